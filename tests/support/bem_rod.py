"""Load a rod of boundary elements smoothly in time."""

from __future__ import annotations

import numpy as np

from vi_contact.bem import (
    BoundaryProblem,
    EnergeticBlocks,
    PoincareSteklov,
    traction_forces,
)


def rod(
    blocks: EnergeticBlocks, load, *, symmetric: bool = True, rho: float = 1.0
) -> BoundaryProblem:
    """The square between rollers on a fixed base, pulled at its top by load(t): a rod with c = 1,
    length 1."""
    mesh = blocks.mesh
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[1] = mesh.nodes_of(mesh.labels == 0)
    fixed[0] = mesh.nodes_of(np.isin(mesh.labels, (1, 3)))
    forces = traction_forces(
        mesh,
        lambda x, n, t: n * load(t),
        dt=blocks.dt,
        steps=blocks.steps,
        elements=mesh.labels == 2,
    )
    return BoundaryProblem(
        PoincareSteklov(blocks, rho, symmetric), forces, fixed, contact=mesh.labels == 0
    )


def smooth_load(t: float) -> float:
    return float(np.sin(0.5 * np.pi * t) ** 2) if t < 2.0 else 0.0


def smooth_integral(t: np.ndarray) -> np.ndarray:
    return np.where(
        t <= 0.0, 0.0, np.where(t < 2.0, 0.5 * t - np.sin(np.pi * t) / (2.0 * np.pi), 1.0)
    )
