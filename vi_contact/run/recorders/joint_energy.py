"""Record where the work at a joint went."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core.algebra import total
from ...core.errors import InputError
from ...core.joints import pose_joint
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State


class JointEnergy:
    """Record the ledger of a joint in joules. Works and losses are sums since the start.

    What ``Energy`` calls loss_contact and loss_friction is here in its parts,

        loss_contact + loss_friction = change of energy_joint + loss_fracture + loss_rubbing
                       + loss_closing + loss_dilatancy - work_joint_water - work_prestress

    With the strength F, C, mu and P of a step, r' = r_n + F - P - lift and changes d of openings g,
    slips s and lifts of dilatancy:

        loss_fracture = F·dg - change of energy_joint      loss_rubbing = r_t·ds
        loss_closing = -r'·dg                               loss_dilatancy = -(r' - F + P)·d lift
        work_joint_water = P·dg
        work_prestress = tau0 w·ds - sigma0 w·(dg + d lift)

    loss_closing is the work of pressing in steps that close a gap, and of springs.
    """

    _COLUMNS: ClassVar[Columns] = {
        "energy_joint": ("J", "energy that the joint gives back when it closes"),
        "loss_fracture": ("J", "work of the tensile strength that does not come back"),
        "loss_rubbing": ("J", "work of friction and cohesion since the start"),
        "loss_closing": ("J", "work of pressing in steps that close a gap since the start"),
        "loss_dilatancy": ("J", "work of pressing on what slip lifts since the start"),
        "work_joint_water": ("J", "work of the water in the joint since the start"),
        "work_prestress": ("J", "work of the prestress since the start"),
    }
    _SUMS = tuple(_COLUMNS)[1:]

    def columns(self) -> Columns:
        """Name energy_joint, loss_fracture, loss_rubbing, … and work_prestress."""
        return self._COLUMNS

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the energy stored in the joint; sums are zero, or those that a restart continues.

        Args:
            problem: what is marched, with a joint.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        if problem.joint is None:
            raise InputError(
                "JointEnergy: the problem has no joint: leave the recorder out, or give the "
                "problem joint="
            )
        self._problem = problem
        self._stored = self._compute_stored(state)
        self._sums = dict.fromkeys(self._SUMS, 0.0)
        if resumed is not None:
            self._sums = {term: float(resumed[term]) for term in self._SUMS}
        return {"energy_joint": self._stored, **self._sums}

    def _compute_stored(self, state: State) -> float:
        """Return the energy [J] that the joint gives back when it closes. Collective."""
        joint = pose_joint(self._problem, state, 0.0)
        if not hasattr(joint.law, "stored"):
            return 0.0
        surface = self._problem.surface
        own = surface.weights @ joint.law.stored(joint.committed, joint.g0)
        return total(surface.comm, own)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of. Collective."""
        step = report.step
        joint = step.joint
        surface = self._problem.surface
        used = joint.used
        g1, s1 = joint.find_end(step, report.result)
        opening = g1 - joint.g0
        slip = s1 - joint.s0
        pressed = report.result.r_n / step.scale
        normal, shear = joint.prestress

        # What springs store is pressing too.
        closing = -float(pressed @ opening)
        closing += self._compress(report, pressed - joint.pull)
        r_t = report.result.r_t
        rubbing = 0.0 if r_t is None else float(np.sum(r_t * slip)) / step.scale
        own = [
            float(used.tension @ opening),
            rubbing,
            closing,
            -float((pressed - joint.pull) @ joint.lifted),
            float(used.water @ opening),
            float(np.sum(shear * slip)) - float(normal @ (opening + joint.lifted)),
        ]
        works = surface.comm.sum(np.array(own)).tolist()
        before = self._stored
        self._stored = self._compute_stored(report.new)
        works[0] -= self._stored - before
        for term, work in zip(self._SUMS, works, strict=True):
            self._sums[term] += work
        return {"energy_joint": self._stored, **self._sums}

    def _compress(self, report: Report, r_n: np.ndarray) -> float:
        """Return the work [J] of the reactions (m,) [N] of a step on its springs."""
        surface = self._problem.surface
        if surface.plain:
            return 0.0
        return float(r_n @ (surface.compliance * (report.new.r_n - report.old.r_n)))
