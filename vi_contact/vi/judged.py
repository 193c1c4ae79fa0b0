"""Judge a u by its certificate, and measure how far it is from the answer.

F is linearised about u: ``A`` is its Jacobian J, and b such that F + J (x_new - x) = A x_new - b.
Where F_i pushes an unknown against a bound, F_i is the *multiplier* of this bound; everywhere else
it has to vanish. So F = push_lower - push_upper at an answer, and each push is >= 0 and zero off
its bound. The certificate tells how far that is from being true, the natural residual
r = x - mid(lower, x - F/J_ii, upper) puts it into one number for the line search.
"""

import numpy as np

from ..core.algebra import Array, lowest, max_abs, total
from ..core.certificate import Certificate
from ..core.verify import ROUNDING
from .equations import Equations

DIAGONAL = 1e-8  # of the largest: smaller entries of the Jacobian's diagonal count as this

# Of the size of the field: how small u may be and still be judged by its own size, where F is not
# linear. Such an F is computed from numbers like 1 + grad u, and bounds from coordinates: both keep
# rounding errors of 1e-16 of the field, which of a smaller u would be more than the tolerance.
SMALL = 1e-6


class Judged:
    """Hold what is known at the present u of a problem; arrays are of its free unknowns.

    Attributes:
        equations: those of F, with u.
        x, F: the free unknowns and the residual F(u; phi_i) at u.
        A, b: the linear problem about u, F(u) + J (x_new - x) = A x_new - b. Where held unknowns
            are not yet at their prescribed values (``left``), b moves them there: F in it has
            ``gain``, what F gains by that.
        left: the share of the change of the held unknowns that is still to come.
        diagonal: sizes of the diagonal entries of A, none of them zero.
        push: the multipliers (lower, upper), zero where the bound does not act.
        broken: whether something is not a finite number.
        certificate: the relative residuals; all infinite where broken, or while something is
            ``left``.
    """

    def __init__(self, equations: Equations, lower: Array, upper: Array, left: float = 0.0) -> None:
        """Judge the present u. Collective.

        Args:
            equations: those of F, with u.
            lower: (n,) bounds of the free unknowns from below.
            upper: (n,) from above.
            left: share of the change of held unknowns that is still to come.
        """
        self.equations = equations
        self.lower = lower
        self.upper = upper
        self.left = left
        self.x = equations.x
        residual = equations.assemble_residual()
        self.A, self.gain = equations.linearise(left)
        self.F = residual + self.gain if left else residual

        # The linear problem, and the largest sizes on any rank of what it is made of: by one
        # reduction. Infinity stands for what is no number.
        Ax = self.A @ self.x
        diagonal = np.abs(self.A.diagonal())
        self.b = Ax - self.F
        local = [max_abs(array) for array in (self.x, self.b, Ax, self.F, diagonal)]
        sizes = equations.comm.max(np.nan_to_num(local, nan=np.inf, posinf=np.inf))
        self.broken = not np.all(np.isfinite(sizes))
        x_max, b_max, Ax_max, F_max, most = sizes.tolist()
        self.diagonal = np.maximum(diagonal, DIAGONAL * most)
        least = 0.0 if equations.constant else SMALL * equations.size

        # References of the certificate: displacements [of u] and forces [of F] that residuals are
        # compared with; one where all is zero.
        x_ref = max(x_max, least) or 1.0
        r_ref = max(b_max, F_max, most * least) or 1.0

        # A bound acts where the multiplier, in units of forces, exceeds the distance, in units of
        # u.
        below = self.x - lower
        above = upper - self.x
        with np.errstate(invalid="ignore"):  # a broken point may have no size
            at_lower = below * r_ref < self.F * x_ref
            at_upper = above * r_ref < -self.F * x_ref
        push_up = np.where(at_lower, self.F, 0.0)
        push_down = np.where(at_upper, -self.F, 0.0)
        self.push = push_up, push_down

        # The certificate: forces that no bound carries; distances below zero; multipliers below
        # zero; distances from bounds that act.
        balance = max_abs(self.F - push_up + push_down)
        behind = max(lowest(below), lowest(above))
        wrong = max(lowest(push_up), lowest(push_down))
        away = max(max_abs(below[at_lower]), max_abs(above[at_upper]))
        carried = max(b_max, Ax_max, ROUNDING * most * x_max, most * least) or 1.0
        scale = np.array([carried, x_ref, r_ref, x_ref])
        worst = equations.comm.max(np.array([balance, behind, wrong, away])) / scale
        if self.broken or left:
            worst = np.full(len(worst), np.inf)
        self.certificate = Certificate(*worst.tolist())

    @property
    def worst(self) -> float:
        """Return the largest residual of the certificate."""
        return self.certificate.worst

    def measure_natural_residual(self, x: Array, F: Array) -> float:
        """Return the size sum J_ii r² of the natural residual r. Collective.

        r = x - mid(lower, x - F / J_ii, upper), with the J_ii of this u, is zero at the answer
        only. The size is infinite where F is not a number.

        Args:
            x: (n,) another x.
            F: (n,) the F there.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            r = x - np.clip(x - F / self.diagonal, self.lower, self.upper)
            size = total(self.equations.comm, self.diagonal @ r**2)
        return size if np.isfinite(size) else np.inf

    def put(self, x: Array, left: float) -> Array:
        """Write another x into u, and return the F there. Collective.

        Args:
            x: (n,) values of the free unknowns.
            left: share of the change of held unknowns that is then still to come. F comes with what
                it will gain by that.
        """
        self.equations.put(x, left)
        F = self.equations.assemble_residual()
        return F + (left / self.left) * self.gain if left else F
