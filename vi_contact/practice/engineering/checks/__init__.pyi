from .earth_pressure_seismic import MononobeOkabe as MononobeOkabe
from .earth_pressure_seismic import VeletsosYounan as VeletsosYounan
from .earth_pressure_seismic import Wood as Wood
from .earth_pressure_static import AtRest as AtRest
from .earth_pressure_static import CoulombWedge as CoulombWedge
from .earth_pressure_static import Rankine as Rankine
from .racking_ratio import RackingRatio as RackingRatio
from .shaken_block import Housner as Housner
from .shaken_block import NewmarkBlock as NewmarkBlock

__all__: list[str]
