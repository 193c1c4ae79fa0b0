"""Find the slip rates of a step with rate-and-state friction, by Newton's method in ln V.

mu(V) grows with the rate V at fixed state, so the rates of a step are unique; but d mu/d V = a/V is
so steep at rest that passes with mu taken from the slip before do not converge. With the response G
of the bodies to forces along the slips e while closed points stay closed, the ways of a pass that
had the tangential reactions r become, for other rates,

    way(y) = way - G (N mu(y) - e·r) = dt exp(y),    y = ln V

which is solved for y: its Jacobian G diag(N d mu/dy) + dt diag(exp y) has positive eigenvalues
only. N are the normal reactions of the pass. The next pass has mu(y), and tells whether contact and
N have changed.
"""

from dataclasses import replace

import numpy as np

from ..core.algebra import Array, Indices, max_abs
from ..core.errors import StepFailure
from ..core.joints import JointStep, Strength
from ..core.step import StepProblem
from .condensed_passes import CondensedPasses, PassEnd

PASSES = 40
ITERATIONS = 200
STEP = 3.0  # the longest change of ln V in an iteration
CLOSE = 1e-13  # change of ln V at the end, of its size
SETTLED = 1e-11  # change of mu r_n between passes, of the largest
LEAST = 1e-60  # [m/s] below any rate that is told from rest


class RatePasses:
    """Solve steps for the slip rates; the response of the bodies is kept while nothing changes."""

    def __init__(self, small: CondensedPasses) -> None:
        """Hold what makes the passes."""
        self._small = small
        self._key = b""
        self._response: Array = np.zeros((0, 0))

    def solve(self, base: StepProblem, joint: JointStep) -> tuple[StepProblem, Array, PassEnd, int]:
        """Return the last pass of a step: the step, its push, its end and how many there were.

        Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning.

        Raises:
            StepFailure: the rates do not settle.
        """
        small = self._small
        surface = base.surface
        small.begin(base)
        speed = np.maximum(joint.committed["speed"], LEAST)
        change = np.inf
        for count in range(1, PASSES + 1):
            step = _apply(base, joint, speed)
            push = find_push(step, small.width)
            end = small.make(step, push)
            before = step.joint.used.mu
            speed = self._find_rates(joint, end, speed, step.scale)
            after, _ = joint.law.at_speed(joint.committed, speed, joint.dt)
            r_n = np.maximum(surface.mine(end.r[:, 0]), 0.0)
            sizes = np.array([max_abs((after - before) * r_n), max_abs(after * r_n)])
            difference, size = surface.comm.max(sizes)
            change = difference / size if size else 0.0
            if change <= SETTLED:
                return step, push, end, count
        raise StepFailure(
            f"step {base.k} at t = {base.t:.6g} s: after {PASSES} passes the friction of the joint "
            f"still changes by {change:.1e} of the largest: try a smaller dt"
        )

    def _find_rates(self, joint: JointStep, end: PassEnd, speed: Array, scale: float) -> Array:
        """Return the rates (m,) [m/s] at which ways and friction agree. Collective.

        Args:
            joint: at the beginning of the step.
            end: of the last pass.
            speed: its rates (m,), to begin with.
            scale: how many times newtons its reactions are.
        """
        surface = self._small.surface
        law = joint.law
        dt = joint.dt
        pressed = end.closed & (end.r[:, 0] > 0.0)
        shear = end.r[:, 1:]
        size = np.linalg.norm(shear, axis=1)
        rubbing = np.flatnonzero(pressed & (size > 0.0))
        e = shear[rubbing] / size[rubbing, None]
        G = self._respond(rubbing, e, end)
        N = end.r[rubbing, 0]
        way0 = np.sum(e * end.slip[rubbing], axis=1) + G @ size[rubbing]
        all_speeds = np.asarray(surface.everywhere(speed))
        y = np.log(all_speeds[rubbing])

        def ask(y: Array) -> tuple[Array, Array]:
            """Return mu and d mu/dy of rubbing points, on every rank."""
            rates = np.full(len(all_speeds), LEAST)
            rates[rubbing] = np.exp(y)
            values = law.at_speed(joint.committed, surface.mine(rates), dt)
            of_all = np.asarray(surface.everywhere(np.column_stack(values)))
            return of_all[rubbing, 0], of_all[rubbing, 1]

        # Newton's method with steps of bounded length: both sides grow with y.
        for _ in range(ITERATIONS):
            mu, rise = ask(y)
            rest = way0 - G @ (N * mu) - dt * np.exp(y)
            jacobian = G * (N * rise) + np.diag(dt * np.exp(y))
            change = np.linalg.solve(jacobian, rest) if len(y) else rest
            longest = max_abs(change)
            y = np.maximum(y + change * min(1.0, STEP / max(longest, STEP)), np.log(LEAST))
            if longest <= CLOSE * max(1.0, max_abs(y)):
                break
        found = np.linalg.norm(end.slip, axis=1) / dt  # of open points: what they move
        found[rubbing] = np.exp(y)
        return np.maximum(surface.mine(found), LEAST)

    def _respond(self, rubbing: Indices, e: Array, end: PassEnd) -> Array:
        """Return ways (k, k) [m] of forces along the slips, while closed points stay closed.

        Args:
            rubbing: the k points.
            e: directions of their slips (k, d - 1).
            end: of the last pass.
        """
        key = rubbing.tobytes() + e.tobytes() + end.closed.tobytes()
        if key == self._key:
            return self._response
        H = self._small.stiffness
        assert H is not None  # whoever asks has looked
        count, width = end.r.shape
        free = np.ones((count, width), dtype=bool)
        free[end.closed, 0] = False
        chosen = np.flatnonzero(free)
        along = np.zeros((count * width, len(rubbing)))
        for axis in range(width - 1):
            along[rubbing * width + 1 + axis, np.arange(len(rubbing))] = e[:, axis]
        loads = along[chosen]
        self._response = loads.T @ np.linalg.solve(H[np.ix_(chosen, chosen)], loads)
        self._key = key
        return self._response


def find_push(step: StepProblem, width: int) -> Array:
    """Return the forces (M width,) of the joint at all conditions, on every rank. Collective.

    They are those by which a step differs from its base, ``scale`` times newtons.

    Args:
        step: the step for r'.
        width: contact unknowns of a condition.
    """
    surface = step.surface
    joint = step.joint
    normal, shear = joint.prestress
    rows = (normal + joint.pull)[:, None]
    if width > 1:
        traces = surface.traces
        moves = surface.tangents >= 0 if traces is None else traces.moves
        rows = np.hstack([rows, np.where(moves, shear, 0.0)])
    return np.asarray(surface.everywhere(step.scale * rows)).ravel()


def _apply(base: StepProblem, joint: JointStep, speed: Array) -> StepProblem:
    """Return the step with the friction of these rates (m,) [m/s]."""
    mu, _ = joint.law.at_speed(joint.committed, speed, joint.dt)
    none = np.zeros(len(speed))
    step = joint.apply(base, Strength(none, none, mu, none))
    return replace(step, joint=replace(step.joint, speed=speed))
