"""Misuses of the Python interface: every argument of every constructor and entry point, given what
it is not.

``MISUSES``: name -> a call that has to raise InputError. A new class is covered by one line of
``VALUES`` or ``CALLS``: its arguments as they should be, then for each argument the kind of values
that are wrong there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from chain import chain_problem, chain_surface, chain_system
from dolfinx.mesh import meshtags
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.boundary_curve import boundary_curve
from vi_contact import core, engineering, fem, ground_motion, soil, solvers
from vi_contact.meshes.block import BlockMesh
from vi_contact.solvers.volume.route import Volume

Wrong = Mapping[str, Any]
HUGE = 10**5000  # more digits than Python prints

# Kinds of wrong values
# ----------------------------------------------------------------------------------------------

NUMBER: Wrong = {
    "text": "0.3",
    "none": None,
    "nan": nan,
    "infinity": inf,
    "complex": 1j,
    "truth": True,
    "class": float,
    "list": [0.3],
    "huge": HUGE,
}
NOT_NEGATIVE = NUMBER | {"negative": -0.1}
POSITIVE = NOT_NEGATIVE | {"zero": 0.0}
SHARE = POSITIVE | {"more than one": 1.5}
WEIGHT = NOT_NEGATIVE | {"more than one": 1.5}
COUNT: Wrong = {
    "text": "3",
    "nan": nan,
    "half": 2.5,
    "negative": -1,
    "zero": 0,
    "infinity": inf,
    "truth": True,
}
FLAG: Wrong = {"text": "yes", "none": None, "number": 1}
THING: Wrong = {
    "text": "base",
    "number": 0.3,
    "class": dict,
    "list": [object()],
    "object": object(),
}
NEEDED = THING | {"none": None}
FUNCTION: Wrong = {"text": "sin", "number": 0.3, "class": float}
VECTOR: Wrong = {
    "text": "xy",
    "texts": ("x", "y"),
    "number": 1.0,
    "complex": (1j, 0.0),
    "nan": (nan, 0.0),
    "none": None,
}
FIELD: Wrong = {
    "text": "up",
    "number": 1.0,
    "texts": ("a", "b"),
    "complex": (1j, 0.0),
    "class": float,
}
LABELS: Wrong = {
    "none": None,
    "list": [(0.0, 0.0)],
    "empty name": {"": (0.0, 0.0)},
    "text": {"a b": (0.0, 0.0)},
}
STEP = POSITIVE | {"tuple": (0.1, 0.2)}


def but(kind: Wrong, *allowed: str) -> Wrong:
    """A kind without the values that are right here."""
    return {name: value for name, value in kind.items() if name not in allowed}


# What the calls share
# -----------------------------------------------------------------------------------------------

COLUMNS = {"t": ("s", "time"), "u": ("m", "displacement")}
HISTORY = {"t": np.arange(64) * 0.01, "u": np.ones(64), "a_x_top": np.sin(np.arange(64.0))}
STEEL = vc.LinearElastic(E=2.1e11, nu=0.3, rho=7850.0)


@cache
def body() -> SimpleNamespace:
    """A block of 4 x 4 elements, standing on its bottom, touching with its right side, with its
    mesh and groups; its twin; and other systems of one mesh."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(4, 4)), MPI.COMM_SELF)
    twin, theirs = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(4, 4)), MPI.COMM_SELF)
    system = fem.assemble(mesh, STEEL, clamped=tags["bottom"])
    surface = fem.contact_surface(system, tags["right"])
    problem = vc.ContactProblem(system, surface)
    state = next(vc.march(problem, dt=1e-4, steps=1))[0]
    values = meshtags(mesh, 1, np.arange(4, dtype=np.int32), np.arange(4, dtype=np.int32))
    return SimpleNamespace(
        mesh=mesh,
        tags=tags,
        twin=twin,
        theirs=theirs,
        system=system,
        surface=surface,
        problem=problem,
        state=state,
        facets=tags["right"],
        cells=fem.Cells("all", np.arange(16), mesh),
        values=values,
        held_left=fem.assemble(mesh, STEEL, clamped=tags["left"]),
    )


def groups(*, cells: bool = False) -> Wrong:
    """What is no boundary group (or cell group) of the body's mesh."""
    b = body()
    mine, other = (b.cells, b.facets) if cells else (b.facets, b.cells)
    far = replace(mine, indices=np.array([0]), mesh=b.twin)
    return {
        "another mesh": far,
        "other group": other,
        "meshtags": b.values,
        "tags": b.tags,
        "numbers": mine.indices,
        "text": "right",
        "class": fem.Facets,
    }


# Tables
# --------------------------------------------------------------------------------------------------

Table = list[tuple[Callable[..., Any], dict[str, Any], dict[str, Wrong]]]
METHOD = but(NEEDED, "list")
RULE = {"tolerance": POSITIVE, "max_iterations": COUNT}


def values() -> Table:
    """(constructor, right arguments, argument -> wrong values), of values that need no mesh."""
    wave = {"amplitude": 1.0, "direction": (1.0, 0.0)}
    shake = {
        "amplitude": NUMBER,
        "direction": VECTOR | {"zero": (0.0, 0.0), "four": (1.0, 0.0, 0.0, 0.0)},
    }
    normal = but(VECTOR, "number") | {"zero": (0.0, 0.0), "longer": (1.0, 0.0, 0.0)}
    coefficient = but(NOT_NEGATIVE, "list") | {"table": np.eye(2), "texts": ["a"]}
    alphas = {"alpha_m": 0.0, "alpha_f": 0.0, "beta": 0.25, "gamma": 0.5}
    return [
        (
            vc.LinearElastic,
            {"E": 1.0, "nu": 0.2, "rho": 1.0},
            {"E": POSITIVE, "nu": NUMBER | {"half": 0.5, "minus one": -1.0}, "rho": NOT_NEGATIVE},
        ),
        (
            vc.LinearElastic.from_wave_speeds,
            {"c_p": 2.0, "c_s": 1.0, "rho": 1.0},
            {"c_p": POSITIVE | {"slow": 1.0}, "c_s": POSITIVE, "rho": POSITIVE},
        ),
        (vc.PlaneStress, {}, {"thickness": POSITIVE}),
        (vc.PlaneStrain, {}, {"thickness": POSITIVE}),
        (vc.MassProportional, {"c": 1.0}, {"c": NOT_NEGATIVE}),
        (vc.Rayleigh, {"alpha": 0.1, "beta": 0.1}, {"alpha": NOT_NEGATIVE, "beta": NOT_NEGATIVE}),
        (
            vc.Rayleigh.from_frequencies,
            {"f1": 1.0, "f2": 2.0, "xi1": 0.05, "xi2": 0.05},
            {"f1": POSITIVE, "f2": POSITIVE, "xi1": NOT_NEGATIVE, "xi2": NOT_NEGATIVE},
        ),
        (vc.Harmonic, wave | {"frequency": 1.0}, shake | {"frequency": POSITIVE, "phase": NUMBER}),
        (
            vc.Ricker,
            wave | {"frequency": 1.0},
            shake | {"frequency": POSITIVE, "delay": but(NOT_NEGATIVE, "none")},
        ),
        (vc.HalfSine, wave | {"duration": 1.0}, shake | {"duration": POSITIVE}),
        (vc.FullSine, wave | {"duration": 1.0}, {"amplitude": NUMBER, "duration": POSITIVE}),
        (vc.Rectangular, wave | {"duration": 1.0}, {"amplitude": NUMBER, "duration": POSITIVE}),
        (
            vc.Tabulated,
            {"times": (0.0, 1.0), "values": (0.0, 1.0)},
            {
                "times": VECTOR | {"back": (1.0, 0.0), "one": (0.0,)},
                "values": VECTOR | {"three": (0.0, 1.0, 2.0)},
            },
        ),
        (
            vc.GroundMotion,
            {"record": ground_motion.Record(np.ones(9), 0.01)},
            {"record": NEEDED, "scale": NUMBER},
        ),
        (vc.Tresca, {"threshold": 1.0}, {"threshold": coefficient}),
        (vc.Coulomb, {"mu": 0.3}, {"mu": coefficient}),
        (vc.SlipRateCoulomb, {"mu": np.ones_like}, {"mu": FUNCTION | {"none": None}}),
        (
            vc.ExponentialDecay,
            {"mu_s": 0.5, "mu_k": 0.3, "v_c": 1.0},
            {"mu_s": coefficient, "mu_k": coefficient, "v_c": POSITIVE},
        ),
        (
            vc.StaticKinetic,
            {"mu_s": 0.5, "mu_k": 0.3},
            {"mu_s": coefficient, "mu_k": coefficient | {"more": 0.6}},
        ),
        (vc.Newton, {"e": 0.5}, {"e": WEIGHT, "update": METHOD}),
        (vc.Inelastic, {}, {"update": METHOD}),
        (vc.Redistributed, {}, {"lumping": WEIGHT}),
        (
            vc.HalfSpace,
            {"point": (0.0, 0.0), "normal": (1.0, 0.0)},
            {"point": but(VECTOR, "number") | {"longer": (0.0,) * 3}, "normal": normal},
        ),
        (vc.AnalyticGap, {"function": np.sin}, {"function": FUNCTION | {"none": None}}),
        (vc.Trapezoidal, {}, {"mass": METHOD | {"law": vc.Inelastic()}}),
        (vc.ZienkiewiczWoodTaylor, {}, {"phi": NUMBER | {"less": 0.4, "more": 1.1}}),
        (vc.SS22, {}, {"theta1": NUMBER | {"less": 0.4}, "theta2": NUMBER | {"less": 0.4}}),
        (vc.HHT, {}, {"alpha": NUMBER | {"less": -0.5, "more": 0.1}}),
        (vc.Newmark, {}, {"beta": NUMBER | {"less": 0.1}, "gamma": NUMBER | {"less": 0.4}}),
        (vc.GeneralisedAlpha, alphas, dict.fromkeys(alphas, NUMBER)),
        (vc.GeneralisedAlpha.spectral_radius, {}, {"rho_inf": WEIGHT}),
        (
            vc.MoreauJean,
            {},
            {"theta": NUMBER | {"less": 0.4}, "e": WEIGHT, "allow_energy_gain": FLAG},
        ),
        (vc.ContactStabilisedNewmark, {}, {"projected": FLAG}),
        (
            vc.LinearMultistep,
            {"a": (0.5, 0.0, -0.5), "b": (0.25, 0.5, 0.25), "gamma": (1.0, -2.0, 1.0)},
            {"a": VECTOR, "b": VECTOR, "gamma": VECTOR, "mu": NUMBER | {"zero": 0.0}},
        ),
        (vc.LinearMultistep.newmark, {}, {"beta": POSITIVE, "gamma": NUMBER}),
        (
            vc.Condensed,
            {},
            {
                "method": METHOD | {"with friction": solvers.NSGS(), "solver": vc.Condensed()},
                "friction_method": METHOD | {"without": solvers.ActiveSet()},
                "rates": METHOD,
            },
        ),
        (solvers.ActiveSet, {}, RULE),
        (solvers.Lemke, {}, RULE),
        (
            solvers.Hildreth,
            {},
            {"tolerance": POSITIVE, "max_sweeps": COUNT, "primal": FLAG, "record": FLAG},
        ),
        (solvers.FrictionNewton, {}, RULE),
        (solvers.NSGS, {}, RULE),
        (solvers.FixedPoint, {}, RULE | {"tresca": METHOD, "extrapolation": METHOD}),
        (solvers.GivenForces, {}, RULE | {"tangential": METHOD, "extrapolation": METHOD}),
        (solvers.RateIteration, {}, RULE | {"extrapolation": METHOD}),
        (solvers.Anderson, {}, {"depth": COUNT, "after": but(COUNT, "zero")}),
        (
            Volume,
            {},
            {
                "method": METHOD | {"of the other route": solvers.ActiveSet()},
                "tolerance": SHARE,
                "petsc_options": {"text": "snes_monitor", "list": ["snes_monitor"]},
                "prefix": {"none": None},
            },
        ),
        (
            vc.Schedule,
            {"pieces": ((0.1, 1.0),)},
            {
                "pieces": {
                    "number": 0.1,
                    "text": "0.1",
                    "none": None,
                    "nan": ((nan, 1.0),),
                    "texts": (("0.1", 1.0),),
                    "back": ((0.1, 1.0), (0.1, 0.5)),
                    "empty": (),
                }
            },
        ),
        (
            vc.HalvedAtImpact,
            {"dt": 0.1},
            {"dt": STEP, "halvings": but(COUNT, "zero") | {"many": 99}},
        ),
        (
            vc.Probe,
            {"points": {"a": (0.0, 0.0)}},
            {
                "points": LABELS
                | {
                    "nan": {"a": (nan, 0.0)},
                    "texts": {"a": ("x", "y")},
                    "mixed": {"a": (0.0,), "b": (0.0, 0.0)},
                },
                "velocity": FLAG,
                "acceleration": FLAG,
                "nearest": FLAG,
            },
        ),
        (
            vc.BodyMotion,
            {"name": "ball"},
            {
                "name": {"none": None, "spaces": "a b", "number": 0.5},
                "bodies": {"number": 0.5, "texts": ("a",), "below": (-1,), "part": (0.5,)},
                "about": but(VECTOR, "none"),
            },
        ),
        (
            vc.Resultants,
            {"name": "base", "centre": (0.0, 0.0)},
            {
                "name": {"none": None, "spaces": "a b", "number": 0.5},
                "centre": but(VECTOR, "none"),
                "where": FUNCTION,
                "normal": but(VECTOR, "none"),
                "part": but(VECTOR, "none"),
            },
        ),
        (
            vc.Racking,
            {"frames": {"a": [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]}},
            {
                "frames": LABELS
                | {"line": {"a": [(0.0, 0.0)] * 4}, "three": {"a": [(0.0, 0.0)] * 3}}
            },
        ),
        (
            vc.CrossChecked,
            {"primary": vc.Condensed(), "others": [vc.Condensed()]},
            {"primary": NEEDED, "others": {"one": vc.Condensed(), "texts": ["nsgs"], "none": None}},
        ),
        (
            soil.SoilColumn,
            {"heights": np.arange(3.0)}
            | dict.fromkeys(("lame", "shear", "rho", "alpha", "beta"), np.ones(2)),
            {
                "heights": VECTOR | {"down": np.array([1.0, 0.0]), "one": np.zeros(1)},
                "rho": VECTOR,
                "lame": VECTOR,
            },
        ),
        (
            core.Load,
            {"constant": np.zeros(3)},
            {
                "constant": VECTOR,
                "separable": {"one": (np.zeros(3), np.sin), "function": np.sin, "none": None},
                "general": {"function": np.sin, "texts": ("a",)},
                "viscous": {"number": (1.0,)},
            },
        ),
        (
            engineering.peaks,
            {"history": HISTORY, "columns": COLUMNS},
            {
                "history": NEEDED,
                "columns": NEEDED,
                "names": {"text": "u", "unknown column": ["w"], "number for a column": [1]},
            },
        ),
        (
            engineering.hysteresis,
            {"history": HISTORY, "deformation": "u", "force": "u"},
            {
                "history": NEEDED,
                "deformation": {"none": None, "unknown column": "w"},
                "force": {"no name of a column": 1},
                "sign": NUMBER,
            },
        ),
        (
            engineering.floor_spectrum,
            {"history": HISTORY, "column": "a_x_top", "periods": np.ones(1)},
            {
                "history": NEEDED,
                "column": {"none": None, "displacement": "u", "unknown": "a_x_b"},
                "relative": FLAG,
            },
        ),
        (
            engineering.transfer_function,
            {"history": HISTORY, "surface": "a_x_top", "base": "a_x_top"},
            {
                "history": NEEDED,
                "surface": {"none": None, "displacement column": "u"},
                "frequencies": but(VECTOR, "number", "none"),
                "bandwidth": but(POSITIVE, "none"),
                "floor": POSITIVE,
            },
        ),
        (fem.NodeToNode, {}, {"tolerance": POSITIVE}),
        (
            soil.upgoing,
            {"motion": vc.Ricker(1.0, 1.0), "dt": 0.1},
            {"motion": NEEDED, "dt": POSITIVE, "outcrop": FLAG},
        ),
        (soil.base_motion, {"excitation": vc.Ricker(1.0, 1.0)}, {"excitation": NEEDED}),
    ]


def of_the_mesh() -> Table:
    """The same of what needs a mesh."""
    b = body()
    numbers = {
        "text": "all",
        "floats": np.array([0.0, 1.0]),
        "mask": np.ones(4, bool),
        "table": np.zeros((2, 2), int),
        "far": np.array([0, 10**6]),
        "negative": np.array([-1]),
    }
    many = {"history": FUNCTION}
    pair = (b.cells, STEEL)
    left, right = b.tags["left"], b.tags["right"]
    far, moved = b.theirs["right"], fem.Prescribed(b.tags["bottom"], (1.0, 0.0))
    wall = {"of the other mesh": far}
    return [
        (
            fem.Facets,
            {"name": "a", "indices": np.arange(2), "mesh": b.mesh},
            {"name": {"none": None}, "indices": numbers, "mesh": NEEDED},
        ),
        (
            fem.Cells,
            {"name": "a", "indices": np.arange(2), "mesh": b.mesh},
            {"name": {"none": None}, "indices": numbers, "mesh": NEEDED},
        ),
        (
            fem.Prescribed,
            {"facets": right},
            {
                "facets": but(groups(), "another mesh"),
                "displacement": FIELD,
                "velocity": FIELD,
                "acceleration": FIELD,
                "components": {"number": 0, "text": "x", "texts": ("x",), "half": (0.5,)},
            },
        ),
        (
            fem.Traction,
            {"facets": right, "value": (1.0, 0.0)},
            {"facets": but(groups(), "another mesh"), "value": FIELD} | many,
        ),
        (
            fem.TangentialTraction,
            {"facets": right, "value": (1.0, 0.0)},
            {"facets": but(groups(), "another mesh")},
        ),
        (fem.BodyForce, {"value": (1.0, 0.0)}, {"value": FIELD} | many),
        (
            fem.Tied,
            {"first": left, "second": right},
            {
                "first": but(groups(), "another mesh"),
                "second": but(groups(), "another mesh"),
                "components": {"number": 0},
            },
        ),
        (
            fem.Dashpots,
            {"facets": right},
            {
                "facets": but(groups(), "another mesh"),
                "material": THING,
                "normal": NOT_NEGATIVE,
                "tangential": NOT_NEGATIVE,
            },
        ),
        (
            fem.CompliantBase,
            {"facets": right, "motion": np.sin},
            {"motion": FUNCTION | {"none": None}},
        ),
        (soil.FreeField, {"facets": right, "base": vc.Ricker(1.0, 1.0)}, {"base": NEEDED}),
        (fem.XDMF, {}, {"every": COUNT | {"none": None}}),
        (
            vc.Reactions,
            {"name": "base", "facets": right, "centre": (0.0, 0.0)},
            {
                "name": {"spaces": "a b", "none": None},
                "facets": but(groups(), "another mesh"),
                "centre": VECTOR,
                "loads": THING,
                "gravity": but(VECTOR, "none"),
            },
        ),
        (
            vc.SectionForces,
            {"cuts": {"a": ((0.0, 0.0), (1.0, 0.0))}},
            {
                "cuts": LABELS | {"one end": {"a": ((0.0, 0.0),)}},
                "cells": but(groups(cells=True), "another mesh", "class"),
                "loads": THING,
                "gravity": but(VECTOR, "none"),
            },
        ),
        (
            fem.assemble,
            {"mesh": b.mesh, "material": STEEL},
            {
                "mesh": NEEDED | {"file": "wall.msh", "tags": b.tags},
                "material": NEEDED
                | {
                    "pair": pair,
                    "another mesh": [(fem.Cells("a", np.arange(16), b.twin), STEEL)],
                    "facets": [(b.facets, STEEL)],
                    "half a pair": [(b.cells,)],
                },
                "section": THING,
                "damping": THING,
                "clamped": groups(),
                "prescribed": THING | {"facets": right, "another mesh": fem.Prescribed(far)},
                "tied": THING | {"another mesh": fem.Tied(b.theirs["left"], far)},
                "dashpots": THING | {"another mesh": fem.Dashpots(far)},
                "loads": THING
                | {"another mesh": fem.Traction(far, (1.0, 0.0)), "prescribed": moved},
                "base_inertia": FLAG,
                "initial_displacement": FIELD
                | {"far": [(fem.Cells("a", [0], b.twin), (1.0, 0.0))]},
                "initial_velocity": FIELD | {"facets": [(b.facets, (1.0, 0.0))]},
            },
        ),
        (
            partial(fem.assemble, b.mesh, STEEL),
            {"clamped": b.tags["bottom"], "prescribed": ()},
            {
                "prescribed": {
                    "contradicts": moved,
                    "all of them": [fem.Prescribed(right), fem.Prescribed(right, np.ones_like)],
                }
            },
        ),
        (
            fem.contact_surface,
            {"system": b.system, "facets": right},
            {
                "system": NEEDED | {"problem": b.problem, "by hand": chain_system(2)},
                "facets": groups(),
                "obstacle": THING
                | {
                    "of numbers": (0.0, 1.0),
                    "complex AnalyticGap": vc.AnalyticGap(lambda x: 1j * x[:, 0]),
                    "shape of AnalyticGap": vc.AnalyticGap(lambda x: x),
                    "inside": Obstacle((-1.0, 0.0)),
                    "no length": Obstacle((0.0, 0.0)),
                    "three": Obstacle((1.0, 0.0, 0.0)),
                    "texts": Obstacle(("a", "b")),
                    "table": Obstacle((1.0, 0.0), (2,)),
                },
                "points": {
                    "number": 1.0,
                    "text": "xy",
                    "texts": [("x", "y")],
                    "flat": (1.0, 0.5),
                    "nan": [(nan, 0.0)],
                },
            },
        ),
        (
            fem.contact_pair,
            {"system": b.system, "facets1": left, "facets2": right},
            {
                "system": NEEDED,
                "facets1": groups(),
                "facets2": groups(),
                "matching": THING,
                "points": {"flat": (1.0, 0.5)},
            },
        ),
        (
            fem.build_mesh,
            {"mesh": BlockMesh(lengths=(1.0,), divisions=(2,)), "comm": MPI.COMM_SELF},
            {"mesh": NEEDED, "comm": NEEDED},
        ),
        (
            fem.read_mesh,
            {"path": "wall.msh", "comm": MPI.COMM_SELF},
            {"path": {"none": None, "number": 3}, "comm": NEEDED},
        ),
        (
            vc.with_weight,
            {"system": b.system},
            {
                "system": NEEDED,
                "acceleration": NUMBER,
                "direction": but(VECTOR, "none") | {"long": (2.0, 0.0)},
                "bodies": {"number": 1, "text": "soil", "unknown": (7,)},
            },
        ),
        (
            fem.bodies_of,
            {"system": b.system, "cells": fem.Cells("all", np.arange(16), b.mesh)},
            {"system": NEEDED, "cells": groups(cells=True)},
        ),
        (
            engineering.lowest_frequency,
            {"system": b.system},
            {"system": NEEDED, "max_iterations": COUNT},
        ),
        (
            fem.release,
            {"static": b.problem, "state": b.state, "problem": b.problem},
            {"static": NEEDED, "problem": NEEDED, "state": states()},
        ),
        (
            started,
            {"recorder": vc.Energy()},
            {
                "recorder": {
                    "reactions": vc.Reactions("a", far, (0.0, 0.0)),
                    "section": vc.SectionForces(
                        {"a": ((0.0, 0.5), (1.0, 0.5))}, cells=fem.Cells("a", [0], b.twin)
                    ),
                    "loads": vc.Reactions(
                        "a", b.tags["bottom"], (0.0, 0.0), loads=fem.Traction(far, (1.0, 0.0))
                    ),
                }
                | wall
            },
        ),
    ]


class Obstacle:
    """One direction everywhere, and gaps of a shape."""

    def __init__(self, direction: Any, shape: tuple[int, ...] = ()) -> None:
        self.direction, self.shape = direction, shape

    def directions(self, points: Any, normals: Any) -> Any:
        return np.tile(self.direction, (len(points), 1))

    def gap(self, points: Any, normals: Any) -> Any:
        return np.zeros((len(points), *self.shape))


def started(recorder: Any) -> object:
    """A run of no step that records."""
    return vc.simulate(body().problem, dt=1e-4, steps=0, record=[recorder], progress=False)


def states() -> Wrong:
    """What is no state of the body's problem."""
    state = body().state
    bad = {
        "u": np.zeros(3),
        "v": state.v[:-1],
        "r_n": np.zeros(1),
        "active": state.r_n,
        "r_t": np.zeros((1, 1)),
    }
    wrong = {name: replace(state, **{name: value}) for name, value in bad.items()}
    wrong |= {
        "nan": replace(state, u=state.u * nan),
        "complex": replace(state, v=state.v * 1j),
        "text": "rest",
        "time": replace(state, t=nan),
        "number": replace(state, k=-1),
        "list": replace(state, u=list(state.u)),
        "class": vc.State,
        "vector": state.u,
    }
    return wrong


def own_matrices() -> Table:
    """Systems of own matrices, and their contact points."""
    right = {"M": np.eye(2), "C": None, "K": np.eye(2), "coordinates": [[0.0, 0.0]]}
    system, K = vc.system_from_arrays(**right), body().system.K.mat
    points = body().system.space.points
    points = points[points[:, 1] > 0.0]
    matrix = NEEDED | {
        "cube": np.ones((2, 2, 2)),
        "oblong": np.ones((2, 3)),
        "complex": 1j * np.eye(2),
        "texts": [["a", "b"], ["c", "d"]],
        "nan": np.full((2, 2), nan),
        "petsc": K,
    }
    numbers = {
        "text": "all",
        "half": [0.5],
        "nan": [nan],
        "far": [9],
        "negative": [-1],
        "table": [[0]],
        "class": dict,
    }
    vector = but(VECTOR, "none") | {"long": np.ones(3)}
    given = {
        "unknowns": THING | {"flat": [0, 1], "half": [[0, 0], [0, 0.5]]},
        "load": vector,
        "u0": vector,
        "v0": vector,
        "coordinates": NEEDED | {"flat": np.ones(2), "four": np.ones((1, 4)), "nan": [[nan, 0.0]]},
    }
    return [
        (
            vc.system_from_arrays,
            right,
            given | {"M": matrix, "C": but(matrix, "none"), "K": matrix, "clamped": numbers},
        ),
        (
            fem.system_from_matrices,
            {"M": K, "C": None, "K": K, "coordinates": points},
            given
            | {
                "M": but(matrix, "petsc"),
                "C": but(matrix, "none", "petsc"),
                "K": but(matrix, "petsc"),
                "clamped": but(numbers, "far") | {"far": [10**6]},
            },
        ),
        (
            vc.contact_points,
            {"system": system, "nodes": [0], "normals": [1.0, 0.0]},
            {
                "system": NEEDED | {"of elements": body().system},
                "nodes": numbers | {"none": None, "empty": []},
                "normals": VECTOR | {"zero": (0.0, 0.0), "longer": (1.0, 0.0, 0.0)},
                "weights": {"text": "a", "nan": nan, "list": [1.0, 2.0]},
                "opposite": numbers | {"itself": [0]},
                "gap0": {"text": "a", "nan": nan, "list": [1.0, 2.0]},
                "obstacle": THING,
            },
        ),
    ]


def runs() -> Table:
    """Problems, and what marches them."""
    b = body()
    chain, state = chain_problem(3), b.state
    inside = replace(state, u=state.u + 1.0, k=0)
    other = fem.contact_surface(b.held_left, b.tags["right"])
    far = replace(chain_surface(3), owned=np.array([7]))
    excitation = {
        "record": ground_motion.Record(np.ones(9), 0.01),
        "text": "elcentro",
        "number": 3.0,
        "class": vc.Harmonic,
        "in space": vc.Harmonic(1.0, 1.0, direction=(1.0, 0.0, 0.0)),
        "list": [None],
    }
    march = {
        "problem": NEEDED | {"system": b.system},
        "scheme": THING | {"class itself": vc.HHT, "solver": vc.Condensed()},
        "solver": THING
        | {
            "class itself": vc.Condensed,
            "scheme": vc.HHT(),
            "method": solvers.ActiveSet(),
            "name": "condensed",
        },
        "dt": STEP,
        "steps": {"text": "3", "half": 2.5, "negative": -1, "nan": nan, "both": None},
        "state": states() | {"inside": inside, "of another": chain_state()},
        "escalation": {
            "one": vc.Condensed(),
            "texts": ["condensed"],
            "none": None,
            "text": "condensed",
        },
        "tolerance": POSITIVE | {"two": 2.0},
    }
    recorded = {
        "one": vc.Energy(),
        "class": [vc.Energy],
        "texts": ["energy"],
        "text": "energy",
        "other": [vc.HHT()],
    }
    given = {"problem": b.problem, "dt": 1e-4, "steps": 2}
    return [
        (
            vc.ContactProblem,
            {"system": b.system, "surface": b.surface},
            {
                "system": NEEDED | {"of another clamp": b.held_left, "of a chain": chain_system(3)},
                "surface": NEEDED
                | {"of another clamp": other, "of a chain": chain_surface(3), "facets": b.facets},
                "friction": NEEDED | {"class itself": vc.Coulomb, "values": (0.3, 0.3)},
                "impact": THING | {"class itself": vc.Inelastic, "name": "inelastic"},
                "mass": THING | {"class itself": vc.Redistributed, "impact law": vc.Inelastic()},
                "excitation": excitation,
            },
        ),
        (
            vc.ContactProblem,
            {"system": chain.system, "surface": chain.surface},
            {
                "surface": {
                    "unknowns of others": far,
                    "slots": replace(far, owned=np.array([0]), slots=np.array([5])),
                    "weights": replace(chain.surface, weights=np.ones(3)),
                    "weights below zero": replace(chain.surface, weights=-chain.surface.weights),
                    "compliance": replace(chain.surface, compliance=chain.surface.compliance - 1.0),
                    "points": replace(chain.surface, points=np.zeros((1, 2))),
                    "gaps": replace(chain.surface, gap0=np.array([nan])),
                },
                "system": {
                    "velocities": replace(chain.system, v0=np.zeros(2)),
                    "influence": replace(chain.system, influence=np.ones((2, 1))),
                    "matrix": replace(chain.system, K=chain_system(4).K),
                    "nan": replace(chain.system, u0=np.full(3, nan)),
                },
            },
        ),
        (
            partial(replace, chain.system),
            {"u0": np.zeros(3)},
            {
                "u0": {
                    "none": None,
                    "text": "rest",
                    "list": [0.0] * 3,
                    "complex": np.zeros(3) * 1j,
                    "table": np.zeros((3, 1)),
                },
                "v0": {"none": None, "number": 0.0},
                "influence": {"flat": np.ones(3), "none": None},
                "M": NEEDED | {"matrix": np.eye(3)},
                "K": NEEDED,
                "C": but(NEEDED, "none"),
                "load": NEEDED | {"array": np.zeros(3)},
                "space": NEEDED,
                "algebra": NEEDED,
            },
        ),
        (vc.march, given, march),
        (
            vc.simulate,
            given | {"progress": False},
            march
            | {
                "record": recorded,
                "out": {"number": 3, "list": ["a"], "class": Path},
                "restart": {"none": None, "number": 3},
                "checkpoint_every": COUNT | {"none": None},
                "progress": FLAG,
                "cross_check": THING,
                "fields": {"without a folder": fem.XDMF()},
                "t_end": {"both": 1.0},
                "callback": FUNCTION,
            },
        ),
        (
            vc.cross_check,
            given | {"solvers": (vc.Condensed(), vc.Condensed(solvers.Hildreth()))},
            {
                "problem": NEEDED,
                "solvers": {
                    "one": vc.Condensed(),
                    "alone": [vc.Condensed()],
                    "texts for a solver": ["a", "b"],
                    "none": None,
                },
                "scheme": THING,
                "dt": STEP,
                "steps": {"text": "3", "half": 2.5},
                "state": states(),
            },
        ),
        (
            vc.static_equilibrium,
            {"problem": b.problem},
            {"problem": NEEDED, "solver": but(THING, "none"), "t": NUMBER, "tolerance": POSITIVE},
        ),
        (
            vc.quasi_static,
            {"problem": b.problem, "times": [0.0, 1.0]},
            {
                "problem": NEEDED,
                "times": {
                    "number": 1.0,
                    "text": "01",
                    "back": [1.0, 0.5],
                    "texts": ["a"],
                    "none": None,
                },
                "solver": but(THING, "none"),
                "state": states(),
                "tolerance": POSITIVE,
            },
        ),
        (b.surface.moving, {}, {"towards": FUNCTION, "along": FUNCTION}),
        (b.surface.on_springs, {"stiffness": 1.0}, {"stiffness": POSITIVE}),
    ]


@cache
def chain_state() -> vc.State:
    """A state of another problem."""
    return next(vc.march(chain_problem(3), dt=1e-3, steps=1))[0]


def calls(table: Table) -> Iterator[tuple[str, Callable[[], object]]]:
    """(name, call with one wrong argument) of a table."""
    for rank, (make, right, fields) in enumerate(table):
        owner = getattr(make, "__qualname__", None) or type(make).__name__
        for field, wrong in fields.items():
            for label, value in wrong.items():
                yield (
                    f"{owner} {field}, {label} ({rank})",
                    partial(make, **(right | {field: value})),
                )


def rights(table: Table) -> Iterator[tuple[str, Callable[[], object]]]:
    """(name, call with the right arguments) of a table; the block has no two sides that could
    touch, and no file."""
    for rank, (make, right, _) in enumerate(table):
        if make not in (fem.contact_pair, fem.read_mesh):
            yield f"{rank} {getattr(make, '__qualname__', make)}", partial(make, **right)


EXTRA: dict[str, Callable[[], object]] = {
    "boundary_curve: another mesh": lambda: boundary_curve(body().facets, body().theirs["left"]),
    "boundary_curve: cells": lambda: boundary_curve(body().cells),
    "boundary_curve: text": lambda: boundary_curve("right"),  # type: ignore[arg-type]
    "joined_surfaces: systems": lambda: fem.joined_surfaces(body().surface, chain_surface(3)),
    "joined_surfaces: texts": lambda: fem.joined_surfaces("a"),  # type: ignore[arg-type]
}
TABLES = [values(), of_the_mesh(), own_matrices(), runs()]
MISUSES = dict(one for table in TABLES for one in calls(table)) | EXTRA
RIGHT = [one for table in TABLES for one in rights(table)]
"""What the misuses were made of: these calls are right."""
