"""Leave the boundaries of absent bodies out of contact: of bodies that are not yet placed, or gone.

A facet is present if a cell on it is. Of a pair, a facet of side 1 is left out too where the
nearest facet of side 2, by their middles, is absent: what it faces is not there.
"""

import numpy as np

from ...core.algebra import Array, Mask, from_each, total
from .. import compat
from ..body.absent import find_present
from ..body.space import FemSpace
from ..mesh.tagged_mesh import Facets


def keep_present(
    space: FemSpace, facets1: Facets, facets2: Facets | None = None
) -> tuple[Facets, Facets | None]:
    """Return the present facets of a boundary, or of both sides of a pair. Collective.

    They may be none. Without absent bodies they are as they were given.

    Args:
        space: of the bodies.
        facets1: the boundary, or side 1.
        facets2: side 2; None where there is none.
    """
    if space.absent is None:
        return facets1, facets2
    there1 = find_present(space.mesh, space.absent, facets1)
    if facets2 is None:
        return _pick(facets1, there1), None
    there2 = find_present(space.mesh, space.absent, facets2)
    middles = np.concatenate(from_each(space.comm, _find_middles(space, facets2)))
    flags = np.concatenate(from_each(space.comm, there2))
    if len(middles) and len(facets1.indices):
        from scipy.spatial import cKDTree  # late: it takes a while

        nearest = cKDTree(middles).query(_find_middles(space, facets1))[1]
        there1 = there1 & flags[nearest]
    return _pick(facets1, there1), _pick(facets2, there2)


def is_there(space: FemSpace, facets: Facets) -> bool:
    """Say whether any facet of a group is left, or no body is ever absent. Collective."""
    return space.absent is None or total(space.comm, len(facets.indices)) > 0.0


def _find_middles(space: FemSpace, facets: Facets) -> Array:
    """Return the middles (k, d) [m] of facets."""
    dim = space.mesh.topology.dim
    rows = compat.entities_to_geometry(space.mesh, dim - 1, facets.indices)
    corners: Array = space.mesh.geometry.x[rows]
    return corners.mean(axis=1)[:, : space.dimension]


def _pick(facets: Facets, there: Mask) -> Facets:
    """Return the facets (k,) of a group that are there."""
    return Facets(facets.name, facets.indices[there], facets.mesh)
