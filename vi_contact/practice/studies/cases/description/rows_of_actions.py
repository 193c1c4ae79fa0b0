"""Write the rows of what acts on a model, holds its bodies, and lies between them."""

from collections.abc import Iterator, Mapping
from typing import Any

from ....units.report_units import write_number
from .pen import NONE, Model, Pen, Row, clip, list_objects, say
from .water_and_joints import list_joint


def list_loads(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the resultant of each load, its point of attack, and its moment about the origin."""
    for load in list_objects(model, "loads"):
        name = load.get("name", NONE)
        if "value" in load:  # on a body without a mesh
            yield (clip(name), write_number(load["value"]), load["unit"], clip(load["varies"]))
        elif load.get("force"):
            yield from _list_resultant(name, load, pen)
        else:
            yield say(name, "no resultant", "its stresses balance themselves")
    if model.get("constant_loads"):
        yield from _list_resultant("all constant loads", model["constant_loads"], pen)


def _list_resultant(name: str, load: Mapping[str, Any], pen: Pen) -> Iterator[Row]:
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


def list_supports(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield what holds, moves or damps the sides of bodies."""
    for support in list_objects(model, "supports"):
        groups = ", ".join(str(group) for group in support.get("groups", ()))
        components = ", ".join(str(letter) for letter in support.get("components", ()))
        yield say(groups, support.get("kind", NONE), f"along {components}" if components else "")


def list_contact(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the parts of the contact: area, friction, gap and what became of their nodes."""
    for part in list_objects(model, "contact"):
        name = part.get("name", NONE)
        if part.get("joint"):
            yield from list_joint(part, pen)
        elif "friction" in part:
            yield _write_friction(name, part["friction"])
        if "size" in part:
            area = "held together" if part.get("held") else ""
            yield pen.row(f"{name}: area", part["size"], "m²", area)
        gaps = part.get("gaps") or [part.get("gap")] * 2
        if gaps[0] is not None:
            yield pen.row_of_range(f"{name}: gap at the start", gaps, "m")
        if "points" in part:
            yield say(f"{name}: points", part["points"], part.get("nodes", ""))
    for layer in list_objects(model, "layers"):
        remark = f"passed in {write_number(layer['passage'])} s"
        yield pen.row("width of the layer", layer["width"], "m", remark)
        yield pen.row("speed for which it is made", layer["speed"], "m/s")


def _write_friction(name: str, friction: Any) -> Row:
    """Return the row of a law of friction, such as Coulomb(mu=0.5)."""
    law, opened, rest = str(friction).partition("(")
    if not opened:
        return say(f"{name}: friction", friction)
    arguments = rest.removesuffix(")")
    if law == "Frictionless":
        return say(f"{name}: friction", "none")
    return say(f"{name}: friction", arguments.replace("=", " = ") or law, law)
