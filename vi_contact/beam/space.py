"""What the unknowns of rod and beam mean, for recorders and writers: displacements (along, across) of the nodes."""

from __future__ import annotations

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError


class BeamSpace:
    """Nodes at ``x`` (the clamped one left out) on the axis. Unknowns: v_1 … v_n along the axis (n = m, or 1: of the
    tip alone), then theta_1 … theta_m and u_1 … u_m of a beam, if there is one. Rotations belong to no point."""

    def __init__(self, x: Array, along: int, beam: bool) -> None:
        self.x, self.along, self.beam = x, along, beam
        self.dimension = 2 if beam else 1
        self.unknowns = along + (2 * len(x) if beam else 0)

    @property
    def ids(self) -> Indices:
        """0, 1, …: one process owns all."""
        return np.arange(self.unknowns)

    @property
    def _nodes(self) -> Indices:
        """The node of each unknown."""
        m = len(self.x)
        rod = np.arange(m - self.along, m)
        return np.concatenate([rod, np.arange(m), np.arange(m)]) if self.beam else rod

    @property
    def coordinates(self) -> Array:
        """(unknowns, d) [m]."""
        places = np.zeros((self.unknowns, self.dimension))
        places[:, 0] = self.x[self._nodes]
        return places

    @property
    def bodies(self) -> Indices:
        """One body."""
        return np.zeros(self.unknowns, dtype=np.int64)

    def find_nodes(self, points: Array) -> Indices:
        """The nearest nodes; InputError for points off the axis, beyond the tip or at the clamp, which has none."""
        points = np.asarray(points, dtype=float)
        start, end = 0.5 * float(self.x[0]), float(self.x[-1])
        off = points[:, 0] < start, points[:, 0] > end * (1.0 + 1e-12), np.any(points[:, 1:] != 0.0, axis=1)
        if np.any(off):
            raise InputError(
                f"points {points.tolist()} are not all on the moving part of the beam: give x from {start:g} to "
                f"{end:g} on the axis"
            )
        return np.abs(points[:, :1] - self.x).argmin(axis=1)

    def sample(self, u: Array, nodes: Indices, t: float, derivative: int = 0) -> Array:
        """(k, d): displacement along the axis, zero where the rod has no unknowns, and across."""
        values, m = np.zeros((len(nodes), self.dimension)), len(self.x)
        rod = np.zeros(m)
        rod[m - self.along :] = u[: self.along]
        values[:, 0] = rod[nodes]
        if self.beam:
            values[:, 1] = u[self.along + m :][nodes]
        return values
