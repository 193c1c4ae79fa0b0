"""Make bodies that have no mesh: [beam] and [particle], each with its contact, and the law [layer].

    [beam]       beam.rod_problem, beam.beam_problem, beam.rubbing_problem
    [particle]   layer.particle_problem
    [layer]      layer.contact_layer, which the scheme layer.BoundaryLayer then takes

A body of these stands in the place of [mesh], [material], [system] and [contact]. The layer stands
in the place of [friction], [impact] and [scheme], before a body of either kind.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache, partial
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

History = Callable[[float], float]
OWN = ("beam", "particle")  # tables that are a body and its contact
OF_MESHES = (
    "material",
    "system",
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

    Args:
        make: friction law -> its contact problem.
        told: what ``description`` tells of it: mass, degree of its elements, bodies with their
            slowest waves c_s [m/s] and edges h [m], supports, outline.
        point: name of its contact point.
        gap: of the contact point at the start [m].
        slides: friction has something to act on.
    """

    make: Callable[[FrictionLaw], ContactProblem] = field(repr=False)
    told: Mapping[str, Any] = field(repr=False)
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
    """Make a ``beam.rod_problem``."""
    elements = elements or beams.Elements()
    bodies = [_of_rod(rod, elements)]
    told = _told(1, rod.length, rod.gap, bodies)
    return BeamBody(lambda friction: beams.rod_problem(rod, elements, start), told, "tip", rod.gap)


def beam_problem(
    beam: beams.TimoshenkoBeam,
    elements: beams.Elements | None = None,
    *,
    normal_force: Annotated[History, Unit("N")],
    start: beams.Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> BeamBody:
    """Make a ``beam.beam_problem``; its friction is that of [friction]."""
    elements = elements or beams.Elements()
    make = partial(_with, beams.beam_problem, beam, elements, start=start, load=load)
    told = _told(2, beam.length, 0.0, [_of_beam(beam, elements)])
    return BeamBody(partial(make, normal_force=normal_force), told, "tip", 0.0, slides=True)


def rubbing_problem(
    rod: beams.Rod,
    beam: beams.TimoshenkoBeam,
    elements: beams.Elements | None = None,
    *,
    rod_start: beams.Start | None = None,
    start: beams.Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> BeamBody:
    """Make a ``beam.rubbing_problem``; its friction is that of [friction]."""
    elements = elements or beams.Elements()
    make = partial(_with, beams.rubbing_problem, rod, beam, elements, start=start, load=load)
    told = _told(2, beam.length, rod.gap, [_of_beam(beam, elements), _of_rod(rod, elements)])
    return BeamBody(partial(make, rod_start=rod_start), told, "tip", rod.gap, slides=True)


def particle_problem(
    mass: Annotated[float, Positive, Unit("kg")],
    *,
    speed: Annotated[float, Finite, Unit("m/s")],
    distance: Annotated[float, NotNegative, Unit("m")],
    force: Annotated[History | None, Unit("N")] = None,
) -> ParticleBody:
    """Make a ``layer.particle_problem``.

    With [layer] the distance is that of the edge of the layer.
    """
    told = {
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

    return ParticleBody(make, told, "particle", distance)


def start(
    u: Annotated[float | Expression, Unit("m")] = 0.0,
    v: Annotated[float | Expression, Unit("m/s")] = 0.0,
    theta: Annotated[float | Expression, RATIO] = 0.0,
    omega: Annotated[float | Expression, Unit("1/s")] = 0.0,
) -> beams.Start:
    """Make a ``beam.Start`` of expressions of x [m]."""

    def of(value: float | Expression) -> Callable[[Array], Array]:
        check_axes(value, 1, "the expression")
        if isinstance(value, Expression):
            return lambda x: np.asarray(value(x=x))
        return lambda x: np.full_like(x, value)

    return beams.Start(of(u), of(v), of(theta), of(omega))


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
    """Make a ``layer.contact_layer``; metric: "blended" or "flat"."""
    known = {one.value: one for one in (layers.Metric.BLENDED, layers.Metric.FLAT)}
    if metric not in known:
        raise InputError(f'metric is "{metric}": give {" or ".join(map(repr, known))}')
    given = {"mass": mass, "speed": speed, "width": width, "start": start, "strength": strength}
    return _found(e, metric=known[metric], **given)


@lru_cache
def _found(e: float, **given: Any) -> Any:
    """Return the law; it is looked for once, as a search takes two seconds."""
    return layers.contact_layer(e, **given)


def own_body(tables: Mapping[str, Any]) -> str:
    """Return the table of a case that is a body without a mesh; "" where there is none."""
    return next((one for one in OWN if one in tables), "")


def refuse_mixed(path: Path, tables: Mapping[str, Any]) -> None:
    """Raise InputError for tables that do not go with a body without a mesh, or with a layer."""
    body = own_body(tables)
    given = [one for one in ("mesh", *OWN) if one in tables]
    if len(given) > 1:
        raise InputError(
            f"{path}: [{given[0]}] and [{given[1]}] are two bodies: leave one of them out"
        )
    for key in OF_MESHES if body else ():
        if key in tables:
            remedy = _REMEDIES.get(key, "leave one of the two out").format(body=body)
            raise InputError(
                f"{path}: [{key}] is for a body with a [mesh], and [{body}] is a body and its "
                f"contact: {remedy}"
            )
    for key, reason in _BESIDE_LAYER.items() if "layer" in tables else ():
        if key in tables:
            raise InputError(
                f"{path}: [{key}] does not go with [layer], which {reason}: leave one of the two "
                "out"
            )
    contact = tables.get("contact", ()) if "layer" in tables else ()
    for one in contact if isinstance(contact, list) else [contact]:
        for key in ("held", "springs"):
            if isinstance(one, dict) and one.get(key):
                raise InputError(
                    f"{path}: [[contact]] has {key}, and [layer] is a law of rigid obstacles from "
                    "which a body may part: leave one of the two out"
                )


def refuse_ranks(path: Path, body: str, size: int) -> None:
    """Raise InputError for a body without a mesh on several ranks."""
    if size > 1:
        raise InputError(
            f"{path}: [{body}] is computed by one process, and there are {size}: leave mpirun out"
        )


def _with(make: Callable[..., ContactProblem], *args: Any, **given: Any) -> ContactProblem:
    """Return what a function makes of its arguments, the last of which is the friction."""
    *parts, friction = args
    return make(*parts, friction=friction, **given)


def _of_beam(beam: beams.TimoshenkoBeam, elements: beams.Elements) -> dict[str, Any]:
    """Return what there is to tell of a beam."""
    waves = float(np.sqrt(beam.shear_factor * beam.G / beam.rho))
    return _part("beam", beam, elements) | {"c_s": waves}


def _of_rod(rod: beams.Rod, elements: beams.Elements) -> dict[str, Any]:
    """Return what there is to tell of a rod, whose waves are not shear waves."""
    return _part("rod", rod, elements)


def _part(name: str, one: Any, elements: beams.Elements) -> dict[str, Any]:
    """Return name, cells, mass [kg], material and edge h [m] of a body along a line."""
    numbers = {key: value for key, value in vars(one).items() if isinstance(value, int | float)}
    return {
        "name": name,
        "cells": elements.count,
        "mass": one.rho * one.area * one.length,
        "material": {"type": type(one).__name__} | numbers,
        "h": one.length / elements.count,
    }


def _told(d: int, length: float, gap: float, bodies: list[dict[str, Any]]) -> dict[str, Any]:
    """Return what ``description`` tells of a body along the x axis, clamped at x = 0.

    Rod and beam are the same body, which has its mass once.
    """
    axis, start, end = np.eye(1, d), np.zeros((1, d)), np.eye(1, d) * length
    wall = np.eye(1, d) * (length + gap)
    across = np.eye(d)[-1:] * 0.1 * length * (d > 1)
    lines = {
        "body": [start, end],
        "start": [start - 0.5 * across, start + 0.5 * across],
        "wall": [wall - across, wall + across],
    }
    components = ["x", "y"][: len(axis[0])]
    return {
        "degree": 1,
        "mass": bodies[0]["mass"],
        "bodies": bodies,
        "supports": [{"kind": "clamped", "groups": ["start"], "components": components}],
        "outline": [
            {"group": name, "lines": np.concatenate(both).tolist()} for name, both in lines.items()
        ],
    }
