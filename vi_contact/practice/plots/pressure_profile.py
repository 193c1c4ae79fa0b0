"""Draw the pressure on a wall over its height, as a run has it and as formulas say.

Lines are told apart without colour: those of the run are black with marks, those of formulas are
grey and have patterns.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core.algebra import Array
from ..engineering.checks.pressure_line import FormulaLine
from ..engineering.pressure_profile import PressureProfile
from ..units.report_units import ReportUnits, choose_unit
from .histories import canvas, escape_dollars, save

SIZE = (6.4, 6.0)  # inches
MARKS = ("o", "s", "^", "D", "v", "P")
FILLS = ("black", "white")
PATTERNS = ("-", (0, (1, 1.5)), (0, (5, 2)), (0, (6, 2, 1, 2)), (0, (3, 1, 1, 1, 1, 1)))
GREYS = ("0.35", "0.55")
MOST_MARKS = 30  # on a line
ROOM = 1.08  # of the axis of pressures, over the largest one


def draw_profile(
    profiles: Sequence[PressureProfile],
    lines: Sequence[FormulaLine],
    path: str | Path,
    *,
    title: str,
    units: ReportUnits = ReportUnits(),
) -> Path:
    """Draw pressure over height, and return the path.

    Points that the other side hardly covers are left out, and so are formulas that do not apply.
    A passive pressure may leave the picture: its axis fits the other lines.

    Args:
        profiles: of the run.
        lines: of the formulas.
        path: the picture; its ending says the format.
        title: stands above it.
        units: of the pressure and of the height.
    """
    per_pressure, pressure_unit = choose_unit("Pa", units)
    per_height, height_unit = choose_unit("m", units, quantity="size")
    figure, ((axis,),) = canvas(1, 1, SIZE)
    largest = []
    drawn = [line for line in lines if not line.applies]
    for number, line in enumerate(drawn):
        pressure = per_pressure * line.pressure
        axis.plot(
            pressure,
            per_height * line.heights,
            color=GREYS[number // len(PATTERNS) % len(GREYS)],
            ls=PATTERNS[number % len(PATTERNS)],
            lw=1.6,
            label=escape_dollars(line.name),
        )
        largest += [] if line.passive else [float(pressure.max())]
    for number, profile in enumerate(profiles):
        has_pressure = np.array(profile.states) != "hardly covered"
        pressure = per_pressure * profile.pressure[has_pressure]
        axis.plot(
            pressure,
            per_height * profile.heights[has_pressure],
            color="black",
            lw=1.2,
            marker=MARKS[number % len(MARKS)],
            markevery=max(1, int(has_pressure.sum()) // MOST_MARKS),
            ms=4.5,
            mfc=FILLS[number % len(FILLS)],
            clip_on=False,
            label=escape_dollars(describe_time(profile)),
        )
        largest.append(float(pressure.max(initial=0.0)))

    # The wall stands at the left, from its foot up.
    lowest = min(0.0, *(float(one.heights.min()) for one in profiles))
    highest = _find_highest(profiles, drawn)
    width = ROOM * max(largest, default=0.0)
    axis.set(
        xlabel=f"normal pressure [{pressure_unit}]",
        ylabel=f"height above the foot [{height_unit}]",
        ylim=(per_height * lowest, per_height * highest),
        title=escape_dollars(title),
    )
    if width > 0.0:
        axis.set_xlim(0.0, width)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=8, frameon=False)
    return save(figure, path)


def describe_time(profile: PressureProfile) -> str:
    """Return the time of a profile, for people."""
    return f"run, t = {profile.t:.4g} s" + (", largest thrust" if profile.largest else "")


def _find_highest(profiles: Sequence[PressureProfile], lines: Sequence[FormulaLine]) -> float:
    """Return the height of the highest point that is drawn [m]."""
    tops: list[Array] = [one.heights for one in profiles] + [line.heights for line in lines]
    return max(float(heights.max()) for heights in tops)
