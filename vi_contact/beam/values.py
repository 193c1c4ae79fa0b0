"""Describe Timoshenko beam and Kelvin-Voigt rod.

They have coefficients and the state they start from (Ahn 2012, section 2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import array, function, optional, shape_of
from ..core.quantities import NotNegative, Positive, Unit

Profile = Callable[[Array], Array]


@dataclass(frozen=True)
class TimoshenkoBeam:
    """Describe a beam clamped at x = 0.

    Its tip at x = length is free; u goes up, theta is the rotation of sections (2.6), (2.7):

        rho I theta'' = E I theta_xx + K A G (u_x - theta) + viscosity (same terms of the rates)
        rho A u''     = K A G (u_xx - theta_x) + viscosity (same terms of the rates) + f(t)

    area: A; inertia: I; shear_factor: K; viscosity: a2. The defaults are Ahn's, with EI = KAG =
    100; his viscosities are 0.001 and 2 s.
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

    viscosity: a1/c1; body_force [N/m] (f_h of the paper, uniform) and end_force [N] pull towards
    the wall for positive values.
    """

    length: Annotated[float, Positive, Unit("m")] = 5.0
    rho: Annotated[float, Positive, Unit("kg/m³")] = 1.0
    area: Annotated[float, Positive, Unit("m²")] = 1.0
    E: Annotated[float, Positive, Unit("Pa")] = 100.0
    viscosity: Annotated[float, NotNegative, Unit("s")] = 0.0
    gap: Annotated[float, NotNegative, Unit("m")] = 0.0
    body_force: Callable[[float], float] | None = None
    end_force: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        for name in ("body_force", "end_force"):
            optional(
                function, "Rod", name, getattr(self, name), "give a function of the time, or None"
            )
        check_fields(self)


@dataclass(frozen=True)
class Start:
    """Give initial values as functions of x.

    They are displacement u [m], velocity v [m/s], rotation theta and rate omega [1/s].
    """

    u: Profile = np.zeros_like
    v: Profile = np.zeros_like
    theta: Profile = np.zeros_like
    omega: Profile = np.zeros_like

    def __post_init__(self) -> None:
        for name in ("u", "v", "theta", "omega"):
            function("Start", name, getattr(self, name), "give a function of the positions x")

    def at(self, name: str, x: Array) -> Array:
        """Return a field at the nodes.

        It raises InputError unless it gives finite numbers, one for each node or one for all.
        """
        values = getattr(self, name)(x)
        shape = () if shape_of(values) == () else x.shape
        return np.broadcast_to(
            array("Start", f"what {name}(x) returns", values, shape), x.shape
        ).copy()
