"""Read a user's forms, conditions and bounds; evaluate F and its Jacobian on the unknowns that nothing clamps."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives

from ..core.algebra import Array, Mask
from ..core.checks import at, refuse, shown
from ..core.errors import InputError
from ..fem import compat
from ..fem.communicators import MpiComm, kept
from ..fem.form_checks import refuse_not_linear
from ..fem.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..fem.petsc_rows import moved

KINDS = ("functional", "linear form", "bilinear form")
FORMS = "give a UFL form F(u; v), or (a, L) with a(u, v) bilinear and L(v) linear"
OFF = 1e-12  # of the bounds' size: prescribed values that miss a bound by round-off keep it


def refused(sentence: str) -> InputError:
    """Return the error of an input of ``vi.solve``."""
    return InputError(f"vi.solve: {sentence}")


def split(form: Any, u: Any, J: Any) -> tuple[Any, Any]:
    """Return (F, J), of a form F(u; v) or of (a, L); InputError for others."""
    if isinstance(form, ufl.Form) and len(form.arguments()) == 2:
        form = ufl.system(form)
    if isinstance(form, ufl.Form):
        if not contains(checked("F", form, 1, u), u):
            raise refused("F does not depend on u: write it with the Function that is solved for, or give (a, L)")
        return form, checked("J", ufl.derivative(form, u) if J is None else J, 2, u)
    if not isinstance(form, tuple | list) or len(form) != 2 or J is not None:
        raise refused(f"the form is {shown(form)}, J {shown(J)}; {FORMS}, whose Jacobian is a")
    a, L = checked("a", form[0], 2, u), checked("L", form[1], 1, u)
    if contains(a, u) or contains(L, u):
        raise refused("a or L contains u itself, so that the problem is not linear in it: give F(u; v)")
    return ufl.action(a, u) - L, a


def checked(name: str, form: Any, rank: int, u: Any) -> Any:
    """Return a form that has so many arguments, on the space of u; else InputError."""
    if not isinstance(form, ufl.Form) or len(form.arguments()) != rank:
        what = f"a form of rank {len(form.arguments())}" if isinstance(form, ufl.Form) else shown(form)
        raise refused(f"{name} is {what}, and a {KINDS[rank]} is needed; {FORMS}")
    if any(one.ufl_function_space() != u.ufl_function_space() for one in form.arguments()):
        raise refused(f"the test or trial function of {name} is on another space: make it of u.function_space")
    return form


def contains(form: Any, u: Any) -> bool:
    """Say whether a form depends on u."""
    return any(one is u for one in form.coefficients())


class Problem:
    """Evaluate F and J at the present u; vectors are of the unknowns of this rank that are ``free``, no Dirichlet
    condition holds them. ``constant``: whether J is the same at every u, the problem linear."""

    def __init__(self, form: Any, u: Any, bcs: Sequence[Any], J: Any) -> None:
        F, J = split(form, u, J)
        self.u, space = u, u.function_space
        self.comm = MpiComm(kept(space.mesh.comm))
        self.owned = space.dofmap.index_map_bs * space.dofmap.index_map.size_local
        if not isinstance(bcs, list | tuple) or not all(compat.constrains(bc, space) for bc in bcs):
            raise refused("bcs is wrong: give a list of dirichletbc objects on the space of u or its components")
        self._clamped, self._values = np.zeros(len(u.x.array), dtype=bool), np.zeros(len(u.x.array))
        for bc in bcs:
            held, values = compat.bc_values(bc, len(self._values))
            self._clamped[held], self._values[held] = True, values
        self.free: Mask = ~self._clamped[: self.owned]
        for one in (F, J):
            refuse_not_linear("vi.solve: F or J", one)
        self._F, self._J = compat.compile_form(F), compat.compile_form(J)
        self.constant = not contains(expand_derivatives(J), u)
        self._jacobian: PetscMatrix | None = None

    @property
    def x(self) -> Array:
        """Return the free unknowns of u."""
        return np.array(self.u.x.array[: self.owned][self.free], dtype=float)

    def put(self, x: Array) -> None:
        """Write the free unknowns into u, and the prescribed ones; ghosts follow."""
        values = self.u.x.array
        values[self._clamped] = self._values[self._clamped]
        values[: self.owned][self.free] = x
        self.u.x.scatter_forward()

    def residual(self) -> Array:
        """Return F at u."""
        vector = compat.assemble_vector(self._F)
        values = np.array(vector.array_r[: self.owned])[self.free]
        vector.destroy()
        return values

    def jacobian(self) -> PetscMatrix:
        """Return J at u on the free unknowns; what it returned before is freed. Collective."""
        if self._jacobian is None or not self.constant:
            self.close()
            whole = moved(compat.assemble_matrix(self._J), self.comm.mpi)
            self._jacobian = as_petsc(PetscAlgebra(self.comm.mpi).block(PetscMatrix(whole), self.free))
            whole.destroy()
        return self._jacobian

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
        """Return (lower, upper) of the free unknowns; InputError, on all ranks, for what contradicts."""
        low, high = self._bound("lower", lower, -np.inf), self._bound("upper", upper, np.inf)
        u, space = np.array(self.u.x.array[: self.owned]), self.u.function_space
        off = OFF * np.max([np.where(np.isfinite(one), np.abs(one), 0.0) for one in (low, high, u)], axis=0)
        defects = (
            (~np.isfinite(u), "the first guess or bcs are NaN or infinite: correct them"),
            (np.isnan(low) | np.isnan(high), "a bound is not a number: give None where there is none"),
            (low > high, "lower is above upper: give lower <= upper"),
            ((low == np.inf) | (high == -np.inf), "no number is allowed: give finite bounds, or None"),
            (~self.free & ((u < low - off) | (u > high + off)), "bcs prescribe a value beyond a bound: correct it"),
        )

        def said(i: int, words: str) -> str:
            node, component = divmod(i, space.dofmap.index_map_bs)
            where = f"component {component} at {at(space.tabulate_dof_coordinates()[node])}"
            return f"vi.solve: {where}, where u is {u[i]:g} in [{low[i]:g}, {high[i]:g}]: {words}"

        refuse((said(int(np.argmax(wrong)), words) for wrong, words in defects if np.any(wrong)), self.comm)
        return low[self.free], high[self.free]

    def _bound(self, name: str, given: Any, none: float) -> Array:
        """A bound at the owned unknowns."""
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
            raise refused(f"{name} is {shown(given)}; give a Function on u.function_space itself, a number (or "
                          f"{width}, one for a component), or None") from None


def given_alike(bound: Any) -> Any:
    """Return what of a bound all ranks give alike: numbers and the value of a Constant; of a Function the kind."""
    return bound.value if isinstance(bound, compat.fem.Constant) else bound
