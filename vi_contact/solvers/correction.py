"""Correct an answer: what it leaves over is a step of its own, small, for the same solver.

The answer (x0, r0) stays, but for a share s of its reactions. The contract of ``step.py`` for d = x
- x0 and q = r - (1 - s) r0 is the contract again, because reactions that obey the laws form a cone
at every point:

    A d = (b - A x0 - (1 - s) Bᵀr0) - Bᵀq
    |q_t| <= s cohesion + slope q_n, along the slip B_t d - (slip0 - B_t x0)
    0 <= q_n  ⊥  (bound - B_n x0 + (1 - s) compliance r0_n / scale)
                 - B_n d + compliance q_n / scale >= 0

Its solution is that of the step, exactly, whatever s is, as long as no reaction falls by more than
its share: q_n >= 0 leaves r_n >= (1 - s) r0_n. But a solver passes through numbers as large as
A⁻¹Bᵀq, and their round-off is now s times what it was. Where a stiff body rests on a soft one, or
on nothing but contact, A⁻¹Bᵀr is millions of times x.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..core.algebra import Array
from ..core.collective import ask_limit
from ..core.errors import StepFailure
from ..core.protocols import FrictionLaw
from ..core.step import StepProblem, StepResult
from ..core.verify import kkt_residual
from .passes import Certified, Passes, certify, pose_about

# share over residual: reactions may be that much more wrong than the residual tells
MARGIN = 2.0**10
LEAST = 2.0**-30
ROUNDS = 3


@dataclass(frozen=True)
class Share:
    """Count the limit of a friction law in shares of the reactions: s limit(r / s).

    Attributes:
        law: the friction law.
        share: s.
    """

    law: FrictionLaw
    share: float

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return the limit: the cohesive part is a share of what it was, the slope is the same.

        Args:
            r_n: (m,) normal reactions.
            weights: (m,) areas of the conditions [m²].
            scale: of reactions.
        """
        return self.share * self.law.limit(r_n / self.share, weights, scale)

    def slope(self, weights: Array) -> Array:
        """Return the slope of the law."""
        return self.law.slope(weights)

    def at(self, speed: Array) -> FrictionLaw:
        """Return the share of the law at this slip rate [m/s]: itself where it knows no rates."""
        law = self.law.at(speed)
        return self if law is self.law else Share(law, self.share)


def choose_share(residual: float) -> float:
    """Return the share of reactions that an answer with this residual gives back.

    It is a power of two, so that no digit is lost.
    """
    power = np.ceil(np.log2(max(residual, LEAST) * MARGIN))
    return float(np.clip(np.exp2(power), LEAST, 1.0))


def pose_remainder(step: StepProblem, answer: StepResult, share: float) -> StepProblem:
    """Return the step for d and q of the head of this file.

    Args:
        step: the step of the answer.
        answer: what leaves something over.
        share: s, of its reactions that it gives back.
    """
    surface = step.surface
    x = answer.x
    r_n, r_t = keep_reactions(step, answer, share)
    b = step.b - step.A @ x - surface.reaction_load(r_n, len(x), r_t)
    posed = pose_about(step, x, b, answer.active)
    return replace(
        posed,
        bound=posed.bound + surface.compliance * r_n / step.scale,
        friction=step.friction if share == 1.0 else Share(step.friction, share),
    )


def add(step: StepProblem, answer: StepResult, rest: StepResult, share: float) -> StepResult:
    """Return the answer with the solution of what it left over.

    Args:
        step: the step of the answer.
        answer: what left something over.
        rest: d and q, the answer to ``pose_remainder`` with the same share.
        share: s.
    """
    r_n, r_t = keep_reactions(step, answer, share)
    if rest.r_t is not None:
        r_t = rest.r_t if r_t is None else r_t + rest.r_t
    return replace(
        rest,
        x=answer.x + rest.x,
        r_n=r_n + rest.r_n,
        r_t=r_t,
        iterations=answer.iterations + rest.iterations,
    )


def keep_reactions(
    step: StepProblem, answer: StepResult, share: float
) -> tuple[Array, Array | None]:
    """Return 1 - s times the reactions, which corrections keep.

    Args:
        step: the step of the answer.
        answer: whose reactions they are.
        share: s.

    Returns:
        r_n (m,) and, with friction, r_t (m, d - 1).
    """
    surface = step.surface
    r_n = np.where(surface.bilateral, answer.r_n, np.maximum(answer.r_n, 0.0))
    if answer.r_t is None or step.slip0 is None:
        return (1.0 - share) * r_n, None

    # Friction outside the cone, or no farther than s from its edge, is put on its edge: whether it
    # sticks or slips, what is missing then lies in the cone of q.
    law = step.friction_at(surface.tangential_values(answer.x) - step.slip0)
    limit = ask_limit(law, r_n, surface.weights, step.scale)
    size = np.linalg.norm(answer.r_t, axis=1)
    onto = np.divide(limit, size, out=np.ones_like(size), where=size > (1.0 - share) * limit)
    return (1.0 - share) * r_n, (1.0 - share) * onto[:, None] * answer.r_t


def correct(
    step: StepProblem,
    answer: Certified,
    solve: Callable[[StepProblem], StepResult],
    goal: float,
) -> Certified:
    """Correct an answer until its certificate is at the goal, or as near as it gets. Collective.

    Args:
        step: the step.
        answer: its answer.
        solve: the solver.
        goal: the residual to come to.

    Returns:
        The corrected answer.
    """
    passes = Passes(tolerance=np.inf, goal=goal, best=answer)
    certify(passes, _make_corrections(step, passes, solve), ROUNDS)
    return passes.best or answer


def _make_corrections(
    step: StepProblem, passes: Passes[Certified], solve: Callable[[StepProblem], StepResult]
) -> Iterator[Certified]:
    """Yield the best answer with what it left over, as long as the solver finds that. Collective.

    Args:
        step: the step.
        passes: the answers so far.
        solve: the solver.
    """
    while passes.best is not None:
        best = passes.best.result
        share = choose_share(passes.least)
        try:
            rest = solve(pose_remainder(step, best, share))
        except StepFailure:
            return
        better = replace(add(step, best, rest, share), method=best.method, history=best.history)
        yield replace(passes.best, result=better, certificate=kkt_residual(step, better))
