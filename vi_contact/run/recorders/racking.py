"""Record the racking of frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...core.checks import array, column_name, instance
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State
from ...engineering.racking import racking


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
        """Find the nodes."""
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
