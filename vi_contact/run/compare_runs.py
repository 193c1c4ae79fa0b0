"""Compare whole runs with answers of another method, whose steps and points are its own.

Per step such answers differ by their discretisations, so what is compared are resultants over time: the impulse of the
contact forces on the body and the mean displacement of its contact boundary towards the support.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import Report


class Reference(Protocol):
    """Give another answer to the same problem, from the same initial time on; in the plane per metre of thickness."""

    @property
    def name(self) -> str: ...
    @property
    def times(self) -> Array:
        """Return (k,) [s], increasing."""
        ...

    @property
    def impulse(self) -> Array:
        """Return (k, d) of the contact forces of the support on the body up to each time [N s]."""
        ...

    @property
    def mean_towards(self) -> Array:
        """Return (k,) displacement towards the support at each time, mean over the contact boundary [m]."""
        ...


@dataclass(frozen=True)
class RunDifference:
    """Hold the largest differences between a run and a reference over their common times, relative.

    The impulse is compared with the largest one, the mean displacement with the largest displacement of any point;
    ``bound``: up to which they are said to agree.
    """

    name: str
    impulse: float
    towards: float
    bound: float

    @property
    def worst(self) -> float:
        """Return the larger of them."""
        return max(self.impulse, self.towards)

    @property
    def agrees(self) -> bool:
        """Say whether both are within the bound."""
        return self.worst <= self.bound


@dataclass
class RunComparison:
    """Collect the resultants of a march, report by report, and compare them."""

    times: list[float] = field(default_factory=lambda: [0.0])
    impulse: list[Array] = field(default_factory=list)
    towards: list[float] = field(default_factory=lambda: [0.0])
    largest: float = 0.0

    def add(self, report: Report) -> None:
        """Add one more step. Collective."""
        problem, mean = report.problem, report.balance
        surface, system = problem.surface, problem.system
        load = surface.reaction_load(mean.r_n, system.rows, mean.r_t)
        force = _on_body(problem, load)
        if not self.impulse:
            self.times, self.impulse = [report.old.t], [np.zeros_like(force)]
            self.towards = [self._mean(problem, report.old.u)]
        self.times.append(report.new.t)
        self.impulse.append(self.impulse[-1] + (report.new.t - report.old.t) * force)
        self.towards.append(self._mean(problem, report.new.u))
        self.largest = max(self.largest, largest(surface.comm, max_abs(report.new.u)))

    @staticmethod
    def _mean(problem: ContactProblem, u: Array) -> float:
        weights = problem.surface.weights
        return float(weights @ problem.surface.normal_values(u) / weights.sum())

    def compare(self, reference: Reference, bound: float) -> RunDifference:
        """Return the differences. InputError for a reference in other dimensions, without common times, or with NaN."""
        mine, theirs = np.array(self.impulse), np.asarray(reference.impulse, float)
        t = np.asarray(reference.times, float)
        common = (t >= self.times[0]) & (t <= self.times[-1] * (1.0 + 1e-12))
        if theirs.shape != (len(t), mine.shape[1]) or not common.any() or not np.isfinite(theirs).all():
            raise InputError(f"{reference.name}: impulses of shape {theirs.shape}, {common.sum()} common times; give "
                             f"finite ones, {mine.shape[1]} components each, at times of the run")
        at = np.array([np.interp(t[common], self.times, column) for column in mine.T]).T
        off = float(np.linalg.norm(at - theirs[common], axis=1).max())
        size = float(np.linalg.norm(theirs[common], axis=1).max())
        away = max_abs(np.interp(t[common], self.times, self.towards) - np.asarray(reference.mean_towards)[common])
        return RunDifference(reference.name, off / (size or 1.0), away / (self.largest or 1.0), bound)


def _on_body(problem: ContactProblem, load: Array) -> Array:
    """(d,) the contact force on the body [N]."""
    surface, system = problem.surface, problem.system
    return np.asarray(0.0 - surface.comm.sum(system.influence.T @ surface.along_axes(load)))
