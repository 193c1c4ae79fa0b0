"""Beam and rod elements against closed forms: tip deflection, thin limit, frequencies, and what the
source's last rotation function does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh, spsolve

from vi_contact.beam.elements import Elements, beam_matrices, rod_matrices
from vi_contact.beam.published import published_elements
from vi_contact.beam.values import Rod, TimoshenkoBeam
from vi_contact.core.algebra import Array

pytestmark = pytest.mark.serial
SLENDER = (1.0, 10.0, 1e2, 1e3, 1e4)  # length over depth
SEED = TimoshenkoBeam()


def rectangular(slenderness: float) -> TimoshenkoBeam:
    """A beam of length 1 and rectangular section, E = 1, nu = 1/4."""
    depth = 1.0 / slenderness
    return TimoshenkoBeam(1.0, 1.0, depth, depth**3 / 12.0, 1.0, 0.4, 5.0 / 6.0)


def tip(beam: TimoshenkoBeam, elements: Elements) -> float:
    """Deflection of the tip under a unit force."""
    force = np.zeros(2 * elements.count)
    force[-1] = 1.0
    return float(spsolve(beam_matrices(beam, elements)[1].tocsc(), force)[-1])


def bending(beam: TimoshenkoBeam) -> float:
    """l³/(3 E I)."""
    return beam.length**3 / (3.0 * beam.bending_stiffness)


def shear(beam: TimoshenkoBeam) -> float:
    """l/(K A G)."""
    return beam.length / beam.shear_stiffness


@pytest.mark.parametrize("slenderness", SLENDER)
def test_one_point_for_the_shear_energy_does_not_lock(slenderness: float) -> None:
    """The tip deflection is l/KAG + l³/3EI (1 - 1/(4 n²)), for any slenderness, to round-off: the
    condition of S grows with its square."""
    beam = rectangular(slenderness)
    for n in (2, 5, 10, 40):
        expected = shear(beam) + bending(beam) * (1.0 - 0.25 / n**2)
        assert tip(beam, Elements(n)) == pytest.approx(expected, rel=1e-10 + 4e-13 * slenderness**2)


@pytest.mark.parametrize("slenderness", SLENDER)
def test_exact_integration_locks(slenderness: float) -> None:
    """The element of the source: bending stiffness too large by the factor 1 + KAG h²/(12 EI)."""
    beam = rectangular(slenderness)
    for n in (5, 40):
        locked = 1.0 + beam.shear_stiffness / (12.0 * beam.bending_stiffness * n**2)
        reached = tip(beam, Elements(n, reduced_shear=False))
        assert reached < shear(beam) + 1.02 * bending(beam) / locked
        if slenderness >= 100.0 and n == 5:
            assert reached < 0.01 * bending(beam)


def test_exact_integration_converges() -> None:
    """With order 2, from below, once h is small beside the depth; the seed's beam has depth
    sqrt(12)."""
    errors = [
        1.0 - tip(SEED, Elements(n, reduced_shear=False)) / (bending(SEED) + shear(SEED))
        for n in (50, 100, 200)
    ]
    assert errors[0] < 1e-3 and np.diff(np.log2(errors)) == pytest.approx([-2.0, -2.0], abs=0.01)


def frequencies(beam: TimoshenkoBeam, *, end: str, count: int = 3) -> Array:
    """Angular frequencies [rad/s] of the clamped beam whose tip is free, or "guided": free to
    slide, not to turn."""
    KAG, EI, rho = beam.shear_stiffness, beam.bending_stiffness, beam.rho
    # what vanishes at the tip, of (u, theta, shear force, moment)
    free = {"free": (2, 3), "guided": (2, 1)}[end]

    def condition(omega: float) -> float:
        squared = rho * omega**2
        A = np.array(
            [
                [0.0, 1.0, 1.0 / KAG, 0.0],
                [0.0, 0.0, 0.0, 1.0 / EI],
                [-beam.area * squared, 0.0, 0.0, 0.0],
                [0.0, -beam.inertia * squared, -1.0, 0.0],
            ]
        )
        return float(np.linalg.det(expm(A * beam.length)[np.ix_(free, (2, 3))]))

    grid = np.linspace(1e-3, 15.0, 400)
    values = np.array([condition(omega) for omega in grid])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0.0)[:count]
    return np.array([brentq(condition, grid[i], grid[i + 1], xtol=1e-13) for i in changes])


def discrete(beam: TimoshenkoBeam, elements: Elements, count: int = 3) -> Array:
    """The lowest of the finite elements."""
    M, S, _ = beam_matrices(beam, elements)
    return np.sqrt(np.sort(eigsh(S, count, M, sigma=0.0, return_eigenvectors=False)))


def test_frequencies() -> None:
    """Of the seed's beam, with order 2; mass and stiffness are symmetric, M is positive
    definite."""
    exact = frequencies(SEED, end="free")
    coarse, fine = (discrete(SEED, Elements(n)) / exact - 1.0 for n in (50, 100))
    assert np.all(np.abs(fine) < 3e-4) and coarse / fine == pytest.approx(4.0, rel=0.02)
    M, S, load = beam_matrices(SEED, Elements(10))
    for matrix in (M.toarray(), S.toarray()):
        assert np.array_equal(matrix, matrix.T) and np.linalg.eigvalsh(matrix)[0] > 0.0
    # half an element's share is on the clamp
    assert load.sum() == pytest.approx(SEED.length * 19.0 / 20.0)


def test_the_published_end_clamps_the_rotation() -> None:
    """Section 7's last basis function: h -> 0 gives a tip that cannot turn, tip deflection l³/12EI
    + l/KAG and the frequencies of the clamped-guided beam, first order; the free tip's are l³/3EI +
    l/KAG and 32 % lower."""
    guided = SEED.length**3 / (12.0 * SEED.bending_stiffness) + shear(SEED)
    errors = [tip(SEED, published_elements(n)) / guided - 1.0 for n in (1000, 2000, 4000)]
    assert 0.0 < errors[2] < 0.005 and np.diff(np.log2(errors)) == pytest.approx(
        [-1.0, -1.0], abs=0.01
    )
    exact = frequencies(SEED, end="guided")
    away = [discrete(SEED, published_elements(n)) / exact - 1.0 for n in (500, 1000)]
    assert np.all(np.abs(away[1]) < 6e-3) and away[0] / away[1] == pytest.approx(2.0, rel=0.02)
    assert exact[0] / frequencies(SEED, end="free")[0] == pytest.approx(1.4687, abs=1e-4)
    h = SEED.length / 50
    stiffness = beam_matrices(SEED, published_elements(50))[1].toarray()[:50, :50]
    last = SEED.bending_stiffness / h * np.array([[1.0, -1.0], [-1.0, 17.0 / 15.0]])
    assert last[0, 0] - last[0, 1] ** 2 / last[1, 1] == pytest.approx(
        2.0 * SEED.bending_stiffness / (17.0 * h)
    )
    assert stiffness[-2, -1] == pytest.approx(last[0, 1], rel=0.01) and stiffness[
        -1, -1
    ] == pytest.approx(last[1, 1], rel=0.01)


def test_rod() -> None:
    """Exact at the nodes under end and distributed force; total mass."""
    rod, n = Rod(length=2.0, rho=3.0, area=0.5, E=8.0), 5
    M, K, uniform = rod_matrices(rod, n)
    x = Elements(n).nodes(rod.length)
    end = np.zeros(n)
    end[-1] = 1.0
    assert spsolve(K.tocsc(), end) == pytest.approx(x / 4.0)
    assert spsolve(K.tocsc(), uniform) == pytest.approx(x * (4.0 - x) / 8.0)
    assert np.ones(n) @ M @ np.ones(n) == pytest.approx(3.0 * (1.0 - 2.0 / (3.0 * n)))
