"""Collect what the run of an entry finds, and how well its equations were solved."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.algebra import EffectiveMatrix, total
from ..core.problem import ContactProblem
from ..core.state_checks import initial_state
from ..core.step import State, StepProblem, StepResult
from ..core.verify import kkt_residual
from ..run.solution import Solution


@dataclass
class Found:
    """Collect what the run of an entry finds.

    Attributes:
        figures: name -> value, in the unit that entry.toml says.
        curves: name -> what the picture of the entry draws.
        unknowns: of the largest system that was solved.
        certificate: the worst of all steps and static stages; NaN where none was solved.
        defect: the largest relative energy defect of all runs in time; NaN without one.
    """

    figures: dict[str, float] = field(default_factory=dict)
    curves: dict[str, Any] = field(default_factory=dict)
    unknowns: int = 0
    certificate: float = math.nan
    defect: float = math.nan

    def add_run(self, solution: Solution) -> None:
        """Take the certificate, the energy defect and the unknowns of a run in time."""
        facts: Mapping[str, Any] = solution.facts
        self.unknowns = max(self.unknowns, int(facts["unknowns"]))
        self.certificate = _worse(self.certificate, float(facts["worst_certificate"]))
        if "energy_defect" in facts:
            self.defect = _worse(self.defect, float(facts["energy_defect"]))

    def add_equilibrium(
        self, problem: ContactProblem, state: State, before: State | None = None
    ) -> None:
        """Take the certificate and the unknowns of a static stage. Collective.

        That of a linear body is computed from its answer alone; a body that is not linear has the
        one of its stage.

        Args:
            problem: what stands in equilibrium.
            state: the equilibrium.
            before: the stage before it, from which slips are counted; the initial state when None.
        """
        rows = round(total(problem.surface.comm, problem.system.rows))
        self.unknowns = max(self.unknowns, rows)
        if problem.system.internal is None:
            residual = certify_equilibrium(problem, state, before)
        else:
            residual = math.nan if state.certificate is None else state.certificate
        self.certificate = _worse(self.certificate, residual)


def certify_equilibrium(
    problem: ContactProblem, state: State, before: State | None = None
) -> float:
    """Return the worst residual of a static stage, computed from its answer alone. Collective.

    Args:
        problem: what stands in equilibrium.
        state: the equilibrium.
        before: the stage before it; the initial state when None.
    """
    system = problem.static_load
    old = initial_state(problem, state.t) if before is None else before
    step = StepProblem(
        A=EffectiveMatrix(system.K, system.algebra, space=system.space),
        b=system.load.at_rest(state.t),
        bound=problem.surface.gap(state.t),
        scale=1.0,
        surface=problem.surface,
        guess=old.u,
        active=old.active,
        t=state.t,
        k=state.k,
        friction=problem.friction,
        slip0=problem.slip_origin(old.u, old.t, state.t),
    )
    answer = StepResult(
        x=state.u,
        r_n=state.r_n,
        active=np.asarray(state.active),
        iterations=0,
        method="of the entry",
        r_t=state.r_t,
    )
    return kkt_residual(step, answer).worst


def _worse(one: float, other: float) -> float:
    """Return the larger of two numbers; NaN stands for none."""
    return other if math.isnan(one) else max(one, other)
