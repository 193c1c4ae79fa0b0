"""The comparison with other programs: its references are right, and its page says what was
measured."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pictures import is_drawn

from vi_contact import __version__

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
PEERS = ROOT / "benchmarks" / "peers"
OURS = [
    ("signorini", "best"),
    ("signorini", "default"),
    *((one, way) for one in ("thrown", "bar") for way in ("best", "never gains")),
]
ROUND_OFF = 1e-10  # errors and penetrations below are zero


@pytest.fixture(scope="module")
def problems() -> Any:
    """The module of the problems, which stands outside of the package."""
    sys.path.insert(0, str(PEERS))
    try:
        import problems

        return problems
    finally:
        sys.path.remove(str(PEERS))


def of_all_sets(problems: Any, n: int) -> tuple[Any, Any]:
    """Displacements and contact forces by trying all sets of closed nodes: exactly one satisfies
    all conditions."""
    mesh = problems.Square(n)
    K, f = problems.stiffness(mesh, **problems.SIGNORINI).toarray(), problems.traction_load(mesh)
    found = []
    for closed in product((False, True), repeat=n + 1):
        held = np.concatenate([2 * mesh.left, 2 * mesh.bottom[np.array(closed)] + 1])
        free = np.setdiff1d(np.arange(len(f)), held)
        if np.linalg.matrix_rank(K[np.ix_(free, free)]) < len(free):
            continue  # a rigid motion is free
        u = np.zeros(len(f))
        u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
        r = (K @ u - f)[2 * mesh.bottom + 1]
        gap = u[2 * mesh.bottom + 1]
        if np.all(r >= -1e-9 * np.abs(f).max()) and np.all(gap >= -1e-12 * np.abs(u).max()):
            found.append((u, r))
    ((u, r),) = found
    return u, r


@pytest.mark.parametrize("n", (2, 4, 6))
def test_reference_is_the_one_of_all_sets(problems: Any, n: int) -> None:
    u, r = problems.signorini_reference(n)
    expected, forces = of_all_sets(problems, n)
    assert np.abs(u - expected).max() <= 1e-12 * np.abs(expected).max()
    assert np.abs(r - forces).max() <= 1e-12 * np.abs(forces).max()
    assert 0 < np.count_nonzero(r) < n + 1  # a part lifts off


def test_reference_satisfies_its_conditions_on_the_meshes_that_are_compared(problems: Any) -> None:
    """Equilibrium of all nodes, no force that pulls, no penetration, no force where it is open; and
    the whole load."""
    for n in problems.SIZES:
        mesh = problems.Square(n)
        u, r = problems.signorini_reference(n)
        rest = problems.stiffness(mesh, **problems.SIGNORINI) @ u - problems.traction_load(mesh)
        rest[2 * mesh.bottom + 1] -= r
        rest[2 * mesh.left] = 0.0
        gap = u[2 * mesh.bottom + 1]
        assert np.abs(rest).max() <= 1e-10 * np.abs(r).max()
        assert r.min() == 0.0 and gap.min() == 0.0 and np.all(r * gap == 0.0)
        assert r.sum() == pytest.approx(2.0e5, rel=1e-12)  # the mean traction is -0.2 MPa


def test_measures_see_what_is_wrong(problems: Any) -> None:
    u, r = problems.signorini_reference(16)
    exact = problems.measure("signorini", {"u": u.reshape(-1, 2), "r": r}, 16)
    assert max(exact.values()) < 1e-12
    sunk = u.reshape(-1, 2) - [0.0, 0.01 * np.abs(u).max()]
    wrong = problems.measure("signorini", {"u": sunk, "r": 1.02 * r}, 16)
    assert wrong["force_error"] == pytest.approx(0.02)
    assert wrong["penetration"] == pytest.approx(0.01 / 1.01, rel=0.02)
    assert wrong["energy_error"] > 1e-3


def test_bar_measures_of_the_exact_solution(problems: Any) -> None:
    """The exact solution at the middles of steps has no error; shifted by a step it has one."""
    exact, dt = problems.bar_reference(), problems.BAR["dt"]
    t = dt * np.arange(1, problems.BAR["steps"] + 1)
    answer = {
        "t": t,
        "force": exact.force(t - 0.5 * dt),
        "foot": exact.foot(t),
        "energy": np.full(len(t), exact.energy),
        "u": exact.displacement(np.linspace(0.0, 10.0, 101), t[-1]),
    }
    found = problems.measure("bar", answer, 0)
    assert found["force_error"] == 0.0 and found["energy_end"] == 1.0
    assert found["displacement_error"] < 1e-9 and found["penetration"] < 1e-9
    assert len(exact.contacts(t[-1])) == problems.BAR["bounces"] and t[-1] == pytest.approx(
        5.0 * exact.period
    )
    assert (
        0.0
        < problems.measure("bar", answer | {"force": exact.force(t - 1.5 * dt)}, 0)["force_error"]
        < 0.2
    )


def test_thrown_reference_is_its_command_s(problems: Any) -> None:
    """Stored runs agree with one another, and with a coarse one of today; the largest force is rho
    c_P v."""
    sys.path.insert(0, str(PEERS))
    try:
        import thrown_reference
    finally:
        sys.path.remove(str(PEERS))
    stored = json.loads((PEERS / "thrown_reference.json").read_text(encoding="utf-8"))
    fine = stored["runs"][-1]
    assert stored["impulse"] == fine["impulse"] and stored["impulse_uncertainty"] < 1e-3
    assert stored["largest_force"] == pytest.approx(
        1000.0 * np.sqrt(1.0e7 * 0.7 / (1.3 * 0.4) / 1000.0), rel=1e-12
    )
    assert fine["largest_mean_of_2_ms"] == pytest.approx(stored["largest_force"], rel=0.015)
    assert thrown_reference.run(16)["impulse"] == pytest.approx(stored["impulse"], rel=0.01)


@pytest.fixture(scope="module")
def compare() -> Any:
    """The module that runs peers and prints tables."""
    sys.path.insert(0, str(PEERS))
    try:
        import compare

        return compare
    finally:
        sys.path.remove(str(PEERS))


def test_page_says_what_was_measured(compare: Any) -> None:
    """Tables, ways, machine and versions of the page are those of the stored run, in which every
    peer has its rows."""
    page = (PEERS.parents[1] / "docs" / "reference" / "comparison.md").read_text(encoding="utf-8")
    stored = json.loads((PEERS / "results.json").read_text(encoding="utf-8"))
    # else: compare.py --page with the page's path
    assert compare.renewed(page, compare.parts_of(stored)) == page
    rows = stored["rows"]
    assert {(row["name"], row["problem"]) for row in rows} == set(
        product(compare.names(), compare.PROBLEMS)
    )
    uncertain = json.loads((PEERS / "thrown_reference.json").read_text(encoding="utf-8"))[
        "impulse_uncertainty"
    ]
    assert f"by {100.0 * uncertain:.2f} %" in page
    told = " ".join(page.split())
    for words in claims(rows):
        assert words in told


def stored_rows() -> list[dict[str, Any]]:
    """The rows of the stored run."""
    return list(json.loads((PEERS / "results.json").read_text(encoding="utf-8"))["rows"])


@pytest.mark.slow
@pytest.mark.parametrize("problem, way", OURS)
def test_our_rows_are_measured(
    problems: Any, monkeypatch: pytest.MonkeyPatch, problem: str, way: str
) -> None:
    """What the program of this project answers today is what its stored rows say; of the bar the
    first bounce."""
    pytest.importorskip("dolfinx")
    monkeypatch.syspath_prepend(str(PEERS))
    import peer_vi_contact as peer

    told, n = ("force_error", "penetration", "energy_error"), 16
    if problem == "thrown":
        told, n = (
            ("energy_end", "energy_largest", "impulse", "largest_force", "penetration"),
            problems.THROWN["n"],
        )
    if problem == "bar":
        told, n = ("force_error_first",), 0
        monkeypatch.setitem(problems.BAR, "steps", 800)
    answer = peer.signorini(n, way) if problem == "signorini" else getattr(peer, problem)(way)
    found = problems.measure(problem, answer, n)
    (row,) = (
        one
        for one in stored_rows()
        if (one["name"], one["problem"], one["way"], one["n"]) == ("vi_contact", problem, way, n)
    )
    for name in told:
        assert found[name] == pytest.approx(row[name], rel=1e-4, abs=ROUND_OFF), name


@pytest.mark.slow
def test_a_row_is_a_process(compare: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A row has its times and its measures, or says why it has none."""
    pytest.importorskip("dolfinx")
    assert [
        (one, way) for one, ways in compare.words_of("vi_contact")["WAYS"].items() for way in ways
    ] == OURS
    monkeypatch.setattr(compare, "LONG", 0.0)  # once
    monkeypatch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)
    row = compare.one("vi_contact", "signorini", 16, "default")
    assert "failed" not in row, row
    assert (
        row["process"] > row["solve"] > 0.0
        and max(row["force_error"], row["energy_error"]) < ROUND_OFF
    )
    assert "no_way" in compare.one("vi_contact", "no_way", 16, "default")["failed"]


def test_rows_of_this_program_are_those_of_its_version() -> None:
    """After a new version: bash benchmarks/peers/run.sh --json benchmarks/peers/results.json, and
    the page."""
    assert {
        row["version"].split(",")[0] for row in stored_rows() if row["name"] == "vi_contact"
    } == {__version__}


def test_the_figure_is_drawn_from_the_stored_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What benchmarks/peers/figure.py draws has a curve or a mark for each program."""
    monkeypatch.syspath_prepend(str(PEERS))
    import figure

    figure.draw(stored_rows(), tmp_path / "peers.png")
    assert is_drawn(tmp_path / "peers.png")


PEER = """
import problems

TITLE = "Absent"
INSTALL = {"pip": ["absent"]}
WAYS = {"signorini": {}, "thrown": {}, "bar": {}}
STOPS = {"signorini": {}, "thrown": {}, "bar": {}}

if __name__ == "__main__":
    problems.main(globals())
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "pip, why",
    [
        (
            "echo ERROR: No matching distribution found for absent; exit 1",
            "not installed: ERROR: No matching distribution found for absent",
        ),
        ("exit 0", "KeyError: 'version'"),
    ],
)
def test_a_peer_that_is_not_there_becomes_rows_that_say_so(
    tmp_path: Path, pip: str, why: str
) -> None:
    """The script goes on: a program that cannot be installed, or does not start, has a row for each
    problem."""
    folder = tmp_path / "benchmarks" / "peers"
    shutil.copytree(
        PEERS, folder, ignore=shutil.ignore_patterns("peer_*", "__pycache__", "results.json")
    )
    shutil.copytree(ROOT / "install", tmp_path / "install")
    (folder / "peer_absent.py").write_text(PEER, encoding="utf-8")
    python = tmp_path / ".venv" / "peers" / "absent" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(
        f'#!/bin/bash\n[ "$1" != -m ] || {{ {pip}; }}\nexec {sys.executable} "$@"\n',
        encoding="utf-8",
    )
    python.chmod(0o755)
    done = subprocess.run(
        ["bash", str(folder / "run.sh"), "--json", "rows.json", "absent"],
        cwd=tmp_path,
        capture_output=True,
        encoding="utf-8",
        env=dict(os.environ),
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text(encoding="utf-8"))["rows"]
    assert [(row["problem"], row["failed"]) for row in rows] == [
        (one, why) for one in ("signorini", "thrown", "bar")
    ]
    assert (
        "- Absent not installed" in done.stdout and done.stdout.count(f"| Absent |  | {why} |") == 3
    )


def claims(rows: list[dict[str, Any]]) -> list[str]:
    """What the sentences of the page say with numbers, made from the rows."""

    def of(name: str, problem: str, way: str, key: str) -> float:
        return next(
            row[key]
            for row in rows
            if (row["name"], row["problem"], row["way"]) == (name, problem, way)
        )

    def percent(name: str, problem: str, way: str, digits: int = 0) -> str:
        return f"{100.0 * abs(of(name, problem, way, 'energy_end') - 1.0):.{digits}f} %"

    def lines(name: str) -> str:
        found = [row["lines"] for row in rows if row["name"] == name]
        return f"{min(found)} to {max(found)}"

    blown = {
        one: [
            row["energy_end"]
            for row in rows
            if row["problem"] == one and row.get("energy_end", 0.0) > 2.0
        ]
        for one in ("thrown", "bar")
    }
    peaks = [
        row["largest_force_error"]
        for row in rows
        if row["problem"] == "thrown" and row["energy_end"] > 2.0
    ]
    ways = (
        ("getfem", "best"),
        ("calculix", "default"),
        ("scikit_fem", "best"),
        ("vi_contact", "best"),
    )
    over = [f"{of(name, 'thrown', way, 'largest_force_error'):.3f}" for name, way in ways]
    order = sorted(row["largest_force_error"] for row in rows if row["problem"] == "thrown")
    assert over == [f"{one:.3f}" for one in order[:4]]
    names = ("getfem", "siconos", "vi_contact")
    first = {name: f"({of(name, 'bar', 'best', 'force_error_first'):.3f})" for name in names}
    never = of("vi_contact", "bar", "never gains", "force_error_first")
    fast = [
        of("scikit_fem", one, "best", "solve") / of("vi_contact", one, "best", "solve")
        for one in blown
    ]
    close = {
        name: of(name, "bar", "best", "force_error")
        for name in ("ngsolve", "calculix", "getfem", "vi_contact")
    }
    assert list(close.values()) == sorted(close.values())
    assert close["ngsolve"] == min(row["force_error"] for row in rows if row["problem"] == "bar")
    assert of("scikit_fem", "bar", "best", "force_error_first") < of(
        "vi_contact", "bar", "best", "force_error_first"
    )
    return [
        f"{min(blown['thrown']):.1f} to {max(blown['thrown']):.1f} times its energy",
        f"{min(blown['bar']):.0f} to {max(blown['bar']):.0f} times its own",
        f"{lines('vi_contact')} a problem", f"needs {lines('scikit_fem')}",
        f"needs {fast[0]:.2f} of its time for the thrown square and {fast[1]:.2f} for the bar",
        f"wrong by {100.0 * of('getfem', 'signorini', 'default', 'force_error'):.0f} %",
        f"overlap of {100.0 * of('calculix', 'signorini', 'default', 'penetration'):.1f} %",
        f"force is then {1.0 + min(peaks):.1f} to {1.0 + max(peaks):.1f} times the exact one",
        f"overshoot ({over[0]}), before CalculiX by default ({over[1]}), scikit-fem ({over[2]}) "
        f"and `vi_contact` ({over[3]})",
        f"`vi_contact` gains {percent('vi_contact', 'thrown', 'best', 2)}, GetFEM's best way "
        f"{percent('getfem', 'thrown', 'best', 2)}, and scikit-fem's "
        f"{percent('scikit_fem', 'thrown', 'best', 2)}",
        f"of `vi_contact` loses {percent('vi_contact', 'thrown', 'never gains')}",
        f"force error {first['getfem']}, followed by `ContactStabilisedNewmark` ({never:.3f}), "
        f"Siconos {first['siconos']} and the default of `vi_contact` {first['vi_contact']}",
        f"NGSolve ({close['ngsolve']:.3f})", f"CalculiX ({close['calculix']:.3f})",
        f"`vi_contact` has {close['vi_contact']:.3f}",
        f"`ContactStabilisedNewmark` loses {percent('vi_contact', 'bar', 'never gains')}, CalculiX "
        f"{percent('calculix', 'bar', 'best')} and {percent('calculix', 'bar', 'default')}, "
        f"OpenSeesPy's TRBDF2 {percent('opensees', 'bar', 'best')} and Kratos with Bossak's scheme "
        f"{percent('kratos', 'bar', 'best')}",
        f"Siconos with projected positions gains {percent('siconos', 'bar', 'best')}",
    ]  # fmt: skip


def test_lines_of_code_are_counted(problems: Any, tmp_path: Path) -> None:
    """Its function and what it uses; no blank lines, comments, docstrings, nor what only other
    problems use."""
    file = tmp_path / "peer_one.py"
    file.write_text(
        '"""Say."""\n\nimport numpy as np\nimport json\n\nHOW = 1\n\n\ndef other():\n    return '
        "json\n\n\n"
        'def helper(x):\n    """Help\n    twice."""\n\n    return HOW * x  # HOW\n\n\n'
        "def bar(way):\n    # a comment\n    return np.sin(helper(1))\n"
    )
    assert problems.lines_of(file, "bar") == 6  # import numpy, HOW, two of helper, two of bar
    assert problems.lines_of(file, "other") == 3
    borrowing = tmp_path / "peer_two.py"
    borrowing.write_text("import problems\n\n\ndef bar(way):\n    return problems.mass(1, 2)\n")
    assert problems.lines_of(borrowing, "bar") > 10  # and the assembly that it takes
