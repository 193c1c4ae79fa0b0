"""Sum up the momentum of a body, and what of its motion is that of a rigid body.

With a rigid motion w of the body, wᵀ M v is its momentum along w: a component of P = ∫ rho v for a
translation, one of L = ∫ rho (X - c) × v for a rotation about c. The rows wᵀ M are made once, so
that a step costs one product with a table of a few rows, however many cells there are.

Positions X are those of the undeformed body, as those of moments of forces are: of a linear body
the rate of P is then the sum of the forces on it, and the rate of L that of their moments.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from ...core.algebra import Array
from ...core.checks import whole
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.system import SemiDiscreteSystem
from ...laws.free_motions import count_bodies
from .. import compat
from ..body.space import warn_of_other_matrices
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells
from .nodal_work import rigid_motions

# of the largest moment of inertia: an axis with less has none, as that of a thin rod
NO_INERTIA = 1e-12


class BodyMomenta:
    """Hold the rows wᵀ M of the rigid motions of a body. Collective.

    Attributes:
        dimension: d.
        mass: (d,) what the momentum along each axis is divided by [kg].
        centre: (d,) centre of mass [m].
        inertia: (q, q) moments of inertia about it [kg m²]; q = 0, 1, 3 in d = 1, 2, 3 dimensions.
    """

    def __init__(
        self,
        owner: str,
        problem: ContactProblem,
        *,
        cells: Cells | None = None,
        bodies: Sequence[int] | None = None,
    ) -> None:
        """Make the rows.

        Args:
            owner: who asks, for messages.
            problem: its system says which mass counts.
            cells: the group of cells that is summed up; None for all.
            bodies: numbers of bodies in its place, as ``fem.bodies_of`` returns them.

        Raises:
            InputError: a group where the system has no cells, a body that does not exist, and
                what has no mass.
        """
        problem.system.refuse_statics_only(owner)
        comm = problem.system.algebra.comm
        space = problem.system.space
        self._problem = problem
        self._comm = comm
        self.dimension = space.dimension
        if bodies is not None:
            last = count_bodies(comm, np.asarray(space.bodies)) - 1
            bodies = [whole(owner, "the number of a body", body, most=last) for body in bodies]
        mass: _Mass
        if getattr(space, "forms", None) is not None:
            mass = _MassOfCells(owner, problem.system, cells, bodies)
        elif cells is None:
            mass = _MassOfMatrix(problem.system, bodies)
        else:
            raise InputError(
                f"{owner}: the system was not made of a mesh and has no cell groups: give bodies="
            )
        self._mass = mass

        # Momenta of the translations tell mass and centre of mass: of a translation e along an axis
        # eᵀ M e is the mass, and eᵀ M X e over it the coordinate of the centre.
        d = self.dimension
        places = mass.points
        shifts = [mass.flatten(np.broadcast_to(axis, places.shape)) for axis in np.eye(d)]
        rows = [mass.compute_row(shift) for shift in shifts]
        axes = range(d)
        self.mass = comm.sum(np.array([rows[i] @ shifts[i] for i in axes]))
        if not np.all(self.mass > 0.0):
            raise InputError(
                f"{owner}: what is summed up has no mass along some axis: give a body with a mass"
            )
        first = [rows[i] @ mass.flatten(places * np.eye(d)[i]) for i in axes]
        self.centre = comm.sum(np.array(first)) / self.mass

        # Momenta of the rotations about the centre tell the moments of inertia.
        turns = [mass.flatten(turn) for turn in rigid_motions(places, self.centre)[d:]]
        rows += [mass.compute_row(turn) for turn in turns]
        self._rows = np.array(rows)
        moments = np.zeros((len(turns), len(turns)))
        for i, row in enumerate(rows[d:]):
            for j, turn in enumerate(turns):
                moments[i, j] = row @ turn
        self.inertia = comm.sum(moments)
        self._inverse = np.linalg.pinv(self.inertia, rcond=NO_INERTIA, hermitian=True)

    def compute_momenta(self, x: Array, t: float, derivative: int) -> Array:
        """Return wᵀ M x of all motions (d + q,): along the axes, then about the centre. Collective.

        Args:
            x: displacements (n,) [m] or velocities [m/s] in the unknowns of the equations.
            t: time [s], at which prescribed components are known.
            derivative: 0 or 1, which of them x is.
        """
        values = self._mass.expand(self._problem.cartesian(x), t, derivative)
        return self._comm.sum(self._rows @ values)

    def compute_mean(self, momenta: Array) -> Array:
        """Return the mean over the mass (d,) that belongs to momenta."""
        return np.asarray(momenta[: self.dimension] / self.mass)

    def compute_angular(self, point: Array, momenta: Array) -> Array:
        """Return the angular momentum (q,) about a point (d,) [m], L = L_c + (c - point) × P."""
        d = self.dimension
        arm = self.centre - point
        linear = momenta[:d]
        if d == 1:
            return np.zeros(0)
        if d == 2:
            return np.asarray(momenta[2:] + (arm[0] * linear[1] - arm[1] * linear[0]))
        return np.asarray(momenta[3:] + np.cross(arm, linear))

    def compute_spin(self, momenta: Array) -> Array:
        """Return the rate (q,) at which a rigid body with these momenta turns.

        It is zero about an axis without inertia.
        """
        return np.asarray(self._inverse @ momenta[self.dimension :])


class _Mass(Protocol):
    """Give rows of a mass matrix, and say what their entries are.

    Attributes:
        points: (k, d) places of what moves [m].
    """

    points: Array

    def flatten(self, vectors: Array) -> Array:
        """Return vectors (k, d) at the points as a vector of entries (e,)."""

    def compute_row(self, motion: Array) -> Array:
        """Return M w (e,) of a motion w (e,). Collective."""

    def expand(self, x: Array, t: float, derivative: int) -> Array:
        """Return the entries (e,) of a vector (n,) of the system's own unknowns."""


class _MassOfCells:
    """Give the mass of cells of a mesh, with what of it belongs to nodes that are held."""

    def __init__(
        self,
        owner: str,
        system: SemiDiscreteSystem,
        cells: Cells | None,
        bodies: Sequence[int] | None,
    ) -> None:
        """Compile the product. Collective.

        Args:
            owner: who asks.
            system: made by ``fem.assemble``.
            cells: a group, or None.
            bodies: numbers, or None.
        """
        space: Any = system.space
        warn_of_other_matrices(owner, system, "M")
        self.points = space.points
        self._space = space
        inside = compat.function(compat.cell_space(space.mesh))
        inside.x.array[:] = 1.0
        if cells is not None:
            indices = cells_of(owner, "cells", cells, space.mesh).indices
            inside.x.array[:] = np.isin(np.arange(len(inside.x.array)), indices)
        if bodies is not None:
            body = space.body_of_block[compat.cell_blocks(space.V)[:, 0]]
            inside.x.array[:] *= np.isin(body, bodies)
        self._w = compat.function(space.V)
        self._form = space.compile_form(space.forms.against("M", self._w, inside))

    def flatten(self, vectors: Array) -> Array:
        """Return the components of all owned nodes."""
        return vectors.ravel()

    def compute_row(self, motion: Array) -> Array:
        """Return M w of the cells, assembled."""
        self._w.x.array[: motion.size] = motion
        self._w.x.scatter_forward()
        vector = compat.assemble_vector(self._form)
        row = vector.array_r.copy()
        vector.destroy()
        return np.asarray(row)

    def expand(self, x: Array, t: float, derivative: int) -> Array:
        """Return the components of all owned nodes, also of those that are held."""
        return np.asarray(self._space.expand(x, t, derivative).ravel())


class _MassOfMatrix:
    """Give the mass matrix of a system, of the rows that do not stand still.

    Unknowns that are no displacements, such as rotations, do not move with a rigid motion.
    """

    def __init__(self, system: SemiDiscreteSystem, bodies: Sequence[int] | None) -> None:
        self.points = system.space.coordinates
        self._system = system
        self._counted = np.ones(system.rows)
        if bodies is not None:
            self._counted = np.isin(system.space.bodies, bodies).astype(float)

    def flatten(self, vectors: Array) -> Array:
        """Return the component of each unknown that is counted."""
        return np.asarray(self._counted * np.sum(self._system.influence * vectors, axis=1))

    def compute_row(self, motion: Array) -> Array:
        """Return M w."""
        return self._system.M @ motion

    def expand(self, x: Array, t: float, derivative: int) -> Array:
        """Return the vector itself."""
        return x
