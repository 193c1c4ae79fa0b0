"""Say the words of a design spectrum, which a case names in its table [sheet].

[sheet]
design_spectrum = {type = "EC8", ground = "B", ag = "0.16 g"}
design_spectrum = {type = "EC8", vertical = true, ag = 1.57}
design_spectrum = {periods = [0.0, 0.1, 0.4, 2.0], accelerations = [1.0, 2.5, 2.5, 0.5]}
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from .....core.errors import InputError
from .....core.quantities import RATIO, Positive, Unit
from ....ground_motion.design_spectrum import DesignSpectrum, TabulatedSpectrum
from ....ground_motion.ec8 import EC8Spectrum
from ..parsing import Words
from ..table_calls import make_callee


def eurocode(
    ag: Annotated[float, Positive, Unit("m/s²")],
    ground: str = "",
    *,
    vertical: bool = False,
    kind: int = 1,
    damping: Annotated[float, RATIO] = 0.05,
) -> EC8Spectrum:
    """Make the elastic spectrum of EN 1998-1.

    Args:
        ag: design ground acceleration on ground A [m/s²].
        ground: "A" to "E"; the vertical spectrum is the same on every ground.
        vertical: whether it is the vertical one.
        kind: type of the spectrum, 1, or 2 for weak near earthquakes.
        damping: ratio.
    """
    if not vertical:
        return EC8Spectrum.on_ground(ground, ag=ag, kind=kind, damping=damping)
    if ground:
        raise InputError(
            f"the vertical spectrum is the same on every ground, and ground is '{ground}': leave "
            "it out"
        )
    return EC8Spectrum.vertical(ag=ag, kind=kind, damping=damping)


# Words of a design spectrum -> what they call, when asked; DEFAULT is that of a table without type.
CHOICES: Mapping[str, Callable[[], Any]] = {
    "EC8": lambda: eurocode,
    "Tabulated": lambda: TabulatedSpectrum,
}
DEFAULT = "Tabulated"


def make_sheet_words(folder: Path) -> Words:
    """Return the words of [sheet] alone: a report asks for no others, and so for no DOLFINx."""
    choices = {word: make_callee(load(), name=word) for word, load in CHOICES.items()}
    return Words(
        folder, {DesignSpectrum: choices}, default={DesignSpectrum: DEFAULT}, groups=(), short={}
    )
