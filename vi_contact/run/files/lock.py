"""Allow one run at a time in a folder: a lock that the kernel takes back when its process ends, however it ends."""

from __future__ import annotations

import fcntl
import logging
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ...core.algebra import Comm
from ...core.errors import InputError
from ...core.files import on_root

log = logging.getLogger(__name__)
LOCK = ".lock"
_held: dict[Path, int] = {}  # folders that this process has locked -> the thread that did


@contextmanager
def locked(comm: Comm, folder: Path | None) -> Iterator[None]:
    """Refuse other runs that want the folder, while it lasts, with one sentence on all their ranks. Collective.

    Rank 0 holds a lock (flock) on a file in the folder. What a killed run leaves of it holds nobody up. Within the same
    thread it may be taken again. On a file system that knows no locks there is none, which is logged.
    """
    mine = None if folder is None else on_root(comm, lambda: _take(folder))
    try:
        yield
    finally:
        if mine is not None and folder is not None:
            _release(folder, mine)


def _take(folder: Path) -> Any:
    """The open, locked file; None when this thread has the lock already."""
    if _held.get(folder.resolve()) == threading.get_ident():
        return None
    while True:
        file = open(folder / LOCK, "a+b", buffering=0)  # noqa: SIM115
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f"another run writes into '{folder}' ({_owner(file)}): wait until it has ended, or choose "
                             "another output folder") from None
        except OSError as error:
            log.warning("'%s' is on a file system without locks (%s): see to it that no other run writes there",
                        folder, error.strerror)
        if _is_there(folder / LOCK, file):
            break
        file.close()  # the run that had it has removed it since
    file.truncate(0)
    file.write(f"process {os.getpid()} on {socket.gethostname()}".encode())
    _held[folder.resolve()] = threading.get_ident()
    return file


def _owner(file: Any) -> str:
    """Who holds it, as it wrote into the file; closes the file."""
    with file:
        file.seek(0)
        return " ".join(file.read(200).decode(errors="replace").split()) or "it has only begun"


def _is_there(path: Path, file: Any) -> bool:
    """Whether the file that is open is still the one of that name."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def _release(folder: Path, file: Any) -> None:
    """Remove the file while it is locked: who opens it in the meantime finds it gone and makes a new one."""
    _held.pop(folder.resolve(), None)
    (folder / LOCK).unlink(missing_ok=True)
    file.close()
