# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .core import AnalyticGap as AnalyticGap
from .core import Certificate as Certificate
from .core import ContactProblem as ContactProblem
from .core import ContactSurface as ContactSurface
from .core import Frictionless as Frictionless
from .core import HalfSpace as HalfSpace
from .core import InputError as InputError
from .core import Interrupted as Interrupted
from .core import OutOfTime as OutOfTime
from .core import Report as Report
from .core import State as State
from .core import StepFailure as StepFailure
from .core import StepProblem as StepProblem
from .core import StepResult as StepResult
from .core import Touching as Touching
from .core import ViContactError as ViContactError
from .core.version import __version__ as __version__
from .fem.contact.points import contact_points as contact_points
from .fem.own_matrices import system_from_arrays as system_from_arrays
from .ground_motion import GroundMotion as GroundMotion
from .ground_motion import read_record as read_record
from .laws import ComponentReset as ComponentReset
from .laws import ConsistentMass as ConsistentMass
from .laws import Coulomb as Coulomb
from .laws import DampingRatio as DampingRatio
from .laws import Elastic as Elastic
from .laws import ExponentialDecay as ExponentialDecay
from .laws import FullSine as FullSine
from .laws import HalfSine as HalfSine
from .laws import Harmonic as Harmonic
from .laws import ImpulseUpdate as ImpulseUpdate
from .laws import Inelastic as Inelastic
from .laws import KelvinVoigt as KelvinVoigt
from .laws import LinearElastic as LinearElastic
from .laws import MassProportional as MassProportional
from .laws import Newton as Newton
from .laws import NoDamping as NoDamping
from .laws import Orthotropic as Orthotropic
from .laws import PlaneStrain as PlaneStrain
from .laws import PlaneStress as PlaneStress
from .laws import Rayleigh as Rayleigh
from .laws import Rectangular as Rectangular
from .laws import Redistributed as Redistributed
from .laws import Ricker as Ricker
from .laws import SlipRateCoulomb as SlipRateCoulomb
from .laws import Solid as Solid
from .laws import StaticKinetic as StaticKinetic
from .laws import Tabulated as Tabulated
from .laws import Tresca as Tresca
from .laws import with_weight as with_weight
from .run import Contact as Contact
from .run import CrossChecked as CrossChecked
from .run import Energy as Energy
from .run import HalvedAtImpact as HalvedAtImpact
from .run import Probe as Probe
from .run import Schedule as Schedule
from .run import Solution as Solution
from .run import cross_check as cross_check
from .run import march as march
from .run import march_many as march_many
from .run import quasi_static as quasi_static
from .run import read_run as read_run
from .run import simulate as simulate
from .run import simulate_many as simulate_many
from .run import static_equilibrium as static_equilibrium
from .schemes import *
from .solvers import Automatic as Automatic
from .solvers import Condensed as Condensed
from .solvers import Iterative as Iterative
from .solvers import Volume as Volume

__all__: list[str] = [
    "AnalyticGap",
    "Automatic",
    "Certificate",
    "ComponentReset",
    "Condensed",
    "ConsistentMass",
    "Contact",
    "ContactProblem",
    "ContactStabilisedNewmark",
    "ContactSurface",
    "Coulomb",
    "CrossChecked",
    "DampingRatio",
    "Elastic",
    "Energy",
    "ExponentialDecay",
    "Frictionless",
    "FullSine",
    "GeneralisedAlpha",
    "GroundMotion",
    "HHT",
    "HalfSine",
    "HalfSpace",
    "HalvedAtImpact",
    "Harmonic",
    "Houbolt",
    "ImpulseUpdate",
    "Inelastic",
    "InputError",
    "Interrupted",
    "Iterative",
    "KelvinVoigt",
    "LinearElastic",
    "LinearMultistep",
    "MassProportional",
    "Midpoint",
    "MoreauJean",
    "Newmark",
    "Newton",
    "NoDamping",
    "Orthotropic",
    "OutOfTime",
    "PlaneStrain",
    "PlaneStress",
    "Probe",
    "Rayleigh",
    "Rectangular",
    "Redistributed",
    "Report",
    "Ricker",
    "SS22",
    "Schedule",
    "SlipRateCoulomb",
    "Solid",
    "Solution",
    "State",
    "StaticKinetic",
    "StepFailure",
    "StepProblem",
    "StepResult",
    "Tabulated",
    "Touching",
    "Trapezoidal",
    "Tresca",
    "ViContactError",
    "Volume",
    "ZienkiewiczWoodTaylor",
    "__version__",
    "contact_points",
    "cross_check",
    "march",
    "march_many",
    "quasi_static",
    "read_record",
    "read_run",
    "simulate",
    "simulate_many",
    "static_equilibrium",
    "system_from_arrays",
    "with_weight",
]
