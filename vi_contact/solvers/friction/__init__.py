"""Solve for normal and tangential reactions on the contact points, Tresca or Coulomb."""

from ...core.lazy import lazy

_CONTENTS = {
    "extrapolation": ("Anderson", "Plain"),
    "fixed_point": ("FixedPoint",),
    "given_forces": ("GivenForces",),
    "newton": ("FrictionNewton",),
    "nsgs": ("NSGS",),
    "slip_rate": ("RateIteration",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
