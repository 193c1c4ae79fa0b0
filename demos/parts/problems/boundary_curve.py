"""Take the boundary of a plane finite element mesh as boundary elements.

The mesh of these is the same on all ranks.
"""

import numpy as np
import numpy.typing as npt

from demos.parts.problems.loose_segments import from_segments
from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.core.errors import InputError
from vi_contact.fem import compat
from vi_contact.fem.groups import facets_of
from vi_contact.fem.mesh import Facets, node_numbers


def boundary_curve(*facets: Facets) -> tuple[BoundaryMesh, npt.NDArray[np.int64]]:
    """Return (boundary mesh, (n,) input number of each of its nodes) of groups.

    These make up closed curves.

    Label of an element = position of its group among the arguments. Raises InputError when the mesh
    is not plane, the groups overlap or the curves are open. Collective.
    """
    for group in facets:
        facets_of("boundary_curve", "a group", group, getattr(facets[0], "mesh", None))
    if not facets or facets[0].mesh.geometry.dim != 2:
        raise InputError(
            "boundary_curve: give boundary groups of a plane mesh; boundary elements are "
            "two-dimensional"
        )
    mesh = facets[0].mesh
    numbers = node_numbers(mesh)
    rows = []
    labels = []
    for label, group in enumerate(facets):
        owned = group.indices[group.indices < mesh.topology.index_map(1).size_local]
        rows.append(compat.entities_to_geometry(mesh, 1, owned))
        labels.append(np.full(len(owned), label))
    local = np.concatenate(rows).reshape(-1, 2)
    gathered = mesh.comm.allgather(
        (numbers[local], mesh.geometry.x[local][:, :, :2], np.concatenate(labels))
    )
    segments, places, tags = (np.concatenate(parts) for parts in zip(*gathered, strict=True))
    order = np.lexsort(np.sort(segments, axis=1).T)  # independent of the number of ranks
    nodes, first, renamed = np.unique(segments[order], return_index=True, return_inverse=True)
    points = places[order].reshape(-1, 2)[first]
    curve = from_segments(points, np.reshape(renamed, (-1, 2)), labels=tags[order])
    number_at = {point.tobytes(): number for point, number in zip(points, nodes, strict=True)}
    return curve, np.array([number_at[point.tobytes()] for point in curve.points])
