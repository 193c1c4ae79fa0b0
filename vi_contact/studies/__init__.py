"""Studies of a problem that is written down: case files, and many runs of one case. Names are imported when used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Case": "cases.case", "read_case": "cases.case", "run_case": "cases.case", "IDA": "ida.ida", "run_ida": "ida.ida",
}
"""Public name -> module of this folder it lives in."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
