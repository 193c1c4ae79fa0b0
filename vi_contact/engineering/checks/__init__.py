"""Check a run against the formulas of textbooks: each prints its formula, inputs and range, docs/guide/checks.md."""

from ...core.lazy import lazy

_CONTENTS = {
    "earth_pressure_static": ("AtRest", "Coulomb", "Rankine"),
    "earth_pressure_seismic": ("MononobeOkabe", "VeletsosYounan", "Wood"),
    "racking_ratio": ("RackingRatio",), "shaken_block": ("Housner", "NewmarkBlock"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
