"""Build the documentation site without a warning, and open its pages in a browser.

Sphinx looks for every link and picture when it builds; the pages are built without running
notebooks, which ``bash docs/build.sh`` does. In headless Chromium, on a screen and on a telephone,
light and dark: equations are set, pictures are there, the search finds, nothing is wider than the
window, and nothing comes from another host.
"""

from __future__ import annotations

import json
import subprocess
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from report_packages import CHROMIUM_FLAGS, browser

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "docs/index.html",
    "docs/gallery/index.html",
    "docs/theory/step.html",
    "search.html?q=build_mesh",
)
WIDTHS = 1280, 390  # of a screen and of a telephone

# Opens each page in a frame, waits until it is whole, and tells the server what it finds there.
PROBE = """<!doctype html><link rel="icon" href="data:,"><script>
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
// waits half a minute at most, of which an idle machine needs a fraction of a second
async function until(holds) {
  for (let k = 0; k < 1500 && !holds(); k++) await wait(20);
}
async function probe(url) {
  const frame = document.createElement("iframe");
  frame.style = "height: 800px; border: 0";
  await new Promise((done) => {
    frame.onload = done;
    frame.src = url;
    document.body.append(frame);
  });
  const here = frame.contentWindow, page = here.document;
  const math = page.querySelectorAll(".math").length;
  const set = () => page.querySelectorAll("mjx-container mjx-math").length;
  const results = () => [...page.querySelectorAll("#search-results li a")];
  const hits = () => results().map((one) => one.textContent);
  await until(() => set() >= math && (hits().length || !url.includes("?q=")));
  page.querySelectorAll("img").forEach((one) => one.loading = "eager");
  await Promise.all([...page.images].map((one) => one.decode().catch(() => 0)));
  const found = {url, math, set: set(), hits: hits(), wide: [], grounds: []};
  found.missing = [...page.images].filter((one) => !one.naturalWidth).map((one) => one.src);
  for (const width of WIDTHS) {
    frame.style.width = `${width}px`;
    found.wide.push(page.documentElement.scrollWidth - page.documentElement.clientWidth);
  }
  for (const theme of ["light", "dark"]) {
    page.body.dataset.theme = theme;
    found.grounds.push(here.getComputedStyle(page.body).backgroundColor.match(/\\d+/g).map(Number));
  }
  const loaded = here.performance.getEntriesByType("resource").map((one) => one.name);
  found.loaded = loaded.length;
  const own = (one) => one.startsWith(location.origin) || /^(data|blob):/.test(one);
  found.outside = loaded.filter((one) => !own(one));
  frame.remove();
  return found;
}
onload = async () => {
  const found = [];
  for (const url of PAGES) found.push(await probe(url));
  await fetch("/found", {method: "POST", body: JSON.stringify(found)});
};
</script><body></body>"""


class Handler(SimpleHTTPRequestHandler):
    """Serve files, silently, and keep what the probing page tells."""

    found: list[dict[str, Any]] = []
    absent: list[str] = []
    told = threading.Event()

    def do_POST(self) -> None:
        """Keep what the page has found, and wake the test that waits for it."""
        self.found.extend(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()
        self.told.set()

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Keep the path of a file that is absent: no page may ask for one."""
        self.absent.append(f"{code} {self.path}")
        super().send_error(code, message, explain)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site without the outputs of notebooks; a warning stops the build."""
    folder = tmp_path_factory.mktemp("site") / "site"
    done = subprocess.run(
        ["bash", str(ROOT / "docs" / "build.sh"), "--quick", str(folder)],
        capture_output=True,
        encoding="utf-8",
        timeout=500,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


@pytest.mark.parametrize("name", ["simulate", "build_mesh", "Condensed"])
def test_names_are_in_index_and_search(site: Path, name: str) -> None:
    """Find a public name in the general index and in the words that the search knows."""
    assert f">{name}" in (site / "genindex.html").read_text(encoding="utf-8")
    assert f'"{name}"' in (site / "searchindex.js").read_text(encoding="utf-8")


def test_pages_open_in_a_browser(site: Path, tmp_path: Path) -> None:
    """Open the pages where no other host can be reached, on wide and on narrow screens."""
    command = browser()
    probe = PROBE.replace("PAGES", json.dumps(PAGES)).replace("WIDTHS", json.dumps(WIDTHS))
    (site / "probe.html").write_text(probe, encoding="utf-8")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(site))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        chromium = subprocess.Popen(
            [
                command,
                *CHROMIUM_FLAGS,
                "--remote-debugging-port=0",
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                f"--user-data-dir={tmp_path}",
                f"http://127.0.0.1:{server.server_port}/probe.html",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        Handler.told.wait(300)
        chromium.terminate()
        chromium.wait(300)
        server.shutdown()
    assert len(Handler.found) == len(PAGES) and Handler.absent == []
    for page in Handler.found:
        assert page["set"] >= page["math"] and page["missing"] == [], page
        assert max(page["wide"]) <= 0 and page["outside"] == [] and page["loaded"] >= 5, page
        light, dark = page["grounds"]
        assert min(light[:3]) > 200 and max(dark[:3]) < 60, page
    assert any("build_mesh" in title for title in Handler.found[-1]["hits"])
    assert any(page["math"] for page in Handler.found)
