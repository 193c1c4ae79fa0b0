"""Laws of yielding where their surfaces have corners: edges, tips, principal values that are one,
steps from a tenth to a thousand times the strain at yield, to and fro."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vi_contact.laws import J2, DruckerPrager, Iwan, MohrCoulomb
from vi_contact.laws.mandel import to_vectors

pytestmark = pytest.mark.serial
E = 2e8
CURVE = [(1e-5, 0.95), (1e-4, 0.7), (1e-3, 0.3), (1e-2, 0.08)]
LAWS: dict[str, Any] = {
    "J2": J2(E, 0.3, 2000.0, 1e5, 1e6, 2e6),
    "J2 without hardening": J2(E, 0.3, 2000.0, 1e5),
    "cone": DruckerPrager(E, 0.3, 2000.0, 1e4, 30.0, 10.0),
    "cone without dilatancy": DruckerPrager(E, 0.3, 2000.0, 1e4, 30.0, 0.0),
    "pyramid": MohrCoulomb(E, 0.3, 2000.0, 1e4, 30.0, 10.0),
    "pyramid without dilatancy": MohrCoulomb(E, 0.3, 2000.0, 1e4, 30.0, 0.0),
    "Tresca": MohrCoulomb(E, 0.3, 2000.0, 1e4, 0.0, 0.0),
    "Iwan": Iwan(E, 0.3, 2000.0, CURVE),
}
PRINCIPAL = (
    (1.0, 1.0, -2.0),
    (2.0, -1.0, -1.0),
    (1.0, 1.0, 1.0),
    (-1.0, -1.0, -1.0),
    (1.0, 0.0, -1.0),
    (0.0, 0.0, -1.0),
    (1.0, 1.0, 1.0 + 1e-7),
    (1.0, -1.0, -1.0 - 1e-10),
    (-3.0, -1.0, -1.0),
    (1e-9, 0.0, 0.0),
    (0.0, 0.0, 0.0),
)
SIZES = (2e-5, 2e-4, 2e-3, 0.2)
TURNS = 4
PRESS = len(SIZES) * TURNS * PRINCIPAL.index((0.0, 0.0, -1.0))
BETWEEN_THREE = {PRESS + len(SIZES) * turn + SIZES.index(2e-4) for turn in range(TURNS)}


def make_ways(n: int) -> np.ndarray:
    """Strain increments (q, n) of these principal values, along the axes and turned."""
    rng = np.random.default_rng(3)
    tensors = []
    for values in PRINCIPAL:
        for turn in range(TURNS):
            Q = np.eye(3)
            if turn and n == 6:
                Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
            elif turn:
                a = rng.uniform(0.0, np.pi)
                Q[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
            for size in SIZES:
                tensors.append(size * Q @ np.diag(values) @ Q.T)
    return to_vectors(np.array(tensors), n)


@pytest.mark.parametrize("n", [4, 6])
@pytest.mark.parametrize("name", LAWS)
def test_corners_of_the_surface(name: str, n: int) -> None:
    """The equations of the law and the balance of energy to round-off, D >= 0, and the tangent is
    the derivative of the stress on one side at least, by differences of 1e-10: some of these ends
    are just between two pieces of the surface. Between three, where neither side need be its own,
    ends Tresca on the way back from the press (0, 0, -1) of 2e-4 alone, in all turns of it."""
    law = LAWS[name]
    ways = make_ways(n)
    rng = np.random.default_rng(5)
    state = law.start(np.zeros((len(ways), n)))
    for turn in range(4):
        way = (-1.0) ** turn * (1.0 + 0.3 * turn) * ways
        new, D = law.stress(way, state)
        stress = float(np.abs(new["sigma"]).max())
        assert law.f(new).max() <= 1e-13 * stress
        assert law.residual(way, state, new, (stress, stress / E)).max() <= 1e-11
        lost = law.dissipation(way, state, new)
        assert lost.min() >= 0.0
        work = np.sum(new["sigma"] * way, axis=1)
        rest = law.stored(new) - law.stored(state) + lost + law.remainder(state, new)
        assert np.abs(work - rest).max() <= 1e-13 * np.abs(work).max()

        step = 1e-10 * (1.0 + np.abs(way).max(axis=1))[:, None] * rng.standard_normal(way.shape)
        ahead, _ = law.stress(way + step, state, tangent=False)
        behind, _ = law.stress(way - step, state, tangent=False)
        exact = np.einsum("qij,qj->qi", D, step)
        size = E * np.linalg.norm(step, axis=1)
        forwards = np.linalg.norm(ahead["sigma"] - new["sigma"] - exact, axis=1) / size
        backwards = np.linalg.norm(new["sigma"] - behind["sigma"] - exact, axis=1) / size
        error = np.minimum(forwards, backwards)
        missed = set(np.flatnonzero(error > 1e-3).tolist())
        assert missed <= (BETWEEN_THREE if name == "Tresca" and turn == 1 else set()), missed
        state = new
