"""Compare contact tractions of boundary elements and of finite elements.

They are compared by nodal forces, not point by point.

A traction of boundary elements is the force on a node over its length, a mean over a step. So the
forces on the nodes of the finite elements, means over the same steps, are collected on the nodes of
the boundary elements, each on its two neighbours in the ratio of the distances (their hat
functions): ends of the contact boundary, where tractions are singular, are compared as forces.
Means over windows of time and over hats of a greater ``width`` tell resolution from disagreement.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vi_contact.bem.contact_run import ContactRun
from vi_contact.core.algebra import Array, Mask
from vi_contact.core.surfaces import ContactSurface


@dataclass(frozen=True)
class Tractions:
    """Hold tractions of both methods (steps, m) [Pa].

    They are those on the m nodes of the boundary elements, in the order of ``x``.

    x, lengths: (m,) [m]; times: (steps,) ends of the steps [s].
    """

    x: Array
    lengths: Array
    times: Array
    mine: Array
    theirs: Array

    def difference(
        self,
        *,
        window: float = 0.0,
        width: float = 0.0,
        between: tuple[float, float] = (0.0, np.inf),
        nodes: Mask | None = None,
    ) -> float:
        """Return the relative L2 difference over time and contact boundary.

        It is that of means over windows [s] (a step by default) and hats of a ``width`` [m] (an
        element), in an interval of time, at chosen nodes of both.
        """
        dt = float(self.times[1] - self.times[0])
        count = max(1, round(window / dt))
        place = (
            np.linspace(self.x[0], self.x[-1], round(np.ptp(self.x) / width) + 1)
            if width
            else self.x
        )
        weights = shares(self.x, place) * self.lengths[:, None]
        lengths = weights.sum(axis=0)
        chosen = slice(None) if nodes is None else nodes
        inside = (self.times > between[0] * (1 + 1e-9)) & (self.times <= between[1] * (1 + 1e-9))
        # a hat between the nodes of a coarse mesh has none of them
        covered = np.where(lengths > 0.0, lengths, 1.0)
        mine, theirs = (
            (_means(values[inside], count) @ weights / covered)[:, chosen]
            for values in (self.mine, self.theirs)
        )
        size = np.sqrt(lengths[chosen])
        return float(np.linalg.norm((mine - theirs) * size) / np.linalg.norm(theirs * size))


def compared(
    run: ContactRun, surface: ContactSurface, history: Mapping[str, Array]
) -> tuple[Tractions, Tractions]:
    """Return pressures and shears of two runs.

    The shears are of the support on the body along +x, of a run of boundary elements and of a
    history of finite elements on the contact points of ``surface`` (all of them, on one rank).
    """
    order = np.argsort(run.contact.compliance.points[:, 0])
    points = surface.points
    x = run.contact.compliance.points[order, 0]
    lengths = run.contact.surface.weights[order]
    collect = shares(points[:, 0], x) * surface.weights[:, None]
    found = []
    for sign, mine, theirs in ((1.0, run.pressure, "pressure"), (-1.0, run.shear, "traction_t")):
        values = (
            history[theirs].reshape(len(history["t"]), -1)
            if theirs in history
            else np.zeros(history["pressure"].shape)
        )
        steps = _over_steps(history["t"], values, run.times)
        found.append(
            Tractions(
                x,
                lengths,
                run.times[: len(steps)],
                sign * mine[: len(steps), order],
                sign * (steps @ collect) / lengths,
            )
        )
    return found[0], found[1]


def shares(x: Array, nodes: Array) -> Array:
    """Return (points, nodes) the share of every node in what is at x.

    It is linear between the two neighbours.
    """
    return np.stack([np.interp(x, nodes, unit) for unit in np.eye(len(nodes))], axis=1)


def _over_steps(times: Array, values: Array, ends: Array) -> Array:
    """Return means over the steps that end at ``ends`` of values that are linear between times."""
    inside = ends <= times[-1] * (1.0 + 1e-9)
    area = np.concatenate(
        [
            np.zeros((1, values.shape[1])),
            np.cumsum(0.5 * np.diff(times)[:, None] * (values[1:] + values[:-1]), axis=0),
        ]
    )
    edges = np.concatenate([[0.0], ends[inside]])
    at = np.stack([np.interp(edges, times, column) for column in area.T], axis=1)
    return np.asarray(np.diff(at, axis=0) / np.diff(edges)[:, None])


def _means(values: Array, count: int) -> Array:
    """Return means over windows of so many steps; a rest at the end is left out."""
    windows = len(values) // count
    return np.asarray(values[: windows * count].reshape(windows, count, -1).mean(axis=1))
