"""Record section forces N, V, M of plane cuts through walls, slabs and columns, along element sides or through them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import array, column_name, instance, several
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from .. import compat
from ..groups import cells_of
from ..mesh import Cells
from ..space import FemSpace
from .cut_cells import Motion, OneSide
from .nodal_work import Loads, NodalWork, check_actions

ON_LINE = 1e-6  # of the length of the cut: what counts as lying on it, and how far a rectangle's angles may be from 90°
UNCOVERED = 1e-3  # of the length of a cut in the plane: what the elements on it may miss
_CORNERS = "give two ends in the plane, three corners of a rectangle in space"
_QUANTITIES = {
    "N": ("N", "normal force, tension positive"),
    "V": ("N", "shear force, on the part right of the cut along it"),
    "M": ("N m", "bending moment, positive with tension at the end of the cut"),
}
_IN_SPACE = {
    "N": _QUANTITIES["N"],
    "V_2": ("N", "shear force along the first side of the cut, on the part behind it"),
    "V_3": ("N", "shear force along the second side of the cut, on the part behind it"),
    "M_t": ("N m", "twisting moment about the normal of the cut, on the part behind it"),
    "M_2": ("N m", "bending moment about the first side of the cut, positive with tension towards the second"),
    "M_3": ("N m", "bending moment about the second side of the cut, negative with tension towards the first"),
}


@dataclass
class SectionForces:
    """Record the resultants of plane cuts: label -> its ends a, b in the plane, corners a, b, c of a rectangle [m].

    In the plane e is the unit vector from a to b and n the one to its left, F the force that the part on the left
    exerts through the cut on the part on the right, and c the middle of the cut:

        N = F·n  (tension positive),   V = F·e,   M = (moment of F about c, anticlockwise) = ∫ s sigma_n ds

    so that M > 0 is tension at b. In space e_2 points from a to b, e_3 from a to c at right angles, n = e_2 x e_3, and
    F is what the part before the cut, where n points, exerts on the one behind it. With the moment M of F about the
    middle of the rectangle, s_2 and s_3 the distances from there, the columns are

        N = F·n,  V_2 = F·e_2,  V_3 = F·e_3,  M_t = M·n,  M_2 = M·e_2 = ∫ s_3 sigma_n,  M_3 = M·e_3 = -∫ s_2 sigma_n

    A cut may run along element sides or through elements, at any inclination. F holds what is beyond the cut: the sum
    of the nodal forces K u + C v + M a - f (a absolute) of the cells on the cut at their nodes on one side, less
    inertia and loads of those parts of the cells that are on this side. These are not integrated stresses, but the
    forces by which the elements are in equilibrium, exact on any mesh for what acts on them. Contact forces and those
    of supports act at nodes; on nodes of the cut itself they belong to neither side. Values are those of the step's
    equation of motion, row 0 those of the initial state at rest; in the plane per thickness of the section.

    Args:
        cells: the group that is cut, the whole mesh when None: a cut of a wall with soil on both sides needs it.
        loads: those given to ``assemble``. gravity: acceleration (d,) [m/s²] of ``with_weight``, if these cells weigh.
    Raises:
        InputError: a cut that leaves the group (in space: misses it) or ends inside it, corners of no rectangle.
    """

    cuts: Mapping[str, Sequence[Sequence[float]]]
    cells: Cells | None = None
    loads: Loads = ()
    gravity: Sequence[float] | None = None

    def __post_init__(self) -> None:
        instance("SectionForces", "cuts", self.cuts, Mapping, "give labels and two ends each, {'base': (a, b)}")
        for label, ends in self.cuts.items():
            column_name("section label", label)
            d = 3 if len(several("SectionForces", f"section '{label}'", ends, _CORNERS)) == 3 else 2
            array("SectionForces", f"what section '{label}' is given by", ends, (d, d), unit="metres")
        if self.cells is not None:
            cells_of("SectionForces", "cells", self.cells)
        check_actions("SectionForces", self.loads, self.gravity)

    def columns(self) -> Columns:
        """Return the columns N_<label>, V_<label>, M_<label>, or in space N, V_2, V_3, M_t, M_2, M_3."""
        return {
            f"{quantity}_{label}": (unit, f"{text}, section {label}")
            for label, ends in self.cuts.items()
            for quantity, (unit, text) in (_QUANTITIES if len(ends) == 2 else _IN_SPACE).items()
        }

    def start(self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None) -> Row:
        """Find the cuts; return the row of the state at rest, of a static stage for example. Collective."""
        work = self._work = NodalWork("section forces", problem, self.loads, self.gravity)
        space, signs, fields = work.space, [], []
        for label, ends in self.cuts.items():
            if len(ends) != space.dimension:
                raise InputError(f"section '{label}' has {len(ends)} corners: give 2 ends in the plane, 3 corners of a "
                                 f"rectangle in space; this mesh has {space.dimension} dimensions")
            cut = find_cut(space, label, np.asarray(ends, dtype=float), self.cells)
            for motion in cut.motions():
                taken = partial(cut.beyond.row, motion) if cut.beyond else None
                fields.append((np.where(cut.nodes[:, None], motion(space.points), 0.0), cut.cells, taken))
                signs.append(-1.0 if cut.left else 1.0)
        work.take(fields)
        self._signs = np.array(signs)
        return self._named(work.at_rest(state))

    def row(self, report: Report) -> Row:
        return self._named(self._work.of_step(report))

    def _named(self, values: np.ndarray) -> Row:
        return dict(zip(self.columns(), (self._signs * values).tolist(), strict=True))


@dataclass(frozen=True)
class Cut:
    """Hold nodes, an (owned,) mask, on the cut and on the side that its forces act on; cells, a (local,) mask of those
    between the sides, from the other one; left: whether that is the side where the normal points.

    axes: (d, d) unit vectors along the sides of the cut and its normal; middle: of the cut; beyond: the parts of cells
    on the side of the nodes, None when no cell is cut through.
    """

    nodes: Mask
    cells: Mask
    left: bool
    axes: Array
    middle: Array
    beyond: OneSide | None

    def motions(self) -> list[Motion]:
        """Return the rigid motions on which the forces do the work N, V, M, or N, V_2, V_3, M_t, M_2, M_3."""
        axes = [self.axes[-1], *self.axes[:-1]]

        def shift(axis: Array) -> Motion:
            return lambda x: np.broadcast_to(axis, x.shape)

        def turn(axis: Array) -> Motion:
            return lambda x: np.cross(axis, x - self.middle)

        if len(axes) == 3:
            return [*map(shift, axes), *map(turn, axes)]
        return [*map(shift, axes), lambda x: (x - self.middle)[..., ::-1] * (-1.0, 1.0)]


def axes_of(name: str, corners: Array) -> tuple[Array, Array]:
    """Return ((d, d) unit vectors along the sides and the normal, lengths (d - 1,) of the sides) of a cut (d, d)."""
    sides = corners[1:] - corners[0]
    size = np.linalg.norm(sides, axis=1)
    if not size.all():
        raise InputError(f"section '{name}': two of its ends or corners are the same point")
    along = sides / size[:, None]
    if len(along) == 1:
        return np.vstack([along, [-along[0, 1], along[0, 0]]]), size
    if abs(along[0] @ along[1]) > ON_LINE:
        raise InputError(f"section '{name}' is no rectangle: give corners a, b, c with a right angle at a")
    return np.vstack([along, np.cross(*along)]), size


def find_cut(space: FemSpace, name: str, corners: Array, group: Cells | None) -> Cut:
    """Find a cut, rows of ``corners`` (d, d). InputError, on all ranks, unless it cuts all of the group of cells that
    it reaches. Collective."""
    axes, size = axes_of(name, corners)
    tol = ON_LINE * float(size.max())

    def level(x: Array) -> Array:
        away = (x - corners[0]) @ axes[-1]
        return np.where(np.abs(away) <= tol, 0.0, away)

    x = space.mesh.geometry.x[compat.geometry_dofmap(space.mesh)][:, :, : space.dimension]
    inside = np.zeros(len(x), dtype=bool)
    inside[slice(None) if group is None else cells_of(f"section '{name}'", "cells", group, space.mesh).indices] = True
    trace = _Trace((x - corners[0]) @ axes[:-1].T, level(x), size, tol)
    _refuse(space, name, inside, trace)
    touching, crossed = inside & trace.touches, inside & trace.touches & trace.left & trace.right
    covered = _covered(space, inside, trace)
    use_left = covered[0] >= covered[1]
    cover = covered[2] + max(covered[:2])
    if not cover > 0.0 or (space.dimension == 2 and abs(cover - size[0]) > UNCOVERED * size[0]):
        raise InputError(f"section '{name}': elements cover {cover:.4g} of its {size.prod():.4g} m"
                         f"{'²' * (space.dimension - 2)}: let it reach from one surface of the group of cells to the "
                         "other")
    away, own = level(space.points), (space.points - corners[0]) @ axes[:-1].T
    on = (away == 0.0) & ((own >= -tol) & (own <= size + tol)).all(axis=1)
    sign = 1.0 if use_left else -1.0
    some = space.comm.max(np.array([float(crossed.any())]))[0] > 0.0
    return Cut(
        on | (sign * away < 0.0), touching & (trace.left if use_left else trace.right), bool(use_left), axes,
        corners[0] + 0.5 * (corners[1:] - corners[0]).sum(axis=0),
        OneSide(space, crossed, lambda points: sign * level(points)) if some else None,
    )


class _Trace:
    """What the plane of a cut leaves in cells: low, high (cells, d - 1), a box round it along the sides of the cut.

    left, right: cells with vertices before and behind the plane; faces: with one in it; touches: with a point of the
    cut; inner: with more; beyond: (2 (d - 1), cells) those that touch it and go on over one of its ends.
    """

    def __init__(self, s: Array, d: Array, size: Array, tol: float) -> None:
        self.left, self.right = d.max(axis=1) > 0.0, d.min(axis=1) < 0.0
        self.faces = np.count_nonzero(d == 0.0, axis=1) > s.shape[2]
        self.low, self.high = np.full(s.shape[::2], np.inf), np.full(s.shape[::2], -np.inf)
        near = (self.left & self.right) | (d == 0.0).any(axis=1)
        low, high, s, d = self.low[near], self.high[near], s[near], d[near]
        for i in range(s.shape[1]):
            for j in range(s.shape[1]):
                rise = d[:, j] - d[:, i]
                cuts = (d[:, i] <= 0.0) & (d[:, j] >= 0.0) & (rise > 0.0)
                share = np.divide(-d[:, i], rise, out=np.zeros_like(rise), where=cuts)
                at = s[:, i] + share[:, None] * (s[:, j] - s[:, i])
                low = np.where(cuts[:, None], np.minimum(low, at), low)
                high = np.where(cuts[:, None], np.maximum(high, at), high)
        self.low[near], self.high[near] = low, high
        self.touches = ((self.low <= size + tol) & (self.high >= -tol)).all(axis=1)
        self.inner = ((self.low < size - tol) & (self.high > tol)).all(axis=1)
        self.beyond = self.touches & np.hstack([self.low < -tol, self.high > size + tol]).T


def _covered(space: FemSpace, inside: Mask, trace: _Trace) -> Array:
    """How much [m, m²] of a cut (in space: of boxes round it) faces of cells on its left and right and cells cover."""
    cells = inside & trace.inner
    cells[space.mesh.topology.index_map(space.mesh.topology.dim).size_local :] = False
    kinds = trace.faces & ~trace.right, trace.faces & ~trace.left, trace.left & trace.right
    return space.comm.sum(np.array([(trace.high - trace.low)[cells & kind].prod(axis=1).sum() for kind in kinds]))


def _refuse(space: FemSpace, name: str, inside: Mask, trace: _Trace) -> None:
    """InputError for a cut that ends in the middle of the group: cells on both sides of it go on over one end."""
    sides = [[(inside & ends & side).any() for side in (trace.left, trace.right)] for ends in trace.beyond]
    if space.comm.max(np.array(sides, dtype=float)).all(axis=1).any():
        raise InputError(f"section '{name}' ends inside the group of cells: let it reach from surface to surface")
