"""The buried channel of V4.2 once more, by a program of its own: nothing of vi_contact is used.

Bilinear squares on plain arrays, absolute displacements of both bodies, gaps as rows of a matrix G
(G u = opening), u1 = A⁻¹(b + Gᵀ p) with the reactions p >= 0 of a non-negative least squares
problem (Lawson and Hanson). SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.sparse.linalg import splu

WIDTH, DEPTH, H = 24.0, 8.0, 0.5
LEFT, RIGHT, BOTTOM, WALL = 10.0, 14.0, 5.0, 0.5
SOIL, CONCRETE = (1.0e8, 0.3, 1800.0), (2.0e10, 0.2, 2400.0)
GRAVITY = 9.80665


def square(E: float, nu: float, rho: float) -> tuple[Any, Any]:
    """(K, M) of a square of side H in plane strain, corners anticlockwise, x and y of each."""
    lame, shear = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    D = np.array([[lame + 2 * shear, lame, 0], [lame, lame + 2 * shear, 0], [0, 0, shear]])
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    K, M = np.zeros((8, 8)), np.zeros((8, 8))
    for s in np.array([(x, y) for x in (-1, 1) for y in (-1, 1)]) / np.sqrt(3):
        N = np.prod(1 + corners * s, axis=1) / 4
        dN = corners * (1 + (corners * s)[:, ::-1]) / 4 * (2 / H)
        B = np.zeros((3, 8))
        B[0, ::2], B[1, 1::2], B[2, ::2], B[2, 1::2] = dN[:, 0], dN[:, 1], dN[:, 1], dN[:, 0]
        shape = np.kron(N, np.eye(2))
        K += B.T @ D @ B * (H / 2) ** 2
        M += rho * shape.T @ shape * (H / 2) ** 2
    return K, M


@dataclass(frozen=True)
class Bodies:
    """Matrices on the free unknowns; x, y: place -> unknown of a body's node; opening rows G; M r
    and weight."""

    K: Any
    M: Any
    G: Any
    inertia: Any
    weight: Any
    number: dict[tuple[str, float, float], int]
    free: Any


@cache
def bodies() -> Bodies:
    number: dict[tuple[str, float, float], int] = {}
    entries = []
    for i in range(round(WIDTH / H)):
        for j in range(round(DEPTH / H)):
            x, y = i * H, j * H
            notch = LEFT <= x < RIGHT and y >= BOTTOM
            if notch and LEFT + WALL <= x < RIGHT - WALL and y >= BOTTOM + WALL:
                continue
            body = "channel" if notch else "soil"
            around = [(x, y), (x + H, y), (x + H, y + H), (x, y + H)]
            nodes = [number.setdefault((body, *place), len(number)) for place in around]
            entries.append((body, np.array([2 * node + c for node in nodes for c in (0, 1)])))
    size = 2 * len(number)
    squares = {"channel": square(*CONCRETE), "soil": square(*SOIL)}
    rows = np.concatenate([np.repeat(own, 8) for _, own in entries])
    columns = np.concatenate([np.tile(own, 8) for _, own in entries])
    values = [np.concatenate([squares[body][i].ravel() for body, _ in entries]) for i in (0, 1)]
    K, M = (sp.csc_matrix((each, (rows, columns)), (size, size)) for each in values)
    weight = np.zeros(size)
    for body, own in entries:
        if body == "channel":
            weight[own] -= GRAVITY * squares[body][1] @ np.tile((0.0, 1.0), 4)
    held = np.zeros(size, dtype=bool)
    for (_, x, y), node in number.items():
        held[2 * node : 2 * node + 2] |= y == 0.0
        held[2 * node + 1] |= x in (0.0, WIDTH)
    free, shake = ~held, M @ np.tile((1.0, 0.0), len(number))
    G = openings(number, size)
    return Bodies(
        K[free][:, free], M[free][:, free], G[:, free], shake[free], weight[free], number, free
    )


def openings(number: dict[tuple[str, float, float], int], size: int) -> Any:
    """Rows of G: base, left wall, right wall, each along its coordinate."""
    heights = np.arange(BOTTOM, DEPTH + H / 2, H)
    places = [(x, BOTTOM, (0, 1)) for x in np.arange(LEFT, RIGHT + H / 2, H)]
    places += [(LEFT, y, (1, 0)) for y in heights] + [(RIGHT, y, (-1, 0)) for y in heights]
    G = np.zeros((len(places), size))
    for row, (x, y, inward) in zip(G, places, strict=True):
        for body, sign in (("channel", 1.0), ("soil", -1.0)):
            node = number[body, float(x), float(y)]
            row[2 * node : 2 * node + 2] += sign * np.array(inward)
    return G


def at_rest() -> Any:
    """u under the channel's weight: rows of G with negative reactions are let go, those with
    openings < 0 closed."""
    b = bodies()
    closed, size = np.ones(len(b.G), dtype=bool), float(abs(b.K).max())
    for _ in range(50):
        Ga = sp.csr_matrix(size * b.G[closed])  # of the size of K, for the pivots
        matrix = sp.bmat([[b.K, -Ga.T], [Ga, None]], format="csc")
        found = splu(matrix).solve(np.concatenate([b.weight, np.zeros(closed.sum())]))
        u, p = found[: b.K.shape[0]], np.zeros(len(closed))
        p[closed] = size * found[b.K.shape[0] :]
        wrong = (closed & (p < 0.0)) | (~closed & (b.G @ u < 0.0))
        if not wrong.any():
            return u
        closed ^= wrong
    raise AssertionError("no contact set in equilibrium")


def run(steps: int, *, amplitude: float = 2.0, dt: float = 1.0 / 80.0) -> tuple[Any, Any]:
    """(openings (steps + 1, 23), u_x and u_y of the channel's bottom corners (steps + 1, 4)) from
    rest on."""
    b = bodies()
    A = splu((b.K + 4.0 / dt**2 * b.M).tocsc())
    mass = splu(b.M.tocsc())
    flexibility = b.G @ A.solve(np.ascontiguousarray(b.G.T))
    impulses = mass.solve(np.ascontiguousarray(b.G.T))
    delassus = b.G @ impulses
    L = cholesky(0.5 * (flexibility + flexibility.T), lower=True)
    index = np.cumsum(b.free) - 1
    corners = [index[2 * b.number["channel", x, BOTTOM] + c] for x in (LEFT, RIGHT) for c in (0, 1)]
    u, v = at_rest(), np.zeros(b.K.shape[0])
    gaps, points = [b.G @ u], [u[corners]]
    for k in range(steps):
        a_g = amplitude * np.sin(2.0 * np.pi * 2.0 * (k + 0.5) * dt)
        load = b.weight - b.inertia * a_g
        rhs = 2.0 * load + b.M @ (4.0 / dt**2 * (u + dt * v)) - b.K @ u
        free = A.solve(rhs)
        p, _ = nnls(L.T, -solve_triangular(L, b.G @ free, lower=True))
        new = free + A.solve(b.G.T @ p)
        v = 2.0 * (new - u) / dt - v
        u, hit = new, p > 0.0
        # the closed points stop: an impulse that leaves the other openings' rates to the mass
        if hit.any():
            v = v - impulses[:, hit] @ np.linalg.solve(delassus[np.ix_(hit, hit)], (b.G @ v)[hit])
        gaps.append(b.G @ u)
        points.append(u[corners])
    return np.array(gaps), np.array(points)
