from .contact_stabilised import ContactStabilisedNewmark as ContactStabilisedNewmark
from .energy_momentum import EnergyMomentum as EnergyMomentum
from .generalised_alpha import GeneralisedAlpha as GeneralisedAlpha
from .hht import HHT as HHT
from .houbolt import Houbolt as Houbolt
from .linear_multistep import LinearMultistep as LinearMultistep
from .midpoint import Midpoint as Midpoint
from .moreau_jean import MoreauJean as MoreauJean
from .newmark import Newmark as Newmark
from .ss22 import SS22 as SS22
from .trapezoidal import Trapezoidal as Trapezoidal
from .zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor as ZienkiewiczWoodTaylor

__all__: list[str]
