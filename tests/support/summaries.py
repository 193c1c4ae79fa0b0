"""Read the summary of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def summary_of(folder: Path) -> dict[str, Any]:
    """summary.json; NaN or Infinity in it is an error."""

    def refuse(text: str) -> None:
        raise ValueError(text)

    found: dict[str, Any] = json.loads((folder / "summary.json").read_text(), parse_constant=refuse)
    return found
