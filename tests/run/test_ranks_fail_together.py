"""What a user gives may fail on one rank alone: all ranks raise it together, and none waits for
ever.

Each failure is that of the last rank: of the only one where there is one. A run that hangs is
killed by its alarm."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import dolfinx.fem
import ufl
from fem_problems import WALL_DT, block, plane_strain, shaken_wall
from own_forms import space, square

import vi_contact as vc
from vi_contact import fem, vi
from vi_contact.core.collective import Parts, _RankError, agree, call_user, together
from vi_contact.core.obstacles import AnalyticGap

PATIENCE = 120  # seconds for a test of about one, on a machine with other work
STEEL = plane_strain(1.0e9, 0.3, 2000.0)
NO_PROGRESS = {"dt": WALL_DT, "progress": False}


@pytest.fixture(autouse=True)
def _alarm() -> Iterator[None]:
    """Kill this process when the test hangs: a rank that waits in a collective call hears no other
    signal."""
    before = signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def last(comm: Any) -> bool:
    return bool(comm.rank == comm.size - 1)


def failing(comm: Any, after: float = -1.0, value: Any = None) -> Any:
    """A history of the time that raises on the last rank, or returns a value, from a time on."""

    def history(t: float) -> Any:
        if last(comm) and t > after:
            if value is not None:
                return value
            raise ValueError("no such time")
        return 0.0

    return history


def body(comm: Any, loads: Any = (), **data: Any) -> tuple[Any, Any]:
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    return fem.assemble(
        mesh, STEEL, clamped=tags["top"], loads=loads(tags) if loads else (), **data
    ), tags


def resting(comm: Any, loads: Any = (), **more: Any) -> Any:
    system, tags = body(comm, loads)
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"]), **more)


def pulled(history: Any) -> Any:
    return lambda tags: [fem.Traction(tags["left"], (1.0e3, 0.0), history=history)]


@pytest.mark.parametrize("value", [None, "a", 1.0j], ids=str)
@pytest.mark.parametrize("after", [-1.0, 4.5 * WALL_DT], ids=["start", "later"])
def test_the_history_of_a_load(comm: Any, shared_tmp: Path, after: float, value: Any) -> None:
    problem = resting(comm, pulled(failing(comm, after, value)))
    words = "the history of a load or excitation" + (
        " at t = .* ended in ValueError: no such time" * (value is None)
    )
    with pytest.raises(vc.InputError, match=words):
        vc.simulate(problem, **NO_PROGRESS, steps=8, out=shared_tmp)
    comm.Barrier()
    if after > 0.0:
        run = vc.read_run(shared_tmp)
        assert run.history["k"][-1] in (3, 4) and run.facts["status"] == "failed"
        assert np.all(np.isfinite(run.history["certificate"]))


@pytest.mark.parametrize(
    "stage",
    [
        lambda problem: vc.static_equilibrium(problem),
        lambda problem: list(vc.quasi_static(problem, [1.0, 2.0])),
        lambda problem: list(vc.march(problem, dt=WALL_DT, steps=2)),
    ],
    ids=["static", "quasi_static", "march"],
)
def test_histories_in_other_loops(comm: Any, stage: Any) -> None:
    with pytest.raises(vc.InputError, match="the history of a load or excitation at t"):
        stage(resting(comm, pulled(failing(comm))))


@pytest.mark.parametrize("way", ["towards", "along"])
@pytest.mark.parametrize("value", [None, np.nan, "a"], ids=str)
def test_an_obstacle_that_moves(comm: Any, way: str, value: Any) -> None:
    system, tags = body(comm)
    surface = fem.contact_surface(system, tags["bottom"]).moving(
        **{way: failing(comm, 0.5 * WALL_DT, value)}
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    with pytest.raises(vc.InputError, match=f"a moving obstacle: {way}"):
        list(vc.march(problem, dt=WALL_DT, steps=2))


@pytest.mark.parametrize("value", [None, np.nan], ids=str)
def test_a_gap_of_one_rank(comm: Any, value: Any) -> None:
    system, tags = body(comm)
    seen = failing(comm, value=value)
    words = "the initial gap contains NaN" if value is not None else "no such time"
    with pytest.raises((vc.InputError, vc.ViContactError, ValueError), match=words):
        fem.contact_surface(
            system, tags["bottom"], obstacle=AnalyticGap(lambda x: np.full(len(x), seen(0.0)))
        )


@dataclass(frozen=True)
class Shaking:
    """An excitation that fails on the last rank."""

    comm: Any
    direction: tuple[float, ...] = (1.0, 0.0)
    duration: float = 1.0

    def acceleration(self, t: float) -> float:
        return failing(self.comm, 0.5 * WALL_DT)(t)


def test_an_excitation(comm: Any) -> None:
    with pytest.raises(
        vc.InputError, match="excitation at t = .* ended in ValueError: no such time"
    ):
        list(vc.march(resting(comm, excitation=Shaking(comm)), dt=WALL_DT, steps=2))


class Rough(vc.Coulomb):
    """A friction law of the user's that fails on the last rank once something presses."""

    failing = False

    def limit(self, r_n: Any, weights: Any, scale: float) -> Any:
        if self.failing and np.any(r_n):
            raise ValueError("no such pressure")
        return super().limit(r_n, weights, scale)


@pytest.mark.parametrize("solver", [None, vc.Volume()], ids=["automatic", "volume"])
def test_a_friction_law(comm: Any, solver: Any) -> None:
    def press(tags: Any) -> Any:
        return [fem.Traction(tags["left"], (1.0e3, -1.0e4))]

    problem = resting(comm, press, friction=Rough(0.3))
    owner = problem.surface.count > 0 and not any(
        comm.allgather(problem.surface.count)[: comm.rank]
    )
    object.__setattr__(problem.friction, "failing", owner)
    with pytest.raises(
        vc.InputError, match="the friction law Rough ended in ValueError: no such pressure"
    ):
        list(vc.march(problem, dt=WALL_DT, steps=3, solver=solver))


class Failing:
    """A recorder that fails on the last rank in a step, and at another step tells a column that
    others do not have."""

    def __init__(self, comm: Any, k: int) -> None:
        self.last, self.k = last(comm), k

    def columns(self) -> Any:
        return {"own": ("m", "nothing")}

    def start(self, problem: Any, state: Any, resumed: Any = None) -> Any:
        return self.told(0)

    def row(self, report: Any) -> Any:
        return self.told(report.new.k)

    def told(self, k: int) -> Any:
        if self.last and k == self.k:
            raise KeyError("own")
        return {"own": 0.0}


@pytest.mark.parametrize("k", [0, 7])
def test_a_recorder(comm: Any, shared_tmp: Path, k: int) -> None:
    """The built-in recorders beside it are collective; what was computed is kept, with a
    checkpoint."""
    problem = shaken_wall(comm)
    run = {"scheme": vc.ZienkiewiczWoodTaylor(), **NO_PROGRESS, "out": shared_tmp}
    record = [Failing(comm, k), vc.Energy(), vc.Contact()]
    words = (
        f"the recorder Failing {'in step 7, t = 0.0125 s,' if k else 'at the start'} ended in "
        "KeyError: 'own'"
    )
    with pytest.raises(
        KeyError if last(comm) else vc.InputError, match="'own'" if last(comm) else words
    ):
        vc.simulate(problem, **run, steps=30, record=record)
    comm.Barrier()
    if k:
        found = vc.read_run(shared_tmp)
        assert found.history["k"][-1] == 6 and found.facts["status"] == "failed"
        assert ("the recorder Failing" in found.facts["reason"]) == (comm.size > 1)
        rest = vc.simulate(
            problem, **run, steps=9, record=[Failing(comm, -1), *record[1:]], restart=True
        )
        assert list(rest.history["k"]) == list(range(10))


class Own(vc.ZienkiewiczWoodTaylor):
    """A scheme of the user's that fails on the last rank in one of its methods."""

    def __init__(self, comm: Any, where: str) -> None:
        super().__init__()
        object.__setattr__(self, "where", (where, last(comm)))

    def told(self, where: str, value: Any) -> Any:
        if self.where == (where, True):
            raise ZeroDivisionError(where)
        return value

    def stage(self, *given: Any) -> Any:
        return self.told("stage", super().stage(*given))

    def finish(self, *given: Any) -> Any:
        return self.told("finish", super().finish(*given))

    def start(self, *given: Any) -> Any:
        return self.told("start", super().start(*given))


@pytest.mark.parametrize("where", ["start", "stage", "finish"])
def test_a_scheme_of_the_users_own(comm: Any, where: str) -> None:
    """On its own rank the error stays as it is; the others name it."""
    with pytest.raises((ZeroDivisionError, vc.ViContactError), match=where):
        vc.simulate(shaken_wall(comm), scheme=Own(comm, where), **NO_PROGRESS, steps=3)


class OwnSolver(vc.Condensed):
    """A solver of the user's that fails on the last rank."""

    def prepare(self, *given: Any) -> Any:
        made = super().prepare(*given)
        return type(
            "Prepared",
            (),
            {"solve": lambda _, step: self.answer(made.solve(step)), "close": lambda _: None},
        )()

    def answer(self, result: Any) -> Any:
        if getattr(self, "fails", False):
            raise ZeroDivisionError("solver")
        return result


def test_a_solver_of_the_users_own(comm: Any) -> None:
    solver = OwnSolver()
    object.__setattr__(solver, "fails", last(comm))
    with pytest.raises((ZeroDivisionError, vc.ViContactError), match="solver"):
        vc.simulate(shaken_wall(comm), solver=solver, **NO_PROGRESS, steps=3)


def test_an_impact_law_of_the_users_own(comm: Any) -> None:
    class Bouncing(vc.Newton):
        def target(self, impact: Any) -> Any:
            raise ZeroDivisionError("bounce")

    def press(tags: Any) -> Any:
        return [fem.Traction(tags["left"], (1.0e3, -1.0e4))]

    with pytest.raises(
        vc.InputError, match="the impact law Bouncing ended in ZeroDivisionError: bounce"
    ):
        list(vc.march(resting(comm, press, impact=Bouncing(0.5)), dt=WALL_DT, steps=3))


# Arguments that must agree

SOLVED = {
    "steps": (3, 4),
    "dt": (WALL_DT, 2.0 * WALL_DT),
    "tolerance": (1e-9, 1e-8),
    "t_end": (None, 1.0),
    "scheme": (vc.Trapezoidal(), vc.Newmark()),
    "solver": (vc.Condensed(), vc.Volume()),
    "restart": (False, True),
    "checkpoint_every": (100, 10),
    "record": ([vc.Energy()], [vc.Energy(), vc.Contact()]),
    "out": (None, "folder"),
    "callback": (None, lambda state, report: None),
    "escalation": ((), (vc.Volume(),)),
    "wall_time": (None, "1:00"),
    "scheme's numbers": (vc.HHT(-0.1), vc.HHT(-0.2)),
}


@pytest.mark.parametrize("name", SOLVED)
def test_arguments_of_a_run(comm: Any, name: str) -> None:
    key = name.split("'")[0]
    given = {"steps": 3, **NO_PROGRESS, key: SOLVED[name][last(comm)]}
    _differ(comm, lambda: vc.simulate(resting(comm), **given), f"simulate: {key} is")


def _differ(comm: Any, call: Any, words: str) -> None:
    if comm.size == 1:  # agrees with itself
        assert words
        return
    with pytest.raises(
        vc.InputError, match=rf"{words}.* on rank 0 and .* on rank {comm.size - 1}; give the same"
    ):
        call()


OTHERS = {
    "march: dt": lambda c: vc.march(resting(c), dt=WALL_DT * (1 + last(c)), steps=1),
    "march: steps": lambda c: vc.march(resting(c), dt=WALL_DT, steps=1 + last(c)),
    "static_equilibrium: t": lambda c: vc.static_equilibrium(resting(c), t=float(last(c))),
    "quasi_static: times": lambda c: vc.quasi_static(resting(c), [1.0, 2.0 + last(c)]),
    "ContactProblem: friction": lambda c: resting(c, friction=vc.Coulomb(0.3 + 0.1 * last(c))),
    "ContactProblem: excitation": lambda c: resting(c, excitation=vc.Harmonic(1.0 + last(c), 2.0)),
    "ContactProblem: impact": lambda c: resting(c, impact=vc.Newton(0.5) if last(c) else None),
    "assemble: material": lambda c: block_of(c, replace(STEEL, rho=2000.0 + last(c))),
    "assemble: damping": lambda c: body(c, damping=vc.MassProportional(1.0 + last(c))),
    "assemble: degree": lambda c: body(c, degree=1 + last(c)),
    "assemble: loads": lambda c: body(
        c, lambda tags: [fem.Traction(tags["left"], (1.0, 2.0 * last(c)))]
    ),
    "contact_surface: facets": lambda c: faces(c, "left" if last(c) else "bottom"),
    "contact_surface: feature_angle": lambda c: faces(
        c, "bottom", feature_angle=0.5 + 0.1 * last(c)
    ),
    "contact_surface: points": lambda c: faces(c, "bottom", points=[[0.5 + 0.5 * last(c), 0.0]]),
    "contact_surface: obstacle": lambda c: faces(
        c, "bottom", obstacle=vc.HalfSpace((0.0, -0.1 * last(c)), (0.0, 1.0))
    ),
}


def block_of(comm: Any, material: Any) -> Any:
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    return fem.assemble(mesh, material, clamped=tags["top"])


def faces(comm: Any, name: str, **more: Any) -> Any:
    system, tags = body(comm)
    return fem.contact_surface(system, tags[name], **more)


@pytest.mark.parametrize("words", OTHERS)
def test_other_arguments(comm: Any, words: str) -> None:
    _differ(comm, lambda: OTHERS[words](comm), f"{words} ")


@pytest.mark.parametrize("name", ["lower", "upper", "tolerance", "iterations"])
def test_bounds_and_settings_of_an_inequality(comm: Any, name: str) -> None:
    u = dolfinx.fem.Function(space(square(comm, 3), ("Lagrange", 1)))
    v = ufl.TestFunction(u.function_space)
    form = ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx + (u - 1.0) * v * ufl.dx
    value = {"tolerance": (1e-9, 1e-8), "iterations": (50, 40)}.get(name, (0.5, 0.6))[last(comm)]
    _differ(comm, lambda: vi.solve(form, u, **{name: value}), f"vi.solve: {name} is")


# The helpers themselves


@dataclass
class Two:
    """Two ranks of which this is one; the answers of the other are given."""

    rank: int
    other: Any
    size: int = 2

    def max(self, x: Any) -> Any:
        return np.maximum(x, float(self.other is not None))

    def gather(self, value: Any) -> Any:
        return [value, self.other] if self.rank == 0 else [self.other, value]

    def bcast(self, value: Any) -> Any:
        return value


@pytest.mark.serial
def test_a_frame_goes_on_and_tells_at_its_end() -> None:
    done = []
    with pytest.raises(vc.InputError, match="f ended in ZeroDivisionError"), together(Two(0, None)):
        assert call_user("f", lambda: 1 / 0, 3) == 3
        done.append(1)
    assert done == [1]
    # without a frame at once
    with pytest.raises(vc.InputError, match="f ended in ZeroDivisionError"):
        call_user("f", lambda: 1 / 0, 3)
    other = _RankError(False, None, "", "KeyError('a')")
    with (
        pytest.raises(vc.ViContactError, match=r"rank 1: KeyError\('a'\)"),
        together(Two(0, other)),
    ):
        done.append(2)
    with (
        pytest.raises(vc.StepFailure, match="too far"),
        together(Two(0, _RankError(False, 1, "too far", ""))),
    ):
        done.append(3)
    assert done == [1, 2, 3]


@pytest.mark.serial
@pytest.mark.parametrize(
    "same",
    [
        (1, 1.0),
        ([1.0] * 70, [1.0] * 70),
        (np.ones(3), np.ones(3)),
        (Parts((1.0,)), Parts((2.0, 3.0))),
        (float("nan"), float("nan")),
        ({"a": [1, "b", None]}, {"a": [1, "b", None]}),
        ([[1], [2, 3]], [[1], [2, 3]]),
    ],
    ids=str,
)
def test_what_is_alike(same: Any) -> None:
    told = []
    for value in same:
        comm = Two(0, None)
        comm.gather = lambda mine: told.append(mine) or [mine, mine]  # type: ignore
        agree(comm, "f", {"x": value})
    assert told[0] == told[1]
