"""Write what model.json says in tables: quantity, value, unit and remark.

``run --check`` prints these rows, and the report has the same before its first figure.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten
from typing import Any

from .....core.step import AXES
from .....core.units import STANDARD_GRAVITY
from ....plots.sections import Table
from ....units.report_units import ReportUnits, choose_unit, write_number, write_quantity

Model = Mapping[str, Any]
Row = tuple[str, str, str, str]
HEADER = ("quantity", "value", "unit", "remark")
NONE = "-"  # where there is no unit
# Numbers of a material or body: key -> (what it is called, SI unit, quantity of ReportUnits).
NUMBERS = {
    "E": ("Young's modulus E", "Pa", "modulus"),
    "E1": ("Young's modulus E1", "Pa", "modulus"),
    "E2": ("Young's modulus E2", "Pa", "modulus"),
    "E3": ("Young's modulus E3", "Pa", "modulus"),
    "nu": ("Poisson's ratio nu", NONE, ""),
    "nu12": ("Poisson's ratio nu12", NONE, ""),
    "nu13": ("Poisson's ratio nu13", NONE, ""),
    "nu23": ("Poisson's ratio nu23", NONE, ""),
    "G": ("shear modulus G", "Pa", "modulus"),
    "G12": ("shear modulus G12", "Pa", "modulus"),
    "G13": ("shear modulus G13", "Pa", "modulus"),
    "G23": ("shear modulus G23", "Pa", "modulus"),
    "length": ("length", "m", "size"),
    "area": ("area of the section", "m²", ""),
    "inertia": ("second moment of area", "m⁴", ""),
    "shear_factor": ("shear factor", NONE, ""),
    "viscosity": ("viscosity", "s", ""),
    "gap": ("gap", "m", "length"),
}
SECTIONS = {"PlaneStrain": "plane strain", "PlaneStress": "plane stress", "Solid": "solid"}


@dataclass(frozen=True)
class _Pen:
    """Write numbers of a model in the units of a report.

    Attributes:
        units: those of the report.
        slice_thickness: in plane strain that of the slice [m], else None.
    """

    units: ReportUnits
    slice_thickness: float | None

    def row(
        self, name: str, value: float, unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of a number in an SI unit.

        Args:
            name: what the number is.
            value: the number.
            unit: its SI unit, "-" for none.
            remark: what is said beside it.
            quantity: as of ``write_quantity``.
        """
        written = write_quantity(
            value, unit, self.units, quantity=quantity, slice_thickness=self.slice_thickness
        )
        return (_text(name), written.number, written.unit, _text(remark))

    def row_of_several(
        self, name: str, values: Sequence[float], unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of the components of a vector, as (1, 2); arguments as of ``row``."""
        factor, name_of_unit = choose_unit(
            unit, self.units, quantity=quantity, slice_thickness=self.slice_thickness
        )
        numbers = [write_number(factor * value) for value in values]
        text = numbers[0] if len(numbers) == 1 else f"({', '.join(numbers)})"
        return (_text(name), text, name_of_unit, _text(remark))

    def row_of_range(
        self, name: str, ends: Sequence[float], unit: str, remark: str = "", *, quantity: str = ""
    ) -> Row:
        """Return the row of what goes from one number to another; arguments as of ``row``."""
        low, high = (self.row(name, end, unit, remark, quantity=quantity) for end in ends)
        return low if low[1] == high[1] else (low[0], f"{low[1]} to {high[1]}", low[2], low[3])


def input_tables(model: Model, units: ReportUnits) -> list[Table]:
    """Return what a model is made of and what acts on it, in tables of rows.

    Keys that a model does not have, as one that an earlier version wrote, are left out.

    Args:
        model: as of ``describe``, or what model.json holds.
        units: in which numbers are written.

    Returns:
        Tables with the columns of HEADER; those without rows are left out.
    """
    section = model.get("section") or {}
    in_slice = section.get("type") == "PlaneStrain"
    pen = _Pen(units, section["thickness"] if in_slice else None)
    tables = []
    for title, list_rows in TABLES.items():
        rows = list(list_rows(model, pen))
        if rows:
            tables.append(Table(HEADER, rows, title))
    return tables


def print_tables(tables: Sequence[Table]) -> str:
    """Return tables as lines of text, each below its title, with their columns in line."""
    lines = []
    for table in tables:
        lines.append(f"{table.title}:")
        widths = [max(len(row[column]) for row in table.rows) for column in range(3)]
        for quantity, value, unit, remark in table.rows:
            shown = "" if unit == NONE else unit
            cells = (quantity.ljust(widths[0]), value.rjust(widths[1]), shown.ljust(widths[2]))
            lines.append(f"  {'  '.join((*cells, remark))}".rstrip())
    return "\n".join(lines)


def _text(value: Any) -> str:
    """Return a text of a file on one line, which nobody made too long to be read."""
    return shorten(str(value), 300, placeholder=" …")


def _say(name: str, value: Any, remark: str = "") -> Row:
    """Return the row of a word or a count."""
    return (_text(name), _text(value), NONE, _text(remark))


def _list_objects(model: Model, key: str) -> list[Mapping[str, Any]]:
    """Return the entries of a list of the model; none where there is no list."""
    entries = model.get(key)
    return [entry for entry in entries or () if isinstance(entry, Mapping)]


# Model and bodies
# --------------------------------------------------------------------------------------------------


def _list_model(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield section, box, mass, gravity, and what is there at the start."""
    section = model.get("section") or {}
    if section:
        yield _say("section", SECTIONS.get(section["type"], section["type"]))
    if section and model["dimension"] == 2:
        in_slice = pen.slice_thickness is not None
        remark = "forces, moments and masses are told for one metre" if in_slice else ""
        yield pen.row("thickness", section["thickness"], "m", remark, quantity="size")
    yield from _list_box(model.get("box") or {}, pen)
    if "mass" in model:
        yield pen.row("mass", model["mass"], "kg")
    if "gravity" in model:
        yield _write_gravity(model["gravity"], pen)
    start = model.get("start") or {}
    for name, unit in (("displacement", "m"), ("velocity", "m/s")):
        if start.get(name):
            yield pen.row(f"largest {name} at the start", start[name], unit)
    if "unknowns" in model:
        degree = f"degree {model['degree']}" if "degree" in model else ""
        yield _say("unknowns", model["unknowns"], degree)
    yield from _list_groups(model)


def _list_box(box: Mapping[str, Any], pen: _Pen) -> Iterator[Row]:
    """Yield the ends of the box round the model, and its extents."""
    ends = zip(AXES, box.get("min", ()), box.get("max", ()), strict=False)
    for axis, low, high in ends:
        extent = pen.row("", high - low, "m", quantity="size")
        remark = f"extent {extent[1]} {extent[2]}"
        name = f"box of the model along {axis}"
        yield pen.row_of_range(name, (low, high), "m", remark, quantity="size")


def _list_groups(model: Model) -> Iterator[Row]:
    """Yield how many groups of the mesh there are of each kind, and their names."""
    names_of: dict[str, list[str]] = {}
    for group in _list_objects(model, "groups"):
        names_of.setdefault(str(group.get("kind")), []).append(str(group.get("name")))
    for kind, names in names_of.items():
        yield _say(f"groups of {kind}", len(names), ", ".join(names))


def _write_gravity(gravity: Mapping[str, Any], pen: _Pen) -> Row:
    """Return the row of gravity."""
    if not gravity:
        return _say("gravity", "none", "nothing has weight")
    along = ", ".join(write_number(part) for part in gravity["direction"])
    bodies = f"of the group {gravity['cells']}" if gravity["cells"] else "of all bodies"
    return pen.row("gravity", gravity["acceleration"], "m/s²", f"along ({along}), {bodies}")


def _list_bodies(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the material of each body, its mass and its centre of mass."""
    for body in _list_objects(model, "bodies"):
        name = body.get("name", NONE)
        material = body.get("material")
        if isinstance(material, Mapping):
            yield from _list_material(name, body, material, pen)
        elif material is not None:
            yield _say(f"{name}: material", material)
        if "mass" in body:
            yield pen.row(f"{name}: mass", body["mass"], "kg", _describe_extent(body, model, pen))
        if "centre" in body:
            yield pen.row_of_several(
                f"{name}: centre of mass", body["centre"], "m", quantity="size"
            )


def _describe_extent(body: Mapping[str, Any], model: Model, pen: _Pen) -> str:
    """Return how large a body is, and of how many cells."""
    if "cells" not in body:
        return ""
    cells = f"{body['cells']} cells"
    if "size" not in body:
        return cells
    unit = {1: "m", 2: "m²", 3: "m³"}[model["dimension"]]
    return f"{write_number(body['size'])} {unit}, {cells}"


def _list_material(
    name: str, body: Mapping[str, Any], material: Mapping[str, Any], pen: _Pen
) -> Iterator[Row]:
    """Yield the numbers of a material.

    Args:
        name: of the body.
        body: its entry in model.json.
        material: the material in it.
        pen: writes.
    """
    kind = material.get("type", "")
    for key, number in material.items():
        if key in NUMBERS:
            meaning, unit, quantity = NUMBERS[key]
            yield pen.row(f"{name}: {meaning}", number, unit, kind, quantity=quantity)
            kind = ""
    if "shear_modulus" in body and not {"G", "G12"} & set(material):
        modulus = body["shear_modulus"]
        yield pen.row_of_range(f"{name}: shear modulus G", modulus, "Pa", kind, quantity="modulus")
    density = body.get("density") or [material.get("rho")] * 2
    if density[0] is not None:
        yield pen.row_of_range(f"{name}: density", density, "kg/m³")
        factor, force = choose_unit("N", pen.units)
        low, high = (write_number(STANDARD_GRAVITY * factor * value) for value in density)
        weight = low if low == high else f"{low} to {high}"
        yield (f"{name}: unit weight", weight, f"{force}/m³", "")
    if "xi" in material:
        yield pen.row(f"{name}: damping ratio xi", 100.0 * material["xi"], "%")


# Actions
# --------------------------------------------------------------------------------------------------


def _list_loads(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the resultant of each load, its point of attack, and its moment about the origin."""
    for load in _list_objects(model, "loads"):
        name = load.get("name", NONE)
        if "value" in load:  # on a body without a mesh
            yield (_text(name), write_number(load["value"]), load["unit"], _text(load["varies"]))
        elif load.get("force"):
            yield from _list_resultant(name, load, pen)
        else:
            yield _say(name, "no resultant", "its stresses balance themselves")
    if model.get("constant_loads"):
        yield from _list_resultant("all constant loads", model["constant_loads"], pen)


def _list_resultant(name: str, load: Mapping[str, Any], pen: _Pen) -> Iterator[Row]:
    """Yield the rows of a resultant."""
    yield pen.row_of_several(f"{name}: resultant", load["force"], "N", load.get("varies", ""))
    if load.get("point") is not None:
        remark = "centre of mass" if load.get("kind") == "weight" else "on its line of action"
        if load.get("level") is not None:
            remark = "where its line of action cuts the foot of the structure, or of the model"
        yield pen.row_of_several(
            f"{name}: point of attack", load["point"], "m", remark, quantity="size"
        )
    if load.get("moment"):
        in_plane = len(load["moment"]) == 1
        about = "about the origin, counter-clockwise" if in_plane else "about the origin"
        yield pen.row_of_several(f"{name}: moment", load["moment"], "N m", about, quantity="moment")


def _list_supports(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield what holds, moves or damps the sides of bodies."""
    for support in _list_objects(model, "supports"):
        groups = ", ".join(str(group) for group in support.get("groups", ()))
        components = ", ".join(str(letter) for letter in support.get("components", ()))
        yield _say(groups, support.get("kind", NONE), f"along {components}" if components else "")


def _list_contact(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the parts of the contact: area, friction, gap and what became of their nodes."""
    for part in _list_objects(model, "contact"):
        name = part.get("name", NONE)
        if "friction" in part:
            yield _write_friction(name, part["friction"])
        if "size" in part:
            area = "held together" if part.get("held") else ""
            yield pen.row(f"{name}: area", part["size"], "m²", area)
        gaps = part.get("gaps") or [part.get("gap")] * 2
        if gaps[0] is not None:
            yield pen.row_of_range(f"{name}: gap at the start", gaps, "m")
        if "points" in part:
            yield _say(f"{name}: points", part["points"], part.get("nodes", ""))
    for layer in _list_objects(model, "layers"):
        remark = f"passed in {write_number(layer['passage'])} s"
        yield pen.row("width of the layer", layer["width"], "m", remark)
        yield pen.row("speed for which it is made", layer["speed"], "m/s")


def _write_friction(name: str, friction: Any) -> Row:
    """Return the row of a law of friction, such as Coulomb(mu=0.5)."""
    law, opened, rest = str(friction).partition("(")
    if not opened:
        return _say(f"{name}: friction", friction)
    arguments = rest.removesuffix(")")
    if law == "Frictionless":
        return _say(f"{name}: friction", "none")
    return _say(f"{name}: friction", arguments.replace("=", " = ") or law, law)


# Motion
# --------------------------------------------------------------------------------------------------


def _list_motions(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield what each record is and how strong, and the numbers of other excitations."""
    for record in _list_objects(model, "records"):
        name = record.get("file", NONE)
        digits = str(record.get("sha256") or "")[:12]
        if digits:
            yield _say(f"{name}: sha256", f"{digits}…", f"read in {record['units']}")
        if "scale" in record:
            yield _say(f"{name}: scale", write_number(record["scale"]))
        if record.get("direction"):
            yield pen.row_of_several(f"{name}: direction", record["direction"], NONE)
        for key, meaning, unit in MEASURES:
            if record.get(key) is not None:
                yield pen.row(f"{name}: {meaning}", record[key], unit)
    for motion in _list_objects(model, "excitations"):
        kind = motion["kind"]
        if motion.get("direction"):
            yield pen.row_of_several(f"{kind}: direction", motion["direction"], NONE)
        for number in motion["numbers"]:
            yield pen.row(f"{kind}: {number['name']}", number["value"], number["unit"])


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


def _list_spectra(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the spectrum of each record beside the design spectrum."""
    design = model.get("design_spectrum") or {}
    wanted = dict(zip(design.get("periods", ()), design.get("accelerations", ()), strict=True))
    for record in _list_objects(model, "records"):
        spectrum = record.get("spectrum") or {}
        if not spectrum:
            continue
        percent = write_number(100.0 * spectrum["damping"])
        for period, value in zip(spectrum["periods"], spectrum["accelerations"], strict=True):
            name = f"{record['file']}: S_a at {write_number(period)} s, {percent} %"
            yield pen.row(name, value, "m/s²", _set_beside(design, wanted.get(period), value, pen))
    if design and not _list_objects(model, "records"):
        for period, value in wanted.items():
            if value is not None:
                name = f"{design['name']}: S_a at {write_number(period)} s"
                yield pen.row(name, value, "m/s²")


def _set_beside(design: Mapping[str, Any], wanted: float | None, value: float, pen: _Pen) -> str:
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


# Time, mesh and sides
# --------------------------------------------------------------------------------------------------


def _list_damping(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the law, its coefficients, and the damping ratio of each of the first modes."""
    if "damping" in model:
        # the ratios of the modes stand beside the periods below
        sources = [text for text in str(model["damping"]).split("; ") if " at T1 = " not in text]
        yield _say("law", "; ".join(sources))
    periods = model.get("periods") or []
    ratios = model.get("damping_ratios") or []
    for number, period in enumerate(periods, start=1):
        share = ""
        if number <= len(ratios):
            ratio = ratios[number - 1]
            share = f"damping {write_number(100.0 * ratio)} %" if ratio else "no damping"
        yield pen.row(f"natural period T{number}, contact closed", period, "s", share)
    for period in model.get("periods_open") or []:
        yield pen.row("natural period T1, contact open", period, "s")
    if "rigid_motions" in model:
        yield _say("rigid motions that are left", model["rigid_motions"])
    alike: dict[tuple[Any, Any], list[str]] = {}
    for body in _list_objects(model, "bodies"):
        factors = (tuple(body.get("alpha") or (0.0,)), tuple(body.get("beta") or (0.0,)))
        alike.setdefault(factors, []).append(str(body.get("name")))
    for (alpha, beta), names in alike.items():
        if any(alpha) or any(beta):
            yield from _list_rayleigh(", ".join(names), (alpha, beta), periods, pen)


def _list_rayleigh(
    name: str,
    factors: tuple[Sequence[float], Sequence[float]],
    periods: Sequence[float],
    pen: _Pen,
) -> Iterator[Row]:
    """Yield alpha and beta of C = alpha M + beta K, and the ratios that they give at T1 and T2.

    Args:
        name: of the bodies.
        factors: least and largest alpha [1/s], and the like of beta [s].
        periods: natural ones [s].
        pen: writes.
    """
    alpha, beta = factors
    yield pen.row_of_range(f"{name}: alpha of the mass", alpha, "1/s")
    yield pen.row_of_range(f"{name}: beta of the stiffness", beta, "s")
    for number, period in enumerate(periods[:2], start=1):
        # xi = alpha / (2 w) + beta w / 2 with w = 2 pi / T
        w = 2.0 * math.pi / period
        ratios = []
        for mass, stiffness in zip(alpha, beta, strict=True):
            ratios.append(100.0 * (mass / (2.0 * w) + stiffness * w / 2.0))
        yield pen.row_of_range(f"{name}: damping ratio at T{number} by alpha and beta", ratios, "%")


def _list_steps(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield the steps of the run, its method, and what waves the mesh carries."""
    run = model.get("run") or {}
    if run:
        remark = f"{run['steps']} steps until {write_number(run['t_end'])} s"
        yield pen.row("time step", run["dt"], "s", remark)
    method = model.get("method") or {}
    for name, text in method.items():
        kinds = [solver.partition("(")[0] for solver in str(text).split(", then ")]
        is_plain = name == "solver" or str(text).endswith("()")
        yield _say(name, ", then ".join(kinds), "" if is_plain else text)
    for wave in _list_objects(model, "waves"):
        if "c_s" not in wave:
            continue
        name = wave["body"]
        step = f"it passes {write_number(wave['dt_ratio'])} edges in a step"
        yield pen.row(f"{name}: shear wave speed", wave["c_s"], "m/s", step)
        edges = f"edges of {write_number(wave['h'])} m, 8 in a wave length"
        yield pen.row(f"{name}: waves up to", wave["f_max"], "Hz", edges)


def _list_sides(model: Model, pen: _Pen) -> Iterator[Row]:
    """Yield how far the sides of the model are from the structure."""
    sides = model.get("sides") or {}
    if not sides:
        return
    names = ", ".join(sides["structure"])
    rule = f"{names}: the bodies that reach no side of the box"
    yield pen.row("width of the structure", sides["width"], "m", rule, quantity="size")
    if sides["wave_length"] is not None:
        waves = f"in {sides['ground']}, at the mean period of {write_number(sides['period'])} s"
        yield pen.row("length of shear waves", sides["wave_length"], "m", waves, quantity="size")
    for place in sides["distances"]:
        remark = f"{place['widths']:.2f} widths"
        if place["wave_lengths"] is not None:
            remark += f", {place['wave_lengths']:.2f} wave lengths"
        name = f"distance of the side {place['side']}"
        yield pen.row(name, place["distance"], "m", remark, quantity="size")


# Title of a table -> its rows.
TABLES: Mapping[str, Callable[[Model, _Pen], Iterator[Row]]] = {
    "model": _list_model,
    "bodies and materials": _list_bodies,
    "loads": _list_loads,
    "supports": _list_supports,
    "contact": _list_contact,
    "motions": _list_motions,
    "response spectra": _list_spectra,
    "damping and periods": _list_damping,
    "time steps and waves": _list_steps,
    "sides of the model": _list_sides,
}
