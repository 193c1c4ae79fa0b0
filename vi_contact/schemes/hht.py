"""Step by the method of Hilber, Hughes and Taylor: Newmark's, with forces before the end.

    M a1 + C v_f + K u_f = (1 + alpha) f1 - alpha f0 - B_nᵀ r_n,f - B_tᵀ r_t,f
    (…)_f = (1 + alpha) (…)1 - alpha (…)0
    beta = ¼ (1 - alpha)²,    gamma = ½ - alpha
    contact and friction conditions at the end of the step

Generalised-alpha with alpha_m = 0, alpha_f = -alpha (see there for equations, restart, energy and
impulses). Order 2, unconditionally stable for -1/3 <= alpha <= 0; amplification (1 + alpha)/(1 -
alpha) at infinite frequency: 1 at alpha = 0, which is Newmark(¼, ½), and ½ at -1/3. On massless
contact nodes contact creates energy when a wave crosses many elements in a step, and the damping
does not keep it in bounds; on consistent mass also when dt resolves the mesh: docs/guide/schemes.md
has numbers. Source: Hilber, Hughes and Taylor, Earthquake Eng. Struct. Dyn. 5 (1977) 283-292.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from ..core.arguments import check_fields
from ..core.quantities import Between
from .generalised_alpha import AlphaStep, GeneralisedAlpha


@dataclass(frozen=True)
class HHT(AlphaStep):
    """Step by the module's equations.

    Attributes:
        alpha: minus the weight of the old forces; -1/3 damps most, 0 nothing.
    """

    alpha: Annotated[
        float,
        Between(-1.0 / 3.0, 0.0, remedy="give a number from -1/3 to 0, others are not stable"),
    ] = -0.1

    def __post_init__(self) -> None:
        check_fields(self)

    @cached_property
    def weights(self) -> GeneralisedAlpha:
        """Return the member of generalised-alpha that the scheme is."""
        return GeneralisedAlpha(0.0, -self.alpha, 0.25 * (1.0 - self.alpha) ** 2, 0.5 - self.alpha)
