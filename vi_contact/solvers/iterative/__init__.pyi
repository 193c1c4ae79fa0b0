# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .route import Iterative as Iterative

__all__: list[str] = ["Iterative"]
