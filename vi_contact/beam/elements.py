"""Assemble piecewise linear elements for rod and beam.

The last rotation function is that of Ahn (2012, section 7).

On an element s = (x - x_left)/h runs from 0 to 1. Deflection and rotation are linear; the shear
energy is

    ½ K A G ∫ (u_x - theta)² dx      by one point per element (reduced_shear), or exactly

Exact integration locks: a slender beam bends too little until h is small beside its *depth*. One
point removes that.

``published_end``: on the last element Ahn multiplies the tip's rotation by -s³ + s² + s, whose
slope is zero at the tip, in order to satisfy theta_x(l) = 0. But its neighbour 1 - s keeps the
slope -1/h, and both together do not reproduce a constant: equal rotations at both nodes cost
energy. With the tip's rotation eliminated the last element is a spring 2 E I/(17 h) on the rotation
of its left node, so that h -> 0 clamps the rotation: theta(l) = 0 instead of theta_x(l) = 0. It is
here to reproduce the source; theta_x(l) = 0 is natural and needs no special function.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array
from ..core.arguments import check_arguments, check_fields
from ..core.checks import check_count, number
from ..core.errors import InputError
from ..core.quantities import Between
from .values import Rod, TimoshenkoBeam

MOST = 5_000_000  # elements
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact to degree 7: squares of cubics
S = 0.5 * (_POINTS + 1.0)
W = 0.5 * _WEIGHTS
_Tables = tuple[Array, Array]


@dataclass(frozen=True)
class Elements:
    """Describe equal elements along a rod or beam.

    The source has Elements(1000, reduced_shear=False, published_end=True).

    Args:
        count: number of elements, two at least.
        reduced_shear: integrate the shear energy by one point per element, which does not lock.
        published_end: take the last rotation function of Ahn (2012), which clamps the tip's
            rotation as h -> 0; see the head of this file.

    Raises:
        InputError: fewer than two elements, or a published end with reduced shear, which the source
            does not have.
    """

    count: Annotated[int, Between(2, math.inf)] = 100
    reduced_shear: bool = True
    published_end: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        check_count("Elements", "count", self.count, "elements", most=MOST)
        if self.published_end and self.reduced_shear:
            raise InputError(
                "Elements: the published end function goes with reduced_shear=False, as in the "
                "source"
            )

    def nodes(self, length: float) -> Array:
        """Return the positions [m] of all nodes but the clamped one, shape (count,).

        Raises:
            InputError: the length [m] is not positive.
        """
        length = number("Elements.nodes", "length", length, positive=True, unit="m")
        return np.linspace(0.0, length, self.count + 1)[1:]


@check_arguments
def beam_matrices(beam: TimoshenkoBeam, elements: Elements) -> tuple[Any, Any, Array]:
    """Assemble the matrices of the beam: ½ wᵀMw and ½ yᵀSy are its energies [J], and C = a2 S.

    They are made of M1, M2, K1, K2, L1 of section 7 of Ahn (2012) with their coefficients; N1
    is the integral of theta_i theta_j in the shear energy.

    Returns:
        M and S, sparse (2 m, 2 m), of y = (theta_1 … theta_m [-], u_1 … u_m [m]), and the forces
        (2 m,) of a uniform load of 1 N/m.

    Raises:
        InputError: an argument is of another type.
    """
    m = elements.count
    h = beam.length / elements.count

    # Tables (2, points) of the two functions of an element and of their slopes, at the points of
    # integration: a pair of tables for the inner elements and the last one.
    lines = _lines(S)
    slopes = _line_slopes(S) / h
    rotations = (lines, lines)
    curvatures = (slopes, slopes)
    if elements.published_end:
        end_rotations = np.array([1.0 - S, -(S**3) + S**2 + S])
        end_curvatures = np.array([-np.ones_like(S), -3.0 * S**2 + 2.0 * S + 1.0]) / h
        rotations = (lines, end_rotations)
        curvatures = (slopes, end_curvatures)
    deflections = (lines, lines)

    # The same at the points of integration of the shear energy: one, or as elsewhere.
    if elements.reduced_shear:
        shear_points = np.array([0.5])
        shear_weights = np.ones(1)
    else:
        shear_points = S
        shear_weights = W
    shear_lines = _lines(shear_points)
    shear_slopes = _line_slopes(shear_points) / h
    shear_rotations = (shear_lines, rotations[1] if elements.published_end else shear_lines)
    shear_deflections = (shear_slopes, shear_slopes)

    def integrate(rows: _Tables, columns: _Tables, weights: Array) -> Any:
        """Return the matrix (m, m) of ∫ row_i column_j over all elements.

        Args:
            rows: tables of the functions of the rows, of the inner elements and the last one.
            columns: tables of the functions of the columns, likewise.
            weights: (points,) of the integration.
        """
        inner = h * (rows[0] * weights) @ columns[0].T
        last = h * (rows[1] * weights) @ columns[1].T
        return _assemble(inner, last, m)

    M1 = integrate(rotations, rotations, W)
    K1 = integrate(curvatures, curvatures, W)
    M2 = integrate(deflections, deflections, W)
    K2 = integrate(shear_deflections, shear_deflections, shear_weights)
    N1 = integrate(shear_rotations, shear_rotations, shear_weights)
    L1 = integrate(shear_rotations, shear_deflections, shear_weights)
    EI = beam.bending_stiffness
    KAG = beam.shear_stiffness
    M = sp.block_diag([beam.rho * beam.inertia * M1, beam.rho * beam.area * M2]).tocsr()
    stiffness = sp.bmat([[EI * K1 + KAG * N1, -KAG * L1], [-KAG * L1.T, KAG * K2]]).tocsr()
    load = np.concatenate([np.zeros(m), _uniform(m, h)])
    return M, stiffness, load


@check_arguments
def rod_matrices(rod: Rod, count: Annotated[int, Between(2, math.inf)]) -> tuple[Any, Any, Array]:
    """Assemble the matrices of the rod: ½ wᵀMw and ½ vᵀKv are its energies [J], and C = a1 K.

    Returns:
        M and K, sparse (n, n), of v_1 … v_n [m] with n = ``count``, and the forces (n,) of a
        uniform load of 1 N/m.

    Raises:
        InputError: the rod is none, or there are fewer than two elements.
    """
    h = rod.length / count
    lines = _lines(S)
    slopes = _line_slopes(S) / h
    element_mass = h * (lines * W) @ lines.T
    element_stiffness = h * (slopes * W) @ slopes.T
    M = rod.rho * rod.area * _assemble(element_mass, element_mass, count)
    K = rod.E * rod.area * _assemble(element_stiffness, element_stiffness, count)
    return M, K, _uniform(count, h)


def _lines(s: Array) -> Array:
    """Return the two linear functions at s, shape (2, len(s))."""
    return np.array([1.0 - s, s])


def _line_slopes(s: Array) -> Array:
    """Return the slopes of the two linear functions times h, shape (2, len(s))."""
    return np.array([-np.ones_like(s), np.ones_like(s)])


def _uniform(m: int, h: float) -> Array:
    """Return ∫ of each function of m elements of length h [m]: h, half of it at the tip."""
    load = np.full(m, h)
    load[-1] *= 0.5
    return load


def _assemble(inner: Array, last: Array, m: int) -> Any:
    """Return the (m, m) matrix of m element matrices (2, 2).

    They are all ``inner`` but the last; node 0 is clamped.
    """
    diagonal = np.full(m, inner[1, 1] + inner[0, 0])
    diagonal[-2] = inner[1, 1] + last[0, 0]
    diagonal[-1] = last[1, 1]
    below = np.append(np.full(m - 2, inner[1, 0]), last[1, 0])
    above = np.append(np.full(m - 2, inner[0, 1]), last[0, 1])
    return sp.diags((below, diagonal, above), (-1, 0, 1)).tocsr()
