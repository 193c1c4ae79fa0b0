"""Small random problems against the enumeration of all their states: every method finds a solution,
or none is right.

Entries are small whole numbers, in units that differ from row to row, so that zeros, ties and
parallel rows occur."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from fuzz import Fuzz

from vi_contact.core.algebra import Array
from vi_contact.solvers import NSGS, ActiveSet, FixedPoint, FrictionNewton, Hildreth, Lemke

st = pytest.importorskip("hypothesis.strategies")

pytestmark = pytest.mark.serial
NORMAL = (ActiveSet(), Hildreth(), Lemke())
FRICTION = (FrictionNewton(), NSGS(), FixedPoint())
# of the largest entry: methods stop at 1e-10 or below, and condition numbers are below 1e3
SAME = 1e-7
ZERO = 1e-9  # of the same: what enumeration takes for zero
ENTRY = st.integers(-3, 3)


def operator(entries: list[int], rows: int) -> Array:
    """BᵀB + 1/2, so that condition numbers stay below 2 rows * 9 * rows + 1."""
    B = np.resize(np.asarray([*entries, 1], dtype=float), (rows, rows))
    return np.asarray(B.T @ B + 0.5 * np.eye(rows))


def complementary(G: Array, q: Array, bilateral: Array) -> Array:
    """The one solution of w = q + G r, 0 <= r, w >= 0, r w = 0 (bilateral: w = 0): all active sets
    are tried."""
    size = max(float(np.abs(q).max()), 1e-300)
    for states in product((False, True), repeat=len(q)):
        active = np.array(states) | bilateral
        r = np.zeros(len(q))
        r[active] = np.linalg.solve(G[np.ix_(active, active)], -q[active])
        w = q + G @ r
        w[active] = 0.0
        if np.all(r[~bilateral] >= -ZERO * size) and np.all(w >= -ZERO * size):
            return r
    raise AssertionError("no active set solves the problem")


@pytest.mark.long
@Fuzz("lcp", __file__).property(
    entries=st.lists(ENTRY, min_size=1, max_size=25),
    gaps=st.lists(ENTRY, min_size=1, max_size=5),
    held=st.integers(0, 31),
    units=st.lists(st.integers(-6, 6), min_size=5, max_size=5),
    examples=150,
)
def test_every_normal_method_finds_the_solution(
    entries: list[int], gaps: list[int], held: int, units: list[int]
) -> None:
    m = len(gaps)
    G, q = operator(entries, m), np.asarray(gaps, dtype=float)
    bilateral = np.array([bool(held >> i & 1) and i % 2 == 1 for i in range(m)])
    exact, unit = complementary(G, q, bilateral), 10.0 ** np.asarray(units[:m], dtype=float)
    scale = max(float(np.abs(exact).max()), 1e-300)
    for method in NORMAL:
        found = method.prepare(unit[:, None] * G * unit, bilateral).solve(q * unit)
        assert np.all(found.r[~bilateral] >= 0.0), method
        assert np.abs(found.r * unit - exact).max() <= SAME * scale, method


def rubbing(G: Array, q: Array, mu: float) -> list[Array]:
    """All solutions r (m, 2) with friction in the plane: every point open, sticking, or sliding one
    way."""
    m, size, found = len(q), max(float(np.abs(q).max()), 1e-300), []
    for states in product(("open", "stick", -1.0, 1.0), repeat=m):
        # unknowns (r_n, r_t) of every point: two rows of equations each
        rows, right = np.zeros((2 * m, 2 * m)), np.zeros(2 * m)
        for i, state in enumerate(states):
            n, t = 2 * i, 2 * i + 1
            if state == "open":
                rows[n, n] = rows[t, t] = 1.0
                continue
            rows[n], right[n] = G[n], -q[i, 0]
            if state == "stick":
                rows[t], right[t] = G[t], -q[i, 1]
            else:  # r_t = -state mu r_n where the point slides along state
                rows[t, t], rows[t, n] = 1.0, state * mu
        if abs(np.linalg.det(rows)) < 1e-12:
            continue
        r = np.linalg.solve(rows, right)
        w, r = (q.ravel() + G @ r).reshape(m, 2), r.reshape(m, 2)
        small = ZERO * size
        good = bool(
            np.all(r[:, 0] >= -small)
            and np.all(w[:, 0] >= -small)
            and np.all(np.abs(r[:, 1]) <= mu * np.maximum(r[:, 0], 0.0) + small)
        )
        slides = [
            state * w[i, 1] >= -small
            for i, state in enumerate(states)
            if not isinstance(state, str)
        ]
        if good and all(slides):
            found.append(r)
    return found


@pytest.mark.long
@Fuzz("friction", __file__).property(
    entries=st.lists(ENTRY, min_size=1, max_size=16),
    places=st.lists(ENTRY, min_size=4, max_size=4),
    points=st.integers(1, 2),
    mu=st.integers(1, 4),
    examples=150,
)
def test_every_friction_method_finds_a_solution(
    entries: list[int], places: list[int], points: int, mu: int
) -> None:
    """mu up to 0.2, where the problem has one solution that all methods reach."""
    G, q = (
        operator(entries, 2 * points),
        np.asarray(places[: 2 * points], dtype=float).reshape(points, 2),
    )
    exact, bilateral = rubbing(G, q, 0.05 * mu), np.zeros(points, dtype=bool)
    assert exact
    scale = max(max(float(np.abs(one).max()) for one in exact), 1e-300)
    for method in FRICTION:
        prepared: Any = method.prepare(G, bilateral)
        found = prepared.solve(q, np.zeros(points), np.full(points, 0.05 * mu)).r
        assert min(float(np.abs(found - one).max()) for one in exact) <= SAME * scale, method
