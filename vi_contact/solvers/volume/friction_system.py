"""The step with Tresca's thresholds s given, as a mixed complementarity problem in simple bounds (solver notes 3f).

The tangential reactions lambda = r_t are unknowns beside the z of volume_system.py. A point that has one free tangent
(2D) carries

    F_lambda = slip0 - B_t x,     -s <= lambda <= s:     0 where lambda is inside, <= 0 where lambda = s, >= 0 at -s

which is |r_t| <= s, r_t along the slip. A point with two (3D) carries the disk itself, no polygon: with the speed
factor gamma >= 0 of the slip, slip = gamma r_t,

    F_lambda = slip0 - B_t x + gamma lambda = 0,     F_gamma = (s² - |lambda|²)/s >= 0  ⊥  gamma >= 0.

The equations of the body gain B_tᵀ lambda. Where s = 0 the bounds hold lambda and gamma at zero. In 2D everything is
linear and monotone; 3D has one solution too, the multiplier of a convex problem. The Jacobian is not symmetric.

VINEWTONRSLS reads its next active set off the signs of F after a projection. F_lambda knows nothing of the projected
lambda, F_gamma nothing of the projected gamma: both are zero but for rounding there, and the iteration would cycle, or
end by luck. So SNES sees, with the diagonal c of A and E the residual of the body, which vanish at the solution,

    F_lambda + E_t / c      and      F_gamma + c lambda·F_lambda / s,

whose signs after a projection say how far the unknown had gone beyond: the rule of the primal-dual active set method.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...core.algebra import Array, Mask
from ...core.step import StepProblem
from .bounded_system import BoundedSystem


class RubbingSystem:
    """Unknowns of a rank: z of ``body``, then lambda of the free tangents, point by point, then gamma.

    Attributes:
        point, tangent, stiffness: (L,) local contact point, position in x and diagonal entry of A of each lambda.
        disk: (local) True for points with two free tangents; ``any_disk``: whether some rank has one.
        pairs: (D, 2) places of their lambdas; line: (L,) True for the other lambdas.
    """

    def __init__(self, body: BoundedSystem) -> None:
        self.body, self.surface = body, body.surface
        free = body.surface.tangents >= 0
        self.point, self.component = np.nonzero(free)
        self.tangent = body.surface.tangents[free]
        self.disk: Mask = free.sum(axis=1) > 1
        self.pairs = np.flatnonzero(self.disk[self.point]).reshape(-1, 2)
        self.line: Mask = ~self.disk[self.point]
        self.first_gamma = body.size + len(self.tangent)
        self.size = self.first_gamma + len(self.pairs)
        self.any_disk = bool(body.max(float(len(self.pairs)))[0])
        self.stiffness = body.A.matrix.diagonal()[self.tangent]

    @property
    def comm(self) -> Any:
        """The PETSc communicator."""
        return self.body.comm

    def split(self, y: Array) -> tuple[Array, Array, Array]:
        """(z, lambda, gamma)."""
        return y[: self.body.size], y[self.body.size : self.first_gamma], y[self.first_gamma :]

    def origin(self, step: StepProblem) -> Array:
        """(L,) x of the free tangents where the slip is zero."""
        assert step.slip0 is not None
        return np.asarray(step.slip0[self.surface.slots][self.point, self.component])

    def by_point(self, values: Array) -> Array:
        """(local, d - 1) of values (L,), zero where a tangent is prescribed."""
        table = np.zeros(self.surface.tangents.shape)
        table[self.point, self.component] = values
        return table

    def shared(self, values: Array) -> Array:
        """Values (L,) -> (m, d - 1), the same on all ranks."""
        table = np.zeros((self.surface.count, self.surface.tangents.shape[1]))
        table[self.surface.slots] = self.by_point(values)
        return self.surface.comm.sum(table)
