from .contact import Contact as Contact
from .energy import Energy as Energy
from .probe import Probe as Probe

__all__: list[str]
