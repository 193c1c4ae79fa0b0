"""Step by Newmark's method: the equation of motion, with contact, holds at the end of the step.

    u1 = u0 + dt v0 + dt² ((½ - beta) a0 + beta a1),    v1 = v0 + dt ((1 - gamma) a0 + gamma a1)
    M a1 + C v1 + K u1 = f1 - B_nᵀ r_n1 - B_tᵀ r_t1
    0 <= r_n1  ⊥  gap0 - B_n u1 >= 0,    |r_t1| <= limit(r_n1) along B_t (u1 - u0)

Generalised-alpha with alpha_m = alpha_f = 0 (see there for A and restart); LinearMultistep.newmark
is the same in the two-step form of the boundary method. Order 2 at gamma = ½, else 1;
unconditionally stable for beta >= gamma/2 >= ¼.

Energy (Krenk), E of the bodies and their constant loads, with C = 0:

    [E + ½ (beta - gamma/2) dt² aᵀMa]0..1 = - du·(B_nᵀ r_n + B_tᵀ r_t)_gamma
                                            - (gamma - ½) (du·K du + (beta - gamma/2) dt² da·M da)
    (…)_gamma = (1 - gamma) (…)0 + gamma (…)1

At (¼, ½) without contact E is constant. With rigid contact its work is ½ (r_n0 g1 - r_n1 g0): on
consistent mass a gain whenever a contact opens; on redistributed mass of order dt, and then
Newmark(¼, ½) is Trapezoidal(). Impulses: dt times the reactions (…)_gamma are the change of
momentum in every step; the ledger uses these means. Source: Newmark, J. Eng. Mech. Div. ASCE 85
(1959) 67-94; Krenk, Comput. Methods Appl. Mech. Eng. 195 (2006) 6110-6124.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

from ..core.problem import ContactProblem
from ..core.step import Balance, State
from .generalised_alpha import AlphaStep, GeneralisedAlpha, balance_at


@dataclass(frozen=True)
class Newmark(AlphaStep):
    """Step by the module's equations; InputError is raised unless beta >= gamma/2 >= ¼.

    Attributes:
        beta: weight of a1 in u1.
        gamma: weight of a1 in v1.
    """

    beta: float = 0.25
    gamma: float = 0.5

    def __post_init__(self) -> None:
        _ = self.weights  # checks them

    @cached_property
    def weights(self) -> GeneralisedAlpha:
        """Return the member of generalised-alpha that the scheme is."""
        return GeneralisedAlpha(0.0, 0.0, self.beta, self.gamma)

    def _weigh_end(self) -> float:
        """Return gamma: with these weights M a dt is the change of momentum."""
        return self.gamma

    def _look_back(self, problem: ContactProblem, state: State) -> Callable[[], Balance]:
        """Return what makes the balance at the beginning, whose weight is 1 - gamma.

        Args:
            problem: the problem that is marched.
            state: at t0, with "a" and "reaction" in its memory.
        """
        return partial(balance_at, problem, state)
