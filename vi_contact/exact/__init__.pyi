# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .hertz import HertzImpact as HertzImpact
from .hertz import HertzPoint as HertzPoint
from .hertz import contact_modulus as contact_modulus
from .hertz import contact_radius as contact_radius
from .housner import HousnerBlock as HousnerBlock

__all__: list[str] = ['HertzImpact', 'HertzPoint', 'HousnerBlock', 'contact_modulus', 'contact_radius']
