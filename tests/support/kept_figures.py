"""Keep the figures that a test saves, to look into them."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from vi_contact.practice.plots import histories


def keep_figures(monkeypatch: pytest.MonkeyPatch, *modules: ModuleType) -> list[Any]:
    """Return the list to which these modules add every figure when they save it."""
    seen: list[Any] = []
    save = histories.save

    def keep(figure: Any, *others: Any) -> Path:
        seen.append(figure)
        return save(figure, *others)

    for module in modules:
        monkeypatch.setattr(module, "save", keep)
    return seen
