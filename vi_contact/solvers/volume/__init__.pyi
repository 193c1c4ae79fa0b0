# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .route import Volume as Volume
from .snes import ReducedNewton as ReducedNewton
from .snes import SemismoothNewton as SemismoothNewton
from .tao import TaoTron as TaoTron

__all__: list[str] = ['ReducedNewton', 'SemismoothNewton', 'TaoTron', 'Volume']
