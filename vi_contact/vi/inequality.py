"""Find u between bounds: F(u; v - u) >= 0 for all v with lower <= v <= upper, at the points of a Function's space.

Newton's method (N. H. Josephy, 1979) solves F(u_k) + J(u_k) (u - u_k) in the place of F (``solve_linear``) and goes
towards the answer as far as makes the natural residual u - mid(lower, u - F/J_ii, upper) smaller by a part of what the
slope promises. A linear problem takes one step."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, lowest, max_abs, total
from ..core.certificate import Certificate
from ..core.checks import instance, whole
from ..core.collective import agree
from ..core.errors import StepFailure
from ..core.matrix_checks import SYMMETRIC, asymmetry
from ..core.step import StepProblem
from ..core.surfaces import empty_surface
from ..core.verify import ROUNDED
from ..fem import compat
from ..fem.communicators import MpiComm, kept
from ..fem.form_checks import refuse_complex
from ..fem.petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from ..solvers.volume.route import Method, ReducedNewton, SemismoothNewton, TaoTron, Volume
from .forms import Problem, given_alike, refused

ARMIJO, HALVINGS = 1e-4, 12
REFINEMENTS = 5  # of a linear problem, at most


@dataclass(frozen=True)
class Result:
    """Hold the answer of ``solve``: u, the Function that was given, and what is known of it.

    ``lambda_lower``, ``lambda_upper``: Functions of the multipliers, forces at points in the unit of F >= 0. With F the
    vector of F(u; phi_i), F = lambda_lower - lambda_upper where bcs prescribe nothing, and zero off the bounds.
    ``active``: how many unknowns are on their lower and upper bounds, those where the multiplier is above zero.
    ``certificate``: relative residuals (``core.certificate``): equilibrium of inactive unknowns, distance of active
    ones from their bound (complementarity), signs of distances (penetration) and of multipliers (tension).
    ``iterations``, ``inner``: Newton steps, and iterations of ``method`` in them; ``seconds`` of this rank's processor.
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


class Point:
    """Judge the present u; arrays are of the free unknowns."""

    def __init__(self, problem: Problem, lower: Array, upper: Array) -> None:
        self.problem, self.lower, self.upper = problem, lower, upper
        self.A, self.x, self.F = problem.jacobian(), problem.x, problem.residual()
        Ax, diagonal = self.A @ self.x, np.abs(self.A.diagonal())
        self.b = Ax - self.F
        local = [max_abs(one) for one in (self.x, self.b, Ax, self.F, diagonal)]
        sizes = problem.comm.max(np.nan_to_num(local, nan=np.inf, posinf=np.inf))
        self.broken = not np.all(np.isfinite(sizes))
        x_max, b_max, Ax_max, F_max, most = sizes.tolist()
        self.diagonal = np.maximum(diagonal, 1e-8 * most)
        x_ref, r_ref = x_max or 1.0, max(b_max, F_max) or 1.0
        below, above = self.x - lower, upper - self.x
        at_lower, at_upper = below * r_ref < self.F * x_ref, above * r_ref < -self.F * x_ref
        self.push = np.where(at_lower, self.F, 0.0), np.where(at_upper, -self.F, 0.0)
        left = max_abs(self.F - self.push[0] + self.push[1])
        away = max(max_abs(below[at_lower]), max_abs(above[at_upper]))
        behind, wrong = (max(map(lowest, pair)) for pair in ((below, above), self.push))
        scale = np.array([max(b_max, Ax_max, ROUNDED * most * x_max) or 1.0, x_ref, r_ref, x_ref])
        worst = problem.comm.max(np.array([left, behind, wrong, away])) / scale
        self.certificate = Certificate(*np.where(self.broken, np.inf, worst).tolist())

    def natural(self) -> float:
        """Return sum J_ii r², r the natural residual at the present u, in the units of this point."""
        x, F = self.problem.x, self.problem.residual()
        r = x - np.clip(x - F / self.diagonal, self.lower, self.upper)
        return total(self.problem.comm, self.diagonal @ r**2)

    def advance(self, target: Array) -> bool:
        """Go towards the target as far as is an improvement; False when nothing is. Collective."""
        problem, step = self.problem, target - self.x
        if problem.constant:
            problem.put(target)
            return True
        natural = self.natural()
        for length in 0.5 ** np.arange(HALVINGS):
            problem.put(np.clip(self.x + length * step, self.lower, self.upper))
            if self.natural() <= (1.0 - 2.0 * ARMIJO * length) * natural:
                return True
        return False


def solve(form: Any, u: Any, *, lower: Any = None, upper: Any = None, bcs: Sequence[Any] = (), J: Any = None,
          method: Method | None = None, petsc_options: Mapping[str, object | None] | None = None,
          prefix: str = "vi_contact_vi_", tolerance: float = 1e-9, iterations: int = 50) -> Result:
    """Solve F(u; v - u) >= 0 for all v between the bounds; u holds the first guess, and the answer.

    ``form``: F(u; v) of UFL, linear or not in the Function u, or (a, L) for a(u, v) - L(v). ``lower``, ``upper``:
    Functions on the space of u, Constants, numbers, one or one for each component, or None. ``bcs``: dirichletbc on
    that space or its components. ``J``: the Jacobian, else the derivative of F.
    ``method``: TaoTron(), ReducedNewton() or SemismoothNewton() of ``solvers``; None takes the first two where J is
    symmetric, the last two elsewhere. ``petsc_options``: for it, under ``prefix`` on the command line.

    The unknowns must be values at points (Lagrange of any degree, DG0, …): bounds hold there, which for degrees above
    one is not everywhere. InputError for forms, bounds and bcs that do not fit; StepFailure when the certificate stays
    above ``tolerance`` after ``iterations`` Newton steps, with the best u so far kept. Collective."""
    start = time.process_time()
    refuse_complex("vi.solve")
    instance("vi.solve", "u", u, compat.fem.Function, "give the DOLFINx Function to solve for")
    if not compat.nodal(u.function_space):
        raise refused("the unknowns of u are not values of one field at points: take Lagrange or DG0, not mixed")
    agree(MpiComm(kept(u.function_space.mesh.comm)), "vi.solve", {
        "lower": given_alike(lower), "upper": given_alike(upper), "J": J is None, "method": method,
        "number of bcs": len(bcs) if isinstance(bcs, list | tuple) else bcs, "petsc_options": petsc_options,
        "prefix": prefix, "tolerance": tolerance, "iterations": iterations})
    limit = whole("vi.solve", "iterations", iterations, least=1)
    settings = Volume(method or TaoTron(), {} if petsc_options is None else petsc_options, prefix, tolerance)
    problem = Problem(form, u, bcs, J)
    problem.put(problem.x)
    low, high = problem.bounds(lower, upper)
    problem.put(np.clip(problem.x, low, high))
    ready, inner, used, said = time.process_time(), 0, "", ""
    best, count, methods = (point := Point(problem, low, high)), 0, () if method is None else (method,)
    limit = min(limit, REFINEMENTS) if problem.constant else limit
    try:
        while best.certificate.worst > tolerance and not said:
            if point.broken:
                said = "F or J is not a number there: check the form and the first guess"
            elif count == limit:
                said = "give a better first guess in u, or more iterations"
            else:
                x, its, used = solve_linear(settings, methods, point.A, point.b, low, high, point.x, problem.comm)
                inner += its
                if point.advance(x):
                    point, count = Point(problem, low, high), count + 1
                    best = min(best, point, key=lambda one: one.certificate.worst)
                else:
                    said = "no step in Newton's direction improves u: give a better first guess"
    except StepFailure as failure:
        said = str(failure)
    finally:
        problem.close()
    problem.put(best.x)
    reason = f"the certificate is {best.certificate.worst:.1e} after {count} Newton steps"
    if said:
        raise StepFailure(f"vi.solve: {reason}, above {tolerance:g}: {said} (u holds the best iterate)")
    active = [round(total(problem.comm, np.count_nonzero(push))) for push in best.push]
    pushes, seconds = [problem.spread(one) for one in best.push], time.process_time() - ready
    return Result(u, pushes[0], pushes[1], (active[0], active[1]), best.certificate, count, inner, used, reason,
                  {"setup": ready - start, "solve": seconds})


def solve_linear(settings: Volume, methods: Sequence[Method], A: PetscMatrix, b: Array, lower: Array, upper: Array,
                 start: Array, comm: MpiComm) -> tuple[Array, int, str]:
    """Return (x, iterations, name) of the first method that finds x, of those that suit A if none is given; StepFailure
    with what all said. Every unknown is the one of a contact condition. Collective."""
    numbers, tried = np.arange(A.rows), []
    symmetric = asymmetry(A, comm, PetscAlgebra(comm.mpi).first(A.rows) + numbers) <= SYMMETRIC
    if not methods:
        methods = (TaoTron(), ReducedNewton()) if symmetric else (ReducedNewton(), SemismoothNewton())
    elif isinstance(methods[0], TaoTron) and not symmetric:
        raise refused(f"{methods[0]} minimises, and the form is not symmetric, so there is nothing to minimise: leave "
                      "method out, or take ReducedNewton() or SemismoothNewton()")
    bAb, bb, some = (total(comm, one) for one in (b @ (A @ b), b @ b, np.any(start)))
    if bAb > 0.0 and not some:  # from nothing: along b as far as energy and bounds say, which tells the size of x
        start = np.clip(bb / bAb * b, lower, upper)
    zero, none = np.zeros(A.rows), np.zeros(A.rows, dtype=bool)
    surface = replace(empty_surface(comm, 1), owned=numbers, gap0=zero, compliance=zero, bilateral=none)
    matrix = EffectiveMatrix(A, (PetscAlgebra if symmetric else UnsymmetricAlgebra)(comm.mpi))
    step = StepProblem(matrix, b, upper, surface, 1.0, start, none, 0.0, 0, lower=lower)
    for method in methods:
        solver = replace(settings, method=method).prepare(matrix, surface, 1.0)
        try:
            found = solver.solve(step)
            return np.clip(found.x, lower, upper), found.iterations, type(method).__name__
        except StepFailure as failure:
            tried.append(str(failure))
        finally:
            solver.close()
    raise StepFailure("; ".join(tried))
