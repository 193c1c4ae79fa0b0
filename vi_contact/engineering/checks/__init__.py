"""Check a run against the formulas of textbooks: each prints its formula, inputs and range,
docs/guide/checks.md."""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
