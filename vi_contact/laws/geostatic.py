"""Say the stress that level ground has before anything is built: its weight, and K0 of it sideways.

    sigma_v = -(surcharge + unit_weight (level - z)),    sigma_h = K0 sigma_v

z is the last coordinate, and tension is positive. Level ground under its own weight is in
equilibrium with it, so that a static stage moves nothing.

Source: Jaky, J. Soc. Hungarian Archit. Eng. 78 (1944) 355-358, K0 = 1 - sin phi of sand.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.quantities import RATIO, Finite, NotNegative, Unit


@dataclass(frozen=True)
class Geostatic:
    """Hold the stress of level ground, for ``fem.assemble(initial_stress=)``.

    Attributes:
        K0: effective horizontal stress over vertical stress.
        unit_weight: rho g [N/m³].
        level: of the surface, along the last axis [m]; above it there is the surcharge alone.
        surcharge: pressure on the surface [Pa].
    """

    K0: Annotated[float, NotNegative, RATIO, "the ratio K0"]
    unit_weight: Annotated[float, NotNegative, Unit("N/m³"), "the unit weight"]
    level: Annotated[float, Finite, Unit("m"), "the level of the ground"]
    surcharge: Annotated[float, NotNegative, Unit("Pa"), "the surcharge"] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def __call__(self, points: Array) -> Array:
        """Return the stress at points (k, d) [m]: components (k, 4), in space (k, 6) [Pa]."""
        d = points.shape[1]
        depth = np.maximum(self.level - points[:, -1], 0.0)
        vertical = -(self.surcharge + self.unit_weight * depth)
        sigma = np.zeros((len(points), 4 if d == 2 else 6))
        sigma[:, :3] = self.K0 * vertical[:, None]
        sigma[:, d - 1] = vertical
        return sigma
