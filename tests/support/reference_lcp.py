"""Ground truth for small complementarity problems: brute force over all sets, and seeded
problems."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array, Mask, max_abs
from vi_contact.solvers.normal.lcp import (
    LCPResult,
    check_gap,
    check_operator,
    compute_scale,
)


@dataclass(frozen=True)
class LCP:
    """The problem w = q + G r, 0 <= r ⊥ w >= 0 (w = 0 in bilateral rows); G an array.

    Raises InputError for shapes that do not match, a NaN or -inf in q, and an infinite q in a
    bilateral row.
    """

    G: Array
    q: Array
    bilateral: Mask

    def __post_init__(self) -> None:
        check_operator(self.G, self.bilateral)
        check_gap(self.q, self.bilateral)

    def w(self, r: Array) -> Array:
        """Gap q + G r (m,)."""
        return np.asarray(self.q + self.G @ r)

    def residual(self, r: Array) -> float:
        """How far r (m,) is from solving it, dimensionless and the same in all units.

        max |min(r_i/d_i, w_i d_i)| over unilateral and max |w_i d_i| over bilateral rows, divided
        by the violation of r = 0 (by max |q_i d_i| when r = 0 is the solution, by max |r_i/d_i|
        when q = 0). 1 is what r = 0 scores, 0 is exact.
        """
        d = self._scale
        q, bilateral = self.q * d, self.bilateral
        reaction = r / d
        violation = _complementarity(np.zeros_like(q), q, bilateral)
        unit = violation or max_abs(q[np.isfinite(q)]) or max_abs(reaction) or 1.0
        return _complementarity(reaction, self.w(r) * d, bilateral) / unit

    @cached_property
    def _scale(self) -> Array:
        return compute_scale(self.G)


def _complementarity(r: Array, w: Array, bilateral: Mask) -> float:
    return max_abs(np.where(bilateral, w, np.minimum(r, w)))


def solve(method: Any, problem: LCP, *, guess: Array | Mask | None = None) -> LCPResult:
    """The answer of a method: ActiveSet or Hildreth."""
    result: LCPResult = method.prepare(problem.G, problem.bilateral).solve(problem.q, guess)
    return result


def enumerate_lcp(G: Array, q: Array, bilateral: Mask) -> Array:
    """The r (m,), m <= 12, of the active set whose signs fit best: no tolerance, no method shared
    with the package.

    Works on rows scaled to unit diagonal; rows with q = +inf are left out.
    """
    d = 1.0 / np.sqrt(np.diag(G))
    reach = np.isfinite(q)
    free = np.flatnonzero(reach & ~bilateral)
    sets = np.zeros((2 ** len(free), q.size), dtype=bool)
    sets[:, bilateral] = True
    sets[:, free] = list(product((False, True), repeat=len(free)))
    scaled, gap = d[:, None] * G * d, np.where(reach, q * d, 0.0)
    systems = np.where(sets[:, :, None], scaled, np.eye(q.size))
    r = np.linalg.solve(systems, np.where(sets, -gap, 0.0)[:, :, None])[:, :, 0]
    signs = np.where(sets, r, gap + r @ scaled)[:, free]
    best = np.argmax(signs.min(axis=1, initial=np.inf))
    return r[best] * d


def spd(rng: np.random.Generator, m: int) -> Array:
    """Random symmetric positive definite (m, m), condition number up to about 1e3."""
    A = rng.normal(size=(m, m + 2))
    return A @ A.T / m + 0.05 * np.eye(m)


def from_solution(rng: np.random.Generator, m: int, *, contact: float, grazing: float) -> LCP:
    """A problem whose solution has about these shares of rows in contact (r > 0) and grazing (r = w
    = 0)."""
    G, side = spd(rng, m), rng.random(m)
    r = np.where(side < contact, rng.random(m) + 0.1, 0.0)
    w = np.where(side >= contact + grazing, rng.random(m) + 0.1, 0.0)
    return LCP(G, w - G @ r, np.zeros(m, dtype=bool))


def generic(rng: np.random.Generator, m: int) -> LCP:
    return LCP(spd(rng, m), rng.normal(size=m), np.zeros(m, dtype=bool))


def degenerate(rng: np.random.Generator, m: int) -> LCP:
    return from_solution(rng, m, contact=0.4, grazing=0.4)


def all_active(rng: np.random.Generator, m: int) -> LCP:
    return from_solution(rng, m, contact=1.0, grazing=0.0)


def none_active(rng: np.random.Generator, m: int) -> LCP:
    return LCP(spd(rng, m), rng.random(m), np.zeros(m, dtype=bool))


def ill_scaled(rng: np.random.Generator, m: int) -> LCP:
    """Every row in a unit of its own: G_ii from 1e-12 to 1e12."""
    problem, units = mixed(rng, m), 10.0 ** rng.uniform(-6.0, 6.0, size=m)
    return LCP(units[:, None] * problem.G * units, problem.q * units, problem.bilateral)


def with_bilateral(rng: np.random.Generator, m: int) -> LCP:
    problem = generic(rng, m)
    return LCP(problem.G, problem.q, rng.random(m) < 0.4)


def out_of_reach(rng: np.random.Generator, m: int) -> LCP:
    problem = generic(rng, m)
    return LCP(problem.G, np.where(rng.random(m) < 0.4, np.inf, problem.q), problem.bilateral)


def mixed(rng: np.random.Generator, m: int) -> LCP:
    problem = degenerate(rng, m)
    bilateral = rng.random(m) < 0.3
    return LCP(
        problem.G, np.where(~bilateral & (rng.random(m) < 0.2), np.inf, problem.q), bilateral
    )


KINDS = (
    generic,
    degenerate,
    all_active,
    none_active,
    ill_scaled,
    with_bilateral,
    out_of_reach,
    mixed,
)


def problems(kind_index: int, count: int = 25) -> list[LCP]:
    """``count`` problems of one kind, m = 1…12, always the same."""
    rng = np.random.default_rng(kind_index)
    return [KINDS[kind_index](rng, 1 + i % 12) for i in range(count)]


def solutions(G: Array, q: Array) -> list[Array]:
    """All solutions with regular sets, by enumeration of the 2^m sets."""
    m, found = len(q), []
    for bits in product((False, True), repeat=len(q)):
        a, r = np.array(bits), np.zeros(m)
        if abs(np.linalg.det(G[np.ix_(a, a)])) > 1e-12:
            r[a] = np.linalg.solve(G[np.ix_(a, a)], -q[a])
            if (
                r.min() >= -1e-12
                and (q + G @ r).min() >= -1e-12
                and not any(np.allclose(r, one) for one in found)
            ):
                found.append(r)
    return found


def minors(G: Array) -> float:
    """The smallest principal minor."""
    sets = (np.flatnonzero(bits) for bits in product((False, True), repeat=len(G)))
    return min(float(np.linalg.det(G[np.ix_(a, a)])) for a in sets if len(a))
