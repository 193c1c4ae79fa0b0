"""Let the stress of a body be no linear function of its displacement.

    M u'' + C u' + p(u) = f(t),    W(u) the stored energy [J] with p = dW/du

``SemiDiscreteSystem.internal`` holds p, its tangent p' and W; K is then the *reference stiffness*,
by which static stages of a body at rest weigh, damping is made, and steps are solved between two
tangents. A linear body has none.

The force may depend on the past too, as that of a material that yields. Such a ``RememberingForce``
makes the force of the next steps from the memory of a state (``State.memory``), and what it
remembers at the end of a step goes into the memory of the next state when the step is accepted.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from .algebra import Algebra, Array, Indices, Matrix

MATERIAL = "material_"
"""How names of what materials remember begin, in the memory of a state."""


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

    def turn_on(self, u0: Array, u1: Array) -> Array:
        """Return where u1 (n,) [m] would be if bodies turned on their way from u0.

        Passes begin there.
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


class RememberingForce(InternalForce, Protocol):
    """Let the internal force depend on the past: p(u) is that after the way from a state to u.

    By itself it is the force of a body that is new and unstrained; ``go_on`` makes that of another
    state. Nothing is changed by asking: a step that is thrown away leaves no trace. All methods are
    collective.
    """

    def go_on(self, memory: Mapping[str, Array], u: Array) -> "RememberingForce":
        """Return the force of steps from a state.

        Args:
            memory: of the state; without names of ``MATERIAL`` the body is new, and unstrained.
            u: displacement (n,) [m] of the state.
        """

    def find_cells(self, name: str) -> Indices:
        """Return numbers of the owned cells (rows,) of an array of the memory.

        They do not depend on the ranks: a checkpoint has the rows in their order.
        """

    def find_middles(self, name: str) -> Array:
        """Return the middles (rows, d) [m] of the owned cells of an array of the memory."""

    def fits(self, memory: Mapping[str, Array]) -> bool:
        """Say whether a memory has the arrays of this body on this rank, in their shapes."""

    def remember(self, u: Array) -> Mapping[str, Array]:
        """Return the memory at u: names that begin with ``MATERIAL`` -> rows (owned cells, …)."""

    def dissipation(self, u: Array) -> float:
        """Return what the way to u dissipates [J], of all ranks, >= 0."""

    def remainder(self, u: Array) -> float:
        """Return R [J] of the way to u: p(u)·Δu = ΔW + dissipation + R, by its own formula."""

    def residual(self, u: Array) -> float:
        """Return the largest residual of the laws of the material, a pure number, of all ranks."""


def remembers(internal: InternalForce | None) -> bool:
    """Say whether an internal force depends on the past."""
    return hasattr(internal, "go_on")


def select_memory(memory: Mapping[str, Array]) -> dict[str, Array]:
    """Return what materials have put into the memory of a state."""
    return {name: value for name, value in memory.items() if name.startswith(MATERIAL)}


class RememberingInTurnedUnknowns(InTurnedUnknowns):
    """Hold an internal force that depends on the past, in the unknowns û."""

    internal: RememberingForce

    def go_on(self, memory: Mapping[str, Array], u: Array) -> "RememberingInTurnedUnknowns":
        """Return the force of steps from a state.

        Args:
            memory: of the state.
            u: displacement (n,) of the state.
        """
        standing = self.internal.go_on(memory, self.T @ u)
        return RememberingInTurnedUnknowns(standing, self.T, self.algebra)

    def whole_tangent(self, u: Array) -> Matrix:
        """Return Tᵀ p'(T u) T (n, n) [N/m], where p' may be no symmetric matrix."""
        internal: Any = self.internal  # which has one where its laws say so
        turned: Any = self.algebra.congruence(self.T, internal.whole_tangent(self.T @ u))
        return turned

    def find_cells(self, name: str) -> Indices:
        """Return numbers of the owned cells of an array of the memory: cells do not turn."""
        return self.internal.find_cells(name)

    def find_middles(self, name: str) -> Array:
        """Return the middles of the owned cells of an array of the memory [m]."""
        return self.internal.find_middles(name)

    def fits(self, memory: Mapping[str, Array]) -> bool:
        """Say whether a memory has the arrays of this body on this rank, in their shapes."""
        return self.internal.fits(memory)

    def remember(self, u: Array) -> Mapping[str, Array]:
        """Return the memory at u."""
        return self.internal.remember(self.T @ u)

    def dissipation(self, u: Array) -> float:
        """Return what the way to u dissipates [J]."""
        return self.internal.dissipation(self.T @ u)

    def remainder(self, u: Array) -> float:
        """Return R of the way to u [J]."""
        return self.internal.remainder(self.T @ u)

    def residual(self, u: Array) -> float:
        """Return the largest residual of the laws of the material."""
        return self.internal.residual(self.T @ u)


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

    def turn_on(self, u0: Array, u1: Array) -> Array:
        """Return the place in the unknowns û, Tᵀ u (n,) [m], as T turns axes."""
        return self.T.transpose_apply(self.internal.turn_on(self.T @ u0, self.T @ u1))


def turns(internal: InternalForce | None) -> bool:
    """Tell whether an internal force is that of a body that turns."""
    return hasattr(internal, "between")


def turn_force(
    internal: InternalForce | None, T: Matrix, algebra: Algebra
) -> InTurnedUnknowns | None:
    """Return an internal force in the unknowns û of u = T û; None for None.

    Args:
        internal: in the unknowns u.
        T: the change of unknowns.
        algebra: that of the matrices.
    """
    if internal is None:
        return None
    kind: Any = InTurnedUnknowns
    if remembers(internal):
        kind = RememberingInTurnedUnknowns
    elif turns(internal):
        kind = BetweenTurnedUnknowns
    turned: InTurnedUnknowns = kind(internal, T, algebra)
    return turned
