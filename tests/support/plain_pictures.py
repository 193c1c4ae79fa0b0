"""Pictures of few pixels, drawn once and without axes.

Matplotlib arranges a picture by drawing it a second time, titles by measuring every number on the
axes, and ticks take longer than all curves.

How they are arranged is seen in tests/plots, which draws them as users do, and in docs/figures.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

DPI = 50


@contextmanager
def plain_pictures() -> Iterator[None]:
    """Let figures have no layout engine, titles stay where they begin, axes be left out, and files
    have 50 dots per inch and all of the canvas."""
    try:
        from matplotlib.axes import Axes
        from matplotlib.axis import Axis
        from matplotlib.figure import Figure
    except ImportError:
        yield
        return
    save = Figure.savefig

    def saved(figure: Any, *target: Any, **more: Any) -> Any:
        film = more.get("format") == "rgba"  # its writer says how many pixels a frame has
        return save(figure, *target, **(more if film else more | {"dpi": DPI, "bbox_inches": None}))

    with ExitStack() as stack:
        for owner, name, new in (
            (Figure, "get_layout_engine", lambda figure: None),
            (Figure, "savefig", saved),
            (Figure, "align_ylabels", lambda figure, axes=None: None),
            (Axes, "_update_title_position", lambda axes, renderer: None),
            (Axis, "draw", lambda axis, renderer: None),
            (Axis, "get_tightbbox", lambda axis, renderer=None, **more: None),
        ):
            if hasattr(owner, name):  # matplotlib may rename what is its own
                stack.enter_context(patch.object(owner, name, new))
        yield
