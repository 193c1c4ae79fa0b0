"""Compile forms with the quadrature degree that a body was assembled with."""

from typing import Any

import ufl

from . import compat
from .space import FemSpace


def compiled(space: FemSpace, form: Any) -> Any:
    """Return a form compiled, its integrals with the degree of the space, if any, unless they say their own."""
    degree = space.quadrature_degree
    if degree is None:
        return compat.compile_form(form)
    return compat.compile_form(ufl.Form([
        one if "quadrature_degree" in one.metadata()
        else one.reconstruct(metadata={**one.metadata(), "quadrature_degree": degree}) for one in form.integrals()
    ]))
