"""Record the water in a joint: its force, its crack, and what is left of pressures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.arguments import check_fields
from ...core.errors import InputError
from ...core.joints import pose_joint
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State

_COLUMNS: Columns = {
    "uplift_force": ("N", "force of the water in the joint Σ p weight"),
    "uplift_effective": ("N", "what is left of the normal reactions, Σ (r_n - p weight)"),
    "crack_length": ("m", "length of the crack from the heel; 0 without JointWater"),
    "water_pressure": ("Pa", "water pressure p of every contact point"),
    "effective_pressure": ("Pa", "r_n / weight - p of every contact point"),
}
_ARRAYS = ("water_pressure", "effective_pressure")


@dataclass
class Uplift:
    """Record the water in a joint.

    Reactions are total ones, as ``Contact`` records them: r_n = r' - F + p weight. The effective
    pressure r_n/weight - p is what friction feels; it is negative where the joint bears tension.
    The crack is what has opened from the heel on (``laws.JointWater``).

    Args:
        arrays: whether the pressures of all points are recorded too.
    """

    arrays: bool = True

    def __post_init__(self) -> None:
        check_fields(self)

    def columns(self) -> Columns:
        """Name uplift_force, uplift_effective, crack_length and the arrays."""
        if self.arrays:
            return _COLUMNS
        return {name: about for name, about in _COLUMNS.items() if name not in _ARRAYS}

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the first state. Collective.

        Args:
            problem: what is marched, with a joint.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        if problem.joint is None:
            raise InputError(
                "Uplift: the problem has no joint, so that there is no water in it: leave the "
                "recorder out, or give the problem joint=laws.Joint(water=…)"
            )
        self._problem = problem
        joint = pose_joint(problem, state, 0.0)
        return self._row(state, joint.ask(joint.g0, joint.s0).water, joint)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of. Collective."""
        joint = pose_joint(self._problem, report.new, 0.0)
        return self._row(report.new, report.step.joint.used.water, joint)

    def _row(self, state: State, water: np.ndarray, joint: Any) -> Row:
        """Return the row of a state. Collective.

        Args:
            state: whose reactions count.
            water: forces (m,) [N] of the water.
            joint: posed at the state.
        """
        surface = self._problem.surface
        uplift, pressed = surface.comm.sum(np.array([water.sum(), state.r_n.sum()])).tolist()
        crack = 0.0
        if hasattr(joint.law, "find_crack"):
            crack = joint.law.find_crack(joint.g0)
        row: dict[str, Any] = {
            "uplift_force": uplift,
            "uplift_effective": pressed - uplift,
            "crack_length": crack,
        }
        if self.arrays:
            table = np.column_stack([water, state.r_n - water]) / surface.weights[:, None]
            whole = surface.on_first(table)
            row |= {name: whole[:, k].copy() for k, name in enumerate(_ARRAYS)}
        return row
