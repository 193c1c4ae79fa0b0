"""Read the design spectrum of a case, which stands in its table [sheet].

[sheet]
design_spectrum = {type = "EC8", ground = "B", ag = "0.16 g"}
design_spectrum = {type = "EC8", vertical = true, ag = 1.57}
design_spectrum = {periods = [0.0, 0.1, 0.4, 2.0], accelerations = [1.0, 2.5, 2.5, 0.5]}
"""

from pathlib import Path
from typing import Annotated, Any

from .....core.errors import InputError
from .....core.quantities import RATIO, Positive, Unit
from ....ground_motion.design_spectrum import DesignSpectrum, TabulatedSpectrum
from ....ground_motion.ec8 import EC8Spectrum
from ..parsing import Words, read
from ..table_calls import Spot, build, make_callee

KEY = "design_spectrum"


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


def read_design_spectrum(value: Any, source: str) -> DesignSpectrum:
    """Return the design spectrum of a table.

    Args:
        value: what stands at the key ``design_spectrum`` of [sheet].
        source: what sentences begin with, such as the path of the case.

    Raises:
        InputError: for another type, keys that are unknown or missing, and wrong values.
    """
    choices = {
        "EC8": make_callee(eurocode, name="EC8"),
        "Tabulated": make_callee(TabulatedSpectrum, name="Tabulated"),
    }
    words = Words(
        folder=Path(),
        choices={DesignSpectrum: choices},
        default={DesignSpectrum: "Tabulated"},
        groups=(),
        short={},
    )
    spot = Spot(source, "sheet", KEY)
    if not isinstance(value, dict):
        raise spot.make_error('is no table: give {type = "EC8", …} or {periods = […], …}')
    spectrum: DesignSpectrum = build(read(value, DesignSpectrum, spot, words), {})
    return spectrum


def find_design_spectrum(case: Any) -> DesignSpectrum | None:
    """Return the design spectrum of a ``Case``; None where its [sheet] has none.

    Raises:
        InputError: as of ``read_design_spectrum``.
    """
    sheet = case.tables.get("sheet", {})
    if not isinstance(sheet, dict) or KEY not in sheet:
        return None
    return read_design_spectrum(sheet[KEY], str(case.path))
