"""Compare a whole run of finite elements with answers of other methods to the same problem.

Boundary elements, for example, have steps and points of their own. So what is compared are
resultants over the whole run: the impulse of the contact forces on the body, and the mean
displacement of its contact boundary to the support.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

import vi_contact as vc
from vi_contact.bem import ContactRun
from vi_contact.core.algebra import Array, largest, max_abs
from vi_contact.core.checks import instance, number, several
from vi_contact.core.errors import InputError
from vi_contact.core.step import Report, Scheme, Solver, State
from vi_contact.run.time_steps import TimeSteps


@dataclass(frozen=True)
class Reference:
    """Hold another answer to the same problem.

    It goes from the same initial time on; in the plane it is per metre of thickness.

    times: (k,) [s], increasing; impulse: (k, d) of the contact forces of the support on the body up
    to each time [N s]; mean_towards: (k,) displacement towards the support at each time, mean over
    the contact boundary [m].
    """

    name: str
    times: Array
    impulse: Array
    mean_towards: Array

    @classmethod
    def of(cls, run: ContactRun) -> "Reference":
        """Return the answer of boundary elements."""
        surface = run.contact.surface
        towards = np.array([surface.gap(t) for t in run.times]) - run.gap
        mean = np.asarray(towards @ surface.weights / surface.weights.sum())
        return cls("boundary elements", run.times, run.impulse, mean)


@dataclass(frozen=True)
class RunDifference:
    """Hold the largest differences between a run and a reference over their common times, relative.

    Impulses over the largest one, mean displacements over the largest of any point; ``bound``: up
    to which they agree.
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

    times: list[float] = field(default_factory=list)
    impulse: list[Array] = field(default_factory=list)
    towards: list[float] = field(default_factory=list)
    largest: float = 0.0

    def add(self, report: Report) -> None:
        """Add one more step. Collective."""
        surface = report.problem.surface
        system = report.problem.system
        mean = report.balance
        load = surface.reaction_load(mean.r_n, system.rows, mean.r_t)
        # on the body [N]
        force = 0.0 - surface.comm.sum(system.influence.T @ surface.along_axes(load))
        if not self.times:
            self._note(surface, report.old, np.zeros_like(force))
        self._note(surface, report.new, self.impulse[-1] + (report.new.t - report.old.t) * force)
        self.largest = max(self.largest, largest(surface.comm, max_abs(report.new.u)))

    def _note(self, surface: vc.ContactSurface, state: State, impulse: Array) -> None:
        self.times.append(state.t)
        self.impulse.append(impulse)
        moments = surface.weights @ surface.normal_values(state.u), surface.weights.sum()
        moved, size = surface.comm.sum(np.array(moments))
        self.towards.append(float(moved / size))

    def compare(self, reference: Reference, bound: float) -> RunDifference:
        """Return the differences.

        InputError for a reference in other dimensions, without common times, or with NaN.
        """
        mine = np.array(self.impulse)
        theirs = np.asarray(reference.impulse, float)
        t = np.asarray(reference.times, float)
        common = (t >= self.times[0]) & (t <= self.times[-1] * (1.0 + 1e-12))
        if (
            theirs.shape != (len(t), mine.shape[1])
            or not common.any()
            or not np.isfinite(theirs).all()
        ):
            raise InputError(
                f"{reference.name}: impulses of shape {theirs.shape}, {common.sum()} common times; "
                f"give finite ones, {mine.shape[1]} components each, at times of the run"
            )
        at = np.array([np.interp(t[common], self.times, column) for column in mine.T]).T
        off = float(np.linalg.norm(at - theirs[common], axis=1).max())
        size = float(np.linalg.norm(theirs[common], axis=1).max())
        away = max_abs(
            np.interp(t[common], self.times, self.towards)
            - np.asarray(reference.mean_towards)[common]
        )
        return RunDifference(
            reference.name, off / (size or 1.0), away / (self.largest or 1.0), bound
        )


def compare_runs(
    problem: vc.ContactProblem,
    references: Sequence[Reference],
    *,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    dt: TimeSteps,
    steps: int,
    state: State | None = None,
    bound: float = 0.02,
) -> list[RunDifference]:
    """March the problem and return how far each reference is off.

    Such is ``Reference.of`` a ``bem.ContactRun``.

    Impulses and mean displacements should agree within ``bound``, relative; the rest as in
    ``march``.
    """
    for one in several(
        "compare_runs", "references", references, "give a list of answers of other methods"
    ):
        instance(
            "compare_runs",
            "a reference",
            one,
            Reference,
            "give Reference.of(a bem.ContactRun), for example",
        )
    number("compare_runs", "bound", bound, positive=True)
    whole = RunComparison()
    for _, report in vc.march(
        problem, scheme=scheme, solver=solver, dt=dt, steps=steps, state=state
    ):
        whole.add(report)
    return [whole.compare(reference, bound) for reference in references]
