"""Describe what holds the bodies of a model, and where they may touch."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from .....core.algebra import Array, largest
from .....core.problem import ContactProblem
from .....core.state_checks import initial_state
from .....core.step import AXES
from .....core.surfaces import ContactSurface
from .....fem.body.absent import NAME as ABSENT
from .....fem.body.placing import adds_or_removes
from .....fem.mesh.tagged_mesh import Facets
from .....fem.output.outline import facets_with_cells
from ..bodies import Body
from ..friction_of_tables import count_points, find_mu
from ..table_calls import Group, build, walk_nodes
from .water_and_joints import describe_values

_CAPITAL = re.compile(r"(?<=[a-z])(?=[A-Z])")  # between the words of a name such as CompliantBase


def describe_supports(space: Any) -> Iterator[dict[str, Any]]:
    """Yield what holds the bodies, moves them, absorbs or lets in waves.

    Ties of sides to each other are among it.
    """
    for support in space.prescribed:
        if support.name == ABSENT:  # bodies that are not there are no support
            continue
        kind = "fixed" if support.components is None else "roller, fixed"
        if support.moves:
            kind = "moved"
        yield _describe_support(space, kind, [support.name], support.components)
    for boundary in space.forms.boundaries:
        kind = _CAPITAL.sub(" ", type(boundary).__name__).lower()
        yield _describe_support(space, kind, [boundary.facets.name], None)
    for tie in space.ties:
        yield _describe_support(space, "tied", [tie.first.name, tie.second.name], tie.components)


def _describe_support(
    space: Any, kind: str, groups: list[str], components: Sequence[int] | None
) -> dict[str, Any]:
    """Return a support, with the names of its components; None stands for all."""
    axes = range(space.dimension) if components is None else components
    return {"kind": kind, "groups": groups, "components": [AXES[axis] for axis in axes]}


def describe_contact(
    case: Any, problem: ContactProblem, tags: Mapping[str, Any], joints: Sequence[int]
) -> Iterator[dict[str, Any]]:
    """Yield the parts of the contact, one for each table; collective.

    Each goes by its name, or by those of its groups.

    Args:
        case: the case.
        problem: its problem.
        tags: groups of the mesh.
        joints: how many parts of the surface each table has.
    """
    surface = problem.surface
    tables = case.nodes.get("contact", ())
    nodes = tables if isinstance(tables, tuple) else (tables,)

    # The points of the whole surface, on all ranks, are those of one table after the other.
    whole = _stand(problem).whole()
    ends = np.cumsum([0, *count_points(surface, joints)])
    firsts = np.cumsum([0, *joints])
    laws = case.list_friction()
    for number, (node, (a, b)) in enumerate(zip(nodes, pairwise(ends), strict=True)):
        groups = [inner.name for inner in walk_nodes(node) if isinstance(inner, Group)]
        known = joints[number] == 1 and len(surface.censuses) == firsts[-1]
        census = surface.censuses[firsts[number]] if known else None
        joint = node.arguments.get("joint")
        law = laws[number] if joint is None else build(joint, {})
        yield {
            "name": node.arguments.get("name") or " on ".join(groups) or "all joints",
            "points": int(b - a),
            "size": float(whole.weights[a:b].sum()),
            "gaps": _find_gaps(whole.gap0[a:b]),
            "held": bool(node.arguments.get("roller", False)),
            "friction": repr(law),
            "joint": [] if joint is None else list(describe_values(law)),
            "mu": find_mu(law),
            "nodes": "" if census is None else census.in_words(),
            "places": whole.points[a:b],
            "others": {} if census is None else census.places,
            "sides": _describe_sides(problem.system.space, tags, groups, whole.points[a:b]),
        }


def _stand(problem: ContactProblem) -> ContactSurface:
    """Return the surface with its gaps at the start, where bodies have been placed on others.

    What is placed touches whatever has moved below it, so that gaps as drawn say nothing there.
    """
    surface = problem.surface
    if not adds_or_removes(problem):
        return surface
    moved = surface.normal_values(initial_state(problem).u)
    return replace(surface, gap0=surface.gap0 - moved)


def _find_gaps(gaps: Array) -> list[float]:
    """Return the least and the largest finite gap of points [m]; [] without any."""
    finite = gaps[np.isfinite(gaps)]
    return [float(finite.min()), float(finite.max())] if len(finite) else []


def describe_contact_point(body: Body, problem: ContactProblem) -> dict[str, Any]:
    """Return the contact point of a body without a mesh, at which pressures are forces."""
    return {
        "name": body.point,
        "points": 1,
        "gap": float(problem.surface.gap0[0]),
        "friction": repr(problem.friction),
        "nodes": "",
        "places": problem.surface.whole().points,
        "others": {},
        "sides": [],
    }


def describe_layer(law: Any) -> dict[str, float]:
    """Return what there is to tell of a layer; its speed is V, at which restitution is wanted."""
    width = law.layer.width
    speed = law.layer.v
    return {"width": width, "speed": speed, "passage": width / speed}


def _describe_sides(
    space: Any, tags: Mapping[str, Any], names: Sequence[str], points: Array
) -> list[dict[str, Any]]:
    """Return (name, mean edge h [m], shear modulus G [Pa]) of both sides of a pair.

    They are those of their facets that are no further from the box of the contact points than an
    edge; there are none where a table has no two groups of facets.
    """
    sides = [tags[name] for name in names if isinstance(tags.get(name), Facets)]
    if len(sides) != 2 or len(names) != 2 or not len(points):
        return []
    descriptions: list[dict[str, Any]] = []
    for side in sides:
        middles, edges, cells = facets_with_cells(space.mesh, side.indices)
        slack = largest(space.comm, edges.max(initial=0.0))
        near = np.all(
            (middles >= points.min(axis=0) - slack) & (middles <= points.max(axis=0) + slack),
            axis=1,
        )
        shear = space.forms.cellwise("shear")[cells[near]]
        count, h, G = space.comm.sum(np.array([near.sum(), edges[near].sum(), shear.sum()]))
        facets = max(count, 1.0)
        descriptions.append({"name": side.name, "h": h / facets, "G": G / facets})
    return descriptions
