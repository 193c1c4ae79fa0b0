"""Solve Hertz contact of cylinders, and a flat rigid punch on a half-space, in plane strain
(Johnson 1985, ch. 2, 4).

E* and R are those of ``vi_contact.exact.hertz``. Pressures are positive in compression; under the
punch they are infinite at the edge, where they grow with the power -1/2 of the distance. Lengths
[m], pressures and moduli [Pa], forces [N/m], or any consistent units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.quantities import Positive, Unit


@dataclass(frozen=True)
class HertzLine:
    """Describe parallel cylinders pressed with `force` P per unit of length (plane strain):

        a = sqrt(4 P R/(pi E*)),   p0 = 2 P/(pi a) = sqrt(P E*/(pi R)),   p = p0 sqrt(1 - x²/a²)

    The approach of half-planes is not defined (logarithmic). force [N/m], modulus E* [Pa], radius R
    [m]. Raises InputError unless all are finite and positive.
    """

    force: Annotated[float, Positive]
    modulus: Annotated[float, Positive, Unit("Pa")]
    radius: Annotated[float, Positive, Unit("m")]

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def half_width(self) -> float:
        """Return a [m]: contact on |x| < a."""
        return math.sqrt(4.0 * self.force * self.radius / (math.pi * self.modulus))

    @property
    def peak(self) -> float:
        """Return p0 [Pa]."""
        return 2.0 * self.force / (math.pi * self.half_width)

    def pressure(self, x: ArrayLike) -> Array:
        """Return p(x) [Pa] at the distance x from the centre line, 0 outside the contact."""
        return self.peak * np.sqrt(
            np.maximum(1.0 - (np.asarray(x, dtype=float) / self.half_width) ** 2, 0.0)
        )


@dataclass(frozen=True)
class StripPunch:
    """Describe a long punch of width 2a under `force` P per unit of length: p = P/(pi sqrt(a² -
    x²)).

    half_width a [m], force [N/m]. Raises InputError unless both are finite and positive.
    """

    half_width: Annotated[float, Positive, Unit("m")]
    force: Annotated[float, Positive]

    def __post_init__(self) -> None:
        check_fields(self)

    def pressure(self, x: ArrayLike) -> Array:
        """Return p(x) [Pa] at the distance x from the centre line, 0 beside the punch, infinite at
        its edge."""
        square = self.half_width**2 - np.asarray(x, dtype=float) ** 2
        with np.errstate(divide="ignore"):
            root = 1.0 / np.sqrt(np.maximum(square, 0.0))
        return self.force / math.pi * np.where(square < 0.0, 0.0, root)
