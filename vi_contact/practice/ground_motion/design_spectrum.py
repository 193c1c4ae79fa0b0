"""Take a design spectrum from a code's table, and set spectra of records beside one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_fields
from ...core.checks import array
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, Unit


class DesignSpectrum(Protocol):
    """Give spectral accelerations of a code: ``EC8Spectrum`` and ``TabulatedSpectrum`` do."""

    @property
    def damping(self) -> float:
        """Return the damping ratio for which it holds."""

    @property
    def name(self) -> str:
        """Return how a report calls it."""

    def acceleration(self, periods: Array) -> Array:
        """Return the spectral accelerations [m/s²] at the periods [s]; NaN where it says none."""


@dataclass(frozen=True)
class TabulatedSpectrum:
    """Hold a design spectrum as points of its curve, with straight lines between them.

    Attributes:
        periods: increasing, from 0 upwards [s].
        accelerations: of the periods [m/s²].
        damping: the ratio for which they hold.
        name: how a report calls it.

    Raises:
        InputError: periods that do not increase, or lists of two lengths.
    """

    periods: Annotated[Sequence[float], Unit("s")]
    accelerations: Annotated[Sequence[float], Unit("m/s²")]
    damping: Annotated[
        float, Between(0.0, 1.0, "[)", "give a ratio from 0 to below 1, 0.05 for 5 %"), RATIO
    ] = 0.05
    name: str = "design spectrum"

    def __post_init__(self) -> None:
        check_fields(self)
        periods = array("TabulatedSpectrum", "periods", self.periods, (None,), unit="s")
        values = array("TabulatedSpectrum", "accelerations", self.accelerations, (None,))
        if len(periods) != len(values) or len(periods) < 2:
            raise InputError(
                f"TabulatedSpectrum: there are {len(periods)} periods and {len(values)} "
                "accelerations; give two lists of the same length, of two or more numbers"
            )
        if periods[0] < 0.0 or np.any(np.diff(periods) <= 0.0):
            raise InputError(
                "TabulatedSpectrum: the periods do not increase from 0 upwards; sort them"
            )
        if np.any(values < 0.0):
            raise InputError("TabulatedSpectrum: an acceleration is negative; give sizes [m/s²]")

    def acceleration(self, periods: Array) -> Array:
        """Return the accelerations [m/s²] at the periods [s]; NaN beyond the ends of the table."""
        wanted = np.asarray(periods, dtype=float)
        return np.interp(wanted, self.periods, self.accelerations, left=np.nan, right=np.nan)
