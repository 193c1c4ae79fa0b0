"""Make rules for one integral: Gauss points, and substitutions that tame what happens at the ends.

A rule is a pair (points, weights) on [0, 1]. A substitution x = s(w) moves the Gauss points towards
the ends, or towards a point nearby, where the integrand has a root, a logarithm or a peak.
"""

from functools import lru_cache

import numpy as np

from ..core.algebra import Array, Indices

Rule = tuple[Array, Array]
FLAT = 1e-6  # least height of a singularity over a piece, over the length of the piece
SHORTEST = 1e-12  # of [0, 1]: a shorter piece is none


@lru_cache
def gauss(n: int) -> Rule:
    """Return the n Gauss points and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache
def smooth_rule(n: int) -> Rule:
    """Smooth the Gauss rule by the substitution w²(3 - 2w).

    It makes square roots and logarithms at both ends harmless.
    """
    x, w = gauss(n)
    return x**2 * (3.0 - 2.0 * x), 6.0 * w * x * (1.0 - x)


@lru_cache
def grade_rule(n: int) -> Rule:
    """Grade the Gauss rule towards both ends by the substitution w³(10 - 15w + 6w²).

    It lies more closely at the ends than ``smooth_rule``, for the logarithm at r = 0.
    """
    x, w = gauss(n)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * w * (x * (1.0 - x)) ** 2


def pieces(breaks: Array) -> tuple[Indices, Array, Array]:
    """Return the pieces into which each row of ``breaks`` (p, k) cuts [0, 1].

    NaN, and places outside [0, 1], are no breaks. A piece has (row of ``breaks``, start, length).
    """
    inner = np.clip(np.nan_to_num(breaks, nan=0.0), 0.0, 1.0)
    first = np.zeros((len(breaks), 1))
    last = np.ones((len(breaks), 1))
    ends = np.sort(np.concatenate([first, inner, last], axis=1), axis=1)
    lengths = np.diff(ends, axis=1)
    rows, columns = np.nonzero(lengths > SHORTEST)
    return rows, ends[rows, columns], lengths[rows, columns]


def roots(a: Array, b: Array, c: Array) -> Array:
    """Return the real roots (..., 2) of a x² + b x + c, NaN where there are none.

    Args:
        a: (...), coefficient of x².
        b: (...), coefficient of x.
        c: (...), the constant.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        # Both roots without a difference of nearly equal numbers: x1 = q/a, and x1 x2 = c/a.
        q = -0.5 * (b + np.copysign(np.sqrt(b**2 - 4.0 * a * c), b))
        return np.stack([q / a, c / q], axis=-1)


def place_rule(
    low: Array,
    length: Array,
    rule: Rule,
    scale: Array | float = 1.0,
    about: tuple[Array, Array] | None = None,
) -> Rule:
    """Return the points and the weights (p, n) of a rule on p pieces.

    Args:
        low: (p,), where the pieces start.
        length: (p,), how long they are.
        rule: points and weights (n,) on [0, 1].
        scale: (p,), factor of the weights.
        about: (centre, height), (p,) each, of a singularity beside the piece. The rule then is one
            in v of the substitution x = centre + height sinh(v).

    The substitution is for functions of sqrt((x - centre)² + height²) that are singular where it
    is zero, however near that is: a peak becomes 1/cosh(v). Far from the centre it is an
    exponential; beside a great height it is linear.
    """
    x, w = rule
    if about is None:
        points = low[:, None] + length[:, None] * x
        weights = (scale * length)[:, None] * w
        return points, weights
    centre, height = about
    height = np.maximum(height, FLAT * length)
    start = np.arcsinh((low - centre) / height)
    span = np.arcsinh((low + length - centre) / height) - start
    v = start[:, None] + span[:, None] * x
    points = centre[:, None] + height[:, None] * np.sinh(v)
    weights = (scale * height * span)[:, None] * np.cosh(v) * w
    return points, weights
