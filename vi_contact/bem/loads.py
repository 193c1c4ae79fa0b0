"""Turn surface tractions into nodal forces, averaged over each time step."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.checks import array, counted, function, instance, mask, number, whole
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
    """Return (steps, 2, n) nodal forces [N/m].

    They are the means over each step of traction(points, normals, t) -> (m, 2) [Pa].

    points, normals: (m, 2); elements: mask (n,) of loaded ones, None: all; order: Gauss points in
    time and along each.
    """
    owner = "traction_forces"
    instance(owner, "mesh", mesh, BoundaryMesh, "give a BoundaryMesh, for example polygon(...)")
    function(owner, "traction", traction, "give a function (points, normals, t) -> (m, 2) in Pa")
    dt, steps = (
        number(owner, "dt", dt, positive=True, unit="s"),
        whole(owner, "steps", steps, least=1),
    )
    counted(owner, "steps", 2 * steps * len(mesh), "numbers")
    everywhere = np.ones(len(mesh), bool)
    chosen = np.flatnonzero(
        everywhere if elements is None else mask(owner, "elements", elements, (len(mesh),))
    )
    x, w = gauss(whole(owner, "order", order, least=1, most=MOST_POINTS))
    start, end = mesh.points[chosen, None], mesh.points[mesh.after[chosen], None]
    places = (start + x[:, None] * (end - start)).reshape(-1, 2)
    normals = np.repeat(mesh.normals[chosen], order, axis=0)
    weight = mesh.lengths[chosen, None] * w
    forces = np.zeros((steps, 2, len(mesh)))
    for k in range(steps):
        at_times = [
            array(
                owner,
                f"the traction at t = {t:.6g} s",
                traction(places, normals, t),
                places.shape,
                unit="Pa",
            )
            for t in (k + x) * dt
        ]
        loads = (
            np.tensordot(w, np.stack(at_times), 1).reshape(len(chosen), order, 2)
            * weight[:, :, None]
        )
        for nodes, shape in ((chosen, 1.0 - x), (mesh.after[chosen], x)):
            forces[k][:, nodes] += np.einsum("eqc,q->ce", loads, shape)
    return forces
