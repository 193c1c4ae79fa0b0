"""Contact on a condensed boundary step by step, through the contract and the methods for the small problem."""

from __future__ import annotations

import numpy as np

from ..core.checks import instance, number
from ..core.errors import StepFailure
from ..core.step import StepProblem, StepResult
from ..core.verify import kkt_residual
from ..solvers.certified import TOLERANCE
from ..solvers.condensed import Condensed
from .contact import BoundaryContact
from .contact_run import ContactRun, run_of


def march_contact(
    contact: BoundaryContact, *, solver: Condensed | None = None, tolerance: float = TOLERANCE
) -> ContactRun:
    """Marches through all steps of the compliance; ``solver``: Condensed with any of its methods.

    Raises StepFailure when a step's certificate exceeds ``tolerance``, with step, time and residuals.
    """
    instance("march_contact", "contact", contact, BoundaryContact, "give a BoundaryContact")
    if solver is not None:
        instance("march_contact", "solver", solver, Condensed, "give Condensed() with any of its methods, or None")
    number("march_contact", "tolerance", tolerance, positive=True)
    surface, matrix = contact.surface, contact.matrix
    prepared = (solver or Condensed()).prepare(matrix, surface, 1.0)
    v, active = np.zeros(int(contact.kept.sum())), surface.gap(0.0) <= 0.0
    loads = np.zeros_like(contact.v_free)
    steps: list[StepProblem] = []
    results: list[StepResult] = []
    for k in range(len(loads)):
        step = contact.step(k, loads, v, active)
        result = prepared.solve(step)
        certificate = kkt_residual(step, result)
        if not certificate.worst <= tolerance:
            raise StepFailure(f"boundary element step {step.k} at t = {step.t:.6g} s stayed above the certificate "
                              f"tolerance {tolerance:g} ({certificate}): try another method for the small problem")
        loads[k] = contact.load(result.r_n, result.r_t)
        v, active = result.x, result.active
        steps.append(step)
        results.append(result)
    return run_of(contact, steps, results)
