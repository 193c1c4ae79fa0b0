"""Check a run against the formulas of textbooks.

Each check prints its formula, inputs and range; see docs/guide/checks.md.
"""

from ....core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
