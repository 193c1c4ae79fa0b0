"""Find what does not go together in a model, and what an engineer should look at."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from .....core.units import STANDARD_GRAVITY
from .pen import list_objects

STEPS = 20.0  # in a period
PASSAGE = 10.0  # steps in the time b/V of a layer (CHOSEN; the demos take 20)
# Edges of side 2 over those of side 1: more points than a softer side can follow (CHOSEN).
COARSER = 1.2
ROUNDED = 1e-9  # of a time step
# What is doubted of the numbers of a model (all CHOSEN): structures and ground swing faster, are
# stiffer and are shaken harder than this, unless a unit was mistaken.
SLOWEST = 20.0  # s, of a first natural period
SOFTEST = 1e3  # Pa, of Young's modulus
WEAKEST = 0.01  # of gravity, the peak of a quake
ALONG = 1e-3  # off one: the length of a direction
DRIFTED = 0.3  # of the peak ground displacement: what is left of it at the end of a record


def find_defects(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield why records do not fit to each other or to the time step, a sentence each."""
    dt = model["run"]["dt"]
    for first, second in pairwise(model["records"]):
        files = f"'{first['file']}' and '{second['file']}'"
        if abs(first["dt"] - second["dt"]) > ROUNDED * first["dt"]:
            yield (
                f"{files} have samples every {first['dt']:g} and "
                f"{second['dt']:g} s: bring them to one step with record = "
                f'{{path = "FILE", resample_dt = {first["dt"]:g}}}'
            )
        if abs(first["duration"] - second["duration"]) > ROUNDED * first["duration"]:
            yield (
                f"{files} last {first['duration']:g} and "
                f"{second['duration']:g} s: trim or pad one of them in its table of processing"
            )
    for record in model["records"]:
        if dt > record["dt"] * (1.0 + ROUNDED):
            yield (
                f"the time step of {dt:g} s leaves out samples of '{record['file']}', which has "
                f"one every {record['dt']:g} s: shorten [run] dt, or give the record resample_dt "
                f"= {dt:g}"
            )


def find_warnings(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an engineer should look at, a sentence each."""
    yield from _find_odd_bodies(model)
    yield from _find_odd_motions(model)
    yield from _find_braked_bodies(model)
    yield from _find_coarse_meshes(model)
    yield from _find_long_steps(model)
    yield from _find_unlike_levels(model)


def _find_odd_bodies(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of stiffness, thickness and periods that look like a mistaken unit."""
    for body in model["bodies"]:
        material = body["material"]
        for name in ("E", "E1", "E2", "E3") if "shear_modulus" in body else ():
            if name in material and material[name] < SOFTEST:
                yield (
                    f"'{body['name']}' has {name} = {material[name]:g} Pa, less than any soil: "
                    'give it in Pa, or with its unit, as "30 GPa"'
                )

    section = model.get("section", {})
    if section.get("type") == "PlaneStrain" and section["thickness"] != 1.0:
        yield (
            f"the slice in plane strain is {section['thickness']:g} m thick: masses, loads and "
            "forces are those of this slice, so leave the thickness out to have them for a metre"
        )

    periods = model.get("periods")
    if periods is not None and not periods:
        yield (
            "no natural period was found: either everything is held, or stiffness and mass are in "
            "units that do not go together"
        )
    if periods and periods[0] > SLOWEST:
        yield (
            f"the first natural period is {periods[0]:.4g} s, longer than that of any building: "
            "look at the units of lengths, stiffness and density, as coordinates in mm make it "
            "a thousand times as long"
        )


def _find_odd_motions(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of motions that are weak, longer than one in their direction, or adrift."""
    for record in model["records"]:
        yield from _judge_direction(f"'{record['file']}'", record["direction"])
        if record["pga"] < WEAKEST * STANDARD_GRAVITY:
            yield (
                f"'{record['file']}' has a peak of {record['pga']:.3g} m/s², "
                f"{record['pga'] / STANDARD_GRAVITY:.2g} g, which is weak for a quake: look at its "
                "units and its scale"
            )
        left = abs(record["last_displacement"])
        if model["waves_come_in"] and left > DRIFTED * record["pgd"] > 0.0:
            yield (
                f"'{record['file']}' ends {left:.3g} m from where it began, of a largest "
                f"displacement of {record['pgd']:.3g} m, and a compliant base follows it: correct "
                "its baseline in the table of processing, unless the ground stayed there"
            )
    for motion in model["excitations"]:
        yield from _judge_direction(motion["kind"], motion["direction"])


def _judge_direction(name: str, direction: Sequence[float]) -> Iterator[str]:
    """Tell of a direction that is no unit vector."""
    length = float(np.linalg.norm(direction)) if direction else 1.0
    if abs(length - 1.0) > ALONG:
        yield (
            f"the direction of {name} has the length {length:.4g}, so that it shakes with "
            f"{length:.4g} times its accelerations: give a direction of length one, and a scale"
        )


def _find_braked_bodies(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of damping by mass where displacements are those of space."""
    damped = [body["name"] for body in model["bodies"] if max(body.get("alpha", [0.0])) > 0.0]
    if damped and model["waves_come_in"]:
        names = ", ".join(f"'{name}'" for name in damped)
        yield (
            f"the damping of {names} has a share of the mass, alpha, and waves come in through the "
            "base: it brakes the motion of the whole model in space, and with it slides, so give a "
            "law with alpha = 0"
        )


def _find_coarse_meshes(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of elements that are too long."""
    # Elements too long for the shear waves of the record with the highest frequencies.
    for record in sorted(model["records"], key=lambda record: float(record["f_95"]))[-1:]:
        for wave in model["waves"]:
            if record["f_95"] > wave["f_max"]:
                yield (
                    f"'{wave['body']}' carries shear waves up to {wave['f_max']:.3g} Hz and "
                    f"'{record['file']}' has 95 % of its energy below {record['f_95']:.3g} Hz: "
                    "give smaller elements, or filter the record"
                )

    # A softer side of a contact with longer edges cannot follow the points of the other side.
    for contact in model["contact"]:
        if not contact["sides"]:
            continue
        first, second = contact["sides"]
        if second["h"] > COARSER * first["h"] and second["G"] < first["G"]:
            yield (
                f"'{first['name']}', side 1 of its contact, has edges of {first['h']:.3g} m, and "
                f"'{second['name']}', the softer side, has edges of {second['h']:.3g} m: points "
                f"open there and pressures zigzag, so mesh '{second['name']}' as finely, or "
                "exchange facets1 and facets2"
            )


def _find_long_steps(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of time steps that are too long; static stages take none."""
    if model["run"]["steps"] == 0:
        return

    # Time steps too long for the passage of a layer.
    for layer in model["layers"]:
        if model["run"]["dt"] > layer["passage"] / PASSAGE:
            yield (
                f"the time step of {model['run']['dt']:.3g} s is longer than a tenth of the time "
                f"in which a body passes the layer, b/V = {layer['passage']:.3g} s: shorten [run] "
                "dt, or widen the layer"
            )

    # Time steps too long for the first period, of the model with the contact closed or open.
    dt = model["run"]["dt"]
    closed = next(iter(model.get("periods", ())), np.inf)
    lifted = next(iter(model.get("periods_open", ())), np.inf)
    if dt > closed / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period, "
            f"{closed:.3g} s: the computed periods become too long, so shorten [run] dt"
        )
    elif dt > lifted / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period "
            f"with the contact open, {lifted:.3g} s: what moves after it has lifted off is "
            "computed too slowly, so shorten [run] dt"
        )


def _find_unlike_levels(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of water in a joint that stands at another height than that before the dam."""
    reservoir = {entry["name"]: entry["value"] for entry in list_objects(model, "reservoir")}
    if not reservoir:
        return
    for part in list_objects(model, "contact"):
        joint = {entry["name"]: entry["value"] for entry in list_objects(part, "joint")}
        if "water: level" not in joint:
            continue
        for name, water in (("level", "the water"), ("tail", "the tail water")):
            outside, inside = reservoir.get(name), joint.get(f"water: {name}")
            if outside != inside:
                yield (
                    f"{water} stands at {_write_height(outside)} in [reservoir] and at "
                    f"{_write_height(inside)} in the joint '{part['name']}': give one {name}, "
                    "unless they differ there"
                )


def _write_height(height: float | None) -> str:
    """Return a height with its unit, "no height" without one."""
    return "no height" if height is None else f"{height:.6g} m"
