"""Yield by friction and cohesion on the worst plane: Mohr and Coulomb's law, for soil and rock.

In principal stresses, tension positive and s1 >= s2 >= s3:

    f = (s1 - s3) + (s1 + s3) sin phi - 2 c cos phi
    Δeps_p = gamma (1 + sin psi, 0, sin psi - 1) along the same axes

The surface is a pyramid of six faces. A stress returns to a face; to an edge, where two faces meet
(s2 = s3, or s1 = s2), by two multipliers; or to the tip, s1 = s2 = s3 = c/tan phi. Each return is
linear. Which of them holds is decided by its own conditions: multipliers >= 0, and stresses in
their order. No mean tension exceeds the tip, which is a cut-off too, with a flow of any dilatancy:
so a material with psi = 0 has an answer in tension.

Sources: Clausen, Damkilde and Andersen, Comput. Struct. 85 (2007) 1795-1807; de Souza Neto, Perić
and Owen, Computational Methods for Plasticity (2008), section 8.2.
"""

from dataclasses import dataclass, replace
from math import cos, radians, sin
from typing import Annotated, Any

import numpy as np

from ..core.algebra import Array
from .drucker_prager import BELOW_NINETY, DEGREES, Cohesion, check_strength, divide_strength
from .mandel import PAIRS, find_principal, make_basis, norm, to_tensors
from .yielding import (
    ROUND_OFF,
    PointState,
    YieldingMaterial,
    choose_flow,
    find_share,
    judge_multiplier,
    largest_of,
)

FACE = ((0, 2),)
RIGHT = ((0, 2), (0, 1))  # s2 = s3, as in triaxial compression
LEFT = ((0, 2), (1, 2))  # s1 = s2, as in triaxial extension
NEGATIVE = 1e-12  # of the largest multiplier: one that is zero, but for rounding
COINCIDENT = 1e-9  # of the largest stress: two principal values that are one


def make_normals(faces: tuple[tuple[int, int], ...], sine: float) -> Array:
    """Return the normals (k, 3) of faces (i, j) of a pyramid in principal stresses.

    Args:
        faces: largest and least principal stress of each.
        sine: of its angle.
    """
    normals = np.zeros((len(faces), 3))
    for row, (i, j) in enumerate(faces):
        normals[row, i] = 1.0 + sine
        normals[row, j] = sine - 1.0
    return normals


@dataclass(frozen=True)
class MohrCoulomb(YieldingMaterial):
    """Describe a material that yields by the law of the module.

    Attributes:
        cohesion: c [Pa].
        phi: angle of friction [degrees].
        psi: angle of dilatancy [degrees], at most phi.
    """

    cohesion: Cohesion
    phi: Annotated[float, BELOW_NINETY, DEGREES, "the angle of friction phi"]
    psi: Annotated[float, BELOW_NINETY, DEGREES, "the angle of dilatancy psi"]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_strength("MohrCoulomb", self.cohesion, self.phi, self.psi)

    @property
    def sines(self) -> tuple[float, float]:
        """Return sin phi and sin psi."""
        return sin(radians(self.phi)), sin(radians(self.psi))

    @property
    def strength(self) -> float:
        """Return 2 c cos phi [Pa]."""
        return 2.0 * self.cohesion * cos(radians(self.phi))

    @property
    def tip(self) -> float:
        """Return the largest mean stress c/tan phi [Pa], infinite where phi = 0."""
        s, _ = self.sines
        return self.strength / (2.0 * s) if s > 0.0 else np.inf

    @property
    def _along_axes(self) -> Array:
        """Return the elastic matrix (3, 3) [Pa] of principal values."""
        G = self.shear_modulus
        return self.bulk_modulus - 2.0 / 3.0 * G + 2.0 * G * np.eye(3)

    @property
    def symmetric(self) -> bool:
        """Say whether tangents are symmetric: psi is phi."""
        return self.psi == self.phi

    def weaken(self, factor: float) -> "MohrCoulomb":
        """Return the material with c and tan phi over a factor, and psi at most that phi."""
        c, phi, psi = divide_strength(self.cohesion, self.phi, self.psi, factor)
        return replace(self, cohesion=c, phi=phi, psi=psi)

    def start(self, sigma: Array) -> dict[str, Array]:
        """Return the state of points that have never yielded; alpha is the plastic strain."""
        return {**super().start(sigma), "alpha": np.zeros(len(sigma))}

    def f(self, state: PointState) -> Array:
        """Return the yield function (q,) [Pa]."""
        values, _ = find_principal(state["sigma"])
        return self._beyond(values)

    def mobilised(self, state: PointState) -> Array:
        """Return s1 - s3 over 2 c cos phi - (s1 + s3) sin phi (q,)."""
        values, _ = find_principal(state["sigma"])
        return find_share(self._beyond(values), values[:, 0] - values[:, 2])

    def _beyond(self, values: Array) -> Array:
        """Return f (q,) [Pa] of sorted principal stresses (q, 3)."""
        s, _ = self.sines
        return (1.0 + s) * values[:, 0] - (1.0 - s) * values[:, 2] - self.strength

    def stress(
        self, de: Array, old: PointState, tangent: bool = True
    ) -> tuple[dict[str, Array], Array | None]:
        """Return the state after a strain increment and its tangent, by principal stresses."""
        n = de.shape[-1]
        C = self.stiffness(n)
        sigma = old["sigma"] + de @ C
        D = np.broadcast_to(C, (len(de), n, n)).copy() if tangent else None

        # Most points are elastic: principal axes and returns are made of the others alone.
        trial, axes = find_principal(sigma)
        rounding = ROUND_OFF * (np.abs(trial).max(axis=1, initial=0.0) + self.strength)
        on = np.flatnonzero(self._beyond(trial) > rounding)
        alpha = old["alpha"].copy()
        new = {"sigma": sigma, "alpha": alpha}
        if not len(on):
            return new, D
        values, slopes = self._return(trial[on])
        stretches, shears = make_basis(axes[on], n)
        sigma[on] = np.einsum("qi,qin->qn", values, stretches)
        change = de[on] - self.elastic_strain(sigma[on] - old["sigma"][on])
        alpha[on] += np.sqrt(2.0 / 3.0) * norm(change)
        if D is not None:
            D[on] = self._turn(trial[on], values, slopes, stretches, shears)
        return new, D

    def _return(self, trial: Array) -> tuple[Array, Array]:
        """Return principal stresses (q, 3) [Pa] on the surface, and their derivatives (q, 3, 3).

        Args:
            trial: sorted principal stresses beyond it.
        """
        values, slopes, _ = self._return_to(FACE, trial)
        disordered = (values[:, 2] > values[:, 1]) | (values[:, 1] > values[:, 0])
        left = np.flatnonzero(disordered)
        for edge, high, low in ((RIGHT, 0, 2), (LEFT, 1, 2)):
            if not len(left):
                return values, slopes
            there, slope, gamma = self._return_to(edge, trial[left])
            least = -NEGATIVE * np.abs(gamma).max(axis=1)
            good = (gamma.min(axis=1) >= least) & (there[:, high] >= there[:, low])
            values[left[good]] = there[good]
            slopes[left[good]] = slope
            left = left[~good]
        values[left] = self.tip
        slopes[left] = 0.0
        return values, slopes

    def _return_to(
        self, faces: tuple[tuple[int, int], ...], trial: Array
    ) -> tuple[Array, Array, Array]:
        """Return where faces are met together: stresses (q, 3), derivative, multipliers (q, k).

        The derivative is (q, 3, 3) for one face and (3, 3) for two.

        Args:
            faces: one or two.
            trial: principal stresses (q, 3).
        """
        s, t = self.sines
        C = self._along_axes
        N = make_normals(faces, s)
        M = make_normals(faces, t)
        inverse = np.linalg.inv(N @ C @ M.T)
        gamma = (trial @ N.T - self.strength) @ inverse.T
        slope = C - C @ M.T @ inverse @ N @ C
        if len(faces) == 1:
            slope = np.broadcast_to(slope, (len(trial), 3, 3)).copy()
        return trial - gamma @ (M @ C), slope, gamma

    def _turn(
        self, trial: Array, values: Array, slopes: Array, stretches: Array, shears: Array
    ) -> Array:
        """Return the tangent (q, n, n) [Pa]: of principal values, and of axes that turn.

        A shear between two axes turns them, and the stress changes by G (s_i - s_j)/(t_i - t_j)
        with the trial t. Where the trial values coincide this is (D_ii - D_ij)/2.

        Args:
            trial: principal stresses (q, 3) before the return.
            values: those after it.
            slopes: derivative (q, 3, 3) of these in principal strains [Pa].
            stretches: unit tensors (q, 3, n) along the axes.
            shears: unit tensors (q, 3, n) between them.
        """
        D: Array = np.einsum("qin,qij,qjm->qnm", stretches, slopes, stretches, optimize=True)
        size = np.abs(trial).max(axis=1)
        for place, (i, j) in enumerate(PAIRS[6]):
            apart = trial[:, i] - trial[:, j]
            one = apart <= COINCIDENT * size
            turning = self.shear_modulus * (values[:, i] - values[:, j])
            turning = turning / np.where(one, 1.0, apart)
            together = 0.5 * (slopes[:, i, i] - slopes[:, i, j])
            rate = 2.0 * np.where(one, together, turning)
            shear = shears[:, place]
            D += rate[:, None, None] * shear[:, :, None] * shear[:, None, :]
        return D

    def residual(
        self, de: Array, old: PointState, new: PointState, sizes: tuple[float, float]
    ) -> Array:
        """Return how far an increment is from the equations of the module (q,).

        The axes are those of sigma + C Δeps_p in space, in which both parts are diagonal.
        """
        stress, strain = sizes
        sigma = new["sigma"]
        flow = self.plastic_increment(de, old, new)
        trial = to_tensors(sigma + flow @ self.stiffness(sigma.shape[-1]))
        _, axes = np.linalg.eigh(trial)
        axes = axes[:, :, ::-1]
        turned = np.einsum("qai,qab,qbj->qij", axes, to_tensors(sigma), axes, optimize=True)
        moved = np.einsum("qai,qab,qbj->qij", axes, to_tensors(flow), axes, optimize=True)
        values = np.einsum("qii->qi", turned)
        plastic = np.einsum("qii->qi", moved)
        off_axes = largest_of(
            *[np.abs(turned[:, i, j]) / stress for i, j in PAIRS[6]],
            *[np.abs(moved[:, i, j]) / strain for i, j in PAIRS[6]],
        )
        candidates: list[Any] = [norm(flow) / strain]
        for faces in (FACE, RIGHT, LEFT):
            candidates.append(self._judge_faces(faces, values, plastic, sizes))
        if np.isfinite(self.tip):
            candidates.append(self._judge_tip(values, plastic, sizes))
        beyond = np.maximum(self._beyond(np.sort(values)[:, ::-1]), 0.0) / stress
        return largest_of(beyond, off_axes, choose_flow(candidates))

    def _judge_faces(
        self,
        faces: tuple[tuple[int, int], ...],
        values: Array,
        plastic: Array,
        sizes: tuple[float, float],
    ) -> Array:
        """Return the residual (q,) of a flow over these faces.

        Args:
            faces: one or two.
            values: principal stresses (q, 3) [Pa].
            plastic: principal plastic strains (q, 3).
            sizes: |sigma| [Pa] and |eps|.
        """
        s, t = self.sines
        M = make_normals(faces, t)
        gamma = plastic @ np.linalg.pinv(M)
        f = values @ make_normals(faces, s).T - self.strength
        parts = [np.linalg.norm(plastic - gamma @ M, axis=1) / sizes[1]]
        for k in range(len(faces)):
            parts.append(judge_multiplier(gamma[:, k], f[:, k], sizes))
        return largest_of(*parts)

    def _judge_tip(self, values: Array, plastic: Array, sizes: tuple[float, float]) -> Array:
        """Return the residual (q,) of a flow at the tip.

        The flow is a sum of the ways of all six faces and of 1. In falling order it is one where
        its products with the edges of the polar cone are not negative: 1 + 1 + 1, (1 - t, 1 - t,
        1 + t) and (1 - t, 1 + t, 1 + t) with t = sin psi.

        Args:
            values: principal stresses (q, 3) [Pa].
            plastic: principal plastic strains (q, 3).
            sizes: |sigma| [Pa] and |eps|.
        """
        stress, strain = sizes
        _, t = self.sines
        low = 1.0 - t
        high = 1.0 + t
        edges = np.array([[1.0, 1.0, 1.0], [low, low, high], [low, high, high]])
        products = np.sort(plastic)[:, ::-1] @ edges.T
        missing = np.maximum(-products.min(axis=1), 0.0) / strain
        return largest_of(missing, np.abs(values - self.tip).max(axis=1) / stress)
