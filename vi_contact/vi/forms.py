"""Read a user's forms, conditions and bounds; evaluate F and its Jacobian.

They are evaluated on the unknowns that nothing clamps.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives

from ..core.algebra import Array, Mask, largest, max_abs, total
from ..core.checks import at, refuse, shown
from ..core.errors import InputError
from ..fem import compat
from ..fem.body.form_checks import refuse_not_linear
from ..fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..fem.matrices.petsc_rows import moved
from ..fem.mesh.communicators import MpiComm, kept
from .rounding import OFF, size_of_field

KINDS = ("functional", "linear form", "bilinear form")
FORMS = "give a UFL form F(u; v), or (a, L) with a(u, v) bilinear and L(v) linear"


def refused(sentence: str) -> InputError:
    """Return the error of an input of ``vi.solve``."""
    return InputError(f"vi.solve: {sentence}")


def split(form: Any, u: Any, J: Any) -> tuple[Any, Any]:
    """Return (F, J), of a form F(u; v) or of (a, L); InputError for others."""
    if isinstance(form, ufl.Form) and len(form.arguments()) == 2:
        form = ufl.system(form)
    if isinstance(form, ufl.Form):
        if not contains(checked("F", form, 1, u), u):
            raise refused(
                "F does not depend on u: write it with the Function that is solved for, or give "
                "(a, L)"
            )
        return form, checked("J", ufl.derivative(form, u) if J is None else J, 2, u)
    if not isinstance(form, tuple | list) or len(form) != 2 or J is not None:
        raise refused(f"the form is {shown(form)}, J {shown(J)}; {FORMS}, whose Jacobian is a")
    a, L = checked("a", form[0], 2, u), checked("L", form[1], 1, u)
    if contains(a, u) or contains(L, u):
        raise refused(
            "a or L contains u itself, so that the problem is not linear in it: give F(u; v)"
        )
    return ufl.action(a, u) - L, a


def derivatives(energy: Any, u: Any) -> tuple[Any, Any]:
    """Return (F, J), the first and second derivative of a functional of u.

    Raises:
        InputError: what is no functional of u.
    """
    if not isinstance(energy, ufl.Form) or energy.arguments():
        what = (
            f"a form of rank {len(energy.arguments())}"
            if isinstance(energy, ufl.Form)
            else shown(energy)
        )
        raise refused(
            f"energy is {what}, and a functional is needed; give a UFL form of rank 0, such as "
            "0.5 * ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx, or the form F(u; v) in its place"
        )
    if not contains(energy, u):
        raise refused("energy does not depend on u: write it with the Function that is solved for")
    F = ufl.derivative(energy, u)
    return F, ufl.derivative(F, u)


def checked(name: str, form: Any, rank: int, u: Any) -> Any:
    """Return a form that has so many arguments, on the space of u; else InputError."""
    if not isinstance(form, ufl.Form) or len(form.arguments()) != rank:
        what = (
            f"a form of rank {len(form.arguments())}" if isinstance(form, ufl.Form) else shown(form)
        )
        raise refused(f"{name} is {what}, and a {KINDS[rank]} is needed; {FORMS}")
    if any(one.ufl_function_space() != u.ufl_function_space() for one in form.arguments()):
        raise refused(
            f"the test or trial function of {name} is on another space: make it of u.function_space"
        )
    return form


def contains(form: Any, u: Any) -> bool:
    """Say whether a form depends on u."""
    return any(one is u for one in form.coefficients())


class Problem:
    """Evaluate F, its Jacobian J and the energy at the present u.

    Vectors are of the unknowns of this rank that are ``free``: no Dirichlet condition holds them.
    The others are *held*. Their values go from those of the first guess to the prescribed ones
    along a straight line, of which the share ``left`` is still to come: 0.0 where the conditions
    are met.

    Attributes:
        constant: whether J is the same at every u, so that the problem is linear.
        given: the values of u before the first step (of a part of the change, see ``aim``), those
            of ghosts too.
    """

    def __init__(self, form: Any, u: Any, bcs: Sequence[Any], J: Any, energy: Any = None) -> None:
        if energy is None:
            F, J = split(form, u, J)
        else:
            F, J = derivatives(energy, u)
        self.u, space = u, u.function_space
        self.comm = MpiComm(kept(space.mesh.comm))
        self.owned = space.dofmap.index_map_bs * space.dofmap.index_map.size_local
        if not isinstance(bcs, list | tuple) or not all(compat.constrains(bc, space) for bc in bcs):
            raise refused(
                "bcs is wrong: give a list of dirichletbc objects on the space of u or its "
                "components"
            )
        self.given = self._first = np.array(u.x.array)
        self._held, self._values = np.zeros(len(self.given), dtype=bool), np.zeros(len(self.given))
        for bc in bcs:
            held, values = compat.bc_values(bc, len(self._values))
            self._held[held], self._values[held] = True, values
        self._prescribed = self._values
        self.free: Mask = ~self._held[: self.owned]
        for one in (F, J):
            refuse_not_linear("vi.solve: F or J", one)
        self._F, self._J = compat.compile_form(F), compat.compile_form(J)
        self._energy = None if energy is None else compat.compile_form(energy)
        self.constant = not contains(expand_derivatives(J), u)
        self._jacobian: PetscMatrix | None = None

    @property
    def x(self) -> Array:
        """Return the free unknowns of u."""
        return np.array(self.u.x.array[: self.owned][self.free], dtype=float)

    @property
    def change(self) -> Array:
        """Return the prescribed values less those of the first guess.

        It is 0 at free unknowns; ghosts are there too.
        """
        return np.where(self._held, self._values - self.given, 0.0)

    def put(self, x: Array, left: float = 0.0) -> None:
        """Write the free unknowns into u, and the held ones.

        The held ones lack the share ``left`` of their change. Collective.
        """
        values = self.u.x.array
        values[self._held] = self._values[self._held]
        if left:
            values[self._held] -= left * self.change[self._held]
        values[: self.owned][self.free] = x
        self.u.x.scatter_forward()

    def dot(self, x: Array, y: Array) -> float:
        """Return x·y over all ranks. Collective."""
        return total(self.comm, x @ y)

    def count(self, mask: Mask) -> int:
        """Return how many entries of a mask are True, over all ranks. Collective."""
        return round(total(self.comm, np.count_nonzero(mask)))

    def all(self, here: bool) -> bool:
        """Say whether something is true on every rank. Collective."""
        return not largest(self.comm, not here)

    def places(self) -> Array:
        """Return (n, 4) where the free unknowns are.

        These are coordinates as shares of the body's box, and the component as a share of their
        number. Collective.
        """
        space, width = self.u.function_space, self.u.function_space.dofmap.index_map_bs
        x = space.tabulate_dof_coordinates()[: self.owned // width]
        low = -self.comm.max(-np.min(x, axis=0, initial=np.inf))
        high = self.comm.max(np.max(x, axis=0, initial=-np.inf))
        shares = np.repeat((x - low) / np.where(high > low, high - low, 1.0), width, axis=0)
        component = np.tile(np.arange(width) / width, len(x))
        return np.column_stack([shares, component])[self.free]

    def put_back(self) -> None:
        """Write the first guess into u, as if nothing had been done.

        The held values are those that it had.
        """
        self.u.x.array[:] = self.given = self._first
        self._values = self._prescribed

    def aim(self, share: float) -> None:
        """Take the present u for the first guess.

        Prescribed values are then those that are so far on the way from the values of the very
        first guess.
        """
        self.given = np.array(self.u.x.array)
        way = self._prescribed - self._first
        self._values = self._prescribed if share == 1.0 else self._first + share * way

    def residual(self) -> Array:
        """Return F at u. Collective."""
        vector = compat.assemble_vector(self._F)
        values = np.array(vector.array_r[: self.owned])[self.free]
        vector.destroy()
        return values

    def energy(self) -> float:
        """Return the energy at u, infinity where it is no number. Collective."""
        found = total(self.comm, compat.assemble_scalar(self._energy))
        return found if np.isfinite(found) else np.inf

    def jacobian(self) -> PetscMatrix:
        """Return J at u on the free unknowns; what it returned before is freed. Collective."""
        return self.linearised(0.0)[0]

    def linearised(self, left: float) -> tuple[PetscMatrix, Array]:
        """Return (J at u on the free unknowns, what F of these will gain).

        F gains it, to first order, by the share ``left`` of the change of the held ones. The J that
        it returned before is freed. Collective.
        """
        gain = np.zeros(np.count_nonzero(self.free))
        if self._jacobian is None or left or not self.constant:
            self.close()
            whole = moved(compat.assemble_matrix(self._J), self.comm.mpi)
            if left:
                gain = (PetscMatrix(whole) @ (left * self.change[: self.owned]))[self.free]
            self._jacobian = as_petsc(
                PetscAlgebra(self.comm.mpi).block(PetscMatrix(whole), self.free)
            )
            whole.destroy()
        return self._jacobian, gain

    def spread(self, values: Array) -> Any:
        """Return values of the free unknowns as a Function, zero elsewhere. Collective."""
        made = compat.function(self.u.function_space)
        made.x.array[: self.owned][self.free] = values
        made.x.scatter_forward()
        return made

    def close(self) -> None:
        """Free the Jacobian; collective."""
        if self._jacobian is not None:
            self._jacobian.mat.destroy()
        self._jacobian = None

    def bounds(self, lower: Any, upper: Any) -> tuple[Array, Array]:
        """Return (lower, upper) of the free unknowns.

        What contradicts raises InputError on all ranks.

        What misses by rounding (``rounding``) contradicts nothing: a prescribed value that is
        beyond a bound stays as it is, and where lower is above upper the unknown is held at
        lower.
        """
        low, high = self._bound("lower", lower, -np.inf), self._bound("upper", upper, np.inf)
        u, space = (
            np.where(self._held, self._values, self.given)[: self.owned],
            self.u.function_space,
        )
        self.size = size_of_field(np.nan_to_num(u, nan=np.inf), low, high, self.comm)
        off = OFF * self.size
        defects = (
            (~np.isfinite(u), "the first guess or bcs are NaN or infinite: correct them"),
            (
                np.isnan(low) | np.isnan(high),
                "a bound is not a number: give None where there is none",
            ),
            (low > high + off, "lower is above upper: give lower <= upper"),
            (
                (low == np.inf) | (high == -np.inf),
                "no number is allowed: give finite bounds, or None",
            ),
            (
                ~self.free & ((u < low - off) | (u > high + off)),
                "bcs prescribe a value beyond a bound: correct it",
            ),
        )

        def said(i: int, words: str) -> str:
            node, component = divmod(i, space.dofmap.index_map_bs)
            where = f"component {component} at {at(space.tabulate_dof_coordinates()[node])}"
            return f"vi.solve: {where}, where u is {u[i]:g} in [{low[i]:g}, {high[i]:g}]: {words}"

        refuse(
            (said(int(np.argmax(wrong)), words) for wrong, words in defects if np.any(wrong)),
            self.comm,
        )
        return low[self.free], np.maximum(low, high)[self.free]

    def moves(self, low: Array, high: Array) -> bool:
        """Say whether conditions or bounds change the first guess by more than rounding.

        It is asked after ``bounds``. Collective.
        """
        x = self.given[: self.owned][self.free]
        most = max(max_abs(self.change), max_abs(x - np.clip(x, low, high)))
        return largest(self.comm, most) > OFF * self.size

    def _bound(self, name: str, given: Any, none: float) -> Array:
        """Return a bound at the owned unknowns."""
        space, width = self.u.function_space, self.u.function_space.dofmap.index_map_bs
        if isinstance(given, compat.fem.Function) and given.function_space == space:
            return np.array(given.x.array[: self.owned])
        given = given.value if isinstance(given, compat.fem.Constant) else given
        try:
            if isinstance(given, ufl.core.expr.Expr):  # numpy would index it for ever
                raise TypeError
            number = np.asarray(none if given is None else given, dtype=float)
            return np.tile(np.broadcast_to(number, (width,)), self.owned // width)
        except (TypeError, ValueError):
            raise refused(
                f"{name} is {shown(given)}; give a Function on u.function_space itself, a number "
                f"(or {width}, one for a component), or None"
            ) from None


def given_alike(bound: Any) -> Any:
    """Return what of a bound all ranks give alike.

    These are numbers and the value of a Constant; of a Function it is the kind.
    """
    return bound.value if isinstance(bound, compat.fem.Constant) else bound
