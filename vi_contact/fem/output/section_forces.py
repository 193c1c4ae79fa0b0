"""Record section forces N, V, M of plane cuts through walls, slabs and columns.

The cuts go along element sides or through elements.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.linalg import block_diag

from ...core.algebra import Array
from ...core.checks import array, column_name, instance, optional, shape_of
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State
from .. import compat
from ..body.space import FemSpace
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells
from .cut_cells import work_beyond
from .nodal_work import Loads, NodalWork, Rigid, check_actions, rigid_motions

# of the length of the cut: what counts as lying on it, and how far a rectangle's angles may be from
# 90°
ON_LINE = 1e-6
UNCOVERED = 1e-3  # of the length of a cut in the plane: what the elements on it may miss
# unit, meaning
_QUANTITIES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


@dataclass
class SectionForces:
    """Record the resultants of plane cuts.

    A cut is label -> its ends a, b in the plane, corners a, b, c of a rectangle [m].

    In the plane e is the unit vector from a to b and n the one to its left, F the force that the
    part on the left exerts through the cut on the part on the right, and c the middle of the cut:

        N = F·n    (tension positive)
        V = F·e
        M = (moment of F about c, anticlockwise) = ∫ s sigma_n ds

    so that M > 0 is tension at b. In space e_2 points from a to b, e_3 from a to c at right angles,
    n = e_2 x e_3, and F is what the part before the cut, where n points, exerts on the one behind
    it. With the moment M of F about the middle of the rectangle, s_2 and s_3 the distances from
    there, the columns are

        N = F·n,    V_2 = F·e_2,                   V_3 = F·e_3
        M_t = M·n,  M_2 = M·e_2 = ∫ s_3 sigma_n,   M_3 = M·e_3 = -∫ s_2 sigma_n

    A cut may run along element sides or, of P1 and Q1, through elements, at any inclination. F is
    minus the sum of the nodal forces K u + C v + M a - f (a absolute) of the cells on the cut at
    their nodes on one side, without inertia and loads of the parts of cells on this side: not
    integrated stresses, but the forces by which these elements are in equilibrium, exact on any
    mesh for what acts on them. Contact forces act at nodes; those on nodes of the cut itself, of P2
    tetrahedra on held ones too, belong to neither side and are left out. Values are those of the
    step's equation of motion, row 0 those of the initial state at rest; per thickness of the
    section (plane strain: per metre).

    Args:
        cells: the group that is cut, the whole mesh when None: a cut of a wall with soil on both
            sides needs it.
        loads: those given to ``assemble``.
        gravity: acceleration (d,) [m/s²] of ``with_weight``, if these cells weigh.

    Raises:
        InputError: a cut that leaves the group (in space: misses it) or ends inside it, or goes
            through cells of degree 2; corners of no rectangle.
    """

    cuts: Annotated[Mapping[str, Sequence[Sequence[float]]], Unit("m")]
    cells: Cells | None = None
    loads: Loads = ()
    gravity: Annotated[Sequence[float] | None, Unit("m/s²")] = None

    def __post_init__(self) -> None:
        instance(
            "SectionForces",
            "cuts",
            self.cuts,
            Mapping,
            "give labels and two ends each, {'base': (a, b)}",
        )
        for label, ends in self.cuts.items():
            column_name("section label", label)
            shape = shape_of(ends)
            if len(shape) == 2 and shape not in ((2, 2), (3, 3)):
                raise InputError(
                    f"SectionForces: section '{label}' has {shape[0]} points of {shape[1]} "
                    "coordinates; give 2 ends (x, y) in the plane, 3 corners (x, y, z) of a "
                    "rectangle in space"
                )
            d = 3 if shape[:1] == (3,) else 2
            array(
                "SectionForces",
                f"section '{label}' of two ends, or three corners",
                ends,
                (d, d),
                unit="metres",
            )
        optional(cells_of, "SectionForces", "cells", self.cells)
        check_actions("SectionForces", self.loads, self.gravity)

    def columns(self) -> Columns:
        """Return the columns N_<label>, V_<label>, M_<label>.

        In space they are N, V_2, V_3, M_t, M_2, M_3.
        """
        return {
            f"{quantity}_{label}": (unit, f"{text}, section {label}")
            for label, ends in self.cuts.items()
            for quantity, (unit, text) in _QUANTITIES[
                "plane" if len(ends) == 2 else "space"
            ].items()
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the cuts; return the row of the state at rest, of a static stage for example.

        Collective.
        """
        work = self._work = NodalWork("section forces", problem, self.loads, self.gravity)
        found = [find_cut(work.space, *item, self.cells) for item in self.cuts.items()]
        work.take([part for part, _ in found])
        self._turn = block_diag(np.zeros((0, 0)), *(turn for _, turn in found))
        return self._named(work.at_rest(state))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._named(self._work.of_step(report))

    def _named(self, values: Array) -> Row:
        return dict(zip(self.columns(), (self._turn @ values).tolist(), strict=True))


def axes_of(name: str, corners: Array) -> tuple[Array, Array]:
    """Return (unit vectors (d, d), lengths (d - 1,) of the sides) of a cut (d, d).

    The vectors are along the normal and the sides.
    """
    size = np.linalg.norm(corners[1:] - corners[0], axis=1)
    if not size.all():
        raise InputError(
            f"section '{name}' has the same point twice: give different ends or corners"
        )
    along = (corners[1:] - corners[0]) / size[:, None]
    if len(along) == 1:
        return np.vstack([[-along[0, 1], along[0, 0]], along]), size
    if abs(along[0] @ along[1]) > ON_LINE:
        raise InputError(
            f"section '{name}' is not a rectangle: give corners a, b, c with a right angle at a"
        )
    return np.vstack([np.cross(*along), along]), size


def find_cut(space: FemSpace, name: str, given: Any, group: Cells | None) -> tuple[Rigid, Array]:
    """Return (what moves on one side of a cut, the matrix that makes N, V, M, … of its work).

    The cut has ends or corners (d, d). Collective. There is an InputError, on all ranks, unless the
    cut goes through all of the group that it reaches.

    The nodes on the cut and behind it move, and the cells before them hold them; the other way
    round where sides of cells lie on the cut behind it only, as at a foot.

    Args:
        space: the body's unknowns.
        name: that of the cut.
        given: its ends or corners (d, d) [m].
        group: the cells that it cuts, all when None.
    """
    corners = np.asarray(given, dtype=float)
    mesh = space.mesh
    if len(corners) != space.dimension:
        raise InputError(
            f"section '{name}' has {len(corners)} corners: give 2 ends in the plane, 3 corners of "
            f"a rectangle in space; this mesh has {space.dimension} dimensions"
        )
    axes, size = axes_of(name, corners)
    # a rectangle may be much larger than the body
    tol = ON_LINE * min(float(size.max()), space.size)

    def level(x: Array) -> Array:
        away = (x - corners[0]) @ axes[0]
        return np.where(np.abs(away) <= tol, 0.0, away)

    x = mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, : space.dimension]
    inside = np.zeros(len(x), dtype=bool)
    inside[
        slice(None)
        if group is None
        else cells_of(f"section '{name}'", "cells", group, mesh).indices
    ] = True
    vertices = x[:, : len(compat.sub_entities(mesh, 0))]
    trace = _Trace((vertices - corners[0]) @ axes[1:].T, level(vertices), size, tol)
    inside &= trace.touches
    sides = [
        [(inside & ends & side).any() for side in (trace.left, trace.right)]
        for ends in trace.beyond
    ]
    if space.comm.max(np.array(sides, dtype=float)).all(axis=1).any():
        raise InputError(
            f"section '{name}' ends inside the group of cells: let it reach from surface to surface"
        )
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    left, right, through = space.comm.sum(trace.cover[:, :owned] @ inside[:owned])
    cover = through + max(left, right)
    if not cover > 0.0 or (space.dimension == 2 and abs(cover - size[0]) > UNCOVERED * size[0]):
        raise InputError(
            f"section '{name}': elements cover {cover:.4g} of its {size.prod():.4g} "
            f"m{'²' * (space.dimension - 2)}: let it reach from one surface of the group of cells "
            "to the other"
        )
    sign = 1.0 if left >= right else -1.0
    away = level(space.points)
    at = (space.points - corners[0]) @ axes[1:].T
    nodes = (sign * away < 0.0) & (space.degree < 2) | (
        (away == 0.0) & ((at >= -tol) & (at <= size + tol)).all(axis=1)
    )
    crossed = inside & (level(x).max(axis=1) > 0.0) & (level(x).min(axis=1) < 0.0)
    if space.degree > 1 and space.comm.max(np.array([float(crossed.any())]))[0]:
        raise InputError(
            f"section '{name}' cuts cells of degree 2: let it follow their plane sides"
        )
    middle = corners[0] + 0.5 * (corners[1:] - corners[0]).sum(axis=0)
    motions = partial(rigid_motions, centre=middle)
    beyond = (
        partial(work_beyond, space, crossed, lambda points: sign * level(points), motions)
        if through
        else None
    )
    moved = nodes[:, None], middle, inside & (trace.left if sign > 0.0 else trace.right), beyond
    return moved, -sign * block_diag(axes, axes if len(axes) == 3 else 1.0)


class _Trace:
    """Hold what the plane of a cut leaves in cells.

    It is held by boxes round it along the sides of the cut, low, high (cells, d - 1).

    left, right: cells with vertices before and behind the plane; touches: with a point of the cut;
    beyond: (2 (d - 1), cells) those of them that go on over one of its ends; cover: (3, cells) how
    much [m] of the cut (in space, [m²], of boxes round it) sides of cells on its left, of cells on
    its right, and cells that it goes through cover.
    """

    def __init__(self, s: Array, d: Array, size: Array, tol: float) -> None:
        self.left = d.max(axis=1) > 0.0
        self.right = d.min(axis=1) < 0.0
        faces = np.count_nonzero(d == 0.0, axis=1) > s.shape[2]
        low = np.full(s.shape[::2], np.inf)
        high = np.full(s.shape[::2], -np.inf)
        near = (self.left & self.right) | (d == 0.0).any(axis=1)
        s, below, above = s[near], d[near][:, :, None], d[near][:, None]  # of all pairs of vertices
        cuts = (below <= 0.0) & (above >= 0.0) & (above > below)
        share = np.divide(-below, above - below, out=np.zeros_like(below + above), where=cuts)
        at = s[:, :, None] + share[..., None] * (s[:, None] - s[:, :, None])
        low[near] = np.where(cuts[..., None], at, np.inf).min(axis=(1, 2))
        high[near] = np.where(cuts[..., None], at, -np.inf).max(axis=(1, 2))
        self.touches = ((low <= size + tol) & (high >= -tol)).all(axis=1)
        self.beyond = self.touches & np.hstack([low < -tol, high > size + tol]).T
        kinds = np.array([faces & ~self.right, faces & ~self.left, self.left & self.right])
        inner = ((low < size - tol) & (high > tol)).all(axis=1)
        self.cover = np.where(kinds & inner, (high - low).prod(axis=1), 0.0)
