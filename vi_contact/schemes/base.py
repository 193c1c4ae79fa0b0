"""What schemes refuse, and what they warn of, when the mass at the contact nodes does not suit them."""

from __future__ import annotations

import logging

import numpy as np

from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..laws.impact import NoImpact

log = logging.getLogger(__name__)


def has_massless_contact(problem: ContactProblem) -> bool:
    """Whether the contact unknowns of the problem carry no inertia."""
    return problem.equations.massless is not None


def contact_in_the_balance(name: str, problem: ContactProblem) -> None:
    """Warns, once for a problem, of a scheme with contact in the acceleration balance on mass at the contact nodes.

    Such a scheme creates the energy ½ (r0 g1 - r1 g0) whenever a contact opens (V9.2).
    """
    surface = problem.surface
    rigid = bool(np.any(~surface.bilateral & (surface.compliance == 0.0)))
    if not rigid or has_massless_contact(problem):
        return
    told = problem.equations.kept(f"told of {name}", list)
    if not told and surface.comm.rank == 0:
        log.warning(
            "%s with consistent mass can gain energy whenever a contact opens: with Newmark's method a bar that "
            "bounces four times ends with 14 to 29 times its energy; leave out mass=ConsistentMass(), or take "
            "ContactStabilisedNewmark() or Midpoint()",
            name,
        )
    told.append(True)


def needs_mass(name: str, problem: ContactProblem) -> None:
    """InputError for a scheme whose contact is an impulse on the contact nodes, when these have no mass."""
    if has_massless_contact(problem):
        raise InputError(
            f"{name} needs mass at the contact nodes, whose forces would swing for ever: give the problem "
            "mass=ConsistentMass(), or use the default scheme Trapezoidal()"
        )


def needs_no_impact_law(problem: ContactProblem) -> None:
    """InputError for an impact law on massless contact nodes: there is no momentum that it could change."""
    if has_massless_contact(problem) and problem.impact is not None and not isinstance(problem.impact, NoImpact):
        raise InputError(
            f"the impact law {problem.impact} acts on the mass of contact nodes and this problem has none there: leave "
            "the law out, or give the problem mass=ConsistentMass()"
        )
