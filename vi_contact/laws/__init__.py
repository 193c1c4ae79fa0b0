"""State how materials, friction, impacts, contact masses and the ground behave.

Take a material first; what is not given is frictionless and undamped. Your own laws: docs/guide/extend.md.
>>> from vi_contact.laws import LinearElastic
>>> round(LinearElastic(E=2.0e10, nu=0.0, rho=2400.0).c_p)  # Pa, -, kg/m³; c_P in m/s
2887
"""

from ..core.lazy import lazy

_CONTENTS = {
    "excitation": ("FullSine", "HalfSine", "Harmonic", "Rectangular", "Ricker", "Tabulated"),
    "friction": ("Coulomb", "ExponentialDecay", "SlipRateCoulomb", "StaticKinetic", "Tresca"),
    "impact": ("ComponentReset", "Elastic", "ImpulseUpdate", "Inelastic", "Newton"),
    "mass": ("ConsistentMass", "Redistributed"),
    "materials": (
        "DampingRatio", "KelvinVoigt", "LinearElastic", "MassProportional", "NoDamping", "PlaneStrain", "PlaneStress",
        "Rayleigh", "Solid",
    ),
    "orthotropic": ("Orthotropic",),
    "weight": ("with_weight",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
