"""Strain a body before it has stresses.

This is by temperature, swelling, given dislocations (boundary method, eq. 25).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
import ufl

from ...core.algebra import Array, total
from ...core.checks import array, function, optional, shape_of, shown
from ...core.errors import InputError
from ...core.quantities import RATIO
from ...laws.materials import PlaneStress
from .. import compat
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells
from .forms import ElasticForms
from .loads import ActingLoad, evaluate


@dataclass(frozen=True)
class InitialStrain(ActingLoad):
    """Apply an initial strain eps_0(x, t) as the load ∫ C eps_0 : eps(v).

    sigma = C (eps(u) - eps_0).

    Warming by T - T_0 is alpha (T - T_0) in all directions. A dislocation, a given jump b [m]
    across a surface with the normal n, is the tensor b⊗n / h in a layer of cells of height h (Mura,
    Micromechanics of Defects in Solids, 1987, ch. 1). In a cell eps_0 is interpolated as
    ``as_function`` projects stresses, by a constant in P1 and where the integration is selective:
    what displacements of this degree can follow leaves a free body without stress. Stresses,
    reactions, section forces and the energy ledger go by eps(u) - eps_0, damping by the rates of u.

    Args:
        value: the strain of all directions, across the plane too, or a tensor, of which the
            symmetric part counts, (d, d) or in the plane (3, 3); or a function of points (k, d) [m]
            and the time [s] -> (k,), (k, d, d) or in the plane (k, 3, 3), which is asked at t = 0 s
            when a body is assembled. A bar is held sideways: warming then lengthens it by (1 +
            nu)/(1 - nu) alpha (T - T_0); nu = 0 is a bar with free sides.
        history: factor s(t) of the value at t = 0 s.
        cells: the part of the body that is strained.

    Raises:
        InputError: values of other shapes, NaN; beside forms=… of the user's own, which do not tell
            C.
    """

    # the value as it is given
    value: Annotated[float | Sequence[Sequence[float]] | Callable[[Array, float], Array], RATIO]  # type: ignore[assignment]
    history: Callable[[float], float] | None = None
    cells: Cells | None = None

    def __post_init__(self) -> None:
        optional(
            function,
            "InitialStrain",
            "history",
            self.history,
            "give a function of the time [s], or None",
        )
        optional(cells_of, "InitialStrain", "cells", self.cells)
        if not callable(self.value):
            dimensions = (1, 2, 3) if self.cells is None else (self.cells.mesh.geometry.dim,)
            _tensors("InitialStrain", self.value, (), dimensions)

    def at(self, points: Array, room: Array, t: float) -> Array:
        """Return the tensors at points (k, d), less the history.

        They are in the shape (k, 9) of the room.

        Args:
            points: (k, d) [m].
            room: (k, 9) where the tensors are written.
            t: time [s].
        """
        value: Any = (
            self.value(points, 0.0 if self.history else t) if callable(self.value) else self.value
        )
        at_points = (len(points),) if callable(self.value) else ()
        found = _tensors(f"InitialStrain at t = {t:g} s", value, at_points, points.shape[1:])
        whole = np.zeros((len(points), 3, 3))
        whole[:, : found.shape[-1], : found.shape[-1]] = found
        if points.shape[1] == 2 and (whole + whole.swapaxes(1, 2))[:, 2, :2].any():
            raise InputError(
                "InitialStrain: value shears across the plane (xz or yz), where a body in the "
                "plane does not move; give zero there, or a body in space"
            )
        return whole.reshape(room.shape)


def _tensors(
    owner: str, value: Any, leading: tuple[int, ...], dimensions: tuple[int, ...]
) -> Array:
    """Return strains, one or one at each point, as tensors.

    Args:
        owner: who asks.
        value: what was given.
        leading: () for one strain, (k,) for one at each point.
        dimensions: those that a body may have.

    Raises:
        InputError: none of these dimensions has the shape.
    """
    shape = shape_of(value)
    if shape != leading and shape not in {
        (*leading, n, n) for d in dimensions for n in (d, 3 if d == 2 else d)
    }:
        what = f"is {shown(value)}" if -1 in shape else f"has shape {shape}"
        ask, k = (
            (f"numbers ({leading[0]},), tensors", f"{leading[0]}, ")
            if leading
            else ("a number, a tensor", "")
        )
        raise InputError(f"{owner}: value {what}; give {ask} ({k}d, d) or in the plane ({k}3, 3)")
    found = array(owner, "value", value, shape)
    return np.multiply.outer(found, np.eye(3)) if shape == leading else found


class InitialStrains:
    """Hold the sum of the initial strains of a body at a time. Collective.

    This is the sum as tensors (3, 3), its load and energy.
    """

    def __init__(self, body: ElasticForms, given: Sequence[InitialStrain]) -> None:
        self._space = body.space
        self._body = body
        self._given = given
        mesh = body.space.mesh
        degree = 0 if body.dilatation else self._space.degree - compat.is_simplex(mesh)
        self.tensors = compat.lagrange(mesh, degree, (3, 3), continuous=False)
        self._field = compat.function(self.tensors)
        cell = ufl.TestFunction(compat.cell_space(mesh))
        self.parts = own, across = self._split(self._field)
        sigma, beyond = body.hooke(own, across, ufl.tr(own))
        self._work = self._space.compile_form(ufl.inner(sigma, ufl.sym(ufl.grad(body.v))) * ufl.dx)
        self._energy = self._space.compile_form(
            0.5 * (ufl.inner(sigma, own) + beyond * across) * cell * ufl.dx
        )
        self._still: tuple[Array, float] | None = (
            None  # what ``energy`` takes of strains that never change
        )
        for one in given:
            self.follow(0.0, only=one)  # tells of wrong functions before there is any work

    def _split(self, eps: Any) -> tuple[Any, Any]:
        """Return (strain (d, d), that across the plane, none in plane stress) of tensors."""
        d = self._space.dimension
        panel = isinstance(self._body.section, PlaneStress)
        free = d != 2 or panel
        if d == 1:
            # A bar cannot strain sideways, as its stiffness says: what is held there presses along
            # it.
            lame = self._body.fields["lame"]
            shear = self._body.fields["shear"]
            sides = eps[1, 1] if panel else eps[1, 1] + eps[2, 2]
            return ufl.as_tensor([[eps[0, 0] + lame / (lame + 2 * shear) * sides]]), 0.0
        return ufl.sym(
            ufl.as_tensor([[eps[i, j] for j in range(d)] for i in range(d)])
        ), 0.0 if free else eps[2, 2]

    def against(self, r: Any, inside: Any) -> Any:
        """Return -rᵀf_0 of the cells inside as a linear form.

        Its products are with what ``follow`` returns.
        """
        own, across = self._split(ufl.TestFunction(self.tensors))
        return (
            -inside
            * ufl.inner(self._body.hooke(own, across, ufl.tr(own))[0], ufl.sym(ufl.grad(r)))
            * ufl.dx
        )

    def follow(self, t: float, *, only: InitialStrain | None = None) -> Array:
        """Sum up the strains at a time, or one of them less its history.

        Returned are the owned values.
        """
        points = self.tensors.tabulate_dof_coordinates()
        blocks = compat.cell_blocks(self.tensors)
        values = self._field.x.array.reshape(-1, 9)
        values[:] = 0.0
        for one in self._given if only is None else (only,):
            part = one.cells and cells_of("InitialStrain", "cells", one.cells, self._space.mesh)
            where = np.ravel(blocks[part.indices] if part else blocks)
            at = partial(one.at, points[where, : self._space.dimension])
            found = evaluate("InitialStrain", at, np.empty((len(where), 9)), t, self._space.comm)
            values[where] += found if only or one.history is None else one.history(t) * found
        return values[: self.tensors.dofmap.index_map.size_local].ravel()

    def forces(self, t: float, *, only: InitialStrain | None = None) -> Array:
        """Return the load on the free unknowns, of all strains or of one less its history."""
        self.follow(t, only=only)
        return self._space.pull(compat.assemble_vector(self._work).array_r)

    def energy(self, u: Array, t: float) -> float:
        """Return ½ ∫ eps_0 : C eps_0 - f_0·u [J], what they add to ½ uᵀKu of the free unknowns."""
        found = self._still or (
            self.forces(t),
            float(compat.assemble_vector(self._energy).array_r.sum()),
        )
        if not any(one.history or callable(one.value) for one in self._given):
            self._still = found
        return total(self._space.comm, found[1] - found[0] @ u)
