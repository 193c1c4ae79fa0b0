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


class TwoEndForce(InternalForce, Protocol):
    """Say it of a body that turns, with one internal force of both ends of a step.

    Its work is the change of the stored energy, (u1 - u0)·p̄(u0, u1) = W(u1) - W(u0), and it has
    neither a resultant nor a moment about the places in the middle of the step.
    """

    def between(self, u0: Array, u1: Array) -> Array:
        """Return p̄(u0, u1) (n,) [N]."""

    def between_tangent(self, u0: Array, u1: Array) -> Matrix:
        """Return about how p̄ changes with ½ (u0 + u1), (n, n) [N/m], symmetric.

        Passes are solved with it. It decides how many there are, and nothing of the answer.
        """


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


@dataclass(frozen=True)
class BetweenTurnedUnknowns(InTurnedUnknowns):
    """Hold the internal force of a body that turns alike: Tᵀ p̄(T û0, T û1)."""

    internal: TwoEndForce

    def between(self, u0: Array, u1: Array) -> Array:
        """Return Tᵀ p̄(T u0, T u1) (n,) [N]."""
        return self.T.transpose_apply(self.internal.between(self.T @ u0, self.T @ u1))

    def between_tangent(self, u0: Array, u1: Array) -> Matrix:
        """Return the derivative in the unknowns û (n, n) [N/m]."""
        tangent = self.internal.between_tangent(self.T @ u0, self.T @ u1)
        turned: Any = self.algebra.congruence(self.T, tangent)
        return turned


def turns(internal: InternalForce | None) -> bool:
    """Tell whether an internal force is that of a body that turns."""
    return hasattr(internal, "between")


def in_unknowns(internal: InternalForce, T: Matrix, algebra: Algebra) -> InternalForce:
    """Return an internal force in the unknowns û of u = T û.

    Args:
        internal: in the unknowns u.
        T: the change of unknowns.
        algebra: that of the matrices.
    """
    kind: Any = BetweenTurnedUnknowns if turns(internal) else InTurnedUnknowns
    turned: InternalForce = kind(internal, T, algebra)
    return turned
