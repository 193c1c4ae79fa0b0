"""Small problems whose conditions share unknowns: against all states of one node, and the split of
forces over rings."""

import numpy as np
import pytest
import scipy.sparse as sp

from vi_contact.core.algebra import Array
from vi_contact.solvers.friction.enumeration import list_answers
from vi_contact.solvers.friction.hyperstatic import Hyperstatic
from vi_contact.solvers.friction.newton import FrictionNewton
from vi_contact.solvers.friction.rings import find_rings

# name -> normals [degrees] and the two bodies of each condition, -1 for a wall
KINDS = {
    "two walls": ((0.0, 110.0), ((0, -1), (0, -1))),
    "three walls": ((0.0, 80.0, 170.0), ((0, -1), (0, -1), (0, -1))),
    "two partners": ((0.0, 0.0), ((0, 1), (0, 2))),
    "three partners": ((0.0, 70.0, 140.0), ((0, 1), (0, 2), (0, 3))),
    "ring": ((270.0, 270.0, 0.0), ((0, 1), (0, 2), (1, 2))),
    "crossing": ((0.0, 270.0, 180.0, 90.0), ((0, 1), (1, 2), (2, 3), (3, 0))),
}


def make_flexible(rng: np.random.Generator, bodies: int) -> Array:
    """Return the flexibility of free nodes (2 bodies, 2 bodies), a random block each."""
    C = np.zeros((2 * bodies, 2 * bodies))
    for i in range(0, 2 * bodies, 2):
        turn = np.linalg.qr(rng.normal(size=(2, 2)))[0]
        C[i : i + 2, i : i + 2] = turn @ np.diag(10.0 ** rng.uniform(-1.0, 1.0, 2)) @ turn.T
    return C


def make_traces(angles: Array, bodies: tuple[tuple[int, int], ...]) -> Array:
    """Return B (2 m, 2 bodies) of conditions with these normals."""
    B = np.zeros((2 * len(bodies), 2 * (1 + max(map(max, bodies)))))
    for i, (angle, (one, other)) in enumerate(zip(np.radians(angles), bodies, strict=True)):
        n = np.array([np.cos(angle), np.sin(angle)])
        frame = np.array([n, [-n[1], n[0]]])
        B[2 * i : 2 * i + 2, 2 * one : 2 * one + 2] = frame
        if other >= 0:
            B[2 * i : 2 * i + 2, 2 * other : 2 * other + 2] = -frame
    return B


class Node:
    """One random place of a kind, with its small problem."""

    def __init__(self, kind: str, seed: int, mu_most: float) -> None:
        rng = np.random.default_rng(seed)
        angles, bodies = KINDS[kind]
        self.B = make_traces(np.array(angles) + rng.uniform(0.0, 360.0), bodies)
        self.C = make_flexible(rng, self.B.shape[1] // 2)
        m = len(bodies)
        self.gap = np.where(rng.random(m) < 0.5, 0.0, rng.uniform(0.0, 0.3, m))
        self.free = rng.normal(size=self.B.shape[1])
        self.mu = rng.uniform(0.05, mu_most, m)
        self.weights = np.ones(m)

    @property
    def q(self) -> Array:
        return np.column_stack([self.gap, np.zeros(len(self.gap))]) - (self.B @ self.free).reshape(
            -1, 2
        )

    def prepare(self, method: object = None) -> Hyperstatic:
        m = len(self.gap)
        movable = np.ones(2 * m, dtype=bool)
        return Hyperstatic(
            method or FrictionNewton(),
            self.B @ self.C @ self.B.T,
            np.zeros(m, dtype=bool),
            rings=find_rings(sp.csr_matrix(self.B), movable, 2),
            weights=self.weights,
            movable=movable,
        )

    def moves(self, r: Array) -> Array:
        """Return the displacements under reactions (m, 2)."""
        return self.free - self.C @ self.B.T @ r.ravel()


@pytest.mark.parametrize(
    ("kind", "mu", "count"),
    [
        ("two walls", 0.5, 60),
        ("two walls", 1.5, 60),
        ("three walls", 0.5, 40),
        ("three walls", 1.5, 40),
        ("two partners", 1.5, 60),
        ("three partners", 0.7, 40),
        ("ring", 0.7, 40),
        ("crossing", 0.7, 10),
    ],
)
def test_all_states_of_a_node(kind, mu, count):
    """Every answer is one of those that the enumeration of all states finds."""
    for seed in range(count):
        node = Node(kind, seed, mu)
        small = node.prepare()
        found = small.solve(node.q, np.zeros(len(node.mu)), node.mu)
        step = small._delassus.problem(node.q, np.zeros(len(node.mu)), node.mu)
        answers = [r * small._delassus.scale for r in list_answers(step)]
        assert answers, seed
        apart = [np.abs(node.moves(found.r) - node.moves(r)).max() for r in answers]
        assert min(apart) < 1e-8, (seed, apart, found)
