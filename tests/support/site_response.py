"""Solve vertical waves in a uniform layer: transfer functions, natural frequencies (Kramer 1996,
ch. 7).

Depth z from the free surface, k* = w/c_S*, c_S* = c_S sqrt(1 + 2i xi) with the hysteretic damping
ratio xi. In the layer u = 2 A cos(k* z) exp(i w t), where A is the amplitude of the upgoing wave.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_fields
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.laws.materials import LinearElastic


@dataclass(frozen=True)
class SoilLayer:
    """Describe a layer of ``height`` [m] and hysteretic damping ratio ``xi``, shaken by vertical
    shear waves.

    InputError unless height > 0 and xi >= 0.
    """

    height: Annotated[float, Positive, Unit("m")]
    material: LinearElastic
    xi: Annotated[float, NotNegative] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def frequency(self, n: int = 1) -> float:
        """Return f_n = (2n - 1) c_S / 4H [Hz] on a rigid base."""
        return (2 * n - 1) * self.material.c_s / (4.0 * self.height)

    def _phase(self, f: ArrayLike) -> NDArray[np.complex128]:
        """Return k* H."""
        speed = self.material.c_s * np.sqrt(1.0 + 2j * self.xi)
        return np.asarray(2.0 * np.pi * np.asarray(f, dtype=float) * self.height / speed)

    def on_rigid_base(self, f: ArrayLike) -> Array:
        """Return |u_surface / u_base| = |1/cos(k* H)|; both are motions within the layer."""
        return np.asarray(np.abs(1.0 / np.cos(self._phase(f))))

    def on_elastic_base(self, f: ArrayLike, rock: LinearElastic) -> Array:
        """Return |u_surface / u_outcrop| = |1/(cos k*H + i a sin k*H)|, a = rho c_S*/(rho_rock
        c_S_rock)."""
        phase = self._phase(f)
        a = (
            self.material.rho
            * self.material.c_s
            * np.sqrt(1.0 + 2j * self.xi)
            / (rock.rho * rock.c_s)
        )
        return np.asarray(np.abs(1.0 / (np.cos(phase) + 1j * a * np.sin(phase))))


def viscous(material: LinearElastic, f: float, *, alpha: float = 0.0, beta: float = 0.0) -> complex:
    """Return the complex wave number [1/m] of shear waves with Rayleigh damping at frequency f
    [Hz].

    rho w² (1 - i alpha/w) = G k² (1 + i w beta): what a run with C = alpha M + beta K has in place
    of k*.
    """
    w = 2.0 * np.pi * f
    return complex(w / material.c_s * np.sqrt((1.0 - 1j * alpha / w) / (1.0 + 1j * w * beta)))
