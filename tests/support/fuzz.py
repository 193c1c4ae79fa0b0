"""The seeds of every fuzz test, and the inputs that were once found to fail.

A fuzz test makes its inputs from a seed. The suite takes seed 0, so that it finds the same in every
run; ``bash tests/fuzz.sh --seed N`` takes others. An input that fails there is written into the
folder ``fixed`` beside the test, and every later run of the suite begins with it:

    # its fixed inputs are in <folder of the test>/fixed/records
    FUZZ = Fuzz("records", __file__)

    @pytest.mark.fuzz
    def test_records() -> None:
        # the fixed ones first, then 100 new ones
        FUZZ.each(100, lambda dice: mutated(TEXT, dice), check)

A property test of hypothesis takes the same seed, and finds the smallest input that fails:

    @FUZZ.property(values=st.lists(st.floats(-1.0, 1.0)), examples=100)
    def test_sums(values: list[float]) -> None: ...

An input is made of what JSON holds, and of bytes. On several ranks all ranks make the same inputs;
take ``each`` there, as the search of hypothesis for a smaller input is not collective.
"""

from __future__ import annotations

import base64
import functools
import json
import os
import random
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import pytest

SEED = int(os.environ.get("VI_CONTACT_FUZZ_SEED", "0"))
KEEP = os.environ.get("VI_CONTACT_FUZZ_KEEP", "") == "1"  # write inputs that fail into the tree
RANK = int(os.environ.get("OMPI_COMM_WORLD_RANK", os.environ.get("PMI_RANK", "0")))

T = TypeVar("T")


class Fuzz:
    """A fuzz test: its name, and where its fixed inputs are."""

    def __init__(self, name: str, file: str) -> None:
        self.name = name
        self.folder = Path(file).resolve().parent / "fixed" / re.sub(r"\W+", "_", name)

    def dice(self, number: int) -> random.Random:
        """Return the dice of one input: others for every test, seed and number, the same on every
        machine and rank."""
        return random.Random(f"{self.name} {SEED} {number}")

    def fixed(self) -> list[tuple[str, Any]]:
        """Return (label, input) of every input that has failed once."""
        files = sorted(self.folder.glob("*.json"))
        return [(f"fixed/{self.folder.name}/{path.name}", read_input(path)) for path in files]

    def each(
        self, count: int, make: Callable[[random.Random], T], check: Callable[[T], object]
    ) -> None:
        """Check the fixed inputs and so many new ones. The first that fails is kept, and named in
        the failure."""
        for label, value in self.fixed():
            with self.keeping(label, value, new=False):
                check(value)
        for number in range(count):
            value = make(self.dice(number))
            with self.keeping(f"seed-{SEED}-number-{number}", value):
                check(value)

    @contextmanager
    def keeping(self, label: str, value: Any, *, new: bool = True) -> Iterator[None]:
        """Name the input in whatever is raised inside, and write it into the folder of fixed inputs
        if asked to."""
        try:
            yield
        except Exception as error:  # of any kind: it is raised again, with the name of the input
            error.add_note(f"the input of {self.name} that fails: {label}: {value!r:.2000}")
            if new and KEEP and RANK == 0:
                self.folder.mkdir(parents=True, exist_ok=True)
                write_input(self.folder / f"{label}.json", value)
                error.add_note(f"it was written to {self.folder / label}.json")
            raise

    def property(
        self, *, examples: int = 100, **strategies: Any
    ) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        """Make a property test of hypothesis: arguments by name -> strategy. Skipped where
        hypothesis is missing.

        With seed 0 its examples are those that follow from the test alone (derandomize); else those
        of the seed. The fixed inputs come first. Fixtures are not available inside, apart from
        those that last for the session."""
        hypothesis = pytest.importorskip("hypothesis")

        def made(test: Callable[..., Any]) -> Callable[..., Any]:
            settings = hypothesis.settings(
                max_examples=examples,
                deadline=None,
                database=None,
                derandomize=SEED == 0,
                suppress_health_check=list(hypothesis.HealthCheck),
            )

            def kept(**values: Any) -> None:
                # the last one that is tried is the smallest that fails
                with self.keeping(f"seed-{SEED}", values):
                    test(**values)

            kept.__name__ = test.__name__
            search = settings(hypothesis.given(**strategies)(kept))
            if SEED:
                search = hypothesis.seed(SEED)(search)

            @functools.wraps(test)
            def run() -> None:
                for label, values in self.fixed():
                    with self.keeping(label, values, new=False):
                        test(**values)
                search()

            del run.__wrapped__  # pytest would take the strategies' names for fixtures
            return pytest.mark.fuzz(run)

        return made


def write_input(path: Path, value: Any) -> None:
    """Write an input as JSON; bytes become {"bytes": base64}."""
    path.write_text(json.dumps(_plain(value), indent=1) + "\n", "utf-8")


def read_input(path: Path) -> Any:
    """Return an input as it was written; tuples have become lists."""
    return _whole(json.loads(path.read_text("utf-8")))


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"bytes": base64.b64encode(value).decode()}
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return _plain(value.tolist())
    return value


def _whole(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == {"bytes"}:
            return base64.b64decode(value["bytes"])
        return {key: _whole(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_whole(one) for one in value]
    return value
