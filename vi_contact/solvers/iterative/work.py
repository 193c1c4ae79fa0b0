"""Count what an iterative solver has done: iterations, products with A, renewals of the preconditioner."""

from dataclasses import dataclass


@dataclass
class Work:
    """Hold sums since the solver was prepared.

    ``linear_iterations`` of conjugate gradients, those of the fallback too, or of GMRES; ``newton_steps`` with
    friction; ``products`` with A; ``renewals`` of the preconditioner after the first; ``fallbacks``: steps that ended
    by projected gradients, or with limits of friction given for some rounds.
    """

    linear_iterations: int = 0
    newton_steps: int = 0
    products: int = 0
    renewals: int = 0
    fallbacks: int = 0
