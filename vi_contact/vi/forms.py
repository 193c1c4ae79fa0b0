"""Read a user's forms, conditions and bounds; evaluate F and its Jacobian on free unknowns."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives

from ..core.algebra import Array, Mask, largest, max_abs, total
from ..core.checks import describe_point, quote, refuse
from ..core.errors import InputError
from ..fem import compat
from ..fem.body.form_checks import refuse_not_linear
from ..fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..fem.matrices.petsc_rows import transfer
from ..fem.mesh.communicators import MpiComm, keep_communicator
from .rounding import OFF, measure_field

KINDS = ("functional", "linear form", "bilinear form")
FORMS = "give a UFL form F(u; v), or (a, L) with a(u, v) bilinear and L(v) linear"


def make_error(sentence: str) -> InputError:
    """Return the error of an input of ``vi.solve``."""
    return InputError(f"vi.solve: {sentence}")


def split_form(form: Any, u: Any, J: Any) -> tuple[Any, Any]:
    """Return F and its Jacobian.

    Args:
        form: F(u; v), or (a, L).
        u: the Function to solve for.
        J: the Jacobian; None for the derivative of F.

    Raises:
        InputError: the form is neither, or not on the space of u.
    """
    # A form of both rank 2 and 1 in one, a(u, v) - L(v), is the pair (a, L).
    if isinstance(form, ufl.Form) and len(form.arguments()) == 2:
        form = ufl.system(form)

    # F(u; v), whose Jacobian is its derivative.
    if isinstance(form, ufl.Form):
        check_form("F", form, 1, u)
        if not depends_on(form, u):
            raise make_error(
                "F does not depend on u: write it with the Function that is solved for, or give "
                "(a, L)"
            )
        jacobian = ufl.derivative(form, u) if J is None else J
        check_form("J", jacobian, 2, u)
        return form, jacobian
    if not isinstance(form, tuple | list) or len(form) != 2 or J is not None:
        raise make_error(f"the form is {quote(form)}, J {quote(J)}; {FORMS}, whose Jacobian is a")

    # (a, L), which is linear: F = a(u, v) - L(v).
    a, L = form
    check_form("a", a, 2, u)
    check_form("L", L, 1, u)
    if depends_on(a, u) or depends_on(L, u):
        raise make_error(
            "a or L contains u itself, so that the problem is not linear in it: give F(u; v)"
        )
    return ufl.action(a, u) - L, a


def differentiate(energy: Any, u: Any) -> tuple[Any, Any]:
    """Return (F, J), the first and second derivative of a functional of u.

    Raises:
        InputError: what is no functional of u.
    """
    if not isinstance(energy, ufl.Form) or energy.arguments():
        raise make_error(
            f"energy is {_describe_form(energy)}, and a functional is needed; give a UFL form of "
            "rank 0, such as 0.5 * ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx, or the form "
            "F(u; v) in its place"
        )
    if not depends_on(energy, u):
        raise make_error(
            "energy does not depend on u: write it with the Function that is solved for"
        )
    F = ufl.derivative(energy, u)
    return F, ufl.derivative(F, u)


def check_form(name: str, form: Any, rank: int, u: Any) -> None:
    """Raise InputError unless a form has so many arguments, on the space of u.

    Args:
        name: of the form, for messages.
        form: of UFL.
        rank: number of arguments.
        u: the Function to solve for.
    """
    if not isinstance(form, ufl.Form) or len(form.arguments()) != rank:
        given = _describe_form(form)
        raise make_error(f"{name} is {given}, and a {KINDS[rank]} is needed; {FORMS}")
    space = u.ufl_function_space()
    if any(argument.ufl_function_space() != space for argument in form.arguments()):
        raise make_error(
            f"the test or trial function of {name} is on another space: make it of u.function_space"
        )


def _describe_form(value: Any) -> str:
    """Return in words what was given in the place of a form of another rank."""
    if isinstance(value, ufl.Form):
        return f"a form of rank {len(value.arguments())}"
    return quote(value)


def depends_on(form: Any, u: Any) -> bool:
    """Say whether a form depends on u."""
    return any(coefficient is u for coefficient in form.coefficients())


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
        free: (n,) which owned unknowns no condition holds.
        owned: their number.
        size: of the field; known after ``read_bounds``.
    """

    def __init__(self, form: Any, u: Any, bcs: Sequence[Any], J: Any, energy: Any = None) -> None:
        """Check and compile the forms. Collective.

        Args:
            form: F(u; v), or (a, L); None with an energy.
            u: the Function to solve for.
            bcs: Dirichlet conditions.
            J: the Jacobian; None for the derivative of F.
            energy: the functional of u; None with a form.

        Raises:
            InputError: forms or conditions do not fit u.
        """
        if energy is None:
            F, J = split_form(form, u, J)
        else:
            F, J = differentiate(energy, u)
        space = u.function_space
        self.u = u
        self.comm = MpiComm(keep_communicator(space.mesh.comm))
        self.owned = space.dofmap.index_map_bs * space.dofmap.index_map.size_local
        if not isinstance(bcs, list | tuple) or not all(compat.constrains(bc, space) for bc in bcs):
            raise make_error(
                "bcs is wrong: give a list of dirichletbc objects on the space of u or its "
                "components"
            )

        # Values of the first guess, and those that conditions prescribe.
        self._first = np.array(u.x.array)
        self.given = self._first
        self._held = np.zeros(len(self.given), dtype=bool)
        self._values = np.zeros(len(self.given))
        for bc in bcs:
            held, values = compat.bc_values(bc, len(self._values))
            self._held[held] = True
            self._values[held] = values
        self._prescribed = self._values
        self.free: Mask = ~self._held[: self.owned]

        refuse_not_linear("vi.solve: F or J", F)
        refuse_not_linear("vi.solve: F or J", J)
        self._F = compat.compile_form(F)
        self._J = compat.compile_form(J)
        self._energy = None if energy is None else compat.compile_form(energy)
        self.constant = not depends_on(expand_derivatives(J), u)
        self._jacobian: PetscMatrix | None = None

    @property
    def x(self) -> Array:
        """Return the free unknowns of u."""
        return np.array(self.u.x.array[: self.owned][self.free], dtype=float)

    @property
    def change(self) -> Array:
        """Return the prescribed values less those of the first guess, of ghosts too.

        They are zero at free unknowns.
        """
        return np.where(self._held, self._values - self.given, 0.0)

    def put(self, x: Array, left: float = 0.0) -> None:
        """Write the free unknowns (n,) into u, and the held ones. Collective.

        Args:
            x: (n,) values of the free unknowns.
            left: the share of their change that the held ones lack, from 0 (at their prescribed
                values) to 1 (as in the first guess).
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

    def locate_unknowns(self) -> Array:
        """Return (n, 4) where the free unknowns are. Collective.

        The columns are coordinates as shares of the body's box, and the component as a share of
        their number.
        """
        space = self.u.function_space
        width = space.dofmap.index_map_bs
        x = space.tabulate_dof_coordinates()[: self.owned // width]
        low = -self.comm.max(-np.min(x, axis=0, initial=np.inf))
        high = self.comm.max(np.max(x, axis=0, initial=-np.inf))
        shares = np.repeat((x - low) / np.where(high > low, high - low, 1.0), width, axis=0)
        component = np.tile(np.arange(width) / width, len(x))
        return np.column_stack([shares, component])[self.free]

    def put_back(self) -> None:
        """Write the first guess into u, with the values that held unknowns had in it."""
        self.u.x.array[:] = self._first
        self.given = self._first
        self._values = self._prescribed

    def aim(self, share: float) -> None:
        """Take the present u for the first guess, and prescribe a part of the change.

        Prescribed values are then those of this share of the way from the very first guess.
        """
        self.given = np.array(self.u.x.array)
        way = self._prescribed - self._first
        self._values = self._prescribed if share == 1.0 else self._first + share * way

    def assemble_residual(self) -> Array:
        """Return F at u. Collective."""
        vector = compat.assemble_vector(self._F)
        values = np.array(vector.array_r[: self.owned])[self.free]
        vector.destroy()
        return values

    def evaluate_energy(self) -> float:
        """Return the energy at u, infinity where it is no number. Collective."""
        energy = total(self.comm, compat.assemble_scalar(self._energy))
        return energy if np.isfinite(energy) else np.inf

    def linearise(self, left: float) -> tuple[PetscMatrix, Array]:
        """Return J at u on the free unknowns, and what F of these will gain (n,). Collective.

        F gains it, to first order, by the share ``left`` of the change of the held ones. The J that
        it returned before is freed.
        """
        # A constant Jacobian is assembled once. Where held unknowns still move, the columns of the
        # whole Jacobian that belong to them are needed too, and it is assembled again.
        gain = np.zeros(np.count_nonzero(self.free))
        if self._jacobian is None or left or not self.constant:
            self.close()
            whole = transfer(compat.assemble_matrix(self._J), self.comm.mpi)
            if left:
                gain = (PetscMatrix(whole) @ (left * self.change[: self.owned]))[self.free]
            self._jacobian = as_petsc(
                PetscAlgebra(self.comm.mpi).block(PetscMatrix(whole), self.free)
            )
            whole.destroy()
        return self._jacobian, gain

    def spread(self, values: Array) -> Any:
        """Return values (n,) of the free unknowns as a Function, zero elsewhere. Collective."""
        function = compat.function(self.u.function_space)
        function.x.array[: self.owned][self.free] = values
        function.x.scatter_forward()
        return function

    def close(self) -> None:
        """Free the Jacobian; collective."""
        if self._jacobian is not None:
            self._jacobian.mat.destroy()
        self._jacobian = None

    def read_bounds(self, lower: Any, upper: Any) -> tuple[Array, Array]:
        """Return (lower, upper) of the free unknowns. Collective.

        What misses by rounding (``rounding``) contradicts nothing: a prescribed value that is
        beyond a bound stays as it is, and where lower is above upper the unknown is held at
        lower.

        Raises:
            InputError: on all ranks, where bounds contradict each other or the conditions.
        """
        low = self._read_bound("lower", lower, -np.inf)
        high = self._read_bound("upper", upper, np.inf)
        # u as it would be with the conditions: what bounds are compared with, and what tells the
        # size of the field that rounding is relative to.
        u = np.where(self._held, self._values, self.given)[: self.owned]
        space = self.u.function_space
        self.size = measure_field(np.nan_to_num(u, nan=np.inf), low, high, self.comm)
        off = OFF * self.size

        # Masks of what is wrong at unknowns of this rank; the first defect of any rank is told.
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

        def describe(i: int, words: str) -> str:
            node, component = divmod(i, space.dofmap.index_map_bs)
            place = describe_point(space.tabulate_dof_coordinates()[node])
            where = f"component {component} at {place}"
            return f"vi.solve: {where}, where u is {u[i]:g} in [{low[i]:g}, {high[i]:g}]: {words}"

        sentences = [
            describe(int(np.argmax(wrong)), words) for wrong, words in defects if np.any(wrong)
        ]
        refuse(sentences, self.comm)
        return low[self.free], np.maximum(low, high)[self.free]

    def moves(self, low: Array, high: Array) -> bool:
        """Say whether conditions or bounds change the first guess by more than rounding.

        It is asked after ``read_bounds``. Collective.
        """
        x = self.given[: self.owned][self.free]
        most = max(max_abs(self.change), max_abs(x - np.clip(x, low, high)))
        return largest(self.comm, most) > OFF * self.size

    def _read_bound(self, name: str, given: Any, none: float) -> Array:
        """Return a bound at the owned unknowns.

        Args:
            name: of the bound, for messages.
            given: what the user gave: a Function, a Constant, numbers or None.
            none: the number that stands for None.
        """
        space = self.u.function_space
        width = space.dofmap.index_map_bs
        if isinstance(given, compat.fem.Function) and given.function_space == space:
            return np.array(given.x.array[: self.owned])
        given = given.value if isinstance(given, compat.fem.Constant) else given
        try:
            if isinstance(given, ufl.core.expr.Expr):  # numpy would index it for ever
                raise TypeError
            number = np.asarray(none if given is None else given, dtype=float)
            return np.tile(np.broadcast_to(number, (width,)), self.owned // width)
        except (TypeError, ValueError):
            raise make_error(
                f"{name} is {quote(given)}; give a Function on u.function_space itself, a number "
                f"(or {width}, one for a component), or None"
            ) from None


def take_common_part(bound: Any) -> Any:
    """Return what of a bound all ranks must give alike: numbers, and the value of a Constant.

    A Function is compared by its kind alone.
    """
    return bound.value if isinstance(bound, compat.fem.Constant) else bound
