# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from . import channel as channel
from . import wall as wall

__all__: list[str] = ['channel', 'wall']
