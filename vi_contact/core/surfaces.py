"""Hold the contact conditions of a surface, each on the rank that owns its node.

A contact condition bounds one unknown: after the change of basis u = T û (nodal frames turned to
the contact direction) the normal displacement u_n of a contact point *is* an entry of û, and B_n is
a selection of entries. Where conditions share unknowns, as those of a stone on two stones do, B_n
is a matrix of any entries (``core.traces``), and the basis is that of the system. Contact arrays
(bounds, reactions, active sets, slips) have one row for every condition of this rank, and none of
another's: what is asked of all of them (``some``, ``everywhere``) is asked on all ranks. Sign: the
direction n points from the body to the obstacle, u_n = u·n, gap = gap0 - u_n >= 0, reaction r_n >=
0.

``ContactSurface`` is a value: its methods read it, or return another surface (``moving``,
``on_springs``, …). Below it stand the frames that T is made of: ``make_nodal_frames`` gives every
contact node a normal and tangents, ``arrange_frames`` says in which columns of T these stand.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .algebra import (
    Array,
    Comm,
    Indices,
    Mask,
    Matrix,
    SerialComm,
    freeze,
    largest,
    on_first,
    total,
)
from .arguments import check_arguments
from .census import Census
from .checks import function, quote
from .collective import call_user
from .errors import InputError
from .quantities import Positive, Unit
from .system import Companion
from .traces import Traces

log = logging.getLogger(__name__)
Motion = Callable[[float], float | Array]
# Arrays of a surface that a caller may hold too, and which are kept as read-only copies.
COPIES = (
    "points",
    "normals",
    "weights",
    "gap0",
    "bilateral",
    "compliance",
    "owned",
    "slots",
    "tangents",
)


class WatchedNodes(Protocol):
    """Watch the nodes of a contact boundary without a condition, which move as prescribed."""

    def smallest(self, t: float) -> float:
        """Return their smallest gap [m] at time t [s]. Collective."""

    def refuse_driven(self, t: float) -> None:
        """Raise InputError, on all ranks, for a node that is in what it faces at time t.

        Collective.
        """

    def before_moving(self, towards: Motion | None) -> "WatchedNodes":
        """Return the same nodes before an obstacle that moves towards them, t [s] -> [m]."""

    def carry(self, ground: Callable[[float], Array]) -> "WatchedNodes":
        """Return the same nodes before an obstacle that the ground carries, t [s] -> (d,) [m]."""


@dataclass(frozen=True)
class ContactSurface:
    """Hold the m contact conditions whose unknowns this rank owns, of the ``total`` on all ranks.

    Attributes:
        comm: the ranks that share the surface.
        points: (m, d) positions [m].
        normals: (m, d) unit contact directions (towards the obstacle).
        weights: (m,) tributary length [m] times thickness, or area [m²]: pressure = r_n / weights.
        gap0: (m,) initial gap [m], >= 0.
        bilateral: (m,) True where the point is held on the obstacle (u_n = gap0, reaction of either
            sign).
        compliance: (m,) of the support [m/N]; 0 is rigid, more is a spring.
        owned: (m,) indices in û of the normal unknowns.
        slots: (m,) the numbers of the conditions among those of all ranks, ascending; they do not
            depend on the number of ranks.
        tangents: (m, d-1) indices in û of the tangential unknowns of the same points; -1 where
            prescribed.
        traces: B_n and B_t where no condition has an unknown of its own; ``owned`` and ``tangents``
            are -1 then, and basis, dual and coupling None. None: they select ``owned`` and
            ``tangents``.
        basis: T with u = T û, the turn into nodal frames, or None when they already point along the
            axes.
        dual: T⁻ᵀ where T is not orthogonal, because some point has contact directions at oblique
            angles; else None.
        coupling: R with û = R ǔ where the other side deforms too: the unknowns of a contact point
            are then those of its displacement relative to that side; R - 1 takes from rows of other
            points only. None on an obstacle.
        motion: how far the obstacle has moved towards the body at time t, (m,) [m]; None for one at
            rest.
        slide: how far it has moved along the tangents at time t, (m, d-1) [m]; None for one at
            rest.
        space: of the systems that it was made for; None when it was made by hand.
        companions: motions of the obstacle that are marched beside the run, with its scheme and
            time steps.
        nodes: (m,) numbers of the nodes, to be told apart only: several conditions may be of one.
            None: one each.
        frictionless_corners: True when nodes with several conditions are allowed beside friction.
        uncovered: (m,) True where the other side lies in front of so little around the node that
            r_n / weight is no pressure; None: nowhere. Such points are left out of largest
            pressures.
        watched: nodes of its boundaries without a condition, since they are prescribed in every
            component.
        censuses: what became of the nodes of each contact boundary, in the order in which surfaces
            were joined; empty where nothing is known of facets.
    """

    comm: Comm
    points: Array
    normals: Array
    weights: Array
    gap0: Array
    bilateral: Mask
    compliance: Array
    owned: Indices
    slots: Indices
    tangents: Indices
    basis: Matrix | None = None
    coupling: Matrix | None = None
    motion: Callable[[float], Array] | None = None
    slide: Callable[[float], Array] | None = None
    space: Any = field(default=None, repr=False)
    companions: tuple[Companion, ...] = ()
    dual: Matrix | None = None
    nodes: Indices | None = None
    frictionless_corners: bool = False
    censuses: tuple[Census, ...] = field(default=(), repr=False)
    uncovered: Mask | None = field(default=None, repr=False)
    watched: tuple["WatchedNodes", ...] = field(default=(), repr=False)
    traces: Traces | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Keep copies that nobody can write to: what is made of them once stays true."""
        for name in COPIES:
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and value.flags.writeable:
                object.__setattr__(self, name, freeze(value.copy()))

    def __repr__(self) -> str:
        """Return how many conditions of each kind this rank has, not the arrays."""
        springs = np.count_nonzero(self.compliance)
        held = np.count_nonzero(self.bilateral)
        moves = "" if self.motion is None and self.slide is None else ", on a moving obstacle"
        return (
            f"{type(self).__name__}({self.count} conditions here: {springs} on springs, {held} "
            f"bilateral{moves})"
        )

    @property
    def count(self) -> int:
        """Return the number of contact conditions m of this rank."""
        return len(self.gap0)

    @cached_property
    def total(self) -> int:
        """Return the number of contact conditions of all ranks. Collective when first asked."""
        return round(total(self.comm, self.count))

    def some(self, mask: Mask) -> bool:
        """Say whether the mask (m,) is True for a condition of any rank. Collective."""
        return bool(largest(self.comm, np.count_nonzero(mask) > 0))

    @cached_property
    def rigid(self) -> Mask:
        """Return which of these conditions have no spring."""
        return self.compliance == 0.0

    @cached_property
    def plain(self) -> bool:
        """Say whether all conditions of this rank are rigid and unilateral."""
        return bool(self.rigid.all() and not self.bilateral.any())

    def everywhere(self, values: NDArray[Any]) -> Any:
        """Return the values (total, …) of all conditions, by their numbers, on every rank.

        It is for output, and for small problems that every rank solves. Collective.

        Args:
            values: (m, …) those of this rank, of one type on all ranks.
        """
        if self.comm.size == 1:
            return np.asarray(values)

        # Each rank has its own rows in a table of zeros, and the sum of the tables has them all.
        whole = np.zeros((self.total, *np.shape(values)[1:]))
        whole[self.slots] = values
        return self.comm.sum(whole).astype(np.asarray(values).dtype)

    def mine(self, whole: NDArray[Any]) -> NDArray[Any]:
        """Return the rows (m, …) of the conditions of this rank, out of all rows (total, …)."""
        return whole if self.comm.size == 1 else whole[self.slots]

    def on_first(self, values: NDArray[Any]) -> Any:
        """Return the values (total, …) of all conditions on rank 0, and (0, …) on the others.

        It is for output. Collective.
        """
        return on_first(self.comm, self.slots, values)

    @cached_property
    def corners(self) -> tuple[Indices, ...]:
        """Return the conditions of each node that has several, in the order of the nodes."""
        return () if self.nodes is None else group_same_nodes(self.nodes)

    @property
    def alone(self) -> Mask:
        """Return which conditions (m,) have the tangents of their own direction alone: traces."""
        return np.full(self.count, self.traces is not None)

    @property
    def frame_nodes(self) -> Indices | None:
        """Return the nodes (m,) whose frames hold the tangents of all their conditions.

        It is None where the tangents of each condition are those of its direction alone.
        """
        return self.nodes if self.traces is None else None

    @property
    def turned(self) -> bool:
        """Say whether unknowns are in frames of nodes or relative, not displacements along axes."""
        return self.basis is not None or self.coupling is not None

    def in_frames(self, u: Array) -> Array:
        """Return T⁻¹ u: displacements (n,) along the axes, turned into the nodal frames.

        T⁻¹ is Tᵀ, but where oblique corners have made T not orthogonal (``dual`` = T⁻ᵀ).
        """
        turn = self.basis if self.dual is None else self.dual
        return u if turn is None else turn.transpose_apply(u)

    def along_axes(self, load: Array) -> Array:
        """Return T⁻ᵀ f: a load (n,) [N] on the unknowns û as forces along the axes."""
        turn = self.basis if self.dual is None else self.dual
        return load if turn is None else turn @ load

    def whole(self) -> "ContactSurface":
        """Return a surface with the conditions of all ranks, by number, on every rank. Collective.

        It says where they are and how large; its places in the unknowns stay those of this rank,
        so it is no surface to solve with.
        """
        names = (
            "points",
            "normals",
            "weights",
            "gap0",
            "bilateral",
            "compliance",
            "nodes",
            "uncovered",
        )
        known = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        arrays = {name: self.everywhere(values) for name, values in known.items()}
        return replace(self, comm=SerialComm(), slots=np.arange(self.total), **arrays)

    def normal_values(self, x: Array) -> Array:
        """Return B_n x (m,); of rows (k, n) rows (k, m), as in all these products with B.

        Args:
            x: displacement, velocity or acceleration of the owned unknowns (n,), or rows (k, n).
        """
        if self.traces is not None:
            return self.traces.normal_values(x)
        return np.asarray(x[self.owned] if x.ndim == 1 else x.take(self.owned, -1))

    def tangential_values(self, x: Array) -> Array:
        """Return B_t x (m, d - 1), zero where the tangent is prescribed."""
        if self.traces is not None:
            return self.traces.tangential_values(x)
        return np.where(self.tangents >= 0, x.take(self.tangents, -1), 0.0)

    def put_normal(self, x: Array, values: Array, chosen: Mask) -> None:
        """Write normal values into an x of the caller's own, (n,) or rows (k, n).

        Traces have no unknown to write to: x stays as it is.

        Args:
            x: where they are written.
            values: (m,) or rows (k, m).
            chosen: of the shape of the conditions (of each row), True where they are written.
        """
        if self.traces is not None:
            return
        normal = x[..., self.owned]
        x[..., self.owned] = np.where(chosen, values, normal)

    def put_tangential(self, x: Array, values: Array, chosen: Mask) -> None:
        """Write tangential values into an x of the caller's own, (n,) or rows (k, n).

        Traces have no unknown to write to: x stays as it is.

        Args:
            x: where they are written.
            values: (m, d - 1) or rows (k, m, d - 1).
            chosen: of the same shape, True where they are written; prescribed tangents are left.
        """
        if self.traces is not None:
            return
        free = self.tangents >= 0
        places = self.tangents[free]
        x[..., places] = np.where(chosen[..., free], values[..., free], x[..., places])

    def slip(self, u: Array, t: float) -> Array:
        """Return the tangential displacements relative to the obstacle (m, d - 1) [m].

        Open points have one too.

        Args:
            u: displacement (n,) [m].
            t: time [s], for an obstacle that slides.
        """
        displacement = self.tangential_values(u)
        return displacement if self.slide is None else displacement - self.slide(t)

    def slip_origin(self, u: Array, start: float, end: float) -> Array:
        """Return where the slip of a step is zero, (m, d - 1) [m].

        It is B_t u plus what the obstacle slides in the step.

        Args:
            u: displacement (n,) [m] at the beginning of the step.
            start: time of the beginning [s].
            end: time of the end [s].
        """
        origin = self.tangential_values(u)
        sliding = self.sliding(start, end)
        return origin if sliding is None else origin + sliding

    def reaction_load(self, r_n: Array, rows: int, r_t: Array | None = None) -> Array:
        """Return B_nᵀ r_n + B_tᵀ r_t (rows,), the contact reaction [N] on the owned unknowns.

        Args:
            r_n: normal reactions (m,) [N], or rows (k, m).
            rows: number of unknowns that this rank owns.
            r_t: tangential reactions (m, d - 1) [N], or rows (k, m, d - 1), None without friction.
        """
        if self.traces is not None:
            return self.traces.load(r_n, rows, r_t)

        # Entries are set and not added, as an unknown belongs to one condition. The transposed
        # views let one statement serve a vector and rows of vectors.
        load = np.zeros((*r_n.shape[:-1], rows))
        load.T[self.owned] = r_n.T
        if r_t is not None:
            free = self.tangents >= 0
            load.T[self.tangents[free]] = r_t[..., free].T
        return load

    def touched(self, *, frictional: bool = False) -> Indices:
        """Return the unknowns of this rank that conditions read, ascending. Collective for traces.

        Args:
            frictional: whether those of tangents count too.
        """
        if self.traces is not None:
            return self.traces.read_here(frictional=frictional)
        tangents = self.tangents[self.tangents >= 0] if frictional else self.tangents[:0].ravel()
        return np.unique(np.concatenate([self.owned, tangents]))

    def with_own_laws(self) -> "ContactSurface":
        """Return the surface whose nodes with several conditions rub on each of their faces.

        It is the surface itself where nothing is known of what such nodes face.
        """
        return self

    def gap(self, t: float) -> Array:
        """Return the gap of the undeformed body at time t [s]: gap0 less the motion, (m,) [m]."""
        return self.gap0 if self.motion is None else self.gap0 - self.motion(t)

    def refuse_driven(self, t: float) -> None:
        """Raise InputError, on all ranks, where a prescribed node is in what it faces at time t.

        Collective.
        """
        for nodes in self.watched:
            nodes.refuse_driven(t)

    def advance(self, start: float, end: float) -> Array | None:
        """Return how far the obstacle moves towards the body between two times, (m,) [m].

        Returns None for an obstacle at rest.
        """
        return None if self.motion is None else self.motion(end) - self.motion(start)

    def sliding(self, start: float, end: float) -> Array | None:
        """Return how far the obstacle moves along the tangents between two times, (m, d-1) [m].

        Returns None for an obstacle at rest.
        """
        return None if self.slide is None else self.slide(end) - self.slide(start)

    def moving(
        self, towards: Motion | None = None, along: Motion | None = None
    ) -> "ContactSurface":
        """Return the surface on an obstacle that moves.

        A moving obstacle is not turned; its points face the same nodes.

        Args:
            towards: function of the time t [s] that returns how far it has moved towards the body
                [m]: one number, or an array (m,) in the order of ``points``. None: not at all.
            along: function of the time t [s] that returns how far it has moved along the tangents
                [m]: one number, or an array (m, d-1). None: not at all.
        """
        watched = tuple(nodes.before_moving(towards) for nodes in self.watched)
        motion = None
        slide = None
        if towards is not None:
            motion = _spread_over_points("towards", towards, self.gap0.shape)
        if along is not None:
            slide = _spread_over_points("along", along, self.tangents.shape)
        return replace(self, watched=watched, motion=motion, slide=slide)

    def bilateral_everywhere(self) -> "ContactSurface":
        """Return the bilateral comparison case: every point stays on the obstacle."""
        return replace(self, bilateral=np.ones(self.count, dtype=bool))

    def with_frictionless_corners(self) -> "ContactSurface":
        """Let nodes with several conditions slide freely over their faces beside friction.

        Otherwise each of their conditions has the friction of its own face (``with_own_laws``), and
        all conditions of the surface are traces. In space such a node still rubs along its edge,
        with the normal force of its first condition (of one group: that of the face with the lowest
        node numbers); where conditions are traces already it does not. Collective.
        """
        corners = total(self.comm, len(self.corners))
        if corners and self.comm.rank == 0:
            log.info(
                "%d contact nodes with several contact directions slide without friction", corners
            )
        traces = self.traces
        if traces is not None and self.corners:
            traces = traces.without_tangents(np.concatenate(self.corners))
        return replace(self, frictionless_corners=True, traces=traces)

    @check_arguments
    def on_springs(
        self, stiffness: Annotated[float, Positive, Unit("Pa/m"), "the foundation modulus"]
    ) -> "ContactSurface":
        """Return the surface on a linearly deformable support, with this foundation modulus.

        Each point presses a fictitious spring k = stiffness * weight [N/m], whose far end obeys the
        unilateral law: r_n = k (u_n - gap0) where that is positive, else zero.

        Args:
            stiffness: pressure over indentation [Pa/m], above zero.
        """
        return replace(self, compliance=1.0 / (float(stiffness) * self.weights))


def _spread_over_points(
    name: str, given: Motion, shape: tuple[int, ...]
) -> Callable[[float], Array]:
    """Return a user's motion of an obstacle as a function that gives every point its own [m].

    Args:
        name: the argument that it was given as.
        given: the user's function of the time t [s].
        shape: that of the values, a row for each condition.
    """
    function("moving", name, given, "give a function of the time t [s] that returns metres")
    nowhere = np.zeros(shape)

    def motion(t: float) -> Array:
        owner = f"a moving obstacle: {name}({t:g} s)"
        return call_user(owner, lambda: _spread_value(owner, given(t), shape), nowhere)

    motion.given = given  # type: ignore[attr-defined]  # is asked for its frequency
    return motion


def _spread_value(owner: str, value: Any, shape: tuple[int, ...]) -> Array:
    """Return what a user's motion gives as an array with a row for each condition.

    Args:
        owner: the function and its argument, for the sentence.
        value: a value for all points, or one for each.
        shape: that of the answer.

    Raises:
        InputError: what are no finite metres.
    """
    metres = np.asarray(value)
    # The lengths of the axes are compared from the last one on, as numpy does.
    pairs = zip(metres.shape[::-1], shape[::-1], strict=False)
    fits = metres.ndim <= len(shape) and all(n in (1, m) for n, m in pairs)
    if not fits or metres.dtype.kind not in "iuf" or not np.all(np.isfinite(metres)):
        raise InputError(
            f"{owner} is {quote(value)}; return finite metres, one number or an array of shape "
            f"{shape}"
        )
    return np.broadcast_to(metres.astype(float), shape)


def group_same_nodes(nodes: Indices) -> tuple[Indices, ...]:
    """Return, for each number that stands several times in ``nodes`` (m,), its places.

    The groups are in the order of the numbers, and the places of a group ascend.
    """
    # Equal numbers are side by side in the sorted array, as many as ``counts`` says, from ``first``
    # on.
    order = np.argsort(nodes, kind="stable")
    _, first, counts = np.unique(nodes[order], return_index=True, return_counts=True)
    several = counts > 1
    starts = first[several].tolist()
    sizes = counts[several].tolist()
    return tuple(order[start : start + k] for start, k in zip(starts, sizes, strict=True))


def make_nodal_frames(directions: Array) -> Array:
    """Return orthonormal frames (k, d, d) of contact directions (k, d).

    The first column is the contact direction n, the others are tangential. In the plane t = (-n_y,
    n_x). In space t1 is the projection of the axis that is least aligned with n, and t2 = n x t1.
    """
    # All nodes at once: frames[i, :, c] is vector c of the frame of node i.
    k, d = directions.shape
    frames = np.empty((k, d, d))
    frames[:, :, 0] = directions
    if d == 2:
        frames[:, :, 1] = np.column_stack([-directions[:, 1], directions[:, 0]])
    if d == 3:
        axis = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
        t1 = axis - np.sum(axis * directions, axis=1)[:, None] * directions
        t1 /= np.linalg.norm(t1, axis=1)[:, None]
        frames[:, :, 1] = t1
        frames[:, :, 2] = np.cross(directions, t1)
    return frames


def arrange_frames(frames: Array) -> tuple[Indices, Array]:
    """Return (c, Q): nodal frames whose contact direction is in the column of its own component.

    Axes at right angles to a direction keep their own columns: they are the components that may be
    prescribed.

    Args:
        frames: (k, d, d) as ``make_nodal_frames`` returns them.

    Returns:
        c (k,), the largest component of each direction, and Q (k, d, d), whose column c is the
        direction.
    """
    k, d, _ = frames.shape
    nodes = np.arange(k)
    directions = frames[:, :, 0]
    size = np.abs(directions)
    normal = np.argmax(size, axis=1)

    # The tangents take the other columns in the order of the components of the direction, the
    # smallest first: the first tangent is made of the axis that is least aligned.
    size[nodes, normal] = np.inf
    others = np.argsort(size, axis=1, kind="stable")[:, :-1]

    # Where the direction is an axis, the tangents are the other axes as they are.
    blocks = np.tile(np.eye(d), (k, 1, 1))
    oblique = np.count_nonzero(directions, axis=1) > 1
    tangents = frames[oblique, :, 1:].swapaxes(1, 2)
    blocks[nodes[oblique, None], :, others[oblique]] = tangents
    blocks[nodes, :, normal] = directions
    return normal, blocks


def list_tangential_columns(column: Indices, d: int) -> Indices:
    """Return the columns (m, d-1) of a frame beside the normal ones (m,), ascending.

    Args:
        column: (m,) in which column the contact direction of a condition stands.
        d: dimension, number of columns.
    """
    # 0, 1, … d - 2, where those from the normal column on move up by one.
    tangents = np.arange(d - 1)[None, :]
    return np.asarray(tangents + (tangents >= column[:, None]))


def empty_surface(comm: Comm, dimension: int) -> ContactSurface:
    """Return a surface without any contact: the linear case to compare with."""
    none = np.zeros(0, dtype=np.int64)
    return ContactSurface(
        comm=comm,
        points=np.zeros((0, dimension)),
        normals=np.zeros((0, dimension)),
        weights=np.zeros(0),
        gap0=np.zeros(0),
        bilateral=np.zeros(0, dtype=bool),
        compliance=np.zeros(0),
        owned=none,
        slots=none,
        tangents=np.zeros((0, max(dimension - 1, 0)), dtype=np.int64),
    )
