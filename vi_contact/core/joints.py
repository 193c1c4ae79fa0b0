"""State the contract of joints whose strength changes, and what a step of a scheme sees of one.

At a point of weight w [m²] let r_n be the normal reaction (pressing > 0) and r_t the tangential
one. A joint of tensile strength f_t, cohesion c, slope mu and water pressure p [Pa] says

    0 <= r' = r_n + F - P  ⊥  opening >= 0,    |r_t| <= C + mu (r' - F),    F = f_t w D, …

where F, C = c w D and P = p w are forces [N] that depend on how far the joint has opened and
slipped. **Known in one pass
of a step** they make a step of the contract (``core.step``) for r': the load grows by
scale B_nᵀ(F - P), the cohesion is C - mu F and the slope mu. So solvers and certificates stay as
they are. The limit must not be negative: C is taken as max(C, mu F).

What a point has gone through is *committed* with an accepted step and lies in ``State.memory``, an
array for each name of the law with a row for each condition. So checkpoints hold it, and an attempt
that is thrown away leaves no trace.

The strength of a step of a scheme is the *mean of the law over the step*, the work over the way:
the energy is then that under the law, whatever dt is. A static stage has no way but its end, and
takes the strength there. ``vi_contact.solvers.joints`` finds the strength that is that of the
answer.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .algebra import Array, Mask, max_abs
from .checks import quote
from .errors import InputError
from .joint_laws import Committed, Slope, Strength
from .problem import ContactProblem
from .step import State, StepProblem, StepResult
from .surfaces import ContactSurface

MEMORY = "joint_"  # how names of committed arrays begin in the memory of a state
RAISED = "raised"  # the frame's own committed array: the dilation of the step before
TINY = 1e-10  # of the largest force of a step: below it no strength is judged
ROUNDING = 1e-5  # of the displacements of a step: a slip that is judged is no smaller
# Of what the largest load moves by itself: forces are certified relative to it, so a slip is known
# to the tolerance times that; it is judged a hundred times sharper.
OF_LOAD = 1e-2


@dataclass(frozen=True)
class StrengthUsed:
    """Bound friction by the strength of one pass: limit = scale cohesion + mu max(r', 0).

    Attributes:
        cohesion: C - mu F >= 0 (m,) [N].
        mu: the slope (m,).
    """

    never_negative = True
    cohesion: Array
    mu: Array

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return the largest tangential reactions (m,), ``scale`` times newtons.

        Args:
            r_n: r' (m,), ``scale`` times newtons.
            weights: areas (m,) [m²]; not read, as the cohesion is a force.
            scale: how many times newtons the reactions of the step are.
        """
        return scale * self.cohesion + self.mu * np.maximum(r_n, 0.0)

    def slope(self, weights: Array) -> Array:
        """Return mu (m,)."""
        return self.mu

    def at(self, speed: Array) -> "StrengthUsed":
        """Return itself: the slip rate is in the strength already."""
        return self


@dataclass(frozen=True)
class JointStep:
    """Hold a joint in one step: where it starts, and the strength that the step uses.

    Attributes:
        law: of the joint.
        committed: its arrays (m, …) before the step.
        surface: the contact conditions.
        g0: openings (m,) [m] at the beginning.
        s0: slips (m, d - 1) [m] at the beginning.
        raised: how far slip has lifted the points (m,) [m].
        lifted: by how much of it in this step (m,) [m].
        prestress: forces [N] that the joint had before: normal (m,), tangential (m, d - 1).
        dt: length of the step [s], 0 for a static stage.
        at_end: whether the strength is that at the end, and not the mean.
        used: the strength in newtons that the step is solved with; None before the first pass.
        speed: the slip rates (m,) [m/s] that mu is taken at, of laws that are solved for the rate.
    """

    law: Any
    committed: Committed
    surface: ContactSurface
    g0: Array
    s0: Array
    raised: Array
    lifted: Array
    prestress: tuple[Array, Array]
    dt: float
    at_end: bool
    used: Strength | None = None
    speed: Array | None = None

    @property
    def implicit(self) -> bool:
        """Say whether the strength is that of the answer."""
        return bool(getattr(self.law, "implicit", True))

    def guess(self, base: StepProblem) -> Strength:
        """Return the strength [N] to begin with: closed points stay closed and nothing slips.

        Open points go where the step predicts them.

        Args:
            base: the step without its joint.
        """
        if not self.implicit:
            return self.ask(self.g0, self.s0)
        there = base.bound - self.raised - self.surface.normal_values(base.guess)
        g1 = np.where(base.active | (self.g0 <= 0.0), self.g0, np.maximum(there, 0.0))
        return self.ask(g1, self.s0)

    def ask(self, g1: Array, s1: Array) -> Strength:
        """Return the strength [N] of a step that ends at these openings and slips.

        Args:
            g1: openings (m,) [m].
            s1: slips (m, d - 1) [m].
        """
        law = self.law
        if self.at_end:
            there = law.commit(self.committed, self.g0, g1, self.s0, s1, self.dt)
            found = law.strength(there, g1, g1, s1, s1, self.dt)
        else:
            found = law.strength(self.committed, self.g0, g1, self.s0, s1, self.dt)
        return self._weigh(found)

    def _weigh(self, found: Strength) -> Strength:
        """Return a strength in newtons, with a limit of friction that is never negative."""
        weights = self.surface.weights
        if getattr(self.law, "never_negative", False):  # its values were checked when it was made
            tension = weights * found.tension
            cohesion = np.maximum(weights * found.cohesion, found.mu * tension)
            return Strength(tension, cohesion, found.mu, weights * found.water)
        count = self.surface.count
        owner = type(self.law).__name__
        parts = []
        for name, part in zip(Strength._fields, found, strict=True):
            values = np.asarray(part)
            if values.dtype.kind not in "iuf" or values.shape not in ((), (count,)):
                raise InputError(
                    f"{owner}: {name} is {quote(part)}; return {count} real numbers, one for each "
                    "contact point"
                )
            if not np.all(np.isfinite(values)) or np.any(values < 0.0):
                raise InputError(
                    f"{owner}: {name} is {quote(part)}; return zero or positive finite numbers"
                )
            parts.append(np.broadcast_to(values.astype(float), (count,)))
        tension, cohesion, mu, water = parts
        tension = weights * tension
        cohesion = np.maximum(weights * cohesion, mu * tension)
        return Strength(tension, cohesion, mu, weights * water)

    def find_slope(self, g1: Array, s1: Array) -> Slope:
        """Return how F [N/m] and mu [1/m] change with the end of the step.

        Args:
            g1: openings (m,) [m].
            s1: slips (m, d - 1) [m].
        """
        law = self.law
        weights = self.surface.weights
        if not self.at_end:
            slope = law.slope(self.committed, self.g0, g1, self.s0, s1, self.dt)
            return Slope(weights * slope.tension, np.asarray(slope.mu, dtype=float))
        # The mean from an end to its neighbour changes half as fast as the strength there.
        there = law.commit(self.committed, self.g0, g1, self.s0, s1, self.dt)
        slope = law.slope(there, g1, g1, s1, s1, self.dt)
        return Slope(2.0 * weights * slope.tension, 2.0 * np.asarray(slope.mu, dtype=float))

    @property
    def pull(self) -> Array:
        """Return F - P (m,) [N], by which r' is more than the reaction."""
        assert self.used is not None  # it is known in a pass
        return self.used.tension - self.used.water

    @property
    def shift(self) -> Array:
        """Return by how much the bounds of the step are nearer (m,) [m].

        Slip lifts the points, and a spring in series carries the reaction, and not r'.
        """
        return self.raised + self.surface.compliance * (self.prestress[0] + self.pull)

    def apply(self, base: StepProblem, used: Strength) -> StepProblem:
        """Return the step for r', with a strength [N].

        Args:
            base: the step without its joint.
            used: the strength.
        """
        surface = self.surface
        joint = replace(self, used=used)
        normal, shear = self.prestress
        push = normal + joint.pull
        tangential = None if base.slip0 is None else base.scale * shear
        load = surface.reaction_load(base.scale * push, base.b.shape[-1], tangential)
        friction: Any = base.friction
        if base.slip0 is not None:
            cohesion = np.maximum(used.cohesion - used.mu * used.tension, 0.0)
            friction = StrengthUsed(cohesion, used.mu)
        return replace(
            base,
            b=base.b + load,
            bound=base.bound - joint.shift,
            friction=friction,
            joint=joint,
        )

    def find_end(self, step: StepProblem, result: StepResult) -> tuple[Array, Array]:
        """Return openings (m,) and slips (m, d - 1) [m] at the end of an answer.

        Args:
            step: the step for r'.
            result: its answer.
        """
        surface = self.surface
        gap = step.bound - surface.normal_values(result.x)
        gap = gap + surface.compliance * result.r_n / step.scale
        slip = np.zeros(self.s0.shape)
        if step.slip0 is not None:
            slip = surface.tangential_values(result.x) - step.slip0
        return self.end_at(gap, slip, result.active)

    def end_at(self, gap: Array, slip: Array, closed: Mask) -> tuple[Array, Array]:
        """Return openings (m,) and slips (m, d - 1) [m] at the end.

        Args:
            gap: what is left of the gap (m,) [m]; closed points have none but for rounding.
            slip: of the step (m, d - 1) [m].
            closed: (m,).
        """
        return np.where(closed, 0.0, np.maximum(gap, 0.0)), self.s0 + slip

    def commit(self, step: StepProblem, result: StepResult) -> Committed:
        """Return the committed arrays after a step, with the frame's own.

        Args:
            step: the step for r'.
            result: its answer.
        """
        g1, s1 = self.find_end(step, result)
        law = self.law
        s0 = self.s0
        if self.speed is not None:
            # The rate that the step was solved for is sharper than a difference of slips.
            s1 = follow(s1 - s0, self.speed * self.dt)
            s0 = np.zeros(s1.shape)
        after = dict(law.commit(self.committed, self.g0, g1, s0, s1, self.dt))
        if hasattr(law, "dilation"):
            after[RAISED] = self.raised
        return after


def follow(slip: Array, way: Array) -> Array:
    """Return slips (m, d - 1) [m] of given lengths, in the directions of others.

    Args:
        slip: (m, d - 1) [m]; without a direction it is along the first tangent.
        way: the lengths (m,) [m].
    """
    size = np.linalg.norm(slip, axis=1)
    first = np.zeros(slip.shape)
    first[:, :1] = 1.0
    unit = np.divide(slip, size[:, None], out=first, where=size[:, None] > 0.0)
    return np.asarray(way[:, None] * unit)


def judge_strength(step: StepProblem, result: StepResult) -> float:
    """Return ``law`` of the certificate: how far the strength used is from that of the answer.

    It is the largest difference of forces, of F, C, P and mu r', over the largest of them. 0
    without a joint, and for one whose strength is that before the step. Collective.

    Args:
        step: the step for r'.
        result: its answer.
    """
    joint = step.joint
    if joint is None or not joint.implicit:
        return 0.0
    return measure_lag(step, result)


def measure_lag(step: StepProblem, result: StepResult) -> float:
    """Return how far the strength used is from that of the answer, as ``judge_strength``.

    Of an explicit joint it is the lag. Collective.

    Args:
        step: the step for r', with its joint.
        result: its answer.
    """
    joint = step.joint
    g1, s1 = joint.find_end(step, result)
    r_n = np.maximum(result.r_n, 0.0) / step.scale
    used = joint.used
    there = joint.ask(g1, s1)
    friction = np.abs(there.mu - used.mu) * r_n

    # A law that is solved for the rate is so steep at rest that round-off of a slip is seen in mu.
    # There the slip itself is judged, in the size of the slips of the step or of what rounding
    # leaves of its displacements, and mu at its rate.
    if joint.speed is not None:
        at_rate = np.abs(joint.law.at_speed(joint.committed, joint.speed, joint.dt)[0] - used.mu)
        way = np.linalg.norm(s1 - joint.s0, axis=1)
        missing = np.abs(way - joint.speed * joint.dt)
        of_load = max_abs(step.b) / step.A.largest  # what the loads move by themselves [m]
        length = ROUNDING * max(max_abs(result.x), max_abs(step.start))
        length = max(length, OF_LOAD * of_load)
        way_most, length = step.surface.comm.max(np.array([max_abs(way), length]))
        largest_force = step.surface.comm.max(np.array([max_abs(used.mu * r_n)]))[0]
        of_slip = largest_force * missing / (max(way_most, length) or 1.0)
        friction = np.maximum(np.minimum(friction, of_slip), at_rate * r_n)

    force = max_abs(step.b) / step.scale
    return compare(step.surface, there, used, friction, used.mu * r_n, force)


def compare(
    surface: ContactSurface,
    there: Strength,
    used: Strength,
    friction: Array,
    limit: Array,
    force: float,
) -> float:
    """Return the largest difference of two strengths [N] over the largest strength. Collective.

    Args:
        surface: the contact conditions.
        there: the strength of an answer.
        used: the strength that it was found with.
        friction: the difference of mu r' (m,) [N].
        limit: mu r' (m,) [N].
        force: the largest load of the step [N], beside which tiny strengths are rounding.
    """
    forces = np.concatenate([there.tension, there.cohesion, there.water])
    before = np.concatenate([used.tension, used.cohesion, used.water])
    difference = max(max_abs(forces - before), max_abs(friction))
    size = max(max_abs(forces), max_abs(before), max_abs(limit))
    if surface.comm.size > 1:
        difference, size, force = surface.comm.max(np.array([difference, size, force]))
    if difference == 0.0:
        return 0.0
    return float(difference / max(size, TINY * force))


def read_committed(problem: ContactProblem, state: State) -> Committed:
    """Return the committed arrays of a state; those of the start where it has none.

    Args:
        problem: with a joint.
        state: of a run, a static stage, or made by hand.
    """
    assert problem.joint is not None  # whoever asks has looked
    kept = {
        name.removeprefix(MEMORY): values
        for name, values in state.memory.items()
        if name.startswith(MEMORY)
    }
    return kept or dict(problem.joint.start(problem.surface.count))


def keep_committed(state: State, committed: Committed) -> State:
    """Return a state with committed arrays in its memory.

    Args:
        state: at the end of a step.
        committed: what the joint has gone through.
    """
    kept = {f"{MEMORY}{name}": values for name, values in committed.items()}
    return replace(state, memory={**state.memory, **kept})


def find_limit(problem: ContactProblem, state: State) -> Array:
    """Return the largest tangential reactions (m,) [N] that a state allows.

    With a joint they are C + mu (r_n - P) of what is left of it, r_n the total reaction.

    Args:
        problem: with a joint or a law of friction.
        state: of a run or a static stage.
    """
    surface = problem.surface
    if problem.joint is None:
        return problem.friction.limit(state.r_n, surface.weights, 1.0)
    joint = pose_joint(problem, state, 0.0)
    if hasattr(joint.law, "at_speed"):
        mu, _ = joint.law.at_speed(joint.committed, joint.committed["speed"], 0.0)
        return np.asarray(mu * np.maximum(state.r_n, 0.0))
    left = joint.ask(joint.g0, joint.s0)
    effective = state.r_n - left.water + left.tension
    cohesion = left.cohesion - left.mu * left.tension
    return np.asarray(cohesion + left.mu * np.maximum(effective, 0.0))


def _weigh_prestress(law: Any, surface: ContactSurface, slip: Array) -> tuple[Array, Array]:
    """Return the forces [N] of a law's prestress: normal (m,), tangential (m, d - 1) as slips."""
    normal = np.zeros(surface.count)
    shear = np.zeros(slip.shape)
    before = getattr(law, "prestress", None)
    if before is not None:
        normal = surface.weights * before.spread("normal", surface.count)
        if shear.shape[1]:
            shear[:, 0] = surface.weights * before.spread("shear", surface.count)
    return normal, shear


def pose_joint(
    problem: ContactProblem, state: State, dt: float, *, at_end: bool = False
) -> JointStep:
    """Return the joint at the beginning of a step.

    Args:
        problem: with a joint.
        state: at the beginning.
        dt: length of the step [s], 0 for a static stage.
        at_end: whether the strength is that at the end.
    """
    surface = problem.surface
    law: Any = problem.joint
    committed = read_committed(problem, state)
    before = committed.get(RAISED, np.zeros(surface.count))
    raised = np.zeros(surface.count)
    if hasattr(law, "dilation"):
        raised = np.asarray(law.dilation(committed), dtype=float)
    # The reaction of a state is the total one, which springs carry.
    gap = surface.gap(state.t) - surface.normal_values(state.u) - before
    gap = gap + surface.compliance * state.r_n
    g0 = np.where(state.active, 0.0, np.maximum(gap, 0.0))
    s0 = surface.slip(state.u, state.t)
    return JointStep(
        law=law,
        committed={name: values for name, values in committed.items() if name != RAISED},
        surface=surface,
        g0=g0,
        s0=s0,
        raised=raised,
        lifted=raised - before,
        prestress=_weigh_prestress(law, surface, s0),
        dt=dt,
        at_end=at_end,
    )
