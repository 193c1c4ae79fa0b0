"""Strain a body before it has stresses: by temperature, swelling or given dislocations.

    sigma = C (eps(u) - eps_0),   f_0 = ∫ C eps_0 : eps(v)     (boundary method, eq. 25)

Strains are kept as tensors (3, 3) of discontinuous fields, nine values at a point in a row.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
import ufl

from ...core.algebra import Array, total
from ...core.checks import array, find_shape, function, optional, quote
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
    value: Annotated[  # type: ignore[assignment]
        float | Sequence[Sequence[float]] | Callable[[Array, float], Array], RATIO
    ]
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
            _make_tensors("InitialStrain", self.value, (), dimensions)

    def at(self, points: Array, room: Array, t: float) -> Array:
        """Return the strains at points, less the history, as ``loads.evaluate`` asks for them.

        Args:
            points: (k, d) [m].
            room: (k, 9) of the shape that is wanted; nothing is written there.
            t: time [s].

        Returns:
            (k, 9) tensors, row by row.

        Raises:
            InputError: values of another shape, and shears across the plane of a body.
        """
        # one strain, or one at each point
        value: Any = self.value
        leading: tuple[int, ...] = ()
        if callable(self.value):
            value = self.value(points, 0.0 if self.history else t)
            leading = (len(points),)
        strains = _make_tensors(f"InitialStrain at t = {t:g} s", value, leading, points.shape[1:])

        # a tensor (d, d) is the corner of one (3, 3) that is zero beside it
        whole = np.zeros((len(points), 3, 3))
        whole[:, : strains.shape[-1], : strains.shape[-1]] = strains
        if points.shape[1] == 2 and (whole + whole.swapaxes(1, 2))[:, 2, :2].any():
            raise InputError(
                "InitialStrain: value shears across the plane (xz or yz), where a body in the "
                "plane does not move; give zero there, or a body in space"
            )
        return whole.reshape(room.shape)


def _make_tensors(
    owner: str, value: Any, leading: tuple[int, ...], dimensions: tuple[int, ...]
) -> Array:
    """Return strains as tensors (*leading, n, n): a number is that times the identity (3, 3).

    Args:
        owner: who asks.
        value: what was given: numbers, tensors (d, d), or in the plane (3, 3).
        leading: () for one strain, (k,) for one at each point.
        dimensions: those that a body may have.

    Raises:
        InputError: none of these dimensions has the shape.
    """
    shape = find_shape(value)
    sizes = {*dimensions, *(3 for d in dimensions if d == 2)}
    if shape != leading and shape not in {(*leading, n, n) for n in sizes}:
        fault = f"is {quote(value)}" if -1 in shape else f"has shape {shape}"
        remedy = "a number, a tensor (d, d) or in the plane (3, 3)"
        if leading:
            k = leading[0]
            remedy = f"numbers ({k},), tensors ({k}, d, d) or in the plane ({k}, 3, 3)"
        raise InputError(f"{owner}: value {fault}; give {remedy}")
    strains = array(owner, "value", value, shape)
    return np.multiply.outer(strains, np.eye(3)) if shape == leading else strains


class InitialStrains:
    """Hold the sum of the initial strains of a body at a time, its load and its energy. Collective.

    Attributes:
        tensors: the space of strains (3, 3): constant in a cell of P1 and with selective
            integration, else of the degree of u, on simplices one less.
        parts: the sum eps_0 of a time as forms take it, ``_split``.
    """

    def __init__(self, body: ElasticForms, given: Sequence[InitialStrain]) -> None:
        """Compile the forms of load and energy, and ask every strain once. Collective.

        Args:
            body: the forms, which tell C.
            given: the strains.

        Raises:
            InputError: on all ranks, values of other shapes, and NaN.
        """
        self._space = body.space
        self._body = body
        self._given = given
        mesh = body.space.mesh
        degree = self._space.degree
        if compat.is_simplex(mesh):
            degree = self._space.degree - 1
        if body.dilatation:
            degree = 0
        self.tensors = compat.lagrange(mesh, degree, (3, 3), continuous=False)
        self._field = compat.function(self.tensors)
        # load f_0 = ∫ C eps_0 : eps(v), and energy ½ ∫ eps_0 : C eps_0 of each cell
        cell = ufl.TestFunction(compat.cell_space(mesh))
        self.parts = own, across = self._split(self._field)
        sigma, beyond = body.hooke(own, across, ufl.tr(own))
        self._work = self._space.compile_form(ufl.inner(sigma, ufl.sym(ufl.grad(body.v))) * ufl.dx)
        self._energy = self._space.compile_form(
            0.5 * (ufl.inner(sigma, own) + beyond * across) * cell * ufl.dx
        )
        # load and energy of strains that never change, once they are known
        self._still: tuple[Array, float] | None = None
        for strain in given:
            self.follow(0.0, only=strain)  # tells of wrong functions before there is any work

    def _split(self, eps: Any) -> tuple[Any, Any]:
        """Return strain (d, d) and strain across the plane that act as tensors (3, 3) do.

        Across the plane a body is held in plane strain only.

        Args:
            eps: (3, 3) tensors.
        """
        d = self._space.dimension
        panel = isinstance(self._body.section, PlaneStress)
        if d == 1:
            # a bar cannot strain sideways, as its stiffness says: what is held there presses along
            # it
            lame = self._body.fields["lame"]
            shear = self._body.fields["shear"]
            sides = eps[1, 1] if panel else eps[1, 1] + eps[2, 2]
            return ufl.as_tensor([[eps[0, 0] + lame / (lame + 2 * shear) * sides]]), 0.0
        rows = []
        for i in range(d):
            rows.append([eps[i, j] for j in range(d)])
        held = d == 2 and not panel
        return ufl.sym(ufl.as_tensor(rows)), eps[2, 2] if held else 0.0

    def against(self, r: Any, inside: Any) -> Any:
        """Return -rᵀf_0 of the cells inside, as a linear form in the strains.

        Its product with what ``follow`` returns is the number.

        Args:
            r: a Function of displacements.
            inside: one in the cells that count, zero in others.
        """
        own, across = self._split(ufl.TestFunction(self.tensors))
        sigma, _ = self._body.hooke(own, across, ufl.tr(own))
        return -inside * ufl.inner(sigma, ufl.sym(ufl.grad(r))) * ufl.dx

    def follow(self, t: float, *, only: InitialStrain | None = None) -> Array:
        """Sum up the strains at a time, and return the owned values (points 9,). Collective.

        Args:
            t: time [s].
            only: this strain alone, less its history; the sum of all when None.
        """
        points = self.tensors.tabulate_dof_coordinates()
        blocks = compat.cell_blocks(self.tensors)
        values = self._field.x.array.reshape(-1, 9)
        values[:] = 0.0
        for strain in self._given if only is None else (only,):
            # evaluated at the points of its cells, on all ranks or none
            where = np.ravel(blocks)
            if strain.cells is not None:
                part = cells_of("InitialStrain", "cells", strain.cells, self._space.mesh)
                where = np.ravel(blocks[part.indices])
            ask = partial(strain.at, points[where, : self._space.dimension])
            own = evaluate("InitialStrain", ask, np.empty((len(where), 9)), t, self._space.comm)
            if only is None and strain.history is not None:
                own = strain.history(t) * own
            values[where] += own
        return values[: self.tensors.dofmap.index_map.size_local].ravel()

    def forces(self, t: float, *, only: InitialStrain | None = None) -> Array:
        """Return the load (n,) [N] on the free unknowns. Collective.

        Args:
            t: time [s].
            only: of this strain alone, less its history; of all when None.
        """
        self.follow(t, only=only)
        return self._space.pull(compat.assemble_vector(self._work).array_r)

    def energy(self, u: Array, t: float) -> float:
        """Return ½ ∫ eps_0 : C eps_0 - f_0·u [J], what they add to ½ uᵀKu. Collective.

        Args:
            u: (n,) free unknowns [m].
            t: time [s].
        """
        if self._still is not None:
            forces, energy = self._still
        else:
            forces = self.forces(t)
            energy = float(compat.assemble_vector(self._energy).array_r.sum())
            if not any(strain.history or callable(strain.value) for strain in self._given):
                self._still = forces, energy
        return total(self._space.comm, energy - forces @ u)
