"""Bring the motion of the ground to a body: moved bases, upgoing waves, soil columns, free-field sides."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "companion": ("CompanionRun",),
    "free_field": ("FreeField",),
    "moving_base": ("BaseMotion", "base_motion"),
    "soil_column": ("SoilColumn",),
    "upgoing_wave": ("UpgoingVelocity", "upgoing"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
