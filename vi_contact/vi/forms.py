"""Read a user's forms: F(u; v) and its Jacobian, (a, L), or an energy."""

from typing import Any

import ufl

from ..core.checks import quote
from ..core.errors import InputError

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
