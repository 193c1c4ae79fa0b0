"""Say where in a step the balance of forces holds: all that a time scheme has to say of it.

A scheme has one unknown x for a step, the displacement or the velocity at its end. It predicts x by
a ``guess`` and solves for the increment d = x - guess. Displacement, velocity and acceleration at
the *stage* are affine in d,

    u = u_g + alpha d,    v = v_g + beta d,    a = a_g + gamma d

and the balance of forces holds there, with the means of the scheme:

    M a + C v + K u = f - carried - B_nᵀ r_n - B_tᵀ r_t

``carried`` are reactions of the beginning that stand in it. Times ``scale`` this is a step of the
contract (``core.step``) for d:

    A d = b - Bᵀ(scale r),    A = scale (gamma M + beta C + alpha K)
    b = scale (f - carried - M a_g - C v_g - K u_g)

b is what is left of the forces at the guess, which is small beside them: rounding of a solver is
relative to d and not to x, so that free flight does not drift (``tests/schemes/test_drift.py``).

``pose`` makes the step, ``complete`` takes its answer back to x and to newtons, and ``average``
makes the equation of motion that the ledger reads. Vectors may also be rows (k, n) of several runs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .algebra import Array, EffectiveMatrix, Mask, Matrix
from .internal import turns
from .problem import ContactProblem
from .step import Balance, State, StepProblem, StepResult
from .system import SemiDiscreteSystem


@dataclass(frozen=True)
class Affine:
    """Hold a vector that is affine in the increment: at_guess + slope d.

    Attributes:
        at_guess: its value (n,) at d = 0; None for zero, whose products cost nothing.
        slope: its derivative, a number.
    """

    at_guess: Array | None
    slope: float

    def __call__(self, d: Array) -> Array:
        """Return its value (n,) at an increment d (n,)."""
        change = self.slope * d
        return change if self.at_guess is None else self.at_guess + change

    def find(self, d: Array | None) -> Array | None:
        """Return its value (n,) where that is not zero for want of any part.

        Args:
            d: the increment (n,); None for zero.
        """
        return self.at_guess if d is None or self.slope == 0.0 else self(d)


@dataclass(frozen=True)
class Stage:
    """Hold the balance of a step by the equations of the module.

    Attributes:
        guess: x (n,) at d = 0, [m] or [m/s].
        u: displacement at the stage [m].
        v: velocity at the stage [m/s].
        a: acceleration at the stage [m/s²].
        load: f (n,) [N], the mean load of the scheme.
        scale: what the balance is multiplied by; reactions of the posed step are so many newtons.
        bound: (m,) largest B_n x, infinite where nothing is in the way.
        slip0: B_t x (m, d - 1) where the slip is zero; None without friction.
        active: predicted contact set (m,).
        t: time [s] at the end of the step.
        k: number of the step.
        rate_factor: slip rate [m/s] over B_t x - slip0.
        carried: Bᵀr (n,) [N] of reactions of the beginning; None for none.
        carried_reactions: these (m,) and (m, d - 1) or None [N], which traces do not tell of Bᵀr;
            None where each unknown has one.
        weight: of this balance in the mean equation of the step.
        before: makes the balance at the beginning of the step, which has the weight 1 - ``weight``;
            None where this balance is the mean one but for its weight.
        old: (share u0, share p(u0)) where the displacement of the stage is a sum share u0 + end u1
            over both ends, at each of which the internal force p of a body that is not linear is
            taken.
        end: the share of u1 in that sum.
        of_momentum: whether the mean acceleration of the step is (v1 - v0)/dt.
        between: u0 (n,) where the internal force is that of both ends at once, p̄(u0, x), of a body
            that turns (``core.internal.TwoEndForce``); x is then the displacement at the end.
        turned: whether the unknowns are in the frames of contact nodes; None where nobody asks.
    """

    guess: Array
    u: Affine
    v: Affine
    a: Affine
    load: Array
    scale: float
    bound: Array
    slip0: Array | None
    active: Mask
    t: float
    k: int
    rate_factor: float
    carried: Array | None = None
    carried_reactions: tuple[Array, Array | None] | None = None
    weight: float = 1.0
    before: Callable[[], Balance] | None = None
    old: tuple[Array, Array] | None = None
    end: float = 1.0
    of_momentum: bool = True
    between: Array | None = None
    turned: bool | None = None

    def find_internal(self, system: SemiDiscreteSystem, d: Array | None = None) -> Array:
        """Return the internal force (n,) [N] of the balance at an increment; None for zero.

        It is taken at the displacement of the stage or, where ``old`` says so, as a sum over both
        ends; the two are one for a linear body.

        Args:
            system: the equations that are marched.
            d: the increment (n,); None for zero.
        """
        if self.between is not None:
            both: Any = system.internal
            return np.asarray(both.between(self.between, self.find_place(d)))
        internal = system.internal_force(self.find_place(d))
        if self.old is None:
            return internal
        return self.old[1] + (internal if self.end == 1.0 else self.end * internal)

    def find_tangent(self, system: SemiDiscreteSystem, d: Array, *, whole: bool = False) -> Matrix:
        """Return the tangent (n, n) [N/m] of the internal force at the displacement of the stage.

        Args:
            system: the equations that are marched.
            d: the increment (n,).
            whole: whether that of a material may be no symmetric matrix.
        """
        internal: Any = system.internal
        place = self.find_place(d)
        if whole:
            return internal.whole_tangent(place)  # type: ignore[no-any-return]
        if self.between is not None:
            return internal.between_tangent(self.between, place)  # type: ignore[no-any-return]
        return internal.tangent(place)  # type: ignore[no-any-return]

    def find_start(self, system: SemiDiscreteSystem) -> Array | None:
        """Return the increment (n,) at which passes begin; None for zero.

        Args:
            system: the equations that are marched.
        """
        if self.between is None:
            return None
        both: Any = system.internal
        return np.asarray(both.turn_on(self.between, self.guess) - self.guess)

    def find_place(self, d: Array | None = None) -> Array:
        """Return the displacement (n,) [m] at which the internal force is asked for.

        Args:
            d: the increment (n,); None for zero.
        """
        if self.between is not None:
            return self.guess if d is None else self.guess + d
        u: Any = self.u.find(d)
        if self.old is None:
            return u
        return u - self.old[0] if self.end == 1.0 else (u - self.old[0]) / self.end


@dataclass(frozen=True)
class Answer:
    """Hold the certified answer of a step, as ``Scheme.finish`` takes it.

    Attributes:
        x: the unknown (n,) of the scheme, [m] or [m/s].
        d: its increment (n,), x - guess.
        r_n: normal reactions (m,) [N].
        r_t: tangential reactions (m, d - 1) [N]; None without friction.
        active: (m,) True for closed conditions.
    """

    x: Array
    d: Array
    r_n: Array
    r_t: Array | None
    active: Mask


def make_matrix(
    system: SemiDiscreteSystem, stage: Stage, stiffness: Matrix | None = None
) -> EffectiveMatrix:
    """Return A of the steps with these slopes and this scale.

    Args:
        system: the equations that are marched.
        stage: of any step of one size.
        stiffness: in the place of K, a tangent of the internal force.
    """
    return system.effective(
        m=stage.scale * stage.a.slope,
        c=stage.scale * stage.v.slope,
        k=stage.scale * stage.u.slope,
        stiffness=stiffness,
    )


def find_rest(
    system: SemiDiscreteSystem, stage: Stage, d: Array | None = None
) -> tuple[Array, Array]:
    """Return what is left of the forces at an increment, and the internal force in it.

    scale (f - carried - M a - C v - p(u)) and scale p(u), with p(u) = K u for a linear body. The
    first one is b of the step from there.

    Args:
        system: the equations that are marched.
        stage: the balance.
        d: the increment (n,); None for zero, where accelerations are often zero too, by the choice
            of the guess.

    Returns:
        Both (n,), in the unit of b.
    """
    internal = stage.find_internal(system, d)
    force = stage.load - internal
    if stage.carried is not None:
        force -= stage.carried
    a = stage.a.find(d)
    if a is not None:
        force -= system.M @ a
    v = None if system.C is None else stage.v.find(d)
    if system.C is not None and v is not None:
        force -= system.C @ v
    if stage.scale != 1.0:
        force *= stage.scale
        internal = stage.scale * internal
    return force, internal


@dataclass(frozen=True)
class NonlinearForces:
    """Hold the forces of a step whose body is not linear.

    Attributes:
        system: the equations of the step.
        stage: the balance.
    """

    system: SemiDiscreteSystem
    stage: Stage

    @property
    def turns(self) -> bool:
        """Say whether the internal force is that of a body that turns."""
        return self.stage.between is not None

    @property
    def may_have_turned(self) -> bool:
        """Say whether the body is one that turns, in a step of time or at rest."""
        return turns(self.system.internal)

    def find_rest(self, d: Array) -> Array:
        """Return what is left of the forces at an increment (n,): b - A d of a linear body."""
        return find_rest(self.system, self.stage, d)[0]

    def measure(self, d: Array) -> tuple[Array, Array, Array]:
        """Return what is left of the forces at an increment (n,), and what it is compared with.

        Returns:
            What is left, the sizes of the forces that act, and the internal force: (n,) each, in
            the unit of b. Sizes are those of the load, and of inertia and reactions together: in
            free flight the load alone is more than rounding.
        """
        rest, internal = find_rest(self.system, self.stage, d)
        acting = np.maximum(np.abs(self.stage.scale * self.stage.load), np.abs(rest + internal))
        return rest, acting, internal

    def find_start(self) -> Array | None:
        """Return the increment (n,) at which passes begin; None for zero."""
        return self.stage.find_start(self.system)

    def find_old(self) -> Array:
        """Return the increment (n,) of the displacement before, of a body that turns."""
        assert self.stage.between is not None  # asked for of such bodies alone
        return self.stage.between - self.stage.guess

    def find_tangent(self, d: Array, *, whole: bool = False) -> Matrix:
        """Return p'(u) (n, n) [N/m] at an increment.

        Args:
            d: the increment (n,).
            whole: whether it may be no symmetric matrix; else its symmetric part.
        """
        return self.stage.find_tangent(self.system, d, whole=whole)

    def make_matrix(self, tangent: Matrix) -> EffectiveMatrix:
        """Return A of the step with a tangent in the place of K."""
        return make_matrix(self.system, self.stage, tangent)


def pose(
    problem: ContactProblem,
    stage: Stage,
    A: EffectiveMatrix,
    system: SemiDiscreteSystem | None = None,
) -> StepProblem:
    """Return the step for d, with the forces that are left at the guess as its load.

    Args:
        problem: the problem that is marched.
        stage: the balance.
        A: the effective matrix of the stage.
        system: the equations of the step; None: those that are marched.
    """
    system = problem.equations if system is None else system
    surface = problem.surface
    force, internal = find_rest(system, stage)

    # Conditions on d are those on x, seen from the guess.
    slip0 = stage.slip0
    if slip0 is not None:
        slip0 = slip0 - surface.tangential_values(stage.guess)
    return StepProblem(
        A=A,
        b=force,
        bound=stage.bound - surface.normal_values(stage.guess),
        surface=surface,
        scale=stage.scale,
        guess=np.zeros(stage.guess.shape),
        active=stage.active,
        t=stage.t,
        k=stage.k,
        friction=problem.friction,
        slip0=slip0,
        rate_factor=stage.rate_factor,
        origin=stage.guess,
        internal=internal,
        forces=None if system.internal is None else NonlinearForces(system, stage),
    )


def add_increment(
    x: Array, bound: Array, slip0: Array | None, step: StepProblem, result: StepResult
) -> Array:
    """Return x + d for the answer d of a step that was posed about x.

    Rounding of the sum must not open a closed point or move one that sticks: where d is on its
    bound, x + d is exactly on its own, and where the slip is zero it stays so.

    Args:
        x: about which the step was posed (n,).
        bound: (m,) largest B_n (x + d).
        slip0: B_t (x + d) (m, d - 1) where the slip is zero; None without friction.
        step: for d.
        result: its answer.
    """
    surface = step.surface
    d = result.x
    x = x + d
    if surface.traces is not None:
        return x  # traces have no unknown to put anywhere
    if result.active.any():
        on_bound = surface.normal_values(d) == step.bound
        surface.put_normal(x, bound, on_bound)
    if slip0 is not None:
        sticks = surface.tangential_values(d) == step.slip0
        if sticks.any():
            surface.put_tangential(x, slip0, sticks)
    return x


def complete(stage: Stage, step: StepProblem, result: StepResult) -> Answer:
    """Return the answer for x, with reactions in newtons.

    Args:
        stage: the balance.
        step: what ``pose`` made of it.
        result: the answer of a solver, for d.
    """
    x = add_increment(stage.guess, stage.bound, stage.slip0, step, result)
    r_n = result.r_n
    r_t = result.r_t
    if stage.scale != 1.0:
        r_n = r_n / stage.scale
        r_t = None if r_t is None else r_t / stage.scale
    return Answer(x, result.x, r_n, r_t, result.active)


def average(
    problem: ContactProblem, stage: Stage, answer: Answer, old: State, new: State
) -> Balance:
    """Return the mean equation of motion of a step, for the energy ledger.

    What the states say counts, where the scheme promises that a is the rate of their velocities:
    a state that does not fit to its step then leaves a defect in the ledger.

    Args:
        problem: the problem that is marched.
        stage: the balance.
        answer: of the step.
        old: the state that the step began with.
        new: the state at its end, before the impact law.
    """
    surface = problem.surface
    system = problem.equations
    r_n = answer.r_n
    r_t = answer.r_t
    if stage.carried_reactions is not None:
        carried_n, carried_t = stage.carried_reactions
        r_n = r_n + carried_n
        if r_t is not None and carried_t is not None:
            r_t = r_t + carried_t
    elif stage.carried is not None:
        r_n = r_n + surface.normal_values(stage.carried)
        if r_t is not None:
            r_t = r_t + surface.tangential_values(stage.carried)
    internal = None
    if system.internal is not None:
        internal = stage.find_internal(system, answer.d)
    balance = Balance(
        u=stage.u(answer.d),
        v=stage.v(answer.d),
        a=stage.a(answer.d),
        f=stage.load,
        r_n=r_n,
        r_t=r_t,
        internal=internal,
    )
    if stage.weight != 1.0:
        balance = balance.weigh(stage.weight, None if stage.before is None else stage.before())
    if not stage.of_momentum:
        return balance
    dt = stage.t - old.t
    return replace(balance, a=(new.v - old.v) / dt, of_momentum=dt)
