"""Stresses of a displacement field, per cell."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array
from .. import compat


class VonMises:
    """Mean von Mises stress of every owned cell [Pa]: ∫ sqrt(3/2 s:s) / ∫ 1 over the cell, s the deviator of sigma.

    Plane strain has sigma_zz = lambda tr(eps), plane stress has none; a one-dimensional body is taken for a bar in
    uniaxial stress. Viscous stresses are not included.
    """

    def __init__(self, forms: Any) -> None:
        """``forms``: the ElasticForms of a system, whose constants carry the thickness as a factor."""
        space = forms.space
        self._u = compat.function(space.V)
        eps = ufl.sym(ufl.grad(self._u))
        sigma = forms.stress(self._u) / forms.section.thickness
        across = forms.fields["lame_out"] * ufl.tr(eps) / forms.section.thickness
        mean = (ufl.tr(sigma) + across) / 3
        deviator = sigma - mean * ufl.Identity(space.dimension)
        squares = ufl.inner(deviator, deviator) + (3 - space.dimension) * (across - mean) ** 2
        cell = ufl.TestFunction(compat.cell_space(space.mesh))
        dx = ufl.dx(metadata={"quadrature_degree": 2})
        self._form = compat.compile_form(ufl.sqrt(1.5 * squares) * cell * dx)
        self._volume = np.array(compat.assemble_vector(compat.compile_form(cell * dx)).array_r)

    def __call__(self, nodal: Array) -> Array:
        """Of nodal displacements (owned nodes, d); collective."""
        self._u.x.array[: nodal.size] = nodal.ravel()
        self._u.x.scatter_forward()
        return np.asarray(compat.assemble_vector(self._form).array_r / self._volume)
