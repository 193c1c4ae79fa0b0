"""State THE CONTRACT between time schemes and solvers, and the values that pass between them.

Every time scheme turns a step into the same one-step problem, and every solver solves it:

    A x = b - B_nᵀ r_n - B_tᵀ r_t,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0
    |r_t| <= limit(r_n),    r_t = limit(r_n) slip/|slip| where slip = B_t x - slip0 is not zero

(bilateral rows: equality and r_n of either sign). A is constant as long as dt is, so it is
factorised once. ``r_n`` and ``r_t`` are ``scale`` times the reactions of the step in newtons, those
of the body on its support; ``compliance`` is zero on a rigid support. Vectors are arrays of the
unknowns that this rank owns, in the rotated basis; contact arrays have shape (m,) or, tangential
ones, (m, d - 1), a row for each condition on these unknowns; r_t is None without friction. Branch
on them with ``surface.some``, which asks all ranks: what follows may be collective.

The loop (``run.march``) calls, for every step, in this order:

    scheme.step -> solver.solve -> kkt_residual (core.verify) -> scheme.finish -> the impact law,
    scheme.jump

and ``scheme.effective_matrix`` and ``solver.prepare`` once for every dt. Below n are the unknowns
this rank owns, m its contact conditions, d the dimensions. ``problem.equations`` is the system to
march: in the rotated basis, with mass law and excitations in it; ``problem.surface`` are its
contact conditions. Arrays that come in are read, never written to.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from .algebra import Array, EffectiveMatrix, Mask
from .certificate import Certificate
from .checks import at, on_all, shown
from .errors import InputError, ViContactError
from .problem import ContactProblem
from .protocols import FrictionLaw, Frictionless, MassLaw
from .surfaces import ContactSurface


@dataclass(frozen=True)
class State:
    """Hold displacement u, velocity v and contact at time t = t_k [s].

    Both are vectors (n,), in [m] and [m/s], in the rotated basis.

    ``r_n`` (m,), ``r_t`` (m, d - 1) [N] are the reactions of the step that led here, mean or end
    values as the scheme says. ``active`` (m,) are the closed conditions. ``memory`` holds what a
    scheme carries besides u and v: vectors (n,), and arrays that are the same on every rank.
    """

    t: float
    k: int
    u: Array
    v: Array
    r_n: Array
    active: Mask
    memory: Mapping[str, Array] = field(default_factory=dict)
    r_t: Array | None = None

    def __repr__(self) -> str:
        """Return time, step and sizes on this rank: not the arrays."""
        closed = (
            f"{np.count_nonzero(self.active)} of {np.size(self.active)} contact conditions closed"
        )
        return f"State(t={self.t} s, k={self.k}, {np.size(self.u)} unknowns, {closed})"

    def with_velocity(self, v: Array) -> "State":
        """Return the state with another velocity."""
        return State(self.t, self.k, self.u, v, self.r_n, self.active, self.memory, self.r_t)


@dataclass(frozen=True)
class StepProblem:
    """Pose one step, as every solver sees it.

    ``guess`` (n,): predicted x; ``active`` (m,): predicted contact set.

    ``rate_factor``: slip rate [m/s] = rate_factor (B_t x - slip0): 1/dt for displacements, 1 for
    velocities, 0 in static problems, where friction is that of rest. ``lower`` (m,): bounds from
    below too, which ``Volume`` alone knows (``vi``); None in the steps of a scheme.
    """

    A: EffectiveMatrix
    b: Array
    bound: Array
    surface: ContactSurface
    scale: float
    guess: Array
    active: Mask
    t: float
    k: int
    friction: FrictionLaw = field(default_factory=Frictionless)
    slip0: Array | None = None
    rate_factor: float = 0.0
    lower: Array | None = None

    def __post_init__(self) -> None:
        rows, conditions = self.guess.shape[-1], self.surface.count
        if (self.b.shape[-1], len(self.bound), self.active.shape[-1]) != (
            rows,
            conditions,
            conditions,
        ):
            raise InputError(
                f"StepProblem has {len(self.b)} loads for {rows} unknowns, {len(self.bound)} "
                f"bounds and a contact set of {len(self.active)} for {conditions} conditions: give "
                "one of each"
            )

    def friction_at(self, slip: Array) -> FrictionLaw:
        """Return the friction law at the rates [m/s] of this slip, B_t x - slip0 (m, d - 1).

        Collective: what a law of the user's own raises on one rank is raised on all. InputError for
        limits that are negative or no numbers.
        """
        speed = self.rate_factor * np.linalg.norm(slip, axis=1)

        def law() -> FrictionLaw:
            found = self.friction.at(speed)
            refuse_limits(found, self.surface, self.scale, self.t)
            return found

        return on_all(self.surface.comm, f"{type(self.friction).__name__} at t = {self.t:g} s", law)


def refuse_limits(law: FrictionLaw, surface: ContactSurface, scale: float, t: float) -> None:
    """Raise InputError unless cohesion and slope are >= 0 at every condition of this rank.

    They are those of limit = cohesion + slope max(r_n, 0). Laws whose ``never_negative`` is true
    were checked when they were made.
    """
    if getattr(law, "never_negative", False):
        return
    weights = surface.weights
    parts = {
        "slope": law.slope(weights),
        "limit(0)": law.limit(np.zeros(surface.count), weights, scale),
    }
    for name, values in parts.items():
        found = np.asarray(values)
        if found.dtype.kind not in "iuf" or found.shape != (surface.count,):
            raise InputError(
                f"{type(law).__name__}: {name} is {shown(values)} at t = {t:g} s; return "
                f"{surface.count} real numbers, one for each contact condition"
            )
        wrong = np.flatnonzero(~((found >= 0.0) & (found < np.inf)))
        if len(wrong):
            raise InputError(
                f"{type(law).__name__}: {name} is {found[wrong[0]]:g} at "
                f"{at(surface.points[wrong[0]])} and t = {t:g} s; a friction limit is zero or a "
                "positive finite number"
            )


@dataclass(frozen=True)
class StepResult:
    """Answer a step by x (n,), the reactions and the closed conditions (m,).

    The reactions are r_n (m,) and r_t (m, d - 1), ``scale`` times newtons.

    ``iterations`` count changes of the active set, sweeps or Newton steps, as ``method`` says.
    ``history``: how the method converged, in a measure of its own. ``aim``: the residual at which
    an iterative method stopped because it was told to, 0 for one that goes on to round-off.
    """

    x: Array
    r_n: Array
    active: Mask
    iterations: int
    method: str
    r_t: Array | None = None
    history: tuple[float, ...] = ()
    aim: float = 0.0


@dataclass(frozen=True)
class Answers:
    """Answer a step of several runs.

    ``rows`` holds x (k, n), r_n, active (k, m) and r_t (k, m, d - 1). Of each run there are
    ``iterations`` and, with friction, ``histories``. ``failed`` is what those runs raise that have
    no answer.
    """

    rows: StepResult
    iterations: Sequence[int]
    failed: dict[int, ViContactError]
    histories: Sequence[tuple[float, ...]] = ()

    def own(self, row: int) -> StepResult:
        """Return the answer of one run."""
        rows, history = self.rows, self.histories[row] if self.histories else ()
        r_t, count = None if rows.r_t is None else rows.r_t[row], self.iterations[row]
        return StepResult(
            rows.x[row], rows.r_n[row], rows.active[row], count, rows.method, r_t, history
        )


@dataclass(frozen=True)
class Balance:
    """Hold the equation of motion that the step satisfied, with the scheme's own averages.

        M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t

    Multiplying it by the displacement increment gives the energy ledger of any scheme
    (verify.energy_balance).
    """

    u: Array
    v: Array
    a: Array
    f: Array
    r_n: Array
    r_t: Array | None = None


class Scheme(Protocol):
    """Turn a state into a StepProblem, and the answer into the next state: a time scheme.

    One whose contact condition is on velocities says ``penetrates = True``: states of its own runs
    may lie inside the obstacle, and it goes on from them. A scheme is a value without state of its
    own: what it carries from step to step is in ``State.memory``, so that a checkpoint holds all of
    it. One that says ``by_rows = True`` steps several runs at once: ``step`` and ``finish`` then
    also get vectors as rows, (k, n) and (k, m), and return them.
    """

    @property
    def mass(self) -> MassLaw:
        """Return the mass matrix that it takes when the problem does not say which."""

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless ``problem`` suits the scheme.

        Called before anything is computed, on all ranks.
        """

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return ``state`` with the memory that steps of ``dt`` [s] need.

        This is accelerations or earlier levels, for example.

        Called with the first state of a run of ``problem``, on a restart, and whenever dt changes;
        what is in ``state.memory`` already was put there by this scheme, or by none. It may bring
        initial data into equilibrium.
        """

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return ``state`` with the velocity ``v`` that the impact law of ``problem`` gave.

        ``v`` is (n,) [m/s]; u and t stay the same.

        What the scheme remembers of accelerations has to fit the new velocity before the next step
        of ``dt`` [s].
        """

    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix:
        """Return A (n rows) of ``problem`` for all steps of ``dt`` [s].

        As a rule it is ``problem.equations.effective(…)``.

        A is symmetric positive definite; nothing in it depends on time or state. It is made once
        for every dt.
        """

    def step(
        self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float
    ) -> StepProblem:
        """Return the problem of the step of ``problem`` from ``state`` to state.t + dt.

        ``A`` is the matrix of the step.

        ``dt`` [s] is that of A. The meaning of x is the scheme's own (u1 or v1, say); ``bound`` and
        ``scale`` fit it, and ``scale`` is the same in all steps of one dt.
        """

    def finish(
        self,
        problem: ContactProblem,
        state: State,
        step: StepProblem,
        result: StepResult,
        dt: float,
    ) -> State:
        """Return the state of ``problem`` at the end of a step of ``dt`` [s].

        It is that before the impact law.

        ``state`` is the one the step began with, ``step`` what ``step()`` returned for it and
        ``result`` its certified answer: reactions in it are ``scale`` times newtons, those of the
        new state are newtons.
        """

    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance:
        """Return the equation of motion that the step of ``dt`` [s] from ``old`` to ``new`` met.

        The ledger needs it.

        ``new`` is what ``finish`` returned: before the impact law of ``problem``. Called when a
        recorder asks.
        """


class PreparedSolver(Protocol):
    """Solve steps with one effective matrix and one surface; what ``Solver.prepare`` returns.

    One with ``solve_many`` answers several at once (``solvers.condensed``).
    """

    def solve(self, step: StepProblem) -> StepResult:
        """Return x, reactions and closed conditions of ``step``.

        The A, surface and scale of ``step`` are those that the solver was made for.

        The answer is judged by its certificate, so the method may stop where it finds best.
        StepFailure, on all ranks, when there is none. Collective.
        """


class Solver(Protocol):
    """Hold the settings of a one-step solver.

    ``prepare`` does the work that is shared by all steps with the same A.
    """

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless the solver can treat ``problem``.

        Its friction law, supports and matrices are looked at.
        """

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver:
        """Return a solver of steps with the matrix ``A`` on ``surface``.

        Reactions of these steps are ``scale`` times newtons.

        Called once for every dt; factors and whatever else depends on A alone belong here.
        Collective.
        """


@dataclass(frozen=True)
class Report:
    """Tell recorders what happened in one step.

    ``new.v`` is after the impact law, ``v_minus`` before it.

    ``problem`` is the one that was solved, with the mass matrix that the scheme chose when none was
    given.
    """

    problem: ContactProblem
    old: State
    new: State
    v_minus: Array
    step: StepProblem
    result: StepResult
    certificate: Certificate
    averages: Callable[[], Balance]
    escalated: bool

    @cached_property
    def balance(self) -> Balance:
        """Return the equation of motion that the step satisfied; made when somebody asks."""
        return self.averages()


class Recorder(Protocol):
    """Listen to the loop: name columns once, and fill a row after every step.

    Numbers are equal on every rank; arrays count on rank 0, and may be empty on the others.
    """

    def columns(self) -> Mapping[str, tuple[str, str]]:
        """Return what ``start`` and ``row`` fill in: name -> (unit, meaning).

        Called after ``start``, always the same.

        Names are made of letters, digits and underscores; no two recorders of a run have one in
        common.
        """

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Mapping[str, Any]:
        """Return the row of the initial ``state`` of ``problem``.

        Whatever an earlier run has left is forgotten.

        ``resumed``: the last row of the run that a restart continues, from which sums over time go
        on; else None.
        """

    def row(self, report: Report) -> Mapping[str, Any]:
        """Return the row of the step that ``report`` tells of.

        It holds numbers, or arrays of one shape (to HDF5 only).

        Called once a step, in order, on all ranks: collective operations are allowed here.
        """


Columns = Mapping[str, tuple[str, str]]
Row = Mapping[str, Any]
AXES = "xyz"
