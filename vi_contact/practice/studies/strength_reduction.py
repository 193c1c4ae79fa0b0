"""Find by how much the strength of soil may fall before a body finds no equilibrium.

c and tan phi of all materials are divided by a factor F, and psi is at most the phi that is left.
The loads act at once on the unstrained body. F grows until no equilibrium is found; the interval
between the last F with one and the first without is then halved until it is narrow enough. Every
equilibrium is certified. Friction at contact and joints are not divided.

Sources: Zienkiewicz, Humpheson and Lewis, Géotechnique 25 (1975) 671-689; Griffiths and Lane,
Géotechnique 49 (1999) 387-403.
"""

import logging
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from ...core.algebra import largest
from ...core.arguments import check_arguments
from ...core.checks import number, provides
from ...core.errors import InputError, StepFailure
from ...core.internal import remembers
from ...core.problem import ContactProblem
from ...core.quantities import Positive
from ...core.step import Solver, State
from ...run.static import quasi_static, static_equilibrium
from ...solvers.certified import TOLERANCE

log = logging.getLogger(__name__)
GROWTH = 1.25  # of F while no interval is known
MOST = 12  # times that F grows or falls
OWNER = "strength_reduction"


@dataclass(frozen=True)
class Trial:
    """Hold what was found at a factor.

    Attributes:
        factor: F.
        displacement: largest displacement of a node [m]; nan where no equilibrium was found.
        certificate: of the equilibrium; nan where none was found.
        reason: why none was found; empty where one was.
    """

    factor: float
    displacement: float
    certificate: float
    reason: str = ""

    @property
    def stands(self) -> bool:
        """Say whether an equilibrium was found."""
        return not self.reason


@dataclass(frozen=True)
class StrengthReduction:
    """Hold the factor of safety of a body that yields.

    Attributes:
        factor: the largest F with an equilibrium.
        failed: the smallest F without one.
        trials: of all F, in their order.
        problem: with the strength over ``factor``.
        state: its equilibrium.
        first: the equilibrium at the smallest F that was tried, from which the mechanism is drawn.
    """

    factor: float
    failed: float
    trials: tuple[Trial, ...]
    problem: ContactProblem
    state: State
    first: State

    def __str__(self) -> str:
        return (
            f"the body stands with its strength over {self.factor:.4g}, and no equilibrium was "
            f"found over {self.failed:.4g}"
        )


@dataclass
class _Search:
    """Hold what is known so far.

    Attributes:
        problem: with its whole strength.
        solver: of the equilibria.
        certificate: tolerance of the certificates.
        trials: so far.
        standing: factor, problem and state of the equilibria, in the order of the search.
    """

    problem: ContactProblem
    solver: Solver | None
    certificate: float
    trials: list[Trial] = field(default_factory=list)
    standing: list[tuple[float, ContactProblem, State]] = field(default_factory=list)

    def stands(self, factor: float) -> bool:
        """Say whether an equilibrium is found at a factor. Collective."""
        weak = weaken(self.problem, factor)
        try:
            state = self._find_state(weak)
        except StepFailure as failure:
            trial = Trial(factor, np.nan, np.nan, str(failure))
        else:
            trial = Trial(factor, _find_largest(weak, state), float(state.certificate or 0.0))
            self.standing.append((factor, weak, state))
        self.trials = [other for other in self.trials if other.factor != factor] + [trial]
        if self.problem.surface.comm.rank == 0:
            found = f"moved by {trial.displacement:.4g} m" if trial.stands else "no equilibrium"
            log.info("strength over %.5g: %s", factor, found)
        return trial.stands

    def _find_state(self, weak: ContactProblem) -> State:
        """Return the equilibrium of a weaker body. Collective.

        The way goes straight from the unstrained body. Where the iterations do not come to an end
        it goes by the displacements at the largest factor so far, in two increments: without
        friction at contact, whose slip would count from there.

        Args:
            weak: the problem.

        Raises:
            StepFailure: neither way has led to an equilibrium.
        """
        try:
            return static_equilibrium(weak, solver=self.solver, tolerance=self.certificate)
        except StepFailure:
            if not self.standing or weak.frictional:
                raise
        _, _, nearest = max(self.standing, key=lambda found: found[0])
        internal: Any = weak.static_load.internal
        begin = replace(nearest, memory=dict(internal.remember(nearest.u)))
        given: dict[str, Any] = {"solver": self.solver, "tolerance": self.certificate}
        return next(iter(quasi_static(weak, [begin.t], state=begin, **given)))


@check_arguments
def strength_reduction(
    problem: Any,
    *,
    comm: Any = None,
    start: Annotated[float, Positive] = 1.0,
    tolerance: Annotated[float, Positive] = 0.01,
    solver: Solver | None = None,
    certificate: Annotated[float, Positive] = TOLERANCE,
) -> StrengthReduction:
    """Return the factor by which c and tan phi may be divided. Collective.

    That no equilibrium is found is no proof that there is none: look at the displacements of the
    trials, which should grow ever faster, and at the mechanism (``plot_strength_reduction``).

    Args:
        problem: whose static loads act, or a case of ``read_case``.
        comm: the ranks of a case; None: all.
        start: the first factor.
        tolerance: (failed - factor)/factor of the answer, at most.
        solver: of the equilibria; Automatic() when None.
        certificate: tolerance of the certificate of every equilibrium, relative.

    Raises:
        InputError: a number that is not above zero; no material yields, or one does not say what
            it is with another strength; no equilibrium at any small factor, or one at every large
            factor.
    """
    if hasattr(problem, "tables"):
        problem = _build_case(problem, comm)
    provides(OWNER, "problem", problem, ("surface", "system"), "give a ContactProblem or a case")
    if not remembers(problem.system.internal):
        raise InputError(
            f"{OWNER}: no material of this body yields, so its strength has no limit: give "
            "fem.assemble a law such as MohrCoulomb"
        )
    search = _Search(problem, solver, certificate)
    low, high = _bracket(search, start)
    while high - low > tolerance * low:
        middle = 0.5 * (low + high)
        if search.stands(middle):
            low = middle
        else:
            high = middle
    ordered = sorted(search.standing, key=lambda found: found[0])
    last = ordered[-1]
    trials = tuple(sorted(search.trials, key=lambda trial: trial.factor))
    return StrengthReduction(low, high, trials, last[1], last[2], ordered[0][2])


def _build_case(case: Any, comm: Any) -> ContactProblem:
    """Return the problem of a case. Collective."""
    from mpi4py import MPI

    problem: ContactProblem = case.problem(MPI.COMM_WORLD if comm is None else comm)
    return problem


def _bracket(search: _Search, start: float) -> tuple[float, float]:
    """Return a factor with an equilibrium and a larger one without. Collective.

    Args:
        search: so far.
        start: the first factor.

    Raises:
        InputError: there is none within ``MOST`` tries.
    """
    low = start
    for _ in range(MOST):
        if search.stands(low):
            break
        low /= GROWTH
    if not search.standing:
        _refuse_weak(search)
    for _ in range(MOST):
        high = low * GROWTH
        if not search.stands(high):
            return low, high
        low = high
    raise InputError(
        f"{OWNER}: the body stands with its strength over {low:.4g} too; leave out what does not "
        "depend on strength, or give a larger start"
    )


def _refuse_weak(search: _Search) -> None:
    """Raise InputError for a body that stands at no factor, with the reason at the smallest."""
    last = search.trials[-1]
    raise InputError(
        f"{OWNER}: no equilibrium was found with {1.0 / last.factor:.4g} times the strength either "
        f"({last.reason}); check loads and supports"
    )


def weaken(problem: ContactProblem, factor: float) -> ContactProblem:
    """Return the problem of a new body whose materials have their strength over a factor.

    Args:
        problem: whose materials yield.
        factor: F > 0, by which c and tan phi are divided.

    Raises:
        InputError: a material does not say what it is with another strength.
    """
    number(OWNER, "factor", factor)
    internal: Any = problem.system.internal
    return replace(problem, system=problem.system.going_on(internal.weaken(factor)))


def _find_largest(problem: ContactProblem, state: State) -> float:
    """Return the largest displacement of a node [m]. Collective."""
    space: Any = problem.system.space
    nodal = space.expand(problem.cartesian(state.u), state.t, 0)
    own = np.max(np.linalg.norm(nodal, axis=1), initial=0.0)
    return float(largest(problem.surface.comm, own))
