"""Compare independent routes to the same step, step by step from the same state.

Whole runs of an energy-growing scheme may drift apart by round-off; single steps from one state must not. Answers of
another method, boundary elements for example, have steps and points of their own, so what is compared with
``references`` are resultants over the whole run: the impulse of the contact forces on the body and the mean
displacement of its contact boundary towards the support.
"""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, largest, max_abs
from ..core.checks import number, provides, several
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, Report, Scheme, Solver, State, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from .march import march
from .method import check_solver
from .time_steps import TimeSteps

REFERENCE = ("name", "times", "impulse", "mean_towards")


class Reference(Protocol):
    """Give another answer to the same problem, from the same initial time on; in the plane per metre of thickness."""

    @property
    def name(self) -> str: ...
    @property
    def times(self) -> Array:
        """Return (k,) [s], increasing."""

    @property
    def impulse(self) -> Array:
        """Return (k, d) of the contact forces of the support on the body up to each time [N s]."""

    @property
    def mean_towards(self) -> Array:
        """Return (k,) displacement towards the support at each time, mean over the contact boundary [m]."""


@dataclass(frozen=True)
class RunDifference:
    """Hold the largest differences between a run and a reference over their common times, relative.

    Impulses over the largest one, mean displacements over the largest of any point; ``bound``: up to which they agree.
    """

    name: str
    impulse: float
    towards: float
    bound: float

    @property
    def worst(self) -> float:
        """Return the larger of them."""
        return max(self.impulse, self.towards)

    @property
    def agrees(self) -> bool:
        """Say whether both are within the bound."""
        return self.worst <= self.bound


@dataclass
class RunComparison:
    """Collect the resultants of a march, report by report, and compare them."""

    times: list[float] = field(default_factory=list)
    impulse: list[Array] = field(default_factory=list)
    towards: list[float] = field(default_factory=list)
    largest: float = 0.0

    def add(self, report: Report) -> None:
        """Add one more step. Collective."""
        surface, system, mean = report.problem.surface, report.problem.system, report.balance
        load = surface.reaction_load(mean.r_n, system.rows, mean.r_t)
        force = 0.0 - surface.comm.sum(system.influence.T @ surface.along_axes(load))  # on the body [N]
        if not self.times:
            self._note(surface, report.old, np.zeros_like(force))
        self._note(surface, report.new, self.impulse[-1] + (report.new.t - report.old.t) * force)
        self.largest = max(self.largest, largest(surface.comm, max_abs(report.new.u)))

    def _note(self, surface: ContactSurface, state: State, impulse: Array) -> None:
        self.times.append(state.t)
        self.impulse.append(impulse)
        moments = surface.weights @ surface.normal_values(state.u), surface.weights.sum()
        moved, size = surface.comm.sum(np.array(moments))
        self.towards.append(float(moved / size))

    def compare(self, reference: Reference, bound: float) -> RunDifference:
        """Return the differences. InputError for a reference in other dimensions, without common times, or with NaN."""
        mine, theirs = np.array(self.impulse), np.asarray(reference.impulse, float)
        t = np.asarray(reference.times, float)
        common = (t >= self.times[0]) & (t <= self.times[-1] * (1.0 + 1e-12))
        if theirs.shape != (len(t), mine.shape[1]) or not common.any() or not np.isfinite(theirs).all():
            raise InputError(f"{reference.name}: impulses of shape {theirs.shape}, {common.sum()} common times; give "
                             f"finite ones, {mine.shape[1]} components each, at times of the run")
        at = np.array([np.interp(t[common], self.times, column) for column in mine.T]).T
        off = float(np.linalg.norm(at - theirs[common], axis=1).max())
        size = float(np.linalg.norm(theirs[common], axis=1).max())
        away = max_abs(np.interp(t[common], self.times, self.towards) - np.asarray(reference.mean_towards)[common])
        return RunDifference(reference.name, off / (size or 1.0), away / (self.largest or 1.0), bound)


@dataclass
class Disagreement:
    """Hold how far the answers of a solver are off those of the primary one so far: of u, r_n and, in steps with
    friction, r_t the largest difference ``off`` and the largest value ``size``."""

    method: str = ""
    off: dict[str, float] = field(default_factory=lambda: {"u": 0.0, "r_n": 0.0})
    size: dict[str, float] = field(default_factory=lambda: {"u": 0.0, "r_n": 0.0})
    iterations: int = 0
    steps: int = 0

    @property
    def relative(self) -> dict[str, float]:
        """Return max |x - x'| / max |x| over all components and steps, by name; max |x - x'| where x is zero."""
        return {name: off / (self.size[name] or 1.0) for name, off in self.off.items()}

    @property
    def worst(self) -> float:
        """Return the largest of them."""
        return max(self.relative.values())


@dataclass
class CrossChecked:
    """Solve by one solver, whose answer counts, ask others at every step too, and remember how far they are off.

    ``found``: without attempts that ``HalvedAtImpact`` threw away; ``differences``: from references of ``cross_check``
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
        self._earlier, self._last = deepcopy(self.found), (step.k, step.t)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless every solver can take the problem."""
        for solver in (self.primary, *self.others):
            solver.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> "PreparedCrossCheck":
        """Return all solvers prepared on the same matrix."""
        solvers = [solver.prepare(A, surface, scale) for solver in (self.primary, *self.others)]
        return PreparedCrossCheck(self, solvers, surface)

    def report(self) -> Mapping[str, Mapping[str, float]]:
        """Return, by method, relative differences in u, r_n and, with friction, r_t, iterations per step: what
        summary.json shows. A name that comes again gets a number. Opinions: of the whole run."""
        names = [one.method for one in self.found]
        return {
            name if names.count(name) == 1 else f"{name} #{rank}":
            one.relative | {"iterations_per_step": one.iterations / max(one.steps, 1)}
            for rank, (name, one) in enumerate(zip(names, self.found, strict=True), start=1)
        } | {one.name: {"impulse": one.impulse, "towards": one.towards} for one in self.differences}

    @property
    def worst(self) -> float:
        """Return the largest relative difference of any solver in u, r_n or r_t, step by step; not of references."""
        return max((one.worst for one in self.found), default=0.0)


@dataclass(frozen=True)
class PreparedCrossCheck:
    """Solve the steps of one matrix by all the solvers, the primary one first; see CrossChecked."""

    settings: CrossChecked
    solvers: Sequence[PreparedSolver]
    surface: ContactSurface

    def solve(self, step: StepProblem) -> StepResult:
        result = self.solvers[0].solve(step)
        self.settings.begin(step)
        for solver, found in zip(self.solvers[1:], self.settings.found, strict=True):
            self._compare(result, solver.solve(step), found)
        return result

    def _compare(self, result: StepResult, other: StepResult, found: Disagreement) -> None:
        pairs = {"u": (other.x, result.x), "r_n": (other.r_n, result.r_n)}
        if result.r_t is not None:
            pairs["r_t"] = (np.zeros_like(result.r_t) if other.r_t is None else other.r_t, result.r_t)
        sizes = np.array([[max_abs((its - own).ravel()), max_abs(own.ravel())] for its, own in pairs.values()])
        for name, (off, size) in zip(pairs, self.surface.comm.max(sizes).tolist(), strict=True):
            found.off[name], found.size[name] = max(found.off.get(name, 0.0), off), max(found.size.get(name, 0.0), size)
        found.method = other.method
        found.iterations += other.iterations
        found.steps += 1


def cross_check(
    problem: ContactProblem, *, scheme: Scheme | None = None, solvers: Sequence[Solver], dt: TimeSteps, steps: int,
    state: State | None = None, references: Sequence[Reference] = (), bound: float = 0.02,
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
