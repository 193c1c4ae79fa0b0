"""Kernels of the boundary elements: each integrated kernel against the Laplace domain, the textbook
form, 60 digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from laplace_kernels import LaplaceKernels, kappa
from scipy.special import kv

from vi_contact.bem.fundamental_solution import KernelSet, TimeKernels

pytestmark = pytest.mark.serial
C_P, C_S = 1.0, 0.5
ORDERS = {"single": 1, "double": 2, "hyper": 3}
SHARED = ("phi", "dphi", "ddiff", "g1", "g2")
FIELDS = {"single": ("g1", "g2"), "double": SHARED, "hyper": (*SHARED, "inertia_p", "inertia_s")}


def kernel(kernels: KernelSet, operator: str, field: str) -> np.ndarray:
    return getattr(kernels, operator)[FIELDS[operator].index(field)]


def displacement_tensor(d: np.ndarray, t: float, c_p: float, c_s: float) -> np.ndarray:
    """G(x - y, t) itself, density 1: (..., 2, 2) for d = x - y of shape (..., 2); the textbook
    form, not integrated.

    Infinite at the fronts. It is here to check the integrated kernels, not to integrate with.
    """
    r2 = (d**2).sum(-1)
    unit = d[..., :, None] * d[..., None, :] / r2[..., None, None]
    total = np.zeros((*r2.shape, 2, 2))
    for c, sign in ((c_p, 1.0), (c_s, -1.0)):
        q2 = c**2 * t**2 - r2
        q = np.sqrt(np.where(q2 > 0.0, q2, np.inf))
        along = np.where(q2 > 0.0, (2.0 * c**2 * t**2 - r2) / (r2 * q), 0.0)
        across = np.where(q2 > 0.0, q2 / (r2 * q) if sign > 0 else c**2 * t**2 / (r2 * q), 0.0)
        term = along[..., None, None] * unit - across[..., None, None] * np.eye(2)
        total += sign * term / (2.0 * np.pi * c)
    return total


def laplace_transform(r: float, s: float, operator: str, field: str) -> float:
    """∫ exp(-s t) k(t) dt, graded Gauss pieces between the fronts and beyond."""
    x, w = np.polynomial.legendre.leggauss(40)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    ends = [r / C_P, r / C_S, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0]
    total = 0.0
    for low, high in zip(ends[:-1], ends[1:], strict=True):
        t, weight = (
            low + (high - low) * x**2 * (3.0 - 2.0 * x),
            (high - low) * w * 6.0 * x * (1.0 - x),
        )
        values = [
            float(kernel(TimeKernels(ti, C_P, C_S)(np.array([r])), operator, field)[0]) for ti in t
        ]
        total += float(np.sum(weight * np.exp(-s * t) * values))
    return total


@pytest.mark.parametrize("operator", ORDERS)
def test_transforms_of_time_kernels_are_the_laplace_kernels(operator):
    """B1: ∫ exp(-s t) k^(n)(t) dt = s^-n k(s), both sides of the arrival of the S wave."""
    r, s = 0.3, 1.3
    exact = LaplaceKernels(s, C_P, C_S)(np.array([r]))
    for field in FIELDS[operator]:
        expected = complex(kernel(exact, operator, field)[0]) / s ** ORDERS[operator]
        assert laplace_transform(r, s, operator, field) == pytest.approx(
            expected.real, rel=1e-12
        ), field


@pytest.mark.parametrize("t", [0.3, 0.44, 0.5, 1.7])
def test_rate_of_the_integrated_displacement_tensor_is_the_textbook_one(t):
    """B1: d/dt G^(1) = G, between the fronts (r = 0.224) and behind both."""
    d = np.array([[0.2, 0.1]])
    r = np.hypot(*d[0])

    def integrated(t: float) -> np.ndarray:
        g1, g2 = TimeKernels(t, C_P, C_S)(np.array([r])).single
        return g1[0] * np.eye(2) - g2[0] * np.outer(d[0], d[0]) / r**2

    e = 1e-4
    one, two = integrated(t + e) - integrated(t - e), integrated(t + 2 * e) - integrated(t - 2 * e)
    rate = (8.0 * one - two) / (12.0 * e)
    expected = displacement_tensor(d, t, C_P, C_S)[0]
    assert np.abs(rate - expected).max() < 1e-9 * np.abs(expected).max()


def many_digits(r: float, t: float) -> dict[tuple[str, str], float]:
    """The time kernels behind both fronts from their definitions, Q_n = F_n'/r, with 60 digits."""
    with localcontext() as context:
        context.prec = 60
        distance, time = Decimal(r), Decimal(t)
        pi = Decimal("3.14159265358979323846264338327950288419716939937510582097494")
        f, q, c2 = {}, {}, {"s": Decimal(C_S) ** 2, "p": Decimal(C_P) ** 2}
        for wave, speed in (("s", Decimal(C_S)), ("p", Decimal(C_P))):
            root2 = time**2 - distance**2 / speed**2
            f[wave, 1] = ((time + root2.sqrt()) * speed / distance).ln()
            f[wave, 2] = time * f[wave, 1] - root2.sqrt()
            for n in (3, 4, 5):
                f[wave, n] = ((2 * n - 3) * time * f[wave, n - 1] - root2 * f[wave, n - 2]) / (
                    n - 1
                ) ** 2
            for n in (2, 3, 4, 5):
                q[wave, n] = ((n - 1) * f[wave, n] - time * f[wave, n - 1]) / distance**2
        values = {}
        for operator, n in ORDERS.items():
            change = q["s", n + 2] - q["p", n + 2]
            values[operator, "g1"] = f["s", n] / c2["s"] - change
            values[operator, "g2"] = f["s", n] / c2["s"] - f["p", n] / c2["p"] - 2 * change
            if n > 1:
                values[operator, "phi"], values[operator, "dphi"] = f["s", n], q["s", n]
                values[operator, "ddiff"] = q["p", n] - q["s", n]
        values["hyper", "inertia_p"], values["hyper", "inertia_s"] = f["p", 1], f["s", 1]
        return {key: float(value / (2 * pi)) for key, value in values.items()}


@pytest.mark.parametrize("r", [1e-7, 1e-3, 0.4])
def test_time_kernels_keep_their_digits_at_small_distances(r):
    """B1: nothing cancels: r = 1e-7 at t = 3 as good as r = 0.4."""
    kernels = TimeKernels(3.0, C_P, C_S)(np.array([r]))
    for (operator, field), expected in many_digits(r, 3.0).items():
        found = float(kernel(kernels, operator, field)[0])
        assert found == pytest.approx(expected, rel=1e-12), (operator, field)


def test_nothing_arrives_before_the_waves():
    """Ahead of the P front all kernels are zero; between the fronts the functions of the S wave
    are."""
    kernels = TimeKernels(1.0, C_P, C_S)(np.array([0.7, 1.0, 1.5]))
    for values in (kernels.single, kernels.double, kernels.hyper):
        assert all((field[1:] == 0.0).all() for field in values)
    assert kernel(kernels, "double", "phi")[0] == kernel(kernels, "hyper", "inertia_s")[0] == 0.0
    assert kernel(kernels, "single", "g1")[0] != 0.0


def test_the_bessel_function_without_its_pole():
    """kappa(z) = K1(z)/z - 1/z²: series and direct form meet at |z| = 0.7."""
    z = 0.7 * np.exp(1j * np.linspace(-1.5, 1.5, 7))
    direct = kv(1, z) / z - 1.0 / z**2
    assert np.abs(kappa(z * (1.0 - 1e-12)) - direct).max() < 1e-11
    assert np.abs(kappa(z) - direct).max() < 1e-14
