"""End a run before its time is over.

A wall time is read as Slurm does, and it is said when what is left of it gets short.
"""

import math
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from ..core.checks import quote
from ..core.errors import InputError

# times the longest step and the checkpoint and histories at the end, as long as the longest so far
SAFETY = 2.0
_FORMS = (
    "minutes, minutes:seconds, hours:minutes:seconds, days-hours, days-hours:minutes or "
    "days-hours:minutes:seconds"
)
# without and with days [s]
_UNITS = {"": ((60,), (60, 1), (3600, 60, 1)), "-": ((3600,), (3600, 60), (3600, 60, 1))}
_IMPORTED = time.monotonic()


def parse_wall_time(wall_time: object) -> float:
    """Return the seconds of a text that Slurm reads as --time; InputError for any other."""
    text = wall_time if isinstance(wall_time, str) else ""
    match = re.fullmatch(r"(?:(\d+)(-))?(\d+(?::\d+){0,2})", text, re.ASCII)
    if match:
        days, dash, rest = match.groups("")
        parts = [int(part) for part in rest.split(":")]
        units = _UNITS[dash][len(parts) - 1]
        seconds = 86400 * int(days or 0) + sum(a * b for a, b in zip(units, parts, strict=True))
        if 0 < seconds < 1e9:
            return float(seconds)
    raise InputError(f"the wall time is {quote(wall_time)}: give {_FORMS}, such as '11:30:00'")


def measure_age() -> float:
    """Return the seconds since this process began.

    Where the system does not tell, it is since this module was imported.
    """
    return time.monotonic() - _find_birth()


@cache
def _find_birth() -> float:
    """Return when this process began, on the clock of ``time.monotonic`` [s]."""
    try:
        ticks = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19])
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return _IMPORTED
    return time.monotonic() - age


class WallTime:
    """Keep what base steps and checkpoints take against the wall time of the process.

    A wall time of None has no end. ``runs``: how many take turns in this process, all of which
    write a checkpoint before the end.
    """

    def __init__(self, wall_time: str | None = None, runs: int = 1) -> None:
        self.text = wall_time
        self._runs = runs
        self._end = math.inf if wall_time is None else parse_wall_time(wall_time)
        self._last = 0.0  # age of the process at the end of the last step [s]
        self._step = 0.0  # the longest step so far [s]
        self._saving = math.nan  # the longest checkpoint so far [s]

    @property
    def left(self) -> float:
        """Return how much of the wall time is left [s]."""
        return self._end - measure_age()

    @property
    def words(self) -> str:
        """Return the same for a sentence."""
        return f"{max(self.left, 0.0):.0f} s left of the wall time {self.text}"

    @property
    def unsure(self) -> bool:
        """Say whether nobody knows yet how long a checkpoint takes, although it matters."""
        return self._never_saved and self._end < math.inf

    @property
    def _never_saved(self) -> bool:
        """Say whether there has been no checkpoint yet."""
        return math.isnan(self._saving)

    def begin(self) -> None:
        """Note that the first step begins now."""
        self._last = measure_age()

    @contextmanager
    def saving(self) -> Iterator[None]:
        """Take the time of a checkpoint."""
        begin = measure_age()
        yield
        seconds = measure_age() - begin
        self._saving = seconds if self._never_saved else max(seconds, self._saving)

    def over(self) -> bool:
        """Say, at the end of a base step, whether another one might not end in time."""
        if self.text is None:
            return False
        # What is still to come takes as long as the longest so far: another step and, for each run,
        # a checkpoint and the histories. NaN, before the first checkpoint, is not over.
        now = measure_age()
        self._step = max(self._step, now - self._last)
        self._last = now
        return bool(self._end - now <= SAFETY * (self._step + 2.0 * self._runs * self._saving))
