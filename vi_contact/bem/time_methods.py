"""Define time methods of convolution quadrature, and the circle in the z-plane on which it works.

A method replaces the derivative in time by a function delta(z)/dt of the shift z (one step back): a number for the
multistep methods, a matrix that couples the stages for Runge-Kutta methods (Lubich 1988; Banjai, Messner and Schanz
2012). All three are A-stable, so that what is passive in continuous time stays passive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array


class TimeMethod(Protocol):
    """Describe what convolution quadrature asks of a method."""

    @property
    def abscissae(self) -> tuple[float, ...]:
        """Return the stages within a step, as shares of it; the last is 1."""
        ...

    @property
    def smallest_ratio(self) -> float:
        """Return the least c_P dt/h, h the longest element, with which histories stay bounded."""
        ...

    def delta(self, z: NDArray) -> NDArray:
        """Return (L, stages, stages) matrices dt d/dt at shifts z (L,), |z| < 1."""
        ...


@dataclass(frozen=True)
class BDF2:
    """Describe backward differences of order 2: delta = 3/2 - 2 z + z²/2. Damps high frequencies."""

    abscissae: ClassVar[tuple[float, ...]] = (1.0,)
    smallest_ratio: ClassVar[float] = 0.05

    def delta(self, z: NDArray) -> NDArray:
        """Return (L, 1, 1)."""
        return np.asarray(1.5 - 2.0 * z + 0.5 * z**2)[:, None, None]


@dataclass(frozen=True)
class Trapezoid:
    """Describe the trapezoidal rule, order 2: delta = 2 (1 - z)/(1 + z).

    No numerical damping: fronts ring, and below c_P dt/h = 0.5 the errors of integration over elements grow in time.
    """

    abscissae: ClassVar[tuple[float, ...]] = (1.0,)
    smallest_ratio: ClassVar[float] = 0.5

    def delta(self, z: NDArray) -> NDArray:
        """Return (L, 1, 1)."""
        return np.asarray(2.0 * (1.0 - z) / (1.0 + z))[:, None, None]


@dataclass(frozen=True)
class RadauIIA:
    """Describe Radau IIA of two stages, order 3: delta = (A + z/(1 - z) 1 bᵀ)⁻¹, b the last row of A."""

    abscissae: ClassVar[tuple[float, ...]] = (1.0 / 3.0, 1.0)
    smallest_ratio: ClassVar[float] = 0.05

    def delta(self, z: NDArray) -> NDArray:
        """Return (L, 2, 2)."""
        a = np.array([[5.0, -1.0], [9.0, 3.0]]) / 12.0
        return np.linalg.inv(a + (z / (1.0 - z))[:, None, None] * a[-1])


@dataclass(frozen=True)
class Contour:
    """Hold the points z_l = R exp(-2 pi i l/N), l = 0 ... N/2, with which N steps are transformed; R = eps^(1/2N).

    Real histories need the half circle only. What wraps around is R^N = 1.5e-8 of the whole.
    """

    steps: int

    @property
    def radius(self) -> float:
        """Return the radius R of the circle."""
        return float(np.finfo(float).eps ** (0.5 / self.steps))

    @property
    def z(self) -> NDArray:
        """Return (N/2 + 1,) points."""
        return np.asarray(self.radius * np.exp(-2j * np.pi * np.arange(self.steps // 2 + 1) / self.steps))

    def forward(self, history: NDArray) -> NDArray:
        """Return (N/2 + 1, ...) sums over n of z^n history[n] of a real history (N, ...)."""
        return np.fft.rfft(history * self._powers(history.ndim), axis=0)

    def backward(self, transform: NDArray) -> Array:
        """Return (N, ...) real history of a transform (N/2 + 1, ...)."""
        return np.asarray(np.fft.irfft(transform, n=self.steps, axis=0) / self._powers(transform.ndim))

    def _powers(self, dimensions: int) -> Array:
        return (self.radius ** np.arange(self.steps)).reshape(-1, *[1] * (dimensions - 1))
