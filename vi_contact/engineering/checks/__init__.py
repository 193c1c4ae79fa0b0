"""Check a run against the formulas of textbooks: each prints its formula, inputs and range, docs/guide/checks.md.

>>> from vi_contact.engineering.checks import AtRest
>>> import numpy as np
>>> AtRest(height=5.0, rho=2000.0, nu=0.3, gravity=10.0).compare({"N_wall": np.array([1.1e5])}).expected
107142.85714285714
"""

from ...core.lazy import lazy

_CONTENTS = {"earth_pressure_static": ("AtRest", "Coulomb", "Rankine")}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
