#!/usr/bin/env python3
"""Measure where the processor time of a run goes: a bar for every size, and a figure.

    python3 benchmarks/run_parts.py [--steps 200] [--figure docs/figures/run_parts.png]
        [--json FILE]

The runs are the wall and the block in space of step_cost.py, without friction. ``simulate`` has its
default records and a run folder; mesh and assembly are not counted. The time of a part is the time
of its functions without the functions of other parts that they call. Matrix products are "products"
whoever asks for them, and the rest of ``simulate`` outside the time loop is "records". The clock
itself takes a microsecond each time a part begins.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from step_cost import SCHEME, block, wall  # first: it sets the number of threads

import vi_contact as vc
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.kernels.contact_last import ContactLast
from vi_contact.run.march import March
from vi_contact.solvers import certified, condensed
from vi_contact.solvers.normal.active_set import ActiveSet, PreparedSets

RUNS = (
    ("wall", wall, 216),
    ("wall", wall, 2e4),
    ("wall", wall, 2e5),
    ("block in space", block, 2e4),
)
PARTS = (
    "set-up",
    "forward",
    "small problem",
    "backward",
    "products",
    "certificate",
    "scheme and loop",
    "records",
)
COLOURS = ("#4d4d4d", "#1f77b4", "#ff7f0e", "#17becf", "#2ca02c", "#9467bd", "#bcbd22", "#d62728")


class Clock:
    """Count the processor time of parts; a part that begins stops the one that called it."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._open = ["records"]
        self._since = time.thread_time()

    def _book(self) -> None:
        now = time.thread_time()
        self.seconds[self._open[-1]] += now - self._since
        self._since = now

    def forget(self) -> None:
        """Begin to count anew, with the parts that are open now."""
        self._book()
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count what happens inside as this part."""
        self._book()
        self._open.append(name)
        try:
            yield
        finally:
            self._book()
            self._open.pop()

    def counted(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, whose time counts as this part."""

        def timed(*given: Any, **named: Any) -> Any:
            with self.part(name):
                return function(*given, **named)

        return timed

    def loop(self, iterate: Callable[[Any], Iterator[Any]]) -> Callable[[Any], Iterator[Any]]:
        """Return the generator of steps, whose own time counts as "scheme and loop"."""

        def steps(march: Any) -> Iterator[Any]:
            inner = iterate(march)
            while True:
                with self.part("scheme and loop"):
                    found = next(inner, None)
                if found is None:
                    return
                yield found

        return steps


@contextmanager
def watched(clock: Clock) -> Iterator[None]:
    """Count the functions that make up the parts, and give them back at the end."""
    places: list[tuple[str, Any, str]] = [
        ("set-up", condensed, "condense"),
        ("set-up", ActiveSet, "prepare"),
        ("set-up", sys.modules["vi_contact.run.stepper"], "make_matrix"),
        ("forward", ContactLast, "forward"),
        ("small problem", PreparedSets, "solve"),
        ("backward", ContactLast, "backward"),
        ("products", PetscMatrix, "__matmul__"),
        ("products", PetscMatrix, "transpose_apply"),
        ("certificate", certified, "kkt_residual"),
    ]
    kept = [(place, name, getattr(place, name)) for _, place, name in places] + [
        (March, "__iter__", March.__iter__)
    ]
    for part, place, name in places:
        setattr(place, name, clock.counted(part, getattr(place, name)))
    March.__iter__ = clock.loop(March.__iter__)  # type: ignore[method-assign]
    try:
        yield
    finally:
        for place, name, function in kept:
            setattr(place, name, function)


def measured(
    name: str, build: Callable[[float, Any], Any], size: float, steps: int
) -> dict[str, Any]:
    """Return the seconds of the parts of one run."""
    clock = Clock()
    with tempfile.TemporaryDirectory() as folder, watched(clock), clock.part("records"):
        problem, dt, _ = build(size, None)

        def run(count: int) -> None:
            vc.simulate(
                problem,
                scheme=SCHEME,
                solver=vc.Condensed(),
                dt=dt,
                steps=count,
                out=folder,
                progress=False,
            )

        run(1)  # what is made but once
        clock.forget()
        run(steps)
    return {
        "problem": name,
        "unknowns": problem.system.rows,
        "points": problem.surface.total,
        "steps": steps,
        "seconds": clock.seconds,
    }


def draw(rows: list[dict[str, Any]], file: Path) -> None:
    """Draw a bar for every run, its parts in percent."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9.0, 0.75 * len(rows) + 1.7), layout="constrained")
    labels = [f"{row['problem']}\n{row['unknowns']:,} unknowns".replace(",", " ") for row in rows]
    left = [0.0] * len(rows)
    for part, colour in zip(PARTS, COLOURS, strict=True):
        shares = [100.0 * row["seconds"][part] / sum(row["seconds"].values()) for row in rows]
        bars = axes.barh(labels, shares, left=left, color=colour, label=part)
        texts = [f"{share:.0f}" if share >= 3.0 else "" for share in shares]
        axes.bar_label(bars, texts, label_type="center", color="white", fontsize=9)
        left = [a + b for a, b in zip(left, shares, strict=True)]
    axes.invert_yaxis()
    axes.set(xlim=(0.0, 100.0), xlabel=f"processor time of a run of {rows[0]['steps']} steps [%]")
    for row, label in zip(rows, labels, strict=True):
        total = sum(row["seconds"].values())
        axes.text(101.0, label, f"{total:.2g} s" if total < 10.0 else f"{total:.0f} s", va="center")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=len(PARTS) // 2, frameon=False)
    figure.savefig(file, dpi=120)


def main() -> None:
    """Print milliseconds a step of every part, and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--figure", type=Path)
    parser.add_argument(
        "--json", type=Path, help="file for all numbers; a file that exists is drawn without a run"
    )
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    if options.json and options.json.exists():
        rows = json.loads(options.json.read_text())
    for name, build, size in () if rows else RUNS:
        rows.append(measured(name, build, size, options.steps))
    for row in rows:
        parts = ", ".join(
            f"{part} {1e3 * seconds / row['steps']:.3g}" for part, seconds in row["seconds"].items()
        )
        print(f"{row['problem']}, {row['unknowns']} unknowns, ms a step: {parts}")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    if options.figure:
        draw(rows, options.figure)


if __name__ == "__main__":
    main()
