# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .companion import CompanionRun as CompanionRun
from .curves import SoilCurves as SoilCurves
from .equivalent_linear import SiteResponse as SiteResponse
from .equivalent_linear import equivalent_linear as equivalent_linear
from .free_field import FreeField as FreeField
from .moving_base import BaseMotion as BaseMotion
from .moving_base import base_motion as base_motion
from .soil_column import SoilColumn as SoilColumn
from .strain_compatible import StrainCompatible as StrainCompatible
from .strain_compatible import strain_compatible as strain_compatible
from .upgoing_wave import UpgoingVelocity as UpgoingVelocity
from .upgoing_wave import upgoing as upgoing

__all__: list[str] = [
    "BaseMotion",
    "CompanionRun",
    "FreeField",
    "SiteResponse",
    "SoilColumn",
    "SoilCurves",
    "StrainCompatible",
    "UpgoingVelocity",
    "base_motion",
    "equivalent_linear",
    "strain_compatible",
    "upgoing",
]
