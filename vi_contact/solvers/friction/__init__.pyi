from .extrapolation import Anderson as Anderson
from .extrapolation import Plain as Plain
from .fixed_point import FixedPoint as FixedPoint
from .given_forces import GivenForces as GivenForces
from .newton import FrictionNewton as FrictionNewton
from .nsgs import NSGS as NSGS
from .slip_rate import RateIteration as RateIteration
