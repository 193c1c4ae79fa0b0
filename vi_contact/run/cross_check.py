"""Compare independent routes to the same step, step by step from the same state.

Whole runs of an energy-growing scheme may drift apart by round-off; single steps from one state
must not.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field

import numpy as np

from ..core.algebra import EffectiveMatrix, max_abs
from ..core.checks import several
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, Scheme, Solver, State, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from .march import march
from .method import check_solver
from .time_steps import TimeSteps


@dataclass
class Disagreement:
    """Hold how far the answers of a solver are off those of the primary one so far.

    This is, of u, r_n and, in steps with friction, r_t, the largest difference ``off`` and the
    largest value ``size``.
    """

    method: str = ""
    off: dict[str, float] = field(default_factory=lambda: {"u": 0.0, "r_n": 0.0})
    size: dict[str, float] = field(default_factory=lambda: {"u": 0.0, "r_n": 0.0})
    iterations: int = 0
    steps: int = 0

    @property
    def relative(self) -> dict[str, float]:
        """Return max |x - x'| / max |x| over all components and steps, by name.

        It is max |x - x'| where x is zero.
        """
        return {name: off / (self.size[name] or 1.0) for name, off in self.off.items()}

    @property
    def worst(self) -> float:
        """Return the largest of them."""
        return max(self.relative.values())


@dataclass
class CrossChecked:
    """Solve by one solver, whose answer counts, and ask others at every step too.

    How far they are off is remembered.

    ``found``: without attempts that ``HalvedAtImpact`` threw away.
    """

    primary: Solver
    others: Sequence[Solver]
    found: list[Disagreement] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_solver("CrossChecked", self.primary, "the first solver")
        for one in several("CrossChecked", "others", self.others, "give a list of solvers"):
            check_solver("CrossChecked", one, "a solver")
        if not len(self.others):
            raise InputError(
                "CrossChecked: others names no solver, so that nothing is compared; give one or "
                "more, or the first solver alone"
            )
        self.found = [Disagreement() for _ in self.others]
        self._earlier, self._last = self.found, (-1, 0.0)

    def begin(self, step: StepProblem) -> None:
        """Forget the attempt before when this one is of the same step but shorter.

        The longer one was thrown away.
        """
        k, t = self._last
        if step.k == k and step.t < t:
            self.found = self._earlier
        self._earlier, self._last = deepcopy(self.found), (step.k, step.t)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless every solver can take the problem."""
        for solver in (self.primary, *self.others):
            solver.check(problem)

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedCrossCheck":
        """Return all solvers prepared on the same matrix."""
        solvers = [solver.prepare(A, surface, scale) for solver in (self.primary, *self.others)]
        return PreparedCrossCheck(self, solvers, surface)

    def report(self) -> Mapping[str, Mapping[str, float]]:
        """Return, by method, relative differences and iterations per step.

        The differences are in u, r_n and, with friction, r_t. This is what summary.json shows. A
        name that comes again gets a number.
        """
        names = [one.method for one in self.found]
        return {
            name if names.count(name) == 1 else f"{name} #{rank}": one.relative
            | {"iterations_per_step": one.iterations / max(one.steps, 1)}
            for rank, (name, one) in enumerate(zip(names, self.found, strict=True), start=1)
        }

    @property
    def worst(self) -> float:
        """Return the largest relative difference of any solver in u, r_n or r_t, step by step."""
        return max((one.worst for one in self.found), default=0.0)


@dataclass(frozen=True)
class PreparedCrossCheck:
    """Solve the steps of one matrix by all the solvers, the primary one first; see CrossChecked."""

    settings: CrossChecked
    solvers: Sequence[PreparedSolver]
    surface: ContactSurface

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer of the first solver; compare those of the others with it."""
        result = self.solvers[0].solve(step)
        self.settings.begin(step)
        for solver, found in zip(self.solvers[1:], self.settings.found, strict=True):
            self._compare(result, solver.solve(step), found)
        return result

    def _compare(self, result: StepResult, other: StepResult, found: Disagreement) -> None:
        pairs = {"u": (other.x, result.x), "r_n": (other.r_n, result.r_n)}
        if result.r_t is not None:
            pairs["r_t"] = (
                np.zeros_like(result.r_t) if other.r_t is None else other.r_t,
                result.r_t,
            )
        sizes = np.array(
            [[max_abs((its - own).ravel()), max_abs(own.ravel())] for its, own in pairs.values()]
        )
        for name, (off, size) in zip(pairs, self.surface.comm.max(sizes).tolist(), strict=True):
            found.off[name], found.size[name] = (
                max(found.off.get(name, 0.0), off),
                max(found.size.get(name, 0.0), size),
            )
        found.method = other.method
        found.iterations += other.iterations
        found.steps += 1


def cross_check(
    problem: ContactProblem,
    *,
    scheme: Scheme | None = None,
    solvers: Sequence[Solver],
    dt: TimeSteps,
    steps: int,
    state: State | None = None,
) -> CrossChecked:
    """March with the first solver and compare the others with it at every step.

    ``report()`` of the result tells.

    ``dt`` and ``steps`` as in ``march``: ``steps`` counts base steps, the statistics all accepted
    ones.
    """
    given = several("cross_check", "solvers", solvers, "give a list of two or more solvers")
    if len(given) < 2:
        raise InputError(f"cross_check: {len(given)} solvers are given; give two or more")
    checked = CrossChecked(solvers[0], tuple(solvers[1:]))
    for _ in march(problem, scheme=scheme, solver=checked, dt=dt, steps=steps, state=state):
        pass
    return checked
