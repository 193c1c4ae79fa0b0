"""Record section forces N, V, M of straight cuts through the elements of walls and slabs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.checks import array, column_name, instance
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from ..groups import cells_of
from ..mesh import Cells
from .cuts import find_cut
from .nodal_work import Loads, NodalWork, check_actions

_QUANTITIES = {
    "N": ("N", "normal force, tension positive,"),
    "V": ("N", "shear force, on the part right of the cut along it,"),
    "M": ("N m", "bending moment, positive with tension at the end of the cut,"),
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
            f"{quantity}_{label}": (unit, f"{text.rstrip(',')}, section {label}")
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
