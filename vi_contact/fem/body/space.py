"""Say what the unknowns of a finite element system mean: which component of which node.

Words, from large to small:

    node        a point of the mesh with a number that no number of ranks changes (mesh.numbering)
    block       the place of a node on this rank; owned ones first, then ghosts
    component   block * d + c, c < d: a place in a *full* vector, of owned nodes
    unknown     a component that the equations solve for; vectors of the system have these alone

A component is free, held (by a support) or tied (it follows another one); unknowns are the free
ones. ``FemSpace`` keeps the tables between them, and ``elimination`` takes vectors from one to the
other: ``restrict`` and ``pull`` from full to free, ``expand`` back.
"""

import logging
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask, from_each, largest, total
from ...core.checks import instance, refuse
from ...core.errors import InputError
from ...core.system import SemiDiscreteSystem
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra
from ..mesh.communicators import MpiComm, keep_communicator
from ..mesh.group_checks import cells_of
from ..mesh.nodal_space import NodalSpace, bounding_box
from ..mesh.normals import outward_normals
from ..mesh.numbering import NodeTable, facet_rows, node_numbers
from ..mesh.tagged_mesh import Cells, Facets
from .blending import Blends, TiedSide
from .elimination import Elimination
from .hierarchical import Hierarchy, needs_hierarchy
from .in_cells import find_in_cells, find_nodes_of_cells
from .loads import Support
from .ties import UNTIED, Links, Tied, link

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
    """Return the numbers of the bodies that a cell group consists of. Collective.

    Bodies are parts of the mesh that share no node; ``with_weight(system, bodies=…)`` takes these
    numbers.

    Raises:
        InputError: a group that is only a part of a body.
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


def warn_of_other_matrices(owner: str, system: SemiDiscreteSystem, names: str) -> None:
    """Warn, on rank 0, of M, C or K that fem.assemble did not make, before an output ignores them.

    Stresses and section forces go by the materials given to ``assemble``. Springs that a user adds
    to K leave them right; another material does not.

    Args:
        owner: who asks.
        system: a system of ``assemble``.
        names: letters of the matrices that count, such as "MK".
    """
    foreign = system.space.forms.foreign(system, names)  # type: ignore[attr-defined]
    if foreign and system.algebra.comm.rank == 0:
        log.warning(
            "%s: %s of the system is not the one that fem.assemble made: this output uses the "
            "materials, section and damping given there",
            owner,
            " and ".join(foreign),
        )


def translations(nodes: int, dimension: int) -> list[Array]:
    """Return the unit translation of so many nodes in every direction, d full vectors."""
    return [np.tile(e, nodes) for e in np.eye(dimension)]


class FemSpace(NodalSpace):
    """Number the nodal unknowns of a displacement space.

    The held and the tied components are eliminated (``body.elimination``).

    Attributes:
        V: the DOLFINx function space; dimension d.
        algebra: makes matrices on the communicator of the mesh.
        comm: the ranks, which last as long as the program.
        dimension: d.
        size: diagonal of the body's bounding box [m].
        supports: what holds components of nodes, and which; where two hold one the later counts.
        prescribed: the conditions of the supports, in the same order.
        moves: whether some support moves what it holds.
        ties: boundaries that move together.
        held: (owned nodes, d) mask of components that are held.
        tied: (owned nodes, d) mask of components that follow those of another node.
        free: (owned full,) mask of the other components.
        tied_nodes: numbers of all nodes that move together with another, on every rank.
        mean_nodes: numbers of all nodes that follow several others, on every rank.
        tied_unknowns: mask of the free unknowns of such nodes, None without ties.
        numbers: (owned nodes, d) which unknown of all ranks a component is, also one that follows;
            -1 where held, and where it follows several others.
        degree: 1 for P1 and Q1, 2 for P2 and Q2.
        quadrature_degree: that of all its forms; None: as UFL estimates it.
        nodes: (owned nodes,) their numbers (``mesh.numbering``: of mid-points too).
        points: (owned nodes, d) coordinates [m].
        node_of_block: (blocks,) numbers of the nodes, those of ghosts too.
        body_of_block: (blocks,) their bodies.
        ids: (n,) numbers of the unknowns on any ranks (node * d + component).
        free_index: (owned full,) which owned unknown a component is, -1 where it is not free.
        unknowns: number of unknowns on all ranks.
        elimination: P of u_full = P u + U.
        forms: the ElasticForms of the system made on it; stress output needs them.
        absent: which local cells are absent (``body.absent``); None where none ever are.
        stands: (k, d) where supports hold nodes that an earlier stage had moved [m], or None.
        water: compressible water with unknowns of its own (``water_unknowns``), or None.
    """

    def __init__(
        self,
        V: Any,
        nodes: NodeTable,
        supports: Sequence[Support],
        tied: Sequence[Tied] = (),
        *,
        degree: int = 1,
        quadrature_degree: int | None = None,
        absent: Mask | None = None,
    ) -> None:
        """Give numbers to the unknowns. Collective.

        Args:
            V: the DOLFINx function space of the displacement.
            nodes: its nodes.
            supports: what holds components of them.
            tied: boundaries that move together.
            degree: that of V, 1 or 2.
            quadrature_degree: that of all forms, None for UFL's estimate.
            absent: which local cells are absent; None where none ever are.
        """
        self.V = V
        self.mesh = V.mesh
        self.degree = degree
        self.quadrature_degree = quadrature_degree
        self.comm: MpiComm = MpiComm(keep_communicator(self.mesh.comm))
        self.algebra = PetscAlgebra(self.comm.mpi)
        self.dimension: int = self.mesh.geometry.dim
        self.node_of_block: Indices = nodes.numbers
        self.body_of_block: Indices = nodes.bodies
        self.nodes: Indices = nodes.numbers[: nodes.owned]
        self.points: Array = nodes.points[: nodes.owned]
        self.size = bounding_box(self.comm, self.points)  # tolerances are relative to it
        self.supports = tuple(supports)
        self.prescribed = tuple(support.condition for support in supports)
        self.moves = any(support.moves for support in supports)
        self.ties = tuple(tied)
        shape = (nodes.owned, self.dimension)

        # what is held and what follows is eliminated; the rest is free. Where tied components are
        # held on both sides they are held, and follow nobody.
        self.held = np.zeros(shape, dtype=bool)
        for support in supports:
            self.held[support.places] = True
        links = self._find_links() if tied else UNTIED
        moving = [links.followers, links.leaders, links.blends.followers]
        self.tied_nodes: Indices = np.unique(np.concatenate(moving) // self.dimension)
        self.mean_nodes: Indices = np.unique(links.blends.followers // self.dimension)
        self._leader = links.of_nodes(self.dimension) if tied else {}
        self.tied: Mask = self._find_followers(links) if tied else np.zeros(shape, dtype=bool)
        self.free: Mask = ~(self.held | self.tied).ravel()

        # free components are numbered over all ranks, those of a rank in a row; those that follow
        # have the number of another
        ids = self.nodes[:, None] * self.dimension + np.arange(self.dimension)
        self.ids: Indices = ids.ravel()[self.free]
        self.unknowns = int(total(self.comm, self.free.sum()))
        self.free_index: Indices = np.where(self.free, np.cumsum(self.free) - 1, -1)
        first = int(self.comm.mpi.exscan(int(self.free.sum())) or 0)
        numbers = np.where(self.free, first + self.free_index, -1)
        if tied:
            numbers = self._number_followers(links, numbers)
        self.numbers: Indices = numbers.reshape(shape)
        together = np.isin(self.nodes, self.tied_nodes)
        self.tied_unknowns: Mask | None = (
            np.repeat(together, self.dimension)[self.free] if tied else None
        )
        self.elimination = Elimination(
            self.comm,
            self.free,
            self.held.ravel(),
            followed=self.numbers.ravel() if tied else None,
            unknowns=self.unknowns,
            blended=self._number_blends(links.blends) if len(links.blends.followers) else None,
        )
        self.forms: Any = None
        self.stands: Array | None = None
        self.absent = absent
        self.water: Any = None
        self._others_at = np.zeros((0, self.dimension))
        self._others_of = np.zeros(0, dtype=np.int64)

    @property
    def translations(self) -> list[Array]:
        """Return the unit translation in every direction, full vectors."""
        return translations(len(self.nodes), self.dimension)

    @property
    def bytes(self) -> int:
        """Return the bytes of the mesh on this rank."""
        return compat.mesh_bytes(self.mesh)

    def compile_form(self, form: Any) -> Any:
        """Compile a form, with the quadrature degree of the space where it does not say its own.

        Collective.
        """
        return compat.compile_form(form, self.quadrature_degree)

    def facet_blocks(self, facets: Any) -> Indices:
        """Return the owned blocks (nodes) on the facets, wherever the facets are owned."""
        return compat.locate_owned_blocks(self.V, facets)

    @cached_property
    def _names(self) -> Indices:
        """Return the numbers of the local geometry nodes. Collective when first asked."""
        return node_numbers(self.mesh)

    def corners_of_facets(self, facets: Any) -> Indices:
        """Return the numbers (k, n) of the nodes of facets that may have contact conditions.

        These are all nodes, in a hierarchy the vertices. Collective.

        Args:
            facets: (k,) local numbers, ghosts' too.
        """
        if self.degree == 1:
            vertices = compat.entities_to_geometry(self.mesh, self.mesh.topology.dim - 1, facets)
            return self._names[vertices]
        nodes = self.node_of_block[facet_rows(self.V, facets)]
        # vertices come first: as many as a facet of a tetrahedron has
        return nodes if self.hierarchy is None else nodes[:, : self.dimension]

    @property
    def outlets(self) -> Mask | None:
        """Return the unknowns (n,) of water that leaves the reservoir, None without any."""
        return None if self.water is None else self.water.outlets

    def hold_outlets(self, system: SemiDiscreteSystem) -> SemiDiscreteSystem:
        """Return the system of a static stage, whose outlets are held by springs. Collective.

        Nothing loads them there, so that the answer is the same for any springs.
        """
        if self.outlets is None:
            return system
        rows = np.flatnonzero(self.outlets)
        springs = self.water.static_springs[rows]
        held = system.algebra.local(rows, rows, springs, system.rows)
        return system.changed(K=system.algebra.combine([(1.0, system.K), (1.0, held)]))

    @cached_property
    def hierarchy(self) -> Hierarchy | None:
        """Return the hierarchy of P2 tetrahedra, None of other cells.

        Collective when first asked.
        """
        return Hierarchy(self) if needs_hierarchy(self.V) else None

    # Ties
    # ----------------------------------------------------------------------------------------------

    def _find_links(self) -> Links:
        """Return which unknowns move as others do, on every rank. Collective."""
        sides = [(self._gather(tie.first), self._gather(tie.second)) for tie in self.ties]
        return link(self.ties, sides, self.dimension, self.size)

    def _gather(self, facets: Facets) -> TiedSide:
        """Return a tied boundary: its nodes on all ranks, by their numbers. Collective."""
        blocks = self.facet_blocks(facets.indices)
        rows = self.node_of_block[facet_rows(self.V, facets.indices)]
        vertices = compat.entities_to_geometry(
            self.mesh, self.mesh.topology.dim - 1, facets.indices
        )
        outward = outward_normals(self.mesh, facets.indices, vertices)
        own = (self.nodes[blocks], self.points[blocks], self.held[blocks], rows, outward)
        parts = self.comm.bcast(self.comm.gather(own))
        numbers, points, held, rows, outward = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        order = np.argsort(numbers)
        # each facet once, in an order that no number of ranks changes
        _, first = np.unique(np.sort(rows, axis=1), axis=0, return_index=True)
        return TiedSide(
            facets.name,
            numbers[order],
            points[order],
            held[order],
            np.searchsorted(numbers[order], rows[first]),
            len(compat.sub_entities(self.mesh, self.mesh.topology.dim - 1)[0]),
            outward[first],
        )

    def _find_followers(self, links: Links) -> Mask:
        """Return which owned components (owned nodes, d) follow another node. Collective.

        Those that are held, as their leaders are, follow nobody.

        Raises:
            InputError: some of those that move as one are held, and others are not.
        """
        followers_held = self._read_everywhere(links.followers, self.held) > 0.0
        leaders_held = self._read_everywhere(links.leaders, self.held) > 0.0
        for number in links.followers[followers_held != leaders_held]:
            raise InputError(
                f"component {number % self.dimension} of a tied node is prescribed on one side "
                "only: prescribe both sides alike, or tie the other components (components=)"
            )
        ids = self.nodes[:, None] * self.dimension + np.arange(self.dimension)
        moving = np.concatenate([links.followers[~followers_held], links.blends.followers])
        return np.isin(ids, moving)

    def _number_followers(self, links: Links, numbers: Indices) -> Indices:
        """Return the unknown of every owned component, that of their leaders for followers.

        Collective.

        Args:
            links: what follows what.
            numbers: (full,) the unknown of every owned component, -1 where it is not free; it is
                overwritten.
        """
        d = self.dimension
        leaders = self._read_everywhere(links.leaders, numbers.reshape(-1, d)).astype(np.int64)
        # of the followers that this rank owns: their place in a full vector, and their leader's
        # unknown
        blocks = self.blocks_of(links.followers // d)
        owned = blocks >= 0
        row = (d * blocks + links.followers % d)[owned]
        leader = leaders[owned]
        follows = self.tied.ravel()[row]
        numbers[row[follows]] = leader[follows]
        return numbers

    def _number_blends(self, blends: Blends) -> tuple[Any, Any]:
        """Return the rows of owned components that follow several others. Collective.

        Args:
            blends: what they follow.

        Returns:
            sparse matrices with a row for each owned component: of the free unknowns of all ranks,
            and of the held components of all ranks.
        """
        d = self.dimension
        first = int(self.comm.mpi.exscan(self.held.size) or 0)
        places = np.arange(first, first + self.held.size).reshape(-1, d)
        columns = [
            self._read_everywhere(blends.leaders, values).astype(np.int64)
            for values in (self.numbers, np.where(self.held, places, -1))
        ]
        blocks = self.blocks_of(blends.followers // d)[blends.rows]
        row = d * blocks + blends.followers[blends.rows] % d
        owned = (blocks >= 0) & (blocks < len(self.nodes))
        widths = (self.unknowns, int(total(self.comm, self.held.size)))
        made = []
        for column, width in zip(columns, widths, strict=True):
            used = owned & (column >= 0)
            entries = (blends.weights[used], (row[used], column[used]))
            made.append(sp.csr_matrix(entries, shape=(self.held.size, width)))
        return made[0], made[1]

    def _read_everywhere(self, numbers: Indices, values: Any) -> Array:
        """Return the values (m,) of components of nodes of any rank, on every rank. Collective.

        Args:
            numbers: (m,) node number * d + component.
            values: (owned nodes, d).
        """
        rows = self.at_nodes(numbers // self.dimension, values.astype(float))
        return rows[np.arange(len(numbers)), numbers % self.dimension]

    def find_in_cells(
        self, points: Array, among: Indices | None = None
    ) -> list[tuple[Indices, Array] | None]:
        """Return the nodes of the cell of each point and their weights (``in_cells``). Collective.

        Args:
            points: (p, d) [m]; the answer is None for one that is outside of all cells.
            among: local numbers of the cells that count; None: all.
        """
        return find_in_cells(self, points, among)

    def find_nodes_of_cells(self, cells: Indices) -> Indices:
        """Return the numbers of the nodes of local cells, the same on all ranks. Collective."""
        return find_nodes_of_cells(self, cells)

    def leaders(self, nodes: Indices) -> Indices:
        """Return the numbers of the nodes that these follow in all components.

        A node that follows nobody has its own number, one that is tied in part -1.
        """
        if not self._leader:
            return nodes
        return np.array([self._leader.get(n, n) for n in nodes.tolist()], dtype=np.int64)

    def add_unknowns(self, count: int, point: Array, body: int) -> None:
        """Add unknowns that are no displacements after those of nodes. Collective.

        Each counts as a node by itself, after all nodes. Only the last rank may add some, so that
        the numbers of all others stay.

        Args:
            count: how many this rank adds.
            point: (d,) where they are taken to be [m].
            body: of which they are a part.
        """
        last = int(largest(self.comm, np.max(self.node_of_block, initial=0)))
        more = self.dimension * (last + 1 + np.arange(count))
        self.ids = np.concatenate([self.ids, more])
        self.unknowns += int(total(self.comm, count))
        self.elimination.others = count
        if self.tied_unknowns is not None:
            self.tied_unknowns = np.concatenate([self.tied_unknowns, np.zeros(count, dtype=bool)])
        self._others_at = np.tile(point, (count, 1))
        self._others_of = np.full(count, body, dtype=np.int64)

    # Free unknowns
    # ----------------------------------------------------------------------------------------------

    @property
    def coordinates(self) -> Array:
        """Return the positions (rows, d) of the nodes of the free unknowns [m]."""
        of_nodes = np.repeat(self.points, self.dimension, axis=0)[self.free]
        return np.concatenate([of_nodes, self._others_at]) if len(self._others_at) else of_nodes

    @property
    def body_of_node(self) -> Indices:
        """Return the body of every owned node.

        Bodies are parts of the mesh that share no node, in the order of node numbers.
        """
        return self.body_of_block[: len(self.nodes)]

    @property
    def bodies(self) -> Indices:
        """Return the body of every free unknown."""
        of_nodes = np.repeat(self.body_of_node, self.dimension)[self.free]
        return np.concatenate([of_nodes, self._others_of]) if len(self._others_of) else of_nodes

    # Vectors
    # ----------------------------------------------------------------------------------------------

    def evaluate_prescribed(self, t: float, derivative: int = 0) -> Array:
        """Return U(x, t) or its time derivative, a full vector that is zero on free components.

        Where conditions meet, the later one counts; what they say is added to where an earlier
        stage left the nodes. Collective where something moves.

        Args:
            t: time [s].
            derivative: 0 for U [m], 1 and 2 for its rates.

        Raises:
            InputError: on all ranks, values that are no numbers or not finite.
        """
        values = np.zeros((len(self.nodes), self.dimension))
        defects = []
        for support in self.supports:
            values[support.places] = 0.0
            if support.moves:
                values[support.places], defect = support.at(self.points, t, derivative)
                defects.append(defect)
        if defects:
            refuse(defects, self.comm)
        if self.stands is not None and not derivative:
            values = values + self.stands
        return values.ravel()

    def expand(self, u: Array, t: float, derivative: int = 0) -> Array:
        """Expand a free vector -> nodal values (owned nodes, d), prescribed components included.

        Args:
            u: (n,) the free vector.
            t: time [s].
            derivative: 0 for displacements, 1 and 2 for their rates.
        """
        full = self.elimination.expand(u, self.evaluate_prescribed(t, derivative))
        return full.reshape(-1, self.dimension)

    def pull(self, force: Array) -> Array:
        """Pull back by Pᵀ: forces on all owned components -> on the free ones."""
        return self.elimination.pull(force)

    def reduce(self, full: Any) -> Any:
        """Return PᵀAP of the free components of a PETSc matrix of all. Collective."""
        return self.elimination.reduce(full)

    def take_held_columns(self, full: Any) -> Any:
        """Return the columns of prescribed components of a PETSc matrix of all. Collective."""
        return self.elimination.take_held_columns(full)

    def restrict(self, full: Array) -> Array:
        """Restrict nodal values (owned nodes, d) to the free vector."""
        return self.elimination.restrict(full)
