# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .inequality import Result as Result
from .inequality import solve as solve

__all__: list[str] = ["Result", "solve"]
