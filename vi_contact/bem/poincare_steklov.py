"""Build the Poincaré-Steklov operator of one body.

With it come boundary value problems, and what contact needs of them.

S maps the history of boundary displacements to nodal forces. It has two forms:

    S = (K' + 1/2) V⁻¹ (K + 1/2) - D    symmetric, the default: its space-time matrix is positive
                                        definite
    S = V⁻¹ (K + 1/2)                   unsymmetric: nothing guarantees that it is
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
    find_shape,
    instance,
    integers,
    mask,
    optional,
    provides,
)
from ..core.errors import InputError, StepFailure
from ..core.quantities import Positive, Unit
from ..solvers.normal.lcp import EPS
from .boundary_mesh import BoundaryMesh
from .compressed import CompressedBlocks
from .energetic import EnergeticBlocks, march_blocks, sum_products
from .frequency_circle import solve_on_circle

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
        """Return the motion of the body under forces and prescribed displacements.

        Args:
            forces: (steps, pieces of a step, 2n), nodal forces [N/m].
            fixed: (2n,), which unknowns are prescribed.
            prescribed: (steps, 2n), their displacements [m] at the ends of the steps; None for
                zero.

        Returns:
            Displacements (steps, 2n) [m], tractions (steps, 4n) [Pa] and nodal forces (steps, 2n)
            [N/m], reactions included.
        """

    def condense(
        self, forces: Array, fixed: Mask, prescribed: Array | None, unknowns: Indices
    ) -> tuple[Array, Array]:
        """Return W and u_free of ``CondensedCompliance`` for some unknowns.

        Args:
            forces: (steps, pieces of a step, 2n), nodal forces of the loads [N/m].
            fixed: (2n,), which unknowns are prescribed.
            prescribed: (steps, 2n), their displacements [m]; None for zero.
            unknowns: numbers of the unknowns that may come into contact.
        """


@dataclass(frozen=True, eq=False)
class PoincareSteklov:
    """Hold S of a body of density rho, from blocks of density 1.

    Attributes:
        blocks: what ``energetic_blocks`` returns.
        rho: density of the body [kg/m³].
        symmetric: which of the two forms of S is used.
    """

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
        """Return the motion by one march, or on a circle of frequencies.

        Args:
            forces: (steps, 1, 2n), nodal forces [N/m], means over the steps.
            fixed: (2n,), which unknowns are prescribed.
            prescribed: (steps, 2n), their displacements [m] at the ends of the steps; None for
                zero.

        Returns:
            Displacements (steps, 2n) [m], tractions (steps, 4n) [Pa] and nodal forces (steps, 2n)
            [N/m], reactions included.

        Raises:
            StepFailure: a motion of the unsymmetric form that misses the equation that it does not
                use.
        """
        pulls = forces[:, 0] / self.rho
        if isinstance(self.blocks, CompressedBlocks):
            no_units = np.arange(0)
            _, u, p, total = solve_on_circle(
                self.blocks, fixed, pulls, prescribed, no_units, symmetric=self.symmetric
            )
        else:
            columns = march_blocks(
                self.blocks,
                fixed,
                pulls[:, :, None],
                None if prescribed is None else prescribed[:, :, None],
                symmetric=self.symmetric,
            )
            u, p, total = (values[:, :, 0] for values in columns)
        if not self.symmetric:
            self._refuse_missed(u, p, total)
        return u, self.rho * p, self.rho * total

    def _refuse_missed(self, u: Array, p: Array, total: Array) -> None:
        """Raise StepFailure where a motion misses the equation that its form does not use."""
        error = max_abs(self._other_equation(u, p) - total[-1])
        missed = error / (max_abs(total) or 1.0)
        if not missed <= MISSED:
            raise StepFailure(
                f"boundary elements: after {len(u)} steps the motion of the unsymmetric form "
                f"misses the other integral equation by {missed:.1e} of the largest force, and "
                f"{MISSED:g} is the limit; take the symmetric form, fewer steps, another time "
                "step, or a finer mesh"
            )

    def _other_equation(self, u: Array, p: Array) -> Array:
        """Return Mᵀ p_k/2 + sum_l K'^(k-l) p_l - D^(k-l) u_l (2n,) of the last step.

        In the symmetric form, these are the forces of that step. K' p is summed as Kᵀ times the
        jumps of p.
        """
        changes = np.diff(u, axis=0, prepend=0.0)
        jumps = np.diff(p, axis=0, prepend=0.0)
        half = 0.5 * self.mesh.mass.T
        if isinstance(self.blocks, CompressedBlocks):
            _, _, adjoint, hyper = self.blocks.apply(p[::-1], changes[::-1], jumps[::-1])
            return np.asarray(half @ p[-1] + adjoint - hyper)
        latest_first = slice(len(u) - 1, None, -1)
        adjoint = sum_products(self.blocks.double[latest_first].swapaxes(1, 2), jumps[..., None])
        hyper = sum_products(self.blocks.hyper[latest_first], changes[..., None])
        return half @ p[-1] + (adjoint - hyper)[:, 0]

    def condense(
        self, forces: Array, fixed: Mask, prescribed: Array | None, unknowns: Indices
    ) -> tuple[Array, Array]:
        """Return W and u_free of ``CondensedCompliance`` for some unknowns.

        Args:
            forces: (steps, 1, 2n), nodal forces of the loads [N/m].
            fixed: (2n,), which unknowns are prescribed.
            prescribed: (steps, 2n), their displacements [m]; None for zero.
            unknowns: numbers of the unknowns that may come into contact.

        Returns:
            W (steps, 2m, 2m) [m²/N] and u_free (steps, 2m) [m].

        Raises:
            StepFailure: rounding errors that grow too far in the unsymmetric form.
        """
        pulls = forces[:, 0] / self.rho
        if isinstance(self.blocks, CompressedBlocks):
            W, moved, *_ = solve_on_circle(
                self.blocks, fixed, pulls, prescribed, unknowns, symmetric=self.symmetric
            )
            return W / self.rho, moved[:, unknowns]

        # One march: a column for each unit force in step 0, and a last one for the loads.
        columns = np.zeros((len(forces), 2 * len(self.mesh), len(unknowns) + 1))
        columns[0, unknowns, np.arange(len(unknowns))] = 1.0 / self.rho
        columns[:, :, -1] = pulls
        prescribed_columns = None
        if prescribed is not None:
            prescribed_columns = np.zeros_like(columns)
            prescribed_columns[:, :, -1] = prescribed
        u, _, _ = march_blocks(
            self.blocks, fixed, columns, prescribed_columns, symmetric=self.symmetric
        )
        after_units = u[:, unknowns, :-1]
        if not self.symmetric:
            _refuse_growth(after_units)
        return np.ascontiguousarray(after_units), np.ascontiguousarray(u[:, unknowns, -1])


def _refuse_growth(moved: Array) -> None:
    """Raise StepFailure where motions (steps, n, r) after unit forces in step 0 grow too far.

    Rounding errors of the first step grow with them, until they show.
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

    Attributes:
        times: (steps,) ends of the steps [s].
        displacement: (steps, 2, n) of the nodes at these times [m].
        traction: (steps, 2, n, 2) in each step, at both ends of each element [Pa].
        forces: (steps, 2, n) nodal forces in each step, reactions included [N/m].
    """

    times: Array
    displacement: Array
    traction: Array
    forces: Array

    @property
    def work(self) -> Array:
        """Return the work (steps,) of all forces up to each time [J/m].

        It is the energy of the body, which is never negative in the symmetric form.
        """
        return work(self.forces, self.displacement)


def work(forces: Array, displacement: Array) -> Array:
    """Return the work (steps,) up to each time of forces in the steps.

    Both arrays have the steps first. Displacements are those at the ends of the steps, and zero at
    t_0.
    """
    terms = forces * np.diff(displacement, axis=0, prepend=0.0)
    all_but_steps = tuple(range(1, terms.ndim))
    return np.cumsum(terms.sum(axis=all_but_steps))


@dataclass(frozen=True)
class CondensedCompliance:
    """Hold u_c at t_(k+1) = sum_(l<=k) W[k-l] lam[l] + u_free[k], all that contact needs to know.

    The contact unknowns are x of all m contact nodes, then y. Rows and columns of supported
    unknowns are zero.

    Attributes:
        W: (steps, 2m, 2m) displacements at the end of step j after a unit nodal force [N/m] during
            step 0 [m²/N].
        u_free: (steps, 2m) displacements without contact forces [m].
        nodes: (m,) numbers of the contact nodes in the mesh.
        points: (m, 2) their places [m].
        normals: (m, 2) their outward unit normals.
        lengths: (m,) of contact boundary that belongs to a node [m]; traction = force / length.
        dt: time step [s].
        turns: (m,) angle by which the contact boundary turns at a node [rad]; None where it is not
            known.
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
        array(owner, "u_free", self.u_free, (steps, 2 * m))
        array(owner, "points", self.points, (m, 2))
        array(owner, "normals", self.normals, (m, 2))
        array(owner, "lengths", self.lengths, (m,))
        check_fields(self)

    def displacement(self, forces: Array) -> Array:
        """Return (steps, 2m) displacements under nodal contact forces (steps, 2m)."""
        moved = []
        for k in range(len(forces)):
            moved.append(sum_products(self.W[k::-1], forces[: k + 1, :, None])[:, 0])
        return self.u_free[: len(forces)] + np.array(moved)


@dataclass(frozen=True, eq=False)
class BoundaryProblem:
    """Describe a body with supports, loads and a boundary that may come into contact.

    What is neither loaded nor supported nor in contact is free of traction.

    Attributes:
        operator: S of the body, such as PoincareSteklov.
        forces: (steps, 2, n) nodal forces of the loads (loads.py), means over the steps [N/m]; or
            of the shape that the operator asks for (``load_shape``).
        fixed: (2, n) whether an unknown is supported; None for no support.
        prescribed: (steps, 2, n) displacements of the supported unknowns at the ends of the steps
            [m]; None for zero.
        contact: (n,) whether an element is part of the contact boundary; None for no contact.

    Raises:
        InputError: wrong shapes, and masks that are none.
    """

    operator: BodyOperator
    forces: Array
    fixed: Mask | None = None
    prescribed: Array | None = None
    contact: Mask | None = None

    def __post_init__(self) -> None:
        owner = "BoundaryProblem"
        names = ("load_shape", "motion", "condense")
        provides(owner, "operator", self.operator, names, "give PoincareSteklov(…)")
        n = len(self.operator.mesh)
        load_shape = self.operator.load_shape(len(find_shape(self.forces)))
        forces = array(owner, "forces", self.forces, load_shape, unit="N/m")
        object.__setattr__(self, "forces", forces)
        if not len(self.forces):
            raise InputError(f"{owner}: forces is empty; give the forces of one step or more")
        optional(mask, owner, "fixed", self.fixed, (2, n))
        optional(mask, owner, "contact", self.contact, (n,))
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

    def _gather_loads(
        self, contact_forces: ArrayLike | None = None
    ) -> tuple[Array, Mask, Array | None]:
        """Return what the operator asks for: forces, fixed unknowns (2n,), their motion.

        The forces (steps, pieces of a step, 2n) are those of the loads and of contact; the motion
        is (steps, 2n) or None.
        """
        steps = len(self.forces)
        n = len(self.operator.mesh)
        forces = np.array(self.forces, float).reshape(steps, -1, 2, n)
        if contact_forces is not None:
            shape = (steps, 2 * len(self.contact_nodes))
            checked_forces = array(
                "BoundaryProblem.solve", "contact_forces", contact_forces, shape, unit="N/m"
            )
            forces[..., self.contact_nodes] += checked_forces.reshape(steps, 1, 2, -1)
        fixed = np.zeros((2, n), bool) if self.fixed is None else np.asarray(self.fixed, bool)
        prescribed = None
        if self.prescribed is not None:
            prescribed = np.asarray(self.prescribed, float).reshape(steps, -1)
        return forces.reshape(steps, -1, 2 * n), fixed.ravel(), prescribed

    def solve(self, contact_forces: ArrayLike | None = None) -> BoundaryMotion:
        """Return the motion under loads and nodal contact forces (steps, 2m) [N/m].

        The contact forces are ordered as in CondensedCompliance; None is for no contact.
        """
        u, p, forces = self.operator.motion(*self._gather_loads(contact_forces))
        n = len(self.operator.mesh)
        return BoundaryMotion(
            times=self.times,
            displacement=u.reshape(-1, 2, n),
            traction=p.reshape(-1, 2, n, 2),
            forces=forces.reshape(-1, 2, n),
        )

    def condensed(self) -> CondensedCompliance:
        """Return the compliance of the contact unknowns and their motion without contact."""
        mesh = self.operator.mesh
        nodes = self.contact_nodes
        elements = np.asarray(self.contact, bool)
        unknowns = np.concatenate([nodes, nodes + len(mesh)])
        W, u_free = self.operator.condense(*self._gather_loads(), unknowns)
        return CondensedCompliance(
            W=W,
            u_free=u_free,
            nodes=nodes,
            points=mesh.points[nodes],
            normals=mesh.node_normals(elements)[nodes],
            lengths=mesh.node_lengths(elements)[nodes],
            dt=self.operator.dt,
            turns=mesh.node_turns(elements)[nodes],
        )
