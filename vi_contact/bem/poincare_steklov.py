"""Build the Poincaré-Steklov operator of one body.

With it come boundary value problems, and what contact needs of them.

S maps the history of boundary displacements to nodal forces. Symmetric form S = (K' + 1/2) V⁻¹ (K +
1/2) - D (default: its space-time matrix is positive definite), unsymmetric form S = V⁻¹ (K + 1/2)
(positivity not guaranteed).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array, Indices, Mask, max_abs
from ..core.arguments import check_fields
from ..core.checks import (
    array,
    instance,
    integers,
    mask,
    optional,
    provides,
    shape_of,
)
from ..core.errors import InputError, StepFailure
from ..core.quantities import Positive, Unit
from ..solvers.normal.lcp import EPS
from .boundary_mesh import BoundaryMesh
from .compressed import CompressedBlocks
from .energetic import EnergeticBlocks, marched, summed
from .frequency_circle import on_circle

GROWN = 1e-3  # of the motion: what rounding errors may grow to
# of the largest force: what motions of the unsymmetric form may miss in the equation that they do
# not use
MISSED = 0.1


class BodyOperator(Protocol):
    """Move one body.

    This is what a boundary value problem asks of an operator, in either discretisation in time.
    """

    @property
    def mesh(self) -> BoundaryMesh:
        """Return the mesh of the boundary."""

    @property
    def dt(self) -> float:
        """Return the time step [s]."""

    def load_shape(self, dimensions: int) -> tuple[int | None, ...]:
        """Return the shape of nodal forces given in so many dimensions."""

    def motion(
        self, forces: Array, fixed: Mask, prescribed: Array | None
    ) -> tuple[Array, Array, Array]:
        """Return displacements (steps, 2n), tractions (steps, 4n) and nodal forces (steps, 2n).

        Reactions are included. They are those under forces (steps, pieces of a step, 2n) and
        prescribed displacements (steps, 2n) of fixed unknowns (2n,).
        """

    def condense(
        self, forces: Array, fixed: Mask, prescribed: Array | None, unknowns: Indices
    ) -> tuple[Array, Array]:
        """Return W and u_free of CondensedCompliance for these unknowns."""


@dataclass(frozen=True, eq=False)
class PoincareSteklov:
    """Hold S of a body of density rho, from blocks of density 1."""

    blocks: EnergeticBlocks | CompressedBlocks
    rho: Annotated[float, Positive, Unit("kg/m³"), "the mass density rho"]
    symmetric: bool = True

    def __post_init__(self) -> None:
        instance(
            "PoincareSteklov",
            "blocks",
            self.blocks,
            (EnergeticBlocks, CompressedBlocks),
            "use energetic_blocks",
        )
        check_fields(self)

    @property
    def mesh(self) -> BoundaryMesh:
        """Return the boundary."""
        return self.blocks.mesh

    @property
    def dt(self) -> float:
        """Return the time step [s]."""
        return self.blocks.dt

    def load_shape(self, dimensions: int) -> tuple[int | None, ...]:
        """Return the shape of the nodal forces of a problem."""
        return None, 2, len(self.mesh)

    def motion(
        self, forces: Array, fixed: Mask, prescribed: Array | None
    ) -> tuple[Array, Array, Array]:
        """Return the motion by one march, or on a circle of frequencies; forces: (steps, 1, 2n)."""
        if isinstance(self.blocks, CompressedBlocks):
            pulls, nothing = forces[:, 0] / self.rho, np.arange(0)
            u, p, total = on_circle(self.blocks, fixed, pulls, prescribed, nothing, self.symmetric)[
                1:
            ]
        else:
            given = None if prescribed is None else prescribed[:, :, None]
            found = marched(
                self.blocks,
                fixed,
                forces.swapaxes(1, 2) / self.rho,
                given,
                symmetric=self.symmetric,
            )
            u, p, total = (values[:, :, 0] for values in found)
        missed = (
            0.0
            if self.symmetric
            else max_abs(self._other_equation(u, p) - total[-1]) / (max_abs(total) or 1.0)
        )
        if not missed <= MISSED:
            raise StepFailure(
                f"boundary elements: after {len(u)} steps the motion of the unsymmetric form "
                f"misses the other integral equation by {missed:.1e} of the largest force, and "
                f"{MISSED:g} is the limit; take the symmetric form, fewer steps, another time "
                "step, or a finer mesh"
            )
        return u, self.rho * p, self.rho * total

    def _other_equation(self, u: Array, p: Array) -> Array:
        """Return (2n,) Mᵀ p_k/2 + sum_l K'^(k-l) p_l - D^(k-l) u_l.

        It is that of the last step; in the symmetric form, these are forces.
        """
        changes, jumps = (np.diff(values, axis=0, prepend=0.0) for values in (u, p))
        half = 0.5 * self.mesh.mass.T
        if isinstance(self.blocks, CompressedBlocks):
            adjoint, hyper = self.blocks.applied(p[::-1], changes[::-1], jumps[::-1])[2:]
            return np.asarray(half @ p[-1] + adjoint - hyper)
        double, hyper = (
            blocks[len(u) - 1 :: -1] for blocks in (self.blocks.double, self.blocks.hyper)
        )
        past = summed(double.swapaxes(1, 2), jumps[..., None]) - summed(hyper, changes[..., None])
        return half @ p[-1] + past[:, 0]

    def condense(
        self, forces: Array, fixed: Mask, prescribed: Array | None, unknowns: Indices
    ) -> tuple[Array, Array]:
        """Return W and u_free of CondensedCompliance for these unknowns.

        They come from one march with 2m + 1 columns, or so.
        """
        if isinstance(self.blocks, CompressedBlocks):
            W, moved, *_ = on_circle(
                self.blocks, fixed, forces[:, 0] / self.rho, prescribed, unknowns, self.symmetric
            )
            return W / self.rho, moved[:, unknowns]
        columns = np.zeros((len(forces), 2 * len(self.mesh), len(unknowns) + 1))
        columns[0, unknowns, np.arange(len(unknowns))] = 1.0 / self.rho
        columns[:, :, -1] = forces[:, 0] / self.rho
        given = (
            None
            if prescribed is None
            else np.concatenate([0.0 * columns[..., :-1], prescribed[..., None]], axis=2)
        )
        u = marched(self.blocks, fixed, columns, given, symmetric=self.symmetric)[0][:, unknowns]
        _refuse_growth(u[..., : 0 if self.symmetric else -1])
        return np.ascontiguousarray(u[:, :, :-1]), np.ascontiguousarray(u[:, :, -1])


def _refuse_growth(moved: Array) -> None:
    """Raise StepFailure where motions (steps, n, r) after unit forces in step 0 grow too far.

    They do where rounding shows.
    """
    size = np.abs(moved).max(axis=(1, 2), initial=0.0)
    if not size.max() * EPS <= GROWN * size[0]:
        share = size.max() * EPS / size[0]
        raise StepFailure(
            f"boundary elements: in {len(size)} steps after unit forces the unsymmetric form lets "
            f"rounding errors grow to {share:.1e} of the motion, and {GROWN:.0e} is the limit; "
            "take the symmetric form, fewer steps, or another time step"
        )


@dataclass(frozen=True)
class BoundaryMotion:
    """Hold the answer of a boundary value problem.

    times: (steps,) ends of the steps [s]; displacement: (steps, 2, n) there [m]; traction: (steps,
    2, n, 2) in each step [Pa], at both ends of each element; forces: (steps, 2, n) nodal forces
    [N/m], reactions included.
    """

    times: Array
    displacement: Array
    traction: Array
    forces: Array

    @property
    def work(self) -> Array:
        """Return (steps,) work of all forces up to each time [J/m].

        It is the energy of the body (symmetric form: >= 0).
        """
        return work(self.forces, self.displacement)


def work(forces: Array, displacement: Array) -> Array:
    """Return (steps,) work up to each time of forces during the steps.

    Displacements are those at the ends of the steps; the work is 0 at t_0.
    """
    terms = forces * np.diff(displacement, axis=0, prepend=0.0)
    return np.cumsum(terms.sum(axis=tuple(range(1, terms.ndim))))


@dataclass(frozen=True)
class CondensedCompliance:
    """Hold u_c at t_(k+1) = sum_(l<=k) W[k-l] lam[l] + u_free[k], all that contact needs to know.

    W: (steps, 2m, 2m) [m²/N], displacement of the contact unknowns (x of all nodes, then y) at the
    end of step j after a unit nodal force [N/m] during step 0; u_free: (steps, 2m) [m] without
    contact forces; nodes: (m,) numbers in the mesh; points, normals: (m, 2) places [m] and outward
    unit normals; lengths: (m,) [m] of contact boundary that belongs to a node, traction = force /
    length; dt [s]; turns: (m,) angle [rad] by which the contact boundary turns at a node, None
    where nobody knows. Rows and columns of supported unknowns are zero.
    """

    W: Array
    u_free: Array
    nodes: Indices
    points: Array
    normals: Array
    lengths: Array
    dt: Annotated[float, Positive, Unit("s")]
    turns: Array | None = None

    def __post_init__(self) -> None:
        owner = "CondensedCompliance"
        m = len(integers(owner, "nodes", self.nodes, (None,)))
        steps = len(array(owner, "W", self.W, (None, 2 * m, 2 * m), unit="m²/N"))
        if not steps:
            raise InputError(f"{owner}: W has no step; give one or more")
        for name, shape in (
            ("u_free", (steps, 2 * m)),
            ("points", (m, 2)),
            ("normals", (m, 2)),
            ("lengths", (m,)),
        ):
            array(owner, name, getattr(self, name), shape)
        check_fields(self)

    def displacement(self, forces: Array) -> Array:
        """Return (steps, 2m) displacements under nodal contact forces (steps, 2m)."""
        past = [summed(self.W[k::-1], forces[: k + 1, :, None])[:, 0] for k in range(len(forces))]
        return self.u_free[: len(forces)] + np.array(past)


@dataclass(frozen=True, eq=False)
class BoundaryProblem:
    """Describe a body with supports, loads and a boundary that may come into contact.

    operator: its S, such as PoincareSteklov; forces: (steps, 2, n) nodal forces of the loads [N/m]
    (loads.py), means over the steps, or of the shape that the operator asks for (``load_shape``);
    fixed: (2, n) supported unknowns; prescribed: (steps, 2, n) their displacement [m] at the ends
    of the steps, zero if None; contact: (n,) mask of the elements of the contact boundary.
    Everything else is free of traction. Raises InputError for wrong shapes and what is no mask.
    """

    operator: BodyOperator
    forces: Array
    fixed: Mask | None = None
    prescribed: Array | None = None
    contact: Mask | None = None

    def __post_init__(self) -> None:
        owner, names = "BoundaryProblem", ("load_shape", "motion", "condense")
        provides(owner, "operator", self.operator, names, "give PoincareSteklov(…)")
        n, wanted = len(self.operator.mesh), self.operator.load_shape(len(shape_of(self.forces)))
        object.__setattr__(self, "forces", array(owner, "forces", self.forces, wanted, unit="N/m"))
        if not len(self.forces):
            raise InputError(f"{owner}: forces is empty; give the forces of one step or more")
        for name, shape in (("fixed", (2, n)), ("contact", (n,))):
            optional(mask, owner, name, getattr(self, name), shape)
        optional(array, owner, "prescribed", self.prescribed, (len(self.forces), 2, n), unit="m")

    @property
    def times(self) -> Array:
        """Return (steps,) ends of the steps [s]."""
        return self.operator.dt * np.arange(1, len(self.forces) + 1)

    @cached_property
    def contact_nodes(self) -> Indices:
        """Return (m,) numbers of the nodes of the contact boundary."""
        if self.contact is None or not np.any(self.contact):
            raise InputError(
                "BoundaryProblem: contact is empty; give the mask of the contact elements"
            )
        return np.flatnonzero(self.operator.mesh.nodes_of(self.contact))

    def _given(self, contact_forces: ArrayLike | None = None) -> tuple[Array, Mask, Array | None]:
        """Return nodal forces (steps, pieces of a step, 2n).

        Those of contact are added. With them come the fixed unknowns and their motion.
        """
        steps, n = len(self.forces), len(self.operator.mesh)
        forces = np.array(self.forces, float).reshape(steps, -1, 2, n)
        if contact_forces is not None:
            shape = (steps, 2 * len(self.contact_nodes))
            given = array(
                "BoundaryProblem.solve", "contact_forces", contact_forces, shape, unit="N/m"
            )
            forces[..., self.contact_nodes] += given.reshape(steps, 1, 2, -1)
        fixed = np.zeros((2, n), bool) if self.fixed is None else np.asarray(self.fixed, bool)
        prescribed = (
            None
            if self.prescribed is None
            else np.asarray(self.prescribed, float).reshape(steps, -1)
        )
        return forces.reshape(steps, -1, 2 * n), fixed.ravel(), prescribed

    def solve(self, contact_forces: ArrayLike | None = None) -> BoundaryMotion:
        """Return the motion under loads and nodal contact forces (steps, 2m).

        These are ordered as in CondensedCompliance.
        """
        u, p, forces = self.operator.motion(*self._given(contact_forces))
        n = len(self.operator.mesh)
        return BoundaryMotion(
            self.times, u.reshape(-1, 2, n), p.reshape(-1, 2, n, 2), forces.reshape(-1, 2, n)
        )

    def condensed(self) -> CondensedCompliance:
        """Return the compliance of the contact unknowns and their motion without contact."""
        mesh, nodes, elements = (
            self.operator.mesh,
            self.contact_nodes,
            np.asarray(self.contact, bool),
        )
        W, u_free = self.operator.condense(
            *self._given(), np.concatenate([nodes, nodes + len(mesh)])
        )
        return CondensedCompliance(
            W,
            u_free,
            nodes,
            mesh.points[nodes],
            mesh.node_normals(elements)[nodes],
            mesh.node_lengths(elements)[nodes],
            self.operator.dt,
            mesh.node_turns(elements)[nodes],
        )
