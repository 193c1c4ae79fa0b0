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
from typing import Any

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
        q: coordinates (m, n).
        v: their rates (m, n).
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
    q = array(owner, "q0", q0, (None,))
    v = array(owner, "v0", v0, (None,))
    times = array(owner, "times", times, (None,))
    if len(times) < 2 or np.any(np.diff(times) <= 0.0):
        raise InputError(
            f"{owner}: times are {quote(times)}; give two or more that increase, the first the "
            "start"
        )
    check_tolerance(owner, rtol)
    for system in systems:
        system.check(q, v, float(times[0]))

    # The unknowns y are q, v, lambda and the momenta m̄ λ̇.
    n = len(q)
    parts = [n, 2 * n, 2 * n + k]
    y0 = np.concatenate([q, v, np.zeros(2 * k)])
    solution = _integrate(systems, y0, times, parts, rtol)

    # Constraints and reactions at the times that were asked for.
    places, speeds, multipliers, momenta = np.split(solution.y.T, parts, axis=1)
    phi = np.empty((len(places), k))
    for row, place in enumerate(places):
        for R, system in enumerate(systems):
            phi[row, R] = system.rho(place)
    states = zip(solution.t, places, speeds, multipliers, momenta, strict=True)
    reaction = np.array([_solve(systems, *state)[1] for state in states])
    return BilateralMotion(solution.t, places, speeds, phi, multipliers, reaction)


def _integrate(
    systems: Sequence[ConstrainedSystem], y0: Array, times: Array, parts: list[int], rtol: float
) -> Any:
    """Return what ``solve_ivp`` makes of the unknowns y, with their values at the times.

    Args:
        systems: one for each constraint.
        y0: the unknowns at the start.
        times: (m,) [s].
        parts: where y is cut into q, v, lambda and momenta.
        rtol: relative tolerance.

    Raises:
        StepFailure: accelerations that are not finite at the start, or the integrator stops.
    """
    evaluations = Evaluations()

    def rates(t: float, y: Array) -> Array:
        """Return the rates of y at a time [s]."""
        evaluations.spend(t)
        place, speed, multiplier, momentum = np.split(y, parts)
        acceleration, _, multiplier_rate, force = _solve(
            systems, t, place, speed, multiplier, momentum
        )
        return np.concatenate([speed, acceleration, multiplier_rate, force])

    atol = rtol * max(float(np.max(np.abs(y0))), 1e-300)
    with one_sentence():
        if not np.all(np.isfinite(rates(float(times[0]), y0))):
            raise StepFailure(
                f"the accelerations at t = {times[0]:.6g} s are not finite: check what the "
                "systems' functions return there, and that the constraints are independent"
            )
        solution = solve_ivp(
            rates, (times[0], times[-1]), y0, t_eval=times, rtol=rtol, atol=atol, method="DOP853"
        )
    if solution.status < 0:
        raise StepFailure(
            f"the motion could not be integrated beyond t = {evaluations.t:.6g} s: "
            f"{solution.message}"
        )
    return solution


def _solve(
    systems: Sequence[ConstrainedSystem],
    t: float,
    q: Array,
    v: Array,
    multiplier: Array,
    momentum: Array,
) -> tuple[Array, Array, Array, Array]:
    """Return (v̇, reactions, λ̇, (m̄ λ̇)˙) from (31) and (34).

    Args:
        systems: one for each of the k constraints.
        t: time [s].
        q: coordinates (n,).
        v: their rates (n,).
        multiplier: lambda (k,).
        momentum: m̄ λ̇ (k,).
    """
    # Accelerations without constraints, and M⁻¹aᵀ of every constraint.
    first = systems[0]
    a = np.array([system.gradient(q) for system in systems], dtype=float)
    right_sides = np.column_stack([first.generalised_force(t, q, v), a.T])
    solutions = np.linalg.solve(first.matrix(q), right_sides)
    free = solutions[:, 0]
    along = solutions[:, 1:]

    # m̄, c̄, k̄ and f̄ of (32), (33).
    masses = 1.0 / np.einsum("ri,ir->r", a, along)
    c = along * masses
    damping, stiffness, pull = _along(first, t, q, v, c)

    # The reactions that bring about φ̈ of (34).
    phi = np.array([system.rho(q) for system in systems])
    rate = np.asarray(a @ v)
    turning = np.array([system.turning(q, v) for system in systems])
    phi_acceleration = -(_slope(systems, q, v) * rate + damping * rate + stiffness * phi) / masses
    reaction = np.linalg.solve(a @ along, phi_acceleration - a @ free - turning)
    multiplier_rate = momentum / masses
    force = reaction - damping * multiplier_rate - stiffness * multiplier + pull
    return np.asarray(free + along @ reaction), reaction, multiplier_rate, force


def _along(system: ConstrainedSystem, t: float, q: Array, v: Array, c: Array) -> Array:
    """Return (c̄, k̄, f̄) of (32), (3, k).

    Args:
        system: whose force it is.
        t: time [s].
        q: coordinates (n,).
        v: their rates (n,).
        c: directions of the constraints (n, k).
    """
    values = np.zeros((3, c.shape[1]))
    force = system.force
    if force is None:
        return values
    for R, way in enumerate(c.T):
        # Central differences of the force along the direction, by h of q and by w of v.
        size = float(np.max(np.abs(way)))
        h = system.difference(q) / size
        w = system.difference(v) / size
        values[0, R] = -way @ (force(t, q, v + w * way) - force(t, q, v - w * way)) / (2.0 * w)
        values[1, R] = -way @ (force(t, q + h * way, v) - force(t, q - h * way, v)) / (2.0 * h)
        values[2, R] = way @ force(t, q, v)
    return values


def _slope(systems: Sequence[ConstrainedSystem], q: Array, v: Array) -> Array:
    """Return m̄˙ (k,) by a central difference along the motion."""
    size = float(np.max(np.abs(v)))
    if size == 0.0:
        return np.zeros(len(systems))
    h = systems[0].difference(q) / size

    def masses(place: Array) -> Array:
        """Return m̄ (k,) at coordinates (n,)."""
        M = systems[0].matrix(place)
        a = np.array([system.gradient(place) for system in systems], dtype=float)
        return np.asarray(1.0 / np.einsum("ri,ir->r", a, np.linalg.solve(M, a.T)))

    return (masses(q + h * v) - masses(q - h * v)) / (2.0 * h)
