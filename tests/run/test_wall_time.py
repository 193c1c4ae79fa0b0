"""A wall time ends a run before the queue does: read as Slurm reads it, decided alike on all ranks,
and restarted."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from at_step import AtStep
from marched_chain import equal_files, run, run_wall
from summaries import summary_of

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError, Interrupted, OutOfTime
from vi_contact.practice.cli.entry import main
from vi_contact.run import wall_time as watch
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.wall_time import WallTime, measure_age, parse_wall_time

serial = pytest.mark.serial
PACKAGE = str(Path(__file__).parents[2])


class Clock:
    """Stands for the age of the process; a run advances it step by step."""

    def __init__(self, now: float = 0.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now

    def takes(self, seconds: float) -> Any:
        """A recorder that lets every step take so long."""
        clock = self

        class Slow(AtStep):
            def row(self, report: Any) -> dict[str, float]:
                clock.now += seconds
                return {"one": 1.0}

        return Slow(-1, bool)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[Clock]:
    found = Clock()
    monkeypatch.setattr(watch, "measure_age", found)
    yield found


@serial
@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("90", 5400),
        ("1:30", 90),
        ("11:30:00", 41400),
        ("2-12", 216000),
        ("2-12:30", 217800),
        ("2-12:30:15", 217815),
        ("0-0:0:1", 1),
        ("120:00", 7200),
    ],
)
def test_slurm_reads_it_so(text: str, seconds: float) -> None:
    """The six forms of sbatch(1), --time: the same digits mean minutes first without days, hours
    first with them."""
    assert parse_wall_time(text) == seconds


@serial
@pytest.mark.parametrize(
    "text",
    [
        "",
        "0",
        "0:00",
        "-1",
        "1:2:3:4",
        "1-2:3:4:5",
        "1-",
        "half",
        "1.5",
        "1:",
        " 1",
        60,
        "٣",
        "9" * 400,
        "UNLIMITED",
    ],
)
def test_what_slurm_does_not_read(text: Any, tmp_path: Path) -> None:
    """One sentence, before anything is written; no folder, no wall time."""
    with pytest.raises(
        InputError, match="the wall time is .*: give minutes, minutes:seconds, .*'11:30:00'"
    ):
        run(tmp_path / "none", 5, wall_time=text)
    assert not (tmp_path / "none").exists()
    with pytest.raises(InputError, match="wall_time needs a folder"):
        run(None, 5, wall_time="5")


@serial
def test_what_is_left_is_never_less_than_the_margin(clock: Clock) -> None:
    """A step of 30 s, a checkpoint of 10 s: over once no more than 2 (30 + 2 · 10) s are left, no
    earlier."""
    one = WallTime("1000:00")
    one.begin()
    assert one.unsure
    with one.saving():
        clock.now += 10.0
    assert not one.unsure and not one.over()
    clock.now += 30.0
    assert not one.over()
    for before, after in pairwise(range(40, 60000)):
        clock.now = float(after)
        if one.over():
            assert 60000.0 - before > 100.0 >= one.left
            return
    raise AssertionError("it is never over")


@serial
def test_without_a_wall_time_there_is_no_end(clock: Clock) -> None:
    one = WallTime()
    clock.now = 1e12
    assert not one.unsure and not one.over()


@serial
def test_the_run_ends_before_the_time_and_goes_on(tmp_path: Path, clock: Clock) -> None:
    """Steps of 10 s, 600 s: saved, told and of a status of its own; the restart is the straight run
    to the last bit."""
    clock.now = 35.0  # what came before the run counts
    record = [Energy(), Contact(), clock.takes(10.0)]
    with pytest.raises(
        OutOfTime,
        match=r"s left of the wall time 10:00 ended the run after step 55, .* restart it "
        r"from its checkpoint in '",
    ) as caught:
        run(tmp_path / "parts", 100, record=record, wall_time="10:00")
    assert caught.value.status == 75 and isinstance(caught.value, Interrupted)
    found = summary_of(tmp_path / "parts")
    assert (found["status"], found["steps"], found["reason"]) == (
        "interrupted",
        55,
        str(caught.value),
    )
    assert "565 s are left of the wall time 10:00" in (tmp_path / "parts" / "run.log").read_text()
    clock.now = 0.0
    run(tmp_path / "parts", 100, record=record, restart=True, wall_time="1:00:00")
    run(tmp_path / "straight", 100, record=record)
    assert equal_files(tmp_path / "parts", tmp_path / "straight")


@serial
def test_too_little_time_still_makes_a_step(tmp_path: Path, clock: Clock) -> None:
    """A chain of restarts ends, however short their time: every one of them does a step. The last
    one finishes."""
    record = [Energy(), Contact(), clock.takes(100.0)]
    for k in (1, 2, 3):
        with pytest.raises(OutOfTime, match=f"after step {k}, "):
            run(tmp_path, 4, record=record, restart=k > 1, wall_time="0:30")
    assert (
        run(tmp_path, 4, record=record, restart=True, wall_time="0:30").facts["status"]
        == "finished"
    )


def test_one_rank_is_late(comm: Any, shared_tmp: Path, clock: Clock) -> None:
    """The last rank's clock alone runs out: all end after the same step, and go on like the
    straight run."""
    pytest.importorskip("dolfinx")
    seconds = 10.0 if comm.rank == comm.size - 1 else 0.0
    with pytest.raises(OutOfTime, match="after step 9, "):
        run_wall(comm, shared_tmp, 20, record=[Energy(), clock.takes(seconds)], wall_time="1:45")
    assert summary_of(shared_tmp)["steps"] == 9  # written when the first rank is through
    clock.now = 0.0
    parts = run_wall(comm, shared_tmp, 20, record=[Energy(), clock.takes(0.0)], restart=True)
    straight = run_wall(comm, None, 20, record=[Energy(), clock.takes(0.0)])
    for name in ("t", "k", "energy_kinetic", "energy_strain"):
        size = np.abs(straight.history[name]).max()
        assert np.abs(parts.history[name] - straight.history[name]).max() <= 1e-12 * size, name


@pytest.mark.long
@serial
def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 75 and one sentence; what is no wall time is refused."""
    pytest.importorskip("dolfinx")
    monkeypatch.setattr("vi_contact.practice.cli.entry.world", SerialComm)
    monkeypatch.setattr(watch, "measure_age", Clock(300.0))
    short = ["run", "wall", "--steps", "3", "--quiet", "--out", str(tmp_path / "wall")]
    assert main([*short, "--wall-time", "0:05:00"]) == 75
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith(
        "vi-contact: 0 s left of the wall time 0:05:00 ended the run after"
    )
    assert said.err.count("\n") == 1
    assert main([*short, "--wall-time", "soon"]) == 1
    said = capsys.readouterr().err
    assert "the wall time is" in said and "give minutes" in said


@serial
@pytest.mark.slow
def test_the_batch_script_of_the_guide(tmp_path: Path) -> None:
    """With srun and sbatch that run in place: jobs whose second is over when they begin, as they
    are as old as their shell, make a step each and go on from one another until all is done."""
    pytest.importorskip("dolfinx")
    guide = (Path(PACKAGE) / "docs" / "guide" / "clusters.md").read_text(encoding="utf-8")
    script = guide.split("```bash\n")[1].split("```")[0]
    for old, new in (
        ("case=dam.toml", "case=wall"),
        ("--wall-time 11:45:00", "--wall-time 0:01 --steps 2"),
    ):
        assert script.count(old) == 1
        script = script.replace(old, new)
    (tmp_path / "job.sh").write_text(script)
    tools = {
        "srun": (
            'while [ "$1" != vi-contact ]; do shift; done; shift; sleep 1; exec "$PYTHON" -m '
            'vi_contact "$@"'
        ),
        "sbatch": 'echo again >> "$SLURM_SUBMIT_DIR/jobs"; exec bash "$1"',
    }
    for name, does in tools.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{does}\n")
        (tmp_path / name).chmod(0o755)
    environment = {
        "PYTHON": sys.executable,
        "PYTHONPATH": PACKAGE,
        "SLURM_SUBMIT_DIR": str(tmp_path),
        "PATH": f"{tmp_path}:{os.environ['PATH']}",
    }
    done = subprocess.run(
        ["bash", "job.sh"],
        cwd=tmp_path,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert (tmp_path / "jobs").read_text().split() == ["again"], done.stderr
    found = summary_of(tmp_path / "results" / "dam")
    assert (found["status"], found["steps"], found["restarted_from_step"]) == ("finished", 2, 1)
    assert (
        done.stderr.count("of the wall time 0:01 ended the run after step") == 1
        and done.returncode == 75
    )


@serial
def test_the_age_is_that_of_the_process() -> None:
    """A process that has slept before it imports anything is at least so old, and no older than who
    has started it."""
    code = (
        "import time\ntime.sleep(0.5)\nfrom vi_contact.run.wall_time import measure_age\n"
        "print(measure_age())"
    )
    begin = time.monotonic()
    said = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": PACKAGE},
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    # a tick of the kernel is a hundredth of a second
    assert 0.5 <= float(said) <= time.monotonic() - begin + 0.1
    assert measure_age() >= float(said)
