"""Choose what a run uses when its user leaves time scheme or mass matrix open."""

from __future__ import annotations

from dataclasses import replace

from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given
from ..core.step import Scheme
from ..laws.mass import ConsistentMass
from ..schemes.trapezoidal import Trapezoidal
from ..schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from .method import check_scheme


def with_defaults(problem: ContactProblem, scheme: Scheme | None) -> tuple[ContactProblem, Scheme]:
    """Return the problem with a mass matrix and the scheme to run it with.

    Without a scheme: the trapezoidal rule on redistributed mass; with an impact law, or with mass at the contact nodes
    asked for, the Zienkiewicz-Wood-Taylor step at phi = ½, which never gains energy. Without a mass: the scheme's own
    choice.
    """
    check_problem_given("march", problem)
    check_scheme("march", scheme)
    if scheme is None:
        massive = problem.mass is not None and isinstance(problem.mass, ConsistentMass)
        scheme = Trapezoidal() if problem.impact is None and not massive else ZienkiewiczWoodTaylor()
    return (problem if problem.mass is not None else replace(problem, mass=scheme.mass)), scheme
