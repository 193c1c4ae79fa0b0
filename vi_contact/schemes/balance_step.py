"""What schemes share that have contact in the balance of forces at the end of a step."""

from __future__ import annotations

from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..laws.mass import Redistributed
from .guard import contact_in_the_balance, needs_no_impact_law


class BalanceStep:
    """Safe without mass at the contact nodes only."""

    @property
    def mass(self) -> MassLaw:
        """Contact stands in the balance of forces: without mass at the contact nodes it cannot create energy."""
        return Redistributed()

    def check(self, problem: ContactProblem) -> None:
        """InputError for an impact law on massless contact nodes; warns when they have mass."""
        needs_no_impact_law(problem)
        contact_in_the_balance(repr(self), problem)
