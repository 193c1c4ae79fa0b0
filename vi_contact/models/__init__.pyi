# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from . import boundary_curve as boundary_curve
from . import channel as channel
from . import wall as wall

__all__: list[str] = ['boundary_curve', 'channel', 'wall']
