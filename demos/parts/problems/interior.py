"""Compute the displacement inside the body from those on its boundary.

From these histories u(x) = V p - K u, in time.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.boundary_operators import (
    N_DOUBLE,
    N_SINGLE,
    double_local,
    integrands,
    join_at_nodes,
    tensor,
)
from vi_contact.bem.fundamental_solution import TimeKernels
from vi_contact.bem.loops import distances
from vi_contact.bem.poincare_steklov import BoundaryMotion, PoincareSteklov
from vi_contact.bem.quadrature import integration_matrix
from vi_contact.bem.rules import pieces, place_rule, roots, smooth_rule
from vi_contact.core.algebra import Array
from vi_contact.core.checks import array, find_shape, instance, integers
from vi_contact.core.errors import InputError

ORDER = 8  # points a piece
CLOSEST = 1e-3  # least distance from the boundary in element lengths


def interior_displacement(
    operator: PoincareSteklov,
    motion: BoundaryMotion,
    points: ArrayLike,
    *,
    steps: Sequence[int] | None = None,
) -> Array:
    """Return (len(steps), m, 2) displacement [m] of inner points (m, 2).

    It is that at the times motion.times[steps] (None: all).

    Without quadrature in time, with the elements split at the wave fronts. InputError for points
    that are not inside.
    """
    owner = "interior_displacement"
    instance(owner, "operator", operator, PoincareSteklov, "give PoincareSteklov(blocks, rho)")
    instance(owner, "motion", motion, BoundaryMotion, "give the answer of BoundaryProblem.solve()")
    mesh, blocks = operator.mesh, operator.blocks
    x = array(
        owner, "points", points, (2,) if find_shape(points) == (2,) else (None, 2), unit="m"
    ).reshape(-1, 2)
    _check_inside(mesh, x)
    wanted = (
        np.arange(len(motion.times)) if steps is None else integers(owner, "steps", steps, (None,))
    )
    if len(wanted) and not 0 <= wanted.min() <= wanted.max() < len(motion.times):
        raise InputError(
            f"{owner}: steps are from {wanted.min()} to {wanted.max()}; this motion has steps 0 to "
            f"{len(motion.times) - 1}"
        )
    traction = motion.traction.reshape(len(motion.times), -1) / operator.rho
    increments = np.diff(motion.displacement, axis=0, prepend=0.0).reshape(len(motion.times), -1)
    total = np.zeros((len(wanted), 2 * len(x)))
    single, double = np.zeros((2 * len(x), 4 * len(mesh))), np.zeros((2 * len(x), 2 * len(mesh)))
    for j in range(int(wanted.max(initial=-1)) + 1):
        single_now, double_now = _matrices(mesh, x, (j + 1) * blocks.dt, blocks.c_p, blocks.c_s)
        reached = wanted >= j
        past = wanted[reached] - j
        total[reached] += traction[past] @ (single_now - single).T
        total[reached] -= increments[past] @ (double_now - double).T / blocks.dt
        single, double = single_now, double_now
    return total.reshape(len(wanted), 2, len(x)).swapaxes(1, 2)


def _matrices(
    mesh: BoundaryMesh, x: Array, t: float, c_p: float, c_s: float
) -> tuple[Array, Array]:
    """Return (2m, 4n) of V integrated once, (2m, 2n) of K integrated twice.

    Both go up to t; the density is 1.
    """
    m, n = len(x), len(mesh)
    moments = np.concatenate(list(_moments(mesh, x, t, c_p, c_s)), axis=1)
    point, element = np.repeat(np.arange(m), n), np.tile(np.arange(n), m)
    single, double = np.empty((2, m, 2, n, 2)), np.empty((2, m, 2, n, 2))
    values = double_local(mesh, c_s**2, moments[N_SINGLE:, :, None, :], element)[..., 0, :]
    single[:, point, :, element] = tensor(moments[:N_SINGLE]).transpose(2, 0, 1, 3)
    double[:, point, :, element] = values.transpose(2, 0, 1, 3)
    return single.reshape(2 * m, 4 * n), join_at_nodes(mesh, double, 3).reshape(2 * m, 2 * n)


def _moments(mesh: BoundaryMesh, x: Array, t: float, c_p: float, c_s: float) -> Iterator[Array]:
    """Return (k, points * n, 2) integrals over each element.

    They are those of the stacked kernels against its shape functions.
    """
    n = len(mesh)
    along = mesh.points[mesh.after] - mesh.points
    group = max(1, 4000 // n)
    kernels = TimeKernels(t, c_p, c_s)
    for first in range(0, len(x), group):
        count = len(x[first : first + group])
        offset = (x[first : first + group, None] - mesh.points).reshape(-1, 2)
        b = np.tile(along, (count, 1))
        b2 = (b**2).sum(1)
        projection = (b * offset).sum(1)
        d2 = (offset**2).sum(1)
        fronts = [roots(b2, -2.0 * projection, d2 - (c * t) ** 2) for c in (c_p, c_s)]
        foot = projection / b2
        height = np.abs(b[:, 0] * offset[:, 1] - b[:, 1] * offset[:, 0]) / b2
        row, low, length = pieces(np.concatenate([*fronts, foot[:, None]], axis=1))
        eta, weight = (
            part.ravel()
            for part in place_rule(low, length, smooth_rule(ORDER), about=(foot[row], height[row]))
        )
        owner = np.repeat(row, ORDER)
        weight = weight * np.sqrt(b2)[owner]
        d = (offset[owner] - eta[:, None] * b[owner]).T
        r = np.hypot(*d)
        heard = r < c_p * t
        d = d[:, heard]
        r = r[heard]
        eta = eta[heard]
        owner = owner[heard]
        weight = weight[heard]
        values = integrands(kernels(r), d, r)[: N_SINGLE + N_DOUBLE]
        matrix = integration_matrix(
            np.stack([1.0 - eta, eta], axis=1) * weight[:, None], owner, count * n
        )
        yield np.asarray(matrix @ values.T).T.reshape(len(values), count * n, 2)


def _check_inside(mesh: BoundaryMesh, x: Array) -> None:
    """Raise InputError unless all points are inside.

    They have winding number 1 (0 for an exterior body), and are off the boundary.
    """
    start = mesh.points - x[:, None]
    end = mesh.points[mesh.after] - x[:, None]
    distance = distances(x[:, None], mesh.points, mesh.points[mesh.after]) / mesh.lengths
    turn = np.arctan2(
        start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0], (start * end).sum(2)
    ).sum(1)
    winding = np.rint(turn / (2.0 * np.pi)) + (1.0 if mesh.exterior else 0.0)
    bad = (distance.min(axis=1) < CLOSEST) | (winding != 1.0)
    if bad.any():
        raise InputError(
            f"interior_displacement: the point {x[int(bad.argmax())].tolist()} lies on the "
            "boundary or outside the body; give points inside and take boundary values from the "
            "motion"
        )
