"""Alternate between the normal problem with r_t given and the tangential one with r_n given.

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
from .extrapolation import Extrapolation, Plain, check_extrapolation
from .newton import FrictionNewton
from .problem import (
    FrictionMethod,
    LastIterate,
    PreparedFriction,
    ScaledDelassus,
    ScaledProblem,
    Settings,
    check_inner_method,
)

LOOSE = 100.0  # times the tolerance: residual that an answer may have


@dataclass(frozen=True)
class GivenForces(Settings):
    """Hold the settings of the alternation.

    In the result ``iterations`` counts pairs of problems and ``history`` the relative change of r_t
    in each.

    Attributes:
        tolerance: change of r_t over the largest.
        max_iterations: number of pairs, at most.
        tangential: the method of tangential problems.
        extrapolation: how the next r_t follows: Plain() or Anderson().
    """

    tolerance: float = 1e-11
    tangential: FrictionMethod = field(default_factory=FrictionNewton)
    extrapolation: Extrapolation = field(default_factory=Plain)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_inner_method("GivenForces", "tangential", self.tangential)
        check_extrapolation("GivenForces", self.extrapolation)

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d); ``bilateral`` (m,) says which rows are bilateral."""
        delassus = ScaledDelassus(G, bilateral)
        d = delassus.dimension
        matrix = delassus.matrix
        normal = ActiveSet().prepare(matrix[::d, ::d].copy(), bilateral)

        # In the matrix of the tangential problem normal unknowns have nothing to do with it.
        apart = matrix.copy()
        apart[::d] = 0.0
        apart[:, ::d] = 0.0
        np.fill_diagonal(apart[::d, ::d], 1.0)
        tangential = self.tangential.prepare(apart, np.zeros_like(bilateral))
        loop = partial(self._iterate, normal, tangential)
        return PreparedFriction(self, LOOSE * self.tolerance, delassus, loop)

    def _iterate(self, normal: Any, tangential: Any, step: ScaledProblem, r: Array) -> LastIterate:
        """Alternate the two problems from r (m, d), which is overwritten.

        Args:
            normal: the prepared normal problem.
            tangential: the prepared tangential problem.
            step: the problem.
            r: (m, d) reactions to start from, scaled.
        """
        choose_next = self.extrapolation.start()
        none = np.zeros(step.count)
        history: list[float] = []
        while step.unit > 0.0 and len(history) < self.max_iterations:
            given = r[:, 1:].copy()

            # Normal: the gaps without r_n, with r_t given.
            active = r[:, 0] > 0.0
            r[:, 0] = 0.0
            r[:, 0] = normal.solve(step.w(r)[:, 0], active).r

            # Tangential: the slips without r_t, with r_n and so the thresholds given. Gaps that
            # never close leave the normal unknowns of that problem at zero.
            r[:, 1:] = 0.0
            w = step.w(r)
            w[:, 0] = np.inf
            r[:, 1:] = tangential.solve(w, step.limit(r[:, 0]), none).r[:, 1:]

            size = max(max_abs(r[:, 1:]), max_abs(given))
            history.append(max_abs(r[:, 1:] - given) / size if size else 0.0)
            if history[-1] <= self.tolerance:
                break
            r[:, 1:] = choose_next(given.ravel(), r[:, 1:].ravel()).reshape(given.shape)
        return LastIterate(r, len(history), history)
