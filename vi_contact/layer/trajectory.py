"""Integrate in time from flight to layer and back.

There is an event at every crossing of the layer's edge rho = b.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ..core.algebra import Array
from ..core.checks import array, instance, number, optional, whole
from ..core.errors import InputError, StepFailure
from .layer import Layer
from .metric import Metric
from .motion import (
    ConstrainedSystem,
    Evaluations,
    check_tolerance,
    one_sentence,
)


@dataclass(frozen=True)
class LayerContact:
    """Describe a passage through the layer.

    Args:
        start: time of entry [s].
        end: time of exit [s].
        rate_in: ρ̇ at entry [m/s], negative.
        rate_out: ρ̇ at exit [m/s], positive.
        deepest: the least distance [m].
        turned: its time [s].
    """

    start: float
    end: float
    rate_in: float
    rate_out: float
    deepest: float
    turned: float

    @property
    def duration(self) -> float:
        """Return the time between entry and exit [s]."""
        return self.end - self.start

    @property
    def restitution(self) -> float:
        """Return -ρ̇⁺/ρ̇⁻ [-], Newton's coefficient (37)."""
        return -self.rate_out / self.rate_in


@dataclass(frozen=True)
class Trajectory:
    """Hold a motion through a layer.

    Args:
        t: times (m,) [s].
        q: coordinates (m, n_q), in the units of the system.
        v: velocities (m, n), likewise.
        rho: distances (m,) [m].
        reaction: lambda (m,) [N], positive away from the obstacle.
        contacts: the passages that are completed.
    """

    t: Array
    q: Array
    v: Array
    rho: Array
    reaction: Array
    contacts: Sequence[LayerContact]


def layer_motion(
    system: ConstrainedSystem,
    layer: Layer,
    *,
    q0: Array,
    v0: Array,
    t_end: float,
    metric: Metric = Metric.DOMINANT,
    contacts: int | None = None,
    rtol: float = 1e-11,
    refine: int = 1,
) -> Trajectory:
    """Integrate a motion with one contact, M v̇ = f - Γ(v, v) + Aᵀ lambda, from t = 0.

    lambda [N] is that of the layer, positive away from the obstacle, and zero outside it.

    Args:
        system: masses, forces and the distance to the obstacle.
        layer: the law.
        q0: coordinates (n_q,) at t = 0, with rho(q0) > 0.
        v0: velocities (n,) at t = 0.
        t_end: end of the motion [s].
        metric: the reading of the law.
        contacts: end after so many passages, if they come before t_end; None: do not.
        rtol: relative tolerance of the integration by Dormand and Prince's method of order 8.
        refine: rows of the trajectory for each of its steps, which are large, by its own
            interpolation.

    Returns:
        The motion and its contacts.

    Raises:
        InputError: the start is not inside the admissible set (rho > 0), or in the layer while V is
            not known; a function of the system returns no finite numbers there.
        StepFailure: the integrator stopped, or did not come to an end; the message names the time.
    """
    owner = "layer_motion"
    instance(
        owner,
        "system",
        system,
        ConstrainedSystem,
        "give ConstrainedSystem(...), or RigidBody(...).system()",
    )
    instance(owner, "layer", layer, Layer, "give a Layer")
    instance(owner, "metric", metric, Metric, "give Metric.DOMINANT, FULL, BLENDED or FLAT")
    q = array(owner, "q0", q0, (None,))
    v = array(owner, "v0", v0, (None,))
    system.check(q, v)
    number(owner, "t_end", t_end, positive=True, unit="s")
    optional(whole, owner, "contacts", contacts, least=1)
    check_tolerance(owner, rtol)
    whole(owner, "refine", refine, least=1, most=10_000)
    rho = float(system.rho(q))
    if not rho > 0.0:
        raise InputError(
            f"the motion starts at distance rho = {rho:g}, outside the admissible set: start at "
            "rho > 0"
        )

    # From crossing to crossing. A body on the edge is inside if it is on its way in.
    passages = _Passages(system, layer, metric, rtol=rtol, refine=refine)
    inside = rho < layer.width or (rho == layer.width and system.normal_rate(q, v) < 0.0)
    t = 0.0
    with one_sentence():
        while t < t_end and (contacts is None or len(passages.contacts) < contacts):
            t, q, v, crossed = passages.run(t, t_end, q, v, inside)
            inside = not inside
            if not crossed:
                break
    return passages.trajectory()


def cross_layer(
    layer: Layer, mass: float, speed: float, metric: Metric, *, rtol: float, refine: int = 1
) -> Trajectory:
    """Return how a particle on a line crosses the layer.

    Args:
        layer: the law.
        mass: of the particle [kg].
        speed: with which it enters [m/s].
        metric: the reading of the law.
        rtol: relative tolerance, as for ``layer_motion``.
        refine: rows for each step of the integration, likewise.

    Returns:
        The motion, with one contact.

    Raises:
        InputError: the particle stays in the layer.
    """
    particle = ConstrainedSystem(np.array([[mass]]), lambda q: float(q[0]), lambda q: np.ones(1))
    trajectory = layer_motion(
        particle,
        layer,
        q0=np.array([layer.width]),
        v0=np.array([-speed]),
        t_end=1e6 * layer.width / speed,
        metric=metric,
        contacts=1,
        rtol=rtol,
        refine=refine,
    )
    if not trajectory.contacts:
        raise InputError("the layer holds the body back for ever: give it more k or less c")
    return trajectory


class _Passages:
    """Integrate flights and passages through the layer, one after the other.

    The unknowns are v and q - q_start since the last crossing, over the time since: 1e-8 m is
    resolved beside 1 m.

    Attributes:
        contacts: the passages that are completed.
    """

    def __init__(
        self, system: ConstrainedSystem, layer: Layer, metric: Metric, *, rtol: float, refine: int
    ) -> None:
        """Begin without any motion.

        Args:
            system: masses, forces and the distance to the obstacle.
            layer: the law.
            metric: the reading of the law.
            rtol: relative tolerance of the integration.
            refine: rows of the trajectory for each step of the integration.
        """
        self._system = system
        self._layer = layer
        self._metric = metric
        self._rtol = rtol
        self._refine = refine
        self._parts: list[tuple[Array, Array, Array, Array, Array]] = []
        self._evaluations = Evaluations()
        self.contacts: list[LayerContact] = []

    def run(
        self, start: float, t_end: float, q: Array, v: Array, inside: bool
    ) -> tuple[float, Array, Array, bool]:
        """Integrate to the next crossing of the edge, or to the end.

        Args:
            start: time of the last crossing [s].
            t_end: end of the motion [s].
            q: coordinates (n_q,) at the start.
            v: velocities (n,) at the start.
            inside: whether this is a passage through the layer.

        Returns:
            Time, coordinates and velocities at the end, and whether the edge was crossed.

        Raises:
            StepFailure: the integrator stops; the message names the time.
        """
        system = self._system
        n = len(q)
        layer = self._layer
        if inside and layer.speed is None:
            layer = layer.at(abs(system.normal_rate(q, v)))
        solution = self._integrate(start, t_end, q, v, layer, inside)
        places = q + solution.y[:n].T
        speeds = solution.y[n:].T

        # Rows at the integrator's steps, and at even parts of them by its own interpolation.
        steps = np.arange(len(solution.t))
        parts = np.arange(self._refine * (len(solution.t) - 1) + 1) / self._refine
        t = np.interp(parts, steps, solution.t)
        y = solution.sol(t) if self._refine > 1 else solution.y
        self._keep(start + t, q + y[:n].T, y[n:].T, layer, inside)

        # A passage that is completed; it is deepest where it turned, or at the edge.
        end = start + float(solution.t[-1])
        crossed = solution.status == 1
        if inside and crossed:
            turns = []
            for state, time in zip(solution.y_events[1], solution.t_events[1], strict=True):
                turns.append((float(system.rho(q + state[:n])), float(time)))
            deepest, t_deepest = min(turns, default=(layer.width, 0.0))
            contact = LayerContact(
                start=start,
                end=end,
                rate_in=system.normal_rate(q, v),
                rate_out=system.normal_rate(places[-1], speeds[-1]),
                deepest=deepest,
                turned=start + t_deepest,
            )
            self.contacts.append(contact)
        return end, places[-1], speeds[-1], crossed

    def _integrate(
        self, start: float, t_end: float, q: Array, v: Array, layer: Layer, inside: bool
    ) -> Any:
        """Return what ``solve_ivp`` makes of (q - q_start, v) over the time since the start.

        Its first event is the crossing of the edge, which ends it; its second one a turn, where the
        distance is least. The arguments are those of ``run``, and the layer with its speed.
        """
        system = self._system
        n = len(q)

        def rates(t: float, y: Array) -> Array:
            """Return the rates of the unknowns at a time since the start [s]."""
            self._evaluations.spend(start + t)
            place = q + y[:n]
            speed = y[n:]
            acceleration, _ = self._acceleration(start + t, place, speed, layer, inside)
            return np.concatenate([system.velocity(place, speed), acceleration])

        def edge(t: float, y: Array) -> float:
            """Return the distance from the edge [m], negative inside."""
            rho = float(system.rho(q + y[:n]))
            if not np.isfinite(rho):
                raise StepFailure(
                    f"the distance rho(q) is {rho:g} at t = {start + t:.6g} s: return a finite "
                    "number"
                )
            return rho - layer.width

        def turn(t: float, y: Array) -> float:
            """Return ρ̇ [m/s], which passes zero upwards at a turn."""
            return system.normal_rate(q + y[:n], y[n:])

        edge.terminal = True  # type: ignore[attr-defined]
        edge.direction = 1.0 if inside else -1.0  # type: ignore[attr-defined]
        turn.direction = 1.0  # type: ignore[attr-defined]
        y0 = np.r_[np.zeros(n), v]
        if not np.all(np.isfinite(rates(0.0, y0))):
            raise StepFailure(
                f"the velocities or accelerations at t = {start:.6g} s are not finite: check what "
                "the system's functions return there"
            )

        # Absolute tolerances, of the size of the motion: lengths, and speeds. Of these is one that
        # the acceleration gives over the width, or 1 where nothing moves.
        size = layer.width if inside else max(layer.width, float(np.max(np.abs(q))))
        acceleration, _ = self._acceleration(start, q, v, layer, inside)
        most = float(np.max(np.abs(acceleration)))
        speed_over_width = float(np.sqrt(most * layer.width)) or 1.0
        speed = max(float(np.max(np.abs(v))), layer.speed or 0.0, speed_over_width)
        atol = self._rtol * np.r_[np.full(n, size), np.full(len(v), speed)]
        solution = solve_ivp(
            rates,
            (0.0, t_end - start),
            y0,
            events=(edge, turn),
            atol=atol,
            rtol=self._rtol,
            method="DOP853",
            dense_output=self._refine > 1,
        )
        if solution.status < 0:
            raise StepFailure(
                f"the motion could not be integrated beyond t = {start + solution.t[-1]:.6g} s at "
                f"rho = {system.rho(q + solution.y[:n, -1]):.3g}: give a larger rtol "
                f"({solution.message})"
            )
        return solution

    def _acceleration(
        self, t: float, q: Array, v: Array, layer: Layer, inside: bool
    ) -> tuple[Array, float]:
        """Return (v̇, lambda).

        They are NaN where a trial stage has left the admissible set, which makes the integrator
        step back.

        Args:
            t: time [s].
            q: coordinates (n_q,).
            v: velocities (n,).
            layer: the law, with its speed.
            inside: whether this is a passage through the layer.
        """
        free, along, g, normal = self._system.accelerations(t, q, v)
        if not inside:
            return free, 0.0
        rho = float(self._system.rho(q))
        if not rho > 0.0:
            return np.full_like(free, np.nan), np.nan
        reaction = self._metric.reaction(layer, g, rho, self._system.normal_rate(q, v), normal)
        return free + along * reaction, reaction

    def _keep(self, t: Array, q: Array, v: Array, layer: Layer, inside: bool) -> None:
        """Keep the rows of a part of the motion, with their distances and reactions.

        Args:
            t: times (m,) [s].
            q: coordinates (m, n_q).
            v: velocities (m, n).
            layer: the law, with its speed.
            inside: whether this is a passage through the layer.
        """
        rho = np.array([float(self._system.rho(place)) for place in q])
        reaction = np.empty(len(t))
        for row in range(len(t)):
            _, reaction[row] = self._acceleration(t[row], q[row], v[row], layer, inside)
        self._parts.append((t, q, v, rho, reaction))

    def trajectory(self) -> Trajectory:
        """Return the motion so far."""
        columns = zip(*self._parts, strict=True)
        t, q, v, rho, reaction = (np.concatenate(column) for column in columns)
        return Trajectory(t, q, v, rho, reaction, tuple(self.contacts))
