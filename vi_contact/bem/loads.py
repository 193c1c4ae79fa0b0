"""Turn surface tractions into nodal forces, averaged over each time step."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.checks import array, check_count, function, instance, mask, number, whole
from .boundary_mesh import BoundaryMesh
from .quadrature import MOST_POINTS
from .rules import gauss


def traction_forces(
    mesh: BoundaryMesh,
    traction: Callable[[Array, Array, float], ArrayLike],
    *,
    dt: float,
    steps: int,
    elements: ArrayLike | None = None,
    order: int = 4,
) -> Array:
    """Return the nodal forces (steps, 2, n) of a traction, means over each step [N/m].

    Args:
        mesh: the boundary, of n elements.
        traction: a function of (points (m, 2), normals (m, 2), t) that returns (m, 2) [Pa].
        dt: time step [s].
        steps: number of steps.
        elements: mask (n,) of the loaded elements; None for all.
        order: number of Gauss points in each step, and along each element.
    """
    owner = "traction_forces"
    instance(owner, "mesh", mesh, BoundaryMesh, "give a BoundaryMesh, for example polygon(...)")
    function(owner, "traction", traction, "give a function (points, normals, t) -> (m, 2) in Pa")
    dt = number(owner, "dt", dt, positive=True, unit="s")
    steps = whole(owner, "steps", steps, least=1)
    check_count(owner, "steps", 2 * steps * len(mesh), "numbers")
    loaded = np.ones(len(mesh), bool)
    if elements is not None:
        loaded = mask(owner, "elements", elements, (len(mesh),))
    x, w = gauss(whole(owner, "order", order, least=1, most=MOST_POINTS))

    # Gauss points along the loaded elements.
    first = np.flatnonzero(loaded)
    second = mesh.after[first]
    start = mesh.points[first, None]
    end = mesh.points[second, None]
    places = (start + x[:, None] * (end - start)).reshape(-1, 2)
    normals = np.repeat(mesh.normals[first], order, axis=0)
    weight = mesh.lengths[first, None] * w

    forces = np.zeros((steps, 2, len(mesh)))
    for k in range(steps):
        # Mean over the step, then the integral with the shape functions of both ends.
        tractions = []
        for t in (k + x) * dt:
            name = f"the traction at t = {t:.6g} s"
            values = traction(places, normals, t)
            tractions.append(array(owner, name, values, places.shape, unit="Pa"))
        mean = np.tensordot(w, np.stack(tractions), 1).reshape(len(first), order, 2)
        loads = mean * weight[:, :, None]
        forces[k][:, first] += np.einsum("eqc,q->ce", loads, 1.0 - x)
        forces[k][:, second] += np.einsum("eqc,q->ce", loads, x)
    return forces
