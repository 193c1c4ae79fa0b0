"""The volume route as PETSc users meet it: options, refusals, failures in words, and nothing left
behind."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from petsc4py import PETSc
from petsc_packages import needs
from volume_cases import Case, case, pushed_block

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.protocols import Frictionless
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import Coulomb
from vi_contact.solvers.volume.failures import NOT_A_NUMBER, make_petsc_failure, make_reason_failure
from vi_contact.solvers.volume.route import (
    ReducedNewton,
    SemismoothNewton,
    TaoTron,
    Volume,
)

METHODS = (ReducedNewton(), SemismoothNewton(), TaoTron())
PREFIX = "vi_contact_volume_"


@pytest.fixture(
    params=[
        pytest.param(False, marks=pytest.mark.serial, id="scipy"),
        pytest.param(True, id="petsc"),
    ]
)
def pushed(request: pytest.FixtureRequest) -> Case:
    if request.param:
        pytest.importorskip("mpi4py")
    return pushed_block(parallel=request.param)


@pytest.fixture
def database() -> Iterator[Any]:
    """PETSc's options, as the command line fills them; restored afterwards."""
    options = PETSc.Options()
    before = options.getAll()
    yield options
    for key in set(options.getAll()) - set(before):
        options.delValue(key)


def prepare(c: Case, volume: Volume) -> Any:
    return volume.prepare(c.step.A, c.step.surface, c.step.scale)


class Rubbing:
    """What check() looks at."""

    def __init__(self, c: Case, friction: Any) -> None:
        self.surface, self.friction = c.step.surface, friction
        self.joint = None
        self.frictional = not isinstance(friction, Frictionless)
        self.system = c.step.A  # for its algebra


@pytest.mark.two_ranks
def test_friction_is_refused_with_the_methods_that_carry_it(pushed: Case) -> None:
    """Bounds on displacements cannot express |r_t| <= limit, and there is no energy to minimise;
    nor is there slip in one dimension."""
    for method in METHODS:
        Volume(method=method).check(Rubbing(pushed, Frictionless()))
    for method in METHODS[1:]:
        with pytest.raises(
            InputError, match=r"would ignore Coulomb\(mu=0.3\).*ReducedNewton\(\).*condensed"
        ):
            Volume(method=method).check(Rubbing(pushed, Coulomb(mu=0.3)))
    with pytest.raises(InputError, match="one dimension"):
        Volume(method=ReducedNewton()).check(Rubbing(pushed, Coulomb(mu=0.3)))


@pytest.mark.parametrize("tolerance", [0.0, -1e-9, 1.0, float("nan")])
@pytest.mark.serial
def test_tolerance_must_be_a_relative_error(tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance"):
        Volume(tolerance=tolerance)


REFUSED = [
    (ReducedNewton(), {"pc_type": "gamg"}, "rigid modes"),
    (ReducedNewton(), {"pc_type": "fieldsplit"}, "wrong rows"),
    (ReducedNewton(), {"pc_type": "mg"}, "grid transfers"),
    (ReducedNewton(), {"pc_type": "icc"}, "does not solve the system"),
    (ReducedNewton(), {"pc_type": "nothere"}, "does not accept the options"),
    (ReducedNewton(), {"snes_type": "newtonls"}, "set up for vinewtonrsls"),
    (ReducedNewton(), {"snes_type": "vinewtonssls"}, "set up for vinewtonrsls"),
    (SemismoothNewton(), {"pc_type": "cholesky"}, "not symmetric"),
    (SemismoothNewton(), {"ksp_type": "cg", "pc_type": "jacobi"}, "not symmetric"),
    (SemismoothNewton(), {"pc_type": "ilu"}, "does not solve the system"),
    (TaoTron(), {"pc_type": "gamg"}, "rigid modes"),
    (TaoTron(), {"tao_type": "bqpip"}, "TAO type bqpip is refused"),
    (TaoTron(), {"tao_type": "lmvm"}, "ignore bounds"),
]


@pytest.mark.two_ranks
@pytest.mark.parametrize(("method", "options", "reason"), REFUSED)
def test_unsound_options_are_refused(
    pushed: Case, method: Any, options: dict[str, str], reason: str
) -> None:
    """P5, P6, P8, P18."""
    with pytest.raises(InputError, match=reason):
        prepare(pushed, Volume(method=method, petsc_options=options))


@pytest.mark.two_ranks
@pytest.mark.parametrize(("method", "options", "reason"), REFUSED[::4])
def test_unsound_options_of_the_command_line_are_refused(
    pushed: Case, database: Any, method: Any, options: dict[str, str], reason: str
) -> None:
    for key, value in options.items():
        database[PREFIX + key] = value
    with pytest.raises(InputError, match=reason):
        prepare(pushed, Volume(method=method))


SPELT = [
    (
        ReducedNewton(),
        {"pc_typ": "jacobi"},
        "nothing reads 'pc_typ' of petsc_options: did you mean 'pc_type'?",
    ),
    (ReducedNewton(), {"snes_max_its": 5}, "did you mean 'snes_max_it'?"),
    (ReducedNewton(), {"mat_mumps_icntl_140": 5}, "did you mean 'mat_mumps_icntl_14'?"),
    (
        ReducedNewton(),
        {"ksp_rtol": 1e-8},
        "nothing reads 'ksp_rtol' of petsc_options: what it is for is not part of",
    ),
    (ReducedNewton(), {"tao_max_it": 5}, "nothing reads 'tao_max_it'"),
    (ReducedNewton(), {PREFIX + "pc_type": "lu"}, "give it without its prefix, as 'pc_type'"),
    (SemismoothNewton(), {"-snes_linesearch_typ": "bt"}, "did you mean 'snes_linesearch_type'?"),
    (
        TaoTron(),
        {"sub_pc_factor_level": 1, "pc_type": "bjacobi"},
        "did you mean 'sub_pc_factor_levels'?",
    ),
    (TaoTron(), {"quite_another": 1}, "nothing reads 'quite_another'"),
]
RIGHT = [
    (ReducedNewton(), {"snes_linesearch_max_it": 3, "mat_mumps_icntl_14": 90, "snes_max_it": 30}),
    (
        ReducedNewton(),
        {"ksp_type": "cg", "pc_type": "bjacobi", "ksp_rtol": 1e-10, "sub_pc_type": "icc"},
    ),
    (
        SemismoothNewton(),
        {"ksp_type": "gmres", "ksp_gmres_restart": 20, "pc_type": "lu", "ksp_rtol": 1e-12},
    ),
    (
        TaoTron(),
        {"pc_type": "bjacobi", "sub_pc_type": "icc", "sub_pc_factor_levels": 1, "tao_max_it": 90},
    ),
    (TaoTron(), {"pc_type": "jacobi", "-ksp_rtol": 1e-6}),
]


@pytest.mark.two_ranks
@pytest.mark.parametrize(("method", "options", "said"), SPELT)
def test_what_nothing_reads_is_refused(
    pushed: Case, method: Any, options: dict[str, Any], said: str
) -> None:
    """By name and with the nearest one that PETSc has, once a step has been solved; the database is
    as before."""
    before = PETSc.Options().getAll()
    with pytest.raises(InputError) as caught:
        prepare(pushed, Volume(method=method, petsc_options=options)).solve(pushed.step)
    assert said in str(caught.value) and PETSc.Options().getAll() == before


@pytest.mark.parametrize(("method", "options"), RIGHT)
def test_what_is_read_late_is_taken(pushed: Case, method: Any, options: dict[str, Any]) -> None:
    """Options of MUMPS, of blocks and of line searches are read when these are made, and stay right
    in later steps."""
    solver = prepare(pushed, Volume(method=method, petsc_options=options))
    for _ in range(2):
        assert kkt_residual(pushed.step, solver.solve(pushed.step)).worst <= 1e-9


def test_a_misspelt_option_of_the_command_line_is_a_warning(
    pushed: Case, database: Any, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another solver with this prefix may read it; it is told once."""
    monkeypatch.setattr("vi_contact.solvers.volume.options._TOLD", set())
    database[PREFIX + "pc_tipe"] = "jacobi"
    for _ in range(2):
        prepare(pushed, Volume()).solve(pushed.step)
    told = [one.message for one in caplog.records if "pc_tipe" in one.message]
    assert len(told) == (pushed.step.surface.comm.rank == 0)
    assert all("did you mean 'pc_type'?" in one for one in told)


@pytest.mark.two_ranks
def test_bounds_on_a_field_have_the_same_options(comm: Any) -> None:
    """``vi.solve`` hands them to its method; one that is only for the first method it tries is not
    held against it."""
    pytest.importorskip("dolfinx")
    from own_forms import Known, space, square
    from ufl import dx, grad, inner

    from vi_contact import vi

    def solve(**options: Any) -> Any:
        known = Known(
            space(square(comm, 6), ("Lagrange", 1)), lambda u, v: inner(grad(u), grad(v)) * dx
        )
        return vi.solve(
            known.linear, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc], **options
        )

    for method in (None, *METHODS):
        with pytest.raises(
            InputError, match="nothing reads 'pc_typ' of petsc_options: did you mean 'pc_type'"
        ):
            solve(method=method, petsc_options={"pc_typ": "jacobi"})
    assert solve(petsc_options={"tao_max_it": 90}).method == "TaoTron"


@pytest.mark.two_ranks
@pytest.mark.parametrize("kind", ["cp", "none", "bt"])
def test_line_searches(pushed: Case, kind: str) -> None:
    """P20: PETSc before 3.23 forgets the bounds in the slope of `cp`."""
    volume = Volume(method=ReducedNewton(), petsc_options={"snes_linesearch_type": kind})
    if kind == "cp" and PETSc.Sys.getVersion() < (3, 23, 0):
        with pytest.raises(InputError, match=r"before 3\.23"):
            prepare(pushed, volume)
    else:
        assert kkt_residual(pushed.step, prepare(pushed, volume).solve(pushed.step)).worst <= 1e-9


@pytest.mark.parametrize("pc", ["jacobi", "bjacobi", pytest.param("hypre", marks=needs("hypre"))])
def test_iterative_linear_solver(pushed: Case, pc: str) -> None:
    """Solver notes: hypre and block Jacobi survive changes of the active set."""
    options = {"ksp_type": "cg", "pc_type": pc, "ksp_rtol": 1e-8}
    prepared = prepare(pushed, Volume(method=ReducedNewton(), petsc_options=options))
    assert kkt_residual(pushed.step, prepared.solve(pushed.step)).worst <= 1e-9
    assert (prepared.snes.ksp.getType(), prepared.snes.ksp.pc.getType()) == ("cg", pc)


@pytest.mark.two_ranks
def test_petsc_objects_are_reachable(pushed: Case) -> None:
    for method in METHODS:
        prepared = prepare(pushed, Volume(method=method))
        result = prepared.solve(pushed.step)
        solver = prepared.tao if prepared.snes is None else prepared.snes
        assert solver.getIterationNumber() == result.iterations
        assert solver.getOptionsPrefix() == PREFIX
        prepared.close()
        assert prepared.snes is None and prepared.tao is None


@pytest.mark.two_ranks
def test_option_layers(pushed: Case, database: Any) -> None:
    """Defaults, then the settings, then the command line; ours are gone from the database after
    every call."""
    before = database.getAll()
    assert prepare(pushed, Volume()).snes.getTolerances()[3] == 100
    assert prepare(pushed, Volume(petsc_options={"-snes_max_it": 7})).snes.getTolerances()[3] == 7
    database[PREFIX + "snes_max_it"] = 9
    prepared = prepare(pushed, Volume(petsc_options={"snes_max_it": 7}))
    assert prepared.snes.getTolerances()[3] == 9
    prepared.solve(pushed.step)
    assert database.getAll() == {**before, PREFIX + "snes_max_it": "9"}


@pytest.mark.two_ranks
def test_prefix(pushed: Case, database: Any) -> None:
    database["mine_snes_max_it"] = 9
    assert prepare(pushed, Volume(prefix="mine_")).snes.getTolerances()[3] == 9
    assert prepare(pushed, Volume()).snes.getTolerances()[3] == 100


@pytest.mark.serial
def test_monitor_option(capfd: pytest.CaptureFixture[str]) -> None:
    c = pushed_block()
    prepare(c, Volume(petsc_options={"snes_monitor": None})).solve(c.step)
    assert "SNES Function norm" in capfd.readouterr().out


@pytest.mark.two_ranks
@pytest.mark.parametrize("key", ["snes_rtol", "snes_atol"])
def test_the_users_tolerance_stops_earlier(pushed: Case, key: str) -> None:
    """A tolerance given by the user counts relative to |b|; the certificate then says what it
    cost."""
    prepared = prepare(pushed, Volume(method=SemismoothNewton(), petsc_options={key: 1e-3}))
    early = prepared.solve(pushed.step)
    full = prepare(pushed, Volume(method=SemismoothNewton())).solve(pushed.step)
    assert early.iterations < full.iterations
    assert 1e-9 < kkt_residual(pushed.step, early).worst < 1e-2


@pytest.mark.two_ranks
def test_tao_tolerance_of_the_user(pushed: Case) -> None:
    early = prepare(pushed, Volume(method=TaoTron(), petsc_options={"tao_gatol": 1e-4})).solve(
        pushed.step
    )
    full = prepare(pushed, Volume(method=TaoTron())).solve(pushed.step)
    assert early.iterations < full.iterations


@pytest.mark.two_ranks
@pytest.mark.parametrize("method", [ReducedNewton(), SemismoothNewton(), TaoTron()])
def test_iteration_limit_is_a_failure_in_words(pushed: Case, method: Any) -> None:
    """The text has PETSc's reason, iterations, residual and advice; the same solver can go on
    afterwards."""
    volume = Volume(method=method, petsc_options={"snes_max_it": 1, "tao_max_it": 1})
    prepared = prepare(pushed, volume)
    text = (
        r"stopped after 1 iterations with relative residual \d.*DIVERGED_MAX_?ITS? \(the "
        r"iteration limit was reached"
    )
    with pytest.raises(StepFailure, match=rf"{type(method).__name__}\) {text}\): check that"):
        prepared.solve(pushed.step)
    away = replace(pushed.step, b=np.zeros_like(pushed.step.b))
    assert prepared.solve(away).iterations == 0


@pytest.mark.parametrize("method", METHODS)
def test_nan_load_is_a_failure(pushed: Case, method: Any) -> None:
    prepared = prepare(pushed, Volume(method=method))
    with pytest.raises(StepFailure, match="not a number.* for NaN"):
        prepared.solve(replace(pushed.step, b=pushed.step.b * np.nan))
    assert kkt_residual(pushed.step, prepared.solve(pushed.step)).worst <= 1e-9


@pytest.mark.serial
def test_reasons_of_every_petsc_have_words() -> None:
    """PETSc 3.25 renamed the reason of a residual that is not a number, and words its error 83 in
    its own way."""
    old = type("Old", (), {"DIVERGED_FNORM_NAN": NOT_A_NUMBER})
    new = type("New", (), {"DIVERGED_FUNCTION_NANORINF": NOT_A_NUMBER})
    for reasons in (old, new, PETSc.SNES.ConvergedReason):
        assert "(the residual is not a number): check the load" in str(
            make_reason_failure("Volume", reasons, NOT_A_NUMBER, 1, 0.5)
        )
    for words in (
        "Inf or NaN detected",
        "User provided compute function generated infinity or NaN",
    ):
        assert "check the load" in str(make_petsc_failure("Volume", RuntimeError(words)))
    assert "check that" in str(
        make_petsc_failure("Volume", RuntimeError("Nanometres are too long"))
    )


@pytest.mark.serial
def test_the_objective_keeps_its_digits_near_its_origin() -> None:
    """A line search needs f(y) - f(origin), which is 1e-12 of f and less than f's round-off
    allows."""
    c = pushed_block()
    scaled = prepare(c, Volume(method=TaoTron()))._scaled
    y = np.linspace(0.5, 1.0, len(c.step.b))
    scaled.set(c.step, y * 0.0)
    gradient, small = PETSc.Vec().createSeq(len(y)), 2.0**-40 * y[::-1]
    values = []
    for origin in (y, y + small):
        scaled.measure_from(origin)
        values.append(scaled.write_gradient(None, PETSc.Vec().createWithArray(y + small), gradient))
    change = small @ (scaled.residual(y) + 0.5 * (scaled.residual(y + small) - scaled.residual(y)))
    assert values[0] == pytest.approx(change, rel=1e-12) and values[1] == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_nan_bound_is_refused(pushed: Case, method: Any) -> None:
    with pytest.raises(InputError, match="bound .* contains NaN"):
        prepare(pushed, Volume(method=method)).solve(
            replace(pushed.step, bound=pushed.step.bound * np.nan)
        )


def test_petsc_errors_are_failures_and_leave_a_usable_solver(pushed: Case, database: Any) -> None:
    prepared = prepare(pushed, Volume(method=ReducedNewton()))
    database[PREFIX + "pc_factor_mat_solver_type"] = "nothere"
    with pytest.raises(StepFailure, match="PETSc error 92 .*nothere"):
        prepared.solve(pushed.step)
    database.delValue(PREFIX + "pc_factor_mat_solver_type")
    assert kkt_residual(pushed.step, prepared.solve(pushed.step)).worst <= 1e-9


@pytest.mark.parametrize("method", [ReducedNewton(), SemismoothNewton(), TaoTron()])
def test_a_body_that_flies_away_is_a_failure(method: Any) -> None:
    """P11: a floating chain pulled off its wall has no equilibrium, and PETSc may report none of it
    as an error."""
    n = 20
    stiffness = sp.diags(
        [-np.ones(n - 1), np.r_[1.0, 2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1)], [-1, 0, 1]
    ).tocsr()
    load = np.zeros(n)
    load[3] = -1.0
    c = case(
        stiffness,
        np.array([n - 1]),
        load,
        np.array([0.1]),
        parallel=bool(pytest.importorskip("mpi4py")),
    )
    with pytest.raises(StepFailure, match="check that"):
        prepare(c, Volume(method=method)).solve(c.step)


@pytest.mark.slow
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_solvers_are_freed(pushed: Case, method: Any, closed: bool) -> None:
    """Only PETSc objects outlive the last reference, so that their late destruction finds nothing
    else to free."""
    gc.disable()
    try:
        prepared = prepare(pushed, Volume(method=method))
        prepared.solve(pushed.step)
        parts = [prepared, prepared._scaled, prepared._driver, *vars(prepared._driver).values()]
        alive = [
            weakref.ref(part) for part in parts if type(part).__module__.startswith("vi_contact")
        ]
        assert len(alive) >= 5
        if closed:
            prepared.close()
        del prepared, parts
        assert [reference() for reference in alive] == [None] * len(alive)
    finally:
        gc.enable()


def test_a_closed_solver_opens_again(pushed: Case) -> None:
    for method in METHODS:
        prepared = prepare(pushed, Volume(method=method))
        first = prepared.solve(pushed.step)
        prepared.close()
        change = np.max(np.abs(prepared.solve(pushed.step).x - first.x), initial=0.0)
        size = np.max(np.abs(first.x), initial=0.0)
        change, size = pushed.step.surface.comm.max(np.array([change, size]))
        # not 0: MUMPS on several ranks does not repeat itself to the last bit
        assert change <= 1e-11 * size


def test_methods_do_not_disturb_the_matrix(pushed: Case) -> None:
    """P8: VINEWTONSSLS overwrites its Jacobian; A must not be it."""
    x = np.arange(1.0, 1.0 + len(pushed.step.b))
    before = pushed.step.A @ x
    for method in METHODS:
        prepare(pushed, Volume(method=method)).solve(pushed.step)
        assert np.array_equal(pushed.step.A @ x, before)
