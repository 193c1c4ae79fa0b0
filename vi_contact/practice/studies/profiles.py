"""Set the pressure of the soil on a wall, as a run has it, beside the formulas of its case."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask
from ...core.arguments import check_arguments
from ...core.checks import quote
from ...core.errors import InputError
from ...core.own_files import is_own
from ...run.files.folder import HISTORY_H5, MODEL
from ...run.files.reading import RunFolder, read_object, read_run
from ...run.recorders.contact_parts import find_in_box
from ..engineering.checks.comparison import find_duration
from ..engineering.checks.earth_pressure_seismic import LayerCheck
from ..engineering.checks.earth_pressure_static import EarthPressure
from ..engineering.checks.model_facts import ModelFacts, find_owners
from ..engineering.checks.pressure_line import FormulaLine, make_line
from ..engineering.pressure_profile import LARGEST, PressureProfile, find_profiles
from ..units.report_units import ReportUnits
from .cases.library import read_copy
from .cases.toml_file import list_tables
from .report import read_checks, read_sheet


@dataclass(frozen=True)
class ProfileReport:
    """Hold the profiles of a part and the formulas beside them.

    Attributes:
        part: name of the part.
        profiles: of the run.
        lines: of the formulas that the case names for the part.
        width: of the model across its plane [m], by which forces are divided; None in space where
            no check gives it: forces are then those of the whole.
        notes: sentences about the run.
        units: of the report of the run.
    """

    part: str
    profiles: tuple[PressureProfile, ...]
    lines: tuple[FormulaLine, ...]
    width: float | None
    notes: tuple[str, ...]
    units: ReportUnits = ReportUnits()


@check_arguments
def profile(
    folder: str | Path,
    part: str,
    *,
    times: Sequence[float | str] = (0.0, LARGEST),
    foot: float | None = None,
) -> ProfileReport:
    """Return the pressure over the height of a part of the contact, and the formulas beside it.

    Args:
        folder: of the run of a case, which recorded ``Contact()``.
        part: name of a [[contact]], of its group, or of a ``Resultants``.
        times: [s]; "max" is the time of the largest thrust of the part.
        foot: level from which heights count [m]; None: the lowest point of the part.

    Raises:
        InputError: as of ``read_run`` and ``find_profiles``, and for a part that is not there.
    """
    folder = Path(folder)
    run = read_run(folder)
    if run.contact is None or "pressure" not in run.history:
        raise InputError(
            f"'{folder}' has no pressures of contact points in {HISTORY_H5}: run the case to its "
            'end with [[record]] type = "Contact"'
        )
    facts = ModelFacts.read(folder)
    chosen = pick_part(folder, run, part)
    checks = [
        check
        for check in read_checks(folder)
        if isinstance(check, EarthPressure) and check.part == part
    ]
    profiles = find_profiles(
        run.history,
        run.contact,
        chosen,
        name=part,
        times=times,
        foot=foot,
        mu=facts.find_mu(part),
    )
    width = checks[0].width if checks else None
    if width is None and run.contact.points.shape[1] == 2:
        width = 1.0
    heights = np.linspace(0.0, max(float(one.heights.max()) for one in profiles), 101)
    lines = [
        make_line(check, run.history, facts, heights)
        for check in checks
        if not isinstance(check, LayerCheck)
    ]
    notes = _find_notes(run, part, profiles)
    units = read_sheet(folder, read_copy(folder), run).units
    return ProfileReport(part, profiles, tuple(lines), width, notes, units)


def _find_notes(run: RunFolder, part: str, profiles: Sequence[PressureProfile]) -> tuple[str, ...]:
    """Return how long the largest thrust lasts, and how many points have no pressure."""
    notes = []
    column = f"N_{part}"
    thrust = run.history.get(column, np.zeros(1))
    if any(one.largest for one in profiles) and float(thrust.max()) > 0.0:
        lasted, rows = find_duration(run.history["t"], thrust)
        one_step = ", one step: compute with half the time step before you believe it"
        notes.append(
            f"the largest thrust lasts {lasted:.3g} s above 90 %{one_step if rows == 1 else ''}"
        )
    hardly = profiles[0].states.count("hardly covered")
    if hardly:
        notes.append(f"points that the other side hardly covers have no pressure: {hardly}")
    return tuple(notes)


def pick_part(folder: Path, run: RunFolder, part: str) -> Mask:
    """Return which contact points (m,) of a run are in a part.

    The part is a [[contact]] of this name, or one of whose groups has it; else what a
    ``Resultants`` of this name records: such a contact, a box, or all of it.

    Raises:
        InputError: there is no such part, or model.json does not belong to the run.
    """
    assert run.contact is not None
    points = run.contact.points
    contacts = _list_contacts(folder)
    chosen = _pick_contact(contacts, part, len(points), folder)
    if chosen is not None:
        return chosen
    names = [name for name, _ in contacts]
    for record in list_tables(read_copy(folder).get("record")):
        if record.get("type") != "Resultants" or record.get("name", record.get("part")) != part:
            continue
        of = record.get("part")
        if of is None:
            return np.ones(len(points), dtype=bool)
        found = _pick_contact(contacts, of, len(points), folder)
        if found is None:
            found = _pick_box(of, points)
        if found is not None:
            return found
    raise InputError(
        f"'{folder}' has no part {quote(part)} of the contact: give the name of a [[contact]], or "
        "of a Resultants whose part is one or a box; the contacts are "
        f"{', '.join(names) or 'none'}"
    )


def _list_contacts(folder: Path) -> list[tuple[str, int]]:
    """Return name and number of points of each [[contact]], in the order of the points."""
    if not is_own(folder / MODEL):
        return []
    model = read_object(folder / MODEL)
    try:
        return [(str(part["name"]), int(part["points"])) for part in model["contact"]]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"'{folder / MODEL}' is damaged ({str(error)[:200]}): restore it"
        ) from error


def _pick_contact(
    contacts: Sequence[tuple[str, int]], part: Any, count: int, folder: Path
) -> Mask | None:
    """Return the points of a contact by its name or that of its group; None for no such.

    Args:
        contacts: name and number of points of each.
        part: a name.
        count: of all points.
        folder: of the run.
    """
    names = [name for name, _ in contacts]
    owners = find_owners(names, part)
    if len(owners) != 1:
        return None
    if sum(points for _, points in contacts) != count:
        raise InputError(
            f"'{folder / MODEL}' tells of other contact points than {HISTORY_H5}: restore them"
        )
    place = names.index(owners[0])
    first = sum(points for _, points in contacts[:place])
    chosen = np.zeros(count, dtype=bool)
    chosen[first : first + contacts[place][1]] = True
    return chosen


def _pick_box(box: Any, points: Array) -> Mask | None:
    """Return the points (m, d) in a box, its faces included; None for what is no box of numbers."""
    try:
        corners = np.asarray(box, dtype=float)
    except (TypeError, ValueError):
        return None
    return find_in_box(points, corners) if corners.shape == (2, points.shape[1]) else None
