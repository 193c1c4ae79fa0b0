"""Put PETSc's reasons for stopping into words, and make StepFailures of them.

PETSc 3.25 has other names for some reasons and other words for some errors; both are settled
here.
"""

import re
import tomllib
from pathlib import Path
from typing import Any

from ...core.errors import StepFailure

# SNES_DIVERGED_FNORM_NAN, in PETSc 3.25 SNES_DIVERGED_FUNCTION_NANORINF: the number stayed
NOT_A_NUMBER = -4
WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
CHECK_NUMBERS = "check the load, the guess and the bound of this step for NaN"
ADVICE = {
    "DIVERGED_LINEAR_SOLVE": (
        "check that the body is held or that mass enters A, and that A is positive definite"
    ),
    **dict.fromkeys(
        (name for name, words in WORDS.items() if words.endswith("not a number")), CHECK_NUMBERS
    ),
}
ERRORS = {  # of PETSc, by number
    55: "PETSc has no memory left: take Iterative(), which factorises nothing, or more memory",
    71: "the matrix has a zero pivot: check that the body is held or that mass enters A",
    81: "the matrix has a zero pivot: check that the body is held or that mass enters A",
}
UNKNOWN = (
    "PETSc says no more of the cause: check that the body is held and petsc_options fit, or "
    "try another method"
)
GENERAL_ADVICE = (
    "check that the body is held, try a smaller step, another method, or a larger iteration limit"
)


def name_of(reasons: type, reason: int) -> str:
    """Return the longest name of a reason in one of petsc4py's classes of reasons.

    Such names are CONVERGED_..., DIVERGED_...
    """
    names = [
        name
        for name, value in vars(reasons).items()
        if value == reason and not name.startswith("_")
    ]
    return max(names, key=len, default=f"reason {reason}")


def stopped(method: str, reasons: type, reason: int, iterations: int, worst: float) -> StepFailure:
    """Return the failure of a solver that stopped with a reason <= 0."""
    name = name_of(reasons, reason)
    words = WORDS.get(name, "no convergence")
    return StepFailure(
        f"{method} stopped after {iterations} iterations with relative residual {worst:.2g}, "
        f"{name} ({words}): {ADVICE.get(name, GENERAL_ADVICE)}"
    )


def raised(method: str, error: Any) -> StepFailure:
    """Return the failure of a PETSc call that raised."""
    said = last_line(error)
    code: Any = getattr(error, "ierr", "unknown")
    advice = ERRORS.get(code, UNKNOWN)
    # error 72, "Inf or NaN", or 83, "generated infinity or NaN"
    if re.search(r"\bnan\b", said, re.IGNORECASE):
        said, advice = f"not a number: {said}", CHECK_NUMBERS
    return StepFailure(f"{method} stopped with PETSc error {code} ({said}): {advice}")


def last_line(error: Any) -> str:
    """Return what is wrong, which PETSc tells at the end of its trace."""
    return str(error).splitlines()[-1].split("] ", 1)[-1].strip()
