"""Plane waves in the material c_P = 1, c_S = 1/2, rho = 1, with their tractions, for tests of the
boundary elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vi_contact import LinearElastic

MATERIAL = LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
SQUARE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
DIRECTION = np.array([np.cos(0.4), np.sin(0.4)])
TURNED = np.array([-DIRECTION[1], DIRECTION[0]])


def stress_vector(gradient: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """sigma n from du_i/dx_j (m, 2, 2)."""
    trace = np.trace(gradient, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    stress = MATERIAL.lame_lambda * trace + MATERIAL.shear_modulus * (
        gradient + gradient.swapaxes(1, 2)
    )
    return np.einsum("mij,mj->mi", stress, normals)


@dataclass(frozen=True)
class Wave:
    """u = f(t - delay - x.d/c) times the polarisation; f and its derivative df."""

    f: Callable
    df: Callable
    shear: bool = False
    delay: float = 0.0

    @property
    def speed(self) -> float:
        return 0.5 if self.shear else 1.0

    @property
    def polarisation(self) -> np.ndarray:
        return TURNED if self.shear else DIRECTION

    def phase(self, x: np.ndarray, t: float) -> np.ndarray:
        return t - self.delay - x @ DIRECTION / self.speed

    def displacement(self, x: np.ndarray, t: float) -> np.ndarray:
        return np.multiply.outer(self.f(self.phase(x, t)), self.polarisation)

    def traction(self, x: np.ndarray, normals: np.ndarray, t: float) -> np.ndarray:
        rate = -self.df(self.phase(x, t)) / self.speed
        return stress_vector(
            np.multiply.outer(rate, np.multiply.outer(self.polarisation, DIRECTION)), normals
        )


def exponential(s: complex, *, shear: bool = False) -> Wave:
    """exp(s (t - x.d/c)): at t = 0 a plane wave of the Laplace domain."""
    return Wave(lambda q: np.exp(s * q), lambda q: s * np.exp(s * q), shear)


def pulse(*, shear: bool = False, duration: float = 2.0) -> Wave:
    """sin² of the given duration that reaches the unit square at t = 0."""

    def inside(q: np.ndarray) -> np.ndarray:
        return (q > 0.0) & (q < duration)

    return Wave(
        lambda q: np.where(inside(q), np.sin(np.pi * q / duration) ** 2, 0.0),
        lambda q: np.where(inside(q), np.pi / duration * np.sin(2.0 * np.pi * q / duration), 0.0),
        shear,
        0.5 * np.abs(DIRECTION).sum() / (0.5 if shear else 1.0),
    )
