from .body_motion import BodyMotion as BodyMotion
from .contact import Contact as Contact
from .energy import Energy as Energy
from .joint_energy import JointEnergy as JointEnergy
from .largest_strain import LargestStrain as LargestStrain
from .probe import Probe as Probe
from .racking import Racking as Racking
from .reactions import Reactions as Reactions
from .reservoir_water import ReservoirWater as ReservoirWater
from .resultants import Resultants as Resultants
from .section_forces import SectionForces as SectionForces
from .stress_strain import StressStrain as StressStrain
from .uplift import Uplift as Uplift

__all__: list[str]
