"""Strips of soil that several tests of boundaries share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.soil.soil_column import SoilColumn
from vi_contact.run.march import march

SOIL = LinearElastic.from_wave_speeds(400.0, 200.0, 2000.0)


def strip(
    comm: Any, width: float, height: float, divisions: tuple[int, int], **spec: Any
) -> tuple[Any, Any]:
    """(mesh, tags) of a rectangle of soil."""
    return fem.build_mesh(BlockMesh(lengths=(width, height), divisions=divisions, **spec), comm)


def column_of(
    material: LinearElastic, heights: Array, *, alpha: float = 0.0, beta: float = 0.0
) -> SoilColumn:
    """The column of one material."""
    same = np.ones(len(heights) - 1)
    moduli = material.lame_lambda * same, material.shear_modulus * same, material.rho * same
    return SoilColumn(heights, *moduli, alpha * same, beta * same)


def energies(problem: Any, **run: Any) -> Array:
    """Kinetic and strain energy together after every step [J]."""
    system = problem.system
    return np.array(
        [system.kinetic_energy(s.v) + system.strain_energy(s.u) for s, _ in march(problem, **run)]
    )


def history(problem: Any, points: Any, *, derivative: int = 0, **run: Any) -> Array:
    """u (or v) at points after every step, (steps, points, d)."""
    space = problem.system.space
    nodes, rows = space.find_nodes(np.asarray(points, dtype=float)), []
    for state, _ in march(problem, **run):
        rows.append(
            space.sample(
                problem.cartesian((state.u, state.v)[derivative]), nodes, state.t, derivative
            )
        )
    return np.array(rows)


def burst(duration: float) -> Callable[[float], float]:
    """One hump sin²(pi t/T), zero outside."""
    return lambda t: float(np.sin(np.pi * t / duration) ** 2) if 0.0 < t < duration else 0.0
