"""Solve the contact problem of one step: condensed to the contact points, or in the volume with PETSc."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "condensed": ("Condensed",),
    "friction.extrapolation": ("Aitken", "Anderson", "Plain"),
    "friction.fixed_point": ("FixedPoint",),
    "friction.given_forces": ("GivenForces",),
    "friction.newton": ("FrictionNewton",),
    "friction.nsgs": ("NSGS",),
    "friction.slip_rate": ("RateIteration",),
    "friction.uzawa": ("Uzawa",),
    "normal.active_set": ("ActiveSet",),
    "normal.hildreth": ("Hildreth",),
    "normal.projected_cg": ("ProjectedCG",),
    "volume": ("Volume",),
}
__all__ = sorted(name for names in _CONTENTS.values() for name in names)
__getattr__, __dir__ = lazy(__name__, _CONTENTS)
