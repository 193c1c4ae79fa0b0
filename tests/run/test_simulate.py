"""simulate: the same steps as march, told to people, and nothing lost however the run ends."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from at_step import AtStep, failing
from chain import chain_problem
from summaries import summary_of

from vi_contact.core.algebra import EffectiveMatrix
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.files import to_json
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report, State, StepProblem, StepResult
from vi_contact.core.surfaces import ContactSurface
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import Inelastic
from vi_contact.run.cross_check import CrossChecked
from vi_contact.run.march import march
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.simulate import Solution, simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.serial

DT = 5e-3


def problem(**more: Any) -> ContactProblem:
    """The shaken chain between two walls."""
    shake = Harmonic(3.0, 2.0, direction=(1.0,))
    return chain_problem(
        5, gap=1e-3, left_gap=2e-3, excitation=shake, impact=Inelastic(), consistent=True, **more
    )


def run(steps: int | None = 100, **more: Any) -> Solution:
    """A run with the usual settings."""
    settings: dict[str, Any] = {
        "scheme": ZienkiewiczWoodTaylor(),
        "solver": Condensed(),
        "dt": DT,
        "steps": steps,
    }
    return simulate(problem(), **(settings | more))


def same(one: State, other: State) -> bool:
    """Whether two states agree to the last bit."""
    arrays = (("u", "v", "r_n", "active"), one.memory)
    return (
        (one.t, one.k) == (other.t, other.k)
        and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in arrays[0])
        and set(one.memory) == set(other.memory)
        and all(np.array_equal(one.memory[name], other.memory[name]) for name in arrays[1])
    )


@dataclass(frozen=True)
class Wrong:
    """A solver that answers one metre everywhere: no step is certified."""

    def check(self, problem: ContactProblem) -> None:
        """Takes everything."""

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> Wrong:
        return self

    def solve(self, step: StepProblem) -> StepResult:
        m = step.surface.count
        return StepResult(0.0 * step.b + 1.0, np.zeros(m), np.zeros(m, bool), 1, "wrong")


@pytest.mark.parametrize("scheme", [ZienkiewiczWoodTaylor(), LinearMultistep.newmark()], ids=repr)
def test_same_steps_as_march(scheme: Any) -> None:
    """simulate only listens: its final state is march's to the last bit."""
    *_, (state, _) = march(problem(), scheme=scheme, solver=Condensed(), dt=DT, steps=100)
    assert same(run(scheme=scheme).state, state)


def test_t_end_and_initial_state() -> None:
    """steps or t_end say the same; a given state is where the run goes on, with its step number and
    time."""
    assert same(run(steps=None, t_end=100 * DT).state, run().state)
    middle = run(40).state
    rest = run(60, state=middle)
    assert same(rest.state, run().state)
    assert rest.history["k"][0] == 40 and len(rest.history["t"]) == 61


def test_no_steps() -> None:
    """A run of no steps has the initial row, and no times per step."""
    solution = run(0)
    assert solution.history["t"].tolist() == [0.0]
    assert np.isnan(solution.facts["seconds_per_step"]) and np.isnan(
        solution.facts["seconds_per_linear_step"]
    )
    assert (
        "without a step" in solution.summary()
        and json.loads(to_json(solution.facts))["seconds_per_step"] is None
    )


def test_summary_for_people_and_programs(tmp_path: Path) -> None:
    """Every figure the summary promises, with the values of the histories."""
    solution = run(out=tmp_path)
    found, history = summary_of(tmp_path), solution.history
    assert found == json.loads(to_json(solution.facts))
    assert found["status"] == "finished" and found["steps"] == 100 and found["ranks"] == 1
    assert found["unknowns"] == 5 and found["contact_points"] == 2 and found["dt"] == DT
    assert found["worst_certificate"] == history["certificate"].max() <= 1e-9
    assert found["iterations_per_step"]["mean"] == pytest.approx(
        history["iterations"][1:].mean(), rel=1e-14
    )
    assert found["iterations_per_step"]["max"] == history["iterations"].max() > 0
    assert found["energy"]["work_input"] == history["work_input"][-1]
    assert 0.0 < found["energy_defect"] == found["energy"]["energy_defect"] < 1e-10
    assert found["seconds_per_step"] > found["seconds_per_linear_step"] > 0.0
    assert {"vi_contact", "python", "numpy", "scipy", "h5py"} <= set(found["versions"])
    assert found["cross_check"] is None and found["reason"] == ""
    text = solution.summary()
    for words in (
        "100 steps",
        "iterations per step",
        "worst certificate",
        "impact loss",
        "defect",
        "linear step",
    ):
        assert words in text
    assert max(map(len, text.splitlines())) <= 120


def test_cross_check_is_reported(tmp_path: Path) -> None:
    """The comparison that accompanied the run is in the summary: two methods agree to 1e-8 (V9,
    metamorphic)."""
    checked = CrossChecked(Condensed(), (Condensed(Hildreth()),))
    solution = run(solver=checked, cross_check=checked, out=tmp_path)
    ((method, difference),) = summary_of(tmp_path)["cross_check"].items()
    assert "Hildreth" in method and max(difference["u"], difference["r_n"]) < 1e-8
    assert method in solution.summary()
    assert summary_of(tmp_path)["solver"] == repr(Condensed())


def test_escalation_is_recorded(tmp_path: Path) -> None:
    """A step that needed another solver says so, in the history, the summary and the log."""
    solution = run(10, solver=Wrong(), escalation=(Condensed(),), out=tmp_path)
    assert solution.history["escalated"].tolist() == [0.0] + 10 * [1.0]
    assert summary_of(tmp_path)["escalated_steps"] == 10
    assert (
        "step 7, t = 0.035 s: escalated to condensed ActiveSet"
        in (tmp_path / "run.log").read_text()
    )
    assert same(solution.state, run(10).state)


def test_failed_step_keeps_what_was_computed(tmp_path: Path) -> None:
    """StepFailure passes through; the folder holds all steps before it and the reason, and a
    restart goes on."""

    class Late(Wrong):
        def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> Any:
            sound = Condensed().prepare(A, surface, scale)
            wrong = Wrong()

            class Either:
                def solve(self, step: StepProblem) -> StepResult:
                    return sound.solve(step) if step.k < 43 else wrong.solve(step)

            return Either()

    with pytest.raises(StepFailure, match="step 43 at"):
        run(solver=Late(), out=tmp_path)
    found = summary_of(tmp_path)
    assert found["status"] == "failed" and found["steps"] == 42 and "step 43 at" in found["reason"]
    rows = np.genfromtxt(tmp_path / "history.csv", delimiter=",", names=True)
    assert rows["k"].tolist() == list(range(43))
    assert same(run(out=tmp_path, restart=True).state, run().state)


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), RuntimeError("the recorder broke")], ids=["ctrl-c", "defect"]
)
def test_interrupted_run_goes_on(tmp_path: Path, error: BaseException) -> None:
    """Ctrl-C or a defect in a recorder at step 57: all files are complete, and the restart equals
    the straight run."""
    with pytest.raises(type(error)):
        run(out=tmp_path, record=[Energy(), Contact(), AtStep(57, failing(error))])
    found = summary_of(tmp_path)
    assert found["status"] == ("interrupted" if isinstance(error, KeyboardInterrupt) else "failed")
    assert found["steps"] == 56 and not (tmp_path / "history.journal").exists()
    harmless = AtStep(-1, failing(error))
    solution = run(out=tmp_path, record=[Energy(), Contact(), harmless], restart=True)
    straight = run(record=[Energy(), Contact(), harmless])
    assert same(solution.state, straight.state)
    for name, values in straight.history.items():
        assert np.array_equal(solution.history[name], values, equal_nan=True), name
    assert summary_of(tmp_path)["restarted_from_step"] == 56


def test_log_shows_progress(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Off a terminal a line every tenth of the run, with the time that is left, and nothing on the
    terminal itself."""
    run(out=tmp_path, checkpoint_every=40)
    lines = (tmp_path / "run.log").read_text().splitlines()
    progress = [line for line in lines if " left" in line]
    assert len(progress) == 10 and "step 100, t = 0.5 s: 100 of 100 steps" in progress[-1]
    for words in (
        "versions: vi_contact",
        "ranks: 1",
        "dt: 0.005",
        "scheme: Zien",
        "checkpoint of step 40",
        "finished",
    ):
        assert any(words in line for line in lines), words
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err == ""
    assert (
        logging.getLogger("vi_contact").handlers == [] and logging.getLogger("vi_contact").propagate
    )


def test_progress_line_on_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a terminal a bar with time, iterations and worst certificate; none when it is not
    wanted."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    run(20)
    shown = capsys.readouterr().err
    assert "20/20" in shown and "worst=" in shown and "t=0.1 s" in shown
    run(20, progress=False)
    assert capsys.readouterr().err == ""


def test_bad_arguments_change_nothing(tmp_path: Path) -> None:
    """Wrong input is told before a file of an earlier run is touched."""
    run(10, out=tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("checkpoint_every is 0", {"checkpoint_every": 0}),
        ("dt is -1.0", {"dt": -1.0}),
        ("give either steps or t_end", {"t_end": 1.0}),
        (
            "two recorders have the column 'u_x_a'",
            {"record": [Probe({"a": (1.0,)}), Probe({"a": (2.0,)})]},
        ),
        ("give a point of the body", {"record": [Probe({"a": (99.0,)})]}),
    ]
    for words, arguments in wrong:
        with pytest.raises(InputError, match=words):
            run(out=tmp_path, **arguments)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    with pytest.raises(InputError, match="restart=True needs the folder"):
        run(restart=True)
    with pytest.raises(InputError, match="fields need an output folder"):
        run(fields=object())


@dataclass
class Own:
    """A recorder of one's own that announces a column "a" and fills what it is told."""

    first: dict[str, Any]
    later: dict[str, Any]

    def columns(self) -> dict[str, tuple[str, str]]:
        return {"a": ("m", "mine")}

    def start(self, problem: ContactProblem, state: State, resumed: Any = None) -> dict[str, Any]:
        return self.first

    def row(self, report: Report) -> dict[str, Any]:
        return self.later


@pytest.mark.parametrize(
    ("first", "later", "words"),
    [
        ({}, {"a": 1.0}, "names the column 'a' in columns"),
        ({"a": 1.0}, {"b": 1.0}, "names the column 'a' in columns"),
        ({"a": 1.0}, {"a": 1.0, "b": 1.0}, "names the column 'b' in columns"),
        (
            {"a": 1.0},
            {"a": "one"},
            "column 'a' is 'one': let its recorder return a number or an array",
        ),
        ({"a": None}, {"a": 1.0}, "column 'a' is None"),
    ],
)
def test_recorders_of_ones_own_fill_what_they_announce(first: Any, later: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        run(3, record=[Own(first, later)])
    assert run(3, record=[Own({"a": 1}, {"a": np.float32(2.0)})]).history["a"].tolist() == [
        1.0,
        2.0,
        2.0,
        2.0,
    ]


@pytest.mark.parametrize("value", ["1.0", None, np.ones(2), 1j], ids=repr)
def test_histories_return_one_number(value: Any) -> None:
    """Of an excitation of one's own, from the start or later; numpy's numbers are numbers."""

    class Late(Harmonic):
        def acceleration(self, t: float) -> Any:
            return value if t > 0.01 else np.float64(t)

    shaken = chain_problem(5, excitation=Late(1.0, 1.0, direction=(1.0,)), consistent=True)
    with pytest.raises(
        InputError, match=r"the history of a load or excitation is .* at t = 0.01.* return one real"
    ):
        simulate(shaken, dt=DT, steps=9, progress=False)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"problem": "chain"}, "static_equilibrium: problem is 'chain'; give a ContactProblem"),
        (
            {"solver": "condensed"},
            "static_equilibrium: solver is 'condensed'; give a solver, such as",
        ),
        ({"solver": Condensed}, "make an object of it"),
        ({"tolerance": np.nan}, "static_equilibrium: tolerance is nan; give a relative residual"),
        ({"t": np.nan}, "static_equilibrium: t is nan; give a finite number in s"),
        ({"t": "0"}, "static_equilibrium: t is '0'"),
    ],
)
def test_arguments_of_a_static_stage(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        static_equilibrium(**({"problem": problem()} | arguments))
