"""What the runs of ready models have in common: records, length of the run, solvers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..core.checks import check_word
from ..core.errors import InputError
from ..core.protocols import Excitation, ImpactLaw
from ..core.step import Solver
from ..ground_motion import Record, pga, read_record, resampled, scaled, scaled_to_pga
from ..ground_motion.excitation import GroundMotion
from ..run.cross_check import CrossChecked
from .choices import SCHEMES, SOLVERS


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options by the names of the command line. ``motion``: a record file; without one a harmonic shakes the model.

    ``impact`` None: seed 000's inelastic rule for the schemes that seed could have used, none for the others.
    """

    motion: str | None = None
    vertical: str | None = None
    units: str | None = None
    scale: float = 1.0
    pga: float | None = None
    resample: float | None = None
    solver: str = "condensed"
    scheme: str = "zwt"
    impact: ImpactLaw | None = None
    dt: float | None = None
    steps: int | None = None
    cross_check: bool = False
    fields_every: int = 10
    restart: bool = False
    changed: bool = False


def check_options(run: RunOptions) -> None:
    """InputError for unknown words and for options of a record without one."""
    check_word("solver", run.solver, list(SOLVERS))
    check_word("scheme", run.scheme, list(SCHEMES))
    if run.motion is None and run.vertical is None:
        for name, value in (("pga", run.pga), ("units", run.units), ("resample", run.resample)):
            if value is not None:
                raise InputError(f"{name} speaks of a record: give a motion file too, or leave {name} out")
    if run.fields_every < 0:
        raise InputError(f"fields_every is {run.fields_every}: give a number of steps, or 0 for no fields")


def records(run: RunOptions) -> list[Record | None]:
    """(horizontal, vertical) records in m/s², resampled and scaled as asked; both by the same factor, which brings the
    first one that is given to the wanted peak."""
    raw = [None if path is None else read_record(path, run.units) for path in (run.motion, run.vertical)]
    if run.resample is not None:
        raw = [None if one is None else resampled(one, run.resample) for one in raw]
    first = next((one for one in raw if one is not None), None)
    factor = run.scale
    if run.pga is not None and first is not None:
        factor = pga(scaled_to_pga(first, run.pga)) / pga(first)
    return [None if one is None else scaled(one, factor=factor) for one in raw]


def excitations(shaking: Sequence[Record | None], harmonic: Callable[[], Excitation]) -> list[Excitation]:
    """Horizontal and vertical motion of the records, or the model's own harmonic without any."""
    directions = ((1.0, 0.0), (0.0, 1.0))
    found: list[Excitation] = [
        GroundMotion(record, direction=direction)
        for record, direction in zip(shaking, directions, strict=True)
        if record is not None
    ]
    return found or [harmonic()]


def number_of_steps(run: RunOptions, dt: float, shaking: Sequence[Excitation]) -> int:
    """As asked; else the whole record, or the seed's 400 steps."""
    if run.steps is not None:
        return run.steps
    duration = max(one.duration for one in shaking)
    return 400 if duration == float("inf") or dt <= 0.0 else int(duration / dt) + 1


def solvers(
    run: RunOptions, *, reference: Solver = SOLVERS["volume-reference"]
) -> tuple[Solver, CrossChecked | None]:
    """The solver; with ``cross_check`` the other route accompanies every step: the reference, or the condensed one.

    ``reference``: what "volume-reference" means to a model.
    """
    solver = reference if run.solver == "volume-reference" else SOLVERS[run.solver]
    if not run.cross_check:
        return solver, None
    checked = CrossChecked(solver, (SOLVERS["condensed"] if run.solver.startswith("volume") else reference,))
    return checked, checked
