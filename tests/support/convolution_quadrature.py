"""Turn boundary elements of the Laplace domain into a method in time: convolution quadrature
(docs/theory/bem.md).

A Runge-Kutta method replaces the derivative by a matrix delta(z)/dt of the shift z (one step back)
that couples its stages (Lubich 1988; Banjai, Messner and Schanz 2012). Here: Radau IIA of two
stages and order 3, A-stable, so that what is passive in continuous time stays passive:

    delta(z) = (A + z/(1 - z) 1 bᵀ)⁻¹,    A = [5, -1; 9, 3]/12,  b its last row

with stages at shares 1/3 and 1 of a step. For u = C(d/dt) g, g enters here by its impulses J = ∫ g
dt at the stages, so that means over steps are what counts, as in the energetic method, and a jump
at the end of a step needs no rule of its own. With delta = X diag(delta_i) X⁻¹ and s_i =
delta_i/dt at each point z of a circle,

    û = X diag(s_i C(s_i)) X⁻¹ Ĵ,      Ĵ = dt (c + z/(1 - z) 1) ĝ   for g held in each step.

Only matrices at the frequencies s_i are formed, N/2 + 1 times two. For g held, the work sum_k g_k
(u_k - u_(k-1)) is dt times the method's own sum of g times velocity: not negative for a passive
body.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vi_contact.core.algebra import Array
from vi_contact.core.checks import find_shape, function, number, whole
from vi_contact.core.errors import InputError

RADAU = np.array([[5.0, -1.0], [9.0, 3.0]]) / 12.0
STAGES = np.array([1.0 / 3.0, 1.0])
WIDTHS = np.diff(STAGES, prepend=0.0)  # of the parts of a step between stages, as shares of it


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Describe what the method makes of N steps of dt [s].

    z: (N/2 + 1,) shifts R exp(-2 pi i l/N), R = eps^(1/2N): real histories need the half circle
    only, and what wraps around is R^N = 1.5e-8 of the whole. s: (N/2 + 1, 2) complex frequencies
    [1/s], all with Re s > 0; vectors: (N/2 + 1, 2, 2) X. Raises InputError unless dt > 0, and for
    less than one step.
    """

    dt: float
    steps: int
    z: NDArray = field(init=False, repr=False)
    s: NDArray = field(init=False, repr=False)
    vectors: NDArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        number("convolution quadrature", "the time step dt", self.dt, positive=True, unit="s")
        whole("convolution quadrature", "the number of time steps", self.steps, least=1)
        z = self._radius * np.exp(-2j * np.pi * np.arange(self.steps // 2 + 1) / self.steps)
        values, vectors = np.linalg.eig(
            np.linalg.inv(RADAU + (z / (1.0 - z))[:, None, None] * RADAU[-1])
        )
        for name, value in (("z", z), ("s", values / self.dt), ("vectors", vectors)):
            object.__setattr__(self, name, value)

    @property
    def _radius(self) -> float:
        return float(np.finfo(float).eps ** (0.5 / self.steps))

    def _powers(self, dimensions: int) -> Array:
        return (self._radius ** np.arange(self.steps)).reshape(-1, *[1] * (dimensions - 1))

    def backward(self, transform: NDArray) -> Array:
        """Return the real history (N, ...) of which (N/2 + 1, ...) are the sums over n of z^n
        history[n]."""
        return np.asarray(
            np.fft.irfft(transform, n=self.steps, axis=0) / self._powers(transform.ndim)
        )

    @cached_property
    def held_factors(self) -> NDArray:
        """Return (N/2 + 1, 2) a_i: û = sum_i a_i C(s_i) ĝ at the end of the step, for g held in
        each step."""
        z = self.z[:, None]
        impulse = self.dt * (STAGES + z / (1.0 - z))
        return (
            self.vectors[:, -1] * self.s * np.linalg.solve(self.vectors, impulse[..., None])[..., 0]
        )

    def impulses(self, means: Array) -> NDArray:
        """Return (N/2 + 1, 2, ...) X⁻¹ Ĵ of real means between stages (N, 2, ...); (N, 1, ...) if
        held."""
        pieces = means * (WIDTHS * self.dt).reshape(-1, *[1] * (means.ndim - 2))
        summed = np.cumsum(pieces.reshape(-1, *means.shape[2:]), axis=0).reshape(pieces.shape)
        transform = np.fft.rfft(summed * self._powers(summed.ndim), axis=0)
        return np.linalg.solve(self.vectors, transform.reshape(*transform.shape[:2], -1)).reshape(
            transform.shape
        )

    def at_ends(self, modes: NDArray) -> Array:
        """Return (N, ...) values at the ends of the steps of modes (N/2 + 1, 2, ...)."""
        return self.backward(np.einsum("li,li...->l...", self.vectors[:, -1], modes))

    def step_means(self, impulse_modes: NDArray) -> Array:
        """Return (N, ...) means over the steps of what has these impulses."""
        return np.diff(self.at_ends(impulse_modes), axis=0, prepend=0.0) / self.dt

    def substep_means(self, forces: Callable[[float, int], Array]) -> Array:
        """Return (N, 2, ...) mean loads between stages, from forces(dt, steps) -> (steps, ...)
        means over steps.

        forces is, for example, `lambda dt, steps: traction_forces(mesh, traction, dt=dt,
        steps=steps)`. With these instead of means over whole steps the method keeps its order 3 in
        time.
        """
        function(
            "substep_means",
            "forces",
            forces,
            "give a function (dt, steps) that returns means over steps",
        )
        fine = forces(self.dt / 3, self.steps * 3)
        if not find_shape(fine) or len(fine) != self.steps * 3:
            raise InputError(
                f"substep_means: forces(dt, {self.steps * 3}) has shape {find_shape(fine)}; return "
                "one mean for each step"
            )
        first, second, third = np.moveaxis(fine.reshape(self.steps, 3, *fine.shape[1:]), 1, 0)
        return np.stack([first, (second + third) / 2.0], axis=1)
