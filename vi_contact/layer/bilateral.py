"""Compute motions under equality constraints.

They are compared with the layer (b-geometry, ENOC 2017, equations 29 to 34).

Every constraint phi^R(q) = 0 with a^R = d phi^R brings one coordinate lambda^R of a manifold of its
own:

    M v̇ + Γ(v, v) - f = sum_R [(m̄_R λ̇^R)˙ + c̄_R λ̇^R + k̄_R λ^R - f̄_R] a^R          (31)
    (m̄_R φ̇^R)˙ + c̄_R φ̇^R + k̄_R φ^R = 0                                             (34)
    m̄ = c·M c,  c̄ = -c·(∂f/∂v) c,  k̄ = -c·(∂f/∂q) c,  f̄ = c·f,  with a·c = 1       (32, 33)

n + k ordinary differential equations for q and lambda, no algebraic ones. CHOSEN: c_R = M⁻¹a_R/(a_R
M⁻¹ a_R), the direction that the boundary's B of (20) has, so that m̄ is g_11 of the layer; (33)
leaves it open. The derivatives of (32) are read as those of the forces along c, from the authors'
earlier papers: the text prints them incompletely. They decide how an error in phi fades, not the
motion. The bracket is the reaction along a^R [N], of either sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ..core.algebra import Array
from ..core.checks import array, instance, quote, several
from ..core.errors import InputError, StepFailure
from .motion import (
    ConstrainedSystem,
    Evaluations,
    check_tolerance,
    one_sentence,
)


@dataclass(frozen=True)
class BilateralMotion:
    """Hold a motion under k equality constraints.

    Args:
        t: times (m,) [s].
        q, v: coordinates and their rates (m, n).
        phi: values of the constraints (m, k).
        multiplier: coordinates lambda^R of the constraints (m, k).
        reaction: forces along a^R (m, k) [N], of either sign.
    """

    t: Array
    q: Array
    v: Array
    phi: Array
    multiplier: Array
    reaction: Array


def bilateral_motion(
    systems: Sequence[ConstrainedSystem], *, q0: Array, v0: Array, times: Array, rtol: float = 1e-11
) -> BilateralMotion:
    """Integrate the motion with the constraints phi^R(q) = 0 held, by (31) and (34).

    lambda starts from 0, at rest.

    Args:
        systems: one for each constraint, its ``rho`` and ``gradient`` being phi and a; mass and
            forces are those of the first, and its velocities are the rates of q.
        q0: coordinates (n,) at the start.
        v0: their rates (n,) at the start.
        times: (m,) [s], increasing; the first is the start.
        rtol: relative tolerance of the integration by Dormand and Prince's method of order 8.

    Returns:
        The motion and its reactions at these times.

    Raises:
        InputError: quasi-velocities, no constraint, or times that do not increase.
        StepFailure: the integrator stops; the message names the time.

    Source: ENOC 2017, equations 29 to 34.
    """
    owner = "bilateral_motion"
    k = len(several("bilateral_motion", "systems", systems, "give a list of them"))
    for system in systems:
        instance(owner, "a system", system, ConstrainedSystem, "give ConstrainedSystem(...)")
    if not systems or any(system.rates is not None for system in systems):
        raise InputError(
            f"{owner}: bilateral constraints need at least one system, whose velocities are the "
            "rates of q; give one for each constraint"
        )
    q, v, times = (
        array(owner, name, value, (None,))
        for name, value in (("q0", q0), ("v0", v0), ("times", times))
    )
    if len(times) < 2 or np.any(np.diff(times) <= 0.0):
        raise InputError(
            f"{owner}: times are {quote(times)}; give two or more that increase, the first the "
            "start"
        )
    check_tolerance(owner, rtol)
    for system in systems:
        system.check(q, v, float(times[0]))
    n = len(q)
    evaluations = Evaluations()

    def rates(t: float, y: Array) -> Array:
        evaluations.spend(t)
        place, speed, multiplier, momentum = np.split(y, [n, 2 * n, 2 * n + k])
        acceleration, _, multiplier_rate, force = _solved(
            systems, t, place, speed, multiplier, momentum
        )
        return np.concatenate([speed, acceleration, multiplier_rate, force])

    y0 = np.concatenate([q, v, np.zeros(2 * k)])
    atol = rtol * max(float(np.max(np.abs(y0))), 1e-300)
    with one_sentence():
        if not np.all(np.isfinite(rates(float(times[0]), y0))):
            raise StepFailure(
                f"the accelerations at t = {times[0]:.6g} s are not finite: check what the "
                "systems' functions return there, and that the constraints are independent"
            )
        found = solve_ivp(
            rates, (times[0], times[-1]), y0, t_eval=times, rtol=rtol, atol=atol, method="DOP853"
        )
    if found.status < 0:
        raise StepFailure(
            f"the motion could not be integrated beyond t = {evaluations.t:.6g} s: {found.message}"
        )
    places, speeds, multipliers, momenta = np.split(found.y.T, [n, 2 * n, 2 * n + k], axis=1)
    phi = np.array([[system.rho(row) for system in systems] for row in places])
    rows = zip(found.t, places, speeds, multipliers, momenta, strict=True)
    reaction = np.array([_solved(systems, *row)[1] for row in rows])
    return BilateralMotion(found.t, places, speeds, phi, multipliers, reaction)


def _solved(
    systems: Sequence[ConstrainedSystem],
    t: float,
    q: Array,
    v: Array,
    multiplier: Array,
    momentum: Array,
) -> tuple[Array, Array, Array, Array]:
    """(v̇, reactions, λ̇, (m̄ λ̇)˙) from (31) and (34)."""
    first = systems[0]
    a = np.array([system.gradient(q) for system in systems], dtype=float)
    both = np.linalg.solve(
        first.matrix(q), np.column_stack([first.generalised_force(t, q, v), a.T])
    )
    free = both[:, 0]
    along = both[:, 1:]
    masses = 1.0 / np.einsum("ri,ir->r", a, along)
    c = along * masses
    damping, stiffness, pull = _along(first, t, q, v, c)
    phi = np.array([system.rho(q) for system in systems])
    rate = np.asarray(a @ v)
    turning = np.array([system.turning(q, v) for system in systems])
    # φ̈ of (34)
    wanted = -(_slope(systems, q, v) * rate + damping * rate + stiffness * phi) / masses
    reaction = np.linalg.solve(a @ along, wanted - a @ free - turning)
    multiplier_rate = momentum / masses
    force = reaction - damping * multiplier_rate - stiffness * multiplier + pull
    return np.asarray(free + along @ reaction), reaction, multiplier_rate, force


def _along(system: ConstrainedSystem, t: float, q: Array, v: Array, c: Array) -> Array:
    """(c̄, k̄, f̄) of (32), (3, k)."""
    values = np.zeros((3, c.shape[1]))
    force = system.force
    if force is None:
        return values
    for R, way in enumerate(c.T):
        h, w = (system.difference(x) / float(np.max(np.abs(way))) for x in (q, v))
        values[0, R] = -way @ (force(t, q, v + w * way) - force(t, q, v - w * way)) / (2.0 * w)
        values[1, R] = -way @ (force(t, q + h * way, v) - force(t, q - h * way, v)) / (2.0 * h)
        values[2, R] = way @ force(t, q, v)
    return values


def _slope(systems: Sequence[ConstrainedSystem], q: Array, v: Array) -> Array:
    """m̄˙ (k,) by a central difference along the motion."""
    size = float(np.max(np.abs(v)))
    if size == 0.0:
        return np.zeros(len(systems))
    h = systems[0].difference(q) / size

    def masses(place: Array) -> Array:
        M = systems[0].matrix(place)
        a = np.array([system.gradient(place) for system in systems], dtype=float)
        return np.asarray(1.0 / np.einsum("ri,ir->r", a, np.linalg.solve(M, a.T)))

    return (masses(q + h * v) - masses(q - h * v)) / (2.0 * h)
