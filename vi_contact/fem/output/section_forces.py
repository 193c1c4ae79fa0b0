"""Record section forces N, V, M of straight cuts through the elements of walls and slabs, along lines of the mesh."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import array, column_name, instance
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from .. import compat
from ..groups import cells_of
from ..mesh import Cells
from ..space import FemSpace
from .nodal_work import Loads, NodalWork, check_actions

ON_LINE = 1e-6  # of the length of the cut: what counts as lying on it
UNCOVERED = 1e-3  # of the length of a cut: what the element sides on it may miss
_QUANTITIES = {
    "N": ("N", "normal force, tension positive"),
    "V": ("N", "shear force, on the part right of the cut along it"),
    "M": ("N m", "bending moment, positive with tension at the end of the cut"),
}


@dataclass
class SectionForces:
    """Record the resultants of straight cuts a -> b along element sides of a plane mesh: label -> (a, b) [m].

    With e the unit vector from a to b and n the one to its left, F the force that the part on the left exerts through
    the cut on the part on the right, and c the middle of the cut:

        N = F·n  (tension positive),   V = F·e,   M = (moment of F about c, anticlockwise) = ∫ s sigma_n ds

    so that M > 0 is tension at b. F is minus the sum over the nodes of the cut of the nodal forces
    K u + C v + M a - f of the cells on one side (a absolute): not integrated stresses, but the forces by which these
    elements are in equilibrium, exact on any mesh for what acts on them. Contact forces on nodes of the cut itself
    belong to neither side and are left out. Values are those of the step's equation of motion, row 0 those of the
    initial state at rest; per thickness of the section (plane strain: per metre).

    Args:
        cells: the group that is cut, the whole mesh when None: a cut of a wall with soil on both sides needs it.
        loads: those given to ``assemble``. gravity: acceleration (d,) [m/s²] of ``with_weight``, if these cells weigh.
    Raises:
        InputError: a cut that crosses elements, leaves the group or ends inside it; meshes that are not plane.
    """

    cuts: Mapping[str, tuple[Sequence[float], Sequence[float]]]
    cells: Cells | None = None
    loads: Loads = ()
    gravity: Sequence[float] | None = None

    def __post_init__(self) -> None:
        instance("SectionForces", "cuts", self.cuts, Mapping, "give labels and two ends each, {'base': (a, b)}")
        for label, ends in self.cuts.items():
            column_name("section label", label)
            array("SectionForces", f"the two ends of '{label}'", ends, (2, 2), unit="metres")
        if self.cells is not None:
            cells_of("SectionForces", "cells", self.cells)
        check_actions("SectionForces", self.loads, self.gravity)

    def columns(self) -> Columns:
        """Return the columns N_<label>, V_<label>, M_<label>."""
        return {
            f"{quantity}_{label}": (unit, f"{text}, section {label}")
            for label in self.cuts
            for quantity, (unit, text) in _QUANTITIES.items()
        }

    def start(self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None) -> Row:
        """Find the cuts; return the row of the state at rest, of a static stage for example. Collective."""
        work = self._work = NodalWork("section forces", problem, self.loads, self.gravity)
        space, signs, fields = work.space, [], []
        if space.dimension != 2:
            raise InputError(f"section forces are of plane meshes, this one has {space.dimension} dimensions")
        for label, ends in self.cuts.items():
            cut = find_cut(space, label, np.asarray(ends, dtype=float), self.cells)
            arms = space.points - cut.middle
            turn = np.column_stack([-arms[:, 1], arms[:, 0]])
            for field in (np.tile(cut.across, (len(arms), 1)), np.tile(cut.along, (len(arms), 1)), turn):
                fields.append((np.where(cut.nodes[:, None], field, 0.0), cut.cells))
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
    """Hold nodes, an (owned,) mask; cells, a (local,) mask of one side, ``left`` of the way from a to b or right;
    along, across: unit vectors from a to b and to the left; middle: of the cut."""

    nodes: Mask
    cells: Mask
    left: bool
    along: Array
    across: Array
    middle: Array


def find_cut(space: FemSpace, name: str, ends: Array, group: Cells | None) -> Cut:
    """Find the cut from a to b, rows of ``ends`` (2, 2). InputError, on all ranks, unless it runs along element sides
    from one end of the group to the other. Collective."""
    way = ends[1] - ends[0]
    length = float(np.linalg.norm(way))
    if not length > 0.0:
        raise InputError(f"section '{name}': its two ends are the same point")
    along = way / length
    across = np.array([-along[1], along[0]])
    tol = ON_LINE * length
    x = space.mesh.geometry.x[compat.geometry_dofmap(space.mesh)][:, :, :2] - ends[0]
    inside = np.zeros(len(x), dtype=bool)
    inside[slice(None) if group is None else cells_of(f"section '{name}'", "cells", group, space.mesh).indices] = True
    sides = _Sides(x @ along, x @ across, length, tol)
    on = (np.abs(sides.d) <= tol) & (sides.s >= -tol) & (sides.s <= length + tol)
    _refuse(space, name, inside, sides)
    touching = inside & on.any(axis=1)
    owned = np.arange(len(x)) < space.mesh.topology.index_map(space.mesh.topology.dim).size_local
    left, right = touching & sides.left, touching & sides.right
    span = np.where(on, sides.s, -np.inf).max(axis=1) - np.where(on, sides.s, np.inf).min(axis=1)
    covered = space.comm.sum(np.array([span[owned & side].sum() for side in (left, right)]))
    use_left = covered[0] >= covered[1]
    if abs(max(covered) - length) > UNCOVERED * length:
        raise InputError(f"section '{name}': sides of elements cover {max(covered):.4g} m of its {length:.4g} m: lay "
                         "it along lines of the mesh, from one surface of the group of cells to the other")
    own = space.points - ends[0]
    nodes = (np.abs(own @ across) <= tol) & (own @ along >= -tol) & (own @ along <= length + tol)
    return Cut(nodes, left if use_left else right, bool(use_left), along, across, 0.5 * (ends[0] + ends[1]))


class _Sides:
    """Vertices of cells (cells, vertices) by their place s along the cut and their distance d to its left."""

    def __init__(self, s: Array, d: Array, length: float, tol: float) -> None:
        self.s, self.d, self.left, self.right = s, d, d.max(axis=1) > tol, d.min(axis=1) < -tol
        straddles = self.left & self.right
        first, last = np.full(len(s), np.inf), np.full(len(s), -np.inf)
        for i in range(s.shape[1]):
            for j in range(s.shape[1]):
                rise = d[:, j] - d[:, i]
                cuts = (d[:, i] <= tol) & (d[:, j] >= -tol) & (rise > tol)
                at = s[:, i] - np.divide(d[:, i], rise, out=np.zeros_like(rise), where=cuts) * (s[:, j] - s[:, i])
                first = np.where(cuts, np.minimum(first, at), first)
                last = np.where(cuts, np.maximum(last, at), last)
        self.crossed = straddles & (last > tol) & (first < length - tol)
        on_line = np.abs(d) <= tol
        low, high = np.where(on_line, s, np.inf).min(axis=1), np.where(on_line, s, -np.inf).max(axis=1)
        self.beyond = np.array([  # cells with a side on the line that goes on after an end, or cut by the line there
            ((high > tol + end) & (np.abs(low - end) <= tol)) if end else ((low < -tol) & (np.abs(high) <= tol))
            for end in (0.0, length)
        ])
        self.split = straddles & ((np.abs(first - length) <= tol) | (np.abs(last) <= tol))


def _refuse(space: FemSpace, name: str, inside: Mask, sides: _Sides) -> None:
    """InputError for a cut that crosses elements or ends in the middle of the group."""
    flags = [(inside & sides.crossed).any(), (inside & sides.split).any()]
    flags += [(inside & beyond & side).any() for beyond in sides.beyond for side in (sides.left, sides.right)]
    found = space.comm.max(np.array(flags, dtype=float)) > 0.5
    if found[0]:
        raise InputError(f"section '{name}' crosses elements: lay it along lines of the mesh, which nodes mark")
    if found[1] or found[2:4].all() or found[4:6].all():
        raise InputError(f"section '{name}' ends inside the group of cells: let it reach from surface to surface")
