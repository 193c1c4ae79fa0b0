# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .route import Volume as Volume
from .snes import ReducedNewton as ReducedNewton
from .snes import SemismoothNewton as SemismoothNewton
from .tao import TaoTron as TaoTron

__all__: list[str] = ["ReducedNewton", "SemismoothNewton", "TaoTron", "Volume"]
