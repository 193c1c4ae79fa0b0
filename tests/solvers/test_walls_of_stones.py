"""Walls of many stones: a sparse G of shared bodies gives what a dense one gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core import sizes
from vi_contact.kernels.bodies import CondensedBodies
from vi_contact.kernels.dissection import dissect
from vi_contact.kernels.fronts import Fronts
from vi_contact.meshes.masonry import MasonryMesh
from vi_contact.solvers import condensed
from vi_contact.solvers.friction.kept_factor import Jacobian, KeptFactor

STONE = vc.LinearElastic(E=1e10, nu=0.2, rho=2400.0)


def make_wall(comm: Any, depth: float | None = None, push: float = 6.0) -> vc.ContactProblem:
    """A wall of two courses on shaking ground, in the plane or in space."""
    d = 2 if depth is None else 3
    cells = (4, 2) if depth is None else (2, 2, 2)
    wall = MasonryMesh(stones=2, courses=2, height=0.2, depth=depth, ground=0.2, divisions=cells)
    mesh, tags = fem.build_mesh(wall, comm)
    weight = (0.0, -9.81 * STONE.rho) if d == 2 else (0.0, -9.81 * STONE.rho, 0.0)
    ground = vc.Harmonic(amplitude=push, frequency=20.0, direction=(1.0,) + (0.0,) * (d - 1))
    system = fem.assemble(
        mesh,
        STONE,
        clamped=tags["ground_bottom"],
        loads=fem.BodyForce(weight),
        damping=vc.Rayleigh(alpha=0.0, beta=1e-4),
    )
    surface = fem.contact_pairs(system, within=1e-6)
    assert surface.traces is not None
    return vc.ContactProblem(
        system,
        surface,
        friction=vc.Coulomb(0.3),
        excitation=ground,
        mass=vc.ConsistentMass(),
    )


def march(problem: vc.ContactProblem, steps: int, rows: int, patch: Any) -> tuple[Any, Any]:
    """Steps with a sparse G from some rows on: the last state, and the solver."""
    patch.setattr(condensed, "SPARSE", rows)
    stepper = vc.Stepper(problem, solver=vc.Condensed())
    for _ in range(steps):
        trial = stepper.attempt(1e-3)
        assert trial.report.certificate.worst < 1e-9
        stepper.accept(trial)
    solver: Any = next(iter(stepper.prepared.values())).first
    return stepper.state, solver.friction


@pytest.mark.long
@pytest.mark.parametrize("depth", [None, 0.2], ids=["plane", "space"])
def test_a_sparse_g_gives_what_a_dense_one_gives(depth: Any, monkeypatch: Any) -> None:
    """Two ways to one answer, forces of rings too: their least split is unique."""
    problem = make_wall(MPI.COMM_WORLD, depth)
    steps = 12 if depth is None else 4
    sparse, friction = march(problem, steps, 0, monkeypatch)
    dense, other = march(problem, steps, 10**9, monkeypatch)
    assert sp.issparse(friction.delassus) and not sp.issparse(other.delassus)
    G = other.delassus
    assert np.allclose(friction.delassus.toarray(), G, rtol=0.0, atol=1e-12 * np.abs(G).max())
    assert sparse.active.sum() == dense.active.sum()
    for name in ("u", "v", "r_n", "r_t"):
        one, two = getattr(sparse, name), getattr(dense, name)
        size = MPI.COMM_WORLD.allreduce(np.abs(two).max(initial=0.0), MPI.MAX)
        assert np.allclose(one, two, rtol=0.0, atol=1e-8 * size), name


def test_equal_stones_share_a_factor(monkeypatch: Any) -> None:
    """Whole stones, half stones and the ground are three shapes, on any number of ranks."""
    problem = make_wall(MPI.COMM_WORLD)
    _, friction = march(problem, 1, 0, monkeypatch)
    shapes = friction.condensed.bodies.shapes
    assert isinstance(friction.condensed, CondensedBodies)
    assert sorted(len(shape.unknowns) for shape in shapes) == [1, 2, 3]


@pytest.mark.long
def test_restarts_and_runs_agree(monkeypatch: Any) -> None:
    """What is kept from step to step saves time, and changes answers by rounding alone."""
    problem = make_wall(MPI.COMM_WORLD)
    straight, _ = march(problem, 8, 0, monkeypatch)
    half, _ = march(problem, 4, 0, monkeypatch)
    stepper = vc.Stepper(problem, solver=vc.Condensed(), state=half)
    for _ in range(4):
        stepper.accept(stepper.attempt(1e-3))
    size = MPI.COMM_WORLD.allreduce(np.abs(straight.u).max(initial=0.0), MPI.MAX)
    assert np.allclose(stepper.state.u, straight.u, rtol=0.0, atol=1e-12 * size)


@pytest.mark.serial
def test_a_joint_takes_the_same_wall(monkeypatch: Any) -> None:
    """The law of a joint needs an array of G, which is made of the sparse one."""
    monkeypatch.setattr(condensed, "SPARSE", 0)
    wall = make_wall(MPI.COMM_SELF)
    joint = vc.laws.Joint(tension=2e3, opening=1e-3)
    problem = vc.ContactProblem(
        wall.system, wall.surface, joint=joint, mass=vc.ConsistentMass(), excitation=wall.excitation
    )
    reports = [report for _, report in vc.march(problem, dt=1e-3, steps=3, solver=vc.Condensed())]
    assert max(report.certificate.worst for report in reports) < 1e-9


class Factor:
    """A factor of a whole R G + D, in the place of fronts, with few digits if that is wanted."""

    def __init__(self, G: Any, short: float = 0.0) -> None:
        self._G = G.toarray()
        self._short = short
        self.operations = 0.5 * len(self._G)
        self.operations_of_solve = 1.0
        self.precise: list[bool] = []

    def factorise(self, R: Any, D: Any, *, precise: bool = False) -> bool:
        self._J = R.ravel()[:, None] * self._G + np.diag(D.ravel())
        self.precise.append(precise)
        if not precise and self._short:
            rng = np.random.default_rng(0)
            self._J = self._short * rng.normal(size=self._J.shape)
        return True

    def solve(self, v: Any) -> Any:
        return np.linalg.solve(self._J, v)


def make_jacobian(G: Any, marks: Any) -> Jacobian:
    """Rows of G where a mark is one, and of the identity elsewhere."""
    return Jacobian(G, marks[:, :, None], 1.0 - marks[:, :, None])


@pytest.mark.serial
@pytest.mark.parametrize("d", [2, 3])
def test_fronts_give_what_one_matrix_gives(d: int) -> None:
    """Bodies in a random order in rows, some conditions open and some that slip, a condition of
    three bodies and one of a single one: the residual of J x = v is rounding."""
    rng = np.random.default_rng(d)
    side = 9
    place = rng.permutation(side * side).reshape(side, side)
    pairs = [[place[i, j], place[i, j + 1]] for i in range(side) for j in range(side - 1)]
    pairs += [[place[i, j], place[i + 1, j]] for i in range(side - 1) for j in range(side)]
    pairs = [pair for pair in pairs for _ in range(3)]
    pairs += [[place[0, 0]], [place[3, 3], place[3, 4], place[4, 3]]]
    m = len(pairs)
    rows = np.repeat(np.arange(m), [len(pair) for pair in pairs])
    bodies = np.concatenate(pairs)
    touched = sp.csr_matrix((np.ones(len(rows)), (rows, bodies)))
    middle = np.array([np.argwhere(place == k)[0] for k in range(side * side)], dtype=float)
    points = np.array([middle[pair].mean(axis=0) for pair in pairs])
    B = sp.kron(touched, np.ones((d, 4))).tocsr()
    B.data = rng.normal(size=B.nnz)
    G = sp.csr_matrix(B @ B.T + sp.identity(m * d))
    G.data = G.data.astype(np.float32).astype(float)  # fronts hold G in single precision
    fronts = Fronts(G, dissect(touched, points), d)
    R = np.tile(np.eye(d), (m, 1, 1))
    D = np.zeros((m, d, d))
    is_open = rng.random(m) < 0.2
    slips = ~is_open & (rng.random(m) < 0.2)
    R[is_open] = 0.0
    D[is_open] = np.eye(d)
    R[slips, 1:] = 0.0
    D[slips, 1, 0] = -0.5
    D[slips, 1:, 1:] = np.eye(d - 1)
    assert fronts.factorise(R, D, precise=True)
    v = rng.normal(size=m * d)
    x = fronts.solve(v)
    assert np.abs(Jacobian(G, R, D) @ x - v).max() < 1e-10 * np.abs(x).max()
    # several right sides at once
    several = fronts.solve(np.column_stack([v, 2.0 * v]))
    assert np.abs(several - np.column_stack([x, 2.0 * x])).max() < 1e-12 * np.abs(x).max()
    # in single precision GMRES mends the digits
    kept = KeptFactor(fronts)
    marks = np.zeros((m, 1))
    x = np.zeros(m * d)
    for _ in range(3):
        more = kept.solve(Jacobian(G, R, D), v - Jacobian(G, R, D) @ x, marks)
        assert more is not None
        x = x + more
    assert kept.factors == 1
    assert np.abs(Jacobian(G, R, D) @ x - v).max() < 1e-10 * np.abs(x).max()
    # a singular one is said to be so
    R[:] = 0.0
    D[:] = 0.0
    assert not fronts.factorise(R, D)


@pytest.mark.serial
def test_work_follows_the_rows_that_changed() -> None:
    """k changed rows: k columns of the inverse, once, and the answer of a factor of its own."""
    rng = np.random.default_rng(3)
    n = 200
    J = sp.csr_matrix(np.eye(n) * 4.0 + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1))
    marks = np.ones((n, 1))
    kept = KeptFactor(Factor(J))
    kept.solve(make_jacobian(J, marks), rng.normal(size=n), marks)
    known: set[int] = set()
    for k in (1, 5, 12):
        changed = J.tolil()
        rows = rng.choice(n, k, replace=False)
        known |= set(rows)
        for row in rows:
            changed[row] = 0.0
            changed[row, row] = 1.0
        states = marks.copy()
        states[rows] = 0.0
        right = rng.normal(size=n)
        before = kept.iterations
        operations = kept.operations
        x = kept.solve(make_jacobian(J, states), right, states)
        assert x is not None and kept.factors == 1
        assert kept.columns == len(known)
        assert kept.iterations - before <= 2
        assert kept.operations - operations <= k + 4
        assert np.abs(changed @ x - right).max() < 1e-8 * np.abs(right).max()
        # again: nothing new has changed
        kept.solve(make_jacobian(J, states), right, states)
        assert kept.columns == len(known)
    # more changed rows than a factor costs: another factor
    kept.solve(make_jacobian(J, np.zeros((n, 1))), right, np.zeros((n, 1)))
    assert kept.factors == 2


@pytest.mark.serial
def test_a_factor_without_digits_is_made_again() -> None:
    """Where GMRES does not get there by a factor in single precision one in double is made."""
    n = 100
    J = sp.csr_matrix(np.eye(n) * 4.0 + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1))
    marks = np.ones((n, 1))
    factor = Factor(J, short=1.0)
    kept = KeptFactor(factor)
    right = np.random.default_rng(5).normal(size=n)
    x = kept.solve(make_jacobian(J, marks), right, marks)
    assert x is not None and factor.precise == [False, True]
    assert np.abs(J @ x - right).max() < 1e-8 * np.abs(right).max()


@pytest.mark.serial
def test_a_singular_problem_after_a_regular_one_is_told() -> None:
    """All rows become zero, and one of them is said to have changed."""
    m = 4
    fronts = Fronts(sp.identity(m, format="csr"), dissect(sp.identity(m).tocsr(), np.eye(m)), 1)
    kept = KeptFactor(fronts)
    nothing = np.zeros((m, 1, 1))
    marks = np.zeros((m, 1))
    right = np.arange(1.0, m + 1.0)
    regular = Jacobian(sp.identity(m, format="csr"), nothing, nothing + 1.0)
    assert kept.solve(regular, right, marks) == pytest.approx(right)
    marks = marks.copy()
    marks[0] = 1.0
    assert kept.solve(Jacobian(regular.G, nothing, nothing), right, marks) is None


def make_fronts(side: int) -> Fronts:
    """Fronts of a bonded wall of so many stones along each side, two conditions a joint."""
    stone = np.arange(side * side).reshape(side, side)
    beside = np.column_stack([stone[:, :-1].ravel(), stone[:, 1:].ravel()])
    above = np.column_stack([stone[:-1].ravel(), stone[1:].ravel()])
    across = np.column_stack([stone[:-1, :-1].ravel(), stone[1:, 1:].ravel()])
    pairs = np.repeat(np.vstack([beside, above, across]), 2, axis=0)
    m = len(pairs)
    touched = sp.csr_matrix((np.ones(2 * m), (np.repeat(np.arange(m), 2), pairs.ravel())))
    points = np.stack([pairs % side, pairs // side], axis=2).mean(axis=1)
    return Fronts(sp.csr_matrix(touched @ touched.T), dissect(touched, points), 1)


@pytest.mark.serial
def test_operations_grow_as_those_of_a_plane() -> None:
    """A factor of n stones grows with the power 1.5 in the end (George 1973), from above, and a
    solution, which a changed row costs, with hardly more than n. Operations are counted, not
    seconds; the band of a wall without dissection has the powers 2 and 1.5."""
    sides = np.array([10, 14, 20, 28, 40])
    fronts = [make_fronts(side) for side in sides]
    grown = np.diff(np.log(sides**2.0))
    by_factor = np.diff(np.log([front.operations for front in fronts])) / grown
    by_solve = np.diff(np.log([front.operations_of_solve for front in fronts])) / grown
    assert (np.diff(by_factor) < 0.0).all() and by_factor[-1] < 1.6
    assert (np.diff(by_solve) < 0.0).all() and by_solve[-1] < 1.25


def test_a_factor_that_takes_too_much_memory_is_refused(monkeypatch: Any) -> None:
    """The limit is one of memory, which is known before the factor is made."""
    monkeypatch.setattr(sizes, "DENSE_ROWS", 10)
    with pytest.raises(vc.InputError, match=r"a factor of .* GB on every rank.*fewer stones"):
        march(make_wall(MPI.COMM_WORLD), 1, 0, monkeypatch)


@pytest.mark.serial
@pytest.mark.parametrize("depth", [None, 0.2], ids=["plane", "space"])
def test_iterative_rubs_where_conditions_share_unknowns(depth: Any) -> None:
    """The same answers as Condensed, whose factor is a sum of iterations here."""
    pytest.importorskip("petsc4py")
    problem = make_wall(MPI.COMM_WORLD, depth)
    ends = []
    for solver in (vc.Iterative("jacobi"), vc.Condensed()):
        stepper = vc.Stepper(problem, solver=solver)
        for _ in range(3):
            trial = stepper.attempt(1e-3)
            assert trial.report.certificate.worst < 1e-9
            stepper.accept(trial)
        ends.append(stepper.state)
    for name in ("u", "v", "r_n", "r_t"):
        one, two = (getattr(end, name) for end in ends)
        size = MPI.COMM_WORLD.allreduce(np.abs(two).max(initial=0.0), MPI.MAX)
        assert np.allclose(one, two, rtol=0.0, atol=1e-10 * size), name
