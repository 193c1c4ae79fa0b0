"""Condense with friction: the Delassus operator of normal and tangential contact unknowns together.

With the unit vectors E of the normal and F of the tangential unknowns, x_free = A⁻¹b and D = [E F]:

    G = DᵀA⁻¹D (+ compliance/scale on the normal diagonal),    node by node: r_n, then r_t
    q_n = bound - Eᵀx_free,   q_t = slip0 - Fᵀx_free             gap, and minus the slip, without reactions
    the small problem of ``problem`` gives r;   x = A⁻¹(b - E r_n - F r_t)

A law that depends on the slip rate makes this a sequence of such problems: ``slip_rate``.

Tangential unknowns that are prescribed carry no reaction: their rows are replaced by those of a free spring.
"""

from __future__ import annotations

import numpy as np

from ...core.algebra import Array, EffectiveMatrix, Indices, Mask
from ...core.step import StepProblem
from ...core.surfaces import ContactSurface
from .problem import FrictionMethod, FrictionResult
from .slip_rate import RateIteration


class CondensedFriction:
    """Solve the small problem with friction of one A. ``normal`` (m, m): the Delassus operator of the normal unknowns.

    ``columns``: A⁻¹F, the owned rows, when they are to be kept.
    """

    def __init__(
        self, method: FrictionMethod, A: EffectiveMatrix, surface: ContactSurface, normal: Array, *,
        rates: RateIteration, keep: bool,
    ) -> None:
        self._surface, self._rates = surface, rates
        m, k = surface.total, surface.tangents.shape[1]
        free = surface.tangents >= 0
        places = (surface.slots[:, None] * k + np.arange(k))[free]
        wanted = np.concatenate([surface.owned, surface.tangents[free]])
        columns = A.factor.solve_units(surface.tangents[free], places, m * k, None if keep else wanted)
        self.delassus = self._assembled(normal, columns[wanted] if keep else columns, places, free)
        self.columns = columns if keep else np.zeros((0, 0))
        self._small = method.prepare(self.delassus, surface.everywhere(surface.bilateral))

    def _assembled(self, normal: Array, columns: Array, places: Indices, free: Mask) -> Array:
        """G (m d, m d), symmetrised. ``columns``: the rows of A⁻¹F of normal unknowns, then of tangential ones."""
        surface, (m, k) = self._surface, (self._surface.total, self._surface.tangents.shape[1])
        rows = np.zeros((m + m * k, m * k))
        rows[surface.slots] = columns[: surface.count]
        rows[m + places] = columns[surface.count :]
        present = np.zeros(m * k)
        present[places] = 1.0
        total = surface.comm.sum(np.vstack([rows, present]))
        coupling, tangential = total[:m], 0.5 * (total[m:-1] + total[m:-1].T)
        tangential[np.diag_indices(m * k)] += (1.0 - total[-1]) * np.repeat(normal.diagonal(), k)
        G = np.empty((m, 1 + k, m, 1 + k))
        G[:, 0, :, 0] = normal
        G[:, 0, :, 1:] = coupling.reshape(m, m, k)
        G[:, 1:, :, 0] = coupling.T.reshape(m, k, m)
        G[:, 1:, :, 1:] = tangential.reshape(m, k, m, k)
        return G.reshape(m * (1 + k), m * (1 + k))

    def solve(self, step: StepProblem, x_free: Array) -> FrictionResult:
        """Return the reactions of a step."""
        surface, law = self._surface, step.friction
        gap = step.bound - surface.normal_values(x_free)
        slip = surface.tangential_values(x_free) - origin(step)
        none = np.zeros(surface.count)
        rest = step.friction_at(np.zeros_like(slip))
        cohesion, slope = rest.limit(none, surface.weights, step.scale), rest.slope(surface.weights)
        whole = surface.everywhere(np.column_stack([gap, -slip, cohesion, slope, step.active]))
        q, (cohesion, slope, closed) = np.ascontiguousarray(whole[:, :-3]), whole[:, -3:].T
        active = closed > 0.0
        if rest is law:
            return self._small.solve(q, cohesion, slope, active)

        def solved(mu: Array, before: FrictionResult | None) -> FrictionResult:
            return self._small.solve(q, cohesion, mu, active if before is None else before.r)

        def coefficients(found: FrictionResult) -> Array:
            rates = step.friction_at(self._slip(q, found)[surface.slots])
            return np.asarray(surface.everywhere(rates.slope(surface.weights)))

        return self._rates.solve(slope, solved, coefficients)

    def _slip(self, q: Array, found: FrictionResult) -> Array:
        """B_t x - slip0 (m, d - 1) of points that rub, exactly zero where they stick."""
        w = q[:, 1:] + (self.delassus @ found.r.ravel()).reshape(q.shape)[:, 1:]
        return np.where(((found.r[:, 0] > 0.0) & ~found.stick)[:, None], -w, 0.0)

    def hold_sticking(self, x: Array, step: StepProblem, small: FrictionResult) -> None:
        """Put the tangential unknowns of sticking points where they were, which removes round-off only."""
        tangents = self._surface.tangents
        there = (tangents >= 0) & small.stick[self._surface.slots][:, None]
        x[tangents[there]] = origin(step)[there]


def origin(step: StepProblem) -> Array:
    """Return B_t x where the slip is zero."""
    assert step.slip0 is not None
    return step.slip0
