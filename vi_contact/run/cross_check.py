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

    Attributes:
        primary: the solver whose answers count.
        others: those that are compared with it.
        found: how far each of the others is off so far, without attempts that ``HalvedAtImpact``
            threw away.
    """

    primary: Solver
    others: Sequence[Solver]
    found: list[Disagreement] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_solver("CrossChecked", self.primary, "the first solver")
        for other in several("CrossChecked", "others", self.others, "give a list of solvers"):
            check_solver("CrossChecked", other, "a solver")
        if not len(self.others):
            raise InputError(
                "CrossChecked: others names no solver, so that nothing is compared; give one or "
                "more, or the first solver alone"
            )
        self.found = [Disagreement() for _ in self.others]
        self._earlier = self.found
        self._last = (-1, 0.0)

    def begin(self, step: StepProblem) -> None:
        """Forget the attempt before when this one is of the same step but shorter.

        The longer one was thrown away.
        """
        k, t = self._last
        if step.k == k and step.t < t:
            self.found = self._earlier
        self._earlier = deepcopy(self.found)
        self._last = (step.k, step.t)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless every solver can take the problem."""
        for solver in (self.primary, *self.others):
            solver.check(problem)

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedCrossCheck":
        """Return all solvers prepared on the same matrix.

        Args:
            A: the effective matrix.
            surface: the contact conditions.
            scale: reactions of the steps are so many times newtons.
        """
        solvers = [solver.prepare(A, surface, scale) for solver in (self.primary, *self.others)]
        return PreparedCrossCheck(self, solvers, surface)

    def report(self) -> Mapping[str, Mapping[str, float]]:
        """Return, by method, relative differences and iterations per step.

        The differences are in u, r_n and, with friction, r_t. This is what summary.json shows. A
        name that comes again gets a number.
        """
        names = [disagreement.method for disagreement in self.found]
        report = {}
        for number, disagreement in enumerate(self.found, start=1):
            name = disagreement.method
            if names.count(name) > 1:
                name = f"{name} #{number}"
            iterations = disagreement.iterations / max(disagreement.steps, 1)
            report[name] = disagreement.relative | {"iterations_per_step": iterations}
        return report

    @property
    def worst(self) -> float:
        """Return the largest relative difference of any solver in u, r_n or r_t, step by step."""
        return max((disagreement.worst for disagreement in self.found), default=0.0)


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
        for solver, disagreement in zip(self.solvers[1:], self.settings.found, strict=True):
            self._compare(step, result, solver.solve(step), disagreement)
        return result

    def _compare(
        self, step: StepProblem, result: StepResult, other: StepResult, disagreement: Disagreement
    ) -> None:
        """Take the differences of two answers to a step into ``disagreement``. Collective.

        Args:
            step: the step.
            result: of the primary solver.
            other: of the solver that is compared with it.
            disagreement: of this solver so far.
        """
        # Differences of u are judged by the size of u, not by that of an increment.
        origin = 0.0 if step.origin is None else step.origin
        pairs = {
            "u": (origin + other.x, origin + result.x),
            "r_n": (other.r_n, result.r_n),
        }
        if result.r_t is not None:
            other_r_t = np.zeros_like(result.r_t) if other.r_t is None else other.r_t
            pairs["r_t"] = (other_r_t, result.r_t)

        # The largest difference and the largest value of all ranks, in one message.
        sizes = [
            [max_abs((other_x - x).ravel()), max_abs(x.ravel())] for other_x, x in pairs.values()
        ]
        everywhere = self.surface.comm.max(np.array(sizes)).tolist()
        for name, (off, size) in zip(pairs, everywhere, strict=True):
            disagreement.off[name] = max(disagreement.off.get(name, 0.0), off)
            disagreement.size[name] = max(disagreement.size.get(name, 0.0), size)
        disagreement.method = other.method
        disagreement.iterations += other.iterations
        disagreement.steps += 1


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

    ``report()`` of the result tells how far they are off; its statistics are of all accepted steps,
    and of every linear step in them where the body is not linear.

    Args:
        problem: as of ``march``.
        scheme: as of ``march``.
        solvers: two or more.
        dt: as of ``march`` [s].
        steps: the number of base steps.
        state: as of ``march``.
    """
    count = len(several("cross_check", "solvers", solvers, "give a list of two or more solvers"))
    if count < 2:
        raise InputError(f"cross_check: {count} solvers are given; give two or more")
    checked = CrossChecked(solvers[0], tuple(solvers[1:]))
    for _ in march(problem, scheme=scheme, solver=checked, dt=dt, steps=steps, state=state):
        pass
    return checked
