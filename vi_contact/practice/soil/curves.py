"""Say how soil softens and damps as it is sheared: G/Gmax and damping ratio over shear strain."""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.checks import array, check_word, quote
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, NotNegative, Positive, Unit

# G/Gmax where a table must begin: below its first strain the soil has the values of its first row
LINEAR = 0.95
ATMOSPHERE = 101325.0  # Pa
_TABLES = tomllib.loads(files(__package__).joinpath("curves.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class SoilCurves:
    """Hold G/Gmax and the damping ratio at some shear strains.

    Between these strains there are straight lines over the logarithm of the strain. Smaller strains
    than the first have its values. Larger strains than the last are outside: ``equivalent_linear``
    and ``strain_compatible`` refuse to end there.

    Attributes:
        strain: (n,) rising, as numbers and not in per cent: 1e-3 is 0.1 %.
        reduction: (n,) G/Gmax, falling from at least 0.95, above zero.
        damping: (n,) ratios below 1/2.
        name: of the curves in messages.

    Raises:
        InputError: other tables.
    """

    strain: Annotated[Sequence[float], RATIO]
    reduction: Annotated[Sequence[float], RATIO]
    damping: Annotated[Sequence[float], RATIO]
    name: str = "own curves"

    def __post_init__(self) -> None:
        strain = array("SoilCurves", "strain", self.strain, (None,))
        reduction = array("SoilCurves", "reduction", self.reduction, strain.shape)
        damping = array("SoilCurves", "damping", self.damping, strain.shape)
        if len(strain) < 2 or strain[0] <= 0.0 or np.any(np.diff(strain) <= 0.0):
            raise InputError(
                f"SoilCurves: strain of '{self.name}' is {quote(self.strain)}; give two or more "
                "rising numbers above zero"
            )
        if (
            np.any(np.diff(reduction) > 0.0)
            or reduction[-1] <= 0.0
            or not LINEAR <= reduction[0] <= 1.0
        ):
            raise InputError(
                f"SoilCurves: reduction of '{self.name}' is {quote(self.reduction)}; give G/Gmax "
                f"that falls from 1 (at least {LINEAR:g}) and stays above zero: begin at smaller "
                "strains"
            )
        if damping.min() < 0.0 or damping.max() >= 0.5:
            raise InputError(
                f"SoilCurves: damping of '{self.name}' is {quote(self.damping)}; give ratios from "
                "0 to less than 1/2, not per cent"
            )
        object.__setattr__(self, "strain", tuple(strain.tolist()))
        object.__setattr__(self, "reduction", tuple(reduction.tolist()))
        object.__setattr__(self, "damping", tuple(damping.tolist()))

    @classmethod
    @check_arguments
    def linear(
        cls, damping: Annotated[float, NotNegative, RATIO, "the damping ratio"]
    ) -> "SoilCurves":
        """Return the curves of what keeps its stiffness and damping ratio at any strain.

        That is a structure, or stiff rock.
        """
        xi = float(damping)
        return cls((1e-9, 1e9), (1.0, 1.0), (xi, xi), f"linear, {xi:g}")

    @classmethod
    def seed_idriss(cls, bound: str = "mean") -> "SoilCurves":
        """Return the curves of sands, Seed and Idriss (1970), for strains up to 1 %.

        They are as pystrata 0.5.4 has read them from the figures. ``bound`` is "mean", or "upper"
        for the upper curve of the modulus with the lower curve of damping, which SHAKE91 takes.
        """
        bounds = _TABLES["seed_idriss"]
        check_word("bound of seed_idriss", bound, tuple(bounds))
        table = bounds[bound]
        name = f"Seed-Idriss {bound}"
        return cls(_TABLES["strain"], table["reduction"], table["damping"], name)

    @classmethod
    @check_arguments
    def vucetic_dobry(
        cls, plasticity: Annotated[float, NotNegative, "the plasticity index [%]"]
    ) -> "SoilCurves":
        """Return the curves of a plasticity index from 0 to 200 [%], for strains up to 1 %.

        They are those of Vucetic and Dobry (1991), as pystrata 0.5.4 has read them. They are
        published for 0, 15, 30, 50, 100 and 200; between these there are straight lines over the
        index.
        """
        index = float(plasticity)
        table = _TABLES["vucetic_dobry"]
        published = table["plasticity"]
        if index > published[-1]:
            raise InputError(
                f"SoilCurves.vucetic_dobry: the plasticity index is {index:g} %, and the curves "
                f"end at {published[-1]} %: give SoilCurves of your own"
            )

        def at_index(rows: list[list[float]]) -> list[float]:
            """Return the values at the index, of a row for each published one."""
            return [float(np.interp(index, published, column)) for column in np.transpose(rows)]

        reduction = at_index(table["reduction"])
        damping = at_index(table["damping"])
        return cls(_TABLES["strain"], reduction, damping, f"Vucetic-Dobry PI {index:g}")

    @classmethod
    @check_arguments
    def darendeli(
        cls,
        *,
        mean_stress: Annotated[float, Positive, Unit("Pa"), "mean_stress"],
        plasticity: Annotated[float, NotNegative, "plasticity [%]"] = 0.0,
        ocr: Annotated[float, Between(1.0, math.inf, remedy="give 1 or more")] = 1.0,
        frequency: Annotated[float, Positive, Unit("Hz")] = 1.0,
        cycles: Annotated[float, Positive] = 10.0,
    ) -> "SoilCurves":
        """Return the curves of Darendeli (2001), for strains up to 1 %.

        With p = mean_stress / 1 atm, PI in % and strains s in %:

            G/Gmax = 1 / (1 + (s/s_r)^0.919),    s_r = (0.0352 + 0.001 PI ocr^0.3246) p^0.3483
            xi = (0.6329 - 0.00566 ln N) (G/Gmax)^0.1 D_Masing + xi_min
            xi_min = (0.8005 + 0.0129 PI ocr^-0.1069) p^-0.2889 (1 + 0.2919 ln f)

        with his D_Masing, a cubic polynomial in that of the hyperbola with exponent 1.

        Args:
            mean_stress: effective mean stress [Pa].
            plasticity: index PI [%].
            ocr: overconsolidation ratio.
            frequency: f of the loading [Hz].
            cycles: number N of cycles.
        """
        p = float(mean_stress) / ATMOSPHERE
        index = float(plasticity)
        f = float(frequency)
        n = float(cycles)
        s = np.logspace(-4.0, 0.0, 41)
        a = 0.919  # the exponent of the modulus
        s_r = (0.0352 + 0.001 * index * ocr**0.3246) * p**0.3483

        # Damping by Masing's rules for the exponent 1, in %, and from it for the exponent a.
        hyperbola = 4.0 * (s - s_r * np.log1p(s / s_r)) * (s + s_r) / s**2 - 2.0
        coefficients = [
            -0.0005 * a**2 + 0.0002 * a + 0.0003,
            0.0805 * a**2 - 0.071 * a - 0.0095,
            -1.1143 * a**2 + 1.8618 * a + 0.2523,
            0.0,
        ]
        masing = np.polyval(coefficients, 100.0 / np.pi * hyperbola)
        least = (0.8005 + 0.0129 * index * ocr**-0.1069) * p**-0.2889 * (1.0 + 0.2919 * np.log(f))
        reduction: Any = 1.0 / (1.0 + (s / s_r) ** a)
        damping: Any = (0.6329 - 0.00566 * np.log(n)) * reduction**0.1 * masing + least
        strain: Any = s / 100.0
        name = f"Darendeli PI {index:g}, {mean_stress:g} Pa"
        return cls(strain, reduction, damping / 100.0, name)

    def beyond(self, strain: float, place: str) -> str:
        """Return the sentence about an effective strain beyond the curves, or "" where it is not.

        ``place`` says where the strain is.
        """
        last = self.strain[-1]
        if strain <= last:
            return ""
        return (
            f"SoilCurves: the effective shear strain is {100.0 * strain:.3g} % {place}, and "
            f"'{self.name}' ends at {100.0 * last:.3g} %; give a weaker motion, or "
            "curves that go further"
        )

    def at(self, strain: Array) -> tuple[Array, Array]:
        """Return (G/Gmax, damping ratio) at shear strains; beyond the last one, its values."""
        place = np.log(np.maximum(strain, self.strain[0]))
        known = np.log(self.strain)
        return np.interp(place, known, self.reduction), np.interp(place, known, self.damping)
