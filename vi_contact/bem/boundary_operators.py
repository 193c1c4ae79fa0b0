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
from ..laws.materials import LinearElastic, require_mass
from .boundary_mesh import BoundaryMesh
from .element_pairs import ElementPairs
from .fundamental_solution import KernelSet
from .quadrature import Orders, point_sets

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])  # M u = TURN du/dtau
SLOPE = np.array([-1.0, 1.0])  # derivative of the two shape functions times the length
N_SINGLE = 3  # how many of the stacked integrands belong to the single layer
N_DOUBLE = 8  # and how many, behind them, to the double layer


def check_body(mesh: BoundaryMesh, material: LinearElastic, orders: Orders) -> None:
    """Raise InputError unless a body can be integrated.

    Args:
        mesh: has to be a BoundaryMesh.
        material: has to be LinearElastic, without a damping ratio.
        orders: has to be Orders.
    """
    owner = "boundary elements"
    instance(owner, "the mesh", mesh, BoundaryMesh, "give a BoundaryMesh, for example polygon(...)")
    instance(owner, "the material", material, LinearElastic, "give a LinearElastic")
    instance(owner, "orders", orders, Orders, "give numbers of points, Orders()")
    require_mass(owner, "the material", material)
    if material.xi:
        raise InputError(
            f"{owner}: the material has the damping ratio xi = {material.xi:g}, and they are "
            "elastic without damping; leave xi out"
        )


@dataclass(frozen=True)
class OperatorMatrices:
    """Hold the matrices of the operators V, K and D of n elements.

    Attributes:
        single: (4n, 4n) <V p, psi>.
        double: (4n, 2n) <K u, psi>.
        hyper: (2n, 2n) <D u, v>.
    """

    single: NDArray
    double: NDArray
    hyper: NDArray


class Galerkin:
    """Integrate radial kernels over all pairs of elements of one mesh."""

    def __init__(self, mesh: BoundaryMesh, c_s: float, orders: Orders = Orders()) -> None:
        """Pair the elements.

        Args:
            mesh: the boundary.
            c_s: speed of shear waves [m/s].
            orders: numbers of Gauss points.
        """
        instance("Galerkin", "orders", orders, Orders, "give numbers of points, Orders()")
        number("Galerkin", "the shear wave speed c_s", c_s, positive=True, unit="m/s")
        self.mesh = mesh
        self.shear = c_s**2  # mu of density 1
        self.orders = orders
        self.pairs = ElementPairs(mesh)

    def assemble(
        self, kernels: Callable[[Array], KernelSet], fronts: Sequence[float] = ()
    ) -> OperatorMatrices:
        """Return the matrices of the three operators.

        Args:
            kernels: kernels of density 1 at distances r (m,) [m].
            fronts: distances of their kinks [m]. Beyond the greatest of them they are zero; without
                any they are smooth.
        """
        ends = (N_SINGLE, N_SINGLE + N_DOUBLE)
        single, double, hyper = np.split(self._moments(kernels, fronts), ends)
        return OperatorMatrices(self._single(single), self._double(double), self._hyper(hyper))

    def _moments(self, kernels: Callable, fronts: Sequence[float]) -> NDArray:
        """Return the integrals (k, p, 2, 2) [m²] of the stacked kernels times phi_a(x) phi_b(y)."""
        total: NDArray = np.empty(0)
        for points in point_sets(self.pairs, fronts, self.orders):
            values = integrands(kernels(points.r), points.d, points.r)
            if not len(total):
                total = np.zeros((len(values), len(self.pairs), 4), values.dtype)
            total[:, points.pairs] += points.integrate(values)
        total *= (np.hypot(*self.pairs.a) * np.hypot(*self.pairs.b))[:, None]
        return total.reshape(len(total), -1, 2, 2)

    def _single(self, moments: NDArray) -> NDArray:
        """Return <V p, psi> from the moments (3, p, 2, 2) of G; G is symmetric in x and y."""
        n = len(self.mesh)
        first = self.pairs.first
        second = self.pairs.second
        values = tensor(moments)
        matrix = np.zeros((2, n, 2, 2, n, 2), moments.dtype)
        matrix[:, first, :, :, second] = values.transpose(2, 0, 3, 1, 4)
        matrix[:, second, :, :, first] = values.transpose(2, 0, 4, 1, 3)
        return matrix.reshape(4 * n, 4 * n)

    def _double(self, moments: NDArray) -> NDArray:
        """Return <K u, psi> from the moments (8, p, 2, 2) of ``integrands``.

        With x and y exchanged the four gradients change their sign.
        """
        n = len(self.mesh)
        first = self.pairs.first
        second = self.pairs.second
        signs = np.array([-1, -1, -1, -1, 1, 1, 1, 1])[:, None, None, None]
        exchanged = moments.swapaxes(2, 3) * signs
        local = np.zeros((2, n, 2, 2, n, 2), moments.dtype)
        for x, y, of_pairs in ((first, second, moments), (second, first, exchanged)):
            values = double_local(self.mesh, self.shear, of_pairs, y)
            local[:, x, :, :, y] = values.transpose(2, 0, 3, 1, 4)
        return join_at_nodes(self.mesh, local, 4).reshape(4 * n, 2 * n)

    def _hyper(self, moments: NDArray) -> NDArray:
        """Return <D u, v> from the moments (10, p, 2, 2) of ``integrands``; D is symmetric."""
        n = len(self.mesh)
        first = self.pairs.first
        second = self.pairs.second
        values = self._hyper_local(moments)
        local = np.zeros((2, n, 2, 2, n, 2), moments.dtype)
        for c in range(2):
            for k in range(2):
                local[c, first, :, k, second, :] = values[c, k]
                local[k, second, :, c, first, :] = values[c, k].swapaxes(1, 2)
        joined = join_at_nodes(self.mesh, local, 4)
        return join_at_nodes(self.mesh, joined, 1).reshape(2 * n, 2 * n)

    def _hyper_local(self, m: NDArray) -> NDArray:
        """Return the entries (2, 2, p, 2, 2) of <D u, v> by pairs of elements.

        The axes are: component of v on the first element, component of u on the second, pair, shape
        function of v, shape function of u.
        """
        mesh = self.mesh
        mu = self.shear
        first = self.pairs.first
        second = self.pairs.second
        n_x = mesh.normals[first].T[:, :, None, None]
        n_y = mesh.normals[second].T[:, :, None, None]
        tau_x = mesh.tangents[first].T[:, :, None, None]
        tau_y = mesh.tangents[second].T[:, :, None, None]
        dv = SLOPE[:, None] / mesh.lengths[first][:, None, None]
        du = SLOPE / mesh.lengths[second][:, None, None]

        # Both functions differentiated: 4 mu² Mv.G Mu - 4 mu Phi_S u'.v'.
        phi = m[2].sum((1, 2))[:, None, None]
        g = tensor(m[3:6].sum((2, 3)))[..., None, None]
        turned = TURN.T @ np.moveaxis(g, (0, 1), (-2, -1)) @ TURN

        # One of them differentiated: its derivatives are constant on an element, so that the
        # gradients are summed over its shapes. They are those of Phi_S, then of Phi_P - Phi_S.
        sum_u = m[6:10].sum(3)[..., None]
        sum_v = m[6:10].sum(2)[:, :, None, :]
        across_x = (sum_u[:2] * n_x).sum(0)
        across_y = (sum_v[:2] * n_y).sum(0)
        values = np.empty((2, 2, *m.shape[1:]), m.dtype)
        for c in range(2):
            for k in range(2):
                inertia = -(n_x[c] * n_y[k] * m[0] + tau_x[c] * tau_y[k] * m[1])
                slopes = 4.0 * mu**2 * turned[..., c, k] - (4.0 * mu * phi if c == k else 0.0)
                grad_u = sum_u[2] * TURN[0, k] + sum_u[3] * TURN[1, k]
                grad_v = sum_v[2] * TURN[0, c] + sum_v[3] * TURN[1, c]
                slope_of_u = (TURN[c, k] * across_x + n_x[c] * grad_u) * du
                slope_of_v = (TURN[k, c] * across_y + n_y[k] * grad_v) * dv
                mixed = slope_of_u - slope_of_v
                values[c, k] = inertia + slopes * dv * du + 2.0 * mu * mixed
        return values


def double_local(mesh: BoundaryMesh, shear: float, m: NDArray, y: NDArray[np.int64]) -> NDArray:
    """Return the entries (2, 2, p, a, 2) of <K u, psi> by pairs of elements.

    The axes are: component of K u, component of u, pair, shape function of x, shape function of y.

    Args:
        mesh: the boundary.
        shear: c_S² [m²/s²].
        m: (8, p, a, 2), moments of the stacked kernels of the double layer.
        y: (p,), elements on which y is.
    """
    normal = mesh.normals[y].T[:, :, None, None]
    slopes = SLOPE / mesh.lengths[y][:, None, None]

    # What meets M u is summed over the shapes of u, whose derivatives are constant on an element.
    phi = m[4].sum(2)[..., None]
    g = tensor(m[5:8].sum(3))[..., None]
    by_normal = (m[0:2] * normal).sum(0)
    values = np.empty((2, 2, *m.shape[1:]), m.dtype)
    for c in range(2):
        for k in range(2):
            along = -TURN[c, k] * phi + 2.0 * shear * (g[c, 0] * TURN[0, k] + g[c, 1] * TURN[1, k])
            values[c, k] = along * slopes - m[2 + c] * normal[k]
            if c == k:
                values[c, k] -= by_normal
    return values


def join_at_nodes(mesh: BoundaryMesh, local: NDArray, axis: int) -> NDArray:
    """Add up entries of shape functions at the nodes, where two elements meet.

    Args:
        mesh: the boundary.
        local: entries, by elements on an axis and by the two ends on the next one, which goes.
        axis: number of the axis of the elements.
    """
    start = np.take(local, 0, axis + 1)
    end = np.take(local, 1, axis + 1)
    before = np.empty_like(mesh.after)
    before[mesh.after] = np.arange(len(before))
    return start + np.take(end, before, axis)


def tensor(m: NDArray) -> NDArray:
    """Return the symmetric tensor (2, 2, ...) of its components xx, xy, yy (3, ...)."""
    return np.stack([np.stack([m[0], m[1]]), np.stack([m[1], m[2]])])


def integrands(kernels: KernelSet, d: Array, r: Array) -> NDArray:
    """Return the integrands (k, m) of the operators, those of V, then of K, then of D.

    Args:
        kernels: radial functions at m distances.
        d: (2, m), x - y [m].
        r: (m,), its length [m].
    """
    # G = g1 I - g2 r̂ r̂ᵀ by its components xx, xy, yy. Gradients are d times a function of r.
    xx = d[0] ** 2 / r**2
    xy = d[0] * d[1] / r**2
    yy = d[1] ** 2 / r**2
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
