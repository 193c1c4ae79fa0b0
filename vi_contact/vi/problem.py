"""Prepare a variational inequality once, and solve it many times.

``Problem`` is the door for users, and ``inequality.solve`` for one answer. It reads what they give
(``forms``, ``bounds``), and takes one of two ways:

- a form F(u; v), with any Jacobian: Newton's method for variational inequalities (``newton``),
  whose linear problems are those of the volume route (``linear_steps``). It makes the natural
  residual u - mid(lower, u - F/J_ii, upper) smaller in each step; a linear problem takes one step.
- an energy, whose derivative F is: a descent with a trust region (``minimum``), which also leaves
  maxima and saddles. It is taken for a form too, where Newton's method fails and the Jacobian is
  symmetric.

What either has found is judged by one certificate (``judged``).
"""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.certificate import Certificate
from ..core.checks import instance, quote, whole
from ..core.collective import agree
from ..core.errors import InputError, StepFailure
from ..core.html import make_table
from ..fem import compat
from ..fem.body.form_checks import refuse_complex
from ..fem.mesh.communicators import MpiComm, give_back, keep_communicator
from ..solvers.volume.options import OptionLayers
from ..solvers.volume.route import Method, TaoTron, Volume
from .bounds import Bounds, take_common_part
from .equations import Equations
from .forms import make_error
from .judged import Judged
from .linear_steps import LinearSteps, is_symmetric
from .minimum import METHOD, minimise
from .model import Model
from .newton import Progress, solve_in_parts

log = logging.getLogger(__name__)

NEGATIVE = (
    "the Jacobian of F is not positive at this u, so that Newton's method may lead away from every "
    "answer: give the functional whose derivative F is as energy= in the place of F, or take "
    "smaller load steps"
)
HILL = (
    "the Jacobian of F is not positive at the answer: if F is the derivative of an energy, this u "
    "is no minimum of it, and energy= in the place of F finds one"
)
NEWTON_STEPS = 50  # of a form, at most, unless the user gives a number
DESCENT_STEPS = 1000  # of an energy


@dataclass(frozen=True)
class Result:
    """Hold the answer of ``solve``, and what is known of it.

    Attributes:
        u: the Function that was given.
        lambda_lower, lambda_upper: Functions of the multipliers, forces at points in the unit of
            F >= 0. With F the vector of F(u; phi_i), F = lambda_lower - lambda_upper where bcs
            prescribe nothing, and zero off the bounds.
        active: how many unknowns are on their lower and upper bounds: where the multiplier is above
            zero.
        certificate: relative residuals (``core.certificate``): equilibrium of inactive unknowns,
            distance of active ones from their bound (complementarity), signs of distances
            (penetration) and of multipliers (tension).
        iterations: steps of Newton's method, or downhill.
        inner: iterations of ``method`` in them, of conjugate gradients for an energy.
        method: the name of the method that solved the last linear problem.
        reason: why it ended, and whether u is a local minimum.
        seconds: of this rank's processor, for "setup" and "solve".
    """

    u: Any
    lambda_lower: Any
    lambda_upper: Any
    active: tuple[int, int]
    certificate: Certificate
    iterations: int
    inner: int
    method: str
    reason: str
    seconds: Mapping[str, float]

    def _repr_html_(self) -> str:
        """Return a table for a notebook, which calls this by its name."""
        lower, upper = self.active
        rows = [
            ("unknowns on bounds", f"{lower} on the lower, {upper} on the upper"),
            ("iterations", f"{self.iterations} (inner: {self.inner})"),
            ("method", self.method),
            ("reason", self.reason),
            *self.certificate.list_rows(),
        ]
        for name, value in self.seconds.items():
            rows.append((f"{name} [s]", f"{value:.3g}"))
        return make_table(rows)


class Problem:
    """Find u between bounds with F(u; v - u) >= 0 for all v between them, again and again.

    The forms are compiled, and matrices and PETSc's solvers are made, once. Between two answers
    values may change: those of coefficients and Constants in the forms, of the conditions, of the
    bounds, and of u, which holds the first guess.

    >>> import dolfinx, ufl, dolfinx.fem as own; from mpi4py import MPI; from vi_contact import vi
    >>> line = dolfinx.mesh.create_interval(MPI.COMM_SELF, 8, [0.0, 1.0])  # a string
    >>> V = getattr(own, "functionspace", own.FunctionSpace)(line, ("Lagrange", 1))
    >>> ends = own.dirichletbc(0.0, own.locate_dofs_geometrical(V, lambda x: x[0] % 1.0 == 0.0), V)
    >>> u, v, load = own.Function(V), ufl.TestFunction(V), own.Constant(line, 8.0)
    >>> string = vi.Problem((u.dx(0) * v.dx(0) + load * v) * ufl.dx, u, bcs=[ends])
    >>> string.solve(lower=-0.5).active[0], string.solve(lower=lambda x: -0.5 - x[0]).active[0]
    (3, 1)
    >>> load.value = 64.0
    >>> string.solve(lower=-0.5).active[0]
    7
    """

    def __init__(
        self,
        form: Any = None,
        u: Any = None,
        *,
        energy: Any = None,
        bcs: Sequence[Any] = (),
        J: Any = None,
        method: Method | None = None,
        petsc_options: Mapping[str, object | None] | None = None,
        prefix: str = "vi_contact_vi_",
        tolerance: float = 1e-9,
    ) -> None:
        """Check and compile the forms. Collective.

        Args:
            form: F(u; v) of UFL, linear or not in the Function u, or (a, L) for a(u, v) - L(v).
            u: the Function to solve for; its unknowns are values at points.
            energy: in the place of the form a functional Pi(u), whose derivative is F.
            bcs: dirichletbc on the space of u or its components. Their values may change later,
                where they hold u may not.
            J: the Jacobian, else the derivative of F.
            method: TaoTron(), ReducedNewton() or SemismoothNewton() of ``solvers``; None takes the
                first two where J is symmetric, the last two elsewhere.
            petsc_options: for the method, and of an energy for the preconditioner of conjugate
                gradients.
            prefix: of these options on the command line.
            tolerance: the largest residual of the certificate.

        Raises:
            InputError: forms, conditions or settings do not fit.
        """
        refuse_complex("vi.solve")
        refuse_unknowns(u)
        refuse_choices(form, energy, J, method)
        comm = MpiComm(keep_communicator(u.function_space.mesh.comm))
        choices = {
            "J": J is None,
            "energy": energy is None,
            "method": method,
            "number of bcs": len(bcs) if isinstance(bcs, list | tuple) else bcs,
            "petsc_options": petsc_options,
            "prefix": prefix,
            "tolerance": tolerance,
        }
        agree(comm, "vi.solve", choices)
        options = {} if petsc_options is None else petsc_options
        settings = Volume(method or TaoTron(), options, prefix, tolerance)
        give_back(comm.mpi)  # what problems of before have left, that nobody has closed

        self._by_energy = energy is not None
        self._tolerance = tolerance
        self._equations = Equations(form, u, bcs, J, energy, comm)
        self._bounds = Bounds(u, comm)
        self._layers = OptionLayers(prefix, choose_preconditioner(comm.size), options)
        rows = np.count_nonzero(self._equations.free)
        methods = () if method is None else (method,)
        self._steps = LinearSteps(settings, methods, comm, rows)

    def solve(
        self, *, lower: Any = None, upper: Any = None, iterations: int | None = None
    ) -> Result:
        """Return the answer for these bounds, and write it into u. Collective.

        Args:
            lower: bounds from below: a Function on the space of u; a Constant or numbers, one or
                one for each component; a function that takes points x (3, n) and returns values
                (n,) or (components, n); an expression of UFL; or None.
            upper: bounds from above, as ``lower``.
            iterations: steps, at most; None: 50, and 1000 of an energy.

        Returns:
            The answer, with multipliers and certificate.

        Raises:
            InputError: bounds or conditions contradict each other.
            StepFailure: the certificate stays above the tolerance; u keeps the best values so far.
        """
        start = time.process_time()
        if iterations is not None:
            whole("vi.solve", "iterations", iterations, least=1)
        equations = self._equations
        choices = {
            "lower": take_common_part(lower),
            "upper": take_common_part(upper),
            "iterations": iterations,
        }
        agree(equations.comm, "vi.solve", choices)

        # Read conditions and bounds; from here on u changes.
        equations.start()
        low, high = equations.restrict_bounds(
            self._bounds.read("lower", lower, -np.inf), self._bounds.read("upper", upper, np.inf)
        )
        ready = time.process_time()
        try:
            progress, doubt = self._find(low, high, iterations)
        except InputError:
            self._steps.close()  # so that options which are refused now are refused again
            raise
        reason = self._explain(progress, doubt)
        return finish(equations, progress, reason, start=start, ready=ready)

    def close(self) -> None:
        """Free the matrices and PETSc's solvers; ``solve`` makes them anew. Collective.

        Without ``close`` they are freed with the next Problem after this one is gone.
        """
        self._steps.close()
        self._equations.close()

    def _find(self, low: Array, high: Array, iterations: int | None) -> tuple[Progress, bool]:
        """Return where the method ends, and whether F has negative curvature there. Collective.

        Args:
            low: (n,) bounds of the free unknowns from below.
            high: (n,) from above.
            iterations: steps, at most; None for as many as are usual.
        """
        # Newton's method for a form, a descent for an energy.
        if self._by_energy:
            return self._descend(low, high, iterations), False
        limit = NEWTON_STEPS if iterations is None else iterations
        progress = solve_in_parts(self._equations, low, high, self._steps, limit)
        # A Jacobian with negative curvature explains a failure, and casts doubt on an answer.
        if not progress.failure and not progress.doubted:
            return progress, False
        point = judge_symmetric(progress)
        is_hill = point is not None and curves_down(point, self._layers)
        if not progress.failure or point is None or iterations is not None:
            return progress, is_hill

        # Where the Jacobian is symmetric everywhere, F is the derivative of an energy: go down, and
        # count the steps so far too.
        self._equations.put_back()
        descent = self._descend(low, high, iterations)
        if descent.failure:
            return progress, is_hill
        descent.count += progress.count
        descent.inner += progress.inner
        return descent, False

    def _descend(self, low: Array, high: Array, iterations: int | None) -> Progress:
        """Return where the descent ends. Collective.

        Args:
            low: (n,) bounds of the free unknowns from below.
            high: (n,) from above.
            iterations: steps, at most; None for as many as are usual.
        """
        limit = DESCENT_STEPS if iterations is None else iterations
        equations = self._equations
        progress = minimise(equations, low, high, self._tolerance, limit, self._layers)
        give_back(equations.comm.mpi)  # the models on the way have made PETSc objects
        return progress

    def _explain(self, progress: Progress, is_hill: bool) -> str:
        """Return why the method ended. Collective.

        Args:
            progress: of the method.
            is_hill: whether F has negative curvature where it ended.

        Raises:
            StepFailure: it ended without an answer.
        """
        steps = "steps downhill" if progress.method == METHOD else "Newton steps"
        worst = progress.best.certificate.worst
        reason = f"the certificate is {worst:.1e} after {progress.count} {steps}"
        if progress.failure:
            cause = NEGATIVE if is_hill else progress.failure
            sentence = f"vi.solve: {reason}, above {self._tolerance:g}: {cause}"
            raise give_up(self._equations, progress, sentence)
        if is_hill:
            reason += f", {HILL}"
            if self._equations.comm.rank == 0:
                log.warning("vi.solve: %s", HILL)
        if progress.method == METHOD:
            reason += ", at a local minimum: no direction of negative curvature is found"
        return reason


def finish(
    equations: Equations, progress: Progress, reason: str, *, start: float, ready: float
) -> Result:
    """Write the best values into u, and return the answer. Collective.

    Args:
        equations: with u.
        progress: of the method, which has found the answer.
        reason: why it ended.
        start: processor time [s] when the call began.
        ready: processor time [s] when conditions and bounds had been read.
    """
    best = progress.best
    equations.put(best.x)
    on_lower, on_upper = (equations.count(multiplier != 0.0) for multiplier in best.push)
    lambda_lower, lambda_upper = (equations.spread(multiplier) for multiplier in best.push)
    return Result(
        u=equations.u,
        lambda_lower=lambda_lower,
        lambda_upper=lambda_upper,
        active=(on_lower, on_upper),
        certificate=best.certificate,
        iterations=progress.count,
        inner=progress.inner,
        method=progress.method,
        reason=reason,
        seconds={"setup": ready - start, "solve": time.process_time() - ready},
    )


def refuse_unknowns(u: Any) -> None:
    """Raise InputError unless u is a Function whose unknowns are values of one field at points."""
    instance("vi.solve", "u", u, compat.fem.Function, "give the DOLFINx Function to solve for")
    if not compat.nodal(u.function_space):
        raise make_error(
            "the unknowns of u are not values of one field at points: take Lagrange or DG0, not "
            "mixed"
        )


def refuse_choices(form: Any, energy: Any, J: Any, method: Any) -> None:
    """Raise InputError unless there is a form or an energy, and what belongs to it.

    Args:
        form: F(u; v), or (a, L).
        energy: the functional of u.
        J: the Jacobian, of a form only.
        method: for linear steps, of a form only.
    """
    if form is None and energy is None:
        raise make_error(
            "there is nothing to solve: give the form F(u; v), or energy=, a functional of u"
        )
    if form is not None and energy is not None:
        raise make_error(
            "both a form and energy= are given: give one of them, as the form is the "
            "derivative of the energy"
        )
    if energy is not None and J is not None:
        raise make_error("J is given beside energy=, whose second derivative is J: leave J out")
    if energy is not None and method is not None:
        raise make_error(
            f"method is {quote(method)}, which solves the linear steps of a form; leave it "
            "out with energy="
        )


def choose_preconditioner(ranks: int) -> Mapping[str, object | None]:
    """Return the options that come before the user's, for conjugate gradients on so many ranks."""
    return {"pc_type": "icc"} if ranks == 1 else {"pc_type": "bjacobi", "sub_pc_type": "icc"}


def judge_symmetric(progress: Progress) -> Judged | None:
    """Return the best u with its Jacobian, which later points have replaced. Collective.

    It is None where F is linear, or its Jacobian not symmetric.
    """
    best = progress.best
    equations = best.equations
    if best.broken or equations.constant:
        return None
    equations.put(best.x, best.left)
    point = Judged(equations, best.lower, best.upper, best.left)
    return point if is_symmetric(point.A, equations.comm) else None


def curves_down(point: Judged, layers: OptionLayers) -> bool:
    """Say whether a symmetric Jacobian has a direction of negative curvature. Collective."""
    model = Model(point, layers)
    negative = model.curves_down()
    model.close()
    return negative


def give_up(equations: Equations, progress: Progress, sentence: str) -> StepFailure:
    """Write the best values into u, and return the error. Collective.

    Where conditions were never met, these are the first guess.

    Args:
        equations: with u.
        progress: of the method that failed.
        sentence: of the error; what u holds is added.
    """
    if progress.best.left:
        equations.put_back()
        return StepFailure(f"{sentence} (u holds the first guess)")
    equations.put(progress.best.x)
    return StepFailure(f"{sentence} (u holds the best iterate)")
