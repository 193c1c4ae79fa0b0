"""Build the Galerkin matrices of the four boundary operators.

They come from radial kernels of either domain, for density 1.

With M u = d/dtau (-u_2, u_1), mu = c_S², x - y = d and normals n_x, n_y (regularised as in
docs/theory/bem.md; nothing is worse than a logarithm on a closed curve):

    V p  = ∫ G p                                                                  single layer
    K u  = ∫ dPhi_S/dn_y u - Phi_S M u                                            double layer
           + grad_y(Phi_P - Phi_S) (n_y.u) + 2 mu G M u
    <K' p, v> = <p, K v>                                                          adjoint
    <D u, v> = ∫∫ - [inertia_P (n_x.v)(n_y.u) + inertia_S (tau_x.v)(tau_y.u)]     hypersingular
                - 4 mu Phi_S u'.v' + 4 mu² Mv.G Mu
               + 2 mu [(v.Mu) dPhi_S/dn_x + (u.Mv) dPhi_S/dn_y]
               + 2 mu [(n_x.v) grad_x(Phi_P - Phi_S).Mu + (n_y.u) grad_y(Phi_P - Phi_S).Mv]

in u/2 = V p - K u and p/2 = K' p - D u. For density rho: V/rho, K, rho D.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array
from ..core.checks import instance, number
from ..core.errors import InputError
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .element_pairs import ElementPairs
from .fundamental_solution import KernelSet
from .quadrature import Orders, point_sets

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])  # M u = TURN du/dtau
SLOPE = np.array([-1.0, 1.0])  # derivative of the two shape functions times the length
N_SINGLE, N_DOUBLE = 3, 8


def check_body(mesh: BoundaryMesh, material: LinearElastic, orders: Orders) -> None:
    """Raise InputError unless these are a boundary mesh, a material and numbers of points."""
    owner = "boundary elements"
    instance(owner, "the mesh", mesh, BoundaryMesh, "give a BoundaryMesh, for example polygon(...)")
    instance(owner, "the material", material, LinearElastic, "give a LinearElastic")
    instance(owner, "orders", orders, Orders, "give numbers of points, Orders()")
    if material.xi:
        raise InputError(
            f"{owner}: the material has the damping ratio xi = {material.xi:g}, and they are "
            "elastic without damping; leave xi out"
        )


@dataclass(frozen=True)
class OperatorMatrices:
    """Hold single (4n, 4n) <V p, psi>, double (4n, 2n) <K u, psi>, hyper (2n, 2n) <D u, v>."""

    single: NDArray
    double: NDArray
    hyper: NDArray


class Galerkin:
    """Integrate radial kernels over all pairs of elements of one mesh.

    kernels(r (m,)) -> KernelSet: of density 1, speeds (c_p, c_s); fronts: distances [m] of kinks,
    the last their end.
    """

    def __init__(self, mesh: BoundaryMesh, c_s: float, orders: Orders = Orders()) -> None:
        instance("Galerkin", "orders", orders, Orders, "give numbers of points, Orders()")
        number("Galerkin", "the shear wave speed c_s", c_s, positive=True, unit="m/s")
        self.mesh, self.shear, self.orders = mesh, c_s**2, orders
        self.pairs = ElementPairs(mesh)

    def assemble(
        self, kernels: Callable[[Array], KernelSet], fronts: Sequence[float] = ()
    ) -> OperatorMatrices:
        """Return the matrices of the three operators."""
        single, double, hyper = np.split(
            self._moments(kernels, fronts), (N_SINGLE, N_SINGLE + N_DOUBLE)
        )
        return OperatorMatrices(self._single(single), self._double(double), self._hyper(hyper))

    def _moments(self, kernels: Callable, fronts: Sequence[float]) -> NDArray:
        """Return (k, pairs, 2, 2) integrals [m²] of the stacked kernels.

        They are taken against phi_a(x) phi_b(y).
        """
        total: NDArray = np.empty(0)
        for points in point_sets(self.pairs, fronts, self.orders):
            values = integrands(kernels(points.r), points.d, points.r)
            if not len(total):
                total = np.zeros((len(values), len(self.pairs), 4), values.dtype)
            total[:, points.pairs] += points.integrate(values)
        total *= (np.hypot(*self.pairs.a) * np.hypot(*self.pairs.b))[:, None]
        return total.reshape(len(total), -1, 2, 2)

    def _single(self, moments: NDArray) -> NDArray:
        n, e, f = len(self.mesh), self.pairs.first, self.pairs.second
        matrix, values = np.zeros((2, n, 2, 2, n, 2), moments.dtype), tensor(moments)
        matrix[:, e, :, :, f] = values.transpose(2, 0, 3, 1, 4)
        matrix[:, f, :, :, e] = values.transpose(2, 0, 4, 1, 3)
        return matrix.reshape(4 * n, 4 * n)

    def _double(self, moments: NDArray) -> NDArray:
        n, e, f = len(self.mesh), self.pairs.first, self.pairs.second
        local = np.zeros((2, n, 2, 2, n, 2), moments.dtype)
        swapped = (
            moments.swapaxes(2, 3) * np.array([-1, -1, -1, -1, 1, 1, 1, 1])[:, None, None, None]
        )
        for x, y, m in ((e, f, moments), (f, e, swapped)):
            local[:, x, :, :, y] = double_local(self.mesh, self.shear, m, y).transpose(
                2, 0, 3, 1, 4
            )
        return joined_at_nodes(self.mesh, local, 4).reshape(4 * n, 2 * n)

    def _hyper(self, moments: NDArray) -> NDArray:
        n, e, f = len(self.mesh), self.pairs.first, self.pairs.second
        local, values = np.zeros((2, n, 2, 2, n, 2), moments.dtype), self._hyper_local(moments)
        for c in range(2):
            for k in range(2):
                local[c, e, :, k, f, :] = values[c, k]
                local[k, f, :, c, e, :] = values[c, k].swapaxes(1, 2)
        return joined_at_nodes(self.mesh, joined_at_nodes(self.mesh, local, 4), 1).reshape(
            2 * n, 2 * n
        )

    def _hyper_local(self, m: NDArray) -> NDArray:
        """Return (2, 2, p, 2, 2).

        The axes are: component of v on the first element, of u on the second, pair, shape of v, of
        u.
        """
        mesh, e, f = self.mesh, self.pairs.first, self.pairs.second
        n_x, n_y = mesh.normals[e].T[:, :, None, None], mesh.normals[f].T[:, :, None, None]
        t_x, t_y = mesh.tangents[e].T[:, :, None, None], mesh.tangents[f].T[:, :, None, None]
        dv = SLOPE[:, None] / mesh.lengths[e][:, None, None]
        du = SLOPE / mesh.lengths[f][:, None, None]
        phi, g = m[2].sum((1, 2))[:, None, None], tensor(m[3:6].sum((2, 3)))[..., None, None]
        # summed over shapes of u; of v
        sum_u, sum_v = (m[6:10].sum(3)[..., None], m[6:10].sum(2)[:, :, None, :])
        across_x, across_y = (sum_u[:2] * n_x).sum(0), (sum_v[:2] * n_y).sum(0)
        mu, turned = self.shear, TURN.T @ np.moveaxis(g, (0, 1), (-2, -1)) @ TURN
        values = np.empty((2, 2, *m.shape[1:]), m.dtype)
        for c in range(2):
            for k in range(2):
                one = -(n_x[c] * n_y[k] * m[0] + t_x[c] * t_y[k] * m[1])
                two = 4.0 * mu**2 * turned[..., c, k] - (4.0 * mu * phi if c == k else 0.0)
                grad_u = sum_u[2] * TURN[0, k] + sum_u[3] * TURN[1, k]
                grad_v = sum_v[2] * TURN[0, c] + sum_v[3] * TURN[1, c]
                three = (TURN[c, k] * across_x + n_x[c] * grad_u) * du - (
                    TURN[k, c] * across_y + n_y[k] * grad_v
                ) * dv
                values[c, k] = one + two * dv * du + 2.0 * mu * three
        return values


def double_local(mesh: BoundaryMesh, shear: float, m: NDArray, y: NDArray[np.int64]) -> NDArray:
    """Return (2, 2, p, a, 2).

    The axes are: component of K u, component of u, pair, shape function of x, of y on the elements
    y (p,).

    m: (8, p, a, 2) moments of the stacked kernels of the double layer; shear: c_S².
    """
    normal, slopes = mesh.normals[y].T[:, :, None, None], SLOPE / mesh.lengths[y][:, None, None]
    phi, g = m[4].sum(2)[..., None], tensor(m[5:8].sum(3))[..., None]
    by_normal = (m[0:2] * normal).sum(0)
    values = np.empty((2, 2, *m.shape[1:]), m.dtype)
    for c in range(2):
        for k in range(2):
            along = -TURN[c, k] * phi + 2.0 * shear * (g[c, 0] * TURN[0, k] + g[c, 1] * TURN[1, k])
            values[c, k] = along * slopes - m[2 + c] * normal[k]
            if c == k:
                values[c, k] -= by_normal
    return values


def joined_at_nodes(mesh: BoundaryMesh, local: NDArray, axis: int) -> NDArray:
    """Add up shape functions (element at `axis`, end at axis + 1) at the nodes.

    The end axis goes.
    """
    start, end = np.take(local, 0, axis + 1), np.take(local, 1, axis + 1)
    before = np.empty_like(mesh.after)
    before[mesh.after] = np.arange(len(before))
    return start + np.take(end, before, axis)


def tensor(m: NDArray) -> NDArray:
    """Return (2, 2, ...) from the components xx, xy, yy."""
    return np.stack([np.stack([m[0], m[1]]), np.stack([m[1], m[2]])])


def integrands(kernels: KernelSet, d: Array, r: Array) -> NDArray:
    """Return (k, m) integrands of the operators at d = x - y.

    They come in the order their methods read them.
    """
    xx, xy, yy = d[0] ** 2 / r**2, d[0] * d[1] / r**2, d[1] ** 2 / r**2
    g1, g2 = kernels.single
    rows = [g1 - g2 * xx, -g2 * xy, g1 - g2 * yy]
    phi, dphi, ddiff, g1, g2 = kernels.double
    rows += [
        dphi * d[0],
        dphi * d[1],
        ddiff * d[0],
        ddiff * d[1],
        phi,
        g1 - g2 * xx,
        -g2 * xy,
        g1 - g2 * yy,
    ]
    phi, dphi, ddiff, g1, g2, inertia_p, inertia_s = kernels.hyper
    rows += [
        inertia_p,
        inertia_s,
        phi,
        g1 - g2 * xx,
        -g2 * xy,
        g1 - g2 * yy,
        dphi * d[0],
        dphi * d[1],
        ddiff * d[0],
        ddiff * d[1],
    ]
    return np.stack(rows)
