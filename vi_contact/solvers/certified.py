"""Certify or refuse steps.

There are a solver, the methods to escalate to, and the certificate of every answer.

An answer whose certificate comes near the tolerance, as round-off makes it where a factor meets
bodies of very unlike stiffness, is corrected by what it leaves over (``correction``) before it is
judged.
"""

from collections.abc import Sequence

import numpy as np

from ..core.algebra import EffectiveMatrix
from ..core.certificate import Certificate
from ..core.checks import on_all
from ..core.collective import together_if_own
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.products import freeze
from ..core.step import PreparedSolver, Solver, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..core.timing import report_time
from ..core.verify import kkt_residual
from .correction import corrected
from .door import refuse_matrix, refuse_nan

TOLERANCE = 1e-9
# of the tolerance: round-off of ordinary steps stays a hundred times below, and is left as it is
NEAR = 1e-2
FAR = 1e-4  # residuals above are not round-off
ADVICE = "try a smaller dt or another solver, or check the data of this time"


class CertifiedSolver:
    """Try a solver and the methods to escalate to, all bound to one effective matrix.

    Nothing uncertified leaves it.
    """

    def __init__(
        self,
        problem: ContactProblem,
        A: EffectiveMatrix,
        scale: float,
        solvers: Sequence[Solver],
        tolerance: float,
        *,
        surface: ContactSurface | None = None,
        advice: str = ADVICE,
    ) -> None:
        for solver in solvers:
            solver.check(problem)
        self._surface, self._A, self._scale, self._advice = (
            surface or problem.surface,
            A,
            scale,
            advice,
        )
        self._solvers, self._tolerance = solvers, tolerance
        self._prepared: dict[int, PreparedSolver] = {}
        refuse_matrix(problem, A)
        self._problem = problem
        self._get(0)

    @property
    def first(self) -> PreparedSolver:
        """Return the solver that is tried first."""
        return self._get(0)

    def _get(self, rank: int) -> PreparedSolver:
        """Return the solver of that rank of escalation, prepared when first needed."""
        if rank not in self._prepared:
            prepare = report_time("preparing")(self._solvers[rank].prepare)
            self._prepared[rank] = prepare(self._A, self._surface, self._scale)
        return self._prepared[rank]

    def solve(self, step: StepProblem) -> tuple[StepResult, Certificate, bool]:
        """Return (result, certificate, escalated) of the first method below tolerance.

        Raises:
            StepFailure: there is none.
        """
        refuse_nan(step, lambda: self._problem.equations)
        tried = []
        for rank in range(len(self._solvers)):
            try:
                with together_if_own(self._surface.comm, self._solvers[rank]):
                    result = self._get(rank).solve(step)
            except StepFailure as failure:
                tried.append(str(failure))
                continue
            freeze(result.x)
            certificate = kkt_residual(step, result)
            if max(NEAR * self._tolerance, result.aim) < certificate.worst < FAR:
                solve, goal = self._get(rank).solve, NEAR * self._tolerance
                result, certificate = corrected(step, result, certificate, solve, goal)
            if certificate.worst <= self._tolerance:
                return result, certificate, rank > 0
            tried.append(f"{result.method}: {certificate}")
        raise StepFailure(
            f"step {step.k} at t = {step.t:.6g} s stayed above the certificate tolerance "
            f"{self._tolerance:g} ({'; '.join(tried)}): {self._advice}"
        )


def check_laws(owner: str, problem: ContactProblem, *, unsymmetric: bool = False) -> None:
    """Raise InputError for laws that do not fit.

    This is for friction without a tangential direction, or of a wrong number of values, and for
    matrices that are not symmetric unless the owner solves with them. Collective.
    """
    surface, law = problem.surface, problem.friction
    if not unsymmetric and not problem.system.algebra.symmetric:
        raise InputError(
            f"{owner} needs symmetric matrices and those of the system are not: use "
            "Condensed(Lemke()), or Volume() with ReducedNewton() or SemismoothNewton()"
        )
    if problem.frictional and surface.tangents.shape[1] == 0:
        raise InputError(
            f"{owner} cannot use {law}: a body in one dimension cannot slide, so use Frictionless()"
        )
    on_all(
        surface.comm,
        "the friction law",
        lambda: law.limit(np.zeros(surface.count), surface.weights, 1.0),
    )
