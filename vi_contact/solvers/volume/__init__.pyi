from .route import Volume as Volume
from .snes import ReducedNewton as ReducedNewton
from .snes import SemismoothNewton as SemismoothNewton
from .tao import TaoTron as TaoTron
