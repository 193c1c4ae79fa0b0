"""Say in one sentence why a step has no answer: how far it came, what stopped it, and what helps."""

from collections.abc import Sequence

from ...core.errors import StepFailure
from .conjugate_gradients import INDEFINITE, NOT_A_NUMBER, STAGNATED, WRONG_SIGNS

HELD = ("check that every body is held or has mass, that A is positive definite, and that no material is a million "
        "times stiffer than its neighbour")
OTHER = "take another preconditioner, or Condensed() where a factor fits into memory"
NUMBERS = "check the load, the guess and the bound of this step for NaN"
SAID = {
    STAGNATED: ("the residual stagnated", f"{HELD}; else {OTHER}"),
    INDEFINITE: ("A is not positive definite", HELD),
    NOT_A_NUMBER: ("the residual is not a number", NUMBERS),
    WRONG_SIGNS: ("the contact set did not settle", OTHER),
    -8: ("the preconditioner is not positive definite", OTHER),
    -11: ("the preconditioner could not be applied", OTHER),
}
SHOWN = 6  # residuals


def stopped(name: str, reason: int, iterations: int, history: Sequence[float]) -> StepFailure:
    """Return the failure of a solver that stopped for PETSc's ``reason``; ``history``: residuals over the forces."""
    words, remedy = SAID.get(reason, ("conjugate gradients broke down", f"{HELD}; else {OTHER}"))
    return StepFailure(f"{name} stopped after {iterations} linear iterations, {words} (residuals {told(history)}): "
                       f"{remedy}")


def told(history: Sequence[float]) -> str:
    """Return the first residual, some, and the last."""
    last = len(history) - 1
    chosen = sorted({round(i * last / (SHOWN - 1)) for i in range(SHOWN)}) if last > 0 else range(len(history))
    return ", ".join(f"{history[i]:.1e}" for i in chosen) or "none"
