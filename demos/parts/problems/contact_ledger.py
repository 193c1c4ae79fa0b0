"""Keep the energy ledger of a contact run of boundary elements, from boundary data alone."""

from dataclasses import dataclass

import numpy as np

from vi_contact.bem.contact_run import ContactRun
from vi_contact.bem.poincare_steklov import BoundaryMotion, work
from vi_contact.core.algebra import Array, Mask
from vi_contact.core.checks import array, instance, mask, optional
from vi_contact.core.errors import InputError


@dataclass(frozen=True)
class ContactLedger:
    """Hold the works up to each time (steps,) [J/m] from boundary data.

    With them, energy = load + contact + support to round-off.

    energy: of the body; load: of the tractions; contact: of the contact forces, friction included;
    support: of what holds prescribed unknowns; friction: what friction took (in ``contact``
    already).
    """

    energy: Array
    load: Array
    contact: Array
    support: Array
    friction: Array

    @property
    def defect(self) -> float:
        """Return |energy - load - contact - support| over the largest of them."""
        terms = (self.energy, self.load, self.contact, self.support)
        size = max(float(np.abs(term).max(initial=0.0)) for term in terms)
        return float(np.abs(self.energy - self.load - self.contact - self.support).max()) / (
            size or 1.0
        )


def ledger(
    run: ContactRun, motion: BoundaryMotion, loads: Array, *, supported: Mask | None = None
) -> ContactLedger:
    """Return the works of a run from its boundary motion.

    That is BoundaryProblem.solve(run.forces); ``loads`` are (steps, 2, n).

    supported: (2, n), the ``fixed`` of the problem.
    """
    instance("ledger", "run", run, ContactRun, "give the answer of march_contact")
    instance("ledger", "motion", motion, BoundaryMotion, "give BoundaryProblem.solve(run.forces)")
    loads = array("ledger", "loads", loads, motion.displacement.shape, unit="N/m")
    if len(run.times) != len(motion.times):
        raise InputError(
            f"ledger: the run has {len(run.times)} steps and the motion {len(motion.times)}; give "
            "the motion of this run, BoundaryProblem.solve(run.forces)"
        )
    optional(mask, "ledger", "supported", supported, motion.displacement.shape[1:])
    held = np.zeros(loads.shape[1:], bool) if supported is None else supported
    support = work(np.where(held, motion.forces, 0.0), motion.displacement)
    load = work(np.where(held, 0.0, loads), motion.displacement)
    return ContactLedger(motion.work, load, run.work, support, run.friction_loss)
