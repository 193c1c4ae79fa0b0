"""Record section forces N, V, M of plane cuts through walls, slabs and columns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.linalg import block_diag

from ...core.algebra import Array
from ...core.checks import array, column_name, find_shape, instance, optional
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State
from ...fem.mesh.group_checks import cells_of
from ...fem.mesh.tagged_mesh import Cells
from ...fem.output.nodal_work import Loads, NodalWork, check_actions
from ...fem.output.plane_cuts import find_cut

# Resultants of a cut: quantity -> (unit, meaning).
_IN_THE_PLANE: Columns = {
    "N": ("N", "normal force, tension positive"),
    "V": ("N", "shear force, on the part right of the cut along it"),
    "M": ("N m", "bending moment, positive with tension at the end of the cut"),
}
_IN_SPACE: Columns = {
    "N": ("N", "normal force, tension positive"),
    "V_2": ("N", "shear force along the first side of the cut, on the part behind it"),
    "V_3": ("N", "shear force along the second side of the cut, on the part behind it"),
    "M_t": ("N m", "twisting moment about the normal of the cut, on the part behind it"),
    "M_2": (
        "N m",
        (
            "bending moment about the first side of the cut, positive with tension towards the "
            "second"
        ),
    ),
    "M_3": (
        "N m",
        (
            "bending moment about the second side of the cut, negative with tension towards "
            "the first"
        ),
    ),
}


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
    mesh for what acts on them. Where materials yield, the forces of their stresses at points of
    integration are in the place of K u. Contact forces act at nodes; those on nodes of the cut
    itself, of P2 tetrahedra on held ones too, belong to neither side and are left out. Values are
    those of the step's equation of motion, row 0 those of the initial state at rest; per thickness
    of the section (plane strain: per metre).

    Args:
        cells: the group that is cut, the whole mesh when None: a cut of a wall with soil on both
            sides needs it.
        loads: those given to ``assemble``.
        gravity: acceleration (d,) [m/s²] of ``with_weight``, if these cells weigh.

    Raises:
        InputError: a cut that leaves the group (in space: misses it) or ends inside it, or goes
            through cells of degree 2; a cut through absent bodies alone; corners of no rectangle.
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
            shape = find_shape(ends)
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
        columns = {}
        for label, ends in self.cuts.items():
            quantities = _IN_THE_PLANE if len(ends) == 2 else _IN_SPACE
            for quantity, (unit, text) in quantities.items():
                columns[f"{quantity}_{label}"] = (unit, f"{text}, section {label}")
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the cuts; return the row of the state at rest, of a static stage for example.

        Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: a cut does not go through the cells.
        """
        work = NodalWork("section forces", problem, self.loads, self.gravity)
        self._work = work
        cuts = [find_cut(work.space, label, ends, self.cells) for label, ends in self.cuts.items()]
        work.take([moved for moved, _ in cuts])
        self._turn = block_diag(np.zeros((0, 0)), *(turn for _, turn in cuts))
        return self._row(work.at_rest(state))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(self._work.of_step(report))

    def _row(self, values: Array) -> Row:
        """Return the work of rigid motions on the cuts, turned into their axes, as a row."""
        return dict(zip(self.columns(), (self._turn @ values).tolist(), strict=True))
