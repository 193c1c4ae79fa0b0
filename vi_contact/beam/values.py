"""Describe Timoshenko beam and Kelvin-Voigt rod.

They have coefficients and the state they start from (Ahn 2012, section 2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import array, find_shape, function, optional
from ..core.quantities import NotNegative, Positive, Unit

Profile = Callable[[Array], Array]


@dataclass(frozen=True)
class TimoshenkoBeam:
    """Describe a beam clamped at x = 0.

    Its tip at x = length is free; u goes up, theta is the rotation of sections (2.6), (2.7):

        rho I theta'' = E I theta_xx + K A G (u_x - theta) + viscosity (same terms of the rates)
        rho A u''     = K A G (u_xx - theta_x) + viscosity (same terms of the rates) + f(t)

    The defaults are Ahn's, with E I = 100 N m² and K A G = 100 N.

    Args:
        length: l.
        rho: mass density.
        area: A, of the cross-section.
        inertia: I, second moment of area.
        E: Young's modulus.
        G: shear modulus.
        shear_factor: K, for the shape of the cross-section.
        viscosity: a2, of Kelvin and Voigt; Ahn's are 0.001 and 2 s.

    Raises:
        InputError: a number is outside its range.

    Source: J. Ahn (2012), A viscoelastic Timoshenko beam with Coulomb law of friction.
    """

    length: Annotated[float, Positive, Unit("m")] = 5.0
    rho: Annotated[float, Positive, Unit("kg/m³")] = 1.0
    area: Annotated[float, Positive, Unit("m²")] = 1.0
    inertia: Annotated[float, Positive, Unit("m⁴")] = 1.0
    E: Annotated[float, Positive, Unit("Pa")] = 100.0
    G: Annotated[float, Positive, Unit("Pa")] = 100.0
    shear_factor: Annotated[float, Positive] = 1.0
    viscosity: Annotated[float, NotNegative, Unit("s")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def bending_stiffness(self) -> float:
        """Return E I [N m²]."""
        return self.E * self.inertia

    @property
    def shear_stiffness(self) -> float:
        """Return K A G [N]."""
        return self.shear_factor * self.area * self.G


@dataclass(frozen=True)
class Rod:
    """Describe a rod along x, clamped at x = 0.

    Its end x = length may touch a wall at the distance gap (2.1)-(2.4):

        rho A v'' = E A (v_xx + viscosity v'_xx) + body_force(t),    v(length) <= gap

    v is positive towards the wall. The clamped end stands still.

    Args:
        length: l.
        rho: mass density.
        area: A, of the cross-section.
        E: Young's modulus.
        viscosity: a1/c1 of the paper, of Kelvin and Voigt.
        gap: distance of the wall from the end at rest.
        body_force: t [s] -> uniform force [N/m], f_h of the paper, positive towards the wall.
        end_force: t [s] -> force on the free end [N], positive towards the wall.

    Raises:
        InputError: a number is outside its range, or a force is no function.

    Source: J. Ahn (2012), section 2.
    """

    length: Annotated[float, Positive, Unit("m")] = 5.0
    rho: Annotated[float, Positive, Unit("kg/m³")] = 1.0
    area: Annotated[float, Positive, Unit("m²")] = 1.0
    E: Annotated[float, Positive, Unit("Pa")] = 100.0
    viscosity: Annotated[float, NotNegative, Unit("s")] = 0.0
    gap: Annotated[float, NotNegative, Unit("m")] = 0.0
    body_force: Annotated[Callable[[float], float] | None, Unit("N/m")] = None
    end_force: Annotated[Callable[[float], float] | None, Unit("N")] = None

    def __post_init__(self) -> None:
        for name in ("body_force", "end_force"):
            optional(
                function, "Rod", name, getattr(self, name), "give a function of the time, or None"
            )
        check_fields(self)


@dataclass(frozen=True)
class Start:
    """Give initial values as functions of the positions x (n,) [m] along the body.

    Args:
        u: displacement [m], of a rod along it, of a beam across it.
        v: velocity [m/s], likewise.
        theta: rotation of the sections of a beam [-].
        omega: rate of the rotation [1/s].

    Raises:
        InputError: one of them is no function.
    """

    u: Profile = np.zeros_like
    v: Profile = np.zeros_like
    theta: Profile = np.zeros_like
    omega: Profile = np.zeros_like

    def __post_init__(self) -> None:
        for name in ("u", "v", "theta", "omega"):
            function("Start", name, getattr(self, name), "give a function of the positions x")

    def at(self, name: str, x: Array) -> Array:
        """Return the field of this name at the nodes x (n,) [m], shape (n,).

        Raises:
            InputError: it does not give finite numbers, one for each node or one for all.
        """
        values = getattr(self, name)(x)
        shape = () if find_shape(values) == () else x.shape
        numbers = array("Start", f"what {name}(x) returns", values, shape)
        return np.broadcast_to(numbers, x.shape).copy()
