#!/usr/bin/env python3
"""Count and draw the files that dt and x visit in one step of ``march``.

    python3 benchmarks/walk_step.py [--tree PATH] [--json FILE] [--figure FILE]

The body is the wall of the first example of README.md, shaken against ground on its right side.
The step is the one after the first with a closed point, so that all factors are made. Every call of
a function of the package is traced by ``sys.setprofile`` as in ``walk.py``, which says what a
*visit* and a *return* are. A call belongs

- to the walk of dt, when it is handed the length of the step: a number equal to it;
- to the walk of x, when it is handed the unknown of the step or its increment: the array itself, or
  a frozen record of the package that has it as a field, such as an answer or a state.

--json stores the calls; with --figure the calls of this tree are drawn beside those of version
0.2.0, which ``walk_step_0.2.0.json`` holds. That file was made by this program with ``--tree`` on
a clone at the tag 0.2.0 (commit 1ecd1614) and DOLFINx 0.5.2.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import is_dataclass
from itertools import count
from pathlib import Path
from types import FrameType
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
from walk import COMPREHENSIONS, counts

HERE = Path(__file__).resolve().parent
BEFORE = HERE / "walk_step_0.2.0.json"
DT = 1.9531e-3  # [s], a number that nothing else is equal to
WALKS = {"every call": "0.75", "x": "tab:red", "dt": "tab:blue"}  # walk -> colour

Call = tuple[str, str, list[str]]  # file below the package, function, and walks it belongs to


def make_march() -> Any:
    """Return the march of the wall; the package is that of the path."""
    from mpi4py import MPI

    import vi_contact as vc
    from vi_contact import fem
    from vi_contact.meshes.wall import WallMesh

    wall = WallMesh(height=9.0, width=6.0, divisions=(8, 12))
    mesh, tags = fem.build_mesh(wall, MPI.COMM_SELF)
    concrete = vc.LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    system = fem.assemble(
        mesh, concrete, section=vc.PlaneStress(thickness=0.20), clamped=tags["base"]
    )
    ground = vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0))
    problem = vc.ContactProblem(
        system,
        fem.contact_surface(system, tags["face"], obstacle=ground),
        excitation=vc.Harmonic(amplitude=3.0, frequency=14.0, direction=(1.0, 0.0)),
    )
    return vc.march(problem, dt=DT, steps=1000)


def note_step(march: Any, package: Path) -> tuple[list[tuple[str, str, list[Any]]], Any]:
    """Return the calls of the next step with what each is handed, and the report of the step.

    Args:
        march: the steps.
        package: the folder of the package.
    """
    calls: list[tuple[str, str, list[Any]]] = []
    root = f"{package}/"

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        inside = code.co_filename.startswith(root)
        if event != "call" or not inside or code.co_name in COMPREHENSIONS:
            return
        names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        handed = [frame.f_locals.get(name) for name in names]
        calls.append((code.co_filename.removeprefix(root), code.co_name, handed))

    sys.setprofile(note)
    try:
        _, report = next(march)
    finally:
        sys.setprofile(None)
    return calls, report


def has_field(value: Any, arrays: list[Any]) -> bool:
    """Say whether a value is one of the arrays, or a frozen record with one of them as a field."""
    if any(value is array for array in arrays):
        return True
    if not is_dataclass(value) or isinstance(value, type):
        return False
    frozen = value.__dataclass_params__.frozen  # type: ignore[attr-defined]
    fields = getattr(value, "__dict__", {})
    return frozen and any(field is array for field in fields.values() for array in arrays)


def trace_step(tree: Path) -> list[Call]:
    """Return the calls of one step of the package in a tree, each with its walks.

    Args:
        tree: the folder that has the package.
    """
    sys.path.insert(0, str(tree))
    march = make_march()
    for _ in range(200):
        _, report = next(march)
        if report.new.active.any():
            break
    calls, report = note_step(march, tree / "vi_contact")

    # Known when the step is over: x, which is the displacement at the end, and what the solver
    # was asked for, which is x too or its increment.
    unknown = [report.result.x, report.new.u]
    traced: list[Call] = []
    for file, function, handed in calls:
        walks = []
        if any(isinstance(value, float) and value == DT for value in handed):
            walks.append("dt")
        if any(has_field(value, unknown) for value in handed):
            walks.append("x")
        traced.append((file, function, walks))
    return traced


def choose(calls: list[Call], walk: str) -> list[Call]:
    """Return the calls of a walk: of all calls, of dt or of x."""
    return [call for call in calls if walk == "every call" or walk in call[2]]


def count_walks(calls: list[Call]) -> dict[str, dict[str, int]]:
    """Return calls, visits, files and returns of every walk."""
    found = {}
    for walk in WALKS:
        chosen = [(file, function) for file, function, _ in choose(calls, walk)]
        found[walk] = {"calls": len(chosen), **counts(chosen)}
    return found


def draw(panels: dict[str, list[Call]], path: Path) -> None:
    """Draw the walks: the number of the call to the right, the files downwards as they are met.

    Args:
        panels: title of a panel -> its calls.
        path: of the figure.
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(panels), figsize=(15.0, 8.0), layout="constrained")
    for ax, (title, calls) in zip(axes, panels.items(), strict=True):
        rows: dict[str, int] = {}
        for file, _, _ in calls:
            rows.setdefault(file, len(rows))
        for (walk, colour), size in zip(WALKS.items(), (2.0, 7.0, 4.0), strict=True):
            places = [
                (number, rows[file])
                for number, (file, _, walks) in zip(count(1), calls)
                if walk == "every call" or walk in walks
            ]
            visits = count_walks(calls)[walk]
            label = f"{walk}: {visits['calls']} calls, {visits['visits']} visits"
            ax.plot(*zip(*places, strict=True), "o-", color=colour, ms=size, lw=0.8, label=label)
        ax.set_yticks(range(len(rows)), rows, fontsize=8)
        ax.invert_yaxis()
        ax.set(title=title, xlabel="number of the call in the step [-]", ylabel="file")
        ax.grid(alpha=0.2)
        ax.legend(loc="lower left")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def main() -> None:
    """Print the walks of a step, store its calls and draw them if asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--tree", type=Path, default=HERE.parent, help="folder with the package: another clone"
    )
    parser.add_argument("--json", type=Path, help="file for the calls")
    parser.add_argument("--figure", type=Path, help="file for the figure, beside version 0.2.0")
    options = parser.parse_args()
    calls = trace_step(options.tree.resolve())
    for walk, numbers in count_walks(calls).items():
        print(f"{walk}: {numbers}")
    if options.json:
        lines = ",\n".join(json.dumps(call) for call in calls)
        options.json.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    if options.figure:
        before = json.loads(BEFORE.read_text(encoding="utf-8"))
        from vi_contact import __version__

        draw({"version 0.2.0": before, f"version {__version__}": calls}, options.figure)


if __name__ == "__main__":
    main()
