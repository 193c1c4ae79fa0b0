"""Incremental dynamic analysis: the example of docs/guide/studies.md, its table, going on after a
stop, failed runs."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
import re
import shlex
import shutil
import subprocess
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from mpi4py import MPI

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError, OutOfTime
from vi_contact.practice.cli.batch import make_runs
from vi_contact.practice.cli.entry import main
from vi_contact.practice.ground_motion import Record, arias, pga, psa, read_record, scaled, tapered
from vi_contact.practice.plots.studies import DemandPanel, plot_ida
from vi_contact.practice.studies import IDA, read_case, run_ida
from vi_contact.practice.studies.cases.library import locate
from vi_contact.practice.studies.cases.toml_file import format_value
from vi_contact.practice.studies.ida.measures import compute_fractiles, read_demand, read_intensity
from vi_contact.practice.studies.ida.processes import build_command, execute_runs
from vi_contact.practice.studies.ida.runs import OneRun, Shaking
from vi_contact.run.files.folder import lock_folder
from vi_contact.run.solution import Solution
from vi_contact.run.wall_time import WallTime

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
MOTIONS = ("motion_1.at2", "motion_2.at2")
DEMANDS = ("contact_uplift:max", "u_x_top:min")


def blocks(language: str) -> list[str]:
    """The fenced blocks of docs/guide/studies.md."""
    text = (ROOT / "docs" / "guide" / "studies.md").read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder in which the whole example of docs/guide/studies.md has run, and what it
    printed."""
    folder = tmp_path_factory.mktemp("ida")
    (folder / "wall.toml").write_text(blocks("toml")[0], encoding="utf-8")
    make, read = blocks("python")
    commands = [
        shlex.split(one.replace("\\\n", ""), comments=True)
        for one in blocks("sh")
        if "schema" not in one
    ]
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.chdir(folder)
        patch.setenv("PYTHONPATH", str(ROOT), prepend=os.pathsep)  # for the runs of the study
        exec(compile(make, "make.py", "exec"), {"__name__": "__main__"})
        for program, *words in commands:
            assert program == "vi-contact" and main(words) == 0
        exec(compile(read, "read.py", "exec"), {"__name__": "__main__"})
    return folder, printed.getvalue()


@pytest.fixture
def study(example: tuple[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of its folder to spoil; the case and the records stay where they were."""
    monkeypatch.chdir(example[0])
    return Path(shutil.copytree(example[0] / "results" / "ida", tmp_path / "ida"))


def table(folder: Path) -> list[dict[str, str]]:
    with open(folder / "ida.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def again(folder: Path, **more: object) -> tuple[list[dict[str, object]], list[str]]:
    """The study of the example from Python: (rows, what it says)."""
    said: list[str] = []
    asked: dict[str, object] = {
        "motions": MOTIONS,
        "demands": DEMANDS,
        "scales": (1.0, 2.0),
        "intensity": "sa:0.1",
    }
    running = {key: more.pop(key) for key in ("jobs", "part", "launch", "wall_time") if key in more}
    return run_ida(
        IDA(read_case("wall.toml"), **(asked | more)), folder, say=said.append, **running
    ), said


@pytest.mark.slow
@pytest.mark.promise(
    "guide/studies.md", "There are 84 runs; the worst certificate", bound="1e-9, in four runs"
)
def test_the_example_gives_a_tidy_table(example: tuple[Path, str]) -> None:
    """Four rows in order, all certified; intensities and demands are those of record and run."""
    folder, printed = example
    assert "wall.toml: A wall beside the ground: the file is in order" in printed
    assert "4 runs, 0 of them failed" in printed and "4 runs, 4 finished" in printed
    rows = table(folder / "results" / "ida")
    assert list(rows[0]) == [
        "record",
        "scale",
        "sa_0.1",
        "contact_uplift_max",
        "u_x_top_min",
        "certificate",
        "energy_created",
        "steps",
        "status",
        "reason",
    ]
    assert [(row["record"], float(row["scale"])) for row in rows] == [
        (f"motion_{seed}", scale) for seed in (1, 2) for scale in (1.0, 2.0)
    ]
    for row in rows:
        record = tapered(read_record(folder / f"{row['record']}.at2"), fraction=0.05)
        assert float(row["sa_0.1"]) == pytest.approx(
            float(row["scale"]) * psa(record, 0.1), rel=1e-12
        )
        run = folder / "results" / "ida" / "runs" / f"{row['record']}_x{float(row['scale'])}"
        history = np.genfromtxt(run / "history.csv", delimiter=",", names=True)
        assert float(row["u_x_top_min"]) == history["u_x_top"].min() < 0.0
        assert np.abs(history["a_g_x"]).max() == pytest.approx(
            float(row["scale"]) * pga(record), rel=1e-12
        )
        assert 0.0 < float(row["certificate"]) < 1e-9 and 0.0 <= float(row["energy_created"]) < 0.01
        assert row["steps"] == "400" and row["status"] == "finished"
    units = json.loads((folder / "results" / "ida" / "columns.json").read_text(encoding="utf-8"))
    assert (
        list(units) == list(rows[0])
        and units["u_x_top_min"]["unit"] == "m"
        and units["sa_0.1"]["unit"] == "m/s²"
    )
    assert (folder / "results" / "ida" / "ida.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_finished_runs_are_kept(study: Path) -> None:
    """Nothing runs again; the table is the same to the byte, also from rows that a killed study had
    not written."""
    before = (study / "ida.csv").read_bytes()
    (study / "runs" / "motion_1_x2.0" / "row.json").unlink()
    rows, said = again(study)
    assert said == ["4 runs, 4 of them here, 4 finished already"] and len(rows) == 4
    assert (study / "ida.csv").read_bytes() == before


@pytest.mark.long
def test_a_failed_run_is_a_row_and_a_status(study: Path, tmp_path: Path, capsys: Any) -> None:
    """The command ends with 1 and says so, with the reason of the first failed run; the others keep
    their rows."""
    (tmp_path / "bad.txt").write_text("0 1\n0.1 x\n")
    asked = [
        "ida",
        "wall.toml",
        "--motions",
        *MOTIONS,
        str(tmp_path / "bad.txt"),
        "--scales",
        "1,2",
        "--im",
        "sa:0.1",
        "--edp",
        *DEMANDS,
        "--fragility",
        "u_x_top:min=-1e9",
        "--out",
        str(study),
    ]
    assert main(asked) == 1
    printed = capsys.readouterr()
    assert (
        "2 of 6 runs have failed, the first because: " in printed.err
        and f"are in {study}/ida.csv" in printed.err
    )
    assert "bad.txt, line 2: 'x' is not a number" in printed.err
    assert "fragility of u_x_top:min=-1e9: 0 of 2 records pass the limit" in printed.out
    assert [row["status"] for row in table(study)] == ["failed"] * 2 + ["finished"] * 4
    assert main([*asked[:5], *asked[6:]]) == 1  # the rows of before are in the table


def test_other_demands_and_measures_need_no_runs(study: Path) -> None:
    rows, said = again(study, demands=("contact_resultant:max", "u_x_top:last"), intensity="arias")
    assert said[-1].endswith("4 finished already")
    assert rows[1]["arias"] == pytest.approx(4.0 * rows[0]["arias"], rel=1e-9)
    assert rows[1]["contact_resultant_max"] > rows[0]["contact_resultant_max"] > 0.0
    with pytest.raises(
        InputError, match="the run has no column 'u_y_foot': record it, or choose one of t, "
    ):
        again(study, demands=("u_y_foot",))


@pytest.mark.slow
def test_an_interrupted_run_goes_on_and_failures_are_rows(study: Path, tmp_path: Path) -> None:
    """A run with a checkpoint at half its way and no row continues there; a record that is none has
    a row that says so, and the others go on. The row of a failed run is tried again."""
    folder = study / "runs" / "motion_1_x1.0"
    expected = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    for path in folder.iterdir():
        path.unlink() if path.is_file() else shutil.rmtree(path)
    settings = Shaking("motion_1", (Path("motion_1.at2").resolve(),)).settings(
        read_case("wall.toml")
    )
    set_words = [word for setting in (*settings, "run.steps=200") for word in ("--set", setting)]
    assert main(["run", "wall.toml", "--quiet", "--out", str(folder), *set_words]) == 0
    (folder / "summary.json").unlink()
    (tmp_path / "bad.txt").write_text("0 1\n0.1 x\n")
    rows, said = again(study, motions=(*MOTIONS, tmp_path / "bad.txt"), scales=(1.0,), jobs=2)
    assert said[0] == "3 runs, 3 of them here, 1 finished already" and len(rows) == 5
    (bad,) = (row for row in rows if row["status"] == "failed")
    assert bad["record"] == "bad" and bad["u_x_top_min"] is None and bad["sa_0.1"] is None
    assert "bad.txt, line 2: 'x' is not a number" in bad["reason"]
    assert any(line.endswith("] motion_1 x 1: finished") for line in said)
    assert (
        json.loads((folder / "summary.json").read_text(encoding="utf-8"))["restarted_from_step"]
        == 200
    )
    found = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    for name in (
        "t",
        "u_x_top",
        "contact_resultant",
        "contact_uplift",
        "energy_strain",
        "loss_friction",
    ):
        assert found[name] == pytest.approx(
            expected[name], abs=1e-10 * np.abs(expected[name]).max()
        ), name
    assert table(study)[0]["reason"] == bad["reason"] and table(study)[0]["u_x_top_min"] == ""
    assert again(study, motions=(tmp_path / "bad.txt",), scales=(1.0,))[1][0].endswith(
        "0 finished already"
    )


@pytest.mark.long
def test_parts_levels_and_runs_that_die(study: Path) -> None:
    """--part takes every n-th run; levels scale every record to the intensity; a process that dies
    is a row."""
    asked = {"scales": (), "levels": (2.0, 4.0), "intensity": "arias"}
    rows, said = again(study, part=(2, 3), launch=("false",), **asked)
    assert said[0] == "4 runs, 1 of them here, 0 finished already"
    (row,) = (row for row in rows if row["status"] == "failed")
    assert said[1] == f"[1/1] motion_1 x {row['scale']:g}: failed: ended with status 1"
    record = scaled(tapered(read_record("motion_1.at2"), fraction=0.05), factor=row["scale"])
    assert row["arias"] == pytest.approx(4.0, rel=1e-12) and arias(record) == pytest.approx(
        4.0, rel=1e-12
    )
    rows, said = again(study, part=(2, 3), launch=("sh", "-c", "kill -9 $$"), **asked)
    assert said[1].endswith("failed: ended by SIGKILL") and len(rows) == 5
    with pytest.raises(InputError, match="'no-such-program' cannot be started"):
        again(study, part=(2, 3), launch=("no-such-program",), **asked)


def test_a_record_that_is_stretched_is_told_and_levels_are_round(study: Path) -> None:
    """A record of a fifth of the level is multiplied by five; the table has the level itself."""
    peak = pga(tapered(read_record("motion_1.at2"), fraction=0.05))
    asked = {"motions": ("motion_1.at2",), "scales": (), "levels": (3.0 * peak, 5.0 * peak)}
    rows, said = again(study.parent / "stretched", launch=("false",), intensity="pga", **asked)
    assert said[0].startswith("records are multiplied by more than 4: motion_1 by up to 5; ")
    assert [row["pga"] for row in rows] == [float(f"{k * peak:.12g}") for k in (3.0, 5.0)]


def test_stopping_stops_the_runs(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C between two rows: processes that go on are stopped, also where SIGINT is ignored, and
    leave no row."""
    monkeypatch.setattr("vi_contact.practice.studies.ida.processes.PATIENCE", 1.0)
    case, shaking, going = (
        read_case("wall.toml"),
        Shaking("motion_1", (Path("motion_1.at2"),)),
        study / "going",
    )
    long, short = (OneRun(case, shaking, 1.0, study / "runs" / name) for name in ("long", "short"))
    words = (
        f"case \"$*\" in */short*) until [ -s '{going}' ]; do sleep 0.1; done; exit 1;; esac; "
        f"trap '' INT; echo $$ > '{going}'; sleep 3600"
    )
    start = time.monotonic()
    rows = execute_runs([long, short], 2, ("sh", "-c", words), WallTime())
    assert next(rows)["reason"] == "ended with status 1"
    with pytest.raises(KeyboardInterrupt):
        rows.throw(KeyboardInterrupt())
    assert time.monotonic() - start < 600.0 and not (long.folder / "row.json").exists()
    with pytest.raises(ProcessLookupError):
        os.kill(int(going.read_text()), 0)


@pytest.mark.long
@pytest.mark.promise("guide/studies.md", "The demands agree to 1e-13", bound="1e-10")
def test_runs_of_a_body_keep_their_own_books(study: Path, tmp_path: Path) -> None:
    """Runs that share a process share the body, and none of their recorders: the ledger of each is
    its own."""
    shaking = Shaking("motion_1", (Path("motion_1.at2").resolve(),))
    case = read_case(
        locate("wall"),
        [
            'excitation={type="GroundMotion", record="x.at2", direction=[1, 0]}',
            "run.dt=0.005",
            "run.steps=20",
            "impact=",
            "scheme=",
            "solver=",
            "escalation=",
            "fields=",
            "system.base_inertia=true",
        ],
    )
    runs = [OneRun(case, shaking, scale, tmp_path / f"x{scale}") for scale in (1.0, 2.0)]
    shares: list[float] = []
    ends = dict(
        make_runs(json.loads(build_command(runs, (), WallTime())[-1]), MPI.COMM_SELF, shares.append)
    )
    assert shares[-1] == 1.0
    for number, run in enumerate(runs):
        alone = read_case(case.path, run.settings).run(
            MPI.COMM_SELF, out=tmp_path / "alone", progress=False
        )
        together = ends[number]
        assert isinstance(together, Solution) and together.facts["energy_defect"] < 1e-10
        for name in ("work_input", "energy_strain", "loss_contact"):
            expected = alone.history[name]
            assert together.history[name] == pytest.approx(
                expected, abs=1e-10 * np.abs(expected).max()
            )


def test_what_a_process_that_died_has_left_runs_alone(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first process ends one of three runs and dies; each of the others gets its own, and one
    of these dies too."""
    case = read_case("wall.toml")
    runs = [
        OneRun(case, Shaking(f"m{k}", (Path("motion_1.at2"),)), 1.0, study / "runs" / f"m{k}")
        for k in range(3)
    ]
    made: list[list[str]] = []

    def started(asked: Sequence[OneRun], *_: object) -> subprocess.Popen[str]:
        made.append([one.shaking.name for one in asked])
        asked[0].folder.mkdir(exist_ok=True)
        (asked[0].folder / "summary.json").write_text('{"status": "finished"}')
        ended = 'echo \'{"share": 0.5}\'; echo \'{"ended": 0, "status": 0, "said": ""}\''
        words = "echo no memory; exit 3" if made[-1] == ["m1"] else ended
        end = "; kill -9 $$" if len(made) == 1 else ""
        return subprocess.Popen(["sh", "-c", words + end], stdout=subprocess.PIPE, text=True)

    monkeypatch.setattr("vi_contact.practice.studies.ida.processes.start_process", started)
    found = list(execute_runs(runs, 1, (), WallTime()))
    rows = {row["record"]: row for row in found if not isinstance(row, float)}
    assert made == [["m0", "m1", "m2"], ["m1"], ["m2"]] and found[0] == 1.5
    assert [rows[name]["status"] for name in ("m0", "m1", "m2")] == [
        "finished",
        "failed",
        "finished",
    ]
    assert rows["m1"]["reason"] == "no memory"


def test_a_wall_time_ends_a_study(
    study: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """Every run gets what is left; one that ends with status 75 leaves no row, and without time
    left none is begun."""
    monkeypatch.setattr("vi_contact.run.wall_time.measure_age", lambda: 100.0)
    run = OneRun(
        read_case("wall.toml"),
        Shaking("motion_1", (Path("motion_1.at2"),)),
        1.0,
        study / "runs" / "long",
    )
    assert json.loads(build_command([run], (), WallTime("5"))[-1])["wall_time"] == "3:15"
    with pytest.raises(
        OutOfTime,
        match="200 s left of the wall time 5 ended the study: give the same command again",
    ):
        list(execute_runs([run], 1, ("sh", "-c", "exit 75"), WallTime("5")))
    assert not (run.folder / "row.json").exists()
    before = table(study)
    asked = [
        "ida",
        "wall.toml",
        "--motions",
        *MOTIONS,
        "--scales",
        "1,3",
        "--edp",
        *DEMANDS,
        "--out",
        str(study),
    ]
    assert main([*asked, "--wall-time", "1:45"]) == 75
    assert "5 s left of the wall time 1:45" in capsys.readouterr().err and table(study) == before
    with pytest.raises(InputError, match="the wall time is .*: give minutes"):
        again(study, wall_time="soon")


def test_one_study_at_a_time_in_a_folder(study: Path) -> None:
    """The same part of one is refused while it runs, another part is not."""
    with lock_folder(SerialComm(), study), ThreadPoolExecutor(1) as other:
        assert other.submit(again, study, part=(2, 3)).exception() is None
        assert "another run writes into" in str(other.submit(again, study).exception())


def test_another_study_is_refused(study: Path) -> None:
    with pytest.raises(
        InputError, match="holds runs from before the case was changed: choose another folder"
    ):
        run_ida(
            IDA(read_case("wall.toml", ["friction.mu=0.4"]), MOTIONS, DEMANDS, scales=(1.0,)), study
        )
    shutil.copy("motion_2.at2", study / "motion_1.at2")
    with pytest.raises(InputError, match="before the record 'motion_1' was changed"):
        again(study, motions=(study / "motion_1.at2",))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"scales": ()}, "either scales or levels"),
        ({"levels": (1.0,)}, "either scales or levels"),
        ({"scales": (1.0, 1.0)}, "different positive numbers"),
        ({"scales": (-1.0,)}, "different positive numbers"),
        ({"demands": ()}, "demands is empty"),
        ({"demands": ("u:most",)}, "WAY one of max, min, absmax, last"),
        ({"motions": ()}, "motions is empty"),
        ({"motions": ("a/m.at2", "b/m.at2")}, "two motions are called 'm'"),
        ({"motions": (("h.at2", "v.at2"),)}, "the case has 1 ground motion: give"),
        ({"intensity": "pgx"}, "unknown intensity 'pgx': choose one of pga"),
        ({"intensity": "sa:x"}, "give the period after the colon"),
        ({"jobs": 0}, "one job or more"),
        ({"part": (3, 2)}, "1 <= i <= n"),
    ],
)
def test_wrong_studies(study: Path, more: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        again(study, **more)


def test_what_has_no_record_to_replace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = read_case(ROOT / "demos" / "cases" / "wall.toml")
    with pytest.raises(InputError, match=r"\[excitation.1\] has no record that others can replace"):
        IDA(case, ["a.at2"], ["t"], scales=(1.0,))
    case = read_case(ROOT / "demos" / "cases" / "wall_record.toml")
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with pytest.raises(InputError, match="start it without mpirun"):
        run_ida(IDA(case, ["a.at2"], ["t"], scales=(1.0,)), tmp_path)
    assert not any(tmp_path.iterdir())


def test_two_motions_and_their_settings(tmp_path: Path) -> None:
    """Horizontal and vertical record, as text or as table, each with its own scale times the
    factor."""
    case = read_case(ROOT / "demos" / "cases" / "channel.toml", ["excitation.2.scale=0.5"])
    (one,) = IDA(case, [("h.at2", "v.at2")], ["contact_uplift"], scales=(2.0,)).shakings
    h, v = (Path(name).resolve() for name in ("h.at2", "v.at2"))
    assert one.name == "h" and one.settings(case, 2.0) == (
        f'excitation.1.record="{h}"',
        "excitation.1.scale=2.0",
        f'excitation.2.record="{v}"',
        "excitation.2.scale=1.0",
    )
    made = read_case(case.path, (*case.settings, *one.settings(case, 2.0)))
    assert [table["scale"] for table in made.tables["excitation"]] == [2.0, 1.0]
    single = tmp_path / "single.toml"
    single.write_text(
        '[mesh]\ntype = "WallMesh"\n[excitation]\ntype = "GroundMotion"\nrecord = {path = "r"}\n'
        "[run]\ndt = 1\n"
    )
    (one,) = IDA(read_case(single), ["h.at2"], ["t"], scales=(2.0,)).shakings
    assert one.settings(read_case(single)) == (
        f'excitation.record.path="{h}"',
        "excitation.scale=1.0",
    )


@pytest.mark.long
def test_measures() -> None:
    """Degrees: f times the motion has f**degree of the measure. Demands skip what is no number."""
    record = Record(np.sin(0.3 * np.arange(400)), 0.01)
    for word in ("pga", "pgv", "pgd", "arias", "cav", "housner", "sa:0.3"):
        measure = read_intensity(word)
        found = measure.compute(scaled(record, factor=measure.scale(record, 2.5)))
        assert found == pytest.approx(2.5, rel=1e-9), word
        grown = 3.0**measure.degree * measure.compute(record)
        assert measure.compute(scaled(record, factor=3.0)) == pytest.approx(grown, rel=1e-9)
    values = {"x": np.array([1.0, np.nan, -4.0, 2.0])}
    found = [
        read_demand(f"x{way}").compute(values) for way in ("", ":absmax", ":max", ":min", ":last")
    ]
    assert found == [4.0, 4.0, 2.0, -4.0, 2.0]


def test_fractiles_of_straight_curves() -> None:
    """EDP = c IM with c = 1, 2, 3: median 2 IM, fractiles linear between the records (numpy's
    quantile): 1.32, 2.68."""
    curves = {
        str(c): (np.array([3.0, 1.0, 2.0 + c]), c * np.array([3.0, 1.0, 2.0 + c]))
        for c in (1, 2, 3)
    }
    levels, values = compute_fractiles(curves, (0.16, 0.5, 0.84))
    assert levels.tolist() == [1.0, 3.0]
    assert values == pytest.approx(np.outer(levels, [1.32, 2.0, 2.68]))
    assert len(compute_fractiles({"1": curves["1"]}, (0.5,))[0]) == 0
    apart = {"1": (np.array([1.0, 2.0]), np.ones(2)), "2": (np.array([3.0, 4.0]), np.ones(2))}
    assert len(compute_fractiles(apart, (0.5,))[0]) == 0


def test_the_picture_of_many_records(tmp_path: Path) -> None:
    """Without names where records are many, with crosses for failed runs, also when there is
    nothing to scale."""
    curves = {str(k): (np.arange(3.0), k * np.arange(3.0)) for k in range(8)}
    panels = [
        DemandPanel("a", "m", curves, *compute_fractiles(curves, (0.16, 0.5, 0.84)), (1.5,)),
        DemandPanel("b", "-", {"0": (np.ones(1), np.zeros(1))}, np.zeros(0), np.zeros((0, 3))),
    ]
    assert (
        plot_ida(panels, tmp_path / "ida.png", intensity="PGA", unit="m/s²").stat().st_size > 4_000
    )


def test_paths_are_quoted_for_toml() -> None:
    for text in ('a "b" \\ c', "ä ☃ 😀", "tab\tline\n\x7f"):
        assert tomllib.loads(f"x = {format_value(text)}")["x"] == text
