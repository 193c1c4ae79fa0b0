"""Turn boundary elements of the Laplace domain into a method in time: convolution quadrature (docs/theory/bem.md).

For u = C(d/dt) g the derivative is replaced by delta(z)/dt of a time stepping method. Here g enters by its impulses
J = ∫ g dt at the stages, so that means over steps are what counts, as in the energetic method, and a jump at the end of
a step needs no rule of its own. With delta = X diag(delta_i) X⁻¹ and s_i = delta_i/dt at each point z of a circle,

    û = X diag(s_i C(s_i)) X⁻¹ Ĵ,      Ĵ = dt (c + z/(1 - z) 1) ĝ   for g held in each step, stages at shares c of it.

Only matrices at the frequencies s_i are formed, N/2 + 1 times the number of stages. For g held, the work
sum_k g_k (u_k - u_(k-1)) is dt times the method's own sum of g times velocity: not negative for a passive body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array
from ..core.checks import attributes, function, instance, number, shape_of, whole
from ..core.errors import InputError
from .time_methods import BDF2, Contour, RadauIIA, TimeMethod, Trapezoid

METHODS = (BDF2, Trapezoid, RadauIIA)


@dataclass(frozen=True)
class Frequencies:
    """Describe what a method makes of N steps of dt [s].

    s: (N/2 + 1, stages) complex frequencies [1/s], all with Re s > 0; vectors: (N/2 + 1, stages, stages) X.
    """

    method: TimeMethod
    dt: float
    steps: int

    def __post_init__(self) -> None:
        instance("Frequencies", "the method", self.method, METHODS, "give BDF2(), Trapezoid() or RadauIIA()")
        attributes(self, positive=("dt",))
        whole("Frequencies", "steps", self.steps, least=1)

    @cached_property
    def contour(self) -> Contour:
        """Return the circle of the shifts z."""
        return Contour(self.steps)

    @cached_property
    def _eigen(self) -> tuple[NDArray, NDArray]:
        values, vectors = np.linalg.eig(self.method.delta(self.contour.z))
        return values / self.dt, vectors

    @property
    def s(self) -> NDArray:
        """Return the frequencies."""
        return self._eigen[0]

    @property
    def vectors(self) -> NDArray:
        """Return the eigenvectors X."""
        return self._eigen[1]

    @cached_property
    def held_factors(self) -> NDArray:
        """Return (N/2 + 1, stages) a_i: û = sum_i a_i C(s_i) ĝ at the end of the step, for g held in each step."""
        z = self.contour.z[:, None]
        impulse = self.dt * (np.array(self.method.abscissae) + z / (1.0 - z))
        return self.vectors[:, -1] * self.s * np.linalg.solve(self.vectors, impulse[..., None])[..., 0]

    def impulses(self, means: Array) -> NDArray:
        """Return (N/2 + 1, stages, ...) X⁻¹ Ĵ of real means between stages (N, stages, ...); (N, 1, ...) if held."""
        widths = np.diff(self.method.abscissae, prepend=0.0) * self.dt
        pieces = means * widths.reshape(-1, *[1] * (means.ndim - 2))
        transform = self.contour.forward(np.cumsum(pieces.reshape(-1, *means.shape[2:]), axis=0).reshape(pieces.shape))
        return np.linalg.solve(self.vectors, transform.reshape(*transform.shape[:2], -1)).reshape(transform.shape)

    def at_ends(self, modes: NDArray) -> Array:
        """Return (N, ...) values at the ends of the steps of modes (N/2 + 1, stages, ...)."""
        return self.contour.backward(np.einsum("li,li...->l...", self.vectors[:, -1], modes))

    def step_means(self, impulse_modes: NDArray) -> Array:
        """Return (N, ...) means over the steps of what has these impulses."""
        return np.diff(self.at_ends(impulse_modes), axis=0, prepend=0.0) / self.dt


@dataclass(frozen=True)
class ConvolutionQuadrature:
    """Describe the time discretisation beside the energetic one. method: BDF2(), Trapezoid() or RadauIIA()."""

    method: TimeMethod = RadauIIA()

    def __post_init__(self) -> None:
        instance("ConvolutionQuadrature", "the method", self.method, METHODS, "give BDF2(), Trapezoid() or RadauIIA()")

    def frequencies(self, *, dt: float, steps: int) -> Frequencies:
        """Return the frequencies for `steps` steps of dt [s]. Raises InputError unless dt > 0 and steps >= 1."""
        owner = "ConvolutionQuadrature"
        step = number(owner, "the time step dt", dt, positive=True, unit="s")
        return Frequencies(self.method, step, whole(owner, "the number of time steps", steps, least=1))

    def substep_means(self, forces: Callable[[float, int], Array], *, dt: float, steps: int) -> Array:
        """Return (steps, stages, ...) mean loads between stages, from forces(dt, steps) -> (steps, ...) means.

        forces is, for example, `lambda dt, steps: traction_forces(mesh, traction, dt=dt, steps=steps)`. With these
        instead of means over whole steps Radau keeps its order 3 in time; the other methods have one stage.
        """
        owner = "ConvolutionQuadrature.substep_means"
        function(owner, "forces", forces, "give a function (dt, steps) that returns means over steps")
        number(owner, "the time step dt", dt, positive=True, unit="s")
        steps = whole(owner, "the number of time steps", steps, least=1)
        shares = np.diff(self.method.abscissae, prepend=0.0)
        parts = np.rint(shares / shares.min()).astype(int)
        fine = forces(dt / parts.sum(), steps * int(parts.sum()))
        if not shape_of(fine) or len(fine) != steps * parts.sum():
            raise InputError(f"{owner}: forces(dt, {steps * parts.sum()}) has shape {shape_of(fine)}; return one mean "
                             "for each step")
        fine = fine.reshape(steps, int(parts.sum()), *fine.shape[1:])
        starts = np.concatenate([[0], np.cumsum(parts)[:-1]])
        return np.asarray(np.add.reduceat(fine, starts, axis=1) / parts.reshape(-1, *[1] * (fine.ndim - 2)))
