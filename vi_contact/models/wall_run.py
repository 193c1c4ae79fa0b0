"""One run of the wall, from options to an output folder with histories, fields and figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..core.algebra import Array
from ..core.checks import check_word
from ..core.problem import ContactProblem
from ..core.step import State
from ..core.surfaces import ContactSurface
from ..fem.output.fields import XDMF
from ..plots.histories import plot_certificate, plot_contact, plot_energy, plot_excitation, plot_points
from ..run.recorders import Contact, Energy, Probe
from ..run.simulate import Solution, simulate
from ..run.static import static_equilibrium
from .choices import SCHEMES, SOLVERS
from .run_options import RunOptions, check_options, excitations, number_of_steps, records, solvers
from .wall import BASE_INERTIA, CASES, Wall, build

TITLES = {
    "a": "Wall, three possible contact points (Fig. 4)",
    "b": "Wall, eleven possible contact points (Fig. 5)",
    "bilateral": "Wall, eleven points held on the ground",
    "free": "Wall without contact",
    "face": "Wall, whole side in possible contact",
}


@dataclass(frozen=True)
class WallRun(RunOptions):
    """Options of a run; without a record the harmonic of Fig. 3 shakes the wall for 400 steps.

    base_inertia: a word of BASE_INERTIA; None for ``convention``.
    """

    case: str = "a"
    wall: Wall = field(default_factory=Wall)
    gravity: bool = False
    base_inertia: str | None = None

    def __post_init__(self) -> None:
        check_word("case", self.case, (*CASES, "face"))
        check_word("base inertia", self.convention, list(BASE_INERTIA))
        check_options(self)

    @property
    def convention(self) -> str:
        """The word asked for; else "whole" under a record, and "catalogue" under the harmonic of the figures."""
        if self.base_inertia is not None:
            return self.base_inertia
        return "catalogue" if self.motion is None and self.vertical is None else "whole"


def run_wall(run: WallRun, comm: Any, out: str | Path, *, progress: bool = True) -> Solution:
    """Builds the wall, marches, and writes the run folder ``out``; the solution's summary is for printing."""
    shaking = records(run)  # before anything is computed
    model = build(run.wall, comm, weight=run.gravity, base_inertia=run.convention)
    excitation = excitations(shaking, lambda: model.harmonic(run.scale))
    dt = run.dt if run.dt is not None else model.time_step()
    choice = SCHEMES[run.scheme]
    impact = choice.impact if run.impact is None else run.impact
    problem = model.problem(run.case, excitation=excitation, impact=impact, mass=choice.mass)
    solver, checked = solvers(run)
    solution = simulate(
        problem,
        scheme=choice.scheme,
        solver=solver,
        dt=dt,
        steps=number_of_steps(run, dt, excitation),
        record=(Energy(), Contact(), Probe(model.probes())),
        fields=XDMF(every=run.fields_every) if run.fields_every else None,
        out=out,
        state=_start(run, problem),
        escalation=(SOLVERS["volume-reference"], SOLVERS["hildreth"]),
        cross_check=checked,
        restart=run.restart,
        changed=run.changed,
        progress=progress,
    )
    if comm.rank == 0:
        draw(solution.history, run.case, problem.surface, Path(out))
    comm.Barrier()
    return solution


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
