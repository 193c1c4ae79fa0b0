# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .excitation import FullSine as FullSine
from .excitation import HalfSine as HalfSine
from .excitation import Harmonic as Harmonic
from .excitation import Rectangular as Rectangular
from .excitation import Ricker as Ricker
from .excitation import Tabulated as Tabulated
from .friction import Coulomb as Coulomb
from .friction import ExponentialDecay as ExponentialDecay
from .friction import SlipRateCoulomb as SlipRateCoulomb
from .friction import StaticKinetic as StaticKinetic
from .friction import Tresca as Tresca
from .impact import ComponentReset as ComponentReset
from .impact import Elastic as Elastic
from .impact import ImpulseUpdate as ImpulseUpdate
from .impact import Inelastic as Inelastic
from .impact import Newton as Newton
from .mass import ConsistentMass as ConsistentMass
from .mass import Redistributed as Redistributed
from .materials import DampingRatio as DampingRatio
from .materials import KelvinVoigt as KelvinVoigt
from .materials import LinearElastic as LinearElastic
from .materials import MassProportional as MassProportional
from .materials import NoDamping as NoDamping
from .materials import PlaneStrain as PlaneStrain
from .materials import PlaneStress as PlaneStress
from .materials import Rayleigh as Rayleigh
from .materials import Solid as Solid
from .orthotropic import Orthotropic as Orthotropic
from .weight import with_weight as with_weight

__all__: list[str] = [
    "ComponentReset",
    "ConsistentMass",
    "Coulomb",
    "DampingRatio",
    "Elastic",
    "ExponentialDecay",
    "FullSine",
    "HalfSine",
    "Harmonic",
    "ImpulseUpdate",
    "Inelastic",
    "KelvinVoigt",
    "LinearElastic",
    "MassProportional",
    "Newton",
    "NoDamping",
    "Orthotropic",
    "PlaneStrain",
    "PlaneStress",
    "Rayleigh",
    "Rectangular",
    "Redistributed",
    "Ricker",
    "SlipRateCoulomb",
    "Solid",
    "StaticKinetic",
    "Tabulated",
    "Tresca",
    "with_weight",
]
