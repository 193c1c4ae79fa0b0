"""Count what an iterative solver has done: products with A, their processor time, renewals of the preconditioner."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class Work:
    """Hold sums since the solver was prepared, on this rank; times are seconds of its processor.

    ``linear_iterations`` of conjugate gradients, those of the fallback too, or of GMRES; ``newton_steps`` with
    friction; ``products`` with A, which took ``product_seconds``; ``renewals`` of the preconditioner after the first,
    which with it took ``set_up_seconds``;
    ``fallbacks``: steps that ended by projected gradients, or with limits of friction given for some rounds.
    """

    linear_iterations: int = 0
    newton_steps: int = 0
    products: int = 0
    product_seconds: float = 0.0
    renewals: int = 0
    set_up_seconds: float = 0.0
    fallbacks: int = 0

    @contextmanager
    def product(self) -> Iterator[None]:
        """Count and time one product."""
        start = time.process_time()
        yield
        self.products += 1
        self.product_seconds += time.process_time() - start

    @contextmanager
    def set_up(self) -> Iterator[None]:
        """Measure how long a preconditioner is made or renewed."""
        start = time.process_time()
        yield
        self.set_up_seconds += time.process_time() - start
