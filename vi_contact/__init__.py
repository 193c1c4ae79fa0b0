"""vi_contact: dynamic unilateral contact of elastic structures, certified step by step.

The table of contents. Names below are imported when they are first used, so ``import vi_contact`` needs neither PETSc
nor DOLFINx; those live in ``vi_contact.fem``, ``vi_contact.models`` and the volume solvers.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .run.cross_check import cross_check  # noqa: F401
from .run.march import march  # noqa: F401
from .run.simulate import simulate  # noqa: F401

# Functions that share their module's name are bound here, before somebody imports the module and takes the name.
from .soil.moving_base import base_motion  # noqa: F401
from .soil.upgoing_wave import upgoing  # noqa: F401

__version__ = "0.1.0"

_CONTENTS = {
    "core.errors": ("InputError", "Interrupted", "StepFailure", "ViContactError"),
    # values
    "laws.materials": (
        "LinearElastic", "MassProportional", "NoDamping", "PlaneStrain", "PlaneStress", "Rayleigh", "Solid",
    ),
    "laws.friction": ("Coulomb", "ExponentialDecay", "Frictionless", "SlipRateCoulomb", "StaticKinetic", "Tresca"),
    "laws.impact": ("ComponentReset", "Elastic", "Inelastic", "MassProjection", "Newton", "NoImpact"),
    "laws.excitation": (
        "FullSine", "GroundMotion", "HalfSine", "Harmonic", "Rectangular", "Ricker", "Tabulated",
    ),
    "soil.moving_base": ("BaseMotion", "base_motion"),
    "soil.upgoing_wave": ("UpgoingVelocity", "upgoing"),
    "soil.soil_column": ("SoilColumn",),
    "ground_motion": (
        "EC8Spectrum", "Envelope", "KanaiTajimi", "Processing", "Record", "ResponseSpectrum", "baseline_corrected",
        "filtered", "motion_info", "padded", "read_record", "resampled", "response_spectrum", "scaled",
        "scaled_to_arias", "scaled_to_pga", "scaled_to_psa", "synthetic", "tapered", "trimmed", "without_mean",
        "write_at2", "write_columns", "write_path_series",
    ),
    "laws.mass": ("ConsistentMass", "Redistributed"),
    "core.surfaces": ("AnalyticGap", "ContactSurface", "HalfSpace", "Touching"),
    "core.system": ("Load", "SemiDiscreteSystem"),
    # exact solutions to compare with
    "exact.bar": ("PeriodicBar", "ThrownBar"),
    "exact.bouncing_bar": ("BouncingBar",),
    "exact.two_bars": ("TwoBars",),
    "exact.columns": ("ObliqueImpact", "ShearColumn"),
    "exact.hertz": ("HertzImpact", "HertzLine", "HertzPoint", "contact_modulus", "contact_radius"),
    "exact.punch": ("RoundPunch", "StripPunch"),
    "exact.housner": ("HousnerBlock",),
    "exact.sliding": ("SlidingBlock",),
    "exact.site_response": ("SoilLayer",),
    "exact.surface_waves": ("dashpot_energy", "dashpot_reflection", "rayleigh_motion", "rayleigh_speed"),
    "exact.rigid_wall": ("RigidWall",),
    "exact.racking": ("BoxFrame", "ChannelFrame", "racking_ratio"),
    "exact.lining": ("ThickLining", "ThinLining"),
    # contract
    "core.step": ("Certificate", "ContactProblem", "Report", "State", "StepProblem", "StepResult"),
    # schemes
    "run.defaults": ("completed",),
    "schemes.trapezoidal": ("Trapezoidal",),
    "schemes.zienkiewicz_wood_taylor": ("ZienkiewiczWoodTaylor",),
    "schemes.ss22": ("SS22",),
    "schemes.midpoint": ("Midpoint",),
    "schemes.newmark": ("Newmark",),
    "schemes.hht": ("HHT",),
    "schemes.generalised_alpha": ("GeneralisedAlpha",),
    "schemes.houbolt": ("Houbolt",),
    "schemes.contact_stabilised": ("ContactStabilisedNewmark",),
    "schemes.moreau_jean": ("MoreauJean",),
    "schemes.linear_multistep": ("LinearMultistep",),
    # solvers
    "solvers.condensed": ("Condensed",),
    "solvers.normal.active_set": ("ActiveSet",),
    "solvers.normal.hildreth": ("Hildreth",),
    "solvers.normal.projected_cg": ("ProjectedCG",),
    "solvers.friction.newton": ("FrictionNewton",),
    "solvers.friction.nsgs": ("NSGS",),
    "solvers.friction.fixed_point": ("FixedPoint",),
    "solvers.friction.given_forces": ("GivenForces",),
    "solvers.friction.uzawa": ("Uzawa",),
    "solvers.friction.extrapolation": ("Aitken", "Anderson", "Plain"),
    "solvers.friction.slip_rate": ("RateIteration",),
    # the loop and what listens to it
    "run.march": ("march",),
    "run.time_steps": ("HalvedAtImpact", "Schedule"),
    "run.static": ("static_equilibrium",),
    "laws.weight": ("with_weight",),
    "run.quasi_static": ("quasi_static",),
    "run.simulate": ("Solution", "simulate"),
    "run.recorders": ("Contact", "Energy", "Probe"),
    # what engineers ask of a run
    "engineering.resultants": ("Resultants", "contact_summary"),
    "engineering.racking": ("Racking",),
    "engineering.floor_spectra": ("TransferFunction", "floor_spectrum", "recorded_motion", "transfer_function"),
    "engineering.peak_values": ("Loop", "Peak", "hysteresis", "peaks", "write_peaks"),
    "run.files.reading": ("RunFolder", "read_run"),
    "run.cross_check": ("CrossChecked", "cross_check"),
    "core.verify": ("energy_balance", "kkt_residual"),
    "engineering.modal": ("lowest_frequency",),
    # contact in a boundary layer (seed 001)
    "boundary_layer.layer": ("Layer",),
    "boundary_layer.particle": ("ParticleImpact", "layer_for"),
    "boundary_layer.metric": ("Metric",),
    "boundary_layer.motion": ("ConstrainedSystem",),
    "boundary_layer.trajectory": ("layer_motion",),
    "boundary_layer.rigid_body": ("Ellipsoid", "RigidBody"),
    "boundary_layer.bilateral": ("bilateral_motion",),
    "boundary_layer.contact_law": ("ContactLayer", "contact_layer"),
    "boundary_layer.scheme": ("BoundaryLayer",),
}
_HOME = {name: module for module, names in _CONTENTS.items() for name in names}
__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'vi_contact' has no attribute '{name}'")
    return getattr(import_module(f"vi_contact.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
