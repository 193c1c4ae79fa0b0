"""Describe the bodies of a model: their materials and masses, and their waves against the mesh."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from .....core.algebra import Array, largest, total
from .....core.problem import ContactProblem
from .....fem import compat
from .....fem.body.space import space_of
from .....fem.mesh.tagged_mesh import Cells
from .....fem.output.outline import longest_edge, outline
from .....fem.output.sizes import measure_cells
from .....laws.iwan import Iwan
from .....laws.materials import LinearElastic
from .....laws.yielding import YieldingMaterial
from .conditions import describe_supports

# Of first order in a wave length: Kuhlemeyer and Lysmer (1973); the cautious take 10.
ELEMENTS = 8.0


def select_keys(part: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a body is, without the numbers of its waves."""
    return {key: value for key, value in part.items() if key not in ("c_s", "h")}


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
    measured = measure_cells(space.mesh)
    bodies = [
        _describe_body(space, tags, measured, cells, material)
        for cells, material in space.forms.given_materials
    ]
    section = space.forms.section
    bbar = space.forms.integration == "bbar"
    return {
        "degree": space.degree,
        **({"integration": "bbar"} if bbar else {}),
        "section": {"type": type(section).__name__, "thickness": section.thickness},
        "box": find_box(space.comm, space.points),
        "mass": sum(body["mass"] for body in bodies),
        "bodies": bodies,
        "supports": list(describe_supports(space)),
        "outline": outline(space, tags, [cells for cells, _ in space.forms.given_materials]),
    }


def find_box(comm: Any, points: Array) -> dict[str, list[float]]:
    """Return the least and the largest coordinates of points of all ranks. Collective."""
    d = points.shape[1]
    low = -comm.max(np.max(-points, axis=0, initial=-np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    return {"min": np.reshape(low, d).tolist(), "max": np.reshape(high, d).tolist()}


def name_body(space: Any, tags: Mapping[str, Any], cells: Any) -> str:
    """Return the name of the cell group that these cells are, "body" without one. Collective."""
    for name, group in tags.items():
        if not isinstance(group, Cells):
            continue
        if not largest(space.comm, not np.array_equal(group.indices, cells)):
            return name
    return "body"


def _describe_body(
    space: Any, tags: Mapping[str, Any], measured: tuple[Array, Array], cells: Any, material: Any
) -> dict[str, Any]:
    """Return what is made of one material; collective.

    It is known by the name of its cell group, and has its slowest waves and longest edge. What
    changes inside it is told by its least and its largest value.

    Args:
        space: of the body.
        tags: groups of the mesh.
        measured: sizes and centroids of the owned cells.
        cells: of the material, ghosts among them.
        material: the material.
    """
    sizes, centroids = measured
    owned = cells[cells < len(sizes)]
    thickness = space.forms.section.thickness
    fields = ("rho", "shear", "alpha_rho")
    density, shear, inertial = (space.forms.cellwise(field)[owned] for field in fields)
    masses = sizes[owned] * density
    mass = total(space.comm, masses.sum())
    first = space.comm.sum(masses @ centroids[owned])
    volume = total(space.comm, sizes[owned].sum())
    volume_centre = space.comm.sum(sizes[owned] @ centroids[owned]) / volume
    corners = space.mesh.geometry.x[compat.geometry_dofmap(space.mesh)[owned]]
    points = corners.reshape(-1, 3)[:, : space.dimension]
    shear = _find_slowest_shear(space, material, density, shear)

    # a body without mass is damped by its stiffness alone, and has no waves
    heavy = np.where(density > 0.0, density, 1.0)
    waves = {}
    if mass > 0.0:
        waves["c_s"] = -largest(space.comm, np.max(-np.sqrt(shear / heavy), initial=-np.inf))
        waves["h"] = largest(space.comm, longest_edge(space.mesh, owned)) / space.degree

    numbers = {
        key: value for key, value in vars(material).items() if isinstance(value, int | float)
    }
    if isinstance(material, Iwan):
        numbers["elements"] = len(material.elements[0])
    if not numbers.get("xi", 1.0):  # a material without damping has no ratio to tell
        numbers.pop("xi")
    return {
        "name": name_body(space, tags, cells),
        "cells": round(total(space.comm, len(owned))),
        "mass": mass,
        "size": volume,
        "centre": (first / mass if mass > 0.0 else volume_centre).tolist(),
        "box": find_box(space.comm, points),
        "material": {"type": _name_law(material)} | numbers,
        "shear_modulus": _find_range(space.comm, shear / thickness),
        "density": _find_range(space.comm, density / thickness),
        "alpha": _find_range(space.comm, inertial / heavy),
        "beta": _find_range(space.comm, space.forms.cellwise("beta")[owned]),
        **waves,
    }


def _find_slowest_shear(space: Any, material: Any, density: Array, shear: Array) -> Array:
    """Return the shear moduli (cells,) of the slowest shear waves, times the thickness.

    Those of an orthotropic material are of its smallest shear modulus; in the plane of the modulus
    in this plane, across the axis that is nearest to z.

    Args:
        space: of the body.
        material: its material.
        density: (cells,) times the thickness.
        shear: (cells,) of an isotropic material.
    """
    if not hasattr(material, "G12"):
        return shear
    G = (material.G23, material.G13, material.G12)  # in the planes across axes 1, 2, 3
    z = int(np.argmax(np.abs(np.asarray(material.axes)[2]))) if np.ndim(material.axes) else 2
    return np.asarray(density / material.rho * (G[z] if space.dimension == 2 else min(G)))


def _find_range(comm: Any, values: Array) -> list[float]:
    """Return the least and the largest of values of all ranks. Collective."""
    low = -largest(comm, np.max(-values, initial=-np.inf))
    return [low, largest(comm, np.max(values, initial=-np.inf))]


def _name_law(material: Any) -> str:
    """Return the name of a law; that of a linear body which only remembers its stress is linear."""
    kind = LinearElastic if type(material) is YieldingMaterial else type(material)
    return kind.__name__
