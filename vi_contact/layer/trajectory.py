"""Integrate in time from flight to layer and back.

There is an event at every crossing of the layer's edge rho = b.
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
        start, end: times of entry and exit [s].
        rate_in, rate_out: ρ̇ there [m/s], negative on the way in.
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
        q, v: coordinates (m, n_q) and velocities (m, n), in the units of the system.
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
    q, v = array(owner, "q0", q0, (None,)), array(owner, "v0", v0, (None,))
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
    passages = _Passages(system, layer, metric, rtol, refine)
    inside = rho < layer.width or (rho == layer.width and system.normal_rate(q, v) < 0.0)
    t = 0.0
    with one_sentence():
        while t < t_end and (contacts is None or len(passages.contacts) < contacts):
            t, q, v, crossed = passages.run(t, t_end, q, v, inside)
            inside = not inside
            if not crossed:
                break
    return passages.trajectory()


def passage(
    layer: Layer, mass: float, speed: float, metric: Metric, *, rtol: float, refine: int = 1
) -> Trajectory:
    """Return how ``mass`` [kg] on a line crosses the layer.

    It is entered with ``speed`` [m/s]; it raises InputError if it stays.
    """
    particle = ConstrainedSystem(np.array([[mass]]), lambda q: float(q[0]), lambda q: np.ones(1))
    found = layer_motion(
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
    if not found.contacts:
        raise InputError("the layer holds the body back for ever: give it more k or less c")
    return found


class _Passages:
    """Flights and passages through the layer one after the other.

    The unknowns are v and q - q_start since the last crossing, over the time since: 1e-8 m is
    resolved beside 1 m.
    """

    def __init__(
        self, system: ConstrainedSystem, layer: Layer, metric: Metric, rtol: float, refine: int
    ) -> None:
        self._system, self._layer, self._metric, self._rtol, self._refine = (
            system,
            layer,
            metric,
            rtol,
            refine,
        )
        self._parts: list[tuple[Array, Array, Array, Array, Array]] = []
        self._evaluations = Evaluations()
        self.contacts: list[LayerContact] = []

    def run(
        self, start: float, t_end: float, q: Array, v: Array, inside: bool
    ) -> tuple[float, Array, Array, bool]:
        """Integrate to the next crossing of the edge; (t, q, v, whether there was one)."""
        system = self._system
        n = len(q)
        layer = (
            self._layer.at(abs(system.normal_rate(q, v)))
            if inside and self._layer.speed is None
            else self._layer
        )
        width = layer.width

        def rates(t: float, y: Array) -> Array:
            self._evaluations.spend(start + t)
            place = q + y[:n]
            speed = y[n:]
            acceleration, _ = self._acceleration(start + t, place, speed, layer, inside)
            return np.concatenate([system.velocity(place, speed), acceleration])

        def edge(t: float, y: Array) -> float:
            rho = float(system.rho(q + y[:n]))
            if not np.isfinite(rho):
                raise StepFailure(
                    f"the distance rho(q) is {rho:g} at t = {start + t:.6g} s: return a finite "
                    "number"
                )
            return rho - width

        def turn(t: float, y: Array) -> float:
            return system.normal_rate(q + y[:n], y[n:])

        edge.terminal = True  # type: ignore[attr-defined]
        edge.direction = 1.0 if inside else -1.0  # type: ignore[attr-defined]
        turn.direction = 1.0  # type: ignore[attr-defined]
        way = width if inside else max(width, float(np.max(np.abs(q))))
        if not np.all(np.isfinite(rates(0.0, np.r_[np.zeros(n), v]))):
            raise StepFailure(
                f"the velocities or accelerations at t = {start:.6g} s are not finite: check what "
                "the system's functions return there"
            )
        most = float(np.max(np.abs(self._acceleration(start, q, v, layer, inside)[0])))
        # the speed over the width; 1 where nothing moves
        reached = float(np.sqrt(most * layer.width)) or 1.0
        pace = max(float(np.max(np.abs(v))), layer.speed or 0.0, reached)
        atol = self._rtol * np.r_[np.full(n, way), np.full(len(v), pace)]
        found = solve_ivp(
            rates,
            (0.0, t_end - start),
            np.r_[np.zeros(n), v],
            events=(edge, turn),
            atol=atol,
            rtol=self._rtol,
            method="DOP853",
            dense_output=self._refine > 1,
        )
        if found.status < 0:
            raise StepFailure(
                f"the motion could not be integrated beyond t = {start + found.t[-1]:.6g} s at rho "
                f"= {system.rho(q + found.y[:n, -1]):.3g}: give a larger rtol ({found.message})"
            )
        places = q + found.y[:n].T
        speeds = found.y[n:].T
        t = np.interp(
            np.arange(self._refine * (len(found.t) - 1) + 1) / self._refine,
            np.arange(len(found.t)),
            found.t,
        )
        y = found.sol(t) if self._refine > 1 else found.y
        self._keep(start + t, q + y[:n].T, y[n:].T, layer, inside)
        crossed = found.status == 1
        if inside and crossed:
            rate = system.normal_rate(q, v), system.normal_rate(places[-1], speeds[-1])
            turns = zip(found.y_events[1], found.t_events[1], strict=True)
            deepest, when = min(
                ((float(system.rho(q + y[:n])), float(t)) for y, t in turns), default=(width, 0.0)
            )
            self.contacts.append(
                LayerContact(start, start + float(found.t[-1]), *rate, deepest, start + when)
            )
        return start + float(found.t[-1]), places[-1], speeds[-1], crossed

    def _acceleration(
        self, t: float, q: Array, v: Array, layer: Layer, inside: bool
    ) -> tuple[Array, float]:
        """Return (v̇, lambda).

        They are NaN where a trial stage has left the admissible set, which makes the integrator
        step back.
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
        rho = np.array([float(self._system.rho(row)) for row in q])
        reaction = [self._acceleration(*row, layer, inside)[1] for row in zip(t, q, v, strict=True)]
        self._parts.append((t, q, v, rho, np.array(reaction)))

    def trajectory(self) -> Trajectory:
        """Everything so far."""
        t, q, v, rho, reaction = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        return Trajectory(t, q, v, rho, reaction, tuple(self.contacts))
