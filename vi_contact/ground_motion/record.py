"""Hold one component of a recorded ground motion, and name the units its file may be written in."""

from dataclasses import dataclass, replace

import numpy as np

from ..core.algebra import Array
from ..core.arguments import checked
from ..core.checks import array, instance, number
from ..core.errors import InputError
from ..core.units import STANDARD_GRAVITY

UNITS = {"m/s2": 1.0, "cm/s2": 0.01, "gal": 0.01, "g": STANDARD_GRAVITY, "g/10": 0.1 * STANDARD_GRAVITY, "mm/s2": 0.001,
         "in/s2": 0.0254, "ft/s2": 0.3048}
"""Name the accepted units of acceleration, and give their size in m/s²."""

LARGEST_PEAK = 10.0 * STANDARD_GRAVITY
"""Peak acceleration [m/s²] beyond which units are doubted: the strongest ground motions on record reach half of it."""


@dataclass(frozen=True, eq=False)
class Record:
    """Describe equally spaced accelerations: sample k is the acceleration at t = k · dt, the first one at t = 0.

    acceleration: shape (n,), n >= 2 [m/s²], copied and made read-only; dt: time step [s] > 0; title; source: path of
    the file; format: name of its format; units: of the file, before conversion to m/s²; sha256: of the file's bytes;
    notes: what the file says about station and processing, then every change made since, one line each; station and
    component (direction): as the file names them, empty where it does not.
    Between samples the acceleration is a straight line. Two records are equal only if they are the same object.
    Raises InputError for NaN or infinite samples, fewer than two of them, or a time step that is not positive."""

    acceleration: Array
    dt: float
    title: str = ""
    source: str = ""
    format: str = ""
    units: str = "m/s2"
    sha256: str = ""
    notes: tuple[str, ...] = ()
    station: str = ""
    component: str = ""

    def __post_init__(self) -> None:
        for name in ("title", "source", "format", "units", "sha256", "station", "component"):
            instance("Record", name, getattr(self, name), str, "give a text")
        owner = self.source or "Record"
        samples = array(owner, "acceleration", self.acceleration, (None,), unit="m/s2")
        if samples.size < 2:
            raise InputError(f"{owner}: acceleration has {samples.size} samples; give two or more")
        number(owner, "the time step", self.dt, positive=True, unit="seconds")
        samples.flags.writeable = False
        object.__setattr__(self, "acceleration", samples)

    def changed(self, acceleration: Array, note: str, *, dt: float | None = None) -> "Record":
        """Return a record with these samples, and a note of what was done."""
        return replace(self, acceleration=acceleration, dt=dt or self.dt, notes=(*self.notes, note))

    @property
    def times(self) -> Array:
        """Return k · dt [s], shape (n,)."""
        return self.dt * np.arange(self.acceleration.size)

    @property
    def duration(self) -> float:
        """Return the time of the last sample, (n - 1) · dt [s]."""
        return (self.acceleration.size - 1) * self.dt


@checked
def canonical_units(source: str, units: str) -> str:
    """Return the key of UNITS that `units` spells ("CM/SEC/SEC", "(g)", "cm/s^2"); InputError if there is none."""
    text = units.lower().strip(" ()[].,;").replace("²", "2").replace("^", "").replace("**", "")
    text = "".join(text.split()).replace("sec", "s").replace("/s/s", "/s2")
    if text not in UNITS:
        raise InputError(f"{source}: {units!r} is not a unit of acceleration known here; use a file of accelerations "
                         f"in one of {', '.join(UNITS)}")
    return text
