"""March a problem, listen to it with recorders, and keep what it did in a folder."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "cross_check": ("CrossChecked", "cross_check"),
    "files.reading": ("RunFolder", "read_run"),
    "march": ("march",),
    "method": ("with_defaults",),
    "recorders": ("Contact", "Energy", "Probe"),
    "simulate": ("simulate",),
    "solution": ("Solution",),
    "static": ("quasi_static", "static_equilibrium"),
    "time_steps": ("HalvedAtImpact", "Schedule"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
