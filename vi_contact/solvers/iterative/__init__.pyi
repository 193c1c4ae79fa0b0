# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .route import Iterative as Iterative

__all__: list[str] = ['Iterative']
