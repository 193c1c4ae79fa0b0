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
        return np.linspace(
            0.0, number("Elements.nodes", "length", length, positive=True, unit="m"), self.count + 1
        )[1:]


@check_arguments
def beam_matrices(beam: TimoshenkoBeam, elements: Elements) -> tuple[Any, Any, Array]:
    """Assemble the matrices of the beam: ½ wᵀMw and ½ yᵀSy are its energies [J], and C = a2 S.

    They are made of M1, M2, K1, K2, L1 of section 7 of Ahn (2012) with their coefficients.

    Returns:
        M and S, sparse (2 m, 2 m), of y = (theta_1 … theta_m [-], u_1 … u_m [m]), and the forces
        (2 m,) of a uniform load of 1 N/m.

    Raises:
        InputError: an argument is of another type.
    """
    m = elements.count
    h = beam.length / elements.count
    lines = _lines(S)
    slopes = _line_slopes(S) / h
    turn, bend = lines, slopes
    if elements.published_end:
        turn = np.array([1.0 - S, -(S**3) + S**2 + S])
        bend = np.array([-np.ones_like(S), -3.0 * S**2 + 2.0 * S + 1.0]) / h
    middle = np.array([0.5])
    at, weight = (middle, np.ones(1)) if elements.reduced_shear else (S, W)
    shear_u = _line_slopes(at) / h
    shear_turn = [_lines(at), turn if elements.published_end else _lines(at)]
    ends = (lines, turn), (slopes, bend)

    def matrix(left: Any, right: Any, weights: Array) -> Any:
        """Return ∫ left_i right_j over all elements.

        There is a pair of tables for the inner elements and the last one.
        """
        inner, last = (h * (a * weights) @ b.T for a, b in zip(left, right, strict=True))
        return _assembled(inner, last, m)

    turns = ends[0]
    bends = ends[1]
    plain = (lines, lines)
    steep = (shear_u, shear_u)
    EI, KAG = beam.bending_stiffness, beam.shear_stiffness
    M1, K1 = matrix(turns, turns, W), matrix(bends, bends, W)
    M2, K2 = matrix(plain, plain, W), matrix(steep, steep, weight)
    N1, L1 = matrix(shear_turn, shear_turn, weight), matrix(shear_turn, steep, weight)
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
    M, K = (h * (a * W) @ a.T for a in (lines, slopes))
    return (
        rod.rho * rod.area * _assembled(M, M, count),
        rod.E * rod.area * _assembled(K, K, count),
        _uniform(count, h),
    )


def _lines(s: Array) -> Array:
    """Return the two linear functions at s, shape (2, len(s))."""
    return np.array([1.0 - s, s])


def _line_slopes(s: Array) -> Array:
    """Their slopes times h."""
    return np.array([-np.ones_like(s), np.ones_like(s)])


def _uniform(m: int, h: float) -> Array:
    """∫ of each function: h, half of it at the tip."""
    load = np.full(m, h)
    load[-1] *= 0.5
    return load


def _assembled(inner: Array, last: Array, m: int) -> Any:
    """Return the (m, m) matrix of m element matrices (2, 2).

    They are all ``inner`` but the last; node 0 is clamped.
    """
    middle = np.full(m, inner[1, 1] + inner[0, 0])
    middle[-2:] = inner[1, 1] + last[0, 0], last[1, 1]
    below, above = (np.append(np.full(m - 2, inner[at]), last[at]) for at in ((1, 0), (0, 1)))
    return sp.diags((below, middle, above), (-1, 0, 1)).tocsr()
