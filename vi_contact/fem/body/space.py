"""Say what the unknowns of a finite element system mean.

This is nodes, bodies, free and prescribed parts, points, output.
"""

import logging
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import ufl
from petsc4py import PETSc

from ...core.algebra import Array, Indices, Mask, from_each, total
from ...core.checks import instance, refuse
from ...core.errors import InputError
from ...core.system import SemiDiscreteSystem
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix, triple_product
from ..matrices.petsc_rows import aij_of
from ..mesh.communicators import MpiComm, kept
from ..mesh.group_checks import cells_of
from ..mesh.nodal_space import NodalSpace, bounding_box
from ..mesh.numbering import NodeTable, facet_rows, node_numbers
from ..mesh.tagged_mesh import Cells, Facets
from .dirichlet import GivenValues
from .hierarchical import Hierarchy, needs_hierarchy
from .loads import Prescribed
from .ties import PLACE_TOLERANCE, Links, Tied, linked

log = logging.getLogger(__name__)


def space_of(owner: str, system: Any) -> "FemSpace":
    """Return the space of a system that fem.assemble made; InputError for anything else."""
    instance(
        owner, "system", system, SemiDiscreteSystem, "give a system, such as fem.assemble returns"
    )
    if not isinstance(system.space, FemSpace) or system.space.forms is None:
        raise InputError(f"{owner} needs a system made by fem.assemble")
    return system.space


def bodies_of(system: SemiDiscreteSystem, cells: Cells) -> tuple[int, ...]:
    """Return the numbers of the bodies that a cell group is, parts of the mesh that share no node.

    Collective.

    They are those of ``with_weight(system, bodies=…)``. InputError for a group that is only a part
    of a body.
    """
    space = space_of("bodies_of", system)
    cells_of("bodies_of", "cells", cells, space.mesh)
    body = space.body_of_block[compat.cell_blocks(space.V)[:, 0]]
    inside = np.isin(np.arange(len(body)), cells.indices)
    mine, rest = (
        np.unique(np.concatenate(from_each(space.comm, body[part]))) for part in (inside, ~inside)
    )
    if np.isin(mine, rest).any():
        raise InputError(
            f"bodies_of: the cell group '{cells.name}' is a part of a body and shares nodes with "
            "other cells; give a group of whole bodies"
        )
    return tuple(mine.tolist())


def known_matrices(owner: str, system: SemiDiscreteSystem, names: str) -> None:
    """Warn when M, C or K of a system is not what fem.assemble made.

    It is for outputs that go by the materials given there.

    Springs added to K leave the stresses of the elements as they are; another material does not.
    """
    found = system.space.forms.foreign(system, names)  # type: ignore[attr-defined]
    if found and system.algebra.comm.rank == 0:
        log.warning(
            "%s: %s of the system is not the one that fem.assemble made: this output uses the "
            "materials, section and damping given there",
            owner,
            " and ".join(found),
        )


class FemSpace(NodalSpace):
    """Number the nodal unknowns of a displacement space.

    The prescribed and the tied ones are eliminated.

    "Full" vectors hold every owned component (bs*i + c); "free" vectors only those the equations
    solve for.

    Attributes:
        V: the DOLFINx function space, the user's if given; dimension d.
        free: (owned full,) mask of free components.
        held, tied: (owned nodes, d) masks of components that are prescribed, or follow those of
            another node.
        tied_nodes: numbers of all nodes that move together with another, on every rank.
        numbers: (owned nodes, d) which unknown of all ranks a component is, also one that follows;
            -1 where held.
        degree: 1 for P1 and Q1, 2 for P2 and Q2.
        nodes: numbers of the nodes of the owned blocks, those of the mesh (``numbering``: of
            mid-points too).
        points: their coordinates (k, d).
        node_of_block, body_of_block: numbers and bodies of nodes, those of ghosts too.
        ids: rank-independent numbers of the free unknowns (node * d + component).
        unknowns: number of free unknowns on all ranks.
    """

    def __init__(
        self,
        V: Any,
        nodes: NodeTable,
        prescribed: Sequence[Prescribed | GivenValues],
        tied: Sequence[Tied] = (),
        *,
        degree: int = 1,
        quadrature_degree: int | None = None,
    ) -> None:
        self.V = V
        self.degree = degree
        mesh = V.mesh
        self.mesh = mesh
        self.comm: MpiComm = MpiComm(kept(mesh.comm))
        self.algebra = PetscAlgebra(self.comm.mpi)
        self.dimension: int = mesh.geometry.dim
        owned = nodes.owned
        self.node_of_block: Indices = nodes.numbers
        self.body_of_block: Indices = nodes.bodies
        self.nodes: Indices = nodes.numbers[:owned]
        self.points: Array = nodes.points[:owned]
        self.size = bounding_box(self.comm, self.points)  # tolerances are relative to it
        self.prescribed, self.ties = prescribed, tuple(tied)
        self.held = np.zeros((owned, self.dimension), dtype=bool)
        self._where_held = [one.places(self) for one in prescribed]
        for places in self._where_held:
            self.held[places] = True
        links = linked(tied, self.dimension, PLACE_TOLERANCE * self.size, self._everywhere)
        self.tied_nodes: Indices = np.union1d(links.followers, links.leaders) // self.dimension
        self._leader = links.of_nodes(self.dimension)
        self.tied: Mask = self._followers(links)
        self.free: Mask = ~(self.held | self.tied).ravel()
        ids = self.nodes[:, None] * self.dimension + np.arange(self.dimension)
        self.ids: Indices = ids.ravel()[self.free]
        self.unknowns = int(total(self.comm, self.free.sum()))
        self.free_index: Indices = np.where(self.free, np.cumsum(self.free) - 1, -1)
        self.numbers: Indices = self._numbers(links)
        self._P = PetscMatrix(self._selection()) if tied else None
        self.forms: Any = (
            None  # the ElasticForms of the system made on it; stress output needs them
        )
        self.quadrature_degree = quadrature_degree  # of all its forms; None: as UFL estimates it
        self.stands: Array | None = (
            None  # (k, d) where supports hold nodes that an earlier stage had moved [m]
        )

    def compiled(self, form: Any) -> Any:
        """Return a form compiled.

        Its integrals have the degree of the space, if any, unless they say their own.
        """
        degree = self.quadrature_degree
        if degree is None:
            return compat.compile_form(form)
        integrals = [
            one
            if "quadrature_degree" in one.metadata()
            else one.reconstruct(metadata={**one.metadata(), "quadrature_degree": degree})
            for one in form.integrals()
        ]
        return compat.compile_form(ufl.Form(integrals))

    @property
    def translations(self) -> list[Array]:
        """Return the unit translation in every direction, full vectors."""
        return [np.tile(e, len(self.nodes)) for e in np.eye(self.dimension)]

    @property
    def bytes(self) -> int:
        """Return the bytes of the mesh on this rank."""
        return compat.mesh_bytes(self.mesh)

    def facet_blocks(self, facets: Any) -> Indices:
        """Return the owned blocks (nodes) on the facets, wherever the facets are owned."""
        blocks = compat.facet_dofs(self.V, facets)
        return np.asarray(blocks[blocks < len(self.nodes)], dtype=np.int64)

    def corners_of_facets(self, facets: Any) -> Indices:
        """Return the numbers (k, n) of the contact nodes on each of these facets. Collective.

        The facets are local, ghosts' too; the nodes are those that may have contact conditions:
        all, in a hierarchy the vertices.
        """
        if self.degree == 1:
            return node_numbers(self.mesh)[
                compat.entities_to_geometry(self.mesh, self.mesh.topology.dim - 1, facets)
            ]
        return self.node_of_block[facet_rows(self.V, facets)][
            :, : None if self.hierarchy is None else self.dimension
        ]

    @cached_property
    def hierarchy(self) -> Hierarchy | None:
        """Return the hierarchy of P2 tetrahedra, None of other cells.

        Collective when first
        asked.
        """
        return Hierarchy(self) if needs_hierarchy(self.V) else None

    def _everywhere(self, facets: Facets) -> tuple[Indices, Array]:
        """(original numbers, points) of the nodes of facets, ascending, on every rank."""
        blocks = self.facet_blocks(facets.indices)
        parts = self.comm.bcast(self.comm.gather((self.nodes[blocks], self.points[blocks])))
        numbers, points = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(numbers)
        return numbers[order], points[order]

    def _followers(self, links: Links) -> Mask:
        """Return which owned components follow another node.

        Raises:
            InputError: some of those that move as one are held.
        """
        held = [
            self._of_unknowns(numbers, self.held) > 0.0
            for numbers in (links.followers, links.leaders)
        ]
        for number in links.followers[held[0] != held[1]]:
            raise InputError(
                f"component {number % self.dimension} of a tied node is prescribed on one side "
                "only: prescribe both sides alike, or tie the other components (components=)"
            )
        ids = self.nodes[:, None] * self.dimension + np.arange(self.dimension)
        return np.isin(ids, links.followers[~held[0]])

    def _of_unknowns(self, numbers: Indices, values: Any) -> Array:
        """Return owned nodal values (k, d) of unknowns, on every rank.

        An unknown is node number * d + component.
        """
        rows = self.at_nodes(numbers // self.dimension, values.astype(float))
        return rows[np.arange(len(numbers)), numbers % self.dimension]

    def leaders(self, nodes: Indices) -> Indices:
        """Return these node numbers, of nodes that follow another that of the other.

        It is -1 for those tied in part.
        """
        return (
            np.array([self._leader.get(n, n) for n in nodes.tolist()], dtype=np.int64)
            if self._leader
            else nodes
        )

    def _numbers(self, links: Links) -> Indices:
        """Return the unknown of every owned component, numbered over all ranks."""
        d, first = self.dimension, int(self.comm.mpi.exscan(int(self.free.sum())) or 0)
        numbers = np.where(self.free, first + self.free_index, -1)
        leaders = self._of_unknowns(links.leaders, numbers.reshape(-1, d)).astype(np.int64)
        where = self.blocks_of(links.followers // d)
        row, leader = (d * where + links.followers % d)[where >= 0], leaders[where >= 0]
        follows = self.tied.ravel()[row]
        numbers[row[follows]] = leader[follows]
        return numbers.reshape(-1, d)

    def _selection(self) -> Any:
        """P as a PETSc matrix: one 1 per free component, and one for each that follows another."""
        rows, column = len(self.free), self.numbers.ravel()
        kept = np.flatnonzero(column >= 0)
        ones = sp.csr_matrix(
            (np.ones(len(kept)), (kept, column[kept])), shape=(rows, self.unknowns)
        )
        return aij_of(ones, self.comm.mpi, len(self.ids))

    @property
    def tied_unknowns(self) -> Mask | None:
        """Return the free unknowns of nodes that move together with others.

        It is None when no boundaries are tied.
        """
        if self._P is None:
            return None
        return np.repeat(np.isin(self.nodes, self.tied_nodes), self.dimension)[self.free]

    @property
    def coordinates(self) -> Array:
        """Return the positions (rows, d) of the nodes of the free unknowns [m]."""
        return np.asarray(np.repeat(self.points, self.dimension, axis=0)[self.free])

    @property
    def body_of_node(self) -> Indices:
        """Return the body of every owned node.

        Bodies are parts of the mesh that share no node, in the order of node numbers.
        """
        return self.body_of_block[: len(self.nodes)]

    @property
    def bodies(self) -> Indices:
        """Return the body of every free unknown."""
        return np.asarray(np.repeat(self.body_of_node, self.dimension)[self.free])

    # Vectors
    # ----------------------------------------------------------------------------------------------

    def prescribed_values(self, t: float, derivative: int = 0) -> Array:
        """Return the full owned vector of U(x, t) or its time derivative; zero on free components.

        Where conditions meet, the later one counts; what they say is added to where an earlier
        stage left the nodes.
        """
        values = np.zeros((len(self.nodes), self.dimension))
        defects = []
        for condition, places in zip(self.prescribed, self._where_held, strict=True):
            values[places] = 0.0
            if condition.moves:
                values[places], defect = condition.at(self, places, t, derivative)
                defects.append(defect)
        if defects:
            refuse(defects, self.comm)
        return (values if derivative or self.stands is None else values + self.stands).ravel()

    def expand(self, u: Array, t: float, derivative: int = 0) -> Array:
        """Expand a free vector -> nodal values (owned nodes, d), prescribed components included."""
        full = self.prescribed_values(t, derivative)
        if self._P is None:
            full[self.free] = u
        else:
            full += self._P @ u
        return full.reshape(-1, self.dimension)

    def pull(self, force: Array) -> Array:
        """Pull back by Pᵀ.

        This takes forces on all owned components -> on the free ones; tied nodes count at their
        partners.
        """
        return force[self.free] if self._P is None else self._P.transpose_apply(force)

    def reduced(self, full: Any) -> Any:
        """Reduce a PETSc matrix of all components to PᵀAP of the free ones. Collective."""
        return (
            triple_product(full, self._P.mat)
            if self._P is not None
            else self._columns(full, self.free, self.free)
        )

    def held_columns(self, full: Any) -> Any:
        """Return the columns of prescribed components of a PETSc matrix of all. Collective."""
        return self._columns(full, np.ones_like(self.free), self.held.ravel())

    def _columns(self, full: Any, *chosen: Mask) -> Any:
        first = full.getOwnershipRange()[0]
        numbers = [(first + np.flatnonzero(mask)).astype(PETSc.IntType) for mask in chosen]
        return full.createSubMatrix(
            *(PETSc.IS().createGeneral(one, comm=full.comm) for one in numbers)
        )

    def restrict(self, full: Array) -> Array:
        """Restrict nodal values (owned nodes, d) to the free vector."""
        return full.ravel()[self.free]
