"""Galerkin matrices: symmetric, exact for translations, second order in plane waves; quadrature
split at the fronts."""

from __future__ import annotations

import numpy as np
import pytest
from boundary_matrices import in_time, laplace
from laplace_kernels import LaplaceKernels
from plane_waves import MATERIAL, SQUARE, exponential, stress_vector

from vi_contact.bem import BoundaryMesh, Orders, circle, polygon

pytestmark = pytest.mark.serial
S = 2.0 + 3.0j


def steklov(mesh: BoundaryMesh, s: complex, orders: Orders = Orders()) -> dict[str, np.ndarray]:
    matrices = laplace(mesh, s, orders)
    right = 0.5 * mesh.mass + matrices.double
    p = np.linalg.solve(matrices.single, right)
    return {"symmetric": right.T @ p - matrices.hyper, "unsymmetric": mesh.mass.T @ p}


def nodal_forces(mesh: BoundaryMesh, traction) -> np.ndarray:
    x, w = np.polynomial.legendre.leggauss(6)
    forces = np.zeros((2, len(mesh)), complex)
    for q, weight in zip(0.5 * (x + 1.0), 0.5 * w, strict=True):
        places = mesh.points * (1.0 - q) + mesh.points[mesh.after] * q
        load = traction(places, mesh.normals).T * mesh.lengths * weight
        forces += (1.0 - q) * load
        forces[:, mesh.after] += q * load
    return forces.ravel()


def wave_error(mesh: BoundaryMesh, form: str, *, shear: bool = False) -> float:
    wave = exponential(S, shear=shear)
    exact = wave.displacement(mesh.points, 0.0).T.ravel()
    forces = nodal_forces(mesh, lambda x, n: wave.traction(x, n, 0.0))
    found = np.linalg.solve(steklov(mesh, S)[form], forces)
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize(
    "mesh", [polygon(SQUARE, 0.2), circle(0.5, 24), polygon([(0, 0), (1, 0.1), (0.2, 0.8)], 0.2)]
)
def test_symmetry(mesh):
    """B2: V(s), D(s), S_sym(s) are symmetric; so are A and C in time."""
    at_s, time = laplace(mesh, S), in_time(mesh, 0.5)
    for matrix in (at_s.single, at_s.hyper, time.single, time.hyper, steklov(mesh, S)["symmetric"]):
        assert np.abs(matrix - matrix.T).max() < 1e-12 * np.abs(matrix).max()


def test_a_translation_only_accelerates_the_mass():
    """B2: eᵀ S(s) e = s² rho area, in the limit of slow motion (S is a million times greater than
    that)."""
    mesh, s = polygon(SQUARE, 0.2), 1e-3
    matrix = steklov(mesh, s, Orders(touching=20))["symmetric"].real
    for direction in ((1.0, 0.0), (0.6, 0.8)):
        e = np.repeat(direction, len(mesh))
        assert e @ matrix @ e == pytest.approx(s**2, rel=1e-6)


@pytest.mark.parametrize("form", ["symmetric", "unsymmetric"])
@pytest.mark.parametrize(("shear", "coarse"), [(False, 2.6e-2), (True, 1.1e-1)])
def test_plane_waves_in_a_square(form, shear, coarse):
    """B3: displacement under the tractions of a plane wave, Laplace domain; order 2 in the mesh."""
    errors = [wave_error(polygon(SQUARE, 1.0 / k), form, shear=shear) for k in (5, 10)]
    assert errors[0] < coarse and np.log2(errors[0] / errors[1]) > 1.9


def test_plane_waves_in_a_disk():
    """B3: chords of a circle keep order 2."""
    errors = [wave_error(circle(0.5, count), "symmetric") for count in (20, 40)]
    assert errors[0] < 1.5e-2 and np.log2(errors[0] / errors[1]) > 1.9


@pytest.mark.long
def test_source_in_a_hole():
    """B3: outside of a square hole, driven by the tractions of a point force inside it; order 2."""
    errors = []
    for k in (5, 10, 20):
        mesh = polygon(SQUARE[::-1], 1.0 / k, exterior=True)
        exact = source(mesh.points).T.ravel()
        found = np.linalg.solve(steklov(mesh, S)["symmetric"], nodal_forces(mesh, source_traction))
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[0] < 0.16 and errors[2] < 1.2e-2 and np.log2(errors[1] / errors[2]) > 1.9


def source(x: np.ndarray) -> np.ndarray:
    """G e_1 of a point force at (0.1, 0.05)."""
    d = x - np.array([0.1, 0.05])
    r = np.hypot(*d.T)
    g1, g2 = LaplaceKernels(S, MATERIAL.c_p, MATERIAL.c_s)(r).single
    return g1[:, None] * np.array([1.0, 0.0]) - (g2 * d[:, 0] / r**2)[:, None] * d


def source_traction(x: np.ndarray, normals: np.ndarray) -> np.ndarray:
    e = 1e-4
    steps = [source(x + e * axis) - source(x - e * axis) for axis in np.eye(2)]
    return stress_vector(np.stack(steps, axis=-1) / (2.0 * e), normals)


@pytest.mark.parametrize(
    "mesh", [polygon(SQUARE, 0.2), polygon([(0, 0), (1, 0.1), (0.2, 0.8)], 0.2)]
)
@pytest.mark.parametrize("t", [0.13, 0.2, 0.61, 2.5])
@pytest.mark.promise("theory/bem.md", "The error of the quadrature is 3e-5", bound="5e-5")
@pytest.mark.promise("theory/bem.md", "3e-5 on the square with k = 10", bound="5e-5")
@pytest.mark.promise("theory/bem.md", "4e-5 on a triangle", bound="5e-5")
def test_quadrature_split_at_the_fronts(mesh, t):
    """B2: default points against many more, fronts at, inside and past the elements; 5e-5 of the
    greatest entry."""
    few = in_time(mesh, t)
    many = in_time(mesh, t, Orders(far=8, near=12, outer=12, inner=12, touching=24))
    for name in ("single", "double", "hyper"):
        exact = getattr(many, name)
        assert np.abs(getattr(few, name) - exact).max() < 5e-5 * np.abs(exact).max(), name
