"""Compile the C files of this room when they are first needed.

A wheel brings the loops compiled (``find_shipped``). All else is kept in the user's cache, as
DOLFINx keeps forms: $XDG_CACHE_HOME or ~/.cache, folder vi_contact.

There are two libraries:

- the loops (``LOOPS``), which need a C compiler only: ``load_loops``;
- ``factor.c``, which needs CHOLMOD too: ``load_cholmod``. It takes no CHOLMOD but the one that
  PETSc has brought into the process. Another one beside it would share names with it, and with the
  METIS and the BLAS of PETSc, so that functions of one call those of the other. Compiling against
  the header beside that CHOLMOD makes any version do.

Neither has to be there: each ``load_…`` returns None where its library cannot be made, the log says
why, and numpy or PETSc does the work. All ranks get a library, or none of them does.
"""

import ctypes
import logging
import os
import platform
import shlex
import subprocess
from collections.abc import Callable, Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

from numpy.typing import NDArray

from ..core import packages
from ..core.algebra import Comm, largest

log = logging.getLogger(__name__)
HERE = Path(__file__).parent
LOOPS = (HERE / "substitution.c", HERE / "friction_sweeps.c", HERE / "exchanges.c")
FACTOR = HERE / "factor.c"
MAPS = Path("/proc/self/maps")  # of Linux: the files of all libraries of this process
OF_LOOPS = ("forward", "backward", "forward_many", "backward_many")
OF_CHOLMOD = ("order", "factorise", "columns", "release", "substitute")


def load_loops(comm: Comm) -> Any:
    """Return the functions of ``LOOPS``, or None, the same on all ranks.

    The first rank compiles them. Collective.
    """
    return _load_alike(comm, _load_own_loops)


def load_cholmod(comm: Comm) -> Any:
    """Return what ``ContactLast`` needs, of ``substitution.c`` and of ``factor.c``.

    It is None where PETSc has no CHOLMOD or nothing can be compiled, and the same on all ranks. The
    first rank compiles it. Collective.
    """
    return _load_alike(comm, _load_factoriser)


def _load_alike(comm: Comm, load: Callable[[], Any]) -> Any:
    """Return what ``load`` returns, or None on all ranks where it does so on one. Collective.

    Args:
        comm: the ranks that load it.
        load: loads a library, and compiles it where it is not in the cache; None where it cannot.
    """
    # The first rank compiles while the others wait; they find its file in the cache.
    if comm.rank == 0:
        load()
    comm.bcast(None)
    library = load()
    return None if largest(comm, library is None) else library


@lru_cache(maxsize=1)
def _load_own_loops() -> Any:
    """Return the functions, or None where there is no compiler or cache.

    Without one, a line in the log says so once.
    """
    try:
        library = _load_shipped() or ctypes.CDLL(str(compile_library(LOOPS, [])))
    except (OSError, RuntimeError, subprocess.SubprocessError) as problem:
        # RuntimeError: nobody's home is known
        log.info(
            "numpy does what compiled loops would do faster, because they need a C compiler: %s",
            _take_first_line(problem),
        )
        return None
    library.relax.restype = ctypes.c_double  # ctypes takes int where nothing is said
    return library


def find_shipped() -> Path | None:
    """Return the file of the loops that a wheel has brought, None in a clone."""
    return next(iter(sorted(HERE.glob("loops.*.so"))), None)


def _load_shipped() -> Any:
    """Return the loops of the wheel; None without one, or where this machine cannot load it."""
    file = find_shipped()
    if file is None:
        return None
    try:
        return ctypes.CDLL(str(file))
    except OSError as problem:
        log.info("the compiled loops of the wheel cannot be loaded: %s", _take_first_line(problem))
        return None


def _load_factoriser() -> Any:
    """Return the functions for the CHOLMOD of this process.

    A PETSc may bring it later than we are asked first.
    """
    try:
        return _compile_with_cholmod(locate_cholmod_of_petsc())
    except OSError as problem:
        return _report_no_cholmod(str(problem))


@lru_cache(maxsize=1)
def _compile_with_cholmod(file: Path) -> Any:
    """Return the functions for a CHOLMOD, or None where they cannot be had.

    Args:
        file: the library of CHOLMOD, which is in this process already.
    """
    loops = _load_own_loops()
    if loops is None:
        return _report_no_cholmod("there is no C compiler that works")
    try:
        headers = _locate_header_folder(file)
        library = ctypes.CDLL(str(compile_library([FACTOR], [f"-I{headers}"], file)))
        if not library.header_fits():
            raise OSError(f"the header in {headers} is of another version than {file}")
    except (OSError, RuntimeError, subprocess.SubprocessError) as problem:
        return _report_no_cholmod(_take_first_line(problem))
    library.columns.restype = ctypes.c_long
    functions = {name: getattr(loops, name) for name in OF_LOOPS}
    functions |= {name: getattr(library, name) for name in OF_CHOLMOD}
    return SimpleNamespace(**functions)


@lru_cache(maxsize=1)
def _report_no_cholmod(reason: str) -> None:
    """Say once in the log why."""
    log.info(
        "PETSc factorises, because the quicker way needs a C compiler and PETSc's CHOLMOD: %s",
        reason,
    )


def locate_cholmod_of_petsc() -> Path:
    """Return the file of the CHOLMOD that PETSc has brought into this process.

    Raises:
        OSError: there is none; the error says why.
    """
    if not packages.petsc_is_here():
        raise OSError("no PETSc is in this process")
    if not packages.petsc_has("cholmod"):
        raise OSError("this PETSc was built without CHOLMOD")
    return _locate_cholmod(MAPS)


@lru_cache(maxsize=1)
def _locate_cholmod(maps: Path) -> Path:
    """Return the file of the one CHOLMOD in this process.

    The answer is remembered: a library stays once it is there, and to read this list takes longer
    than small steps. An error is not, so that the list is read again.

    Args:
        maps: the list of the memory of this process, which Linux keeps as a text.

    Raises:
        OSError: there is none, or more than one.
    """
    # A line has five columns (addresses, rights and the like), and then the file.
    lines = maps.read_text(encoding="utf-8", errors="surrogateescape").splitlines()
    files = {line.split(maxsplit=5)[5] for line in lines if "libcholmod" in line}
    libraries = sorted(file for file in files if Path(file).name.startswith("libcholmod"))
    if len(libraries) != 1:
        raise OSError(f"there are {len(libraries)} files of CHOLMOD in this process {libraries}")
    return Path(libraries[0])


def _locate_header_folder(file: Path) -> Path:
    """Return the folder of the header that was installed with this library.

    The library lies in lib, or lib/x86_64-linux-gnu, beside include.
    """
    for parent in file.parents[1:3]:
        for folder in (parent / "include" / "suitesparse", parent / "include"):
            if (folder / "cholmod.h").is_file():
                return folder
    raise OSError(f"there is no header cholmod.h beside {file}")


def compile_library(sources: Sequence[Path], options: Sequence[str], *libraries: Path) -> Path:
    """Return the file of the compiled functions, made unless one that can be loaded is there.

    Safe in any number of processes: each compiles aside, and the last one to end replaces the file
    as a whole.

    Args:
        sources: C files of one folder, which become one library.
        options: options of the compiler.
        libraries: files to link with, which are in the process already; a changed one is another
            result.

    Raises:
        OSError, RuntimeError, subprocess.SubprocessError: there is no compiler, no cache or no home
            folder, or the sources do not compile.
    """
    command = [*shlex.split(os.environ.get("CC") or "cc"), "-O3", "-shared", "-fPIC", *options]

    # The name of the file says all that it was made of.
    headers = sorted(sources[0].parent.glob("*.h"))
    texts = [file.read_text(encoding="utf-8") for file in (*sources, *headers)]
    stamps = [(str(file), file.stat().st_size, file.stat().st_mtime_ns) for file in libraries]
    made_of = f"{texts}{command}{stamps}{platform.machine()}"
    key = sha256(made_of.encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vi_contact"
    file = folder / f"{sources[0].stem}-{key}.so"

    # A file that is there may still be damaged, or of a C library that is older here: to load it is
    # the test. Otherwise compile beside it, and put the result in its place in one move.
    try:
        ctypes.CDLL(str(file))
    except OSError:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder) as aside:
            compiled = Path(aside) / file.name
            command += [*map(str, sources), "-o", str(compiled), *map(str, libraries), "-lm"]
            subprocess.run(command, check=True, capture_output=True, text=True)
            compiled.replace(file)
    return file


def locate_arrays(*arrays: NDArray[Any] | None) -> list[ctypes.c_void_p | None]:
    """Return where arrays lie in memory; None for None.

    Whoever asks holds the arrays for as long as a compiled function uses their addresses.
    ``array.ctypes`` takes several times as long to tell.
    """
    return [
        None if array is None else ctypes.c_void_p(array.__array_interface__["data"][0])
        for array in arrays
    ]


def _take_first_line(problem: Exception) -> str:
    """Return the first line of what a compiler or the system said."""
    message = getattr(problem, "stderr", None) or str(problem)
    lines = message.strip().splitlines()
    return lines[0] if lines else repr(problem)
