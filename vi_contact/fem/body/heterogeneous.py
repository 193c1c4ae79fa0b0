"""Describe a material that changes from place to place, by functions."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from ufl.core.expr import Expr
from ufl.domain import extract_domains

from ...core.algebra import Array, Indices, Mask
from ...core.checks import describe_point, on_all, quote, refuse
from ...core.checks import number as number_given
from ...core.errors import InputError
from ...laws.materials import ElasticValues
from .. import compat
from ..mesh.communicators import MpiComm

Values = Any  # a number, a scalar DOLFINx Function, or a function of points (3, k)
RANGES: dict[str, tuple[str, float, float, str]] = {
    "E": ("Young's modulus E [Pa]", 0.0, np.inf, "values above zero"),
    "nu": ("Poisson's ratio nu", -1.0, 0.5, "values between -1 and 0.5, both excluded"),
    "rho": ("the mass density rho [kg/m³]", 0.0, np.inf, "values above zero"),
    "xi": (
        "the damping ratio xi",
        np.nextafter(0.0, -1.0),
        1.0,
        "ratios from 0 to less than 1, not per cent",
    ),
}


@dataclass(frozen=True)
class Heterogeneous:
    """Describe isotropic elasticity by functions E(x) [Pa], nu(x), rho(x) [kg/m³] and xi(x).

    Each is a number, a scalar DOLFINx Function on the mesh of the body, an expression of UFL there,
    or a function of points x (3, k) [m] that returns values (k,), as ``Function.interpolate`` takes
    it.

    A Function that is constant on every cell is taken as it is. Of all others the Lamé constants
    and rho are taken at the vertices of every cell and are linear in it (DG1), so that E and rho
    may be linear exactly. Where the material jumps inside of a function, at a side of a cell,
    vertices cannot tell which side is meant: give (cells, material) pairs or a Function of DG0. The
    body keeps the values of the moment when it is assembled. Columns of free fields and section
    forces through elements take means over cells.

    Args:
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: density [kg/m³].
        xi: ratio of damping, which ``DampingRatio`` reads.

    Raises:
        InputError: neither number nor function; and when a body is assembled, values outside E > 0,
            -1 < nu < 1/2, rho > 0, 0 <= xi < 1, with the first place of them, and Functions or
            expressions of another mesh.
    """

    E: Values
    nu: Values
    rho: Values
    xi: Values = 0.0

    def __post_init__(self) -> None:
        for name, (words, low, high, remedy) in RANGES.items():
            value = getattr(self, name)
            if isinstance(value, Expr):
                if value.ufl_shape:
                    raise InputError(
                        f"Heterogeneous: {words} has values of shape {value.ufl_shape}; give one "
                        "that is scalar"
                    )
                continue
            given = callable(value) and not isinstance(value, type)
            if not given and not low < number_given("Heterogeneous", words, value) < high:
                raise InputError(f"Heterogeneous: {words} is {quote(value)}; give {remedy}")

    @property
    def varies(self) -> bool:
        """Return whether something changes inside of cells."""
        # a Function with one unknown a cell is constant there; of all else nothing is known
        functions = [value for value in (self.E, self.nu, self.rho, self.xi) if callable(value)]
        return not all(
            _is_function(value) and value.function_space.dofmap.dof_layout.num_dofs == 1
            for value in functions
        )

    def at(self, space: Any, cells: Indices) -> ElasticValues:
        """Return the constants at all unknowns of a DG0 or DG1 space. Collective.

        Args:
            space: that of functions on cells.
            cells: local cells of this material; elsewhere values may be anything.

        Raises:
            InputError: on all ranks, values on these cells that no material has.
        """
        comm = MpiComm(space.mesh.comm)
        mine = np.zeros(len(compat.function(space).x.array), dtype=bool)
        mine[compat.cell_blocks(space)[cells]] = True
        values = {
            name: _interpolate(words, getattr(self, name), space, comm)
            for name, (words, *_) in RANGES.items()
        }
        refuse(_find_defects(values, mine, space), comm)
        return ElasticValues(**values)


def _is_function(value: Any) -> bool:
    """Say whether a value is a Function of DOLFINx."""
    return isinstance(value, Expr) and hasattr(value, "function_space")


def _interpolate(words: str, value: Values, space: Any, comm: MpiComm) -> Array:
    """Return a constant at all unknowns of a cellwise space. Collective.

    Args:
        words: what messages call it.
        value: a number, a Function, an expression of UFL, or a function of points.
        space: DG0 or DG1.
        comm: the ranks.

    Raises:
        InputError: on all ranks, a value of another mesh, and one that cannot be evaluated.
    """
    constant = compat.function(space)
    domains = extract_domains(value) if isinstance(value, Expr) else ()
    if any(one.ufl_id() != space.mesh.ufl_domain().ufl_id() for one in domains):
        raise InputError(
            f"Heterogeneous: {words} is of another mesh; give it on the mesh of the body"
        )

    def at_points(x: Array) -> Array:
        values = np.positive(value(x), dtype=float)  # an error for complex numbers
        # DOLFINx reads beyond values that are too few
        if values.shape not in (x.shape[1:], (1, *x.shape[1:])):
            raise InputError(
                f"Heterogeneous: {words} has values of shape {values.shape} at {x.shape[1]} "
                "points; give a function of points x (3, k) that returns (k,)"
            )
        return np.asarray(values)

    def fill() -> None:
        if domains:
            field = value if _is_function(value) else compat.expression(value, space)
            constant.interpolate(field)
        elif callable(value) and not isinstance(value, Expr):
            constant.interpolate(at_points)
        else:
            constant.x.array[:] = float(value)

    on_all(comm, f"Heterogeneous: {words}", fill)
    return np.array(constant.x.array)


def _find_defects(values: dict[str, Array], mine: Mask, space: Any) -> Iterator[str]:
    """Yield a sentence on each constant with values of this rank that no material has.

    Args:
        values: of each constant by name, at all unknowns of the space.
        mine: which unknowns are of cells of the material.
        space: the cellwise space.
    """
    for name, (words, low, high, remedy) in RANGES.items():
        wrong = np.flatnonzero(mine & ~((values[name] > low) & (values[name] < high)))
        if len(wrong):
            place = space.tabulate_dof_coordinates()[wrong[0], : space.mesh.geometry.dim]
            value = values[name][wrong[0]]
            yield f"Heterogeneous: {words} is {value:g} at {describe_point(place)}; give {remedy}"
