"""Make systems of thin (Kirchhoff) plates from a form of DOLFINx.

It is a C0 interior penalty on triangles of second order.

    rho t w'' + D ∇⁴w = q,   M(w) = D ((1 - nu) ∇∇w + nu (Δw) I),   w the deflection upwards [m]

    K(w, v) = ∫ M(w):∇∇v - ∫_S {M_nn(w)} [∂v/∂n] + {M_nn(v)} [∂w/∂n] - p [∂w/∂n] [∂v/∂n]

S are the edges between triangles and, where the plate is clamped, those of its boundary; {} is the
mean of both sides, [] the jump. w = 0 along the whole boundary; M_nn = 0 of a simple support is
natural. p is 4 D times the mean over the sides of edge length over area. K is positive on every
mesh, and nothing is left to tune: second derivatives are constant in a triangle, and M_nn² <= D
M:∇∇w, so that the terms with M_nn are at most the last one and three quarters of the first. Source:
S. Brenner, L.-Y. Sung, C0 interior penalty methods for fourth order elliptic boundary value
problems on polygonal domains, J. Sci. Comput. 22 (2005).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import dolfinx
import numpy as np
import ufl

from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem import compat


@dataclass(frozen=True)
class Plate:
    """Describe a plate.

    It has bending stiffness D [N m], Poisson's ratio [-] and mass per area rho t [kg/m²].
    """

    D: float = 1.0e4
    nu: float = 0.3
    mass: float = 50.0


def square_mesh(comm: Any, side: float, cells: int) -> Any:
    """Return so many squares along the side of a square around 0 [m].

    Each is cut into four triangles.
    """
    half = 0.5 * side
    crossed = dolfinx.mesh.DiagonalType.crossed
    ghosts = dolfinx.mesh.GhostMode.shared_facet  # edges between ranks are integrated too
    return dolfinx.mesh.create_rectangle(
        comm, [[-half, -half], [half, half]], [cells, cells], ghost_mode=ghosts, diagonal=crossed
    )


def disk_mesh(comm: Any, radius: float, cells: int) -> Any:
    """Return the same for a disk [m]: squares around 0 become circles."""
    on = square_mesh(comm, 2.0 * radius, cells)
    x = on.geometry.x
    size = np.max(np.abs(x[:, :2]), axis=1)
    x[:, :2] *= (size / np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300))[:, None]
    return on


def plate_system(
    on: Any,
    plate: Plate,
    *,
    clamped: bool,
    pressure: float = 0.0,
    speed: Callable[[Array], Array] | None = None,
) -> SemiDiscreteSystem:
    """Return the system of a plate on a mesh of triangles, held along its boundary. Collective.

    Its unknowns are deflections along z at the vertices and at the middle of edges,
    ``system.space.points``.

    Args:
        on: mesh in the plane.
        plate: its stiffness and its mass.
        clamped: whether its boundary may not turn either.
        pressure: uniform load downwards [Pa].
        speed: x (n, 3) -> upward velocities (n,) at the start [m/s].
    """
    V = compat.lagrange(on, 2)
    w, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    K = compat.assemble_matrix(compat.compile_form(_stiffness(on, plate, w, v, clamped)))
    M = compat.assemble_matrix(
        compat.compile_form(compat.constant(on, plate.mass) * w * v * ufl.dx)
    )
    n = V.dofmap.index_map.size_local
    points = V.tabulate_dof_coordinates()[:n]
    edges = dolfinx.mesh.locate_entities_boundary(on, 1, lambda x: np.full(x.shape[1], True))
    held = dolfinx.fem.locate_dofs_topological(V, 1, edges)
    ones = M.createVecRight()
    ones.set(1.0)
    area = (M * ones).array / plate.mass  # the integral of each function
    v0 = None if speed is None else np.where(np.isin(np.arange(n), held), 0.0, speed(points))
    return fem.system_from_matrices(
        M,
        None,
        K,
        coordinates=points,
        unknowns=np.column_stack([np.arange(n), np.full(n, 2)]),
        clamped=held[held < n],
        load=-pressure * area,
        v0=v0,
    )


def _stiffness(on: Any, plate: Plate, w: Any, v: Any, clamped: bool) -> Any:
    """Return the form of K."""
    n = ufl.FacetNormal(on)
    D = plate.D
    nu = plate.nu
    slender = ufl.FacetArea(on) / ufl.CellVolume(on)

    def curvature(u: Any) -> Any:
        return ufl.grad(ufl.grad(u))

    def moment(u: Any) -> Any:
        return D * ((1.0 - nu) * curvature(u) + nu * ufl.tr(curvature(u)) * ufl.Identity(2))

    def across(u: Any) -> Any:
        return ufl.dot(n, moment(u) * n)

    def slope(u: Any) -> Any:
        return ufl.dot(ufl.grad(u), n)

    def turned(u: Any) -> Any:  # the slopes of both sides count along their own outward normals
        return slope(u)("+") + slope(u)("-")

    form = (
        ufl.inner(moment(w), curvature(v)) * ufl.dx
        + (
            4.0 * D * ufl.avg(slender) * turned(w) * turned(v)
            - ufl.avg(across(w)) * turned(v)
            - ufl.avg(across(v)) * turned(w)
        )
        * ufl.dS
    )
    if clamped:
        form += (
            4.0 * D * slender * slope(w) * slope(v) - across(w) * slope(v) - across(v) * slope(w)
        ) * ufl.ds
    return form
