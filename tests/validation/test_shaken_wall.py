"""V4: the wall of seed 000 (first example, Figs. 2-5) against the reference numbers and the
statements of its figures.

Reference (REF): an independent script, Q1 8 x 12, consistent mass, mid-step load; displacements
printed to 1e-11 m in rows and 1e-9 m in minima and maxima. Every number is compared at its printed
precision.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import dense, spread
from mpi4py import MPI
from posed import matrix_of
from wall_runs import POINTS, SCHEME, follow, history, model, problem

from demos.parts.problems.wall import Wall
from vi_contact.core.algebra import Array, EffectiveMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.laws.impact import ImpulseUpdate
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.run.modal import lowest_frequency
from vi_contact.solvers.condensed import Condensed, PreparedCondensed
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.slow

ROWS = (10, 20, 40, 100, 200, 400)
# whole marches, slow on several ranks; the last test here shows that these do not matter
one_rank = pytest.mark.serial


def prepared(case: str) -> tuple[ContactProblem, EffectiveMatrix, PreparedCondensed]:
    given = problem(case)
    A = matrix_of(SCHEME, given, model().time_step())
    return given, A, Condensed().prepare(A, given.surface, 2.0)


def printed(text: str) -> Any:
    """A number as far as its printed digits go: half a unit in the last place."""
    digits, _, exponent = text.partition("e")
    place = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return pytest.approx(float(text), abs=0.5001 * place, rel=0.0)


# V4.1, the numbers
# --------------------------------------------------------------------------------------------------

CASES = {
    "free": (
        "-58.38955 -1.74828 -3.31037 -7.43761 -14.73024 -26.09186",
        "-76.903/87.765 -32.954/37.854 -40.366/46.303 -32.954/37.854",
    ),
    "a": (
        "-58.38955 -1.74828 -9.18182 14.46260 7.38785 5.65838",
        "-89.229/22.431 -42.461/9.098 -51.489/0 -42.184/13.231",
    ),
    "b": (
        "-58.38955 -1.74828 0 -9.66376 0 -1.70579",
        "-78.782/0 -33.154/0 -41.042/0 -34.169/9.305",
    ),
    "a, M-projection": (
        "-58.38955 -1.74828 -9.18639 14.46889 13.07956 3.17267",
        "-89.455/20.548 -42.783/9.374 -51.468/0 -42.429/13.283",
    ),
}


@one_rank
@pytest.mark.parametrize("case", CASES)
@pytest.mark.promise("start/first_wall.md", "All digits are tested against")
def test_v4_1_displacements(case):
    """u12 at six steps, minima and maxima of u12, u6, u7, u26 [1e-6 m]; a printed 0 is exactly
    0."""
    found = history("a", projection=True) if case == "a, M-projection" else history(case)
    rows, extremes = CASES[case]
    u = 1e6 * found.u
    for k, text in zip(ROWS, rows.split(), strict=True):
        assert u[k - 1, 0] == (0.0 if text == "0" else printed(text)), f"u12 at step {k}"
    for i, text in enumerate(extremes.split()):
        low, high = text.split("/")
        assert u[:, i].min() == printed(low), f"lowest u{POINTS[i]}"
        assert u[:, i].max() == (0.0 if high == "0" else printed(high)), f"highest u{POINTS[i]}"
    assert found.certificate < 1e-12


@one_rank
def test_v4_1_bilateral():
    """Statement 7: held on the ground, the contact side does not move at all; the opposite side
    does."""
    found = history("bilateral")
    assert not found.contact.any() and found.active.all()
    assert not found.u[:, :3].any()
    assert 1e6 * found.u[:, 3].min() == printed("-2.112")
    assert 1e6 * found.u[:, 3].max() == printed("2.108")


@one_rank
def test_v4_1_frequency_and_time_step():
    """f1 of the clamped wall, f = f1/2 and dt = 1/(40 f), for rho = 2400 and for 240 kg/m³."""
    one = model()
    assert lowest_frequency(one.system) == printed("27.9966")
    assert one.harmonic().frequency == printed("13.9983")
    assert one.time_step() == printed("1.785929e-3")
    light = Wall(material=LinearElastic(E=2.0e10, nu=0.0, rho=240.0))
    assert lowest_frequency(model(light).system) == printed("88.533")


@one_rank
@pytest.mark.parametrize(
    "case, count, eigenvalues",
    [("a", 3, "2.15713256e9 2.35809399e9 2.57581072e9"), ("b", 11, "8.41545514e8 4.00791403e9")],
)
def test_v4_1_eigenvalues_of_the_condensed_matrix(case, count, eigenvalues):
    """D~ [N/m]: all three of case a, lowest and highest of case b."""
    values = np.linalg.eigvalsh(np.linalg.inv(prepared(case)[2].delassus))
    assert len(values) == count
    expected = eigenvalues.split()
    for value, text in zip(
        values if len(expected) == count else values[[0, -1]], expected, strict=True
    ):
        assert value == printed(text)


LEDGERS = {
    "a": {"input": "1.904", "impact": "2.323e-1", "contact": "1.301", "end": "3.711e-1"},
    "b": {"input": "2.665", "impact": "3.662e-1", "contact": "2.126", "end": "1.731e-1"},
}


@one_rank
@pytest.mark.parametrize("case", LEDGERS)
@pytest.mark.promise("start/model.md", "defect stays at rounding")
def test_v4_1_energy_ledger(case):
    """Input work = reset loss + contact work of the steps + energy at the end [J], closed to
    round-off (V9.7)."""
    found = history(case)
    losses = found.losses | {"end": found.energy[-1]}
    for name, text in LEDGERS[case].items():
        assert losses[name] == printed(text), name
    assert losses["input"] == pytest.approx(
        losses["impact"] + losses["contact"] + losses["end"], rel=1e-12
    )
    largest = found.energy.max()
    assert abs(losses["defect"]) < 1e-12 * largest  # V9.7 asks for 1e-10
    assert abs(losses["algorithmic"]) < 1e-13 * largest  # phi = 1/2 is the midpoint rule (V9.1)
    assert losses["damping"] == 0.0


def sweeps(D: Array, z: Array, v: Array) -> tuple[Array, int]:
    """The seed's Hildreth-d'Esopo on (49), word for word: v_i <- min(0, v_i + (z - D v)_i / D_ii),
    cyclically.

    Ends when no v_i changed by more than 1e-13 of the largest; every sweep must lower ½ vᵀDv - zᵀv.
    """
    v, count, change = v.copy(), 0, np.inf
    objective = 0.5 * v @ D @ v - z @ v
    while change > 1e-13 * max(np.abs(v).max(), np.finfo(float).tiny):
        old, last, count = v.copy(), objective, count + 1
        for i in range(len(v)):
            v[i] = min(0.0, v[i] + (z[i] - D[i] @ v) / D[i, i])
        change = np.abs(v - old).max()
        objective = 0.5 * v @ D @ v - z @ v
        assert objective <= last + 1e-14 * abs(last)
    return v, count


@one_rank
@pytest.mark.parametrize("case, mean", [("a", 5.7), ("b", 20.7)])
def test_v4_1_sweeps_of_the_seeds_own_method(case, mean):
    """Projected Gauss-Seidel on D~, z~ from the last displacements gives the same u_N, in 5.7 or
    20.7 sweeps (mean).

    REF does not say what the change of a sweep was compared with; other sensible choices move the
    mean by up to 1.2 in case b (and by 0.2 in case a). Half a sweep is allowed here: found are 5.69
    and 21.16.
    """
    given, A, solver = prepared(case)
    D, surface = np.linalg.inv(solver.delassus), given.surface
    counts = []
    for _, report in march(
        given, scheme=SCHEME, solver=Condensed(), dt=model().time_step(), steps=400
    ):
        free = report.step.origin + A.factor.solve(report.step.b)
        z = D @ surface.normal_values(free)
        v, count = sweeps(D, z, surface.normal_values(report.old.u))
        u_n = surface.normal_values(report.new.u)
        assert np.abs(v - u_n).max() <= 1e-10 * np.abs(u_n).max()
        counts.append(count)
    assert np.mean(counts) == pytest.approx(mean, abs=0.5)


@one_rank
@pytest.mark.parametrize(("case", "primal"), [("a", True), ("b", False), ("b", True)])
def test_statement_8_hildreth_needs_few_sweeps(case, primal):
    """At most 30 sweeps in any step, in both forms. An open step counts none and the last reactions
    are the start, so the means are below those of the seed's own sweeps."""
    given = problem(case)
    found = follow(
        given, dt=model().time_step(), solver=Condensed(Hildreth(primal=primal, tolerance=1e-13))
    )
    assert 0 < found.iterations.max() <= 30
    assert np.abs(found.u - history(case).u).max() < 1e-10 * np.abs(found.u).max()


# V4.0: three forms of one problem
# -------------------------------------------------------------------------------------


@one_rank
@pytest.mark.parametrize("case", ["a", "b"])
def test_v4_0_condensed_matrix_is_the_schur_complement(case):
    """D~ = K_cc - K_ci K_ii^-1 K_ic of the dense effective matrix, symmetric to 1e-12 and positive
    definite.

    And z~ = F_c - K_ci K_ii^-1 F_i is what the unconstrained solution gives, D~ (A^-1 F)_c.
    """
    given, A, solver = prepared(case)
    surface, space = given.surface, given.system.space
    K = dense(MPI.COMM_WORLD, given.equations, A.matrix)
    ids = np.sort(np.concatenate(MPI.COMM_WORLD.allgather(np.asarray(space.ids))))
    c = np.searchsorted(ids, 2 * space.find_nodes(surface.whole().points))
    i = np.setdiff1d(np.arange(len(ids)), c)
    D = K[np.ix_(c, c)] - K[np.ix_(c, i)] @ np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, c)])
    schur = np.linalg.inv(solver.delassus)
    assert np.abs(schur - D).max() < 1e-11 * np.abs(D).max()
    columns = A.algebra.factor(A.matrix).solve_units(surface.owned, surface.slots, surface.total)
    G = surface.everywhere(columns[surface.owned])
    assert np.abs(G - G.T).max() < 1e-12 * np.abs(G).max()
    assert np.abs(schur - schur.T).max() < 1e-12 * np.abs(D).max()
    assert np.linalg.eigvalsh(schur)[0] > 0.0
    b = given.equations.load(model().time_step())
    F = spread(MPI.COMM_WORLD, space.ids, b)[ids]
    z = F[c] - K[np.ix_(c, i)] @ np.linalg.solve(K[np.ix_(i, i)], F[i])
    found = schur @ surface.everywhere(surface.normal_values(A.factor.solve(b)))
    assert np.abs(found - z).max() < 1e-11 * np.abs(z).max()


@one_rank
@pytest.mark.parametrize("case", ["a", "b"])
def test_v4_0_primal_dual_and_active_set_agree(case):
    """(46, 49), (42) and the active set give the same (u_N, S_N) to 1e-10 at every step."""
    solvers = (Condensed(), Condensed(Hildreth(primal=True)), Condensed(Hildreth(primal=False)))
    checked = cross_check(
        problem(case), scheme=SCHEME, solvers=solvers, dt=model().time_step(), steps=60
    )
    assert checked.worst < 1e-10
    assert all(found.size["r_n"] > 0.0 and found.steps == 60 for found in checked.found)


# The statements about Figs. 4 and 5
# -----------------------------------------------------------------------------------


@one_rank
@pytest.mark.parametrize("case", ["a", "b"])
def test_statement_1_linear_before_first_contact(case):
    """Up to the first contact, at or after step 20, all cases are the linear run."""
    found, free = history(case), history("free")
    first = int(np.argmax(found.active.any(axis=1)))
    assert first >= 20 and found.active[first].any()
    assert np.abs(found.u[:first] - free.u[:first]).max() < 1e-13 * np.abs(free.u).max()
    assert np.abs(found.u[first] - free.u[first]).max() > 1e-3 * np.abs(free.u).max()


@one_rank
@pytest.mark.parametrize("case", ["a", "b"])
def test_statement_2_contact_points_never_penetrate(case):
    """u_n <= 0 without exception; in case a the points between and above the three contacts do pass
    the line."""
    found = history(case)
    assert found.contact.max() == 0.0
    if case == "a":
        assert 1e6 * found.u[:, 0].max() > 20.0 and 1e6 * found.u[:, 1].max() > 9.0


@one_rank
def test_statements_3_and_4_cases_differ():
    """Case b: the whole side is one-sided, point 26 moves to +9. Peaks to the right: 22.4 against
    0; left: alike."""
    a, b = history("a").u * 1e6, history("b").u * 1e6
    assert history("b").contact.max(axis=0).tolist() == [0.0] * 11
    assert b[:, 3].max() > 9.0
    assert a[:, 0].max() > 22.0 and b[:, 0].max() == 0.0
    assert 0.8 < b[:, 0].min() / a[:, 0].min() < 1.0


@one_rank
@pytest.mark.parametrize("projection", [False, True])
def test_statement_5_energy_is_lost_in_contact_only(projection):
    """Undamped and no longer shaken: constant in free flight to 1e-12, lost in contact. The
    M-orthogonal reset and the step itself never create energy (V9.1, V9.6); the literal reset of
    components may, step by step."""
    dt = model().time_step()
    reading = ImpulseUpdate() if projection else None
    shaken = follow(problem("a", reading=reading), dt=dt, steps=37)
    impact = problem("a", reading=reading).impact
    quiet = model().problem("a", excitation=(), impact=impact)
    found = follow(quiet, dt=dt, steps=150, state=shaken.state)
    before = np.concatenate([[shaken.energy[-1]], found.energy[:-1]])
    change, touching = found.energy - before, found.active.any(axis=1)
    assert touching.sum() > 20 and (~touching).sum() > 20
    assert np.abs(change[~touching]).max() < 1e-12 * before[0]
    assert found.energy[-1] < 0.7 * before[0]
    reset, contact, _ = found.energy_steps.T
    assert contact.min() > -1e-13 * before[0]
    if projection:
        assert reset.min() > -1e-13 * before[0]
        assert change.max() < 1e-12 * before[0]


@one_rank
@pytest.mark.parametrize("case", ["a", "b"])
def test_statement_6_positive_homogeneity(case):
    """2.5 times the ground acceleration gives 2.5 times every displacement and the same contact
    sets."""
    base = history(case)
    found = follow(problem(case, a0=2.5), dt=model().time_step(), steps=150)
    assert np.array_equal(found.active, base.active[:150]) and found.active.any()
    assert np.abs(found.u - 2.5 * base.u[:150]).max() < 2e-12 * np.abs(found.u).max()


@one_rank
@pytest.mark.promise("start/first_wall.md", "a tenth of the density gives exactly")
def test_density_read_as_a_tenth_only_scales():
    """rho = 0.24 instead of 2.4 kN s²/m⁴ with f = f1/2 and dt = 1/(40 f): every displacement is
    exactly a tenth."""
    light = Wall(material=LinearElastic(E=2.0e10, nu=0.0, rho=240.0))
    found, base = history("a", wall=light), history("a")
    assert np.array_equal(found.active, base.active)
    assert np.abs(10.0 * found.u - base.u).max() < 1e-10 * np.abs(base.u).max()


# Discretisations and ranks
# --------------------------------------------------------------------------------------------

OTHER = {
    "triangles": Wall(triangles=True),
    "finer": Wall(divisions=(16, 24)),
    "finer triangles": Wall(divisions=(16, 24), triangles=True),
}


@one_rank
@pytest.mark.parametrize("other", OTHER)
@pytest.mark.parametrize("case", ["free", "b"])
@pytest.mark.promise("start/first_wall.md", "and `b` by less than 10 %")
def test_other_discretisations(case, other):
    """Minima and maxima within 10 % of the largest displacement of each point."""
    found, base = history(case, wall=OTHER[other]).u, history(case).u
    size = np.abs(base).max(axis=0)
    assert np.all(np.abs(found.min(axis=0) - base.min(axis=0)) < 0.1 * size)
    assert np.all(np.abs(found.max(axis=0) - base.max(axis=0)) < 0.1 * size)


@one_rank
@pytest.mark.parametrize("other", ["finer", "finer triangles"])
def test_other_discretisations_of_isolated_contact_points(other):
    """Case a: minima within 10 % of the largest displacement, on the finer meshes.

    A point contact has no limit in two dimensions (its compliance grows with log 1/h, the mass that
    a reset stops shrinks with h²), so case a belongs to its mesh: triangles of the coarse mesh are
    off by 17 %, maxima by up to 14 %.
    """
    found, base = history("a", wall=OTHER[other]).u, history("a").u
    assert np.all(np.abs(found.min(axis=0) - base.min(axis=0)) < 0.1 * np.abs(base).max(axis=0))


@pytest.mark.parametrize("case", ["a", "b"])
def test_independent_of_the_number_of_ranks(case):
    """Same contact sets and the same displacements, to 1e-10, as on one rank."""
    together, alone = history(case), history(case, alone=True)
    assert np.array_equal(together.active, alone.active)
    assert np.abs(together.u - alone.u).max() < 1e-10 * np.abs(alone.u).max()
    assert np.abs(together.contact - alone.contact).max() < 1e-10 * np.abs(alone.contact).max()
    assert np.array_equal(together.iterations, alone.iterations)
