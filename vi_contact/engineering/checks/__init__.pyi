# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .earth_pressure_static import AtRest as AtRest
from .earth_pressure_static import Coulomb as Coulomb
from .earth_pressure_static import Rankine as Rankine

__all__: list[str] = ['AtRest', 'Coulomb', 'Rankine']
