"""State THE CONTRACT between time schemes and solvers, and the values that pass between them.

Every time scheme turns a step into the same one-step problem, and every solver solves it:

    A x = b - B_nᵀ r_n - B_tᵀ r_t,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0
    |r_t| <= limit(r_n),    r_t = limit(r_n) slip/|slip| where slip = B_t x - slip0 is not zero

(bilateral rows: equality and r_n of either sign). A is constant as long as dt is, so it is
factorised once. ``r_n`` and ``r_t`` are ``scale`` times the reactions of the step in newtons, those
of the body on its support; ``compliance`` is zero on a rigid support. The scale is the scheme's: 1
for reactions at the end of the step, 2 for means of the midpoint rule, whose equation is multiplied
by two so that K has the factor one in A, and dt for impulses in N s.

Vectors are arrays of the unknowns that this rank owns, in the rotated basis: there B_n and B_t
select entries, as the normal and the tangential displacements of a contact node are unknowns
themselves; where conditions share unknowns they are traces (``core.traces``). Contact arrays have
shape (m,) or, tangential ones, (m, d - 1), a row for each condition on these unknowns; r_t is None
without friction. Branch on them with ``surface.some``, which asks all ranks: what follows may be
collective.

The loop (``run.march``) calls, for every step, in this order:

    scheme.stage -> pose (core.stage) -> solver.solve -> kkt_residual (core.verify) ->
    scheme.finish -> the impact law, scheme.jump

and ``make_matrix`` (core.stage) and ``solver.prepare`` once for every dt. Below n are the unknowns
this rank owns, m its contact conditions, d the dimensions. ``problem.equations`` is the system to
march: in the rotated basis, with mass law and excitations in it; ``problem.surface`` are its
contact conditions. Arrays that come in are read, never written to.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from .certificate import Certificate
from .checks import describe_point, on_all, quote
from .errors import InputError, ViContactError
from .html import make_table
from .problem import ContactProblem
from .protocols import FrictionLaw, Frictionless, MassLaw
from .surfaces import ContactSurface

if TYPE_CHECKING:
    from .stage import Answer, Stage


STILL = 1e-12  # of the largest displacement: a slip of traces that is rounding


@dataclass(frozen=True)
class State:
    """Hold the motion and the contact at the end of a step.

    Attributes:
        t: time [s].
        k: number of the step.
        u: displacement (n,) [m] in the rotated basis.
        v: velocity (n,) [m/s] in the rotated basis.
        r_n: normal reactions (m,) [N] of the step that led here, mean or end values as the scheme
            says.
        active: (m,) True for closed conditions.
        memory: what a scheme carries besides u and v: vectors (n,), and arrays that are the same on
            every rank. The class of the scheme says under which names; nobody else reads it. What
            a joint has gone through is there too, arrays (m, …) (``core.joints``), and what
            materials remember, arrays of owned cells (``core.internal.MATERIAL``).
        r_t: tangential reactions (m, d - 1) [N] of that step, None without friction.
        certificate: of the equilibrium that the state is; None of states that steps have led to.
        turned: whether u and v are in the frames of contact nodes (``ContactSurface.turned``);
            None of a state made by hand, which is taken to be of the problem it is given to.
    """

    t: float
    k: int
    u: Array
    v: Array
    r_n: Array
    active: Mask
    memory: Mapping[str, Array] = field(default_factory=dict)
    r_t: Array | None = None
    certificate: float | None = None
    turned: bool | None = None

    def __repr__(self) -> str:
        """Return time, step and sizes on this rank: not the arrays."""
        closed = np.count_nonzero(self.active)
        conditions = np.size(self.active)
        return (
            f"State(t={self.t} s, k={self.k}, {np.size(self.u)} unknowns, {closed} of {conditions} "
            "contact conditions closed)"
        )

    def with_velocity(self, v: Array) -> "State":
        """Return the state with another velocity."""
        contact = (self.r_n, self.active, self.memory, self.r_t)
        return State(self.t, self.k, self.u, v, *contact, turned=self.turned)


class StepForces(Protocol):
    """Know the forces of a step whose body is not linear (``core.stage.NonlinearForces``)."""

    @property
    def turns(self) -> bool:
        """Say whether the body turns: its displacements may be as large as itself."""

    def find_rest(self, d: Array) -> Array:
        """Return what is left of them at x = d (n,), in the unit of b: b - A d if linear."""


@dataclass(frozen=True)
class StepProblem:
    """Pose one step, as every solver sees it.

    The head of this module has the equations. x is a displacement or a velocity, as the scheme
    says.

    Attributes:
        A: matrix (n, n) of the step.
        b: right-hand side (n,), ``scale`` times newtons.
        bound: (m,) largest B_n x, infinite where nothing is in the way.
        surface: the contact conditions.
        scale: how many times newtons r_n and r_t are, constant as long as dt is.
        guess: predicted x (n,).
        active: predicted contact set (m,).
        t: time [s] at the end of the step.
        k: number of the step.
        friction: the law of friction at rest.
        slip0: B_t x (m, d - 1) where the slip is zero; None without friction.
        rate_factor: slip rate [m/s] over B_t x - slip0: 1/dt for displacements, 1 for velocities, 0
            in static problems, where friction is that of rest.
        lower: (m,) bounds from below too, which ``Volume`` alone knows (``vi``); None in the steps
            of a scheme.
        origin: the unknowns (n,) that x is an increment of (``core.stage``); None where x is all.
        internal: ``scale`` times K u (n,) at x = 0, a part of b beside which rounding is judged;
            None where it is not known.
        forces: of a body that is not linear, whose step is rest(x) = Bᵀr with ``forces.find_rest``
            in the place of b - A x, and A that of the reference stiffness; None of a linear one.

    Of several runs at once (``by_rows`` of ``Scheme``), b, guess and active have a row for each,
    (k, n) and (k, m); what the runs share is as above.
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
    origin: Array | None = None
    internal: Array | None = None
    forces: StepForces | None = None
    joint: Any = None

    def __post_init__(self) -> None:
        rows = self.guess.shape[-1]
        conditions = self.surface.count
        sizes = (self.b.shape[-1], self.bound.shape[-1], self.active.shape[-1])
        if sizes != (rows, conditions, conditions):
            raise InputError(
                f"StepProblem has {len(self.b)} loads for {rows} unknowns, {sizes[1]} "
                f"bounds and a contact set of {len(self.active)} for {conditions} conditions: give "
                "one of each"
            )

    @property
    def start(self) -> Array:
        """Return the unknowns (n,) that the step starts from, by which sizes are judged."""
        return self.guess if self.origin is None else self.origin

    def friction_at(self, slip: Array) -> FrictionLaw:
        """Return the friction law at the rates of this slip. Collective.

        What a law of the user's own raises on one rank is raised on all.

        Args:
            slip: B_t x - slip0 (m, d - 1).

        Raises:
            InputError: limits that are negative or no numbers.
        """
        speed = self.rate_factor * np.linalg.norm(slip, axis=1)  # [m/s]

        def ask_law() -> FrictionLaw:
            law = self.friction.at(speed)
            refuse_limits(law, self.surface, self.scale, self.t)
            return law

        name = f"{type(self.friction).__name__} at t = {self.t:g} s"
        return on_all(self.surface.comm, name, ask_law)


def refuse_limits(law: FrictionLaw, surface: ContactSurface, scale: float, t: float) -> None:
    """Raise InputError unless cohesion and slope are >= 0 at every condition of this rank.

    They are those of limit = cohesion + slope max(r_n, 0). Laws whose ``never_negative`` is true
    were checked when they were made.

    Args:
        law: the friction law at the rates of the step.
        surface: the conditions.
        scale: how many times newtons the reactions are.
        t: time [s], for the sentence.
    """
    if getattr(law, "never_negative", False):
        return
    owner = type(law).__name__
    weights = surface.weights

    # The limit is linear in r_n >= 0, so its value at zero and its slope say all of it.
    parts = {
        "slope": law.slope(weights),
        "limit(0)": law.limit(np.zeros(surface.count), weights, scale),
    }
    for name, part in parts.items():
        # A law of the user's own may return anything: look at type and shape before the signs.
        values = np.asarray(part)
        if values.dtype.kind not in "iuf" or values.shape != (surface.count,):
            raise InputError(
                f"{owner}: {name} is {quote(part)} at t = {t:g} s; return "
                f"{surface.count} real numbers, one for each contact condition"
            )
        wrong = np.flatnonzero(~((values >= 0.0) & (values < np.inf)))
        if len(wrong):
            first = wrong[0]
            raise InputError(
                f"{owner}: {name} is {values[first]:g} at "
                f"{describe_point(surface.points[first])} and t = {t:g} s; a friction limit is "
                "zero or a positive finite number"
            )


@dataclass(frozen=True)
class StepResult:
    """Answer a step.

    Attributes:
        x: the unknowns (n,).
        r_n: normal reactions (m,), ``scale`` times newtons.
        active: (m,) True for closed conditions.
        iterations: number of changes of the active set, of sweeps or of Newton steps, as ``method``
            says.
        method: which method found the answer.
        r_t: tangential reactions (m, d - 1), ``scale`` times newtons; None without friction.
        history: how the method converged, in a measure of its own.
        aim: the residual at which an iterative method stopped because it was told to, 0 for one
            that goes on to round-off.
        corrects_slowly: whether to correct the answer takes as long as to find it.

    Of several runs at once, x, r_n, active and r_t have a row for each.
    """

    x: Array
    r_n: Array
    active: Mask
    iterations: int
    method: str
    r_t: Array | None = None
    history: tuple[float, ...] = ()
    aim: float = 0.0
    corrects_slowly: bool = False


@dataclass(frozen=True)
class Answers:
    """Answer a step of several runs: ``solve_many`` of a prepared solver returns it.

    Attributes:
        rows: x (k, n), r_n and active (k, m) and r_t (k, m, d - 1), a row for each of the k runs.
        iterations: those of each run.
        failed: what a run without an answer raises, by its row.
        histories: with friction, that of each run (``StepResult.history``).
    """

    rows: StepResult
    iterations: Sequence[int]
    failed: dict[int, ViContactError]
    histories: Sequence[tuple[float, ...]] = ()

    def own(self, row: int) -> StepResult:
        """Return the answer of the run with this row, from 0 to k - 1."""
        rows = self.rows
        return StepResult(
            x=rows.x[row],
            r_n=rows.r_n[row],
            active=rows.active[row],
            iterations=self.iterations[row],
            method=rows.method,
            r_t=None if rows.r_t is None else rows.r_t[row],
            history=self.histories[row] if self.histories else (),
        )


@dataclass(frozen=True)
class Balance:
    """Hold the equation of motion that the step satisfied, with the scheme's own averages.

        M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t

    Multiplying it by the displacement increment gives the energy ledger of any scheme
    (``core.ledger.energy_balance``). At theta = ½, for instance, u is ½ (u0 + u1) and a is (v1 -
    v0)/dt.

    Attributes:
        u: averaged displacement (n,) [m].
        v: averaged velocity (n,) [m/s].
        a: averaged acceleration (n,) [m/s²].
        f: averaged load (n,) [N].
        r_n: averaged normal reactions (m,) [N].
        r_t: averaged tangential reactions (m, d - 1) [N]; None without friction.
        internal: averaged internal force (n,) [N] of a body that is not linear; None: K u.
        of_momentum: dt [s] where a is (v1 - v0)/dt of the states, so that M a dt is the change of
            their momentum; None where it is not.
    """

    u: Array
    v: Array
    a: Array
    f: Array
    r_n: Array
    r_t: Array | None = None
    internal: Array | None = None
    of_momentum: float | None = None

    def weigh(self, weight: float, other: "Balance | None" = None) -> "Balance":
        """Return weight times this equation, plus 1 - weight times another one.

        Args:
            weight: of this equation.
            other: the other one, in which missing tangential reactions count as zero; None: none
                is added.
        """
        values: dict[str, Any] = {"of_momentum": self.of_momentum}
        for name in ("u", "v", "a", "f", "r_n", "r_t", "internal"):
            value = getattr(self, name)
            mean = None if value is None else weight * value
            also = None if other is None else getattr(other, name)
            if mean is not None and also is not None:
                mean = mean + (1.0 - weight) * also
            values[name] = mean
        return Balance(**values)


class Scheme(Protocol):
    """Turn a state into a StepProblem, and the answer into the next state: a time scheme.

    A scheme is a value without state of its own. What it carries from step to step is in
    ``State.memory``, so that a checkpoint holds all of it. Three class variables, all False where
    they are missing, say more:

    - ``penetrates = True``: the contact condition is on velocities, so that states of its own runs
      may lie inside the obstacle, and the scheme goes on from them.
    - ``takes_ends = True``: it takes the internal force at the ends of steps alone, as materials
      that yield ask for.
    - ``by_rows = True``: it steps several runs at once. ``stage`` and ``finish`` then also get
      vectors as rows, (k, n) and (k, m), and return rows.
    """

    @property
    def mass(self) -> MassLaw:
        """Return the mass law that the scheme takes when the problem does not say which."""

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless ``problem`` suits the scheme.

        The loop calls it before anything is computed, on all ranks.
        """

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return a state with the memory that the next steps need, such as accelerations.

        The loop calls it with the first state of a run, on a restart, and whenever dt changes. It
        may bring initial data into equilibrium.

        Args:
            problem: the problem that is marched.
            state: the state to go on from. What is in its memory already was put there by this
                scheme, or by none.
            dt: size of the next steps [s].
        """

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return a state with the velocity that the impact law gave.

        What the scheme remembers of accelerations has to fit the new velocity before the next step.

        Args:
            problem: the problem that is marched.
            state: the state before the impact, whose u and t stay the same.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s].
        """

    def stage(self, problem: ContactProblem, state: State, dt: float) -> "Stage":
        """Return where the balance of a step holds, from ``state`` to state.t + dt.

        Its slopes and its scale are the same in all steps of one dt: A, which is made of them, is
        factorised once.

        Args:
            problem: the problem that is marched.
            state: the state at the beginning of the step.
            dt: size of the step [s].
        """

    def finish(
        self, problem: ContactProblem, state: State, stage: "Stage", answer: "Answer", dt: float
    ) -> State:
        """Return the state at the end of a step, before the impact law.

        Args:
            problem: the problem that is marched.
            state: the state that the step began with.
            stage: what ``stage()`` returned for it.
            answer: the certified answer, with reactions in newtons.
            dt: size of the step [s].
        """


class PreparedSolver(Protocol):
    """Solve steps with one effective matrix and one surface; ``Solver.prepare`` returns it.

    A prepared solver that also has ``solve_many`` answers several steps at once
    (``solvers.condensed``).
    """

    def solve(self, step: StepProblem) -> StepResult:
        """Return x, reactions and closed conditions of ``step``. Collective.

        A, surface and scale of ``step`` are those that the solver was made for. The answer is
        judged by its certificate, so the method may stop where it finds best.

        Raises:
            StepFailure: on all ranks, when the method finds no answer.
        """


class Solver(Protocol):
    """Hold the settings of a one-step solver.

    ``prepare`` does the work that is shared by all steps with the same A.
    """

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError unless the solver can treat friction law, supports and matrices."""

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver:
        """Return a solver of steps with one matrix. Collective.

        The loop calls it once for every dt; factors and whatever else depends on A alone belong
        here.

        Args:
            A: the effective matrix of these steps.
            surface: their contact conditions.
            scale: how many times newtons their reactions are.
        """


@dataclass(frozen=True)
class Report:
    """Tell recorders what happened in one step.

    Attributes:
        problem: the problem that was solved, with the mass law that the scheme chose when none was
            given.
        old: the state before the step.
        new: the state after the impact law.
        v_minus: the velocity (n,) [m/s] before the impact law.
        step: the one-step problem.
        result: its answer.
        certificate: how well the answer satisfies the conditions of the step.
        averages: makes ``balance``.
        escalated: whether the solver had to go on to another method.
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
        """Return the equation of motion of the step; it is made when somebody asks."""
        return self.averages()

    @cached_property
    def momentum(self) -> Array:
        """Return M v (n,) [N s] of the velocity before the impact law, made once."""
        return self.problem.equations.M @ self.v_minus

    @cached_property
    def elastic(self) -> Array:
        """Return K u, or p(u) (n,) [N] at the end of the step, made once."""
        return self.problem.equations.internal_force(self.new.u)

    def _repr_html_(self) -> str:
        """Return a table for a notebook, which calls this by its name: no rank waits for others."""
        surface = self.problem.surface
        closed = f"{int(np.sum(self.new.active))} of {surface.count}"
        rows = [
            ("step", f"{self.new.k}"),
            ("from t to", f"{self.old.t:.9g} s to {self.new.t:.9g} s"),
            ("closed points of this rank" if surface.comm.size > 1 else "closed points", closed),
            ("iterations", f"{self.result.iterations}"),
            ("escalated", "yes" if self.escalated else "no"),
            *self.certificate.list_rows(),
        ]
        return make_table(rows)


def find_slipping(report: Report) -> Mask:
    """Return which conditions (m,) moved along their support in a step with friction."""
    step = report.step
    surface = step.surface
    assert step.slip0 is not None
    slip = surface.tangential_values(report.result.x) - step.slip0
    if surface.traces is None:
        return np.asarray(np.any(slip != 0.0, axis=1))

    # Where they stick traces are zero but for rounding of the unknowns that they are sums of.
    x = report.result.x if step.origin is None else step.origin + report.result.x
    return np.asarray(np.max(np.abs(slip), axis=1) > STILL * largest(surface.comm, max_abs(x)))


class Recorder(Protocol):
    """Listen to the loop: name columns once, and fill a row after every step.

    Numbers are equal on every rank; arrays count on rank 0, and may be empty on the others.
    """

    def columns(self) -> Mapping[str, tuple[str, str]]:
        """Return what ``start`` and ``row`` fill in: name -> (unit, meaning).

        The loop calls it after ``start``, and always gets the same. Names are made of letters,
        digits and underscores; no two recorders of a run have one in common.
        """

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Mapping[str, Any]:
        """Return the row of the initial state, and forget whatever an earlier run has left.

        Args:
            problem: the problem that is marched.
            state: the state that the run begins with.
            resumed: the last row of the run that a restart continues, from which sums over time go
                on; else None.
        """

    def row(self, report: Report) -> Mapping[str, Any]:
        """Return the row of a step: numbers, or arrays of one shape (to HDF5 only).

        The loop calls it once a step, in order, on all ranks: collective operations are allowed
        here.
        """


# What recorders return, in the words of their annotations: name -> (unit, meaning), and
# name -> number or array.
Columns = Mapping[str, tuple[str, str]]
Row = Mapping[str, Any]
AXES = "xyz"  # how the names of columns end that have a direction
