"""Energy along a run: its largest rise in a step, and what the ledger cannot explain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from bar import before_impact, energy, run

from vi_contact.core.algebra import total
from vi_contact.core.ledger import compute_energies, energy_balance
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import Report, State


@dataclass(frozen=True)
class Course:
    """Energies E include the potential of the constant load [J].

    rise: largest increase of E in a step; first, last: E at the ends; defect: of the ledger, summed
    over the run; largest: the largest ½ vᵀMv + ½ uᵀKu; min_gap [m]; contact, algorithmic, friction:
    smallest loss in a step.
    """

    rise: float
    first: float
    last: float
    defect: float
    largest: float
    min_gap: float
    contact: float
    algorithmic: float
    friction: float


def course(
    problem: ContactProblem,
    scheme: Any,
    *,
    dt: float,
    steps: int,
    state: State | None = None,
    seen: list[Report] | None = None,
    **more: Any,
) -> Course:
    """The energies of a run; its reports are added to ``seen``.

    Other keywords go to ``bar.run``.
    """
    surface, state = problem.surface, state or initial_state(problem)
    first = last = energy(problem, state)
    rise = contact = algorithmic = friction = min_gap = float("inf")
    rise, defect, largest = -rise, 0.0, 0.0
    for report in run(problem, scheme, dt=dt, steps=steps, state=state, **more):
        if seen is not None:
            seen.append(report)
        step = energy_balance(problem, report.old, before_impact(report), report.balance)
        now = energy(problem, report.new)
        rise, last, defect = max(rise, now - last), now, defect + step.defect
        largest = max(
            largest, compute_energies(problem.equations, report.new.u, report.new.v).total
        )
        min_gap = min(min_gap, float((surface.gap0 - surface.normal_values(report.new.u)).min()))
        contact, algorithmic = min(contact, step.contact), min(algorithmic, step.algorithmic)
        friction = min(friction, step.friction)
    return Course(rise, first, last, defect, largest, min_gap, contact, algorithmic, friction)


def rounded(problem: ContactProblem, way: float) -> float:
    """[J] What round-off leaves in the ledger of a body that has moved by ``way`` [m] as a whole:
    eps Σ K_ii way².

    The motion strains nothing, but K u is then a sum of products of this size that cancel, and each
    of them is rounded.
    """
    system = problem.equations
    diagonal = np.abs(system.K.diagonal())
    return float(np.finfo(float).eps * total(system.algebra.comm, diagonal.sum()) * way**2)
