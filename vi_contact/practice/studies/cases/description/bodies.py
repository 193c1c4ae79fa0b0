"""Describe the bodies of a model: their materials and masses, and their waves against the mesh."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .....core.algebra import Array, largest, total
from .....core.problem import ContactProblem
from .....fem.body.space import space_of
from .....fem.mesh.tagged_mesh import Cells
from .....fem.output.outline import cell_volumes, longest_edge, outline
from .conditions import describe_supports

# Of first order in a wave length: Kuhlemeyer and Lysmer (1973); the cautious take 10.
ELEMENTS = 8.0


def select_keys(part: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a body is, without the numbers of its waves."""
    keys = ("name", "cells", "mass", "material")
    return {key: part[key] for key in keys if key in part}


def describe_waves(part: Mapping[str, Any], dt: float) -> dict[str, Any]:
    """Return the shear waves of a body, and which of them its elements and a step can follow."""
    c_s = part["c_s"]
    h = part["h"]
    return {
        "body": part["name"],
        "c_s": c_s,
        "h": h,
        "f_max": c_s / (ELEMENTS * h),
        "dt_ratio": dt * c_s / h,
    }


def describe_meshed_body(problem: ContactProblem, tags: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is told of bodies with a mesh, as ``Body.description`` has it of others."""
    space = space_of("describe", problem.system)
    volumes = cell_volumes(space.mesh)
    materials = space.forms.materials
    bodies = [_describe_body(space, tags, volumes, *material) for material in materials]
    return {
        "degree": space.degree,
        "mass": sum(body["mass"] for body in bodies),
        "bodies": bodies,
        "supports": list(describe_supports(space)),
        "outline": outline(space, tags, [cells for cells, _ in materials]),
    }


def _describe_body(
    space: Any, tags: Mapping[str, Any], volumes: Array, cells: Any, material: Any
) -> dict[str, Any]:
    """Return what is made of one material; collective.

    It is known by the name of its cell group, and has its slowest waves and longest edge.

    Args:
        space: of the body.
        tags: groups of the mesh.
        volumes: (owned cells,) [m³], in the plane per metre.
        cells: of the material, ghosts among them.
        material: the material.
    """
    names = [
        name
        for name, group in tags.items()
        if isinstance(group, Cells)
        and not largest(space.comm, not np.array_equal(group.indices, cells))
    ]
    owned = cells[cells < len(volumes)]
    density, shear = (space.forms.cellwise(field)[owned] for field in ("rho", "shear"))

    # The slowest shear waves of an orthotropic material are those of its smallest shear modulus; in
    # the plane those of the modulus in this plane, across the axis that is nearest to z.
    if hasattr(material, "G12"):
        G = (material.G23, material.G13, material.G12)  # in the planes across axes 1, 2, 3
        z = int(np.argmax(np.abs(np.asarray(material.axes)[2]))) if np.ndim(material.axes) else 2
        shear = density / material.rho * (G[z] if space.dimension == 2 else min(G))

    numbers = {
        key: value for key, value in vars(material).items() if isinstance(value, int | float)
    }
    if not numbers.get("xi", 1.0):  # a material without damping has no ratio to tell
        numbers.pop("xi")
    return {
        "name": (names or ["body"])[0],
        "cells": round(total(space.comm, len(owned))),
        "mass": total(space.comm, volumes[owned] @ density),
        "material": {"type": type(material).__name__} | numbers,
        "c_s": -largest(space.comm, np.max(-np.sqrt(shear / density), initial=-np.inf)),
        "h": largest(space.comm, longest_edge(space.mesh, owned)) / space.degree,
    }
