"""Solve contact with friction by nonsmooth Gauss-Seidel.

One node is solved after another, each exactly.

Given the reactions of all other nodes, a node is open, or it sticks, or it slips:

    open   r_n = 0, r_t the minimum over |r_t| <= cohesion, if w_n >= 0 then;
           otherwise w_n = 0 gives r_n(r_t) and
    stick  S r_t = -q'          if |r_t| <= limit(r_n(r_t))
    slip   (S + lambda) r_t = -q',   |r_t| = limit(r_n(r_t))
           lambda > 0 by a scalar root (closed form in 2D)

with S and q' the tangential block and right-hand side after the elimination of r_n. Sources: Moreau
(Comput. Methods Appl. Mech. Eng. 177, 1999) and Jean (same volume). Under Tresca's law it is
coordinate descent of a convex function and converges for every G; under Coulomb's it converges in
practice, linearly, for friction that is not large.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask
from .problem import Iterated, PreparedFriction, ScaledDelassus, ScaledProblem, Settings


@dataclass(frozen=True)
class NSGS(Settings):
    """Hold the settings. ``tolerance``: largest residual, that of r = 0 being 1.

    In the result ``iterations`` counts sweeps and ``history`` the residual after each.
    """

    max_iterations: int = 5000

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d)."""
        return PreparedFriction(self, self.tolerance, ScaledDelassus(G, bilateral), self._loop)

    def _loop(self, step: ScaledProblem, r: Array) -> Iterated:
        sweep, history = sweeper(step), list[float]()
        while step.unit > 0.0 and len(history) < self.max_iterations:
            r = sweep(r)
            residual = step.residual(r, step.w(r))
            history.append(residual / step.unit)
            if not np.isfinite(residual) or residual <= max(
                self.tolerance * step.unit, step.rounding(r)
            ):
                break
        return r, len(history), history


def sweeper(step: ScaledProblem) -> Callable[[Array], Array]:
    """Return one sweep: r -> r."""
    d, matrix = step.delassus.dimension, step.delassus.matrix
    nodes = [_Node(step, i) for i in range(step.count)]

    def sweep(r: Array) -> Array:
        flat = r.copy().ravel()
        for i, node in enumerate(nodes):
            rows = slice(i * d, (i + 1) * d)
            flat[rows] = 0.0
            flat[rows] = node.solve(step.q[i] + matrix[rows] @ flat)
        return flat.reshape(r.shape)

    return sweep


class _Node:
    """The problem of one node."""

    def __init__(self, step: ScaledProblem, i: int) -> None:
        d = step.delassus.dimension
        block = step.delassus.matrix[i * d : (i + 1) * d, i * d : (i + 1) * d]
        self.normal, self.coupling, self.tangential = (
            float(block[0, 0]),
            block[0, 1:],
            block[1:, 1:],
        )
        self.pushed = block[1:, 0]  # the coupling, unless G is not symmetric
        self.condensed = self.tangential - np.outer(self.pushed, self.coupling) / self.normal
        self.cohesion, self.slope = float(step.cohesion[i]), float(step.slope[i])
        self.bilateral = bool(step.delassus.bilateral[i])

    def solve(self, q: Array) -> Array:
        """Return the reactions of the node when all others give it q."""
        q_n, q_t = float(q[0]), q[1:]
        if not self.bilateral:
            r_t = on_disk(self.tangential, q_t, lambda r_t: self.cohesion)
            if q_n + self.coupling @ r_t >= 0.0:
                return np.concatenate([[0.0], r_t])

        def pressure(r_t: Array) -> float:
            return float(-(q_n + self.coupling @ r_t) / self.normal)

        r_t = on_disk(
            self.condensed,
            q_t - self.pushed * (q_n / self.normal),
            lambda r_t: self.cohesion + self.slope * max(pressure(r_t), 0.0),
        )
        r_n = pressure(r_t)
        return np.concatenate([[r_n if self.bilateral else max(r_n, 0.0)], r_t])


def on_disk(S: Array, q: Array, limit: Callable[[Array], float]) -> Array:
    """Return r with S r = -q when |r| <= limit(r), and else r on the disk.

    There, (S + lambda) r = -q on |r| = limit(r), lambda > 0.

    S (k, k) symmetric positive definite. r falls from S⁻¹q to 0 as lambda grows; the root of |r| -
    limit is bracketed in s = 1/(1 + lambda/trace S) between 0 and 1. Of any other S the moduli of
    the eigenvalues give r: a start only.
    """
    if len(q) == 0 or not q.any():
        return np.zeros(len(q))
    values, vectors = (np.diag(S), np.eye(1)) if len(q) == 1 else np.linalg.eigh(S)
    values, part, unit = np.abs(values), vectors.T @ q, float(np.sum(np.abs(values)))

    def reaction(s: float) -> Array:
        return np.asarray(vectors @ (-s * part / (s * values + (1.0 - s) * unit)))

    def outside(s: float) -> float:
        r = reaction(s)
        return float(np.linalg.norm(r)) - limit(r)

    if outside(1.0) <= 0.0:
        return reaction(1.0)
    if outside(0.0) >= 0.0:
        return np.zeros(len(q))
    from scipy.optimize import brentq  # late: it takes a while

    root = brentq(outside, 0.0, 1.0, xtol=1e-300, rtol=8.9e-16, maxiter=200, disp=False)
    r = reaction(root)
    size, radius = float(np.linalg.norm(r)), limit(r)
    return r * (radius / size) if size > radius else r
