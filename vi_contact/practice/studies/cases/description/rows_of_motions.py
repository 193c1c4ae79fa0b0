"""Write the rows of what shakes a model, and of spectra."""

from collections.abc import Iterator, Mapping
from typing import Any

from ....units.report_units import write_number
from .pen import NONE, Model, Pen, Row, list_objects, say

# Key of a record -> what it is called, SI unit.
MEASURES = (
    ("dt", "time step", "s"),
    ("duration", "duration", "s"),
    ("pga", "PGA, with the scale", "m/s²"),
    ("pgv", "PGV, with the scale", "m/s"),
    ("pgd", "PGD, with the scale", "m"),
    ("arias", "Arias intensity", "m/s"),
    ("d5_95", "significant duration, 5 to 95 %", "s"),
    ("mean_period", "mean period", "s"),
    ("f_95", "95 % of its energy are below", "Hz"),
)


def list_motions(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield what each record is and how strong, and the numbers of other excitations."""
    for record in list_objects(model, "records"):
        name = record.get("file", NONE)
        digits = str(record.get("sha256") or "")[:12]
        if digits:
            yield say(f"{name}: sha256", f"{digits}…", f"read in {record['units']}")
        if "scale" in record:
            yield say(f"{name}: scale", write_number(record["scale"]))
        if record.get("direction"):
            yield pen.row_of_several(f"{name}: direction", record["direction"], NONE)
        for key, meaning, unit in MEASURES:
            if record.get(key) is not None:
                yield pen.row(f"{name}: {meaning}", record[key], unit)
    for motion in list_objects(model, "excitations"):
        kind = motion["kind"]
        if motion.get("direction"):
            yield pen.row_of_several(f"{kind}: direction", motion["direction"], NONE)
        for number in motion["numbers"]:
            yield pen.row(f"{kind}: {number['name']}", number["value"], number["unit"])


def list_spectra(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the spectrum of each record beside the design spectrum."""
    design = model.get("design_spectrum") or {}
    wanted = dict(zip(design.get("periods", ()), design.get("accelerations", ()), strict=True))
    for record in list_objects(model, "records"):
        spectrum = record.get("spectrum") or {}
        if not spectrum:
            continue
        percent = write_number(100.0 * spectrum["damping"])
        for period, value in zip(spectrum["periods"], spectrum["accelerations"], strict=True):
            name = f"{record['file']}: S_a at {write_number(period)} s, {percent} %"
            yield pen.row(name, value, "m/s²", _set_beside(design, wanted.get(period), value, pen))
    if design and not list_objects(model, "records"):
        for period, value in wanted.items():
            if value is not None:
                name = f"{design['name']}: S_a at {write_number(period)} s"
                yield pen.row(name, value, "m/s²")


def _set_beside(design: Mapping[str, Any], wanted: float | None, value: float, pen: Pen) -> str:
    """Return what a design spectrum has at a period, and the share of it that a record has.

    Args:
        design: of model.json, {} for none.
        wanted: its acceleration [m/s²], None where it says none.
        value: that of the record [m/s²].
        pen: writes.
    """
    if wanted is None:
        return ""
    _, number, unit, _ = pen.row("", wanted, "m/s²")
    share = f", of which it has {value / wanted:.2f}" if wanted else ""
    return f"{design['name']}: {number} {unit}{share}"
