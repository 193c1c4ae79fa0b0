"""Sum up what acts on a model: weights and loads, each with its resultant and point of attack."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .....core.algebra import Array, total
from .....core.problem import ContactProblem
from .....core.units import STANDARD_GRAVITY
from .....fem.body.initial_strains import InitialStrain
from .....fem.output.load_resultants import NOTHING, find_point, sum_up_load
from .....fem.output.sizes import measure_cells
from ..bodies import find_body_table
from ..expressions import Expression, Places
from ..table_calls import Call, Group, build, walk_nodes
from .bodies import name_body
from .surroundings import find_bottom

FORCES = ("N", "N/m")  # units of what acts on a body without a mesh
PLACES = 11  # of a part of a resultant, relative to the whole
TIMES = 2001  # of a run at which the factor of a load is looked at, for its largest value


def describe_gravity(case: Any, dimension: int) -> dict[str, Any]:
    """Return how gravity acts: acceleration [m/s²], direction, group of cells; {} without it."""
    if "gravity" not in case.nodes:
        return {}
    arguments = build(_without_groups(case.nodes["gravity"]), {})
    downwards = [*[0.0] * (dimension - 1), -1.0]
    group = case.nodes["gravity"].arguments.get("cells")
    return {
        "acceleration": arguments.get("acceleration", STANDARD_GRAVITY),
        "direction": list(arguments.get("direction") or downwards),
        "cells": group.name if isinstance(group, Group) else "",
    }


def describe_loads(
    case: Any, problem: ContactProblem, tags: Mapping[str, Any], *, t_end: float
) -> list[dict[str, Any]]:
    """Return weights and loads of a body with a mesh; collective.

    Each has name, kind, groups, force (d,) [N], moment about the origin [N m], centroid of where it
    acts, point: where its line of action cuts its facets, if they are flat, else where it passes
    nearest to the centroid; and varies: how it changes with time, "" for a constant one. What
    changes with time by a factor is told for the factor one, anything else at t = 0.

    Args:
        case: a ``Case``.
        problem: its problem.
        tags: groups of the mesh.
        t_end: when the run ends [s].
    """
    size = problem.system.space.size  # type: ignore[attr-defined]  # of a body with a mesh [m]
    loads = list(_describe_weights(case, problem, tags))
    node = case.nodes["system"].arguments.get("loads", ())
    for given in node if isinstance(node, tuple) else (node,):
        load = build(given, {"tags": tags})
        loads.append(_describe_load(given, load, problem, t_end))
    if "reservoir" in case.nodes:
        loads += _describe_reservoir(case.nodes["reservoir"], tags, problem, t_end)
    return [_round(load, size) for load in loads]


def _round(load: dict[str, Any], size: float) -> dict[str, Any]:
    """Return a load without the rounding of its sums, which depends on the number of ranks.

    Args:
        load: with force [N], moment [N m] and places [m].
        size: diagonal of the bodies [m].
    """
    force = float(np.max(np.abs(load["force"]), initial=0.0))
    moment = float(np.max(np.abs(load["moment"]), initial=0.0))
    # a couple has no force, and its moment no part of the force's
    sizes = {
        "force": max(force, moment / size),
        "moment": max(moment, force * size),
        "centroid": size,
        "point": size,
    }
    rounded = dict(load)
    for key, whole in sizes.items():
        if load.get(key) and whole:
            rounded[key] = (np.round(np.array(load[key]) / whole, PLACES) * whole + 0.0).tolist()
    return rounded


def describe_body_loads(case: Any, *, t_end: float) -> list[dict[str, Any]]:
    """Return what acts on a body without a mesh: name, kind, value at the start, and its unit.

    Args:
        case: a ``Case`` with [beam] or [particle].
        t_end: when the run ends [s].
    """
    calls = walk_nodes(case.nodes[find_body_table(case.nodes)])
    loads = []
    for call in calls:
        if isinstance(call, Call):
            loads += list(_describe_forces(call, t_end))
    return loads


def _describe_forces(call: Call, t_end: float) -> Iterator[dict[str, Any]]:
    """Yield the arguments of a call that are forces, as functions of the time."""
    for name, node in call.arguments.items():
        unit = call.callee.quantities[name].unit
        if isinstance(node, Expression) and unit is not None and unit.symbol in FORCES:
            yield {
                "name": name,
                "kind": "force",
                "value": float(node(0.0)),
                "unit": unit.symbol,
                "varies": _describe_history(node, t_end) if "t" in node.used else "",
            }


def _without_groups(call: Call) -> dict[str, Any]:
    """Return the arguments of a call that are no groups of the mesh."""
    return {name: node for name, node in call.arguments.items() if not isinstance(node, Group)}


def _describe_weights(
    case: Any, problem: ContactProblem, tags: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the weight of each body, those of held nodes in it; collective."""
    space: Any = problem.system.space
    gravity = describe_gravity(case, space.dimension)
    if not gravity:
        return
    sizes, centroids = measure_cells(space.mesh)
    density = space.forms.cellwise("rho")
    heavy = np.ones(len(sizes), dtype=bool)
    if gravity["cells"]:
        heavy[:] = np.isin(np.arange(len(sizes)), tags[gravity["cells"]].indices)
    pull = gravity["acceleration"] * np.array(gravity["direction"])
    for cells, _ in space.forms.materials:
        own = cells[cells < len(sizes)]
        own = own[heavy[own]]
        masses = sizes[own] * density[own]
        mass = total(space.comm, masses.sum())
        if not mass:
            continue
        centre = space.comm.sum(masses @ centroids[own]) / mass
        name = name_body(space, tags, cells)
        force = mass * pull
        yield {
            "name": f"weight of {name}",
            "kind": "weight",
            "groups": [name],
            "force": force.tolist(),
            "moment": _turn(centre, force),
            "centroid": centre.tolist(),
            "point": centre.tolist(),
            "varies": "",
        }


def _turn(point: Array, force: Array) -> list[float]:
    """Return the moment about the origin of a force at a point: one number in the plane."""
    if len(force) == 1:
        return []
    if len(force) == 2:
        return [float(point[0] * force[1] - point[1] * force[0])]
    return [float(part) for part in np.cross(point, force)]


def _describe_load(given: Any, load: Any, problem: ContactProblem, t_end: float) -> dict[str, Any]:
    """Return a load with its resultant; collective.

    Args:
        given: its node of the case.
        load: what the node makes.
        problem: on which it acts.
        t_end: when the run ends [s].
    """
    kind = type(load).__name__
    groups = [inner.name for inner in walk_nodes(given) if isinstance(inner, Group)]
    names = ", ".join(f"'{name}'" for name in groups)
    description: dict[str, Any] = {
        "name": f"{kind} on {names}" if names else kind,
        "kind": kind,
        "groups": groups,
    }
    if isinstance(load, InitialStrain):  # the stress of a strain balances itself
        return description | {"force": [], "moment": [], "varies": ""}
    resultant = sum_up_load(problem.system, load, 0.0)
    return description | {
        "force": resultant.force.tolist(),
        "moment": resultant.moment.tolist(),
        "centroid": None if resultant.centroid is None else resultant.centroid.tolist(),
        "point": None if resultant.point is None else resultant.point.tolist(),
        "varies": _describe_change(given, load, t_end),
    }


def _describe_reservoir(
    node: Call, tags: Mapping[str, Any], problem: ContactProblem, t_end: float
) -> list[dict[str, Any]]:
    """Return the pressures of a reservoir at rest with their resultants; collective.

    Args:
        node: of [reservoir].
        tags: groups of the mesh.
        problem: on which they act.
        t_end: when the run ends [s].
    """
    reservoir = build(node, {"tags": tags})
    loads = []
    for name, load in zip(reservoir.name_loads(), reservoir.make_loads(), strict=True):
        described = _describe_load((), load, problem, t_end)
        loads.append(described | {"name": name, "groups": [load.facets.name]})
    return loads


def _describe_change(given: Any, load: Any, t_end: float) -> str:
    """Return how a load changes with time, "" where it does not."""
    if load.history is not None:
        return f"times its history, {_describe_history(load.history, t_end)}"
    used: set[str] = set()
    for node in walk_nodes(given):
        expressions = node.expressions if isinstance(node, Places) else ()
        for expression in expressions if isinstance(expressions, tuple) else (expressions,):
            used |= expression.used
    if "t" in used:
        return "at t = 0 s; it changes with time"
    return ""


def _describe_history(history: Any, t_end: float) -> str:
    """Return what a history is at the start, and its largest size until t_end [s], in words."""
    if isinstance(history, Expression) and "t" not in history.used:
        return "" if history(0.0) == 1.0 else f"the same at all times, {history(0.0):.4g}"
    times = np.linspace(0.0, t_end, TIMES)
    values = np.array([float(history(t)) for t in times])
    row = int(np.argmax(np.abs(values)))
    return f"{values[0]:.4g} at the start, at most {values[row]:.4g} at t = {times[row]:.4g} s"


def sum_up(model: Mapping[str, Any]) -> dict[str, Any]:
    """Return the resultant of all constant loads together; {} for less than two.

    Its point is where the line of action cuts the lowest level of the structure, or of the model
    where nothing stands in a ground: its distance from the middle of a base is the eccentricity.

    Args:
        model: with the keys dimension, box, gravity, loads and sides of model.json.

    Returns:
        force [N], moment about the origin [N m], point [m] and level [m]; the last two are None for
        a couple, and on a line.
    """
    loads = [load for load in model["loads"] if load.get("force") and not load["varies"]]
    if len(loads) < 2:
        return {}
    d = model["dimension"]
    force = np.sum([load["force"] for load in loads], axis=0)
    moment = np.sum([load["moment"] for load in loads], axis=0)
    sizes = sum(float(np.linalg.norm(load["force"])) for load in loads)
    told: dict[str, Any] = {"force": force.tolist(), "moment": np.atleast_1d(moment).tolist()}
    told |= {"point": None, "level": None}
    if d == 1 or np.linalg.norm(force) <= NOTHING * sizes:
        return told

    # The point of this level below the middle of the model is one of the plane.
    box = model["box"]
    axis, end = find_bottom(model)
    level = model["sides"].get("foot", box[end][axis])
    near = 0.5 * (np.array(box["min"]) + np.array(box["max"]))
    near[axis] = level
    found = find_point(force, moment, near=near, normal=np.eye(d)[axis])
    return told | {"point": None if found is None else found.tolist(), "level": float(level)}
