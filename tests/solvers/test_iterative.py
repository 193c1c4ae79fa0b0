"""The iterative volume route against brute force over all contact sets, and its parts; serial and
parallel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from volume_cases import Case, case, pushed_block

from vi_contact.core.algebra import EffectiveMatrix, SerialAlgebra, SerialMatrix
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.verify import kkt_residual
from vi_contact.solvers import Iterative
from vi_contact.solvers.iterative.conjugate_gradients import format_residuals
from vi_contact.solvers.iterative.layout import Nodewise
from vi_contact.solvers.iterative.preconditioners import KINDS, choose_kind, compute_courant

M = 8  # contact points of pushed_block
HALF = np.array([0.3, 0.0] * 4)
OPTIONS: dict[str, dict[str, Any]] = {
    "rigid": {},
    "bilateral": {"bilateral": np.arange(M) % 3 == 0},
    "springs": {"compliance": np.full(M, 0.3)},
    "stiff and soft springs": {"compliance": 10.0 ** np.linspace(-6.0, 6.0, M)},
    "springs, rigid and bilateral": {
        "compliance": HALF,
        "bilateral": np.arange(M) < 3,
        "scale": 2.0,
    },
}


@pytest.fixture(
    params=[
        pytest.param(False, marks=pytest.mark.serial, id="scipy"),
        pytest.param(True, id="petsc"),
    ]
)
def parallel(request: pytest.FixtureRequest) -> Iterator[bool]:
    if request.param:
        pytest.importorskip("mpi4py")
    yield request.param


def prepared(c: Case, kind: str = "icc", **settings: Any) -> Any:
    return Iterative(kind, **settings).prepare(c.step.A, c.step.surface, c.step.scale)


def agree(c: Case, result: Any, exact: Any) -> None:
    """x and r_n to 1e-9 of their largest values, the same contact set, and the certificate of the
    loop."""
    bilateral, worst = (
        c.step.surface.everywhere(c.step.surface.bilateral),
        kkt_residual(c.step, result).worst,
    )
    result = c.whole(result)
    assert np.max(np.abs(result.x - exact.x)) <= 1e-9 * np.max(np.abs(exact.x))
    assert np.max(np.abs(result.r_n - exact.r_n), initial=0.0) <= 1e-9 * np.max(np.abs(exact.r_n))
    assert np.array_equal(result.active, exact.active | bilateral)
    assert not np.any(result.r_n[~result.active])
    assert worst <= 3e-10


@pytest.mark.parametrize("changes", [15, 0], ids=["active set", "projected gradients"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
def test_agrees_with_brute_force(
    parallel: bool, kind: str, changes: int, options: dict[str, Any]
) -> None:
    c = pushed_block(parallel=parallel, **options)
    exact = c.exact()
    assert 0 < np.sum(exact.active) < M
    solver = prepared(c, kind, changes=changes)
    agree(c, solver.solve(c.step), exact)
    assert solver.kind == kind and solver.work.fallbacks == (changes == 0)


@pytest.mark.parametrize("seed", range(3, 8))
def test_springs_that_open_and_close_by_projected_gradients(parallel: bool, seed: int) -> None:
    """Given springs are searched with a line search around: from a prediction that is all wrong,
    too."""
    c = pushed_block(parallel=parallel, seed=seed, compliance=10.0 ** np.linspace(-3.0, 1.0, M))
    exact = c.exact()
    wrong = replace(c.step, active=~exact.active[c.step.surface.slots])
    agree(c, prepared(c, changes=0).solve(wrong), exact)


def test_infinite_and_negative_bounds(parallel: bool) -> None:
    """Moreau-Jean: +inf where no contact is predicted; -e v_n pulls a point back."""
    c = pushed_block(parallel=parallel, seed=3)
    free = c.bounded(np.where(np.arange(M) > 3, np.inf, 0.05))
    agree(free, prepared(free).solve(free.step), free.exact())
    pulled = c.bounded(-0.1 - np.arange(M) / 50.0)
    agree(pulled, prepared(pulled).solve(pulled.step), pulled.exact())


def test_nothing_happens_at_rest(parallel: bool) -> None:
    """No load, touching supports: zero, without an iteration; 0/0 is not an error."""
    c = pushed_block(parallel=parallel)
    solver = prepared(c)
    result = solver.solve(replace(c.step, b=np.zeros_like(c.step.b)))
    assert result.iterations == 0 and solver.work.linear_iterations == 0
    assert not np.any(result.x) and not np.any(result.r_n) and not result.active.any()


@pytest.mark.parametrize("length, force", [(1e-3, 1e6), (1e6, 1e-3)])
def test_units_do_not_matter(parallel: bool, length: float, force: float) -> None:
    """Millimetres and meganewtons: the same dimensionless numbers and the same work."""
    one, other = (
        pushed_block(parallel=parallel),
        pushed_block(parallel=parallel, length=length, force=force),
    )
    first, second = prepared(one), prepared(other)
    a, b = one.whole(first.solve(one.step)), other.whole(second.solve(other.step))
    assert np.max(np.abs(b.x / length - a.x)) <= 1e-9 * np.max(np.abs(a.x))
    assert np.max(np.abs(b.r_n / force - a.r_n), initial=0.0) <= 1e-9 * np.max(np.abs(a.r_n))
    assert np.array_equal(a.active, b.active)
    assert first.work.products == second.work.products


def test_is_deterministic_and_warm_starts(parallel: bool) -> None:
    """The same bits twice; from the answer itself, no iteration and no change of the set."""
    c = pushed_block(parallel=parallel)
    one, two = prepared(c).solve(c.step), prepared(c).solve(c.step)
    assert np.array_equal(one.x, two.x) and np.array_equal(one.r_n, two.r_n)
    solver = prepared(c)
    again = solver.solve(c.starting_at(one))
    assert again.iterations == 0 and solver.work.linear_iterations <= 1


def test_work_is_counted(parallel: bool) -> None:
    """A product for every iteration, one in the end, one in the beginning unless x is zero there,
    and one for a set with more closed points; where points only open, and at springs, the residual
    is known. GAMG is renewed."""
    for options, start, first, extra in (
        ({}, False, 0, 1),
        ({}, True, 1, 0),
        ({"compliance": np.full(M, 0.3)}, False, 0, 0),
    ):
        c = pushed_block(parallel=parallel, **options)
        solver = prepared(c, "gamg")
        result, work = (
            solver.solve(replace(c.step, active=np.full_like(c.step.active, start))),
            solver.work,
        )
        assert result.iterations >= 1
        assert work.products == work.linear_iterations + extra * result.iterations + first + 1
        assert 0 <= work.renewals <= 4


class Counting:
    """A communicator that notes how many numbers are reduced at a time, and refuses the other
    operations."""

    def __init__(self, comm: Any) -> None:
        self._comm, self.rank, self.size, self.most = comm, comm.rank, comm.size, 0

    def sum(self, x: Any) -> Any:
        self.most = max(self.most, np.size(x))
        return self._comm.sum(x)

    def max(self, x: Any) -> Any:
        self.most = max(self.most, np.size(x))
        return self._comm.max(x)


@pytest.mark.parametrize("changes", [15, 0], ids=["active set", "projected gradients"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_more_than_a_dozen_numbers_are_reduced(parallel: bool, kind: str, changes: int) -> None:
    """Of a contact set of 24 points nothing is gathered, and no array of their number is
    reduced."""
    c = pushed_block(6, 24, parallel=parallel)
    counting = Counting(c.step.surface.comm)
    c.step.A.algebra.comm = counting  # type: ignore[misc]
    surface = replace(c.step.surface, comm=counting)
    solver = Iterative(kind, changes=changes).prepare(c.step.A, surface, c.step.scale)
    result = solver.solve(replace(c.step, surface=surface))
    assert 1 <= counting.most <= 12
    assert kkt_residual(c.step, result).worst <= 3e-10


# What cannot be solved
# ------------------------------------------------------------------------------------------------


def failing(matrix: Any, b: Any, words: str, **settings: Any) -> None:
    c = case(sp.csr_matrix(matrix), np.array([0]), b, np.array([1.0]))
    with pytest.raises(StepFailure, match=words) as found:
        prepared(c, "jacobi", **settings).solve(c.step)
    assert "residuals" in str(found.value) and "\n" not in str(found.value)


@pytest.mark.serial
def test_a_driven_floating_body_is_a_sentence() -> None:
    """Two masses on one spring, pulled: nothing holds them, and no residual vanishes."""
    failing(
        [[1.0, -1.0], [-1.0, 1.0]],
        np.array([-1.0, -1.0]),
        "is not positive definite|broke down|stagnated",
    )


@pytest.mark.serial
def test_an_indefinite_matrix_is_a_sentence() -> None:
    failing([[1.0, 3.0], [3.0, 1.0]], np.array([-1.0, 0.5]), "A is not positive definite")


@pytest.mark.serial
def test_stagnation_is_a_sentence_with_the_history() -> None:
    """A chain of springs with a contrast of 1e14 and two iterations of patience."""
    k = 10.0 ** np.linspace(-7.0, 7.0, 41)
    chain = sp.diags([k[:-1] + k[1:], -k[1:-1], -k[1:-1]], [0, 1, -1]).toarray()
    failing(chain, np.ones(40), "stagnated .*residuals .*, .*: check that every body", patience=2)


@pytest.mark.serial
def test_not_a_number_is_a_sentence() -> None:
    failing(np.eye(2), np.array([np.nan, 1.0]), "not a number")


def test_history_shows_first_some_and_last() -> None:
    assert format_residuals([1.0]) == "1.0e+00" and format_residuals([]) == "none"
    assert (
        format_residuals([10.0**-i for i in range(11)])
        == "1.0e+00, 1.0e-02, 1.0e-04, 1.0e-06, 1.0e-08, 1.0e-10"
    )


# Settings
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "settings, words",
    [
        (
            {"preconditioner": "ilu"},
            "unknown preconditioner 'ilu': choose one of auto, jacobi, icc, gamg",
        ),
        ({"tolerance": 2.0}, "tolerance is 2.0; give a relative error below 1"),
        ({"petsc_options": "pc_type"}, "petsc_options"),
        ({"prefix": None}, "prefix"),
    ],
)
def test_wrong_settings_are_told(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Iterative(**settings)


def test_petsc_options_choose_the_preconditioner(parallel: bool) -> None:
    c = pushed_block(parallel=parallel)
    solver = prepared(c, "gamg", petsc_options={"pc_type": "jacobi"})
    agree(c, solver.solve(c.step), c.exact())
    with pytest.raises(InputError, match="vi_contact_iterative_"):
        prepared(c, "gamg", petsc_options={"pc_type": "no such thing"})


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        (
            "jacobi",
            {"pc_typ": "sor"},
            "Iterative(jacobi): nothing reads 'pc_typ' of petsc_options: did you mean 'pc_type'",
        ),
        ("icc", {"sub_pc_factor_level": 1}, "did you mean 'sub_pc_factor_levels'"),
        ("icc", {"pc_gamg_threshold": 0.1}, "nothing reads 'pc_gamg_threshold'"),
        ("gamg", {"pc_gamg_treshold": 0.1}, "did you mean 'pc_gamg_threshold'"),
        ("gamg", {"ksp_type": "cg"}, "nothing reads 'ksp_type'"),
        ("auto", {"pc_gamg_treshold": 0.1}, "did you mean 'pc_gamg_threshold'"),
    ],
)
def test_options_that_nothing_reads_are_refused(
    parallel: bool, kind: str, options: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        prepared(pushed_block(parallel=parallel), kind, petsc_options=options)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("icc", {"sub_pc_factor_levels": 1}),
        ("gamg", {"pc_gamg_threshold": 0.1, "mg_levels_ksp_max_it": 3}),
        ("gamg", {"mg_coarse_sub_pc_type": "lu"}),
        ("auto", {"pc_gamg_threshold": 0.1, "sub_pc_factor_levels": 1}),
    ],
)
def test_options_of_parts_are_taken(parallel: bool, kind: str, options: dict[str, Any]) -> None:
    """Those of blocks and levels, read late or not at all on so few unknowns; with "auto" those of
    every kind."""
    c = pushed_block(parallel=parallel)
    agree(c, prepared(c, kind, petsc_options=options).solve(c.step), c.exact())


class Plane:
    """A space of nodes in the plane, of which some components are unknowns."""

    dimension = 2

    def __init__(self, ids: Any) -> None:
        self.ids = np.asarray(ids)
        self.coordinates = np.column_stack([np.cos(self.ids // 2), np.sin(self.ids // 2)])


def effective(matrix: Any, ids: Any, inertia: Any = None) -> EffectiveMatrix:
    return EffectiveMatrix(SerialMatrix(matrix), SerialAlgebra(), space=Plane(ids), inertia=inertia)


@pytest.mark.serial
@pytest.mark.parametrize(
    "ids", [range(8), [0, 1, 3, 4, 5, 6], [7, 1, 2, 3]], ids=["whole", "rollers", "any order"]
)
def test_blocks_of_whole_nodes_multiply_alike(ids: Any) -> None:
    """Nodes with one of two components get the other one back, held at zero."""
    ids, rng = np.array(ids), np.random.default_rng(1)
    n = len(ids)
    half = rng.normal(size=(n, n))
    nodewise = Nodewise(effective(half @ half.T, ids))
    layout, x = nodewise.layout, rng.normal(size=n)
    assert layout.complete == (n == 8) and layout.size == 2 * len(np.unique(ids // 2)) == n + len(
        layout.missing
    )
    assert np.array_equal(layout.strip(layout.pad(x)), x)
    for mat in (nodewise.blocks(), nodewise.entries()):
        vx, vy = mat.createVecs()
        vx.array[:] = layout.pad(x)
        mat.mult(vx, vy)
        assert mat.getBlockSize() == 2
        assert (
            np.max(np.abs(layout.strip(vy.array_r) - half @ half.T @ x))
            <= 1e-13 * np.abs(half).sum() ** 2
        )
        assert not np.any(vy.array_r[layout.missing])


@pytest.mark.serial
def test_the_courant_number_follows_the_matrices() -> None:
    """Sums of the diagonals: stiffness 100 times inertia is 10; no inertia in statics; not known,
    not a number."""
    M, K = SerialMatrix(np.diag([1.0, 0.0, 3.0, 4.0])), np.diag([100.0, 200.0, 300.0, 200.0])
    A = effective(2.0 * M.csr.toarray() + 2.0 * K, range(4), (2.0, M))
    assert compute_courant(A) == pytest.approx(10.0, rel=1e-14)
    assert compute_courant(effective(K, range(4), (0.0, M))) == np.inf
    assert np.isnan(compute_courant(effective(K, range(4))))
    numbers = (0.1, 0.5, 0.6, 30.0, 31.0, np.inf, np.nan)
    assert [choose_kind(one, modes=True) for one in numbers] == [
        "jacobi",
        "jacobi",
        "icc",
        "icc",
        "gamg",
        "gamg",
        "icc",
    ]
    assert choose_kind(np.inf, modes=False) == "icc"
