"""Thin and sharp bodies: integrals of elements that nearly meet, a thin rod, positivity, what is
refused."""

from __future__ import annotations

import numpy as np
import pytest
from boundary_matrices import in_time
from convolution_operator import convolution_operator
from plane_waves import MATERIAL, SQUARE
from thin_slab import H, slab

from demos.parts.problems.interior import interior_displacement
from vi_contact.bem import (
    BoundaryMesh,
    BoundaryProblem,
    Orders,
    PoincareSteklov,
    circle,
    energetic_blocks,
    polygon,
    traction_forces,
)
from vi_contact.bem.element_pairs import ElementPairs
from vi_contact.bem.energetic import march_blocks
from vi_contact.bem.quadrature import point_sets
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
MANY = Orders(far=8, near=12, outer=12, inner=12, touching=24, close=20)


def wedge(height: float) -> BoundaryMesh:
    return polygon([(0.0, 0.0), (1.0, 0.0), (1.0, height)], H)


SHAPES = {
    "slab of h/20": slab(H / 20),
    "no node faces another": polygon(
        [(-0.01, -0.5), (0.01, -0.5), (0.01, 0.5), (-0.01, 0.5)], (1, 9, 1, 7)
    ),
    "7 degrees": wedge(0.12),
    "3 degrees": wedge(0.06),
    "crack": polygon(
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (0.03, 0.5), (0.0, 0.0), (-0.03, 0.5), (-0.5, 0.5)],
        H,
    ),
    "slot": polygon([(-0.01, -0.5), (-0.01, 0.5), (0.01, 0.5), (0.01, -0.5)], H, exterior=True),
    "short among long": polygon(
        [(-0.5, -0.5), (-0.00625, -0.5), (0, -0.5), (0.5, -0.5), (0, 0.5)], (4, 1, 4, 9, 9)
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_points_of_thin_bodies(name):
    """B2: default points against many more, fronts at, inside and past the elements; 5e-5 of the
    greatest entry."""
    for t in (0.0063, 0.125, 0.375, 2.5):
        found, exact = in_time(SHAPES[name], t), in_time(SHAPES[name], t, MANY)
        for kind in ("single", "double", "hyper"):
            size = np.abs(getattr(exact, kind)).max()
            assert np.abs(getattr(found, kind) - getattr(exact, kind)).max() < 5e-5 * size, (
                kind,
                t,
            )


@pytest.mark.parametrize("fronts", [(), (0.05, 0.1)])
def test_elements_that_face_each_other(fronts):
    """Peaks log r, d/r² and a kink at each front over a slab and its neighbours, against 900 x 900
    plain points."""
    pairs = ElementPairs(slab(H / 20))
    close = np.flatnonzero(pairs.close & ~pairs.corner)
    total = np.zeros((3, len(pairs), 4))
    for points in point_sets(pairs, fronts):
        total[:, points.pairs] += points.integrate(peaks(points.d, fronts))
    x, w = np.polynomial.legendre.leggauss(3)
    fine = (np.arange(300)[:, None] + 0.5 * (x + 1.0)).ravel() / 300
    weight = np.tile(0.5 * w, 300) / 300
    for pair in close[:6]:
        d = (
            pairs.offset[:, pair, None, None]
            + pairs.a[:, pair, None, None] * fine[:, None]
            - pairs.b[:, pair, None, None] * fine
        )
        shapes = np.stack([1.0 - fine, fine]) * weight
        plain = np.einsum("ax,kxy,by->kab", shapes, peaks(d, fronts), shapes).reshape(3, 4)
        assert (
            np.abs(total[:, pair] - plain).max()
            < (1e-6 if not fronts else 2e-4) * np.abs(plain).max()
        )


def peaks(d: np.ndarray, fronts: tuple[float, ...]) -> np.ndarray:
    """(3, ...) integrands with the singularities of the kernels, zero beyond the greatest front."""
    r = np.hypot(*d)
    kinks = sum(
        (np.sqrt(np.maximum(front**2 - r**2, 0.0)) for front in fronts), start=np.ones_like(r)
    )
    reached = r < max(fronts, default=np.inf)
    return np.stack([np.log(r), d[0] / r**2 * 0.01, kinks]) * reached


def pulled(mesh: BoundaryMesh, dt: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Loads of the top, (sin pi t/2)² until t = 2, and rollers at the sides on a fixed base: the
    rod of c = 1."""
    fixed = np.stack([mesh.nodes_of(np.isin(mesh.labels, (1, 3))), mesh.nodes_of(mesh.labels == 0)])
    top = mesh.labels == 2
    return traction_forces(
        mesh, lambda x, n, t: n * load(t), dt=dt, steps=steps, elements=top
    ), fixed


def load(t: float) -> float:
    return float(np.sin(0.5 * np.pi * t) ** 2) if t < 2.0 else 0.0


def exact_top(t: np.ndarray) -> np.ndarray:
    def way(s: np.ndarray) -> np.ndarray:
        return np.where(
            s <= 0.0, 0.0, np.where(s < 2.0, 0.5 * s - np.sin(np.pi * s) / (2.0 * np.pi), 1.0)
        )

    return way(t) - 2.0 * way(t - 2.0)


def error(displacement: np.ndarray, times: np.ndarray, mesh: BoundaryMesh) -> float:
    top = displacement[:, 1][:, mesh.nodes_of(mesh.labels == 2)]
    exact = exact_top(times)[:, None]
    return float(np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape)))


@pytest.mark.long
@pytest.mark.parametrize("share", [5, 20])
def test_thin_rod(share):
    """A rod of h/5 and h/20 between rollers against the exact one: the error is that of the time
    step, of first order; the ledger never goes below zero. Inside, halfway between the sides, it
    moves as they do."""
    h, errors = 0.25, []
    mesh = slab(h / share, h)
    for dt in (h / 2, h / 4):
        steps = round(3.0 / dt)
        forces, fixed = pulled(mesh, dt, steps)
        operator = PoincareSteklov(energetic_blocks(mesh, MATERIAL, dt=dt, steps=steps), 1.0)
        motion = BoundaryProblem(operator, forces, fixed).solve()
        errors.append(error(motion.displacement, motion.times, mesh))
        assert motion.work.min() > 0.0
    assert errors[1] < 0.12 and errors[1] < 0.6 * errors[0]
    inside = interior_displacement(operator, motion, [(0.0, 0.25)], steps=[15, 47])[:, 0, 1]
    sides = np.flatnonzero(np.isclose(mesh.points[:, 1], 0.25))
    assert inside == pytest.approx(
        motion.displacement[[15, 47]][:, 1, sides].mean(axis=1), abs=0.01
    )


@pytest.mark.parametrize("ratio", [1.0, 0.1])
def test_thin_rod_by_convolution_quadrature(ratio):
    """The same rod of h/20 with Radau IIA: 2 % off the exact one, with small steps too."""
    h = 0.2
    mesh, dt, steps = slab(h / 20, h), h * ratio, round(1.2 / (h * ratio))
    operator = convolution_operator(mesh, MATERIAL, dt=dt, steps=steps)
    forces = operator.frequencies.substep_means(lambda dt, steps: pulled(mesh, dt, steps)[0])
    motion = BoundaryProblem(operator, forces, pulled(mesh, dt, 1)[1]).solve()
    assert error(motion.displacement, motion.times, mesh) < 0.02


@pytest.mark.parametrize("name", ["slab of h/20", "7 degrees", "3 degrees"])
def test_symmetric_form_is_positive_on_thin_bodies(name):
    """B6: the smallest eigenvalue of the symmetric part of the space-time S, 6 steps, is above
    zero."""
    mesh, steps = SHAPES[name], 6
    n = 2 * len(mesh)
    blocks = energetic_blocks(mesh, MATERIAL, dt=H, steps=steps)
    held = np.broadcast_to(np.eye(n), (steps, n, n))
    columns = march_blocks(blocks, np.ones(n, bool), np.zeros((steps, n, n)), held)[2]
    whole = np.zeros((steps, n, steps, n))
    for k in range(steps):
        for j in range(k + 1):
            whole[k, :, j] = columns[k - j]
    matrix = whole.reshape(steps * n, steps * n)
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0] > 1e-4


def test_ordinary_bodies_keep_their_points():
    """Nothing is close on squares, disks and notches, so that their matrices stay what they
    were."""
    notched = [(-3, -4), (3, -4), (3, 0), (1, 0), (1, -2), (-1, -2), (-1, 0), (-3, 0)]
    for mesh in (
        polygon(SQUARE, 0.2),
        circle(0.5, 40),
        circle(0.5, 24, exterior=True),
        polygon(notched, 0.5),
    ):
        assert not ElementPairs(mesh).close.any()


@pytest.mark.parametrize(
    ("mesh", "words"),
    [
        (
            slab(H / 21),
            r"comes near itself at \(-0\.00297619, .* 1/20 of the 0\.125 m .* at most 0\.119 m",
        ),
        (wedge(0.04), "comes near itself .* widen the angle"),
        (
            polygon([(0, 0), (1, 0), (1, 0.04)], (1, 1, 1)),
            r"sharp or uneven corner at \(1, 0\.04\).* more equal",
        ),
        (
            polygon(SQUARE, (50, 50, 2, 2)),
            "elements .* are 0.02 m apart, less than 1/20 of the 0.5 m",
        ),
    ],
)
def test_what_is_too_thin(mesh, words):
    with pytest.raises(InputError, match=words):
        energetic_blocks(mesh, MATERIAL, dt=H, steps=1)
