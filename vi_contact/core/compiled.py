"""Compile ``contact_last.c`` against CHOLMOD when it is first needed, and keep it in the user's cache, as DOLFINx keeps
forms: $XDG_CACHE_HOME or ~/.cache, folder vi_contact. Compiling against its header is what makes any CHOLMOD do."""

import ctypes
import logging
import os
import platform
import shlex
import subprocess
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .algebra import Comm, largest

log = logging.getLogger(__name__)
SOURCE = Path(__file__).with_name("contact_last.c")
HEADERS = "-I/usr/include/suitesparse"


def library(comm: Comm) -> Any:
    """Return the compiled functions, or None, the same on all ranks; the first rank compiles them. Collective."""
    if comm.rank == 0:
        _library()
    comm.bcast(None)
    found = _library()
    return None if largest(comm, found is None) else found


@lru_cache(maxsize=1)
def _library() -> Any:
    """The functions; None, and once a line in the log, where there is no compiler, CHOLMOD or cache."""
    try:
        return _loaded(compiled())
    except (OSError, RuntimeError, subprocess.SubprocessError) as problem:  # RuntimeError: nobody's home is known
        said = (getattr(problem, "stderr", None) or str(problem)).strip().splitlines() or [repr(problem)]
        log.info("PETSc factorises, because the quicker way needs a C compiler and CHOLMOD: %s", said[0])
        return None


def already() -> Any:
    """Return the functions where somebody has asked for them before, else None."""
    return _library() if _library.cache_info().currsize else None


def compiled() -> Path:
    """Return the file of the compiled functions, made unless one that can be loaded is there. Safe in any number of
    processes: each compiles aside, and the last one to end replaces the file as a whole."""
    command = [*shlex.split(os.environ.get("CC") or "cc"), "-O3", "-shared", "-fPIC", HEADERS]
    key = sha256(f"{SOURCE.read_text(encoding='utf-8')}{command}{platform.machine()}".encode()).hexdigest()[:16]
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vi_contact"
    file = folder / f"contact_last-{key}.so"
    try:
        _loaded(file)  # fails too where it was made beside another CHOLMOD, since removed
    except OSError:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder) as aside:
            made = Path(aside) / file.name
            command += [str(SOURCE), "-o", str(made), "-lcholmod", "-lm"]
            subprocess.run(command, check=True, capture_output=True, text=True)
            made.replace(file)
    return file


def _loaded(file: Path) -> Any:
    """The functions of a file; OSError where it cannot be loaded."""
    found = ctypes.CDLL(str(file))
    found.columns.restype, found.relax.restype = ctypes.c_long, ctypes.c_double
    return found
