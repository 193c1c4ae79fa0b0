"""Run notebooks of this folder as plain programs, without Jupyter.

python3 docs/notebooks/run.py bouncing_bar            its cells in order; pictures into results/notebooks
python3 docs/notebooks/run.py --figures               all of them, and one picture of each into docs/figures
python3 docs/notebooks/run.py --site build/site       runs none; the site, which has run them, shows these pictures
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import sys
import time
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
NAMES = (
    "bouncing_bar",
    "obstacle_membrane",
    "signorini_square",
    "shaken_wall",
    "own_scheme",
    "bad_mesh",
)
# number of the picture in docs/figures
SHOWN = {
    "bouncing_bar": 3,
    "obstacle_membrane": 1,
    "signorini_square": 2,
    "shaken_wall": 2,
    "own_scheme": 1,
    "bad_mesh": 1,
}


def cells(name: str) -> list[str]:
    """Return the code cells of a notebook, without their options."""
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    found = re.findall(r"^```\{code-cell\} ipython3\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [re.sub(r"\A(?::.*\n)+", "", cell) for cell in found]


def run(name: str, out: Path) -> None:
    """Run the cells of a notebook as one program, and save each picture that it shows in
    ``out``."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    numbers = iter(range(1, 100))

    def show() -> None:
        for figure in map(pyplot.figure, pyplot.get_fignums()):
            figure.savefig(out / f"{name}_{next(numbers)}.png", dpi=80)
        pyplot.close("all")

    pyplot.show = show
    here, began = Path.cwd(), time.process_time()
    try:
        # programs of this clone
        exec(compile("\n".join(cells(name)), name, "exec"), {"__name__": "__main__"})
    finally:
        os.chdir(here)
    show()
    print(f"{name}: {time.process_time() - began:.1f} s of processor time, pictures in {out}\n")


def show_in(site: Path) -> None:
    """Put one picture of each notebook page of the built site into the place of the stored one."""
    for name in NAMES:
        page = (site / "docs" / "notebooks" / f"{name}.html").read_text(encoding="utf-8")
        pictures = re.findall(r'src="\.\./\.\./_images/([0-9a-f]+\.png)"', page)
        if len(pictures) < SHOWN[name]:
            raise SystemExit(
                f"{name}: its page has {len(pictures)} pictures, and number {SHOWN[name]} is wanted"
            )
        shutil.copyfile(
            site / "_images" / pictures[SHOWN[name] - 1], site / "_images" / f"notebook_{name}.png"
        )


def main() -> None:
    """Run those that are named, or all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"one of {', '.join(NAMES)}; all when left out"
    )
    parser.add_argument(
        "--out", type=Path, default=ROOT / "results" / "notebooks", help="where pictures go"
    )
    parser.add_argument(
        "--figures", action="store_true", help="one picture of each into docs/figures too"
    )
    parser.add_argument(
        "--site", type=Path, metavar="DIR", help="a built site: run none, show their pictures there"
    )
    given = parser.parse_args()
    if given.site:
        return show_in(given.site)
    if unknown := set(given.names) - set(NAMES):
        parser.error(f"there is no notebook {min(unknown)}: give one of {', '.join(NAMES)}")
    sys.path.insert(0, str(ROOT))
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for name in given.names or NAMES:
        run(name, out)
        if given.figures:
            shutil.copy(
                out / f"{name}_{SHOWN[name]}.png",
                ROOT / "docs" / "figures" / f"notebook_{name}.png",
            )


if __name__ == "__main__":
    main()
