"""Turn contact nodes to their frames, and conditions with them: T and R of a `ContactSurface`.

A condition is a node, a contact direction and, between two bodies, what the node faces. Each node
has one frame Q, with the directions of all its conditions among its vectors, and its unknowns are û
= Qᵀu: every u·n is one of them. Forces are Q f̂ then, and u = T û with T = Q⁻ᵀ: Q itself, unless
directions of the node are oblique. In space a node with two directions has the unit vector along
its edge as the third. A rank holds the conditions of its own nodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask, Matrix, largest, total
from ...core.checks import describe_point
from ...core.corners import PARALLEL, are_orthogonal, make_corner_frame
from ...core.errors import InputError
from ...core.surfaces import (
    ContactSurface,
    Motion,
    arrange_frames,
    group_same_nodes,
    list_tangential_columns,
    make_nodal_frames,
)
from ..mesh.nodal_space import NodalSpace
from .conditions import Facing, NodalConditions
from .nodes import ask_alike, join_nodes
from .traced import need_traces, trace_conditions

# least singular value of a node's directions: two that turn by 0.8° (CHOSEN; T has 1 over it)
INDEPENDENT = 0.01


@dataclass(frozen=True, kw_only=True, repr=False)
class FemSurface(ContactSurface):
    """Hold a contact surface that remembers what it was made of, so that it can be joined.

    Attributes:
        space: what the unknowns mean.
        parts: the conditions, one part after the other.
        own_slide: ``slide`` along the tangents that conditions have as traces; None where ``slide``
            is None or not known of corners.
    """

    space: NodalSpace = field(repr=False)
    parts: tuple[NodalConditions, ...] = field(repr=False)
    own_slide: Callable[[float], Array] | None = field(default=None, repr=False)

    def moving(self, towards: Motion | None = None, along: Motion | None = None) -> "FemSurface":
        """Return the surface on an obstacle that moves; see ``ContactSurface.moving``.

        Args:
            towards: function of the time t [s] -> how far towards the body [m].
            along: function of the time t [s] -> how far along the tangents [m].
        """
        moved: Any = super().moving(towards, along)
        surface: FemSurface = replace(moved, own_slide=None)
        return surface

    @property
    def has_corners(self) -> bool:
        """Say whether some node of any rank has several conditions. Collective."""
        return total(self.comm, len(self.corners)) > 0.0

    def find_own_slide(self) -> Callable[[float], Array] | None:
        """Return ``slide`` along the tangents of conditions as traces. Collective.

        It is None for an obstacle that does not slide, and where that is not known of corners.
        """
        if self.slide is None or self.traces is not None or not self.has_corners:
            return self.slide
        return self.own_slide

    def with_own_laws(self) -> "FemSurface":
        """Return the same conditions as traces, so that corners rub on each of their faces.

        Tangents of a condition are those of its own direction then. Collective when first asked.
        """
        return self if self.traces is not None else self._traced

    @cached_property
    def _traced(self) -> "FemSurface":
        """Return the same conditions as traces, made once."""
        slide = self.find_own_slide()
        if self.slide is not None and slide is None:
            raise InputError(
                "the obstacle slides along tangents of corners that rub on all their faces: take "
                "surface = surface.with_own_laws() before surface.moving(along=…), whose tangents "
                "are those of each face alone"
            )
        conditions = ("gap0", "weights", "bilateral", "compliance", "motion", "uncovered")
        others = ("companions", "censuses", "watched")
        data = {name: getattr(self, name) for name in (*conditions, *others)}
        return surface_of(self.space, self.parts, traced=True, slide=slide, **data)


class NodalFrames:
    """Make one frame of unit vectors per node of conditions.

    It is orthonormal unless the node has oblique directions.

    Attributes:
        numbers: (k,) nodes.
        blocks: (k, d, d) frames Q, vectors as columns.
        turns: (k, d, d) Q⁻ᵀ.
        place: (m,) row of the node of each condition among ``numbers``.
        column: (m,) column of Q that is the direction of each condition.
        double: (k,) nodes with several conditions.
        oblique: whether some node has directions that are not at right angles.
        rubs: (m, d-1) tangential vectors that belong to each condition; what a node with several of
            them has left, the direction of the edge in space, belongs to the first.

    Raises:
        InputError: a contact direction that is partly prescribed; directions of one node that
            depend on one another.
    """

    def __init__(self, numbers: Indices, points: Array, directions: Array, held: Mask) -> None:
        """Make the frames of m conditions.

        Args:
            numbers: (m,) their nodes.
            points: (m, d) of these [m].
            directions: (m, d) unit vectors.
            held: (m, d) which components of the nodes are prescribed.
        """
        self.points = points
        self.directions = directions
        refuse_prescribed(points, directions, held)
        # one frame for each node, from the direction of its first condition
        self.numbers, first, place = np.unique(numbers, return_index=True, return_inverse=True)
        self.place: Indices = place.ravel()
        self.double: Mask = np.bincount(self.place) > 1
        column, self.blocks = arrange_frames(make_nodal_frames(self.directions[first]))
        self.column = column[self.place]
        self.turns = self.blocks.copy()
        self.rubs = np.ones((len(numbers), self.blocks.shape[1] - 1), dtype=bool)
        # nodes with several conditions have all their directions in it
        for slots in group_same_nodes(self.place):
            self._refuse_dependent(slots)
            self._turn_corner(slots)
        self.oblique = not np.array_equal(self.turns, self.blocks)

    def _turn_corner(self, slots: Indices) -> None:
        """Give a node its frame, with the directions of all its conditions ``slots`` in it."""
        node = self.place[slots[0]]
        self.column[slots], block = make_corner_frame(self.directions[slots])
        self.blocks[node] = block
        orthogonal = are_orthogonal(self.directions[slots])
        self.turns[node] = block if orthogonal else np.linalg.inv(block).T
        # what is left beside the directions rubs with the first condition
        free = ~np.isin(np.arange(len(block)), self.column[slots])
        self.rubs[slots] = False
        self.rubs[slots[0]] = np.delete(free, self.column[slots[0]])

    def own_vectors(self) -> Mask:
        """Return a mask (m, d) of the vectors of its node that belong to each condition.

        They are its direction, and those that rub.
        """
        m = self.place.size
        d = self.blocks.shape[1]
        own = np.zeros((m, d), dtype=bool)
        np.put_along_axis(own, list_tangential_columns(self.column, d), self.rubs, axis=1)
        own[np.arange(m), self.column] = True
        return own

    def _refuse_dependent(self, slots: Indices) -> None:
        """Raise InputError for directions of a node that are parallel, too many or dependent."""
        directions = self.directions[slots]
        k, d = directions.shape
        where = f"contact node {describe_point(self.points[slots[0]])}"
        cosines = (directions @ directions.T)[np.triu_indices(k, 1)]
        if np.any(cosines > 1.0 - PARALLEL):
            raise InputError(
                f"{where} is on several contact surfaces with one contact direction: list every "
                "boundary and every pair once, and join boundaries that continue one another in "
                "one group"
            )
        if k > d or np.linalg.svd(directions, compute_uv=False)[-1] < INDEPENDENT:
            raise InputError(
                f"{where} has {k} contact directions, "
                f"{'more than' if k > d else 'not independent in'} its {d} dimensions: treat the "
                "corner as smooth (a larger feature_angle=), or leave the node out of some of its "
                "surfaces (points=)"
            )


def refuse_prescribed(points: Array, directions: Array, held: Mask) -> None:
    """Raise InputError for a contact direction with a component that is prescribed.

    Args:
        points: (m, d) nodes [m].
        directions: (m, d) unit vectors.
        held: (m, d) which components of the nodes are prescribed.
    """
    for slot in np.flatnonzero(np.any(held & (directions != 0.0), axis=1)):
        raise InputError(
            f"contact node {describe_point(points[slot])} is also prescribed along its contact "
            "direction: free that component or leave the node out of the contact surface"
        )


def snap_to_axes(directions: Array) -> Array:
    """Turn directions (m, d) to an axis where they are along it to round-off.

    So the unknowns of walls along the axes stay as they are.
    """
    snapped = np.where(np.abs(directions) < 1e-13, 0.0, directions)
    return np.asarray(snapped / np.linalg.norm(snapped, axis=1)[:, None])


def gather_frame_data(parts: Sequence[NodalConditions]) -> tuple[Indices, Array, Array, Mask]:
    """Return what makes the frames of conditions, the arguments of ``NodalFrames``."""
    nodes = join_nodes([part.nodes for part in parts])
    return (
        nodes.numbers,
        nodes.points,
        np.concatenate([part.directions for part in parts]),
        nodes.held,
    )


def surface_of(
    space: NodalSpace,
    parts: Sequence[NodalConditions],
    *,
    traced: bool = False,
    joins: bool = False,
    **data: Any,
) -> FemSurface:
    """Make the surface of conditions, one part after the other. Collective.

    Args:
        space: what the unknowns mean.
        parts: this rank's m conditions.
        traced: whether they are traces also where each could have an unknown of its own.
        joins: whether the surface is only to be joined to others: ``joined_surfaces`` makes the
            matrices of all unknowns anew, and this surface has none.
        **data: gap0 (m,), weights (m,) and whatever else a ``ContactSurface`` holds of them.

    Raises:
        InputError: on all ranks, a direction that is partly prescribed, and directions of a node
            that depend on one another.
    """
    comm = space.comm
    d = space.dimension
    # conditions of one part after those of the parts before
    sizes = comm.sum(np.array([float(len(part.slots)) for part in parts]))
    starts = np.cumsum([0, *sizes]).astype(np.int64)
    slots = np.concatenate(
        [start + part.slots for start, part in zip(starts[:-1], parts, strict=True)]
    )
    if traced or need_traces(space, parts):
        _refuse_traced_bubbles(space)
        return _traced_surface_of(space, parts, slots, data)
    # frames are made on each rank of its own nodes, and what one refuses all ranks refuse
    answer = ask_alike(
        comm, slots, lambda *arrays: (NodalFrames(*arrays),), *gather_frame_data(parts)
    )
    frames: NodalFrames = answer[0]
    # T and T⁻ᵀ, and which unknowns û of a node its conditions and tangents are
    index = space.free_index.reshape(-1, d)[space.blocks_of(frames.numbers)]
    place = frames.place
    column = frames.column
    count = len(slots)
    tangents = np.take_along_axis(index[place], list_tangential_columns(column, d), axis=1)
    turn = None
    dual = None
    coupling = None
    if not joins:
        turn = _make_turn(space, frames.turns, index)
        if largest(comm, frames.oblique):
            dual = _make_turn(space, frames.blocks, index)
        if space.hierarchy is not None:
            turn, dual = space.hierarchy.around(turn, turn if dual is None else dual)
        coupling = _make_coupling(space, parts, frames, index)
    return FemSurface(
        comm=comm,
        points=frames.points,
        normals=frames.directions,
        owned=index[place, column],
        slots=slots,
        tangents=np.where(frames.rubs, tangents, -1),
        basis=turn,
        dual=dual,
        nodes=frames.numbers[place],
        coupling=coupling,
        space=space,
        parts=tuple(parts),
        **{"bilateral": np.zeros(count, dtype=bool), "compliance": np.zeros(count)} | data,
    )


def _traced_surface_of(
    space: NodalSpace, parts: Sequence[NodalConditions], slots: Indices, data: dict[str, Any]
) -> FemSurface:
    """Make the surface of conditions that are traces. Collective.

    Args:
        space: what the unknowns mean.
        parts: this rank's m conditions.
        slots: (m,) their numbers among those of all ranks.
        data: what else the surface holds of them.
    """
    nodes = join_nodes([part.nodes for part in parts])
    directions = np.concatenate([part.directions for part in parts])
    refuse_prescribed(nodes.points, directions, nodes.held)
    count = len(slots)
    nothing = np.full((count, space.dimension), -1)
    return FemSurface(
        comm=space.comm,
        points=nodes.points,
        normals=directions,
        owned=nothing[:, 0],
        slots=slots,
        tangents=nothing[:, 1:],
        nodes=nodes.numbers,
        traces=trace_conditions(space, parts, slots),
        space=space,
        parts=tuple(parts),
        **{"bilateral": np.zeros(count, dtype=bool), "compliance": np.zeros(count)} | data,
    )


def _make_turn(space: NodalSpace, blocks: Array, index: Indices) -> Matrix | None:
    """Return the identity but for the blocks of contact nodes (T, or T⁻ᵀ). Collective.

    It is None when all blocks are the identity too.

    Args:
        space: what the unknowns mean.
        blocks: (k, d, d) the block of each node.
        index: (k, d) owned unknowns of the nodes, -1 for held components.
    """
    n = len(space.ids)
    if not largest(space.comm, np.any(blocks != np.eye(space.dimension))):
        return None
    # entries between free components of a node; all other unknowns stay as they are
    free = index >= 0
    used = free[:, :, None] & free[:, None, :]
    rows = np.broadcast_to(index[:, :, None], used.shape)[used]
    columns = np.broadcast_to(index[:, None, :], used.shape)[used]
    plain = np.setdiff1d(np.arange(n), index)
    rows = np.concatenate([rows, plain])
    columns = np.concatenate([columns, plain])
    values = np.concatenate([blocks[used], np.ones(len(plain))])
    return space.algebra.local(rows, columns, values, n)


def _make_coupling(
    space: NodalSpace, parts: Sequence[NodalConditions], frames: NodalFrames, index: Indices
) -> Matrix | None:
    """Return R of û = R ǔ, or None where no condition faces others. Collective.

        û_c = q_c·u_s = ǔ_c + q_c·(sum_j P_sj u_j + sum_k P_sk e_k)

    for the vectors q_c of the frame of a node s that faces nodes j and bubbles k; all other
    unknowns stay as they are. At nodes with several conditions each one's own vectors only are
    relative to what it faces.

    Args:
        space: what the unknowns mean.
        parts: this rank's conditions.
        frames: those of their nodes.
        index: (k, d) owned unknowns of these nodes, -1 for held components.
    """
    if all(part.facing is None and not part.bubbles for part in parts):
        return None
    algebra = space.algebra
    n = len(space.ids)
    first = algebra.first(n)
    total = space.unknowns
    own = [np.zeros(0, dtype=np.int64)]
    entries = [sp.csr_matrix((0, total))]
    start = 0
    relative = frames.own_vectors()
    for part in parts:
        slots = slice(start, start + len(part.nodes.numbers))
        start = slots.stop
        place = frames.place[slots]
        # other bodies have frames of their own where they are in contact; bubbles have none
        faced: list[tuple[Facing, Array]] = []
        if part.facing is not None:
            faced.append((part.facing, _gather_turns(space, frames, part.facing.nodes.numbers)))
        for bubbles in part.bubbles:
            axes = np.tile(np.eye(space.dimension), (len(bubbles.nodes.numbers), 1, 1))
            faced.append((bubbles, axes))
        if not faced:
            continue
        # rows of R, of the c-th vector of each node's frame: a one on the diagonal, and what the
        # node faces
        for c in range(space.dimension):
            rows = np.flatnonzero(relative[slots, c] & (index[place, c] >= 0))
            own.append(index[place[rows], c])
            coefficients = sp.csr_matrix(
                (np.ones(len(rows)), (np.arange(len(rows)), first + own[-1])), (len(rows), total)
            )
            directions = frames.blocks[place[rows], :, c]
            for other, turns in faced:
                coefficients = coefficients + _express_faced(other, rows, turns, directions, total)
            entries.append(coefficients)
    return algebra.replace_identity_rows(n, np.concatenate(own), sp.csr_matrix(sp.vstack(entries)))


def _gather_turns(space: NodalSpace, frames: NodalFrames, numbers: Indices) -> Array:
    """Return T (k, d, d) of nodes that are faced, the identity where these have no condition.

    Collective.

    Args:
        space: what the unknowns mean.
        frames: those of this rank's nodes.
        numbers: (k,) nodes that are faced.
    """
    d = space.dimension
    known = np.zeros((len(space.nodes), 1 + d * d))
    own = space.blocks_of(frames.numbers)
    known[own, 0] = 1.0
    known[own, 1:] = frames.turns.reshape(-1, d * d)
    # the first column tells whether a rank knows a frame of the node
    there = space.at_nodes(space.leaders(numbers), known)
    turns = there[:, 1:].reshape(-1, d, d)
    return np.asarray(np.where(there[:, :1, None] > 0.0, turns, np.eye(d)))


def _express_faced(
    facing: Facing, rows: Indices, turns: Array, directions: Array, total: int
) -> sp.csr_matrix:
    """Return coefficients (rows, total) of direction·sum_j P_sj u_j in the unknowns û.

    Args:
        facing: what m nodes face.
        rows: (rows,) which of these nodes.
        turns: (n, d, d) T of the nodes that are faced.
        directions: (rows, d) unit vectors.
        total: how many unknowns there are on all ranks.
    """
    shares = sp.csr_matrix(facing.P[rows])
    row = np.repeat(np.arange(len(rows)), np.diff(shares.indptr))
    partners = shares.indices
    values = shares.data[:, None] * np.matmul(directions[row][:, None, :], turns[partners])[:, 0]
    unknowns = facing.nodes.unknowns[partners]
    used = (unknowns >= 0) & (values != 0.0)
    places = np.broadcast_to(row[:, None], used.shape)[used], unknowns[used]
    return sp.csr_matrix((values[used], places), shape=(len(rows), total))


def _refuse_traced_bubbles(space: NodalSpace) -> None:
    """Raise InputError for P2 tetrahedra, whose unknowns are no displacements of nodes."""
    if space.hierarchy is not None:
        raise InputError(
            "nodes of P2 tetrahedra have one contact condition for each unknown: leave those that "
            "are on side 1 of one pair and on side 2 of another, or on two faces that rub, out of "
            "one of them (points=), exchange the sides, let corners slide "
            "(surface.with_frictionless_corners()), or use degree=1"
        )
