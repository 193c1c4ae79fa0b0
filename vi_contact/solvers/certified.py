"""Certify or refuse steps: try a solver, then the methods to escalate to, and judge each answer.

An answer whose certificate comes near the tolerance, as round-off makes it where a factor meets
bodies of very unlike stiffness, is corrected by what it leaves over (``correction``) before it is
judged.
"""

from collections.abc import Sequence

import numpy as np

from ..core.algebra import EffectiveMatrix
from ..core.checks import on_all
from ..core.collective import together_if_own
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, Solver, StepProblem
from ..core.surfaces import ContactSurface
from ..core.timing import report_time
from ..core.verify import kkt_residual
from .correction import correct
from .door import Source, refuse_matrix, refuse_nan
from .passes import Certified

TOLERANCE = 1e-9
# of the tolerance: round-off of ordinary steps stays a hundred times below, and is left as it is
NEAR = 1e-2
NEARER = 1e-1  # the same of answers whose correction takes as long as they took
FAR = 1e-4  # residuals above are not round-off
ADVICE = "try a smaller dt or another solver, or check the data of this time"


class CertifiedSolver:
    """Try a solver and the methods to escalate to, all bound to one effective matrix.

    No answer without a certificate below the tolerance leaves it.
    """

    def __init__(
        self,
        problem: ContactProblem | None,
        A: EffectiveMatrix,
        scale: float,
        solvers: Sequence[Solver],
        tolerance: float,
        *,
        surface: ContactSurface | None = None,
        advice: str = ADVICE,
    ) -> None:
        """Check the problem, and prepare the first solver. Collective.

        Args:
            problem: the contact problem; None of a condensed body, which has a surface alone.
            A: the effective matrix of its steps.
            scale: of reactions, over which compliances are divided.
            solvers: the solver, and the methods to escalate to.
            tolerance: the largest residual of a certificate.
            surface: in the place of the problem's.
            advice: end of the sentence that refuses a step.

        Raises:
            InputError: the problem, or a matrix that is not finite, does not suit a solver.
        """
        self._source: Source | None = None
        if problem is not None:
            for solver in solvers:
                solver.check(problem)
            refuse_matrix(problem, A)
            self._source = lambda: problem.equations
            surface = surface or problem.surface
        assert surface is not None  # that of a condensed body is given
        self._surface = surface
        self.A = A
        self._scale = scale
        self._solvers = solvers
        self._tolerance = tolerance
        self._advice = advice
        self._prepared: dict[int, PreparedSolver] = {}
        self._get(0)

    @property
    def first(self) -> PreparedSolver:
        """Return the solver that is tried first."""
        return self._get(0)

    def _get(self, place: int) -> PreparedSolver:
        """Return the solver at a place in the list of methods, prepared when first needed."""
        if place not in self._prepared:
            prepare = report_time("preparing")(self._solvers[place].prepare)
            self._prepared[place] = prepare(self.A, self._surface, self._scale)
        return self._prepared[place]

    def solve(self, step: StepProblem) -> Certified:
        """Return the first answer whose certificate is below the tolerance. Collective.

        Raises:
            StepFailure: no method has such an answer; the error says what each one gave.
        """
        # One method after another, until an answer has a certificate.
        refuse_nan(step, self._source)
        failures = []
        for place, solver in enumerate(self._solvers):
            try:
                with together_if_own(self._surface.comm, solver):
                    result = self._get(place).solve(step)
            except StepFailure as failure:
                failures.append(str(failure))
                continue
            answer = Certified(result, kkt_residual(step, result), place > 0)

            # Round-off that comes near the tolerance is corrected; larger residuals have causes
            # that no correction removes, and no solver is asked for more than it aims at. The
            # correction of a wall of stones, whose states lie within rounding of one another, may
            # take ten times as long as its step: only what comes nearer is corrected there.
            goal = NEAR * self._tolerance
            worst = answer.worst
            enough = NEARER * self._tolerance if result.corrects_slowly else goal
            if max(enough, result.aim) < worst < FAR:
                answer = correct(step, answer, self._get(place).solve, goal)
                worst = answer.worst
            if worst <= self._tolerance:
                return answer
            failures.append(f"{result.method}: {answer.certificate}")
        raise StepFailure(
            f"step {step.k} at t = {step.t:.6g} s stayed above the certificate tolerance "
            f"{self._tolerance:g} ({'; '.join(failures)}): {self._advice}"
        )


def refuse_traces(owner: str, surface: ContactSurface) -> None:
    """Raise InputError for conditions that share unknowns, where a solver needs one for each.

    Args:
        owner: the solver, as messages name it.
        surface: the contact conditions.
    """
    if surface.traces is not None:
        raise InputError(
            f"{owner} needs an unknown for each contact condition, and conditions of this surface "
            "share some, as those of a node in several pairs do, or of a corner that rubs on all "
            "its faces: use Condensed()"
        )


def refuse_rates(owner: str, problem: ContactProblem) -> None:
    """Raise InputError for a joint of slip rates, where a solver has no contact unknowns alone.

    Args:
        owner: the solver, as messages name it.
        problem: the contact problem.
    """
    if hasattr(problem.joint, "at_speed"):
        raise InputError(
            f"{owner} cannot use {type(problem.joint).__name__}, which is solved for the slip rate "
            "on the contact unknowns: use Condensed()"
        )


def check_laws(owner: str, problem: ContactProblem, *, unsymmetric: bool = False) -> None:
    """Raise InputError for laws and matrices that do not suit a solver. Collective.

    These are friction without a tangential direction, or of a wrong number of values, and matrices
    that are not symmetric.

    Args:
        owner: the solver, as messages name it.
        problem: the contact problem.
        unsymmetric: whether the solver takes matrices that are not symmetric.
    """
    surface = problem.surface
    law = problem.friction
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
