"""Put PETSc's reasons for stopping into words, and make StepFailures of them.

PETSc 3.25 has other names for some reasons and other words for some errors; both are settled
here.
"""

import re
from typing import Any

from ...core.errors import StepFailure

# SNES_DIVERGED_FNORM_NAN, in PETSc 3.25 SNES_DIVERGED_FUNCTION_NANORINF: the number stayed
NOT_A_NUMBER = -4
# Names of PETSc's reasons for stopping -> their meaning.
MEANING = {
    "DIVERGED_FUNCTION_DOMAIN": "the residual could not be evaluated",
    "DIVERGED_FUNCTION_COUNT": "too many residual evaluations",
    "DIVERGED_LINEAR_SOLVE": "a linear system could not be solved",
    "DIVERGED_FNORM_NAN": "the residual is not a number",
    "DIVERGED_FUNCTION_NANORINF": "the residual is not a number",
    "DIVERGED_OBJECTIVE_NANORINF": "the objective is not a number",
    "DIVERGED_MAX_IT": "the iteration limit was reached",
    "DIVERGED_LINE_SEARCH": "the line search found no descent",
    "DIVERGED_INNER": "the inner solve failed",
    "DIVERGED_LOCAL_MIN": "the merit function has a minimum that is no solution",
    "DIVERGED_DTOL": "the residual grew without limit",
    "DIVERGED_MAXITS": "the iteration limit was reached",
    "DIVERGED_NAN": "the objective is not a number",
    "DIVERGED_MAXFCN": "too many evaluations of the objective",
    "DIVERGED_LS_FAILURE": "the line search found no descent",
    "DIVERGED_TR_REDUCTION": "the trust region shrank to nothing",
    "DIVERGED_USER": "the matrix is not positive definite, so that nothing has a minimum",
}
CHECK_NUMBERS = "check the load, the guess and the bound of this step for NaN"
ADVICE = {
    "DIVERGED_LINEAR_SOLVE": (
        "check that the body is held or that mass enters A, and that A is positive definite"
    ),
    **dict.fromkeys(
        (name for name, words in MEANING.items() if words.endswith("not a number")), CHECK_NUMBERS
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


def find_name(reasons: type, reason: int) -> str:
    """Return the name of a reason, such as DIVERGED_MAX_IT; of several the longest.

    ``reasons`` is petsc4py's class of them.
    """
    names = [
        name
        for name, value in vars(reasons).items()
        if value == reason and not name.startswith("_")
    ]
    return max(names, key=len, default=f"reason {reason}")


def make_reason_failure(
    method: str, reasons: type, reason: int, iterations: int, worst: float
) -> StepFailure:
    """Return the error of a solver that stopped without an answer.

    Args:
        method: its name.
        reasons: petsc4py's class of reasons.
        reason: that for which it stopped, <= 0.
        iterations: so far.
        worst: relative residual.
    """
    name = find_name(reasons, reason)
    words = MEANING.get(name, "no convergence")
    return StepFailure(
        f"{method} stopped after {iterations} iterations with relative residual {worst:.2g}, "
        f"{name} ({words}): {ADVICE.get(name, GENERAL_ADVICE)}"
    )


def make_petsc_failure(method: str, error: Any) -> StepFailure:
    """Return the error of a method in which a call of PETSc raised one."""
    words = read_last_line(error)
    code: Any = getattr(error, "ierr", "unknown")
    advice = ERRORS.get(code, UNKNOWN)
    # error 72, "Inf or NaN", or 83, "generated infinity or NaN"
    if re.search(r"\bnan\b", words, re.IGNORECASE):
        words = f"not a number: {words}"
        advice = CHECK_NUMBERS
    return StepFailure(f"{method} stopped with PETSc error {code} ({words}): {advice}")


def read_last_line(error: Any) -> str:
    """Return the end of PETSc's trace, which says what is wrong."""
    return str(error).splitlines()[-1].split("] ", 1)[-1].strip()
