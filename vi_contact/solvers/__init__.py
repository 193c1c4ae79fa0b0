"""Solve the contact problem of one step: condensed to the contact points, or in the volume with PETSc."""

from __future__ import annotations

from ..core.lazy import lazy
from . import friction, iterative, normal, volume

_CONTENTS = {
    "condensed": ("Condensed",),
    "friction": friction.__all__,
    "iterative": iterative.__all__,
    "normal": normal.__all__,
    "volume": volume.__all__,
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
