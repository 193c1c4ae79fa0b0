"""A run that is killed at known places, in the middle of its work on files, several times: nothing
is lost or wrong."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from fuzz import Fuzz
from marched_chain import run

from vi_contact.run.files.reading import read_run

pytestmark = [pytest.mark.serial, pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")]
FUZZ = Fuzz("kills at places", __file__)
COUNT, KILLS, STEPS = 3, 2, 40
PLACES = (
    "vi_contact.core.files.write_all",
    "vi_contact.run.files.history.write_all",
    "os.replace",
    "os.fsync",
    "vi_contact.run.files.folder.remove",
    "vi_contact.run.files.log.write_all",
)


def counted(patch: pytest.MonkeyPatch, at: int) -> list[int]:
    """The number of such calls so far; the process is killed before the call of this number, or in
    its middle."""
    seen = [0]

    def made(action: Callable[..., Any], writes: bool) -> Callable[..., Any]:
        def call(*args: Any, **more: Any) -> Any:
            seen[0] += 1
            if seen[0] == at:
                if writes:
                    args[0].write(args[1][: len(args[1]) // 2])
                os.kill(os.getpid(), signal.SIGKILL)
            return action(*args, **more)

        return call

    for place in PLACES:
        module, _, name = place.rpartition(".")
        owner = __import__(module, fromlist=[name])
        patch.setattr(owner, name, made(getattr(owner, name), name == "write_all"))
    return seen


def killed(folder: Path, at: int) -> bool:
    """Run, or go on with the run, in a process that kills itself there; whether it did."""
    child = os.fork()
    if child == 0:
        try:
            with pytest.MonkeyPatch.context() as patch:
                counted(patch, at)
                run(
                    folder, STEPS, checkpoint_every=7, restart=(folder / "checkpoint.npz").is_file()
                )
            os._exit(0)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, "the run ended with an error"
    return os.WIFSIGNALED(status)


@pytest.mark.fuzz
@pytest.mark.slow
def test_a_run_that_is_killed_again_and_again(tmp_path: Path) -> None:
    """In the end its histories and its state are those of the straight run, to the last bit."""
    with pytest.MonkeyPatch.context() as patch:
        seen = counted(patch, 0)
        straight = run(tmp_path / "straight", STEPS, checkpoint_every=7)
    assert seen[0] > 20
    killings = []

    def check(places: list[int]) -> None:
        folder = tmp_path / f"killed {' '.join(map(str, places))}"
        for at in places:
            killings.append(killed(folder, at))
            if (folder / "history.csv").is_file() and (folder / "history.csv").read_bytes().count(
                b"\n"
            ) > 1:
                read_run(folder)
        found = run(
            folder, STEPS, checkpoint_every=7, restart=(folder / "checkpoint.npz").is_file()
        )
        assert np.array_equal(found.state.u, straight.state.u)
        for name, values in read_run(tmp_path / "straight").history.items():
            assert np.array_equal(read_run(folder).history[name], values, equal_nan=True), name

    def make(dice: Random) -> list[int]:
        return [dice.randrange(1, seen[0]) for _ in range(KILLS)]

    FUZZ.each(COUNT, make, check)
    assert sum(killings) > COUNT
