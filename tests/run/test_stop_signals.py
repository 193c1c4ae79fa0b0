"""Signals end a run after a step, on all ranks, saved; a folder takes one run at a time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from at_step import AtStep
from marched_chain import equal_files, run, run_wall
from summaries import summary_of

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError, Interrupted
from vi_contact.practice.cli.entry import main
from vi_contact.run.files import folder as folder_lock
from vi_contact.run.files.folder import lock_folder
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.stop_signals import SIGNALS, StopSignals

serial = pytest.mark.serial
TESTS, PACKAGE = str(Path(__file__).parents[1] / "support"), str(Path(__file__).parents[2])


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Signals mean what they mean to Python by default, also where a shell, nohup or a test runner
    has changed that."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    for number, handler in before.items():
        if number == signal.SIGINT:
            signal.signal(number, signal.default_int_handler)
        elif handler is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def kill(number: int) -> Callable[[], None]:
    """Sends itself a signal."""
    return lambda: os.kill(os.getpid(), number)


@serial
@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_the_run_after_the_step(tmp_path: Path, number: signal.Signals) -> None:
    """Checkpoint, summary and one sentence; the old handlers are back, and the restart is the
    straight run."""
    before = [signal.getsignal(one) for one in SIGNALS]
    record = [Energy(), Contact(), AtStep(57, kill(number))]
    with pytest.raises(
        Interrupted, match=rf"{number.name} ended the run after step 57, .* checkpoint in '"
    ) as caught:
        run(tmp_path / "parts", 100, record=record)
    assert caught.value.number == number and isinstance(caught.value, KeyboardInterrupt)
    assert [signal.getsignal(one) for one in SIGNALS] == before
    found = summary_of(tmp_path / "parts")
    assert (found["status"], found["steps"], found["reason"]) == (
        "interrupted",
        57,
        str(caught.value),
    )
    assert "interrupted after 57 steps" in (tmp_path / "parts" / "run.log").read_text()
    record = [Energy(), Contact(), AtStep(-1, bool)]
    run(tmp_path / "parts", 100, record=record, restart=True)
    run(tmp_path / "straight", 100, record=record)
    assert equal_files(tmp_path / "parts", tmp_path / "straight")


@serial
def test_a_signal_in_the_last_step(tmp_path: Path) -> None:
    """The run is whole; whoever sent the signal gets what it asked for after it."""
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path, 20, record=[AtStep(20, kill(signal.SIGINT))])
    assert summary_of(tmp_path)["status"] == "finished"


@serial
def test_what_is_ignored_stays_ignored() -> None:
    """nohup, jobs in the background, and handlers that the caller wrote himself."""
    got: list[int] = []
    with (
        changed(signal.SIGHUP, signal.SIG_IGN),
        changed(signal.SIGTERM, lambda number, frame: got.append(number)),
    ):
        kept = run(None, 30, record=[AtStep(5, kill(signal.SIGHUP))])
        run(None, 30, record=[AtStep(5, kill(signal.SIGTERM))])
    assert len(kept.history["t"]) == 31 and got == [signal.SIGTERM]


@contextmanager
def changed(number: int, handler: Any) -> Iterator[None]:
    """Another handler for a while."""
    before = signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, before)


@serial
def test_in_a_thread() -> None:
    """Only the main thread has handlers; a run in another one goes through."""
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(run(None, 30)))
    thread.start()
    thread.join()
    assert len(found[0].history["t"]) == 31


@serial
def test_second_ctrl_c() -> None:
    """It ends the process at once, whatever it does."""
    code = (
        "import os, signal, time\nfrom vi_contact.run.stop_signals import StopSignals\nwith "
        "StopSignals():\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n    os.kill(os.getpid(), signal.SIGINT)\n    "
        "time.sleep(600)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": PACKAGE}, timeout=600
    )
    assert done.returncode == -signal.SIGINT


@serial
def test_exit_status_of_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One sentence on standard error, 128 + n."""
    monkeypatch.setattr("vi_contact.practice.cli.entry.world", SerialComm)
    for error, status in (
        (Interrupted("SIGTERM ended the run", signal.SIGTERM), 143),
        (KeyboardInterrupt(), 130),
    ):

        def stop(*_: Any, error: BaseException = error, **__: Any) -> None:
            raise error

        monkeypatch.setattr(
            "vi_contact.practice.cli.entry.build_parser", lambda *_, stop=stop: Parser(stop)
        )
        assert main(["anything"]) == status
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1 and said.err.startswith("vi-contact: ")


class Parser:
    """Stands for the parser of all commands."""

    def __init__(self, run: Any) -> None:
        self.run = run

    def parse_args(self, arguments: Any) -> Parser:
        return self


def test_one_rank_gets_the_signal(comm: Any, shared_tmp: Path) -> None:
    """The last rank gets SIGTERM: all end after the same step, and what is on disk goes on like the
    straight run."""
    pytest.importorskip("dolfinx")
    action = kill(signal.SIGTERM) if comm.rank == comm.size - 1 else bool
    with pytest.raises(Interrupted, match="SIGTERM ended the run after step 9, "):
        run_wall(comm, shared_tmp, 20, record=[Energy(), AtStep(9, action)])
    parts = run_wall(comm, shared_tmp, 20, record=[Energy(), AtStep(-1, bool)], restart=True)
    straight = run_wall(comm, None, 20, record=[Energy(), AtStep(-1, bool)])
    for name in ("t", "k", "energy_kinetic", "energy_strain"):
        size = np.abs(straight.history[name]).max()
        assert np.abs(parts.history[name] - straight.history[name]).max() <= 1e-12 * size, name


# One run at a time
# --------------------------------------------------------------------------------------------------

FIRST = """
import sys
sys.path.insert(0, {tests!r})
from marched_chain import run
from pathlib import Path
run(Path({out!r}), 10**6, checkpoint_every=10)
"""


@contextmanager
def another_run(out: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A run of another process, under way."""
    code = FIRST.format(tests=TESTS, out=str(out))
    child = subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": PACKAGE},
        stderr=subprocess.PIPE,
    )
    try:
        deadline = time.monotonic() + 600
        while not (out / "checkpoint.npz").is_file():
            assert child.poll() is None and time.monotonic() < deadline
            time.sleep(0.01)
        yield child
    finally:
        child.kill()
        child.communicate()


@pytest.mark.long
@serial
def test_two_runs_into_one_folder(tmp_path: Path) -> None:
    """The second is refused and changes nothing; the first is whole; killed, it holds nobody up."""
    with another_run(tmp_path) as first:
        with pytest.raises(
            InputError, match=rf"another run writes into .* \(process {first.pid} on .*\): wait"
        ):
            run(tmp_path, 5)
        with pytest.raises(InputError, match="another run writes into"):
            run(tmp_path, 5, restart=True)
        alone = run(None, 20, restart=tmp_path)
        assert len(alone.history["t"]) >= 21
        first.kill()
        first.wait()
        assert (tmp_path / folder_lock.LOCK).exists()
        (tmp_path / ".checkpoint.npz.1234567.tmp").write_bytes(b"half of it")
        steps = (tmp_path / "history.csv").read_bytes().count(b"\n") + 20
        run(tmp_path, steps, restart=True)
    run(tmp_path / "straight", steps)
    assert equal_files(tmp_path, tmp_path / "straight")
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


@serial
def test_a_lock_that_is_free_again(tmp_path: Path) -> None:
    """Taken twice in one thread, refused in another, gone afterwards, and free after an error."""
    refused: list[str] = []

    def other() -> None:
        try:
            with lock_folder(SerialComm(), tmp_path):
                refused.append("no")
        except InputError as error:
            refused.append(str(error))

    with lock_folder(SerialComm(), tmp_path), lock_folder(SerialComm(), tmp_path):
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
    assert "another run writes into" in refused[0] and list(tmp_path.iterdir()) == []
    with pytest.raises(ZeroDivisionError), lock_folder(SerialComm(), tmp_path):
        raise ZeroDivisionError
    other()
    assert refused[1] == "no"


@serial
def test_a_file_system_without_locks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The run goes on, and the log says that nothing guards the folder."""

    def refuse(*_: Any) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("vi_contact.run.files.folder.fcntl.flock", refuse)
    run(tmp_path, 5)
    assert "file system without locks (Operation not supported)" in caplog.text


def test_all_ranks_are_refused(comm: Any, shared_tmp: Path) -> None:
    """A folder that rank 0 finds locked."""
    from vi_contact.fem.mesh.communicators import MpiComm

    holder = open(shared_tmp / folder_lock.LOCK, "wb") if comm.rank == 0 else None  # noqa: SIM115
    if holder is not None:
        folder_lock.fcntl.flock(holder, folder_lock.fcntl.LOCK_EX)
    with (
        pytest.raises(InputError, match="another run writes into"),
        lock_folder(MpiComm(comm), shared_tmp),
    ):
        pass
    if holder is not None:
        holder.close()
    with lock_folder(MpiComm(comm), shared_tmp):
        pass


@serial
def test_nothing_is_heard_outside() -> None:
    """Leaving without a run that acts: the signal comes again, to the old handler."""
    with pytest.raises(KeyboardInterrupt), StopSignals():
        os.kill(os.getpid(), signal.SIGINT)
