"""Treat corners: nodes with a contact condition for each of several faces.

With the directions n_i of a node its unknowns are û_i = n_i·u, and a force on them is Σ f̂_i n_i.
Where the directions are oblique, with the cosines G_ij = n_i·n_j, a change of velocity along one
normal changes the others' û too, Δû = G a, and a lumped mass m is m G⁻¹.
"""

from itertools import chain, permutations

import numpy as np

from .algebra import Array, Indices, from_each, total
from .checks import describe_point
from .errors import InputError
from .surfaces import (
    ContactSurface,
    arrange_frames,
    group_same_nodes,
    list_tangential_columns,
    make_nodal_frames,
)

# CHOSEN: 30°, a usual feature angle; the coarsest circles of the models turn by less
FEATURE_ANGLE = np.pi / 6
# 1 - cosine of the angle between directions that count as one, cosine between those at right angles
PARALLEL = 1e-9


def are_orthogonal(directions: Array) -> bool:
    """Say whether unit vectors (k, d) are at right angles to one another, to round-off."""
    pairs = np.triu_indices(len(directions), 1)
    cosines = directions @ directions.T
    return bool(np.all(np.abs(cosines)[pairs] <= PARALLEL))


def make_corner_frame(directions: Array) -> tuple[list[int], Array]:
    """Return the frame of a node with several contact directions.

    Args:
        directions: two or three independent unit vectors (k, d).

    Returns:
        The columns (k,) in which the directions stand, and the frame (d, d).
    """
    d = directions.shape[1]
    orthogonal = are_orthogonal(directions)

    # Directions at right angles take, one after another, the column of their largest component
    # that is still free.
    columns: list[int] = []
    for direction in directions:
        order = np.argsort(-np.abs(direction), kind="stable")
        columns.append(next(int(c) for c in order if c not in columns))

    # Oblique ones take those columns in which the product of their components is largest, so that
    # none vanishes in its own: components that are prescribed keep their columns.
    if not orthogonal:
        choices = list(permutations(range(d), len(directions)))
        rows = range(len(directions))
        sizes = [np.prod(np.abs(directions[rows, choice])) for choice in choices]
        columns = list(choices[int(np.argmax(sizes))])

    block = np.zeros((d, d))
    block[:, columns] = directions.T
    for c in set(range(d)) - set(columns):  # in space, one vector may be missing
        edge = np.cross(block[:, (c + 1) % 3], block[:, (c + 2) % 3])
        block[:, c] = edge if orthogonal else edge / np.linalg.norm(edge)
    return columns, block


def make_tangent_vectors(normals: Array, nodes: Indices | None) -> Array:
    """Return the tangents along which slip and r_t are measured, (m, d, d - 1).

    Those of a node with several contact directions are the other vectors of its frame.

    Args:
        normals: contact directions (m, d).
        nodes: numbers of their nodes (m,); None for one node each.
    """
    column, blocks = arrange_frames(make_nodal_frames(normals))
    corners = () if nodes is None else group_same_nodes(nodes)
    for rows in corners:
        if np.linalg.matrix_rank(normals[rows]) == len(rows):  # else two nodes at one place
            column[rows], blocks[rows] = make_corner_frame(normals[rows])
    tangents = list_tangential_columns(column, normals.shape[1])
    return np.take_along_axis(blocks, tangents[:, None, :], axis=2)


def find_tangents(surface: ContactSurface) -> Array:
    """Return the tangents along which slip and r_t of a surface are measured, (m, d, d - 1)."""
    return make_tangent_vectors(surface.normals, surface.frame_nodes)


def find_oblique_corners(surface: ContactSurface) -> list[Indices]:
    """Return the conditions of each node with directions that are not at right angles."""
    if surface.dual is None:
        return []
    return [corner for corner in surface.corners if not are_orthogonal(surface.normals[corner])]


def let_corners_rub(surface: ContactSurface) -> ContactSurface:
    """Return a surface whose corners rub on all their faces, beside friction. Collective.

    It is the same surface where there are none, or where they are allowed to slide freely.

    Raises:
        InputError: corners of a surface that was made by hand, without what makes traces of it.
    """
    if surface.frictionless_corners or not total(surface.comm, len(surface.corners)):
        return surface
    rubbing = surface.with_own_laws()
    if rubbing.traces is not None:
        return rubbing

    # The number and the place of the first condition of each corner, on all ranks.
    first = [(surface.slots[corner[0]], surface.points[corner[0]]) for corner in surface.corners]
    corners = list(chain.from_iterable(from_each(surface.comm, first)))
    _, point = min(corners, key=lambda corner: corner[0])
    raise InputError(
        f"{len(corners)} contact nodes, the first at {describe_point(point)}, have several contact "
        "directions, and friction on two faces at once is not modelled on a surface without finite "
        "elements: let them slide freely (surface.with_frictionless_corners()), or treat the "
        "corner as smooth (a larger feature_angle=)"
    )


def with_open_faces(surface: ContactSurface, v: Array, target: Array) -> Array:
    """Return target normal velocities that oblique open faces have a share in.

    The velocity of a node changes along the normals of its closed faces. Where an open face of the
    node is oblique to these, the velocity along its own normal changes with it.

    Args:
        surface: the contact conditions.
        v: velocities (n,) [m/s] before the impact law, or rows (k, n).
        target: normal velocities (m,) [m/s] of closed faces, NaN for open ones; or rows (k, m).
    """
    corners = find_oblique_corners(surface)
    if not corners:
        return target
    if v.ndim == 2:
        return np.stack([with_open_faces(surface, *row) for row in zip(v, target, strict=True)])
    v_n = surface.normal_values(v)
    target = target.copy()
    for corner in corners:
        is_closed = ~np.isnan(target[corner])
        closed = corner[is_closed]
        open_ = corner[~is_closed]
        if len(closed) and len(open_):
            # The impulses a of the closed faces give Δû = G a: solve for a, and apply it.
            cosines = surface.normals[corner] @ surface.normals[corner].T
            wanted = target[closed] - v_n[closed]
            impulse = np.linalg.solve(cosines[np.ix_(is_closed, is_closed)], wanted)
            target[open_] = v_n[open_] + cosines[np.ix_(~is_closed, is_closed)] @ impulse
    return target


def lump_masses(surface: ContactSurface, nodal: Array) -> tuple[Indices, Indices, Array]:
    """Return (rows, columns, values) of a lumped mass matrix.

    It is diagonal, but m G⁻¹ at oblique corners.

    Args:
        surface: the contact conditions.
        nodal: masses (n,) [kg] of the unknowns.
    """
    # The diagonal, from which the unknowns of oblique corners are taken out, and a small full block
    # for each of these corners.
    diagonal = np.arange(len(nodal))
    on_diagonal = nodal.copy()
    rows = [diagonal]
    columns = [diagonal]
    values = [on_diagonal]
    for corner in find_oblique_corners(surface):
        unknowns = surface.owned[corner]
        cosines = surface.normals[corner] @ surface.normals[corner].T
        masses = np.sqrt(np.outer(nodal[unknowns], nodal[unknowns]))
        on_diagonal[unknowns] = 0.0
        rows.append(np.repeat(unknowns, len(unknowns)))
        columns.append(np.tile(unknowns, len(unknowns)))
        values.append((masses * np.linalg.inv(cosines)).ravel())
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
