"""Make rigid body modes in the unknowns of the equations: turned into the nodal frames, relative at two bodies."""

from typing import Any

import numpy as np

from ...core.algebra import EffectiveMatrix
from ...core.surfaces import ContactSurface
from ...laws.mass_transfer import rigid_motions
from .layout import Layout


def rigid_modes(A: EffectiveMatrix, surface: ContactSurface, layout: Layout, template: Any) -> list[Any]:
    """Return orthonormal PETSc vectors of the rigid motions: translations, then rotations in the planes of two axes."""
    space, comm = A.space, A.algebra.comm
    d, points = int(space.dimension), np.asarray(space.coordinates)
    component = np.asarray(space.ids) % d
    low = -comm.max(-np.min(points, axis=0, initial=np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    x = (points - 0.5 * (low + high)) / np.linalg.norm(high - low)
    modes = rigid_motions(np.eye(d)[component], x).T
    vectors = [template.duplicate() for _ in modes]
    for vector, mode in zip(vectors, modes, strict=True):
        unknowns = surface.in_frames(mode)  # T⁻¹ u
        if surface.coupling is not None:
            unknowns = 2.0 * unknowns - surface.coupling @ unknowns  # R⁻¹ = 2 - R
        vector.array[:] = layout.padded(unknowns)
    return orthonormal(vectors)


def orthonormal(vectors: list[Any]) -> list[Any]:
    """Return the vectors made orthonormal in place (Gram and Schmidt, twice); those that vanish are left out."""
    kept: list[Any] = []
    for vector in vectors:
        before = vector.norm()
        for _ in range(2):
            for other in kept:
                vector.axpy(-vector.dot(other), other)
        size = vector.norm()
        if size > 1e-8 * before:
            vector.scale(1.0 / size)
            kept.append(vector)
    return kept

