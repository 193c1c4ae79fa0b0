"""Draw out what an earth pressure says over the height of a wall: a line beside a run."""

from dataclasses import dataclass

import numpy as np

from ....core.algebra import Array
from .comparison import History
from .earth_pressure_static import EarthPressure
from .model_facts import ModelFacts

# Class of a check -> its name among people; others keep theirs.
NAMES = {"AtRest": "at rest", "CoulombWedge": "Coulomb", "MononobeOkabe": "Mononobe–Okabe"}


@dataclass(frozen=True)
class FormulaLine:
    """Hold what a formula says of the pressure on a wall.

    Attributes:
        name: of the check, with what it was told.
        thrust: N of a metre of wall [N/m], nan where the formula does not apply.
        height: of N above the foot [m].
        moment: N times its height [N m/m].
        heights: (n,) above the foot [m].
        pressure: (n,) normal pressure there [Pa].
        applies: empty, or why it does not apply.
        passive: whether it is a passive pressure, far above the others.
        notes: sentences on what was taken from the run, and what contradicts it.
    """

    name: str
    thrust: float
    height: float
    moment: float
    heights: Array
    pressure: Array
    applies: str
    passive: bool
    notes: tuple[str, ...]


def make_line(
    check: EarthPressure, history: History, facts: ModelFacts, heights: Array
) -> FormulaLine:
    """Return what a formula says, with what it takes from the run.

    Args:
        check: of the case.
        history: of the run.
        facts: of its model.
        heights: (n,) above the foot [m], to which that of its wall is added.
    """
    settled, notes = check.settle(history, facts)
    thrust, arm, why = settled.expect()
    thrust = float("nan") if why else thrust
    at = np.unique(np.append(heights[heights < settled.height], [0.0, settled.height]))
    kh = getattr(settled, "kh", None)
    name = type(check).__name__
    words = [NAMES.get(name, name)]
    if getattr(check, "passive", False):
        words.append("passive")
    if kh is not None:
        words.append(f"kh = {kh:.3g}")
    return FormulaLine(
        name=", ".join(words),
        thrust=thrust,
        height=arm,
        moment=thrust * arm,
        heights=at,
        pressure=settled.find_pressure(at),
        applies=why,
        passive=getattr(check, "passive", False),
        notes=tuple(notes),
    )
