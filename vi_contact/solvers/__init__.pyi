# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .automatic import Automatic as Automatic
from .condensed import Condensed as Condensed
from .friction import Anderson as Anderson
from .friction import FixedPoint as FixedPoint
from .friction import FrictionNewton as FrictionNewton
from .friction import GivenForces as GivenForces
from .friction import NSGS as NSGS
from .friction import Plain as Plain
from .friction import RateIteration as RateIteration
from .iterative import Iterative as Iterative
from .normal import ActiveSet as ActiveSet
from .normal import Hildreth as Hildreth
from .normal import Lemke as Lemke
from .normal import p_matrix as p_matrix
from .normal import PMatrix as PMatrix
from .volume import ReducedNewton as ReducedNewton
from .volume import SemismoothNewton as SemismoothNewton
from .volume import TaoTron as TaoTron
from .volume import Volume as Volume

__all__: list[str] = ['ActiveSet', 'Anderson', 'Automatic', 'Condensed', 'FixedPoint', 'FrictionNewton', 'GivenForces', 'Hildreth', 'Iterative', 'Lemke', 'NSGS', 'PMatrix', 'Plain', 'RateIteration', 'ReducedNewton', 'SemismoothNewton', 'TaoTron', 'Volume', 'p_matrix']
