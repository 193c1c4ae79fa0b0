"""Record the interface between channel and soil besides the channel's own points (Fig. 7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from ...core.surfaces import ContactSurface
from ...fem.contact.frames import FemSurface
from ...run.recorders import Probe


@dataclass
class SoilProbe(Probe):
    """Record, as `Probe` does, at the nodes of the soil that touch these points of the channel in the undeformed mesh.

    InputError for a point that is not at the interface.
    """

    def _found(self, problem: ContactProblem, points: Array) -> Indices:
        """Numbers of the nodes of side 2 that face those of side 1 (the nearest where divisions differ)."""
        nodes, surface = super()._found(problem, points).tolist(), problem.surface
        faced: dict[int, int] = {}
        for part in surface.parts if isinstance(surface, FemSurface) else ():
            if part.facing is not None:
                opposite = part.facing.nodes.numbers[np.asarray(part.facing.P.argmax(axis=1)).ravel()]
                faced |= dict(zip(part.nodes.numbers.tolist(), opposite.tolist(), strict=True))
        if not faced.keys() >= set(nodes):
            raise InputError("a soil probe is not at the interface with the channel: give points of the channel's "
                             "outline")
        return np.array([faced[node] for node in nodes], dtype=np.int64)


@dataclass(frozen=True)
class Openings:
    """Record the largest gap of each side of the contact: columns opening_<side> [m]. ``sides``: name -> mask (m,)."""

    sides: Mapping[str, Mask]

    def columns(self) -> Columns:
        return {f"opening_{side}": ("m", f"largest gap of the contact side '{side}'") for side in self.sides}

    def start(self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None) -> Row:
        return self._row(problem.surface, state)

    def row(self, report: Report) -> Row:
        return self._row(report.problem.surface, report.new)

    def _row(self, surface: ContactSurface, state: State) -> dict[str, Any]:
        gap = surface.gap(state.t) - surface.normal_values(state.u)
        return {f"opening_{side}": float(gap[mask].max()) for side, mask in self.sides.items()}
