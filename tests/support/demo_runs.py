"""Run a demo as a user does, in a folder of its own; but its pictures are not arranged, which takes half of their time.

How they are arranged is seen in tests/plots, and in docs/figures.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[2]


def demo(name: str) -> Any:
    """The module demos/<name>.py; its main() draws axes where they stand at first."""
    spec = spec_from_file_location(f"demo_{name}", ROOT / "demos" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main = not_arranged(module.main)
    return module


def not_arranged(main: Callable[..., Any]) -> Callable[..., Any]:
    """The function without matplotlib's constrained layout."""

    @wraps(main)
    def drawn(*args: Any, **more: Any) -> Any:
        with patch("matplotlib.layout_engine.ConstrainedLayoutEngine.execute"):
            return main(*args, **more)

    return drawn
