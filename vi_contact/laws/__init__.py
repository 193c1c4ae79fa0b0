"""State how materials, friction, impacts, contact masses and the ground behave."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "excitation": ("FullSine", "HalfSine", "Harmonic", "Rectangular", "Ricker", "Tabulated"),
    "friction": ("Coulomb", "ExponentialDecay", "SlipRateCoulomb", "StaticKinetic", "Tresca"),
    "impact": ("ComponentReset", "Elastic", "ImpulseUpdate", "Inelastic", "Newton"),
    "mass": ("ConsistentMass", "Redistributed"),
    "materials": ("LinearElastic", "MassProportional", "NoDamping", "PlaneStrain", "PlaneStress", "Rayleigh", "Solid"),
    "weight": ("with_weight",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
