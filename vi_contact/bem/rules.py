"""Make rules for one integral.

They are Gauss points, and substitutions that tame what happens at or close to the ends.
"""

from functools import lru_cache

import numpy as np

from ..core.algebra import Array, Indices

FLAT = 1e-6  # least height of a singularity over a piece, over the length of the piece


@lru_cache
def gauss(n: int) -> tuple[Array, Array]:
    """Return the Gauss points and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache
def smoothed(n: int) -> tuple[Array, Array]:
    """Return the Gauss rule after the substitution w²(3 - 2w).

    The ends are exact for square roots and logarithms.
    """
    x, w = gauss(n)
    return x**2 * (3.0 - 2.0 * x), 6.0 * w * x * (1.0 - x)


@lru_cache
def graded(n: int) -> tuple[Array, Array]:
    """Return the Gauss rule after the substitution w³(10 - 15w + 6w²).

    The rule is for the logarithm at r = 0.
    """
    x, w = gauss(n)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * w * (x * (1.0 - x)) ** 2


def pieces(breaks: Array) -> tuple[Indices, Array, Array]:
    """Return (row, start, length) of the parts into which each row of breaks cuts [0, 1].

    NaN is no break.
    """
    inner = np.clip(np.nan_to_num(breaks, nan=0.0), 0.0, 1.0)
    ends = np.zeros((len(breaks), 1)), np.ones((len(breaks), 1))
    sorted_ends = np.sort(np.concatenate([ends[0], inner, ends[1]], axis=1), axis=1)
    lengths = np.diff(sorted_ends, axis=1)
    rows, columns = np.nonzero(lengths > 1e-12)
    return rows, sorted_ends[rows, columns], lengths[rows, columns]


def roots(a: Array, b: Array, c: Array) -> Array:
    """Return (..., 2) real roots of a x² + b x + c, NaN where there are none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -0.5 * (b + np.copysign(np.sqrt(b**2 - 4.0 * a * c), b))
        return np.stack([q / a, c / q], axis=-1)


def placed(
    low: Array,
    length: Array,
    rule: tuple[Array, Array],
    scale: Array | float = 1.0,
    about: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Return points and weights (p, n) of a rule on pieces from ``low`` (p,).

    ``scale`` is that of the weights.

    about: (centre, height), then x = centre + height sinh(v), the rule being one in v, for
    functions of sqrt((x - centre)² + height²) that are singular where it is zero, however near that
    is: a peak becomes 1/cosh(v). Far from the centre the substitution is an exponential; beside a
    great height it is linear.
    """
    x, w = rule
    if about is None:
        return low[:, None] + length[:, None] * x, (scale * length)[:, None] * w
    centre, height = about[0], np.maximum(about[1], FLAT * length)
    start = np.arcsinh((low - centre) / height)
    span = np.arcsinh((low + length - centre) / height) - start
    v = start[:, None] + span[:, None] * x
    return centre[:, None] + height[:, None] * np.sinh(v), (scale * height * span)[
        :, None
    ] * np.cosh(v) * w
