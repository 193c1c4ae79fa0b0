"""Make bodies that have no mesh: [beam] and [particle], each with its contact, and the law [layer].

    [beam]       beam.rod_problem, beam.beam_problem, beam.rubbing_problem
    [particle]   layer.particle_problem
    [layer]      layer.contact_layer, which the scheme layer.BoundaryLayer then takes

A body of these stands in the place of [mesh], [material], [system] and [contact]. The layer stands
in the place of [friction], [impact] and [scheme], before a body of either kind.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from .... import beam as beams
from .... import layer as layers
from ....core.algebra import Array
from ....core.errors import InputError
from ....core.problem import ContactProblem
from ....core.protocols import FrictionLaw
from ....core.quantities import RATIO, Finite, NotNegative, Positive, Unit
from .expressions import Expression, check_axes
from .toml_file import list_tables

History = Callable[[float], float]
BODY_TABLES = ("beam", "particle")  # each is a body and its contact
TABLES_OF_MESHES = (
    "material",
    "system",
    "reservoir",
    "contact",
    "gravity",
    "mass",
    "strain_compatible",
    "stage",
)
_REMEDIES = {  # where it is another than to leave one of the two out
    "gravity": "give its weight as a force of [{body}]",
    "mass": "leave it out, as the body keeps its consistent mass",
    "stage": "leave it out",
}
_BESIDE_LAYER = {
    "friction": "is a law without friction",
    "impact": "makes the rebound itself",
    "scheme": "has a time scheme of its own, BoundaryLayer",
    "mass": "needs the consistent mass",
    "gravity": "does not know the equilibrium from which [gravity] lets the body begin",
    "strain_compatible": "is for single runs with a time step of its own",
    "stage": "does not know the equilibrium in which a stage begins",
}


@dataclass(frozen=True)
class Body:
    """Hold a body that has no mesh.

    Attributes:
        make: friction law -> its contact problem.
        description: what the module ``description`` tells of it: mass, degree of its elements,
            bodies with their slowest waves c_s [m/s] and edges h [m], supports, outline.
        point: name of its contact point.
        gap: of the contact point at the start [m].
        slides: friction has something to act on.
    """

    make: Callable[[FrictionLaw], ContactProblem] = field(repr=False)
    description: Mapping[str, Any] = field(repr=False)
    point: str
    gap: float
    slides: bool = False


class BeamBody(Body):
    """Hold what [beam] makes."""


class ParticleBody(Body):
    """Hold what [particle] makes."""


class LayerLaw:
    """Stand for what [layer] makes, a ``layer.ContactLayer``, in the list of tables.

    Cases without a layer then need not import it.
    """


def rod_problem(
    rod: beams.Rod, elements: beams.Elements | None = None, *, start: beams.Start | None = None
) -> BeamBody:
    """Make a ``beam.rod_problem``.

    Args:
        rod: the rod and its gap to the wall.
        elements: of the rod.
        start: initial values along the axis; None: at rest.
    """
    elements = elements or beams.Elements()

    def make(friction: FrictionLaw) -> ContactProblem:
        return beams.rod_problem(rod, elements, start)

    description = _describe_body(1, rod.length, rod.gap, [_describe_rod(rod, elements)])
    return BeamBody(make, description, "tip", rod.gap)


def beam_problem(
    beam: beams.TimoshenkoBeam,
    elements: beams.Elements | None = None,
    *,
    normal_force: Annotated[History, Unit("N")],
    start: beams.Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> BeamBody:
    """Make a ``beam.beam_problem``; its friction is that of [friction].

    Args:
        beam: the beam that rubs.
        elements: of the beam.
        normal_force: t [s] -> force [N] that presses the tip on the wall.
        start: initial values across the axis; None: at rest.
        load: t [s] -> uniform force across [N/m]; None: without.
    """
    elements = elements or beams.Elements()

    def make(friction: FrictionLaw) -> ContactProblem:
        return beams.beam_problem(
            beam, elements, normal_force=normal_force, friction=friction, start=start, load=load
        )

    description = _describe_body(2, beam.length, 0.0, [_describe_beam(beam, elements)])
    return BeamBody(make, description, "tip", 0.0, slides=True)


def rubbing_problem(
    rod: beams.Rod,
    beam: beams.TimoshenkoBeam,
    elements: beams.Elements | None = None,
    *,
    rod_start: beams.Start | None = None,
    start: beams.Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> BeamBody:
    """Make a ``beam.rubbing_problem``; its friction is that of [friction].

    Args:
        rod: the body along its axis, with its gap to the wall.
        beam: the same body across its axis.
        elements: of both.
        rod_start: initial values along the axis; None: at rest.
        start: initial values across the axis; None: at rest.
        load: t [s] -> uniform force across [N/m]; None: without.
    """
    elements = elements or beams.Elements()

    def make(friction: FrictionLaw) -> ContactProblem:
        return beams.rubbing_problem(
            rod,
            beam,
            elements,
            friction=friction,
            rod_start=rod_start,
            start=start,
            load=load,
        )

    parts = [_describe_beam(beam, elements), _describe_rod(rod, elements)]
    description = _describe_body(2, beam.length, rod.gap, parts)
    return BeamBody(make, description, "tip", rod.gap, slides=True)


def particle_problem(
    mass: Annotated[float, Positive, Unit("kg")],
    *,
    speed: Annotated[float, Finite, Unit("m/s")],
    distance: Annotated[float, NotNegative, Unit("m")],
    force: Annotated[History | None, Unit("N")] = None,
) -> ParticleBody:
    """Make a ``layer.particle_problem``.

    Args:
        mass: of the particle [kg].
        speed: towards the wall at the start [m/s].
        distance: to the wall at the start [m]; with [layer], to the edge of the layer.
        force: t [s] -> force [N], positive towards the wall; None: without.
    """
    description = {
        "mass": mass,
        "bodies": [{"name": "particle", "mass": mass, "material": "rigid"}],
        "supports": [],
        "outline": [
            {"group": "way", "lines": [[0.0], [distance]]},
            {"group": "wall", "lines": [[distance], [distance]]},
        ],
    }

    def make(friction: FrictionLaw) -> ContactProblem:
        return layers.particle_problem(mass, speed=speed, distance=distance, force=force)

    return ParticleBody(make, description, "particle", distance)


def start(
    u: Annotated[float | Expression, Unit("m")] = 0.0,
    v: Annotated[float | Expression, Unit("m/s")] = 0.0,
    theta: Annotated[float | Expression, RATIO] = 0.0,
    omega: Annotated[float | Expression, Unit("1/s")] = 0.0,
) -> beams.Start:
    """Make a ``beam.Start`` of expressions of x [m].

    Args:
        u: displacement [m].
        v: velocity [m/s].
        theta: rotation of the sections of a beam [-].
        omega: rate of the rotation [1/s].
    """

    def make_profile(value: float | Expression) -> Callable[[Array], Array]:
        check_axes(value, 1, "the expression")
        if isinstance(value, Expression):
            return lambda x: np.asarray(value(x=x))
        return lambda x: np.full_like(x, value)

    return beams.Start(*map(make_profile, (u, v, theta, omega)))


def contact_layer(
    e: Annotated[float, RATIO],
    *,
    mass: Annotated[float, Unit("kg/m²")],
    speed: Annotated[float, Unit("m/s")],
    width: Annotated[float, Unit("m")],
    start: Annotated[float | None, Unit("m")] = None,
    strength: Annotated[float, RATIO] = 1.0,
    metric: str = "blended",
) -> Any:
    """Make a ``layer.contact_layer``; metric: "blended" or "flat".

    Args:
        e: speed after over speed before the impact [-].
        mass: of the body over its contact area [kg/m²].
        speed: V, with which the body enters the layer [m/s].
        width: b, of the layer [m].
        start: a, where the force is complete [m]; None: half the width.
        strength: k b²/(mass V²) [-], how soon the body is turned back.
        metric: the word of a ``layer.Metric``.

    Raises:
        InputError: for another metric, and as ``layer.contact_layer``.
    """
    metrics = {kind.value: kind for kind in (layers.Metric.BLENDED, layers.Metric.FLAT)}
    if metric not in metrics:
        raise InputError(f'metric is "{metric}": give {" or ".join(map(repr, metrics))}')
    return _search_layer(
        e,
        metric=metrics[metric],
        mass=mass,
        speed=speed,
        width=width,
        start=start,
        strength=strength,
    )


@lru_cache
def _search_layer(e: float, **arguments: Any) -> Any:
    """Return the law; it is looked for once, as a search takes two seconds."""
    return layers.contact_layer(e, **arguments)


def find_body_table(tables: Mapping[str, Any]) -> str:
    """Return the table of a case that is a body without a mesh; "" where there is none."""
    return next((name for name in BODY_TABLES if name in tables), "")


def refuse_mixed(path: Path, tables: Mapping[str, Any]) -> None:
    """Raise InputError for tables that do not go with a body without a mesh, or with a layer."""
    bodies = [name for name in ("mesh", *BODY_TABLES) if name in tables]
    if len(bodies) > 1:
        raise InputError(
            f"{path}: [{bodies[0]}] and [{bodies[1]}] are two bodies: leave one of them out"
        )
    body = find_body_table(tables)
    if body:
        _refuse_beside_body(path, tables, body)
    if "layer" in tables:
        _refuse_beside_layer(path, tables)


def _refuse_beside_body(path: Path, tables: Mapping[str, Any], body: str) -> None:
    """Raise InputError for tables of bodies with a mesh, beside a body without one."""
    for key in TABLES_OF_MESHES:
        if key in tables:
            remedy = _REMEDIES.get(key, "leave one of the two out").format(body=body)
            raise InputError(
                f"{path}: [{key}] is for a body with a [mesh], and [{body}] is a body and its "
                f"contact: {remedy}"
            )


def _refuse_beside_layer(path: Path, tables: Mapping[str, Any]) -> None:
    """Raise InputError for tables, and keys of [[contact]], that do not go with [layer]."""
    for key, reason in _BESIDE_LAYER.items():
        if key in tables:
            raise InputError(
                f"{path}: [{key}] does not go with [layer], which {reason}: leave one of the two "
                "out"
            )
    for table in list_tables(tables.get("contact")):
        for key in ("roller", "springs"):
            if table.get(key):
                raise InputError(
                    f"{path}: [[contact]] has {key}, and [layer] is a law of rigid obstacles from "
                    "which a body may part: leave one of the two out"
                )
        if "mu" in table:
            raise InputError(
                f"{path}: [[contact]] has mu, and [layer] is a law without friction: leave one of "
                "the two out"
            )


def refuse_ranks(path: Path, body: str, size: int) -> None:
    """Raise InputError for a body without a mesh on several ranks.

    Args:
        path: of the case file.
        body: the table of the body.
        size: number of ranks.
    """
    if size > 1:
        raise InputError(
            f"{path}: [{body}] is computed by one process, and there are {size}: leave mpirun out"
        )


def _describe_beam(beam: beams.TimoshenkoBeam, elements: beams.Elements) -> dict[str, Any]:
    """Return what ``description`` tells of a beam, with its shear waves c_s = sqrt(kG/rho)."""
    c_s = float(np.sqrt(beam.shear_factor * beam.G / beam.rho))
    return _describe_part("beam", beam, elements) | {"c_s": c_s}


def _describe_rod(rod: beams.Rod, elements: beams.Elements) -> dict[str, Any]:
    """Return what ``description`` tells of a rod, whose waves are not shear waves."""
    return _describe_part("rod", rod, elements)


def _describe_part(name: str, part: Any, elements: beams.Elements) -> dict[str, Any]:
    """Return name, cells, mass [kg], material and edge h [m] of a body along a line."""
    numbers = {key: value for key, value in vars(part).items() if isinstance(value, int | float)}
    return {
        "name": name,
        "cells": elements.count,
        "mass": part.rho * part.area * part.length,
        "material": {"type": type(part).__name__} | numbers,
        "h": part.length / elements.count,
    }


def _describe_body(
    d: int, length: float, gap: float, parts: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return what ``description`` tells of a body along the x axis, clamped at x = 0.

    Rod and beam are the same body, which has its mass once.
    """
    # The outline: the axis of the body, and in the plane a line across at its start and the wall.
    start = np.zeros((1, d))
    end = np.eye(1, d) * length
    wall = np.eye(1, d) * (length + gap)
    across = np.eye(d)[-1:] * 0.1 * length if d > 1 else np.zeros((1, 1))
    lines = {
        "body": [start, end],
        "start": [start - 0.5 * across, start + 0.5 * across],
        "wall": [wall - across, wall + across],
    }
    outline = [
        {"group": name, "lines": np.concatenate(ends).tolist()} for name, ends in lines.items()
    ]
    fixed = {"kind": "fixed", "groups": ["start"], "components": ["x", "y"][:d]}
    return {
        "degree": 1,
        "mass": parts[0]["mass"],
        "bodies": parts,
        "supports": [fixed],
        "outline": outline,
    }
