"""Take the rod's computed contact force as the normal force of Algorithm 10: the coupling that Ahn (2012) leaves out.

The force r_N^k of (5.1) acts in the step from t_k to t_k+1, and (7.1) of the same step rubs with it. The rod does not
feel the beam, so that rod first, beam second is no approximation: with ``ExactFriction`` it gives ``rubbing_problem``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.checks import array, number, whole
from ..core.errors import InputError
from ..core.step import Scheme
from ..run.march import march
from ..schemes.midpoint import Midpoint
from .contract import rod_problem
from .elements import Elements
from .values import Rod, Start


@dataclass(frozen=True)
class StepForces:
    """Hold forces [N], one per step of dt [s], as a function of the time: that of the step in progress or about to
    begin. InputError for a time that no step covers."""

    dt: float
    forces: tuple[float, ...]

    def __post_init__(self) -> None:
        number("StepForces", "dt", self.dt, positive=True, unit="s")
        array("StepForces", "forces", self.forces, (None,), unit="N")

    def __call__(self, t: float) -> float:
        number("StepForces", "t", t, unit="s")
        step = math.floor(t / self.dt + 1e-6)
        if not 0 <= step < len(self.forces):
            end = len(self.forces) * self.dt
            raise InputError(f"the rod's forces are known for 0 <= t < {end:g} s, not at {t:g} s: let it run as long")
        return self.forces[step]


def rod_forces(
    rod: Rod, elements: Elements, *, dt: float, steps: int, start: Start | None = None, scheme: Scheme | None = None
) -> StepForces:
    """Return |r_N| of every step of the rod [N]. ``scheme``: Midpoint(), the source's, when None."""
    dt = number("rod_forces", "dt", dt, positive=True, unit="s")
    steps = whole("rod_forces", "steps", steps, least=1)
    problem = rod_problem(rod, elements, start)
    run = march(problem, scheme=scheme or Midpoint(), dt=dt, steps=steps)
    return StepForces(dt, tuple(float(state.r_n[0]) for state, _ in run))
