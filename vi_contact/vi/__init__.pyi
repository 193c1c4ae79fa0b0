# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .inequality import Result as Result
from .inequality import solve as solve

__all__: list[str] = ['Result', 'solve']
