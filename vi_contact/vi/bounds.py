"""Read bounds: Functions, numbers, functions of x and expressions of UFL, as values at unknowns."""

from collections.abc import Callable
from typing import Any

import numpy as np
from ufl.algorithms import extract_arguments, extract_coefficients
from ufl.constantvalue import ScalarValue
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from ..core.algebra import Array
from ..core.checks import quote
from ..core.collective import call_user, together
from ..core.errors import InputError
from ..fem import compat
from ..fem.mesh.communicators import MpiComm
from .forms import make_error

Function = Callable[[Array], Any]


class Bounds:
    """Read the bounds of one field again and again.

    An expression of UFL is compiled once, for as long as the same one is given.
    """

    def __init__(self, u: Any, comm: MpiComm) -> None:
        """Note the Function that has bounds.

        Args:
            u: the Function.
            comm: the ranks of its mesh.
        """
        self._u = u
        self._comm = comm
        self._space = u.function_space
        self._width = self._space.dofmap.index_map_bs
        self._nodes = self._space.dofmap.index_map.size_local
        self._points: Array | None = None
        # by the name of the bound: the expression that was given last, compiled, and a Function
        # that takes its values
        self._compiled: dict[str, tuple[Any, Any, Any]] = {}

    def read(self, name: str, given: Any, none: float) -> Array:
        """Return a bound at the owned unknowns. Collective.

        Args:
            name: of the bound, for messages.
            given: what the user gave.
            none: the number that stands for None.

        Raises:
            InputError: on all ranks, where it is no bound.
        """
        if isinstance(given, compat.fem.Function) and given.function_space == self._space:
            return np.array(given.x.array[: self._width * self._nodes])
        if isinstance(given, compat.fem.Constant):
            return self._spread(name, given, given.value)
        if isinstance(given, ScalarValue):
            return self._spread(name, given, float(given))
        if isinstance(given, Expr):
            return self._interpolate(name, given)
        if callable(given) and not isinstance(given, type):
            with together(self._comm):
                return self._evaluate(name, given)
        return self._spread(name, given, none if given is None else given)

    def _spread(self, name: str, given: Any, value: Any) -> Array:
        """Return one number, or one for each component, at all owned unknowns."""
        try:
            number = np.asarray(value, dtype=float)
            return np.tile(np.broadcast_to(number, (self._width,)), self._nodes)
        except (TypeError, ValueError):
            raise self._make_error(name, given) from None

    def _evaluate(self, name: str, given: Function) -> Array:
        """Return a function of x at the owned points of the space."""
        if self._points is None:
            self._points = self._space.tabulate_dof_coordinates()[: self._nodes]
        points = self._points.T.copy()
        shape = (self._width, self._nodes)

        def call() -> Array:
            values = given(points)
            try:
                return np.broadcast_to(np.asarray(values, dtype=float), shape).T.ravel()
            except (TypeError, ValueError):
                raise make_error(
                    f"{name} returns {quote(values)} for points x of shape {points.shape}; let it "
                    f"return an array of shape {shape}, a row for a component"
                ) from None

        return call_user(f"vi.solve: {name}", call, np.zeros(self._width * self._nodes))

    def _interpolate(self, name: str, given: Any) -> Array:
        """Return an expression of UFL at the owned points of the space. Collective."""
        before = self._compiled.get(name)
        is_same = before is not None and bool(before[0] == given)
        if not is_same:
            self._check(name, given)
            compiled = compat.expression(given, self._space)
            self._compiled[name] = (given, compiled, compat.function(self._space))
        _, compiled, values = self._compiled[name]
        values.interpolate(compiled)
        return np.array(values.x.array[: self._width * self._nodes])

    def _check(self, name: str, given: Any) -> None:
        """Raise InputError unless an expression has values for u, and is known without u."""
        domain = self._space.mesh.ufl_domain()
        is_here = [known.ufl_id() == domain.ufl_id() for known in extract_domains(given)]
        is_whole = given.ufl_shape == self._u.ufl_shape and not extract_arguments(given)
        if isinstance(given, compat.fem.Function) or not is_whole or not any(is_here):
            raise self._make_error(name, given)
        if not all(is_here) or any(known is self._u for known in extract_coefficients(given)):
            raise make_error(
                f"{name} is {quote(given)}, which contains u itself or is of another mesh; give a "
                "Function on u.function_space, or an expression that is known before u is"
            )

    def _make_error(self, name: str, given: Any) -> InputError:
        """Return the error of what is no bound."""
        return make_error(
            f"{name} is {quote(given)}; give a Function on u.function_space itself, a number "
            f"(or {self._width}, one for a component), a function of x, an expression of UFL of "
            "the shape of u, or None"
        )


def take_common_part(bound: Any) -> Any:
    """Return what of a bound all ranks must give alike: numbers, and the value of a Constant.

    Of a Function, a function of x and an expression the kind alone is compared.
    """
    return bound.value if isinstance(bound, compat.fem.Constant) else bound
