"""Alternate between normal and tangential problems with given forces.

First comes the normal problem with r_t given, then the tangential problem with r_n given.

The boundary method (docs/reference/sources.md [1]) carries tangential forces C_T that are given
(eq. 6); they enter the right-hand side, gamma of eq. 40, and what is left is the minimum of eq. 42
over normal reactions. With friction C_T is found by turns (Panagiotopoulos, Ing.-Arch. 44, 1975),
with the parts G_nn, G_nt, G_tt of the Delassus operator:

    normal        0 <= r_n  perpendicular to  (q_n + G_nt r_t) + G_nn r_n >= 0
                  r_t = C_T given
    tangential    minimum of ½ r_tᵀ G_tt r_t + r_t·(q_t + G_tn r_n) over |r_t| <= limit(r_n)
                  r_n given

Block Gauss-Seidel: under Tresca's law the exact minimum over one block after the other, which
converges for every G; under Coulomb's when coupling and friction are moderate, linearly.
``extrapolation`` acts on r_t.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from ..normal.active_set import ActiveSet
from .extrapolation import Extrapolation, Plain, accelerated
from .newton import FrictionNewton
from .problem import (
    FrictionMethod,
    Iterated,
    PreparedFriction,
    ScaledDelassus,
    ScaledProblem,
    Settings,
    inner_method,
)


@dataclass(frozen=True)
class GivenForces(Settings):
    """Hold the settings.

    ``tolerance``: change of r_t over the largest; ``tangential``: method of tangential problems.

    In the result ``iterations`` counts pairs of problems and ``history`` the relative change in
    each.
    """

    tolerance: float = 1e-11
    tangential: FrictionMethod = field(default_factory=FrictionNewton)
    extrapolation: Extrapolation = field(default_factory=Plain)

    def __post_init__(self) -> None:
        super().__post_init__()
        inner_method("GivenForces", "tangential", self.tangential)
        accelerated("GivenForces", self.extrapolation)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d)."""
        delassus = ScaledDelassus(G, bilateral)
        d, matrix = delassus.dimension, delassus.matrix
        normal = ActiveSet().prepare(matrix[::d, ::d].copy(), bilateral)
        apart = matrix.copy()  # normal unknowns out of reach of the tangential problem
        apart[::d], apart[:, ::d] = 0.0, 0.0
        np.fill_diagonal(apart[::d, ::d], 1.0)
        tangential = self.tangential.prepare(apart, np.zeros_like(bilateral))
        return PreparedFriction(
            self, 100.0 * self.tolerance, delassus, partial(self._loop, normal, tangential)
        )

    def _loop(self, normal: Any, tangential: Any, step: ScaledProblem, r: Array) -> Iterated:
        """Alternate the two prepared problems."""
        following, none = self.extrapolation.start(), np.zeros(step.count)
        history: list[float] = []
        while step.unit > 0.0 and len(history) < self.max_iterations:
            given, active = r[:, 1:].copy(), r[:, 0] > 0.0
            r[:, 0] = 0.0
            r[:, 0] = normal.solve(step.w(r)[:, 0], active).r
            r[:, 1:] = 0.0
            w = step.w(r)
            w[:, 0] = np.inf
            r[:, 1:] = tangential.solve(w, step.limit(r[:, 0]), none).r[:, 1:]
            size = max(max_abs(r[:, 1:]), max_abs(given))
            history.append(max_abs(r[:, 1:] - given) / size if size else 0.0)
            if history[-1] <= self.tolerance:
                break
            r[:, 1:] = following(given.ravel(), r[:, 1:].ravel()).reshape(given.shape)
        return r, len(history), history
