"""Find where a run starts: the equilibrium of a static (gravity) stage with contact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.algebra import EffectiveMatrix
from ..core.checks import number
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, initial_state
from ..core.step import Solver, State, StepProblem, StepResult
from ..solvers.certified import TOLERANCE, CertifiedSolver, refuse_nan
from ..solvers.condensed import Condensed
from .method import check_methods
from .proximal import Proximal

ADVICE = "try another solver, or smaller load steps, and check the data"


def static_equilibrium(
    problem: ContactProblem, *, solver: Solver | None = None, t: float = 0.0, tolerance: float = TOLERANCE
) -> State:
    """Return the gravity stage: K u = f(t) - B_nᵀ r_n - B_tᵀ r_t with contact active, without excitation.

    The state it leaves has v = 0, keeps stresses, reactions and contact set, and is the start of the dynamic stage. A
    body that no prescribed displacement holds is brought to rest on its contacts; free rigid motions that no load
    drives keep the mean position of u0 (see ``proximal``). ``solver`` None is Condensed().

    Raises:
        InputError: the loads drive a rigid motion that nothing stops: there is no equilibrium.
        StepFailure: no answer below the certificate tolerance.
    """
    owner = "static_equilibrium"
    check_problem_given(owner, problem)
    check_methods(owner, solver, (), tolerance)
    t = number(owner, "t", t, unit="s")
    return Equilibria(problem, solver=solver, tolerance=tolerance).after(initial_state(problem, t), t)


class Equilibria:
    """Solve static stages of one problem, with one factorisation for all."""

    def __init__(
        self, problem: ContactProblem, *, solver: Solver | None = None, tolerance: float = TOLERANCE
    ) -> None:
        system, solver = problem.static_load, solver or Condensed()
        self._problem = problem
        self._K = EffectiveMatrix(system.algebra.combine([(1.0, system.K)]), system.algebra)
        self._solve: Callable[[StepProblem], StepResult]
        if system.floating:
            self._solve = Proximal(problem, self._K, solver, tolerance).solve
        else:
            certified = CertifiedSolver(problem, self._K, 1.0, [solver], tolerance, advice=ADVICE)
            self._solve = lambda step: certified.solve(step)[0]

    def after(self, old: State, t: float) -> State:
        """Return the equilibrium at time t, of a body that rubs and slides from where ``old`` left it; numbered as
        ``old``."""
        problem = self._problem
        step = StepProblem(
            A=self._K,
            b=problem.static_load.load.at_rest(t),
            bound=problem.surface.gap(t),
            surface=problem.surface,
            scale=1.0,
            guess=old.u,
            active=old.active,
            t=t,
            k=old.k,
            friction=problem.friction,
            slip0=problem.slip_origin(old.u, old.t, t),
        )
        refuse_nan(step)
        result = self._solve(step)
        return State(t, old.k, result.x, np.zeros_like(old.u), result.r_n, result.active, r_t=result.r_t)
