"""Write the rows of the model as a whole, and of its bodies and their materials."""

from collections.abc import Iterator, Mapping
from typing import Any

from .....core.step import AXES
from .....core.units import STANDARD_GRAVITY
from ....units.report_units import choose_unit, write_number
from .pen import NONE, Model, Pen, Row, list_objects, say

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
    "yield_stress": ("yield stress", "Pa", "stress"),
    "isotropic": ("isotropic hardening", "Pa", "modulus"),
    "kinematic": ("kinematic hardening", "Pa", "modulus"),
    "cohesion": ("cohesion c", "Pa", "stress"),
    "phi": ("angle of friction phi", "deg", ""),
    "psi": ("angle of dilatancy psi", "deg", ""),
    "elements": ("elements of Iwan", NONE, ""),
    "length": ("length", "m", "size"),
    "area": ("area of the section", "m²", ""),
    "inertia": ("second moment of area", "m⁴", ""),
    "shear_factor": ("shear factor", NONE, ""),
    "viscosity": ("viscosity", "s", ""),
    "gap": ("gap", "m", "length"),
}
SECTIONS = {"PlaneStrain": "plane strain", "PlaneStress": "plane stress", "Solid": "solid"}


def list_model(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield section, box, mass, gravity, and what is there at the start."""
    section = model.get("section") or {}
    if section:
        yield say("section", SECTIONS.get(section["type"], section["type"]))
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
        if model.get("integration") == "bbar":
            degree += ", one mean dilatation a cell (bbar)"
        yield say("unknowns", model["unknowns"], degree)
    yield from _list_groups(model)


def _list_box(box: Mapping[str, Any], pen: Pen) -> Iterator[Row]:
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
    for group in list_objects(model, "groups"):
        names_of.setdefault(str(group.get("kind")), []).append(str(group.get("name")))
    for kind, names in names_of.items():
        yield say(f"groups of {kind}", len(names), ", ".join(names))


def _write_gravity(gravity: Mapping[str, Any], pen: Pen) -> Row:
    """Return the row of gravity."""
    if not gravity:
        return say("gravity", "none", "nothing has weight")
    along = ", ".join(write_number(part) for part in gravity["direction"])
    bodies = f"of the group {gravity['cells']}" if gravity["cells"] else "of all bodies"
    return pen.row("gravity", gravity["acceleration"], "m/s²", f"along ({along}), {bodies}")


def list_bodies(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the material of each body, its mass and its centre of mass."""
    for body in list_objects(model, "bodies"):
        name = body.get("name", NONE)
        material = body.get("material")
        if isinstance(material, Mapping):
            yield from _list_material(name, body, material, pen)
        elif material is not None:
            yield say(f"{name}: material", material)
        if "mass" in body:
            yield pen.row(f"{name}: mass", body["mass"], "kg", _describe_extent(body, model, pen))
        if "centre" in body:
            yield pen.row_of_several(
                f"{name}: centre of mass", body["centre"], "m", quantity="size"
            )


def _describe_extent(body: Mapping[str, Any], model: Model, pen: Pen) -> str:
    """Return how large a body is, and of how many cells."""
    if "cells" not in body:
        return ""
    cells = f"{body['cells']} cells"
    if "size" not in body:
        return cells
    unit = {1: "m", 2: "m²", 3: "m³"}[model["dimension"]]
    return f"{write_number(body['size'])} {unit}, {cells}"


def _list_material(
    name: str, body: Mapping[str, Any], material: Mapping[str, Any], pen: Pen
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
        factor, force = choose_unit("N", pen.units, size=STANDARD_GRAVITY * max(density))
        low, high = (write_number(STANDARD_GRAVITY * factor * value) for value in density)
        weight = low if low == high else f"{low} to {high}"
        yield (f"{name}: unit weight", weight, f"{force}/m³", "")
    if "xi" in material:
        yield pen.row(f"{name}: damping ratio xi", 100.0 * material["xi"], "%")
