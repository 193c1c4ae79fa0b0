"""Treat corners: nodes with a contact condition for each of several faces.

With the directions n_i of a node its unknowns are û_i = n_i·u, and a force on them is Σ f̂_i n_i.
Where the directions are oblique, with the cosines G_ij = n_i·n_j, a change of velocity along one
normal changes the others' û too, Δû = G a, and a lumped mass m is m G⁻¹.
"""

from itertools import permutations

import numpy as np

from .algebra import Array, Indices, from_each
from .checks import at
from .errors import InputError
from .surfaces import ContactSurface, nodal_blocks, nodal_frames, same_node, tangential_columns

# CHOSEN: 30°, a usual feature angle; the coarsest circles of the models turn by less
FEATURE_ANGLE = np.pi / 6
# 1 - cosine of the angle between directions that count as one, cosine between those at right angles
PARALLEL = 1e-9


def at_right_angles(directions: Array) -> bool:
    """Say whether unit vectors (k, d) are orthogonal to one another, to round-off."""
    return bool(
        np.all(np.abs(directions @ directions.T)[np.triu_indices(len(directions), 1)] <= PARALLEL)
    )


def corner_of(directions: Array) -> tuple[list[int], Array]:
    """Return (columns, Q), the frame of a node with several contact directions.

    These are two or three independent directions (k, d).
    """
    d, square = directions.shape[1], at_right_angles(directions)
    columns: list[int] = []
    for direction in directions:
        order = np.argsort(-np.abs(direction), kind="stable")
        columns.append(next(int(c) for c in order if c not in columns))
    # columns in which no direction vanishes: components that are prescribed keep theirs
    if not square:
        choices = list(permutations(range(d), len(directions)))
        sizes = [
            np.prod([abs(direction[c]) for direction, c in zip(directions, own, strict=True)])
            for own in choices
        ]
        columns = list(choices[int(np.argmax(sizes))])
    block = np.zeros((d, d))
    block[:, columns] = directions.T
    for c in set(range(d)) - set(columns):  # in space, one vector may be missing
        edge = np.cross(block[:, (c + 1) % 3], block[:, (c + 2) % 3])
        block[:, c] = edge if square else edge / np.linalg.norm(edge)
    return columns, block


def tangent_vectors(normals: Array, nodes: Indices | None) -> Array:
    """Return the tangents (m, d, d - 1) of contact directions (m, d) at nodes (m,).

    Slip and r_t are along them.

    Of a node with several directions they are the other vectors of its frame. ``nodes``: None for
    one each.
    """
    column, blocks = nodal_blocks(nodal_frames(normals))
    for rows in () if nodes is None else same_node(nodes):
        if np.linalg.matrix_rank(normals[rows]) == len(rows):  # else two nodes at one place
            column[rows], blocks[rows] = corner_of(normals[rows])
    return np.take_along_axis(
        blocks, tangential_columns(column, normals.shape[1])[:, None, :], axis=2
    )


def oblique_corners(surface: ContactSurface) -> list[Indices]:
    """Return the conditions of each node with directions that are not at right angles."""
    if surface.dual is None:
        return []
    return [corner for corner in surface.corners if not at_right_angles(surface.normals[corner])]


def refuse_rubbing(surface: ContactSurface) -> None:
    """Raise InputError for corners beside friction, unless they are allowed to slide freely."""
    if surface.frictionless_corners:
        return
    first = [(surface.slots[corner[0]], surface.points[corner[0]]) for corner in surface.corners]
    every = [one for part in from_each(surface.comm, first) for one in part]
    if every:
        where = at(min(every, key=lambda one: one[0])[1])
        raise InputError(
            f"{len(every)} contact nodes, the first at {where}, have several contact directions, "
            "and friction on two faces at once is not modelled: let them slide freely "
            "(surface.with_frictionless_corners()), or treat the corner as smooth (a larger "
            "feature_angle=)"
        )


def with_open_faces(surface: ContactSurface, v: Array, target: Array) -> Array:
    """Return the target normal velocities (m,), NaN for open faces.

    Among them are those that oblique open faces get from the closed faces of their nodes, whose
    velocity changes along the normals of these.
    """
    corners = oblique_corners(surface)
    if not corners:
        return target
    if v.ndim == 2:
        return np.stack([with_open_faces(surface, *each) for each in zip(v, target, strict=True)])
    v_n, target = surface.normal_values(v), target.copy()
    for corner in corners:
        closed = ~np.isnan(target[corner])
        one, other = corner[closed], corner[~closed]
        if len(one) and len(other):
            cosines = surface.normals[corner] @ surface.normals[corner].T
            jump = np.linalg.solve(cosines[np.ix_(closed, closed)], target[one] - v_n[one])
            target[other] = v_n[other] + cosines[np.ix_(~closed, closed)] @ jump
    return target


def lumped_entries(surface: ContactSurface, nodal: Array) -> tuple[Indices, Indices, Array]:
    """Return (rows, columns, values) of the lumped masses ``nodal``.

    The matrix is the diagonal, but m G⁻¹ at oblique corners.
    """
    rows = [np.arange(len(nodal))]
    columns, values = [rows[0]], [nodal.copy()]
    for corner in oblique_corners(surface):
        own, cosines = surface.owned[corner], surface.normals[corner] @ surface.normals[corner].T
        values[0][own] = 0.0
        rows.append(np.repeat(own, len(own)))
        columns.append(np.tile(own, len(own)))
        values.append((np.sqrt(np.outer(nodal[own], nodal[own])) * np.linalg.inv(cosines)).ravel())
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)
