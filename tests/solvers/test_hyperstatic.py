"""Small problems whose conditions share unknowns: against all states of one node, and the split of
forces over rings."""

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import minimize, root

from vi_contact.core.algebra import Array
from vi_contact.solvers.friction.enumeration import list_answers
from vi_contact.solvers.friction.hyperstatic import Hyperstatic
from vi_contact.solvers.friction.least_forces import States, split_least
from vi_contact.solvers.friction.newton import FrictionNewton
from vi_contact.solvers.friction.nsgs import NSGS
from vi_contact.solvers.friction.rings import find_rings

pytestmark = pytest.mark.serial
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


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "mu", "count"),
    [
        ("two walls", 0.5, 25),
        ("two walls", 1.5, 25),
        ("three walls", 0.5, 15),
        ("three walls", 1.5, 15),
        ("two partners", 1.5, 25),
        ("three partners", 0.7, 15),
        ("ring", 0.7, 15),
        ("crossing", 0.7, 4),
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


@pytest.mark.parametrize("slip", [0.5, -0.5])
def test_a_split_that_loads_a_sliding_point_makes_it_rub(slip):
    """A closed point slides without force, the other two of its ring stick: what the least split
    gives it, normal force and friction, obeys the law and is against the slip."""
    loaded = 0
    for seed in range(20):
        node = Node("ring", seed, 0.7)
        small = node.prepare()
        r = np.array([[1.0, 0.01], [1.0, -0.02], [0.0, 0.0]])
        w = np.array([[0.0, 0.0], [0.0, 0.0], [0.0, -slip]])
        scale = small._delassus.scale
        q = (w - small._delassus.product(r.ravel()).reshape(3, 2)) / scale
        step = small._delassus.problem(q, np.zeros(3), node.mu)
        found = small._finish(step, r, 1, []).r
        force = node.B.T @ (r * scale).ravel()
        assert np.abs(node.B.T @ found.ravel() - force).max() < 1e-12 * np.abs(force).max()
        size = np.abs(found).max()
        assert abs(found[2, 1] - np.sign(slip) * node.mu[2] * found[2, 0]) < 1e-12 * size
        loaded += found[2, 0] > 1e-6 * size
    assert loaded >= 5


def test_several_displacements_of_a_ring_with_unlike_friction():
    """Both stones of a course slip under a stone that holds its neighbour: what each of the two
    joints carries is not determined, and so the friction of both is not where their mu differ.

    Newton's method and sweeps find displacements that are 0.2 of a metre apart. Both satisfy the
    law, and so does every mean of them: no solution is wrong. With one mu there is one answer."""
    found = []
    for method in (FrictionNewton(), NSGS()):
        node = Node("ring", 1132, 0.7)
        found.append(node.prepare(method).solve(node.q, np.zeros(3), node.mu).r)
    apart = np.abs(node.moves(found[0]) - node.moves(found[1])).max()
    assert 0.1 < apart < 0.5
    for share in np.linspace(0.0, 1.0, 5):
        assert violation(node, found[0] + share * (found[1] - found[0])) < 1e-12
    alike = []
    for method in (FrictionNewton(), NSGS()):
        node = Node("ring", 1132, 0.7)
        node.mu[:] = 0.4
        alike.append(node.prepare(method).solve(node.q, np.zeros(3), node.mu).r)
        assert violation(node, alike[-1]) < 1e-12
    assert np.abs(node.moves(alike[0]) - node.moves(alike[1])).max() < 1e-12


def violation(node: Node, r: Array) -> float:
    """By how much reactions (m, 2) miss Signorini's and Coulomb's conditions, in the units of the
    node's numbers of one."""
    w = node.q + (node.B @ node.C @ node.B.T @ r.ravel()).reshape(-1, 2)
    limit = node.mu * np.maximum(r[:, 0], 0.0)
    misses = [
        -w[:, 0],
        -r[:, 0],
        np.abs(r[:, 0] * w[:, 0]),
        np.abs(r[:, 1]) - limit,
        # slip goes against the friction, and takes its limit
        np.abs(limit * w[:, 1] + np.abs(w[:, 1]) * r[:, 1]),
    ]
    return float(np.max(misses))


@pytest.mark.parametrize("kind", ["two walls", "three walls", "ring", "crossing"])
def test_the_split_does_not_depend_on_the_method(kind):
    """Newton's method and Gauss-Seidel sweeps end in other reactions of a ring, and the least split
    of both is one where they found the same displacements."""
    compared = 0
    for seed in range(20):
        node = Node(kind, seed, 0.5)
        found = [
            node.prepare(method).solve(node.q, np.zeros(len(node.mu)), node.mu)
            for method in (FrictionNewton(), NSGS())
        ]
        if np.abs(node.moves(found[0].r) - node.moves(found[1].r)).max() > 1e-9:
            continue  # of several answers both may be right
        size = max(np.abs(found[0].r).max(), 1e-9)
        assert np.abs(found[0].r - found[1].r).max() < 1e-6 * size, seed
        compared += 1
        if compared > 10:
            return
    raise AssertionError(f"only {compared} answers could be compared")


def split_of(r: Array, B: Array, mu: float, weights: Array, slips: bool = False) -> Array:
    """Return the least split of reactions (m, d) of conditions that are closed."""
    m, d = r.shape
    (ring,) = find_rings(sp.csr_matrix(B), np.ones(m * d, dtype=bool), d)
    size = np.linalg.norm(r[:, 1:], axis=1)
    states = States(
        closed=np.ones(m, dtype=bool),
        stick=np.full(m, not slips),
        bilateral=np.zeros(m, dtype=bool),
        slip=r[:, 1:] / np.where(size > 0.0, size, 1.0)[:, None],
        cohesion=np.zeros(m),
        slope=np.full(m, mu),
    )
    return split_least(r, ring, states, weights, np.ones((m, d), dtype=bool))


def test_a_ring_force_by_hand():
    """Four stones at one place, pressed by 1 on two opposite joints and 0.4 on the others: with no
    load along the joints the ring has no force; one of ±0.24 that the beds could carry goes."""
    B = make_traces(np.array([0.0, 270.0, 180.0, 90.0]), KINDS["crossing"][1])
    right = np.column_stack([[1.0, 0.4, 1.0, 0.4], np.zeros(4)])
    (ring,) = find_rings(sp.csr_matrix(B), np.ones(8, dtype=bool), 2)
    assert ring.null.shape == (8, 2)
    for way in np.vstack([ring.null.T, [1.0, -0.5] @ ring.null.T]):
        wrong = right + 0.2 * way.reshape(4, 2) / np.abs(way).max()
        least = split_of(wrong, B, 0.6, np.ones(4))
        assert B.T @ least.ravel() == pytest.approx(B.T @ right.ravel(), abs=1e-14)
        assert np.linalg.norm(least) <= np.linalg.norm(wrong)
        other = split_of(right, B, 0.6, np.ones(4))
        assert least == pytest.approx(other, abs=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_the_least_split_in_space(seed):
    """Three walls, or four bodies round an edge, in three dimensions: no allowed reactions with the
    same effect have a smaller sum, which a general optimiser (SLSQP) confirms to 1e-7."""
    rng = np.random.default_rng(seed)
    m, d, mu = 3, 3, 0.4
    normals = np.array([[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0], [-0.5, -0.7, 0.3]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    rows = []
    for n in normals:
        one = np.cross(n, rng.normal(size=3))
        one /= np.linalg.norm(one)
        rows += [n, one, np.cross(n, one)]
    B = np.array(rows)
    weights = rng.uniform(0.5, 2.0, m)
    r = np.column_stack([rng.uniform(0.5, 2.0, m), np.zeros((m, d - 1))])
    way = rng.normal(size=(m, d - 1))
    r[:, 1:] = mu * r[:, :1] * rng.uniform(0.0, 1.0, (m, 1)) * way
    r[:, 1:] /= np.maximum(np.linalg.norm(way, axis=1), 1.0)[:, None]
    least = split_of(r, B, mu, weights)
    assert B.T @ least.ravel() == pytest.approx(B.T @ r.ravel(), abs=1e-12)
    reach = np.linalg.norm(least[:, 1:], axis=1)
    assert np.all(least[:, 0] >= -1e-12) and np.all(reach <= mu * least[:, 0] + 1e-11)

    def energy(x: Array) -> float:
        return float(np.sum(x.reshape(m, d) ** 2 / weights[:, None]))

    def room(x: Array) -> Array:
        x = x.reshape(m, d)
        return np.concatenate([mu * x[:, 0] - np.sqrt(1e-24 + (x[:, 1:] ** 2).sum(axis=1))])

    found = minimize(
        energy,
        r.ravel(),
        method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda x: B.T @ (x - r.ravel())},
            {"type": "ineq", "fun": room},
        ],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert energy(least.ravel()) <= energy(found.x) * (1.0 + 1e-7)


def test_slipping_joints_keep_the_ratio_of_their_forces():
    """Two walls at which a node slips along the edge only: r_t follows r_n on each, so that the
    normal forces are unique and nothing is split."""
    rows = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0, 1.0, 0], [1.0, 0, 0], [0, 0, 1.0]]
    B = np.array(rows)
    r = np.array([[3.0, 0.0, 0.9], [1.0, 0.0, 0.3]])
    assert split_of(r, B, 0.3, np.ones(2), slips=True) == pytest.approx(r, abs=1e-14)


def test_bodies_apart_have_no_ring():
    """A chain of bodies, and a stone on two stones whose sides do not touch: no force is without
    effect."""
    B = make_traces(np.array([0.0, 30.0]), ((0, 1), (1, 2)))
    assert find_rings(sp.csr_matrix(B), np.ones(4, dtype=bool), 2) == []
    B = make_traces(np.array([270.0, 270.0]), ((0, 1), (0, 2)))
    assert find_rings(sp.csr_matrix(B), np.ones(4, dtype=bool), 2) == []


def find_in_space(G: Array, q: Array, mu: Array) -> list[Array]:
    """Return the answers (m, 3) of all states open, stick, slip of conditions in space.

    Unknowns of a condition that slips are r_n, the angle of the slip and its size; each set of
    states is solved from several starts, and kept where its inequalities hold."""
    m = len(mu)
    answers: list[Array] = []

    def expand(z: Array, states: tuple[str, ...]) -> tuple[Array, Array]:
        r, slid = np.zeros((m, 3)), np.zeros((m, 2))
        for i, state in enumerate(states):
            a = z[3 * i : 3 * i + 3]
            if state == "stick":
                r[i] = a
            if state == "slip":
                way = np.array([np.cos(a[1]), np.sin(a[1])])
                r[i] = [a[0], *(mu[i] * a[0] * way)]
                slid[i] = a[2] * way
        return r, slid

    for states in product(("open", "stick", "slip"), repeat=m):

        def left(z: Array, states: tuple[str, ...] = states) -> Array:
            r, slid = expand(z, states)
            w = q + (G @ r.ravel()).reshape(m, 3)
            w[:, 1:] += slid
            is_open = np.array([state == "open" for state in states])
            return np.where(is_open[:, None], z.reshape(m, 3), w).ravel()

        for angle in np.linspace(0.0, 2.0 * np.pi, 7)[:-1]:
            found = root(left, np.tile([1.0, angle, 0.5], m))
            r, slid = expand(found.x, states)
            w = q + (G @ r.ravel()).reshape(m, 3)
            size = found.x.reshape(m, 3)[:, 2]
            right = found.success and np.abs(left(found.x)).max() < 1e-9
            for i, state in enumerate(states):
                right &= r[i, 0] >= -1e-9 and w[i, 0] >= -1e-9
                right &= np.linalg.norm(r[i, 1:]) <= mu[i] * r[i, 0] + 1e-9
                right &= state != "slip" or size[i] >= -1e-9
            if right and not any(np.abs(r - other).max() < 1e-6 for other in answers):
                answers.append(r)
    return answers


@pytest.mark.parametrize("seed", range(6))
def test_all_states_of_a_node_in_space(seed):
    """A node with two deformable partners in three dimensions: the answer is one of those of all
    nine states."""
    rng = np.random.default_rng(seed)
    bodies = ((0, 1), (0, 2))
    B = np.zeros((6, 9))
    C = np.zeros((9, 9))
    for i in range(3):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rows = slice(3 * i, 3 * i + 3)
        C[rows, rows] = turn @ np.diag(10.0 ** rng.uniform(-0.5, 0.5, 3)) @ turn.T
    for i, (one, other) in enumerate(bodies):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        B[3 * i : 3 * i + 3, 3 * one : 3 * one + 3] = frame
        B[3 * i : 3 * i + 3, 3 * other : 3 * other + 3] = -frame
    G = B @ C @ B.T
    q = -(B @ rng.normal(size=9)).reshape(2, 3)
    mu = rng.uniform(0.1, 0.7, 2)
    small = Hyperstatic(
        FrictionNewton(),
        G,
        np.zeros(2, dtype=bool),
        rings=find_rings(sp.csr_matrix(B), np.ones(6, dtype=bool), 3),
        weights=np.ones(2),
        movable=np.ones(6, dtype=bool),
    )
    r = small.solve(q, np.zeros(2), mu).r
    answers = find_in_space(G, q, mu)
    assert min(np.abs(r - other).max() for other in answers) < 1e-7
