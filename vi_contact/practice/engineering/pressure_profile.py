"""Find the pressure of a part of the contact over its height, in some steps of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask
from ...core.errors import InputError
from ...run.recorders.contact_parts import Geometry, Part, contact_summary

LARGEST = "max"  # the time of the largest thrust, as a word
FLAT = 1e-9  # height of a part over its size, below which it is level
SLIDES = 1e-6  # share of the friction that may be left of a point that slides


@dataclass(frozen=True)
class PressureProfile:
    """Hold the pressure of a part over its height in one step, with its resultants.

    Attributes:
        t: time [s].
        largest: whether this is the step of the largest thrust.
        heights: (n,) of the points above the foot, rising [m].
        pressure: (n,) normal pressure [Pa].
        shear: (n,) tangential traction on the body, upwards positive [Pa].
        states: (n,) "open", "closed" without friction, "sticks" or "slides" with it, or "hardly
            covered" where the pressure of a point is none.
        thrust: N, the force along the normal [N].
        height: of N above the foot [m], nan where the part is open.
        moment: N times its height [N m].
        lift: sum of shear times area, upwards on the body [N].
        open_share: of the part, by area.
    """

    t: float
    largest: bool
    heights: Array
    pressure: Array
    shear: Array
    states: tuple[str, ...]
    thrust: float
    height: float
    moment: float
    lift: float
    open_share: float


def find_profiles(
    history: Mapping[str, Array],
    geometry: Geometry,
    chosen: Mask,
    *,
    name: str,
    times: Sequence[float | str] = (0.0, LARGEST),
    foot: float | None = None,
    mu: float | None = None,
) -> tuple[PressureProfile, ...]:
    """Return the pressure over the height of a part, at each of some times.

    Args:
        history: column -> values, of a run folder or a solution that recorded ``Contact()``.
        geometry: its contact points, ``read_run(folder).contact``.
        chosen: (m,) which points are in the part.
        name: of the part, for sentences.
        times: [s], the step next to each is taken; "max" is that of the largest thrust.
        foot: level from which heights count, a coordinate [m]; None: the lowest point of the part.
        mu: coefficient of friction of the part; None: none.

    Returns:
        One profile for each step; a step that is meant twice is there once.

    Raises:
        InputError: there are no arrays of the contact points, the part is level, or a time is not
            of the run.
    """
    part = Part(name, geometry, None, lambda points, normals: chosen, None)
    levels = geometry.points[chosen][:, -1]
    if not part.tall > FLAT * np.ptp(geometry.points[chosen], axis=0).max():
        raise InputError(f"part '{name}' is level: give a part that has a height, such as a wall")
    centre = np.array(part.centre)
    centre[-1] = levels.min() if foot is None else foot
    summary = contact_summary(
        history, geometry, centre=centre.tolist(), name=name, where=lambda points, normals: chosen
    )
    largest = int(np.argmax(summary["N"]))
    rows = [_find_row(history["t"], time, largest, name) for time in times]

    # The points from the foot up, and the direction along which the body is lifted at each.
    order = np.argsort(levels, kind="stable")
    up = np.eye(part.dimension)[-1]
    upwards = up - part.normals * part.normals[:, -1:]
    size = np.linalg.norm(upwards, axis=1, keepdims=True)
    upwards = np.divide(upwards, size, out=np.zeros_like(upwards), where=size > FLAT)

    profiles = []
    for row in dict.fromkeys(rows):
        pressure = np.asarray(history["pressure"][row], dtype=float)[chosen]
        shear = np.zeros(len(pressure))
        if "traction_t" in history:
            tractions = np.reshape(history["traction_t"][row], (len(chosen), -1))[chosen]
            # traction_t acts on the support: what the body feels is the opposite
            shear = 0.0 - np.einsum("kd,kdc,kc->k", upwards, part.tangents, tractions)
        thrust = float(summary["N"][row])
        profiles.append(
            PressureProfile(
                t=float(history["t"][row]),
                largest=row == largest,
                heights=levels[order] - centre[-1],
                pressure=pressure[order],
                shear=shear[order],
                states=tuple(np.array(_name_states(history, geometry, chosen, row, mu))[order]),
                thrust=thrust,
                height=float(summary["height"][row]),
                moment=thrust * float(np.nan_to_num(summary["height"][row])),
                lift=float(shear @ part.weights),
                open_share=float(summary["uplift"][row]),
            )
        )
    return tuple(profiles)


def _find_row(t: Array, time: float | str, largest: int, name: str) -> int:
    """Return the row of a time.

    Args:
        t: (rows,) times of the run [s].
        time: [s], or "max".
        largest: the row of the largest thrust.
        name: of the part, for the sentence.
    """
    if time == LARGEST:
        return largest
    slack = 0.5 * float(np.diff(t).max(initial=0.0))
    if isinstance(time, str) or not t[0] - slack <= time <= t[-1] + slack:
        raise InputError(
            f"part '{name}': the run lasts from {t[0]:g} to {t[-1]:g} s, and {time} is no time of "
            "it: give times in between, or max"
        )
    return int(np.argmin(np.abs(t - time)))


def _name_states(
    history: Mapping[str, Array], geometry: Geometry, chosen: Mask, row: int, mu: float | None
) -> list[str]:
    """Return the state of each point of a part in a step.

    Args:
        history: as of ``find_profiles``.
        geometry: the contact points.
        chosen: (m,) which of them are in the part.
        row: of the step.
        mu: coefficient of friction; None: none.
    """
    active = np.asarray(history["active"][row])[chosen] > 0.5
    pressure = np.asarray(history["pressure"][row], dtype=float)[chosen]
    uncovered = getattr(geometry, "uncovered", None)
    hardly = np.zeros(len(pressure), dtype=bool) if uncovered is None else uncovered[chosen]

    # A point slides where its traction is as large as the friction lets it be.
    states = np.where(active, "closed", "open").astype(object)
    if mu and "traction_t" in history:
        tractions = np.reshape(history["traction_t"][row], (len(chosen), -1))[chosen]
        slides = np.linalg.norm(tractions, axis=1) >= (1.0 - SLIDES) * mu * pressure
        states[active & slides] = "slides"
        states[active & ~slides] = "sticks"
    states[hardly] = "hardly covered"
    return [str(state) for state in states]
