"""Turn boundary elements of the Laplace domain into a method in time: convolution quadrature (docs/theory/bem.md).

A time method replaces the derivative by a function delta(z)/dt of the shift z (one step back): a number for multistep
methods, a matrix that couples the stages for Runge-Kutta methods (Lubich 1988; Banjai, Messner and Schanz 2012). All
three are A-stable, so that what is passive in continuous time stays passive.

For u = C(d/dt) g, g enters here by its impulses J = ∫ g dt at the stages, so that means over steps are what counts, as
in the energetic method, and a jump at the end of a step needs no rule of its own. With delta = X diag(delta_i) X⁻¹ and
s_i = delta_i/dt at each point z of a circle,

    û = X diag(s_i C(s_i)) X⁻¹ Ĵ,      Ĵ = dt (c + z/(1 - z) 1) ĝ   for g held in each step, stages at shares c of it.

Only matrices at the frequencies s_i are formed, N/2 + 1 times the number of stages. For g held, the work
sum_k g_k (u_k - u_(k-1)) is dt times the method's own sum of g times velocity: not negative for a passive body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array
from ..core.checks import function, instance, number, shape_of, whole
from ..core.errors import InputError


@dataclass(frozen=True)
class BDF2:
    """Describe backward differences of order 2: delta = 3/2 - 2 z + z²/2. Damps high frequencies."""

    abscissae: ClassVar[tuple[float, ...]] = (1.0,)  # the stages within a step, as shares of it
    smallest_ratio: ClassVar[float] = 0.05  # least c_P dt/h, h the longest element, with which histories stay bounded

    def delta(self, z: NDArray) -> NDArray:
        """Return (L, stages, stages) matrices dt d/dt at shifts z (L,), |z| < 1: here one stage."""
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


TimeMethod = BDF2 | Trapezoid | RadauIIA


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Describe what a method makes of N steps of dt [s]: BDF2(), Trapezoid() or RadauIIA().

    z: (N/2 + 1,) shifts R exp(-2 pi i l/N), R = eps^(1/2N): real histories need the half circle only, and what wraps
    around is R^N = 1.5e-8 of the whole. s: (N/2 + 1, stages) complex frequencies [1/s], all with Re s > 0; vectors:
    (N/2 + 1, stages, stages) X. Raises InputError for what is no method, unless dt > 0, and for less than one step.
    """

    method: TimeMethod
    dt: float
    steps: int
    z: NDArray = field(init=False, repr=False)
    s: NDArray = field(init=False, repr=False)
    vectors: NDArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        kinds = (BDF2, Trapezoid, RadauIIA)
        instance("convolution quadrature", "the method", self.method, kinds, "give BDF2(), Trapezoid() or RadauIIA()")
        number("convolution quadrature", "the time step dt", self.dt, positive=True, unit="s")
        whole("convolution quadrature", "the number of time steps", self.steps, least=1)
        z = self._radius * np.exp(-2j * np.pi * np.arange(self.steps // 2 + 1) / self.steps)
        values, vectors = np.linalg.eig(self.method.delta(z))
        for name, value in (("z", z), ("s", values / self.dt), ("vectors", vectors)):
            object.__setattr__(self, name, value)

    @property
    def _radius(self) -> float:
        return float(np.finfo(float).eps ** (0.5 / self.steps))

    def _powers(self, dimensions: int) -> Array:
        return (self._radius ** np.arange(self.steps)).reshape(-1, *[1] * (dimensions - 1))

    def backward(self, transform: NDArray) -> Array:
        """Return the real history (N, ...) of which (N/2 + 1, ...) are the sums over n of z^n history[n]."""
        return np.asarray(np.fft.irfft(transform, n=self.steps, axis=0) / self._powers(transform.ndim))

    @cached_property
    def held_factors(self) -> NDArray:
        """Return (N/2 + 1, stages) a_i: û = sum_i a_i C(s_i) ĝ at the end of the step, for g held in each step."""
        z = self.z[:, None]
        impulse = self.dt * (np.array(self.method.abscissae) + z / (1.0 - z))
        return self.vectors[:, -1] * self.s * np.linalg.solve(self.vectors, impulse[..., None])[..., 0]

    def impulses(self, means: Array) -> NDArray:
        """Return (N/2 + 1, stages, ...) X⁻¹ Ĵ of real means between stages (N, stages, ...); (N, 1, ...) if held."""
        widths = np.diff(self.method.abscissae, prepend=0.0) * self.dt
        pieces = means * widths.reshape(-1, *[1] * (means.ndim - 2))
        summed = np.cumsum(pieces.reshape(-1, *means.shape[2:]), axis=0).reshape(pieces.shape)
        transform = np.fft.rfft(summed * self._powers(summed.ndim), axis=0)
        return np.linalg.solve(self.vectors, transform.reshape(*transform.shape[:2], -1)).reshape(transform.shape)

    def at_ends(self, modes: NDArray) -> Array:
        """Return (N, ...) values at the ends of the steps of modes (N/2 + 1, stages, ...)."""
        return self.backward(np.einsum("li,li...->l...", self.vectors[:, -1], modes))

    def step_means(self, impulse_modes: NDArray) -> Array:
        """Return (N, ...) means over the steps of what has these impulses."""
        return np.diff(self.at_ends(impulse_modes), axis=0, prepend=0.0) / self.dt

    def substep_means(self, forces: Callable[[float, int], Array]) -> Array:
        """Return (N, stages, ...) mean loads between stages, from forces(dt, steps) -> (steps, ...) means over steps.

        forces is, for example, `lambda dt, steps: traction_forces(mesh, traction, dt=dt, steps=steps)`. With these
        instead of means over whole steps Radau keeps its order 3 in time; the other methods have one stage.
        """
        function("substep_means", "forces", forces, "give a function (dt, steps) that returns means over steps")
        shares = np.diff(self.method.abscissae, prepend=0.0)
        parts = np.rint(shares / shares.min()).astype(int)
        each = int(parts.sum())
        fine = forces(self.dt / each, self.steps * each)
        if not shape_of(fine) or len(fine) != self.steps * each:
            raise InputError(f"substep_means: forces(dt, {self.steps * each}) has shape {shape_of(fine)}; return one "
                             "mean for each step")
        fine = fine.reshape(self.steps, each, *fine.shape[1:])
        starts = np.concatenate([[0], np.cumsum(parts)[:-1]])
        return np.asarray(np.add.reduceat(fine, starts, axis=1) / parts.reshape(-1, *[1] * (fine.ndim - 2)))
