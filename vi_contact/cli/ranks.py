"""How a command ends on several ranks: errors are raised on all of them, and if one is not, nobody waits for ever."""

from __future__ import annotations

import sys
import time
from typing import Any

PATIENCE = 30.0  # seconds between the first rank that has failed and the last


def rank() -> int:
    """Return this process's rank, without importing MPI for commands that do not use it."""
    world = _world()
    return 0 if world is None else int(world.rank)


def fail_together(text: str) -> None:
    """Return when all ranks have come here; else say what stopped this one alone and end the others, which wait for it
    in a collective call. Collective, but for that."""
    world = _world()
    if world is None or world.size == 1:
        return
    request, end = world.Ibarrier(), time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > end:
            print(f"vi-contact: rank {world.rank} of {world.size} stopped alone: {text}", file=sys.stderr, flush=True)
            world.Abort(1)
        time.sleep(0.02)


def _world() -> Any:
    """MPI's communicator of all ranks; None where MPI has not been started."""
    return sys.modules["mpi4py.MPI"].COMM_WORLD if "mpi4py.MPI" in sys.modules else None
