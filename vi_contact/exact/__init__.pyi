# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .housner import HousnerBlock as HousnerBlock

__all__: list[str] = ['HousnerBlock']
