"""March a problem, listen to it with recorders, and keep what it did in a folder.

Begin with ``simulate``, as README.md does. ``march`` is the bare loop below it,
``static_equilibrium`` the start under weight, ``read_run`` the way back from a folder: docs/reference/files.md."""

from ..core.lazy import lazy

_CONTENTS = {
    "cross_check": ("CrossChecked", "cross_check"),
    "files.reading": ("RunFolder", "read_run"),
    "march": ("march",),
    "march_many": ("march_many",),
    "method": ("with_defaults",),
    "recorders": ("Contact", "Energy", "Probe"),
    "simulate": ("simulate",),
    "simulate_many": ("simulate_many",),
    "solution": ("Solution",),
    "static": ("quasi_static", "static_equilibrium"),
    "time_steps": ("HalvedAtImpact", "Schedule"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
