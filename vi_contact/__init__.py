"""vi_contact: dynamic unilateral contact of elastic structures, certified step by step.

The names most runs need, imported when they are first used: ``import vi_contact`` needs numpy and scipy only.
All else has a room: ``vi_contact.fem`` (meshes, assembly, surfaces), ``solvers``, ``laws``, ``ground_motion``,
``soil``, ``engineering``, ``exact``, ``bem``, ``beam``, ``boundary_layer``, ``models``, ``studies``, ``plots``.
"""

from . import schemes
from .core.lazy import lazy

_CONTENTS = {
    "core.version": ("__version__",),
    "core.errors": ("InputError", "Interrupted", "OutOfTime", "StepFailure", "ViContactError"),
    "laws.materials": (
        "LinearElastic", "MassProportional", "NoDamping", "PlaneStrain", "PlaneStress", "Rayleigh", "Solid",
    ),
    "laws.kelvin_voigt": ("KelvinVoigt",),
    "laws.orthotropic": ("Orthotropic",),
    "core.protocols": ("Frictionless",),
    "laws.friction": ("Coulomb", "ExponentialDecay", "SlipRateCoulomb", "StaticKinetic", "Tresca"),
    "laws.impact": ("ComponentReset", "Elastic", "ImpulseUpdate", "Inelastic", "Newton"),
    "laws.mass": ("ConsistentMass", "Redistributed"),
    "laws.weight": ("with_weight",),
    "laws.excitation": ("FullSine", "HalfSine", "Harmonic", "Rectangular", "Ricker", "Tabulated"),
    "ground_motion.excitation": ("GroundMotion",),
    "ground_motion.formats.reader": ("read_record",),
    "core.surfaces": ("ContactSurface",),
    "core.obstacles": ("AnalyticGap", "HalfSpace", "Touching"),
    "fem.own_matrices": ("system_from_arrays",),
    "fem.contact.points": ("contact_points",),
    "core.problem": ("ContactProblem",),
    "core.certificate": ("Certificate",),
    "core.step": ("Report", "State", "StepProblem", "StepResult"),
    "schemes": schemes.__all__,
    "solvers.automatic": ("Automatic",),
    "solvers.condensed": ("Condensed",),
    "solvers.iterative": ("Iterative",),
    "solvers.volume": ("Volume",),
    "run.simulate": ("simulate",),
    "run.solution": ("Solution",),
    "run.march": ("march",),
    "run.march_many": ("march_many",),
    "run.simulate_many": ("simulate_many",),
    "run.static": ("quasi_static", "static_equilibrium"),
    "run.time_steps": ("HalvedAtImpact", "Schedule"),
    "run.recorders": ("Contact", "Energy", "Probe"),
    "run.files.reading": ("read_run",),
    "run.cross_check": ("CrossChecked", "cross_check"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
