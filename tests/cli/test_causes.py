"""The causes that sentences name: memory, permissions, closed streams, settings of matplotlib; none
is guessed."""

from __future__ import annotations

import errno
import json
import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_run import drawn_run
from marched_chain import chain, run

from vi_contact import ground_motion
from vi_contact.core.algebra import SerialComm
from vi_contact.core.checks import on_all
from vi_contact.core.errors import InputError, ViContactError, is_of_machine, is_of_memory
from vi_contact.core.files import describe_os_error
from vi_contact.practice.cli.entry import main
from vi_contact.run.files.checkpoint import read_checkpoint
from vi_contact.run.files.reading import read_run
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
MEMORY: list[Exception] = [
    MemoryError(),
    OSError(errno.ENOMEM, "Cannot allocate memory"),
    RuntimeError("Unable to allocate 3.0 GiB for an array"),
    OSError("Can't read: out of memory"),
]
MODEL = {
    "title": "x",
    "dimension": 2,
    "unknowns": 3,
    "supports": [],
    "contact": [],
    "outline": [{"group": "", "lines": [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]]}],
}
NO_MEMORY = "vi-contact: out of memory: take a coarser mesh"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with frames, and a record beside it."""
    from mpi4py import MPI

    place = tmp_path_factory.mktemp("causes")
    drawn_run(MPI.COMM_WORLD, place / "run")
    motion = ground_motion.Record(np.sin(np.arange(4000.0)), 0.01)
    ground_motion.write_at2(motion, place / "motion.at2", "g")
    return place


def raising(error: BaseException) -> Callable[..., Any]:
    def call(*_: Any, **__: Any) -> Any:
        raise error

    return call


WHERE = (
    "vi_contact.run.files.reading.read_bytes",
    "vi_contact.run.files.reading.open_hdf5",
    "vi_contact.run.files.reading.parse_numbers",
    "vi_contact.core.hdf5.StoredFile",
    "vi_contact.core.hdf5.StoredGroup.__getitem__",
    "vi_contact.practice.studies.report.sketch",
    "matplotlib.figure.Figure.savefig",
)


@pytest.mark.parametrize(
    ("place", "error"), [(place, MEMORY[k % len(MEMORY)]) for k, place in enumerate(WHERE)]
)
def test_no_memory_is_no_damage(
    folder: Path,
    place: str,
    error: Exception,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Wherever a report has no memory, it says so, and not that a file is damaged."""
    (folder / "run" / "model.json").write_text(json.dumps(MODEL))
    module, _, name = place.rpartition(".")
    # the room has a function of the module's name
    owner = sys.modules.get(module) or pkgutil.resolve_name(module)
    monkeypatch.setattr(owner, name, raising(error))
    assert main(["report", str(folder / "run")]) == 1
    assert capsys.readouterr().err.startswith(NO_MEMORY)


@pytest.mark.parametrize("error", MEMORY, ids=repr)
@pytest.mark.parametrize("place", ["open_to_read", "np.load", "compute_checksum"])
def test_a_checkpoint_that_does_not_fit_is_not_damaged(
    tmp_path: Path, place: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path, 3)
    monkeypatch.setattr(f"vi_contact.run.files.checkpoint.{place}", raising(error))
    with pytest.raises((type(error), ViContactError)) as caught:
        read_checkpoint(tmp_path, chain(), scheme=ZienkiewiczWoodTaylor(), dt=5e-3)
    assert "damaged" not in str(caught.value) and is_of_memory(caught.value)


@pytest.mark.parametrize("number", [errno.EACCES, errno.EMFILE])
def test_permissions_and_limits_are_no_damage(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path, 3)
    error = OSError(number, os.strerror(number), str(tmp_path / "history.h5"))
    monkeypatch.setattr("vi_contact.run.files.reading.open_hdf5", raising(error))
    with pytest.raises(OSError, match=os.strerror(number)) as caught:
        read_run(tmp_path)
    words = {errno.EACCES: "change its permissions", errno.EMFILE: "raise the limit of open files"}
    assert (
        f"history.h5' cannot be opened ({os.strerror(number)}): {words[number]}"
        in describe_os_error(caught.value)
    )


def test_sentences_of_the_system_name_only_what_it_names() -> None:
    assert describe_os_error(OSError(errno.ENOSPC, "No space left on device")).startswith(
        "the disk is full: a file could not"
    )
    assert "output folder cannot" not in describe_os_error(OSError("something else"))
    assert describe_os_error(BrokenPipeError(errno.EPIPE, "Broken pipe", "/dev/stdout")).startswith(
        "what reads '/dev/stdout'"
    )
    assert not is_of_machine(
        OSError("Unable to open file (file signature not found)")
    ) and not is_of_machine(ValueError("x"))


def test_a_function_of_the_user_s_without_memory() -> None:
    """It is told as what it is; the error that it came from is kept."""
    with pytest.raises(
        InputError, match="a load ended in MemoryError: .*: the machine refused it"
    ) as caught:
        on_all(SerialComm(), "a load", raising(MemoryError("no room")))
    assert is_of_memory(caught.value)
    with pytest.raises(
        InputError, match="a load ended in ZeroDivisionError: .*: correct its function"
    ) as other:
        on_all(SerialComm(), "a load", lambda: 1 / 0)
    assert not is_of_memory(other.value)


# Streams
# --------------------------------------------------------------------------------------------------


def shell(line: str, **more: str) -> tuple[int, str, str]:
    """(status, standard output, standard error) of a line of bash; V is vi-contact."""
    environment = (
        dict(os.environ) | {"PYTHONPATH": str(ROOT), "V": f"{sys.executable} -m vi_contact"} | more
    )
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, check=False, env=environment
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.long
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_no_hindrance(folder: Path, tmp_path: Path, closed: str) -> None:
    """A daemon has none; what libraries print does not get into the files of the run, which would
    get their numbers."""
    if closed.count("-") == 3:  # files get all three numbers
        status, _, said = shell(f"$V run wall --steps 2 --out {tmp_path}/run {closed}")
        assert status == 0, said
        assert len(read_run(tmp_path / "run").history["t"]) == 3
    status, _, said = shell(f"$V motion info nowhere {closed}")
    assert status == 1 and "Error" not in said


@pytest.mark.long
def test_a_reader_that_has_gone_is_no_error(folder: Path, tmp_path: Path) -> None:
    """As of "| head -1": what was to be done is done, quietly; where standard output is the file to
    write, the status is 128 + SIGPIPE, as shells have it."""
    line = (
        f"$V motion convert {folder}/motion.at2 {tmp_path}/out.txt | true; echo ${{PIPESTATUS[0]}}"
    )
    assert shell(line)[1:] == ("0\n", "")
    assert (tmp_path / "out.txt").read_text().count("\n") > 4000
    line = f"$V motion convert {folder}/motion.at2 /dev/stdout | true; echo ${{PIPESTATUS[0]}}"
    assert shell(line)[1:] == ("141\n", "")


@pytest.mark.long
@pytest.mark.parametrize(
    "words",
    [
        "report RUN",
        "motion plot MOTION --out x.png",
    ],
)
def test_a_backend_that_matplotlib_does_not_know(folder: Path, tmp_path: Path, words: str) -> None:
    """It is the setting that is wrong, and no file."""
    (folder / "run" / "model.json").write_text(json.dumps(MODEL))
    words = words.replace("RUN", str(folder / "run")).replace("MOTION", str(folder / "motion.at2"))
    status, _, said = shell(f"cd {tmp_path}; $V {words}", MPLBACKEND="nonsense")
    assert (
        status == 1
        and "correct the environment variable MPLBACKEND" in said
        and "damaged" not in said
    )
    assert said.count("\n") == 1
