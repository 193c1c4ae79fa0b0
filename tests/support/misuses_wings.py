"""Misuses of boundary elements, beam and boundary layer, in the form of misuses_core: right
arguments, wrong values.

``MISUSES``: name -> a call that has to raise InputError; ``RIGHT``: (name, call) of what they were
made of.
"""

from __future__ import annotations

from functools import partial
from math import inf, nan
from typing import Any

import numpy as np
from misuses_core import (
    COUNT,
    FLAG,
    FUNCTION,
    NEEDED,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    THING,
    Table,
    but,
    calls,
    rights,
)

import vi_contact as vc
from demos.parts.problems.boundary_elements import (
    disk_contact,
    disk_problem,
    embedded_problem,
    square_problem,
)
from demos.parts.problems.disk import Disk, Push
from demos.parts.problems.embedded import Embedded
from demos.parts.problems.loose_segments import from_segments
from demos.parts.problems.square import Square
from vi_contact import beam, bem
from vi_contact.beam.contact_problems import (
    StepForces,
    beam_problem,
    rod_forces,
    rod_problem,
    rubbing_problem,
)
from vi_contact.beam.published import readings
from vi_contact.layer.bilateral import bilateral_motion
from vi_contact.layer.contact_law import ContactLayer, contact_layer
from vi_contact.layer.layer import Layer
from vi_contact.layer.motion import ConstrainedSystem
from vi_contact.layer.particle import ParticleImpact, damping_ratio, layer_for, restitution
from vi_contact.layer.rigid_body import Ellipsoid, RigidBody
from vi_contact.layer.scheme import BoundaryLayer
from vi_contact.layer.trajectory import layer_motion

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
EIGHT = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]
MATERIAL = vc.LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
RAGGED = {"ragged": [[1.0], [1.0, 2.0]]}
MASK = RAGGED | {
    "text": "bottom",
    "numbers": [0, 1],
    "short": np.ones(3, bool),
    "reals": np.ones(8),
    "class": list,
}
OTHER = but(NEEDED, "list")
BODY = {"mesh": OTHER | {"corners": SQUARE}, "material": OTHER}
STEPS = COUNT | {"none": None}
JUMP = {"text": "up", "nan": np.full((2, 2, 3), nan), "short": np.zeros((2, 2, 2))}


def function(wrong: dict[str, Any]) -> dict[str, Any]:
    """A function's wrong values, and functions that return these."""
    return dict(FUNCTION) | {
        f"that returns {label}": (lambda *a, value=value: value) for label, value in wrong.items()
    }


def meshes() -> Table:
    """Boundaries and their methods."""
    mesh = bem.polygon(SQUARE, 0.5)
    points = RAGGED | {
        "text": "abc",
        "number": 1.0,
        "nan": [(nan, 0.0), (1, 0), (0, 1)],
        "line": [(0, 0), (1, 0), (2, 0)],
        "space": np.eye(3),
        "eight": EIGHT,
        "two": [(0, 0), (1, 1)],
        "none": None,
        "class": list,
    }
    return [
        (
            bem.polygon,
            {"corners": SQUARE, "h": 0.5},
            {
                "corners": points | {"backwards": SQUARE[::-1]},
                "exterior": FLAG | {"other": True},
                "h": but(POSITIVE, "list", "huge")
                | RAGGED
                | {"one": [1], "texts": ["a"] * 4, "endless": 1e-12, "none": None},
            },
        ),
        (
            bem.BoundaryMesh,
            {"points": SQUARE},
            {
                "points": points,
                "loop_sizes": RAGGED | {"text": "4", "half": (2.5, 1.5), "other": (3,)},
                "exterior": FLAG,
                "labels": RAGGED | {"text": "abcd", "short": [1, 2], "half": [0.5, 1, 2, 3]},
            },
        ),
        (
            bem.circle,
            {"radius": 1.0, "count": 8},
            {
                "radius": but(POSITIVE, "list", "complex") | {"endless": 1e200},
                "exterior": FLAG,
                "count": COUNT | {"two": 2, "endless": 10**9},
                "centre": {"text": "ab", "number": 1.0, "nan": (nan, 0.0)} | RAGGED,
            },
        ),
        (
            from_segments,
            {"points": SQUARE, "segments": [(0, 1), (1, 2), (2, 3), (3, 0)]},
            {
                "points": {"text": "ab", "flat": [1.0, 2.0], "nan": [(nan, 0.0)] * 4},
                "labels": {"text": "ab", "one": [1]},
                "segments": RAGGED
                | {
                    "text": "ab",
                    "far": [(0, 9), (9, 0)],
                    "negative": [(0, -1)],
                    "half": [(0, 0.5)],
                },
            },
        ),
        (mesh.nodes_of, {"elements": np.ones(8, bool)}, {"elements": MASK}),
        (mesh.node_normals, {"elements": np.ones(8, bool)}, {"elements": {"numbers": [0, 1]}}),
        (
            mesh.elements_where,
            {"chosen": lambda x: x[:, 0] > 0.5},
            {"chosen": function({"numbers": np.ones(8)})},
        ),
        (
            bem.Orders,
            {},
            {
                name: COUNT | {"endless": 10**6}
                for name in ("far", "near", "outer", "inner", "close")
            },
        ),
    ]


def operators() -> Table:
    """Matrices, blocks, problems."""
    mesh = bem.polygon(SQUARE, 0.5)
    body = {"mesh": mesh, "material": MATERIAL}
    blocks = bem.energetic_blocks(mesh, MATERIAL, dt=0.5, steps=2)
    steklov, still = bem.PoincareSteklov(blocks, 1.0), np.zeros((2, 2, 8))
    problem = bem.BoundaryProblem(steklov, still, contact=mesh.labels == 0)
    histories = RAGGED | {
        "text": "up",
        "nan": np.full((2, 2, 8), nan),
        "flat": np.zeros(16),
        "short": np.zeros((2, 2, 7)),
        "texts": np.full((2, 2, 8), "a"),
        "none": None,
        "complex": 1j * np.ones((2, 2, 8)),
    }
    speed = {"c_p": POSITIVE | {"slow": 0.1}, "c_s": POSITIVE}
    fields = {"fixed": MASK, "contact": MASK, "prescribed": but(histories, "none")}
    return [
        (
            bem.energetic_blocks,
            body | {"dt": 0.5, "steps": 2},
            BODY
            | {
                "dt": POSITIVE | {"small": 1e-6, "great": 50.0},
                "steps": STEPS | {"endless": 10**12},
                "orders": OTHER | {"numbers": (4, 8)},
            },
        ),
        (bem.TimeKernels, {"t": 1.0, "c_p": 1.0, "c_s": 0.5}, speed | {"t": POSITIVE}),
        (
            bem.traction_forces,
            {"mesh": mesh, "traction": lambda x, n, t: n, "dt": 0.1, "steps": 2},
            {
                "mesh": OTHER,
                "dt": POSITIVE,
                "steps": STEPS | {"endless": 10**12},
                "elements": MASK,
                "traction": function(
                    {"a number": 1.0, "nan": np.full((32, 2), nan), "a text": "up"}
                ),
                "order": COUNT,
            },
        ),
        (
            bem.PoincareSteklov,
            {"blocks": blocks, "rho": 1.0},
            {"blocks": OTHER, "rho": POSITIVE, "symmetric": FLAG},
        ),
        (
            bem.BoundaryProblem,
            {"operator": steklov, "forces": still},
            fields | {"operator": OTHER | {"blocks": blocks}, "forces": histories},
        ),
        (
            problem.solve,
            {},
            {
                "contact_forces": {
                    "text": "up",
                    "nan": np.full((2, 6), nan),
                    "short": np.zeros((2, 5)),
                }
            },
        ),
    ]


def contacts() -> Table:
    """Contact of boundary elements."""
    mesh = bem.polygon(SQUARE, 0.5)
    blocks = bem.energetic_blocks(mesh, MATERIAL, dt=0.5, steps=2)
    problem = bem.BoundaryProblem(
        bem.PoincareSteklov(blocks, 1.0), np.zeros((2, 2, 8)), contact=mesh.labels == 0
    )
    compliance = problem.condensed()
    contact = bem.BoundaryContact(compliance)
    own = bem.MultiplierMesh(mesh, mesh.labels == 0, compliance)

    def conditions_on(compliance: Any) -> bem.Conditions:
        return bem.conditions_on(mesh, compliance, mesh.labels == 0)

    return [
        (
            bem.BoundaryContact,
            {"compliance": compliance},
            {
                "compliance": OTHER | {"problem": problem},
                "obstacle": NEEDED,
                "friction": NEEDED,
                "towards": FUNCTION,
                "along": FUNCTION,
                "bilateral": FLAG,
                "conditions": THING,
            },
        ),
        (
            bem.Conditions,
            {"nodes": [0], "normals": [(0.0, -1.0)], "lengths": [1.0]},
            {
                "nodes": RAGGED | {"text": "a", "negative": [-1], "half": [0.5]},
                "normals": {"text": "down", "flat": [0.0, -1.0]},
                "lengths": {"nan": [nan], "two": [1.0, 1.0]},
            },
        ),
        (conditions_on, {"compliance": compliance}, {"compliance": OTHER}),
        (
            bem.march_contact,
            {"contact": contact},
            {"contact": OTHER, "solver": but(THING, "list"), "tolerance": POSITIVE},
        ),
        (
            bem.SpaceTimeUzawa,
            {},
            {
                "tolerance": POSITIVE,
                "rho": but(POSITIVE, "none"),
                "max_iterations": COUNT,
                "window": COUNT,
            },
        ),
        (bem.SpaceTimeUzawa().solve, {"contact": contact}, {"contact": OTHER}),
        (
            bem.TwoBodies,
            {"one": problem, "two": problem},
            {"one": NEEDED, "two": NEEDED, "welded": MASK, "jump": JUMP, "traction": JUMP},
        ),
        (
            bem.MultiplierMesh,
            {"mesh": mesh, "elements": mesh.labels == 0, "compliance": compliance},
            {
                "mesh": OTHER,
                "elements": MASK | {"another side": mesh.labels == 1},
                "compliance": OTHER | {"problem": problem},
                "patch": COUNT | {"long": 3},
                "interval": COUNT | {"no divisor": 3},
                "degree": {"two": 2, "half": 0.5},
                "testing": {"word": "middle"},
                "sigma": but(POSITIVE, "zero"),
            },
        ),
        (
            own.forces,
            {"forces": np.zeros((1, 2))},
            {"forces": {"text": "up", "nan": np.full((1, 2), nan), "short": np.zeros((1, 3))}},
        ),
        (own.averaged, {"motion": lambda t: t}, {"motion": FUNCTION}),
    ]


def examples() -> Table:
    """The four examples in boundary elements and in finite elements."""
    few = {"material": MATERIAL, "dt": 0.5, "steps": 2}
    wrong = {"material": OTHER, "dt": POSITIVE, "steps": STEPS}
    problem = disk_problem(8, MATERIAL, dt=0.5, steps=2, radius=0.5)
    pressure = {"pressure": FUNCTION | {"none": None}}
    return [
        (
            square_problem,
            few | {"elements": 2},
            wrong | pressure | {"elements": COUNT, "side": POSITIVE},
        ),
        (disk_problem, few | {"elements": 8, "radius": 0.5}, wrong | {"radius": POSITIVE}),
        (
            disk_contact,
            {"problem": problem, "push": lambda t: 0.0},
            {"problem": OTHER, "push": FUNCTION},
        ),
        (
            embedded_problem,
            few | {"elements": 2, "pressure": lambda t: 1.0},
            wrong | pressure | {"elements": COUNT | {"odd": 3}},
        ),
        (
            Square,
            {},
            {
                "cells": COUNT,
                "side": POSITIVE,
                "material": OTHER,
                "pressure": NUMBER,
                "confined": FLAG,
                "history": FUNCTION,
            },
        ),
        (Push, {}, {"height": POSITIVE, "rise": POSITIVE}),
        (Disk, {}, {"radius": POSITIVE, "size": POSITIVE, "material": OTHER, "push": FUNCTION}),
        (Embedded, {}, {"box": OTHER | {"odd": Square(cells=5)}, "block": but(OTHER, "none")}),
    ]


def beams() -> Table:
    """Rod and beam."""
    line, rod, few = beam.TimoshenkoBeam(), beam.Rod(), beam.Elements(4)
    stepper = {
        "beam": line,
        "elements": few,
        "dt": 0.01,
        "normal_force": lambda t: 1.0,
        "mu": lambda t, rate: 0.1,
    }
    ready, start = beam.BeamStepper(**stepper), beam.Start()
    runs = {"rod": OTHER, "elements": OTHER | {"count": 4}, "start": THING}
    sizes = dict.fromkeys(("length", "rho", "area", "E"), POSITIVE)
    return [
        (
            beam.TimoshenkoBeam,
            {},
            sizes | {"inertia": POSITIVE, "G": POSITIVE, "viscosity": NOT_NEGATIVE},
        ),
        (
            beam.Rod,
            {},
            sizes | {"gap": NOT_NEGATIVE, "body_force": FUNCTION, "end_force": FUNCTION},
        ),
        (beam.Start, {}, {"u": FUNCTION | {"none": None}, "omega": FUNCTION}),
        (
            beam.Elements,
            {},
            {"count": COUNT | {"one": 1, "endless": 10**12}, "reduced_shear": FLAG},
        ),
        (
            beam.RegularisedFriction,
            {"eps": 1e-3},
            {
                "eps": POSITIVE,
                "tolerance": POSITIVE,
                "absolute": but(POSITIVE, "none"),
                "max_iterations": COUNT,
                "safeguard": FLAG,
            },
        ),
        (
            beam.BeamStepper,
            stepper,
            {
                "beam": OTHER | {"rod": rod},
                "elements": OTHER | {"count": 4},
                "dt": POSITIVE,
                "load": FUNCTION,
                "normal_force": FUNCTION | {"none": None},
                "mu": FUNCTION | {"none": None},
                "friction": NEEDED | {"Coulomb": vc.Coulomb(0.3)},
            },
        ),
        (
            beam.run_beam,
            {"stepper": ready, "start": start, "steps": 2},
            {
                "stepper": OTHER,
                "start": NEEDED,
                "steps": STEPS | {"endless": 10**15},
                "every": but(COUNT, "zero"),
            },
        ),
        (rod_problem, {"rod": rod, "elements": few}, runs),
        (
            beam_problem,
            {
                "beam": line,
                "elements": few,
                "normal_force": lambda t: 1.0,
                "friction": vc.Coulomb(0.3),
            },
            {
                "beam": OTHER,
                "normal_force": FUNCTION,
                "friction": NEEDED,
                "load": FUNCTION,
                "elements": OTHER,
            },
        ),
        (
            rubbing_problem,
            {"rod": rod, "beam": line, "elements": few, "friction": vc.Coulomb(0.3)},
            runs | {"beam": OTHER, "friction": NEEDED, "rod_start": THING, "load": FUNCTION},
        ),
        (
            rod_forces,
            {"rod": rod, "elements": few, "dt": 0.01, "steps": 2},
            runs | {"dt": POSITIVE, "steps": STEPS, "scheme": but(THING, "list")},
        ),
        (
            StepForces,
            {"dt": 0.1, "forces": (1.0, 2.0)},
            {"dt": POSITIVE, "forces": RAGGED | {"text": "ab", "nan": (nan,), "number": 1.0}},
        ),
        (readings, {"dt": 0.1}, {"dt": POSITIVE}),
    ]


def layers() -> Table:
    """The boundary layer."""
    layer, one = Layer(0.1, k=1.0, speed=1.0, start=0.05), np.ones((1, 1))
    system = {"mass": one, "rho": lambda q: float(q[0]), "gradient": lambda q: np.ones(1)}
    ready, body = (
        ConstrainedSystem(**system),
        {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "point": (0.0, 0.0, -0.1)},
    )
    law = contact_layer(1.0, mass=1.0, speed=1.0, width=0.1)
    values = RAGGED | {"text": "ab", "nan": [nan], "number": 1.0, "none": None}
    two = {"two coordinates or velocities": [1.0, 2.0]}
    motion = {"q0": [1.0], "v0": [0.5]}
    size = {"mass": POSITIVE | {"endless": 1e300}, "speed": POSITIVE | {"endless": 1e300}}
    made = {"e": 0.5, "mass": 1.0, "speed": 1.0, "width": 0.1}
    rest = {"e": POSITIVE | {"more": 1.1, "least": 1e-12}, "width": POSITIVE}
    three = RAGGED | {"text": "abc", "number": 1.0, "nan": (nan, 0.0, 1.0), "two": (1.0, 1.0)}
    return [
        (
            Layer,
            {"width": 0.1, "k": 1.0},
            {
                "width": POSITIVE,
                "k": NOT_NEGATIVE | {"nothing": 0.0},
                "c": NOT_NEGATIVE,
                "speed": but(POSITIVE, "none"),
                "start": but(POSITIVE, "none") | {"behind": 0.2},
            },
        ),
        (ParticleImpact, {"layer": layer, "mass": 1.0, "speed": 1.0}, size | {"layer": OTHER}),
        (restitution, {"s": 0.5}, {"s": NOT_NEGATIVE}),
        (damping_ratio, {"e": 0.5}, {"e": POSITIVE | {"more": 1.1}}),
        (layer_for, made, size | rest | {"deepest": POSITIVE | {"more": 1.0}}),
        (
            contact_layer,
            made,
            size | rest | {"start": but(POSITIVE, "none"), "strength": POSITIVE, "metric": THING},
        ),
        (ContactLayer, {"layer": layer}, {"layer": OTHER, "mass": NOT_NEGATIVE}),
        (BoundaryLayer, {"law": law}, {"law": OTHER | {"layer": layer}}),
        (
            ConstrainedSystem,
            system,
            {
                "mass": {
                    "text": "m",
                    "nan": one * nan,
                    "negative": -one,
                    "flat": [1.0],
                    "none": None,
                },
                "rho": FUNCTION,
                "gradient": FUNCTION,
                "force": FUNCTION,
                "rates": FUNCTION,
                "gradient_rate": FUNCTION,
                "scale": POSITIVE,
            },
        ),
        (Ellipsoid, {"axes": (1.0, 1.0, 1.0)}, {"axes": three | {"zero": (1.0, 0.0, 1.0)}}),
        (
            RigidBody,
            body,
            {
                "mass": POSITIVE,
                "inertia": three | {"zero": (0.0, 1.0, 1.0)},
                "point": three,
                "offset": NUMBER,
                "normal": three | {"zero": (0.0, 0.0, 0.0)},
                "gravity": three,
            },
        ),
        (
            layer_motion,
            motion | {"system": ready, "layer": layer, "t_end": 0.1},
            {
                "system": OTHER | {"body": RigidBody(**body)},
                "layer": OTHER,
                "q0": values | two | {"outside": [-1.0]},
                "v0": values | two,
                "t_end": POSITIVE,
                "metric": THING,
                "contacts": but(COUNT, "none"),
                "rtol": POSITIVE,
                "refine": COUNT,
            },
        ),
        (
            bilateral_motion,
            motion | {"systems": [ready], "times": [0.0, 0.1]},
            {
                "systems": {"none": None, "one": ready, "texts": ["a"], "empty": []},
                "q0": values | two,
                "v0": values | two,
                "times": values | {"back": [1.0, 0.0], "infinity": [0.0, inf]},
                "rtol": POSITIVE,
            },
        ),
        (
            partial(layer_motion, layer=layer, t_end=0.1, **motion),
            {"system": ready},
            {
                "system": {
                    f"{name} returns {label}": ConstrainedSystem(
                        **system | {name: lambda *a, value=value: value}
                    )
                    for name in ("rho", "gradient", "force", "rates", "gradient_rate")
                    for label, value in (
                        ("a text", "a"),
                        ("nan", nan),
                        ("a table", np.eye(2)),
                        ("none", None),
                    )
                }
            },
        ),
    ]


TABLES = [meshes(), operators(), contacts(), examples(), beams(), layers()]
MISUSES = {
    f"{name}, wing {i}": call for i, table in enumerate(TABLES) for name, call in calls(table)
}
RIGHT = [one for table in TABLES for one in rights(table)]
