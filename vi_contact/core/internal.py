"""Let the stress of a body be no linear function of its displacement.

    M u'' + C u' + p(u) = f(t),    W(u) the stored energy [J] with p = dW/du

``SemiDiscreteSystem.internal`` holds p, its tangent p' and W; K is then the *reference stiffness*,
by which static stages of a body at rest weigh, damping is made, and steps are solved between two
tangents. A linear body has none.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from .algebra import Algebra, Array, Matrix


class InternalForce(Protocol):
    """Say what stresses of a body do on its unknowns. All methods are collective."""

    def force(self, u: Array) -> Array:
        """Return p(u) (n,) [N] of the owned displacements (n,) [m]."""

    def energy(self, u: Array) -> float:
        """Return W(u) [J], of all ranks."""

    def tangent(self, u: Array) -> Matrix:
        """Return p'(u) (n, n) [N/m], with the pattern of K or one inside of it."""


@dataclass(frozen=True)
class InTurnedUnknowns:
    """Hold an internal force in the unknowns û of u = T û: Tᵀ p(T û), Tᵀ p'(T û) T, W(T û).

    Attributes:
        internal: in the unknowns u.
        T: the change of unknowns.
        algebra: that of the matrices.
    """

    internal: InternalForce
    T: Matrix
    algebra: Algebra

    def force(self, u: Array) -> Array:
        """Return Tᵀ p(T u) (n,) [N]."""
        return self.T.transpose_apply(self.internal.force(self.T @ u))

    def energy(self, u: Array) -> float:
        """Return W(T u) [J]."""
        return self.internal.energy(self.T @ u)

    def tangent(self, u: Array) -> Matrix:
        """Return Tᵀ p'(T u) T (n, n) [N/m]."""
        turned: Any = self.algebra.congruence(self.T, self.internal.tangent(self.T @ u))
        return turned
