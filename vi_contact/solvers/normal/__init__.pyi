# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .active_set import ActiveSet as ActiveSet
from .hildreth import Hildreth as Hildreth

__all__: list[str] = ['ActiveSet', 'Hildreth']
