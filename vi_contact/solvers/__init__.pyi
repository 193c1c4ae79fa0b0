# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .automatic import Automatic as Automatic
from .condensed import Condensed as Condensed
from .friction import *
from .iterative import *
from .normal import *
from .volume import *

__all__: list[str] = [
    "ActiveSet",
    "Anderson",
    "Automatic",
    "Condensed",
    "FixedPoint",
    "FrictionNewton",
    "GivenForces",
    "Hildreth",
    "Iterative",
    "Lemke",
    "NSGS",
    "PMatrix",
    "Plain",
    "RateIteration",
    "ReducedNewton",
    "SemismoothNewton",
    "TaoTron",
    "Volume",
    "p_matrix",
]
