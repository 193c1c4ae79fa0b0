"""One run of the wall, from options to an output folder with histories, fields and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..algebra import Array
from ..cross_check import CrossChecked
from ..errors import InputError
from ..excitation import Excitation, GroundMotion, Harmonic
from ..fem.fields import XDMF
from ..ground_motion import Record, pga, read_record, resampled, scaled, scaled_to_pga
from ..plotting import plot_certificate, plot_contact, plot_energy, plot_excitation, plot_points
from ..recorders import Contact, Energy, Probe
from ..simulate import Solution, simulate
from ..static import static_equilibrium
from ..step import ContactProblem, ImpactLaw, Solver, State
from ..surfaces import ContactSurface
from .choices import SCHEMES, SOLVERS
from .wall import CASES, Wall, WallModel, build

TITLES = {
    "a": "Wall, three possible contact points (Fig. 4)",
    "b": "Wall, eleven possible contact points (Fig. 5)",
    "bilateral": "Wall, eleven points held on the ground",
    "free": "Wall without contact",
    "face": "Wall, whole side in possible contact",
}


@dataclass(frozen=True)
class WallRun:
    """Options of a run. ``motion``: a record file; without one the harmonic of Fig. 3 shakes the wall for 400 steps.

    ``impact`` None: seed 000's inelastic rule for the schemes that seed could have used, none for the others.
    """

    case: str = "a"
    wall: Wall = field(default_factory=Wall)
    motion: str | None = None
    vertical: str | None = None
    units: str | None = None
    scale: float = 1.0
    pga: float | None = None
    resample: float | None = None
    solver: str = "condensed"
    scheme: str = "zwt"
    impact: ImpactLaw | None = None
    gravity: bool = False
    dt: float | None = None
    steps: int | None = None
    cross_check: bool = False
    fields_every: int = 10
    restart: bool = False

    def __post_init__(self) -> None:
        for name, given, known in (
            ("case", self.case, (*CASES, "face")), ("solver", self.solver, SOLVERS), ("scheme", self.scheme, SCHEMES),
        ):
            if given not in known:
                raise InputError(f"unknown {name} '{given}': choose one of {', '.join(known)}")
        if self.motion is None and self.vertical is None:
            for name, value in (("pga", self.pga), ("units", self.units), ("resample", self.resample)):
                if value is not None:
                    raise InputError(f"{name} speaks of a record: give a motion file too, or leave {name} out")
        if self.fields_every < 0:
            raise InputError(f"fields_every is {self.fields_every}: give a number of steps, or 0 for no fields")


def run_wall(run: WallRun, comm: Any, out: str | Path, *, progress: bool = True) -> Solution:
    """Builds the wall, marches, and writes the run folder ``out``; the solution's summary is for printing."""
    horizontal, vertical = _records(run)
    model = build(run.wall, comm, weight=run.gravity)
    excitation = _excitations(run, model, horizontal, vertical)
    dt = run.dt if run.dt is not None else model.time_step()
    choice = SCHEMES[run.scheme]
    impact = choice.impact if run.impact is None else run.impact
    problem = model.problem(run.case, excitation=excitation, impact=impact, mass=choice.mass)
    solver, checked = _solvers(run)
    solution = simulate(
        problem,
        scheme=choice.scheme,
        solver=solver,
        dt=dt,
        steps=_steps(run, dt, excitation),
        record=(Energy(), Contact(), Probe(model.probes())),
        fields=XDMF(every=run.fields_every) if run.fields_every else None,
        out=out,
        state=_start(run, problem),
        escalation=(SOLVERS["volume-reference"], SOLVERS["hildreth"]),
        cross_check=checked,
        restart=run.restart,
        progress=progress,
    )
    if comm.rank == 0:
        draw(solution.history, run.case, problem.surface, Path(out))
    comm.Barrier()
    return solution


def _records(run: WallRun) -> list[Record | None]:
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


def _excitations(
    run: WallRun, model: WallModel, horizontal: Record | None, vertical: Record | None
) -> Sequence[Excitation]:
    found: list[Excitation] = []
    if horizontal is not None:
        found.append(GroundMotion(horizontal, direction=(1.0, 0.0)))
    if vertical is not None:
        found.append(GroundMotion(vertical, direction=(0.0, 1.0)))
    if not found:
        harmonic: Harmonic = model.harmonic(run.scale)
        found.append(harmonic)
    return found


def _steps(run: WallRun, dt: float, excitation: Sequence[Excitation]) -> int:
    """As asked; else the whole record, or the seed's 400 steps."""
    if run.steps is not None:
        return run.steps
    duration = max(one.duration for one in excitation)
    return 400 if duration == float("inf") or dt <= 0.0 else int(duration / dt) + 1


def _solvers(run: WallRun) -> tuple[Solver, CrossChecked | None]:
    """The solver; with ``cross_check`` the other route accompanies every step."""
    solver = SOLVERS[run.solver]
    if not run.cross_check:
        return solver, None
    other = "condensed" if run.solver.startswith("volume") else "volume-reference"
    checked = CrossChecked(solver, (SOLVERS[other],))
    return checked, checked


def _start(run: WallRun, problem: ContactProblem) -> State | None:
    """The gravity stage with contact active, when the wall has weight."""
    return static_equilibrium(problem, solver=SOLVERS[run.solver]) if run.gravity else None


def draw(
    history: Mapping[str, Array],
    case: str,
    surface: ContactSurface,
    out: Path,
    *,
    title: str | None = None,
    reference: Mapping[str, Array] | None = None,
) -> None:
    """The figures of a run; ``reference``: the history of the linear wall, drawn in grey."""
    contact = [] if case == "free" else [str(number) for number in CASES.get(case, range(1, 13))]
    labels = [name.removeprefix("u_x_") for name in history if name.startswith("u_x_")]
    plot_excitation(history, out / "excitation.png")
    plot_points(
        history, labels, out / "displacements.png",
        title=title or TITLES[case], unilateral=contact, reference=reference,
    )
    plot_energy(history, out / "energy.png")
    plot_certificate(history, out / "certificate.png")
    if surface.count:
        plot_contact(history, out / "contact.png", position=surface.points[:, 1], axis_label="height [m]")
