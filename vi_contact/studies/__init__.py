"""Study a problem that is written down: case files, and many runs of one case."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "cases.case": ("Case", "read_case"),
    "ida.ida": ("IDA", "run_ida"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
