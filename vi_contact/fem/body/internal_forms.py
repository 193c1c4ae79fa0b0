"""State the internal force of a body that is not linear by forms of the user's own.

    p(u)·v = internal(u; v),    p'(u) = its derivative in u,    W(u) = energy(u)

The derivative is UFL's. Forms are compiled once, and assembled anew at every u.
"""

from collections.abc import Callable
from typing import Any

import ufl

from ...core.algebra import Array, Matrix, total
from ...core.checks import on_all
from ...core.errors import InputError
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra
from ..matrices.petsc_rows import transfer
from .form_checks import form_of
from .space import FemSpace

NAME = "Forms: internal"


class InternalForms:
    """Assemble p, p' and W on the free unknowns (``core.internal.InternalForce``)."""

    def __init__(
        self,
        space: FemSpace,
        internal: Callable[[Any, Any], Any],
        energy: Callable[[Any], Any],
    ) -> None:
        """Compile the forms. Collective.

        Args:
            space: the body's unknowns, of which none is moved.
            internal: (u, v) -> UFL form, linear in the test function v and not in the Function u.
            energy: u -> UFL functional [J], whose derivative in u is ``internal``.

        Raises:
            InputError: what is no such form, and a support that moves.
        """
        if space.moves:
            raise InputError(
                f"{NAME} does not go with supports that move: hold them, and shake the body by "
                "excitation="
            )
        self._space = space
        self._u = compat.function(space.V)
        self._forces = compat.function(space.V)
        v = ufl.TestFunction(space.V)
        force = form_of(NAME, lambda v: internal(self._u, v), space, v)
        stored = form_of("Forms: energy", lambda: energy(self._u), space)
        du = ufl.TrialFunction(space.V)
        slope = on_all(space.comm, NAME, lambda: ufl.derivative(force, self._u, du))
        self._force = on_all(space.comm, NAME, lambda: space.compile_form(force))
        self._slope = on_all(space.comm, NAME, lambda: space.compile_form(slope))
        self._energy = on_all(space.comm, "Forms: energy", lambda: space.compile_form(stored))
        self._algebra = PetscAlgebra(space.comm.mpi)

    def _put(self, u: Array) -> None:
        """Write free unknowns (n,) into the Function of the forms, ghosts too. Collective."""
        full = self._space.expand(u, 0.0)  # nothing that is held moves: any time will do
        self._u.x.array[: full.size] = full.ravel()
        self._u.x.scatter_forward()

    def force(self, u: Array) -> Array:
        """Return p(u) (n,) [N]. Collective."""
        self._put(u)
        return self._assemble_force(self._force)

    def energy(self, u: Array) -> float:
        """Return W(u) [J], of all ranks. Collective."""
        self._put(u)
        return float(total(self._space.comm, compat.assemble_scalar(self._energy)))

    def tangent(self, u: Array) -> Matrix:
        """Return p'(u) (n, n) [N/m]. Collective."""
        self._put(u)
        return self._assemble_tangent(self._slope)

    def _assemble_force(self, form: Any) -> Array:
        """Return a linear form on the free unknowns (n,) [N]. Collective."""
        compat.assemble_into(form, self._forces)
        return self._space.pull(self._forces.x.array[: self._space.free.size].copy())

    def _assemble_tangent(self, form: Any) -> Matrix:
        """Return a bilinear form on the free unknowns (n, n) [N/m]. Collective."""
        full = compat.assemble_matrix(form)
        part = self._space.elimination.reduce(full)
        full.destroy()
        return self._algebra.store(transfer(part, self._algebra.comm.mpi))


def find_reference(space: FemSpace, internal: Callable[[Any, Any], Any]) -> Callable[..., Any]:
    """Return the form (u, v) of the stiffness at rest: the derivative of p at zero.

    Args:
        space: the body's unknowns.
        internal: (u, v) -> UFL form.
    """
    zero = compat.function(space.V)

    def stiffness(u: Any, v: Any) -> Any:
        return ufl.derivative(internal(zero, v), zero, u)

    return stiffness
