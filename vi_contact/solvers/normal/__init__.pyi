# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .active_set import ActiveSet as ActiveSet
from .hildreth import Hildreth as Hildreth
from .lemke import Lemke as Lemke
from .uniqueness import PMatrix as PMatrix
from .uniqueness import p_matrix as p_matrix

__all__: list[str] = ["ActiveSet", "Hildreth", "Lemke", "PMatrix", "p_matrix"]
