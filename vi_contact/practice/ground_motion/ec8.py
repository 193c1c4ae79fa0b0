"""Give the elastic response spectra of Eurocode 8 (EN 1998-1:2004).

Clause 3.2.2.2 has the horizontal ones, 3.2.2.3 the vertical ones.
"""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments, check_fields
from ...core.checks import real
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, Positive, Unit

_TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TYPES = dict(enumerate(_TABLES["type"], start=1))  # of spectra: 1, or 2 for weak near earthquakes


@dataclass(frozen=True)
class EC8Spectrum:
    """Hold the elastic spectrum of EN 1998-1, S_e(T) of eqs. 3.2 to 3.5.

    `on_ground` and `vertical` have its tables. A National Annex may give other numbers.

    Attributes:
        ag: design ground acceleration on ground A, gamma_I a_gR [m/s²].
        s: soil factor.
        tb: where the plateau begins [s].
        tc: where the plateau ends [s].
        td: where the displacement becomes constant [s].
        damping: ratio.
        plateau: 2.5, or 3.0 vertically.

    Raises:
        InputError: periods without tb <= tc <= td.
    """

    ag: Annotated[float, Positive, Unit("m/s²")]
    s: Annotated[float, Positive, RATIO]
    tb: Annotated[float, Positive, Unit("s")]
    tc: Annotated[float, Positive, Unit("s")]
    td: Annotated[float, Unit("s")]
    damping: Annotated[
        float, Between(0.0, 1.0, "[)", "give a ratio from 0 to below 1, 0.05 for 5 %"), RATIO
    ] = 0.05
    plateau: float = 2.5

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.tb <= self.tc <= real(self.td):
            raise InputError(f"{self!r}: give periods with tb <= tc <= td")

    @classmethod
    @check_arguments
    def on_ground(
        cls, ground: str, *, ag: float, kind: int = 1, damping: float = 0.05
    ) -> "EC8Spectrum":
        """Return the horizontal spectrum of a ground.

        Args:
            ground: "A" to "E".
            ag: design ground acceleration on ground A [m/s²].
            kind: type of the spectrum, 1, or 2 for weak near earthquakes.
            damping: ratio.
        """
        if kind not in TYPES or ground not in TYPES[kind]["ground"]:
            raise InputError(
                f"EC8Spectrum: ground {ground!r}, type {kind!r}; give A, B, C, D or E and type 1 "
                "or 2"
            )
        s, tb, tc, td = TYPES[kind]["ground"][ground]
        return cls(ag, s, tb, tc, td, damping=damping)

    @classmethod
    @check_arguments
    def vertical(cls, *, ag: float, kind: int = 1, damping: float = 0.05) -> "EC8Spectrum":
        """Return the vertical spectrum S_ve(T) of every ground, eqs. 3.8 to 3.11.

        Args:
            ag: horizontal design ground acceleration [m/s²].
            kind: type of the spectrum, 1 or 2.
            damping: ratio.
        """
        if kind not in TYPES:
            raise InputError(f"EC8Spectrum: type {kind!r}; give 1 or 2")
        ratio, tb, tc, td = TYPES[kind]["vertical"]
        return cls(ratio * ag, 1.0, tb, tc, td, damping=damping, plateau=3.0)

    @property
    def name(self) -> str:
        """Return how a report calls it."""
        return f"Eurocode 8, ag = {self.ag:g} m/s², S = {self.s:g}"

    @property
    def eta(self) -> float:
        """Return the damping correction sqrt(10 / (5 + xi in %)), not below 0.55 (eq. 3.6)."""
        return max(math.sqrt(10.0 / (5.0 + 100.0 * self.damping)), 0.55)

    def acceleration(self, periods: Array) -> Array:
        """Return S_e [m/s²] at the periods [s] >= 0; the code states it up to 4 s."""
        t = np.asarray(periods, dtype=float)
        if np.any(t < 0.0):
            raise InputError("EC8Spectrum: a period is negative; give seconds from 0 upwards")
        # The four branches of S_e / (ag s): rising, plateau, falling like 1/T and like 1/T².
        top = self.plateau * self.eta
        later = np.maximum(t, self.tc)  # no division by zero at T = 0
        rising = 1.0 + t / self.tb * (top - 1.0)
        shape = np.where(t <= self.tb, rising, top * self.tc / later)
        shape = np.where((t > self.tb) & (t <= self.tc), top, shape)
        shape = np.where(t > self.td, top * self.tc * self.td / later**2, shape)
        return self.ag * self.s * shape

    def displacement(self, periods: Array) -> Array:
        """Return S_De = S_e (T / 2 pi)² [m], eq. 3.7."""
        inverse_frequency = np.asarray(periods, dtype=float) / (2.0 * math.pi)
        return self.acceleration(periods) * inverse_frequency**2
