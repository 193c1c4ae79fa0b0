"""Kills a run of several ranks at random instants, restarts it, and compares the end with the
straight run.

python3 tests/support/kill_nine.py [KILLS] [RANKS]      # 20 on 3 ranks; needs mpirun
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

TESTS = Path(__file__).parent
CODE = """
import sys
sys.path.insert(0, {tests!r})
from mpi4py import MPI
from pathlib import Path
from marched_chain import run_wall
folder = Path({folder!r})
restart = (folder / "checkpoint.npz").is_file()
run_wall(MPI.COMM_WORLD, folder, {steps}, checkpoint_every=5, restart=restart)
"""
ROUND_OFF = ("certificate", "energy_defect", "loss_algorithmic")  # columns that are nothing else
PATIENCE = 500.0  # s: Python, DOLFINx and the forms are loaded, or compiled, beside other programs


def started(folder: Path, steps: int, ranks: int) -> subprocess.Popen[bytes]:
    """The run under mpirun, from its checkpoint where there is one; in an environment without what
    MPI put there."""
    mpi = ("OMPI_COMM", "OMPI_UNIVERSE", "PMIX_", "PMI_", "OMPI_MCA_ess", "OMPI_MCA_orte")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(mpi)}
    environment["PYTHONPATH"] = os.pathsep.join(
        [str(TESTS.parents[1]), environment.get("PYTHONPATH", "")]
    )
    code = CODE.format(tests=str(TESTS), folder=str(folder), steps=steps)
    command = ["mpirun", "-n", str(ranks), sys.executable, "-c", code]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def ranks_of(launcher: int) -> list[int]:
    """Processes that mpirun has started, whichever of its threads did."""
    lists = Path(f"/proc/{launcher}/task").glob("*/children")
    return sorted(int(pid) for one in lists for pid in one.read_text().split())


def lines(folder: Path) -> int:
    """Whole lines of history.csv."""
    path = folder / "history.csv"
    return path.read_bytes().count(b"\n") if path.is_file() else 0


def killed(folder: Path, ranks: int, dice: random.Random) -> int:
    """Lets the run go on for a while and kills one of its ranks; the whole lines that it has
    left."""
    before = lines(folder)
    process = started(folder, 10**6, ranks)
    deadline = time.monotonic() + PATIENCE
    while not (folder / "checkpoint.npz").is_file() or lines(folder) <= before:
        assert process.poll() is None and time.monotonic() < deadline, "the run does not go on"
        time.sleep(0.02)
    time.sleep(dice.uniform(0.0, 0.5))
    os.kill(dice.choice(ranks_of(process.pid)), signal.SIGKILL)
    assert process.wait(PATIENCE) != 0
    return lines(folder)


def check(folder: Path, kills: int, ranks: int, seed: int = 0) -> tuple[int, float]:
    """(rows, largest relative difference of a history from that of the straight run) after so many
    kills; rows that a kill left are not fewer in the end than they were."""
    from marched_chain import run_wall
    from mpi4py import MPI

    dice = random.Random(seed)
    rows = [killed(folder / "killed", ranks, dice) for _ in range(kills)]
    assert rows == sorted(rows)
    steps = rows[-1] + 10
    assert started(folder / "killed", steps, ranks).wait(PATIENCE) == 0
    run_wall(MPI.COMM_SELF, folder / "straight", steps)
    one, other = (
        np.genfromtxt(folder / name / "history.csv", delimiter=",", names=True)
        for name in ("killed", "straight")
    )
    assert one["k"].tolist() == other["k"].tolist() == list(range(steps + 1))
    worst = 0.0
    for name in other.dtype.names or ():
        if name not in ROUND_OFF:
            size = np.nanmax(np.abs(other[name])) or 1.0
            assert np.array_equal(np.isnan(one[name]), np.isnan(other[name])), name
            worst = max(worst, float(np.nanmax(np.abs(one[name] - other[name]))) / size)
    return steps, worst


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]] + [20, 3][len(sys.argv) - 1 :]
    sys.path.insert(0, str(TESTS.parents[1]))
    with tempfile.TemporaryDirectory() as scratch:
        done, difference = check(Path(scratch), *numbers)
    print(
        f"{numbers[0]} kills of a run on {numbers[1]} ranks: {done} steps, histories within "
        f"{difference:.1e}"
    )
