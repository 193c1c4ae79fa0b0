"""Run the Timoshenko beam that rubs with its tip on a wall, from the values of a case file's table [beam]."""

import io
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np

from ...beam.algorithm import BeamRun, BeamStepper, Snapshot, run_beam
from ...beam.contract import rod_forces
from ...beam.elements import Elements
from ...beam.source_data import Force, published_elements, published_mu, published_start, readings
from ...beam.tip import ExactFriction, RegularisedFriction
from ...beam.values import Rod, TimoshenkoBeam
from ...core.checks import check_word, counted
from ...core.errors import InputError
from ...core.files import write_atomically
from ...plots.studies import plot_beam_energies, plot_shapes, plot_tips

HISTORY, SHAPES = "history.csv", "shapes.npz"


@dataclass(frozen=True)
class BeamStudy(TimoshenkoBeam):
    """Hold data of the beam in SI units, by default those of the source (docs/theory/beam.md).

    Normal force: a ``reading`` of the source's, "A", "B", "C" (default) or "none"; or ``force``, constant [N]; or
    ``rod``: that of the beam as a rod under so many N/m along it, with ``gap`` to the wall [m]. mu: a constant
    coefficient, by default slip rate/100. exact: the friction inequality in place of its regularisation with ``eps``
    [m per step]. free_end: a tip that may turn and shear without locking, not the source's last rotation function.
    """

    viscosity: float = 0.001
    reading: str | None = None
    force: float | None = None
    rod: float | None = None
    gap: float = 0.05
    mu: float | None = None
    eps: float = 0.002
    exact: bool = False
    elements: int = 1000
    free_end: bool = False
    dt: float = 0.002
    t_end: float = 2.0

    def __post_init__(self) -> None:
        if self.rod is None:  # whose force is a run of its own
            _ = self.stepper

    @cached_property
    def stepper(self) -> BeamStepper:
        """Return the beam with its force and its friction; InputError for numbers out of range."""
        beam = TimoshenkoBeam(*(getattr(self, one.name) for one in fields(TimoshenkoBeam)))
        counted("beam", f"elements {self.elements}", self.elements, "elements", most=100_000)
        elements = Elements(self.elements) if self.free_end else published_elements(self.elements)
        law = ExactFriction() if self.exact else RegularisedFriction(self.eps)
        if not self.dt > 0.0 or not self.t_end >= self.dt:
            raise InputError(f"dt is {self.dt:g} s and t_end {self.t_end:g} s: give 0 < dt <= t_end")
        counted("beam", f"t_end {self.t_end:g} at dt {self.dt:g}", self.t_end / self.dt, "steps")
        constant = self.mu
        mu = published_mu if constant is None else lambda t, rate: constant
        return BeamStepper(beam, elements, self.dt, self._force(elements), mu, law)

    @property
    def steps(self) -> int:
        """Return the number of steps."""
        return round(self.t_end / self.dt)

    def _force(self, elements: Elements) -> Force:
        """Return t -> |r_N| [N]."""
        given = [name for name in ("reading", "force", "rod") if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(f"{' and '.join(given)} are normal forces: give one of them")
        constant = self.force
        if constant is not None:
            return lambda t: constant
        if self.rod is not None:
            load = self.rod
            rod = Rod(self.length, self.rho, self.area, self.E, viscosity=self.viscosity, gap=self.gap,
                      body_force=lambda t: load)
            return rod_forces(rod, elements, dt=self.dt, steps=self.steps)
        known, name = readings(self.dt), self.reading or "C"
        check_word("reading", name, list(known))
        return known[name]

    def run(self, folder: Path) -> str:
        """Write the history and the shapes of the beam into the folder; return the summary."""
        run = run_beam(self.stepper, published_start(), steps=self.steps, every=max(1, self.steps // 100))
        run.save(folder / HISTORY)
        shapes = io.BytesIO()
        np.savez(shapes, x=run.x, t=[one.t for one in run.snapshots], values=[one.values for one in run.snapshots])
        write_atomically(folder / SHAPES, shapes.getvalue())
        return run.summary()

    def draw(self, folder: Path) -> list[Path]:
        """Draw energies, motion of the tip and shapes from the files of a run."""
        run = read_beam_run(folder)
        end = float(run.history["t"][-1])
        return [
            plot_beam_energies({"beam": run}, folder / "energy.png", title="Energy of the beam"),
            plot_tips({"tip": run}, folder / "tip.png", title="Motion of the tip"),
            plot_shapes(run, folder / "shapes.png", span=(0.0, end), title="The beam"),
        ]


def read_beam_run(folder: Path) -> BeamRun:
    """Return the run that ``BeamStudy.run`` wrote. InputError for missing or damaged files."""
    try:
        with open(folder / HISTORY, encoding="utf-8") as file:
            names = file.readline().strip().split(",")
            columns = np.loadtxt(file, delimiter=",", ndmin=2).T
        history = dict(zip(names, columns, strict=True))
        with np.load(folder / SHAPES) as saved:
            shapes = [Snapshot(float(t), values) for t, values in zip(saved["t"], saved["values"], strict=True)]
            return BeamRun(saved["x"], history, tuple(shapes))
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise InputError(f"a file of the beam's run in '{folder}' is missing or damaged ({error}): run it again"
                         ) from error
