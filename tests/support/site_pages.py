"""Pages of the site, their blocks, and the programs of docs/, which are no modules of a package."""

from __future__ import annotations

import re
import sys
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^ *```(\S*)[^\n]*\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return [
        body
        for name, body in FENCE.findall((ROOT / page).read_text(encoding="utf-8"))
        if name == language
    ]


@cache
def loaded(path: Path) -> ModuleType:
    """A program as a module; its data classes look for their module."""
    spec = spec_from_file_location(f"{path.parent.name}_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    found = sys.modules[spec.name] = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found
