# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .extrapolation import Anderson as Anderson
from .extrapolation import Plain as Plain
from .fixed_point import FixedPoint as FixedPoint
from .given_forces import GivenForces as GivenForces
from .newton import FrictionNewton as FrictionNewton
from .nsgs import NSGS as NSGS
from .slip_rate import RateIteration as RateIteration

__all__: list[str] = [
    "Anderson",
    "FixedPoint",
    "FrictionNewton",
    "GivenForces",
    "NSGS",
    "Plain",
    "RateIteration",
]
