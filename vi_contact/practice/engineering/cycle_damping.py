"""Tell the damping that a run really had, from its loops and from its energy.

    D = dissipated in a cycle / (4 pi stored at its amplitude)

Source: Kramer, Geotechnical Earthquake Engineering (1996), section 6.4.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.checks import number
from ...core.errors import InputError
from .peak_values import column_of

LEAST = 0.1  # of the largest range: a way back that is smaller does not end half a cycle


@dataclass(frozen=True)
class CycleDamping:
    """Hold amplitude, secant stiffness and damping ratio of cycles, (cycles,) each.

    Attributes:
        amplitude: half the range of the deformation.
        stiffness: range of the force over that of the deformation.
        damping: D, a share of the critical damping.
    """

    amplitude: Array
    stiffness: Array
    damping: Array


def loop_damping(
    history: Mapping[str, Array], deformation: str, force: str, *, least: float = LEAST
) -> CycleDamping:
    """Return the damping of the loops of two columns, such as strain_xy_a and stress_xy_a.

    A loop goes from one turn of the deformation to the next but one, and is closed by a straight
    line. Its area is what is dissipated; ½ F x at its amplitude is what is stored.

    Args:
        history: column -> values (rows,) of a run.
        deformation: column of x.
        force: column of F.
        least: share of the largest range that a way must have to be half a cycle.

    Raises:
        InputError: no such column, or not a single cycle.
    """
    number("loop_damping", "least", least)
    x = column_of(history, deformation)
    y = column_of(history, force)
    turns = find_turns(x, least * float(np.ptp(x)))
    if len(turns) < 3:
        raise InputError(
            f"loop_damping: '{deformation}' has no whole cycle between its turns; give the history "
            "of a longer run, or a smaller least"
        )
    rows = []
    for begin, end in zip(turns[:-2], turns[2:], strict=True):
        way = np.append(x[begin : end + 1], x[begin])
        forces = np.append(y[begin : end + 1], y[begin])
        area = abs(float(np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(way))))
        amplitude = 0.5 * float(np.ptp(way))
        high = int(np.argmax(way))
        low = int(np.argmin(way))
        stiffness = float(forces[high] - forces[low]) / (2.0 * amplitude)
        stored = 0.5 * stiffness * amplitude**2
        damping = area / (4.0 * np.pi * stored) if stored > 0.0 else np.nan
        rows.append((amplitude, stiffness, damping))
    return CycleDamping(*np.array(rows).T)


def find_turns(x: Array, least: float) -> list[int]:
    """Return the rows at which a history turns round, with ways of at least ``least`` between.

    The first and the last row do not count.

    Args:
        x: the history (rows,).
        least: the smallest way back that counts.
    """
    turns: list[int] = []
    way = 0  # 1 on the way up, -1 on the way down, 0 before the first turn
    high = low = 0
    for row in range(1, len(x)):
        high = row if x[row] >= x[high] else high
        low = row if x[row] <= x[low] else low
        if way >= 0 and x[high] - x[row] >= least > 0.0:
            if way:
                turns.append(high)
            way = -1
            low = row
        elif way <= 0 and x[row] - x[low] >= least > 0.0:
            if way:
                turns.append(low)
            way = 1
            high = row
    return turns


def energy_damping(history: Mapping[str, Array], period: float) -> CycleDamping:
    """Return the damping of a whole body, cycle by cycle, from its energy ledger (``Energy``).

    D is what damping, yielding and friction take in a period, over 4 pi times the range of
    energy_strain in it. The amplitude is that range [J]; there is no stiffness (nan).

    Args:
        history: of a run with ``Energy()``.
        period: of the motion [s].

    Raises:
        InputError: a history without the ledger, or shorter than a period.
    """
    number("energy_damping", "period", period, unit="s")
    t = column_of(history, "t")
    strain = column_of(history, "energy_strain")
    lost = sum(
        column_of(history, name)
        for name in ("loss_damping", "loss_friction", "loss_plastic")
        if name in history
    )
    count = int((t[-1] - t[0]) / period * (1.0 + 1e-9)) if period > 0.0 else 0
    if count < 1:
        raise InputError(
            f"energy_damping: the run of {t[-1] - t[0]:g} s has no whole period of {period:g} s; "
            "give a shorter one that is above zero"
        )
    rows = []
    for k in range(count):
        begin = t[0] + k * period
        end = t[0] + (k + 1) * period
        inside = (t >= begin) & (t <= end)
        stored = float(np.ptp(strain[inside]))
        taken = float(np.interp(end, t, lost) - np.interp(begin, t, lost))
        damping = taken / (4.0 * np.pi * stored) if stored > 0.0 else np.nan
        rows.append((stored, np.nan, damping))
    return CycleDamping(*np.array(rows).T)
