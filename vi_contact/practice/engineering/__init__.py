"""Answer what engineers ask of a run: resultants, racking, floor spectra, peaks, frequencies.

The functions take the ``history`` of a run: docs/guide/outputs.md; ``checks`` compare it with
formulas: docs/guide/checks.md. What records a history stands in ``run.recorders``.

>>> import numpy as np
>>> from vi_contact.practice.engineering import hysteresis
>>> hysteresis({"u": np.array([0.0, 1.0, 2.0]), "F": np.array([0.0, 3.0, 6.0])}, "u", "F").work
array([0. , 1.5, 6. ])
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
