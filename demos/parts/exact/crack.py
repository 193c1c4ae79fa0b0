"""Give closed forms for a bar in tension with the quadratic (AT2) phase-field model of fracture.

    energy = ∫ (1 - d)² ½ E eps² + Gc/2 (d²/l + l |∇d|²),    d >= its values before

Homogeneous: d = E eps² / (E eps² + Gc/l), stress (1 - d)² E eps, largest at eps_c = sqrt(Gc / (3 l
E)) where d = 1/4 and the stress is 9/16 E eps_c; unloading goes back along the secant, d stays. A
crack, d = 1 at x = 0, has the profile exp(-|x|/l) and the energy Gc per area. (K. Pham, H. Amor,
J.-J. Marigo, C. Maurini, Int. J. Damage Mech. 20, 2011; C. Miehe, M. Hofacker, F. Welschinger,
CMAME 199, 2010.) Here E = Gc = 1 and l is given.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def critical(l: float) -> tuple[float, float]:  # noqa: E741
    """Return the strain and the stress at the peak."""
    strain = float(np.sqrt(1.0 / (3.0 * l)))
    return strain, 9.0 / 16.0 * strain


def homogeneous(strains: Any, l: float) -> tuple[Any, Any]:  # noqa: E741
    """Return (d, stress) along a history of strains, d never falling."""
    energy = np.maximum.accumulate(np.asarray(strains, dtype=float)) ** 2
    d = energy / (energy + 1.0 / l)
    return d, (1.0 - d) ** 2 * np.asarray(strains)
