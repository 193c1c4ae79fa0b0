"""Compare independent routes to the same step, step by step from the same state.

Whole runs of an energy-growing scheme may drift apart by round-off; single steps from one state must not. Answers of
another method, boundary elements for example, have other steps: ``references`` are compared over the whole run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..core.algebra import EffectiveMatrix, max_abs
from ..core.checks import number, provides, several
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, Scheme, Solver, State, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from .compare_runs import Reference, RunComparison, RunDifference
from .march import march
from .method import check_solver
from .time_steps import TimeSteps

REFERENCE = ("name", "times", "impulse", "mean_towards")


@dataclass
class Disagreement:
    """Hold the largest differences between a solver and the primary one so far, with the largest values they compare
    to.

    ``rubbed``: whether there was friction to compare, in one of the ``steps``.
    """

    method: str = ""
    x: float = 0.0
    r_n: float = 0.0
    r_t: float = 0.0
    x_ref: float = 0.0
    r_ref: float = 0.0
    t_ref: float = 0.0
    rubbed: bool = False
    iterations: int = 0
    steps: int = 0

    @property
    def relative_u(self) -> float:
        """Return max |x - x'| / max |x| over all unknowns and steps."""
        return self.x / self.x_ref if self.x_ref else self.x

    @property
    def relative_r_n(self) -> float:
        """Return max |r_n - r_n'| / max |r_n| over all conditions and steps."""
        return self.r_n / self.r_ref if self.r_ref else self.r_n

    @property
    def relative_r_t(self) -> float:
        """Return max |r_t - r_t'| / max |r_t| over all conditions and steps; 0 without friction."""
        return self.r_t / self.t_ref if self.t_ref else self.r_t

    @property
    def worst(self) -> float:
        """Return the largest of them."""
        return max(self.relative_u, self.relative_r_n, self.relative_r_t)


@dataclass
class CrossChecked:
    """Solve by one solver, ask others at every step too, and remember how far they are off; the first one's answer
    counts.

    ``found`` does not count attempts that ``HalvedAtImpact`` threw away; ``differences``: what ``cross_check`` found
    about answers of other methods.
    """

    primary: Solver
    others: Sequence[Solver]
    found: list[Disagreement] = field(default_factory=list)
    differences: list[RunDifference] = field(default_factory=list)

    def __post_init__(self) -> None:
        check_solver("CrossChecked", self.primary, "the first solver")
        for one in several("CrossChecked", "others", self.others, "give a list of solvers"):
            check_solver("CrossChecked", one, "a solver")
        self.found = [Disagreement() for _ in self.others]
        self._earlier, self._last = self.found, (-1, 0.0)

    def begin(self, step: StepProblem) -> None:
        """Forget the attempt before when this one is of the same step but shorter: that was thrown away."""
        k, t = self._last
        if step.k == k and step.t < t:
            self.found = self._earlier
        self._earlier, self._last = [replace(one) for one in self.found], (step.k, step.t)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless every solver can take the problem."""
        for solver in (self.primary, *self.others):
            solver.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedCrossCheck:
        """Return all solvers prepared on the same matrix."""
        return PreparedCrossCheck(self, A, surface, scale)

    def report(self) -> Mapping[str, Mapping[str, float]]:
        """Return, by method, relative differences in u, r_n and, with friction, r_t, iterations per step: what
        summary.json shows. A name that comes again gets a number. Opinions: impulse and mean displacement over the
        whole run."""
        names = [one.method for one in self.found]
        return {
            name if names.count(name) == 1 else f"{name} #{rank}": {"u": one.relative_u, "r_n": one.relative_r_n}
            | ({"r_t": one.relative_r_t} if one.rubbed else {})
            | {"iterations_per_step": one.iterations / max(one.steps, 1)}
            for rank, (name, one) in enumerate(zip(names, self.found, strict=True), start=1)
        } | {one.name: {"impulse": one.impulse, "towards": one.towards} for one in self.differences}

    @property
    def worst(self) -> float:
        """Return the largest relative difference of any solver in u, r_n or r_t, step by step; not of references."""
        return max((one.worst for one in self.found), default=0.0)


class PreparedCrossCheck:
    """Solve the steps of one matrix by all the solvers; see CrossChecked."""

    def __init__(self, settings: CrossChecked, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> None:
        self._settings, self._surface = settings, surface
        self._primary: PreparedSolver = settings.primary.prepare(A, surface, scale)
        self._others: list[PreparedSolver] = [solver.prepare(A, surface, scale) for solver in settings.others]

    def solve(self, step: StepProblem) -> StepResult:
        result = self._primary.solve(step)
        self._settings.begin(step)
        for solver, found in zip(self._others, self._settings.found, strict=True):
            self._compare(result, solver.solve(step), found)
        return result

    def _compare(self, result: StepResult, other: StepResult, found: Disagreement) -> None:
        dx, x_ref = self._surface.comm.max(np.array([max_abs(other.x - result.x), max_abs(result.x)]))
        found.method = other.method
        found.x, found.x_ref = max(found.x, dx), max(found.x_ref, x_ref)
        found.r_n = max(found.r_n, max_abs(other.r_n - result.r_n))
        found.r_ref = max(found.r_ref, max_abs(result.r_n))
        if result.r_t is not None:
            rubbed = np.zeros_like(result.r_t) if other.r_t is None else other.r_t
            found.rubbed = True
            found.r_t = max(found.r_t, max_abs((rubbed - result.r_t).ravel()))
            found.t_ref = max(found.t_ref, max_abs(result.r_t.ravel()))
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
    references: Sequence[Reference] = (),
    bound: float = 0.02,
) -> CrossChecked:
    """March with the first solver and compare the others with it at every step; see ``worst`` and ``report()``.

    ``dt`` and ``steps`` as in ``march``: ``steps`` counts base steps, the statistics all accepted ones.
    ``references``: answers of other methods to the same problem, for example a ``bem.ContactRun`` of a uniform body;
    impulses and mean displacements are compared over the whole run and should agree within ``bound``, relative.
    """
    given = several("cross_check", "solvers", solvers, "give a list of two or more solvers")
    if len(given) < (1 if references else 2):
        raise InputError(f"cross_check: {len(given)} solvers; give two or more to compare")
    for one in several("cross_check", "references", references, "give a list of answers of other methods"):
        provides("cross_check", "a reference", one, REFERENCE, "give a bem.ContactRun, for example")
    number("cross_check", "bound", bound, positive=True)
    checked, whole = CrossChecked(solvers[0], tuple(solvers[1:])), RunComparison()
    for _, report in march(problem, scheme=scheme, solver=checked, dt=dt, steps=steps, state=state):
        if references:
            whole.add(report)
    checked.differences = [whole.compare(reference, bound) for reference in references]
    return checked
