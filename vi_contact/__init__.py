"""vi_contact: dynamic unilateral contact of elastic structures, certified step by step.

The names most runs need, imported when they are first used: ``import vi_contact`` needs numpy and scipy only.
All else has a room: ``vi_contact.fem`` (meshes, assembly, surfaces), ``solvers``, ``laws``, ``ground_motion``,
``soil``, ``engineering``, ``bem``, ``studies``, ``plots``.
"""

from . import schemes
from .core.lazy import lazy

_CONTENTS = {
    "core.version": ("__version__",),
    "core": (
        "AnalyticGap", "Certificate", "ContactProblem", "ContactSurface", "Frictionless", "HalfSpace",
        "InputError", "Interrupted", "OutOfTime", "Report", "State", "StepFailure", "StepProblem", "StepResult",
        "Touching", "ViContactError",
    ),
    "laws": (
        "ComponentReset", "ConsistentMass", "Coulomb", "DampingRatio", "Elastic", "ExponentialDecay", "FullSine",
        "HalfSine", "Harmonic", "ImpulseUpdate", "Inelastic", "KelvinVoigt", "LinearElastic", "MassProportional",
        "Newton", "NoDamping", "Orthotropic", "PlaneStrain", "PlaneStress", "Rayleigh", "Rectangular", "Redistributed",
        "Ricker", "SlipRateCoulomb", "Solid", "StaticKinetic", "Tabulated", "Tresca", "with_weight",
    ),
    "ground_motion": ("GroundMotion", "read_record"),
    "fem.own_matrices": ("system_from_arrays",),
    "fem.contact.points": ("contact_points",),
    "schemes": schemes.__all__,
    "solvers": ("Automatic", "Condensed", "Iterative", "Volume"),
    "run": (
        "Contact", "CrossChecked", "Energy", "HalvedAtImpact", "Probe", "Schedule", "Solution", "cross_check",
        "march", "march_many", "quasi_static", "read_run", "simulate", "simulate_many", "static_equilibrium",
    ),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
