"""Hold one component of a recorded ground motion, and name the units its file may be written in."""

from dataclasses import dataclass, replace

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_arguments
from ...core.checks import array, instance, number
from ...core.errors import InputError
from ...core.units import STANDARD_GRAVITY

UNITS = {
    "m/s2": 1.0,
    "cm/s2": 0.01,
    "gal": 0.01,
    "g": STANDARD_GRAVITY,
    "g/10": 0.1 * STANDARD_GRAVITY,
    "mm/s2": 0.001,
    "in/s2": 0.0254,
    "ft/s2": 0.3048,
}
"""Name the accepted units of acceleration, and give their size in m/s²."""

LARGEST_PEAK = 10.0 * STANDARD_GRAVITY
"""Peak acceleration [m/s²] beyond which units are doubted.

The strongest ground motions on record reach half of it.
"""


@dataclass(frozen=True, eq=False)
class Record:
    """Describe equally spaced accelerations.

    Sample k is the acceleration at t = k · dt, the first one at t = 0. Between samples the
    acceleration is a straight line. Two records are equal only if they are the same object.

    Attributes:
        acceleration: (n,), n >= 2 [m/s²], copied and made read-only.
        dt: time step [s].
        title: of the record.
        source: path of the file.
        format: name of its format.
        units: of the file, before conversion to m/s².
        sha256: of the file's bytes.
        notes: what the file says about station and processing, then every change made since, one
            line each.
        station: as the file names it, empty where it does not.
        component: direction, as the file names it, empty where it does not.
        units_from: where the units come from, such as "header, line 4" or "option".
        dt_from: where the time step comes from.
        samples_from: where the number of samples comes from, such as "counted".
        doubts: what was read in one of several ways that were possible, one sentence each.

    Raises:
        InputError: samples that are NaN or infinite; fewer than two samples; a time step that is
            not positive.
    """

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
    units_from: str = ""
    dt_from: str = ""
    samples_from: str = ""
    doubts: tuple[str, ...] = ()

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
        """Return a record with other samples.

        Args:
            acceleration: the samples [m/s²].
            note: of what was done.
            dt: time step of the samples [s]; None for that of this record.
        """
        same_number = acceleration.size == self.acceleration.size
        return replace(
            self,
            acceleration=acceleration,
            dt=dt or self.dt,
            notes=(*self.notes, note),
            dt_from="resampled" if dt else self.dt_from,
            samples_from=self.samples_from if same_number else "changed after reading",
        )

    @property
    def times(self) -> Array:
        """Return k · dt [s], shape (n,)."""
        return self.dt * np.arange(self.acceleration.size)

    @property
    def duration(self) -> float:
        """Return the time of the last sample, (n - 1) · dt [s]."""
        return (self.acceleration.size - 1) * self.dt


_SPELLINGS = {
    "gals": "gal",
    "cms/s2": "cm/s2",
    "cm/ss": "cm/s2",
    "cms-2": "cm/s2",
    "ms-2": "m/s2",
    "mms-2": "mm/s2",
    "m/s/s": "m/s2",
    "g's": "g",
    "gn": "g",
    "gal(cm/s2)": "gal",
    "gal=cm/s2": "gal",
    "cm/s2(gal)": "cm/s2",
}
"""Other spellings of units, after blanks, dots, powers and "sec" have been unified."""


def recognise_units(units: str) -> str | None:
    """Return the key of UNITS that `units` spells ("CM/SEC/SEC", "(g)", "cm/s^2"), or None."""
    text = units.lower().strip(" ()[].,;:'\"")
    text = text.replace("²", "2")
    for power_sign in ("^", "*"):
        text = text.replace(power_sign, "")
    without_blanks = "".join(text.split())
    text = without_blanks.replace("sec", "s").replace("/s/s", "/s2")
    text = _SPELLINGS.get(text, text)
    return text if text in UNITS else None


@check_arguments
def canonical_units(source: str, units: str) -> str:
    """Return the key of UNITS that `units` spells ("CM/SEC/SEC", "(g)", "cm/s^2").

    Raises InputError, which names the source, where there is none.
    """
    text = recognise_units(units) if isinstance(units, str) else None
    if text is None:
        raise InputError(
            f"{source}: {units!r} is not a unit of acceleration known here; use a file of "
            f"accelerations in one of {', '.join(UNITS)}"
        )
    return text
