"""Record the racking of frames: the shear of four corners, which no rigid rotation changes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from ...core.algebra import Array
from ...core.checks import array, column_name, instance
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State


@dataclass
class Racking:
    """Record racking: label -> four corner points (x, y) [m], at the nodes nearest to them.

    Columns racking_<label>, rotation_<label> [rad]: see ``racking``. A rigid motion of the frame,
    and of the ground, leaves racking alone. InputError for corners that are not four, on one line,
    or outside the body.
    """

    frames: Annotated[Mapping[str, Sequence[Sequence[float]]], Unit("m")]

    def __post_init__(self) -> None:
        instance(
            "Racking",
            "frames",
            self.frames,
            Mapping,
            "give labels and four corners each, {'box': [(x, y), …]}",
        )
        if not self.frames:
            raise InputError(
                "Racking: frames is empty; give labels and four corners each, or leave it out"
            )
        for label, corners in self.frames.items():
            column_name("racking label", label)
            meaning = f"the table of four corners '{label}'"
            racking(array("Racking", meaning, corners, (4, 2), unit="m"), np.zeros((4, 2)))

    def columns(self) -> Columns:
        """Name the columns racking_<label>, rotation_<label>."""
        columns = {}
        for label in self.frames:
            shear = f"racking du_x/dy + du_y/dx of frame {label}"
            columns[f"racking_{label}"] = ("rad", shear)
            turn = f"rotation of frame {label}, anticlockwise positive"
            columns[f"rotation_{label}"] = ("rad", turn)
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the nodes; return the row of the first state. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the body is not plane, or a corner is outside it.
        """
        self._problem = problem
        space = problem.system.space
        if space.dimension != 2:
            raise InputError(
                f"Racking is for plane bodies and this one has {space.dimension} dimensions: leave "
                "it out"
            )
        self._nodes = {
            label: space.find_nodes(np.asarray(corners, float))
            for label, corners in self.frames.items()
        }
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        """Return racking and rotation of all frames in a state."""
        row = {}
        u = self._problem.cartesian(state.u)
        for label, nodes in self._nodes.items():
            values = self._problem.system.space.sample(u, nodes, state.t)
            shear, turn = racking(self.frames[label], values)
            row[f"racking_{label}"] = float(shear)
            row[f"rotation_{label}"] = float(turn)
        return row


def racking(corners: ArrayLike, displacements: Array) -> tuple[Array, Array]:
    """Return (racking, rotation) of four corners (4, 2) [m] moved by (..., 4, 2) [m].

    Each is (...,), in radians.

    The displacement gradient G that fits the corners best, u = a + G X, gives racking = du_x/dy +
    du_y/dx and rotation = (du_y/dx - du_x/dy)/2, anticlockwise. For a rectangle du_x/dy is the mean
    over its sides, du_y/dx over bottom and top (Wang 1993: the racking ratio is this over the free
    field's shear strain). InputError for corners on one line.
    """
    x = array("racking", "corners", corners, (4, 2), unit="m")
    arms = x - x.mean(axis=0)
    gram = arms.T @ arms
    if np.linalg.eigvalsh(gram)[0] <= 1e-12 * np.trace(gram):
        raise InputError("Racking: the four corners are on one line: give the corners of a frame")
    gradient = np.einsum(
        "...ki,kj->...ij", np.asarray(displacements, dtype=float), arms @ np.linalg.inv(gram)
    )
    return gradient[..., 0, 1] + gradient[..., 1, 0], 0.5 * (
        gradient[..., 1, 0] - gradient[..., 0, 1]
    )
