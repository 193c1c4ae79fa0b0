"""Say how soil softens and damps as it is sheared.

There are curves of G/Gmax and of the damping ratio over the shear strain.
"""

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import checked
from ...core.checks import array, check_word, shown
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, NotNegative, Positive, Unit

# G/Gmax where a table must begin: below its first strain the soil has the values of its first row
LINEAR = 0.95
ATMOSPHERE = 101325.0  # Pa
_TABLES = tomllib.loads(files(__package__).joinpath("curves.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class SoilCurves:
    """Hold G/Gmax and the damping ratio at shear strains.

    Between them there are straight lines over the logarithm of the strain.

    strain: rising, as numbers, not per cent (1e-3 is 0.1 %); reduction: G/Gmax, from at least 0.95
    falling, above zero; damping: ratios below 1/2. Smaller strains than the first have its values;
    larger ones than the last are outside: ``equivalent_linear`` and ``strain_compatible`` refuse to
    end there. InputError for other tables.
    """

    strain: Annotated[Sequence[float], RATIO]
    reduction: Annotated[Sequence[float], RATIO]
    damping: Annotated[Sequence[float], RATIO]
    name: str = "own curves"

    def __post_init__(self) -> None:
        strain = array("SoilCurves", "strain", self.strain, (None,))
        reduction, damping = (
            array("SoilCurves", name, getattr(self, name), strain.shape)
            for name in ("reduction", "damping")
        )
        if len(strain) < 2 or strain[0] <= 0.0 or np.any(np.diff(strain) <= 0.0):
            raise InputError(
                f"SoilCurves: strain of '{self.name}' is {shown(self.strain)}; give two or more "
                "rising numbers above zero"
            )
        if (
            np.any(np.diff(reduction) > 0.0)
            or reduction[-1] <= 0.0
            or not LINEAR <= reduction[0] <= 1.0
        ):
            raise InputError(
                f"SoilCurves: reduction of '{self.name}' is {shown(self.reduction)}; give G/Gmax "
                f"that falls from 1 (at least {LINEAR:g}) and stays above zero: begin at smaller "
                "strains"
            )
        if damping.min() < 0.0 or damping.max() >= 0.5:
            raise InputError(
                f"SoilCurves: damping of '{self.name}' is {shown(self.damping)}; give ratios from "
                "0 to less than 1/2, not per cent"
            )
        for name, values in (("strain", strain), ("reduction", reduction), ("damping", damping)):
            object.__setattr__(self, name, tuple(values.tolist()))

    @classmethod
    @checked
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
        """Return the curves of sands, Seed and Idriss (1970).

        They are as pystrata 0.5.4 has read them from the figures. They are "mean", or "upper"
        modulus with lower damping, which SHAKE91 goes by. Strains up to 1 %.
        """
        known = _TABLES["seed_idriss"]
        check_word("bound of seed_idriss", bound, tuple(known))
        return cls(
            _TABLES["strain"],
            known[bound]["reduction"],
            known[bound]["damping"],
            f"Seed-Idriss {bound}",
        )

    @classmethod
    @checked
    def vucetic_dobry(
        cls, plasticity: Annotated[float, NotNegative, "the plasticity index [%]"]
    ) -> "SoilCurves":
        """Return the curves of a plasticity index from 0 to 200 [%].

        They are those of Vucetic and Dobry (1991), read likewise. They are published for 0, 15, 30,
        50, 100 and 200, with straight lines over the index between. Strains up to 1 %.
        """
        index = float(plasticity)
        known = _TABLES["vucetic_dobry"]
        if index > known["plasticity"][-1]:
            raise InputError(
                f"SoilCurves.vucetic_dobry: the plasticity index is {index:g} %, and the curves "
                f"end at {known['plasticity'][-1]} %: give SoilCurves of your own"
            )
        reduction, damping = (
            [float(np.interp(index, known["plasticity"], one)) for one in np.transpose(known[name])]
            for name in ("reduction", "damping")
        )
        return cls(_TABLES["strain"], reduction, damping, f"Vucetic-Dobry PI {index:g}")

    @classmethod
    @checked
    def darendeli(
        cls,
        *,
        mean_stress: Annotated[float, Positive, Unit("Pa"), "mean_stress"],
        plasticity: Annotated[float, NotNegative, "plasticity [%]"] = 0.0,
        ocr: Annotated[float, Between(1.0, math.inf, remedy="give 1 or more")] = 1.0,
        frequency: Annotated[float, Positive, Unit("Hz")] = 1.0,
        cycles: Annotated[float, Positive] = 10.0,
    ) -> "SoilCurves":
        """Return the curves of Darendeli (2001).

        With p = mean_stress / 1 atm, PI in % and strains in % up to 1:

            G/Gmax = 1 / (1 + (s/s_r)^0.919),    s_r = (0.0352 + 0.001 PI ocr^0.3246) p^0.3483
            xi = (0.6329 - 0.00566 ln N) (G/Gmax)^0.1 D_Masing + xi_min
            xi_min = (0.8005 + 0.0129 PI ocr^-0.1069) p^-0.2889 (1 + 0.2919 ln f)

        with his D_Masing. mean_stress: effective; frequency: f; cycles: N.
        """
        p, index = float(mean_stress) / ATMOSPHERE, float(plasticity)
        f, n = float(frequency), float(cycles)
        s, a = np.logspace(-4.0, 0.0, 41), 0.919
        s_r = (0.0352 + 0.001 * index * ocr**0.3246) * p**0.3483
        hyperbola = 4.0 * (s - s_r * np.log1p(s / s_r)) * (s + s_r) / s**2 - 2.0
        masing = np.polyval(
            [
                -0.0005 * a**2 + 0.0002 * a + 0.0003,
                0.0805 * a**2 - 0.071 * a - 0.0095,
                -1.1143 * a**2 + 1.8618 * a + 0.2523,
                0.0,
            ],
            100.0 / np.pi * hyperbola,
        )
        least = (0.8005 + 0.0129 * index * ocr**-0.1069) * p**-0.2889 * (1.0 + 0.2919 * np.log(f))
        reduction = 1.0 / (1.0 + (s / s_r) ** a)
        damping = (0.6329 - 0.00566 * np.log(n)) * reduction**0.1 * masing + least
        rows: Any = (s / 100.0, reduction, damping / 100.0)
        return cls(rows[0], rows[1], rows[2], f"Darendeli PI {index:g}, {mean_stress:g} Pa")

    def beyond(self, strain: float, place: str) -> str:
        """Return the sentence about an effective strain beyond the largest of the curves.

        It is empty where it is not beyond.
        """
        return (
            ""
            if strain <= self.strain[-1]
            else (
                f"SoilCurves: the effective shear strain is {100.0 * strain:.3g} % {place}, and "
                f"'{self.name}' ends at {100.0 * self.strain[-1]:.3g} %; give a weaker motion, or "
                "curves that go further"
            )
        )

    def at(self, strain: Array) -> tuple[Array, Array]:
        """Return (G/Gmax, damping ratio) at these shear strains.

        Beyond the last strain there are its values.
        """
        place, known = np.log(np.maximum(strain, self.strain[0])), np.log(self.strain)
        return np.interp(place, known, self.reduction), np.interp(place, known, self.damping)
