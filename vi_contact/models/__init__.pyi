# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from . import wall as wall

__all__: list[str] = ['wall']
