"""Pictures of few pixels, drawn once: matplotlib arranges a picture by drawing it a second time, and pixels take time.

How they are arranged is seen in tests/plots, which draws them as users do, and in docs/figures.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

DPI = 50


@contextmanager
def plain_pictures() -> Iterator[None]:
    """Let figures have no layout engine, and files of them 50 dots per inch."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        yield
        return
    save = Figure.savefig

    def saved(figure: Any, *target: Any, **more: Any) -> Any:
        film = more.get("format") == "rgba"  # its writer says how many pixels a frame has
        return save(figure, *target, **(more if film else more | {"dpi": DPI}))

    with patch.object(Figure, "get_layout_engine", lambda figure: None), patch.object(Figure, "savefig", saved):
        yield
