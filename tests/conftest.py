"""One verdict for all ranks: the suite under mpirun fails as a whole, reports once, and never
hangs.

Ranks meet after collection and after every phase (setup, call, teardown) of every test, on a
communicator of their own. A phase that failed on one rank is failed on all, so that all go on with
the same next test. A rank that does not come to the meeting is stuck in a collective call the
others never made: the run is then aborted with the reports known.
"""

from __future__ import annotations

import faulthandler
import functools
import gc
import importlib.machinery
import importlib.util
import itertools
import logging
import os
import re
import shutil
import sys
import tempfile
import time
from array import array
from collections import Counter
from collections.abc import Generator, Iterable, Iterator
from math import inf
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TextIO

import pytest

# The wheels of DOLFINx find the MPI library that mpi4py has loaded before.
if importlib.util.find_spec("dolfinx_solver") is not None:
    import mpi4py.MPI  # noqa: F401

# What programs print is compared with texts: it must not depend on the terminal or the language of
# who runs the tests.
# Gmsh sets a locale that obeys LANGUAGE
os.environ |= {"COLUMNS": "100", "PYTHON_COLORS": "0", "LANGUAGE": "C"}

CLONE = Path(__file__).resolve().parents[1]
RANK = int(os.environ.get("OMPI_COMM_WORLD_RANK", os.environ.get("PMI_RANK", "0")))
SIZE = int(os.environ.get("OMPI_COMM_WORLD_SIZE", os.environ.get("PMI_SIZE", "1")))
NOT_ON_THREE = ("serial", "slow", "two_ranks")
LEFT_OUT = NOT_ON_THREE if SIZE > 2 else ("serial",) if SIZE > 1 else ()
# whether tests/run.sh runs three ranks too, which two ranks can leave work to
THREE_FOLLOW = SIZE == 2 and "3" in os.environ.get("VI_CONTACT_RANKS", "").split()
# what they are made of runs on three ranks, they on two
ABOVE = ("validation", "models", "soil", "studies", "house")
TEST_SECONDS = 600  # a test that takes longer on an idle machine is taken to be stuck
# how long one watch over the tests stands: a new one for each would wait for a thread to end
WATCH_SECONDS = 30
# patience of a rank that has failed: the others are probably waiting for it in a collective call
MEETING_SECONDS = 30
SLOWEST_FILES = 10  # told at the end of a run
# What --quick leaves out: whole programs, pages, pictures and comparisons with what is published.
WHOLE = ("benchmarks", "house", "plots", "validation", "validation_book")

_stderr = pytest.StashKey[TextIO]()
_watched = pytest.StashKey[float]()
_collection_errors: list[str] = []


@functools.cache
def _comm() -> Any:
    from mpi4py import MPI  # here: pure numpy tests need no MPI

    return MPI.COMM_WORLD.Dup()


def _patience(seconds: float) -> float:
    """Seconds for what takes `seconds` on an idle machine, when others are at work here too."""
    return seconds * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def _meet(
    config: pytest.Config, mine: str, *, where: str, seconds: float, dull: bool = False
) -> list[str]:
    """Return the texts of all ranks, in rank order; none where `mine` is `dull` on all of them:
    nearly always, so that a meeting takes one small reduction. Aborts the run if some rank does not
    come within `seconds`."""
    comm, some = _comm(), array("i", [0])
    request = comm.Iallreduce(array("i", [not dull]), some)
    deadline, pause = time.monotonic() + seconds, 1e-5
    while not request.Test():
        if time.monotonic() > deadline:
            _abort(
                config, f"{where}: the other ranks did not arrive within {seconds:.0f} s\n{mine}"
            )
        time.sleep(pause)
        pause = min(1.5 * pause, 1e-3)
    return list(comm.allgather(mine)) if some[0] else []


def _abort(config: pytest.Config, message: str) -> None:
    print(f"\n[rank {RANK} of {SIZE}] {message}", file=config.stash[_stderr], flush=True)
    time.sleep(1)  # mpirun has to pass it on before it kills
    _comm().Abort(1)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--quick",
        action="store_true",
        help="run one case of each test that is not long or slow, without " + ", ".join(WHOLE),
    )


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    os.fsync = _leave_to_the_system  # type: ignore[assignment]
    # the real one: pytest captures fd 2 during tests
    config.stash[_stderr] = os.fdopen(os.dup(2), "w")
    if RANK:  # rank 0 speaks for all
        config.pluginmanager.unregister(name="terminalreporter")
    if _second_half(config) and config.args == ["tests"]:
        # pytest obeys a name all the same
        ignored = [Path(one).resolve() for one in config.getoption("ignore") or ()]
        folders = {path.parent for path in Path("tests").resolve().rglob("test_*.py")}
        named = [
            str(one) for one in folders if not any(one.is_relative_to(other) for other in ignored)
        ]
        config.args[:] = sorted(named, reverse=True)


def _leave_to_the_system(descriptor: int) -> None:
    """In the place of os.fsync: what tests write need not outlast a power cut, and each file waits
    for the disk as long as ten steps take. A process that is killed loses nothing by it."""


def _second_half(config: pytest.Config) -> bool:
    """Whether this is every other process of several: those begin to collect from behind. In a
    fresh tree asserts are rewritten, which takes longer than to import, and so the processes meet
    in the middle, where they find it done."""
    return bool(int(getattr(config, "workerinput", {}).get("workerid", "gw0")[2:]) % 2)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Files that are left out as a whole are not even imported: that takes longer than many of
    their tests."""
    if config.getoption("--quick") and collection_path.parent.name in WHOLE:
        return True
    if SIZE == 1 or collection_path.suffix != ".py":
        return None
    if SIZE > 2 and collection_path.parent.name in ABOVE:
        return True
    text = collection_path.read_text()
    return (
        True if any(f"\npytestmark = pytest.mark.{marker}" in text for marker in LEFT_OUT) else None
    )


def _left_out(item: pytest.Item) -> bool:
    """Serial tests on several ranks; on three and more, which seldom have a core each, also those
    that are slow and those that say that two ranks show what they show."""
    return any(item.get_closest_marker(marker) for marker in LEFT_OUT)


def _covering(items: list[pytest.Item]) -> set[pytest.Item]:
    """Of every function one test: the first on two ranks, the last on three, where long ones are
    left out too. Where ranks are in its name or that of its file, on two so many that each value
    of each parameter occurs, and on three also what is long. In a suite on both, two ranks leave a
    file to three but for its functions about ranks, and run all of one of which three run none:
    what a file is about in parallel, its short functions and those about ranks show. All others
    run on one rank, where a law, a scheme or a shape takes the path that it takes on several."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        functions.setdefault(item.nodeid.split("[")[0], []).append(item)
    left_to_three = _find_files_on_three(functions) if THREE_FOLLOW else set()
    kept: set[pytest.Item] = set()
    for name, ones in functions.items():
        if SIZE > 2:
            if "ranks" in name or not ones[-1].get_closest_marker("long"):
                kept.add(ones[-1])
        elif "ranks" in name:
            kept.update(_each_value(ones))
        elif ones[0].path not in left_to_three:
            kept.add(ones[0])
    return kept


def _find_files_on_three(functions: dict[str, list[pytest.Item]]) -> set[Path]:
    """Files of which three ranks run the last test of some function."""
    return {
        ones[-1].path
        for name, ones in functions.items()
        if _runs_on_three(ones[-1], about_ranks="ranks" in name)
    }


def _runs_on_three(item: pytest.Item, *, about_ranks: bool) -> bool:
    """Whether three ranks run this last test of its function."""
    markers = NOT_ON_THREE if about_ranks else (*NOT_ON_THREE, "long")
    left_out = any(item.get_closest_marker(marker) for marker in markers)
    return not left_out and item.path.parent.name not in ABOVE


def _each_value(ones: list[pytest.Item]) -> list[pytest.Item]:
    """So many tests of a function that each value of each of its parameters occurs."""
    alike = set.intersection(*map(_parameters, ones)) if len(ones) > 1 else set()
    seen: set[tuple[str, int]] = set()
    kept: list[pytest.Item] = []
    for new in (all, any):  # those of new values only, then those of some new value
        for item in ones:
            values = _parameters(item) - alike
            if item not in kept and (not values or new(value not in seen for value in values)):
                kept.append(item)
                seen |= values
    return kept


def _paired(items: list[pytest.Item]) -> set[pytest.Item]:
    """All tests, but of a function with three lists of parameters or more so many that every two
    values of different lists meet: what three do together has not been seen to matter."""
    kept = set(items)
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        functions.setdefault(item.nodeid.split("[")[0], []).append(item)
    for ones in functions.values():
        lists = [mark.args[0] for mark in ones[0].iter_markers("parametrize")]
        if len(lists) < 3:
            continue
        pairs = {item: set(itertools.combinations(_parametrised(item, lists), 2)) for item in ones}
        kept -= set(ones)
        while any(pairs.values()):
            # the first of the best: alike in every process
            best = max(ones, key=lambda item: len(pairs[item]))
            new = set(pairs[best])
            kept.add(best)
            for rest in pairs.values():
                rest -= new
    return kept


def _parametrised(item: pytest.Item, lists: list[Any]) -> list[tuple[int, int]]:
    """(number of the list, which of its values the test has)."""
    params = item.callspec.params  # type: ignore[attr-defined]
    names = [re.split(r"\s*,\s*", one.strip()) if isinstance(one, str) else one for one in lists]
    return [
        (number, hash(tuple(id(params[name]) for name in some)))
        for number, some in enumerate(names)
    ]


def _parameters(item: pytest.Item) -> set[tuple[str, int]]:
    return (
        {(name, id(value)) for name, value in item.callspec.params.items()}
        if hasattr(item, "callspec")
        else set()
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if hasattr(config, "workerinput"):  # alike in every process, wherever it began
        items.sort(key=lambda item: str(item.path))
    kept = (
        _paired(items) if SIZE == 1 else _covering([item for item in items if not _left_out(item)])
    )
    if config.getoption("--quick"):
        kept &= _first_cases(items)
    if left_out := [item for item in items if item not in kept]:
        items[:] = [item for item in items if item in kept]
        config.hook.pytest_deselected(items=left_out)
    # files of validation and those with many slow tests are long: not last on one core
    if SIZE == 1:
        slow = Counter(item.path for item in items if item.get_closest_marker("slow"))
        items.sort(key=lambda item: -slow[item.path] - 10 * ("validation" in item.path.parts))


def _first_cases(items: list[pytest.Item]) -> set[pytest.Item]:
    """The first case of each test function that --quick runs."""
    functions: dict[str, pytest.Item] = {}
    for item in items:
        if not any(map(item.get_closest_marker, ("slow", "long"))):
            functions.setdefault(item.nodeid.split("[")[0], item)
    return set(functions.values())


def pytest_collectreport(report: pytest.CollectReport) -> None:
    if report.failed:
        _collection_errors.append(report.longreprtext)


def pytest_collection_finish(session: pytest.Session) -> None:
    gc.freeze()  # what was imported stays: the collector need not look at it again and again
    if "vi_contact.core.timing" in sys.modules:  # small bodies, which free little: 2 % of the time
        sys.modules["vi_contact.core.timing"]._MALLOC_TRIM = None  # type: ignore[attr-defined]
    _load_forms_once()
    if SIZE == 1:
        return
    mine = "\n".join([*_collection_errors, *(item.nodeid for item in session.items)])
    texts = _meet(session.config, mine, where="collection", seconds=_patience(TEST_SECONDS))
    if any(text != mine for text in texts):
        _abort(session.config, f"ranks collected different tests:\n{mine}")


def _load_forms_once() -> None:
    """FFCx lists its cache of thousands of files whenever a form is made, also one whose module is
    loaded already, to find a file whose name it knows."""
    jit = sys.modules.get("ffcx.codegeneration.jit")
    if jit is None:
        return
    load, known = jit.get_cached_module, dict[Any, Any]()

    def once(name: str, objects: Any, folder: Any, *more: Any) -> Any:
        key = name, tuple(objects), str(folder)
        found = known[key] if key in known else load(name, objects, folder, *more)
        if found[0] is not None:
            known[key] = found
        return found

    jit.get_cached_module = once  # type: ignore[attr-defined]
    known_file = SimpleNamespace(**vars(importlib.machinery) | {"FileFinder": _known_file})
    known_importlib = SimpleNamespace(**vars(importlib) | {"machinery": known_file})
    jit.importlib = known_importlib  # type: ignore[attr-defined]
    _do_not_print_options(sys.modules["ffcx"])


def _do_not_print_options(ffcx: Any) -> None:
    """FFCx of DOLFINx 0.5 merges its options twice for every form, and formats them for a log that
    nobody reads."""
    if not hasattr(ffcx, "get_parameters"):
        return
    merge, known = ffcx.get_parameters, dict[str, dict[str, Any]]()

    def once(priority: dict[str, Any] | None = None) -> dict[str, Any]:
        key = repr(priority or {})
        if key not in known:
            known[key] = merge(priority)
        return dict(known[key])

    ffcx.get_parameters = ffcx.parameters.get_parameters = once


def _known_file(folder: str, kind: tuple[Any, list[str]]) -> SimpleNamespace:
    """What FFCx asks of importlib.machinery.FileFinder, without a list of the folder."""

    def find_spec(name: str) -> Any:
        loader, ends = kind
        paths = (os.path.join(folder, name + end) for end in ends)
        path = next((path for path in paths if os.path.exists(path)), None)
        return path and importlib.util.spec_from_file_location(
            name, path, loader=loader(name, path)
        )

    return SimpleNamespace(find_spec=find_spec, invalidate_caches=lambda: None)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(
    item: pytest.Item, nextitem: pytest.Item | None
) -> Generator[None, Any, None]:
    _watch(item.config)
    # what all ranks own is freed by all at one place: one that frees alone lets the others wait
    if SIZE > 1:
        gc.disable()
    yield
    if SIZE > 1 and (nextitem is None or nextitem.path != item.path):
        gc.collect()
    if nextitem is None:
        faulthandler.cancel_dump_traceback_later()


def _watch(config: pytest.Config) -> None:
    """End the process with a traceback if the test that starts now does not end."""
    now = time.monotonic()
    if now - config.stash.get(_watched, -inf) > WATCH_SECONDS:
        config.stash[_watched] = now
        seconds = _patience(TEST_SECONDS) + WATCH_SECONDS
        faulthandler.dump_traceback_later(seconds, exit=True, file=config.stash[_stderr])


@pytest.hookimpl(hookwrapper=True, tryfirst=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, None]:
    outcome = yield
    if SIZE > 1:
        _agree(item.config, outcome.get_result())


def _agree(config: pytest.Config, report: pytest.TestReport) -> None:
    """Make a phase that did not end alike on all ranks a failure on all ranks, told with the
    failing ranks' texts."""
    failed = report.outcome == "failed"
    mine = report.outcome + ("\n" + report.longreprtext if failed else "")
    patience = _patience(MEETING_SECONDS if failed else TEST_SECONDS)
    texts = _meet(
        config, mine, where=f"{report.nodeid} ({report.when})", seconds=patience, dull=report.passed
    )
    outcomes = [text.split("\n", 1)[0] for text in texts]
    if len(set(outcomes)) > 1 and not failed:
        told = [
            f"[rank {rank}] {text}" for rank, text in enumerate(texts) if outcomes[rank] == "failed"
        ]
        report.outcome = "failed"
        report.longrepr = "\n".join([f"outcomes by rank: {', '.join(outcomes)}", *told])


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    if SIZE > 1 and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK  # all were serial: they ran on one rank


def _seconds_by_file(stats: dict[str, list[Any]]) -> list[tuple[float, str]]:
    """(seconds of all phases of all tests, file), the slowest first."""
    seconds: Counter[str] = Counter()
    for report in itertools.chain.from_iterable(stats.values()):
        if isinstance(report, pytest.TestReport):
            seconds[report.nodeid.split("::")[0]] += report.duration
    return [(total, file) for file, total in seconds.most_common()]


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Tell the slowest files, and leave the counts where tests/run.sh sums them."""
    # the process that started the workers tells it of all
    if hasattr(terminalreporter.config, "workerinput"):
        return
    stats = terminalreporter.stats
    times = [f"{total:8.1f} s  {file}" for total, file in _seconds_by_file(stats)]
    if len(times) > 1:
        terminalreporter.section("slowest files")
        terminalreporter.write_line("\n".join(times[:SLOWEST_FILES]))
    if table := os.environ.get("VI_CONTACT_TIMES"):
        with open(table, "a") as file:
            file.writelines(f"{SIZE} {line}\n" for line in times)
    if tally := os.environ.get("VI_CONTACT_TALLY"):
        passed, skipped = len(stats.get("passed", [])), len(stats.get("skipped", []))
        failed = len(stats.get("failed", [])) + len(stats.get("error", []))
        Path(tally).write_text(f"{passed} {failed} {skipped}\n")


@pytest.fixture
def comm() -> Any:
    """MPI.COMM_WORLD."""
    return pytest.importorskip("mpi4py.MPI").COMM_WORLD


@pytest.fixture
def shared_tmp(comm: Any) -> Iterator[Path]:
    """A temporary directory, the same on all ranks. Removed at the end: the ranks have met after
    the call phase."""
    path = comm.bcast(tempfile.mkdtemp(prefix="vi_contact-") if comm.rank == 0 else None, root=0)
    yield Path(path)
    if comm.rank == 0:
        shutil.rmtree(path, ignore_errors=True)


@pytest.fixture(autouse=True, scope="module")
def _leaves_no_files() -> Iterator[None]:
    """Fail where the tests of a file leave something in the clone or in the working directory.

    Where the clone belongs to somebody else they could not even write it."""
    folders = {CLONE, Path.cwd(), CLONE / "results"}
    before = _list_entries(folders)
    yield
    left = sorted(_list_entries(folders) - before)
    assert RANK or not left, (
        f"tests of this file, or of one that ran beside it, left {', '.join(left)}: "
        "let them write into tmp_path or shared_tmp, and give every run its out"
    )


def _list_entries(folders: Iterable[Path]) -> set[str]:
    """Paths in these folders, but for those of tools, such as caches."""
    entries = (entry for folder in folders if folder.is_dir() for entry in folder.iterdir())
    return {str(entry) for entry in entries if not entry.name.startswith((".", "__pycache__"))}


@pytest.fixture(autouse=True)
def _log_level() -> Iterator[None]:
    """Programs silence the warnings of the package: the next test hears them again."""
    logger = logging.getLogger("vi_contact")
    before = logger.level
    yield
    logger.setLevel(before)


@pytest.fixture(autouse=True)
def _pictures(request: pytest.FixtureRequest) -> Iterator[None]:
    """Pictures are quick where they are not what is tested."""
    if request.path.parent.name == "plots":
        yield
    else:
        from plain_pictures import plain_pictures

        with plain_pictures():
            yield
