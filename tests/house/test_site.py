"""The documentation site is built without a warning, its links lead somewhere, nothing in it comes
from another host.

In headless Chromium, on screens and on telephones: equations are set, pictures are there, the
search finds, nothing is wider than the window or cut and no script
complains. The pages are built without running notebooks, which ``bash docs/build.sh`` does, and as
root without a network.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from report_packages import CHROMIUM_FLAGS, browser

from vi_contact import __version__

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
WANTED, INSTALLED = (
    ROOT / "install" / "site-requirements.txt",
    ROOT / ".venv" / "site" / "installed",
)
if not INSTALLED.is_file() or INSTALLED.read_bytes() != WANTED.read_bytes():
    pytest.skip(
        "the tools of the site are missing: bash install/site.sh brings them",
        allow_module_level=True,
    )

WIDTHS = 1280, 320, 390, 700, 900, 1100  # of windows; on the first one a page is opened
LOADED = {
    "script": "src",
    "img": "src",
    "iframe": "src",
    "source": "src",
    "video": "src",
    "link": "href",
}


class Page(HTMLParser):
    """The anchors of a page, where its links lead, and what it loads."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.sections: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        if tag == "section" and "id" in given:
            self.sections.append(given["id"])
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "meta" and given.get("http-equiv") == "refresh":
            self.links.append(given["content"].partition("url=")[2])
        if tag in LOADED and LOADED[tag] in given:
            self.loaded.append(given[LOADED[tag]])


def without_network() -> list[str]:
    """The words that start a command without any network, where this user may: what is installed
    must suffice."""
    words = ["unshare", "--net"]
    may = (
        os.geteuid() == 0
        and shutil.which(words[0])
        and subprocess.run([*words, "true"], capture_output=True)
    )
    return words if may and may.returncode == 0 else []


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built without a network and without the outputs of notebooks; a warning stops its
    build."""
    folder = tmp_path_factory.mktemp("site") / "site"
    done = subprocess.run(
        [*without_network(), "bash", str(ROOT / "docs" / "build.sh"), "--quick", str(folder)],
        capture_output=True,
        encoding="utf-8",
        timeout=500,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "no warnings" in done.stdout
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html") if "_static" not in path.parts}


def test_every_document_is_a_page(site: Path, pages: dict[Path, Page]) -> None:
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    wanted = {str(path.relative_to(ROOT).with_suffix("")) for path in documents} | {"index"}
    assert wanted - {str(path.relative_to(site).with_suffix("")) for path in pages} == set()


def test_every_page_says_which_version_it_describes(site: Path, pages: dict[Path, Page]) -> None:
    """In the title of the window, above the menu, and at the foot of the page, where telephones
    show it too."""
    for path in pages:
        if path != site / "index.html":  # which leads to the first page
            text = path.read_text(encoding="utf-8")
            assert re.search(
                rf"<title>(?:[^<]* - )?vi_contact {re.escape(__version__)}</title>", text
            ), path
            assert f'<span class="sidebar-brand-text">vi_contact {__version__}</span>' in text, path
            foot = text.partition('<div class="copyright">')[2].partition("</div>")[0]
            assert f"This page describes version {__version__}" in foot, path


def test_every_link_of_the_site_leads_somewhere(pages: dict[Path, Page]) -> None:
    broken = []
    for path, page in pages.items():
        for link in page.links + page.loaded:
            if re.match(r"[a-z]+:", link):
                continue
            target, _, anchor = unquote(link).partition("#")
            there = (path.parent / target.partition("?")[0]).resolve() if target else path
            if not there.is_file() or (
                anchor and there in pages and anchor not in pages[there].anchors
            ):
                broken.append(f"{path.name}: {link}")
    assert broken == []


def test_nothing_is_loaded_from_another_host(site: Path, pages: dict[Path, Page]) -> None:
    """Neither by pages nor by style sheets. Scripts are watched in the browser below."""
    loaded = [one for page in pages.values() for one in page.loaded]
    for sheet in site.rglob("*.css"):
        loaded += re.findall(
            r"(?:url\(|@import\s+)[\"']?([^\"')\s]+)", sheet.read_text(encoding="utf-8")
        )
    assert len(loaded) > 1000
    assert [one for one in loaded if re.match(r"(?:[a-z]+:)?//", one)] == []


@pytest.mark.parametrize("name", ["simulate", "build_mesh", "ZienkiewiczWoodTaylor", "Condensed"])
def test_names_are_in_index_and_search(site: Path, name: str) -> None:
    assert f">{name}" in (site / "genindex.html").read_text(encoding="utf-8")
    assert f'"{name}"' in (site / "searchindex.js").read_text(encoding="utf-8")


def test_names_in_texts_lead_to_their_pages(site: Path) -> None:
    page = (site / "docs" / "guide" / "second_order.html").read_text(encoding="utf-8")
    assert "../reference/names/vi_contact.fem.html#vi_contact.fem.contact_surface" in page


# Opens every page of a list in a frame, makes the frame as wide as the page's widths say one after
# the other, and tells the server what it finds there. A page that leads on is followed.
PROBE = """<!doctype html><link rel="icon" href="data:,"><script>
const list = LIST, wait = (ms) => new Promise((done) => setTimeout(done, ms));
async function until(holds) {  // for half a minute, of which an idle machine needs a fraction of a second
  for (let k = 0; k < 1500 && !holds(); k++) await wait(20);
}
const open = (url, width) => new Promise((done) => {
  const frame = document.createElement("iframe");
  frame.style = `width: ${width}px; height: 800px; border: 0`;
  frame.onload = () => done(frame);
  frame.src = url;
  document.body.append(frame);
});
function scrolls(one, root) {  // whether the reader can move what is too wide, or it is not for the eyes
  for (; one && one !== root; one = one.parentElement) {
    const how = one.ownerDocument.defaultView.getComputedStyle(one);
    if (/auto|scroll/.test(how.overflowX) || how.visibility === "hidden" || how.clip.startsWith("rect(")) return true;
  }
  return false;
}
// not what is inside of equations and of code: these scroll or do not as a whole
const LOOKED = "article *:not(mjx-container *, pre *), .toc-sticky *, .mobile-header *";
function tooWide(page, width) {
  const root = page.documentElement, cut = [];
  for (const one of page.querySelectorAll(LOOKED)) {
    const edge = one.getBoundingClientRect(), inside = edge.left < root.clientWidth && edge.width > 1;
    const beyond = inside && edge.right > root.clientWidth + 1;
    const hides = one.clientWidth > 1 && one.scrollWidth > one.clientWidth + 1 &&
      /hidden|clip/.test(page.defaultView.getComputedStyle(one).overflowX);
    const moves = scrolls(one, root) && !one.closest(".genindextable");  // names are read, not moved
    if ((beyond || hides) && !moves) cut.push(`${one.tagName} ${one.className}`);
  }
  return {width, seen: root.clientWidth, wide: root.scrollWidth - root.clientWidth, cut: cut.slice(0, 4)};
}
async function probe([url, widths]) {
  const frame = await open(url, widths[0]), here = frame.contentWindow;
  const there = () => here.document.readyState === "complete" && here.document.querySelector("body > *");
  await until(there);  // it may have led on
  const page = here.document;
  const found = {url, at: here.location.pathname + here.location.hash, math: page.querySelectorAll(".math").length};
  found.there = !here.location.hash || page.getElementById(here.location.hash.slice(1)) !== null;
  await until(() => page.querySelectorAll("mjx-container").length >= found.math);
  if (url.includes("?q=")) {
    const hits = () => [...page.querySelectorAll("#search-results li a")].map((one) => one.textContent);
    await until(() => hits().length);
    found.hits = hits();
  }
  page.querySelectorAll("img").forEach((one) => one.loading = "eager");
  await Promise.all([...page.images].map((one) => one.decode().catch(() => 0)));
  await page.fonts.ready;
  found.missing = [...page.images].filter((one) => !one.naturalWidth).map((one) => one.src);
  found.set = page.querySelectorAll("mjx-container mjx-math").length;
  found.errors = page.querySelectorAll("mjx-merror").length;
  found.widths = [];
  for (const width of widths) {
    frame.style.width = `${width}px`;
    found.widths.push(tooWide(page, width));
  }
  page.body.dataset.theme = "dark";
  found.ground = here.getComputedStyle(page.body).backgroundColor;
  found.text = here.getComputedStyle(page.querySelector("article p, article h1, body > *")).color;
  const loaded = () => here.performance.getEntriesByType("resource").map((one) => one.name);
  const outside = () => loaded().filter((one) => !one.startsWith(location.origin + "/") && !/^(data|blob):/.test(one));
  await until(() => !url.includes("spoiled") || outside().length >= 4);  // what is refused is listed when it is
  found.loaded = loaded().length;
  found.outside = outside();
  frame.remove();
  return found;
}
onload = async () => {
  const found = [];
  for (const one of list) found.push(await probe(one));
  await fetch("/found", {method: "POST", body: JSON.stringify(found)});
};
</script><body></body>"""

# A page with every fault that is looked for: the probe must see each of them.
SPOILED = """<!doctype html><html><head><style>
@font-face { font-family: far; src: url(https://font.invalid/far.woff2); }
p { font-family: far; color: rgb(20, 20, 20); }
div.picture { background: url(https://style.invalid/far.png); height: 9px; }
</style><script src="https://script.invalid/far.js"></script><script>
fetch("https://fetch.invalid/far.json").catch(() => 0);
</script><script src="absent.js"></script></head><body><article><p>Dark text on nothing.</p><img src="absent.png">
<div class="picture"></div>
<div class="hides" style="overflow: hidden; width: 200px"><div class="inner" style="width: 300px">.</div></div>
<div style="overflow-x: auto"><div class="may" style="width: 2000px">.</div></div>
<section class="clips" style="overflow: hidden"><div class="beyond" style="width: 900px">.</div></section>
</article></body></html>"""


class Server(ThreadingHTTPServer):
    """Serves the site here; ``found`` is what the probing page told."""

    found: list[dict[str, Any]]
    absent: list[str]
    told: threading.Event

    def handle_error(self, *_: object) -> None:
        """Say nothing: the browser ends while a file is on its way."""


class Handler(SimpleHTTPRequestHandler):
    """Files, silently, and what the probing page tells."""

    def do_POST(self) -> None:
        assert isinstance(self.server, Server)
        self.server.found = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        self.server.told.set()

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        assert isinstance(self.server, Server)
        self.server.absent.append(f"{code} {self.path}")
        super().send_error(code, message, explain)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@dataclass(frozen=True)
class Opened:
    """What the browser found on the pages and on the spoiled page; which
    files the server did not have; and what the console said."""

    pages: list[dict[str, Any]]
    spoiled: dict[str, Any]
    absent: list[str]
    said: str


@pytest.fixture(scope="module")
def opened(site: Path, pages: dict[Path, Page], tmp_path_factory: pytest.TempPathFactory) -> Opened:
    """Every page, in windows of several widths; one in many. No other host can
    be reached."""
    command = browser()
    names = sorted(str(path.relative_to(site)) for path in pages)
    urls = [f"/{name}" for name in names if name != "index.html"]
    list_: list[tuple[str, Sequence[int]]] = [(url, WIDTHS) for url in urls]
    list_ += [("/docs/reference/releases.html", range(420, 1900, 40))]
    list_ += [
        (f"/search.html?q={word}", (390,)) for word in ("certificate", "build_mesh", "Signorini")
    ]
    list_ += [("/spoiled.html", (1280, 390))]
    (site / "probe.html").write_text(
        PROBE.replace("LIST", json.dumps([(u, list(w)) for u, w in list_])), "utf-8"
    )
    (site / "spoiled.html").write_text(SPOILED, encoding="utf-8")
    profile, log = tmp_path_factory.mktemp("profile"), tmp_path_factory.mktemp("log") / "log"
    with (
        Server(("127.0.0.1", 0), partial(Handler, directory=str(site))) as server,
        log.open("w") as said,
    ):
        server.found, server.absent, server.told = [], [], threading.Event()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        chromium = subprocess.Popen(
            [
                command,
                *CHROMIUM_FLAGS,
                "--enable-logging=stderr",
                "--remote-debugging-port=0",
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                f"--user-data-dir={profile}",
                f"http://127.0.0.1:{server.server_port}/probe.html",
            ],
            stdout=said,
            stderr=said,
        )
        server.told.wait(500)
        chromium.terminate()
        chromium.wait(300)
        server.shutdown()
    (site / "probe.html").unlink()
    (site / "spoiled.html").unlink()
    shutil.rmtree(profile, ignore_errors=True)
    console = log.read_text(encoding="utf-8", errors="replace")
    assert server.found, console[-3000:]
    *found, spoiled = server.found
    return Opened(found, spoiled, server.absent, console)


def test_the_browser_sees_what_is_wrong(opened: Opened) -> None:
    """Each fault of the page that has them all: what the tests below find to be absent would be
    seen."""
    spoiled = opened.spoiled
    hosts = {re.sub(r"https://(\w+)\.invalid/.*", r"\1", one) for one in spoiled["outside"]}
    assert hosts == {"font", "style", "script", "fetch"}
    assert {"404 /absent.js", "404 /absent.png"} <= set(opened.absent)
    assert [Path(one).name for one in spoiled["missing"]] == ["absent.png"]
    assert [one["cut"] for one in spoiled["widths"]] == [
        ["DIV hides"],
        ["DIV hides", "SECTION clips", "DIV beyond"],
    ]
    assert not dark(spoiled["ground"]) and not light(spoiled["text"])


def test_scripts_do_not_complain(opened: Opened) -> None:
    lines = [line for line in re.findall(r".*CONSOLE.*", opened.said) if "spoiled.html" not in line]
    assert [line for line in lines if re.search(r"rror|ncaught|ailed|refused", line)] == []


def test_equations_are_set_and_pictures_are_there(opened: Opened) -> None:
    assert [
        one["url"]
        for one in opened.pages
        if one["set"] < one["math"] or one["errors"] or one["missing"]
    ] == []


def test_the_browser_asks_no_other_host_and_lacks_no_file(opened: Opened) -> None:
    """Of scripts, styles, fonts, pictures and what scripts fetch."""
    assert [(one["url"], one["outside"]) for one in opened.pages if one["outside"]] == []
    assert min(one["loaded"] for one in opened.pages) >= 5
    assert sorted(one for one in opened.absent if "/absent." not in one) == []


def test_no_page_is_wider_than_the_screen_or_cut(opened: Opened) -> None:
    found = [(one["url"], at) for one in opened.pages for at in one["widths"]]
    assert {at["width"] for _, at in found} >= set(WIDTHS)
    # 20: the bar to scroll with
    assert all(at["width"] - 20 <= at["seen"] <= at["width"] for _, at in found)
    assert [(url, at) for url, at in found if at["wide"] > 0 or at["cut"]] == []


def dark(colour: str) -> bool:
    """Whether a colour of a style is nearly black, and nothing shines through it."""
    numbers = [float(one) for one in re.findall(r"[\d.]+", colour)]
    return max(numbers[:3]) < 60 and (len(numbers) == 3 or numbers[3] == 1.0)


def light(colour: str) -> bool:
    numbers = [float(one) for one in re.findall(r"[\d.]+", colour)]
    return min(numbers[:3]) > 150 and (len(numbers) == 3 or numbers[3] == 1.0)


def test_dark_mode_is_dark(opened: Opened) -> None:
    """Light text on a dark ground, on every page."""
    seen = {(one["ground"], one["text"]) for one in opened.pages}
    assert all(dark(ground) and light(text) for ground, text in seen), seen


def test_search_finds(opened: Opened) -> None:
    hits = {one["url"].partition("?q=")[2]: one["hits"] for one in opened.pages if "hits" in one}
    assert len(hits) == 3 and all(hits.values()), hits
    assert any("build_mesh" in title for title in hits["build_mesh"])
