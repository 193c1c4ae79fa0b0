"""Solve contact with friction by nonsmooth Gauss-Seidel: one node after another, each exactly.

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
from .problem import LastIterate, PreparedFriction, ScaledDelassus, ScaledProblem, Settings


@dataclass(frozen=True)
class NSGS(Settings):
    """Hold the settings of the sweeps.

    In the result ``iterations`` counts sweeps and ``history`` the residual after each.

    Attributes:
        tolerance: the largest residual, that of r = 0 being 1.
        max_iterations: number of sweeps, at most.
    """

    max_iterations: int = 5000

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d); ``bilateral`` (m,) says which rows are bilateral."""
        return PreparedFriction(self, self.tolerance, ScaledDelassus(G, bilateral), self._iterate)

    def _iterate(self, step: ScaledProblem, r: Array) -> LastIterate:
        """Sweep from r until the residual is small, or rounding."""
        sweep = make_sweep(step)
        history: list[float] = []
        while step.unit > 0.0 and len(history) < self.max_iterations:
            r = sweep(r)
            residual = step.residual(r, step.w(r))
            history.append(residual / step.unit)
            goal = max(self.tolerance * step.unit, step.rounding(r))
            if not np.isfinite(residual) or residual <= goal:
                break
        return LastIterate(r, len(history), history)


def make_sweep(step: ScaledProblem) -> Callable[[Array], Array]:
    """Return one sweep over all nodes of a problem: r (m, d) -> r."""
    d = step.delassus.dimension
    nodes = [_Node(step, i) for i in range(step.count)]

    def sweep(r: Array) -> Array:
        """Solve for every node in turn, with the last reactions of all others."""
        flat = r.copy().ravel()
        for i, node in enumerate(nodes):
            rows = slice(i * d, (i + 1) * d)
            flat[rows] = 0.0
            flat[rows] = node.solve(step.q[i] + step.delassus.product_at(i, flat))
        return flat.reshape(r.shape)

    return sweep


class _Node:
    """Solve the problem of one node."""

    def __init__(self, step: ScaledProblem, i: int) -> None:
        """Take the block of node i, and eliminate its normal reaction from the tangential rows."""
        block = step.delassus.block_at(i)
        self.normal = float(block[0, 0])
        self.coupling = block[0, 1:]  # of w_n to r_t
        self.pushed = block[1:, 0]  # of w_t to r_n: the same, unless G is not symmetric
        self.tangential = block[1:, 1:]
        self.condensed = self.tangential - np.outer(self.pushed, self.coupling) / self.normal
        self.cohesion = float(step.cohesion[i])
        self.slope = float(step.slope[i])
        self.bilateral = bool(step.delassus.bilateral[i])

    def solve(self, q: Array) -> Array:
        """Return the reactions (d,) of the node when all others give it q (d,)."""
        q_n = float(q[0])
        q_t = q[1:]

        # Open: without pressure there is cohesion alone, and the gap must not be negative.
        if not self.bilateral:
            r_t = minimise_on_disk(self.tangential, q_t, lambda r_t: self.cohesion)
            if q_n + self.coupling @ r_t >= 0.0:
                return np.concatenate([[0.0], r_t])

        # Closed: w_n = 0 gives the pressure, which limits r_t; it sticks or slips.
        def pressure(r_t: Array) -> float:
            """Return r_n of w_n = 0."""
            return float(-(q_n + self.coupling @ r_t) / self.normal)

        r_t = minimise_on_disk(
            self.condensed,
            q_t - self.pushed * (q_n / self.normal),
            lambda r_t: self.cohesion + self.slope * max(pressure(r_t), 0.0),
        )
        r_n = pressure(r_t)
        if not self.bilateral:
            r_n = max(r_n, 0.0)
        return np.concatenate([[r_n], r_t])


def minimise_on_disk(S: Array, q: Array, limit: Callable[[Array], float]) -> Array:
    """Return r with S r = -q when |r| <= limit(r), and else r on the edge of the disk.

    There, (S + lambda) r = -q on |r| = limit(r), lambda > 0. r falls from S⁻¹q to 0 as lambda
    grows; the root of |r| - limit is bracketed in s = 1/(1 + lambda/trace S) between 0 and 1.

    Args:
        S: (k, k), symmetric positive definite. Of any other S the moduli of the eigenvalues give r:
            a start only.
        q: (k,).
        limit: radius of the disk, which may depend on r.
    """
    if len(q) == 0 or not q.any():
        return np.zeros(len(q))
    if len(q) == 1:
        values = np.diag(S)
        vectors = np.eye(1)
    else:
        values, vectors = np.linalg.eigh(S)
    values = np.abs(values)
    part = vectors.T @ q
    unit = float(np.sum(np.abs(values)))

    def reaction(s: float) -> Array:
        """Return r of (S + lambda) r = -q at s, in the eigenvectors of S."""
        return np.asarray(vectors @ (-s * part / (s * values + (1.0 - s) * unit)))

    def outside(s: float) -> float:
        """Return by how much r is outside its disk."""
        r = reaction(s)
        return float(np.linalg.norm(r)) - limit(r)

    if outside(1.0) <= 0.0:
        return reaction(1.0)
    if outside(0.0) >= 0.0:
        return np.zeros(len(q))
    from scipy.optimize import brentq  # late: it takes a while

    root = brentq(outside, 0.0, 1.0, xtol=1e-300, rtol=8.9e-16, maxiter=200, disp=False)
    r = reaction(root)
    size = float(np.linalg.norm(r))
    radius = limit(r)
    return r * (radius / size) if size > radius else r
