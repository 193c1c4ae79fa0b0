"""Assemble Galerkin matrices for many complex frequencies: radial functions interpolated, geometry
integrated once.

On each panel of distances a function f(r) is the polynomial through its values at Chebyshev points
r_q, so every integral of the Galerkin layer is a fixed sum over the points:

    ∫∫ f(r) a(x, y) phi_i(x) phi_j(y) = sum_q [∫∫ L_q(r) a(x, y) phi_i phi_j] f(r_q).

The brackets are sparse matrices that depend on the mesh alone. A frequency then costs some hundred
Bessel functions and one sparse product. Panels are dyadic towards r = 0, where the functions are
logarithmic (the pole -1/(2 pi r²) of Phi_S'/r is integrated on its own), and of equal width further
out, where they are like exp(-s r/c_S).
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.boundary_operators import Galerkin
from vi_contact.bem.fundamental_solution import TWO_PI, KernelSet
from vi_contact.bem.quadrature import Orders, point_sets
from vi_contact.core.algebra import Array
from vi_contact.core.checks import check_count, number

POINTS = 16  # Chebyshev points of a panel
PANELS = 100_000  # of equal width
INNERMOST = 1e-9  # end of the dyadic panels, relative to the shortest element


class RadialTable(Galerkin):
    """Integrate kernels without fronts, interpolated on panels of distance no wider than `width`
    [m].

    `assemble(LaplaceKernels(s, c_p, c_s))` as before, with all three operators. Memory: 10 kB per
    pair of elements.
    """

    def __init__(
        self, mesh: BoundaryMesh, c_s: float, width: float, orders: Orders = Orders()
    ) -> None:
        super().__init__(mesh, c_s, orders)
        number("RadialTable", "the width of its panels", width, positive=True, unit="m")
        far = float(self.pairs.r_max.max())
        check_count("RadialTable", "the width of its panels", far / width, "panels", most=PANELS)
        dyadic = width * 0.5 ** np.arange(
            np.ceil(np.log2(width / (INNERMOST * mesh.lengths.min()))), 0.0, -1.0
        )
        self.edges: Array = np.concatenate(
            [dyadic, width * np.arange(1.0, np.ceil(far / width * (1.0 + 1e-9)) + 1.0)]
        )
        reference = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        self._to_coefficients = np.linalg.inv(chebvander(reference, POINTS - 1))
        self.nodes: Array = (
            self.edges[:-1, None] + np.diff(self.edges)[:, None] * 0.5 * (1.0 + reference)
        ).ravel()
        self._matrices, self._pole = self._integrated()

    def interpolation(self, r: Array) -> csr_matrix:
        """Return (m, nodes) matrix that takes values at the nodes to values at distances r (m,)."""
        panel = np.clip(np.searchsorted(self.edges, r) - 1, 0, len(self.edges) - 2)
        low, high = self.edges[panel], self.edges[panel + 1]
        weights = (
            chebvander((2.0 * r - low - high) / (high - low), POINTS - 1) @ self._to_coefficients
        )
        columns = panel[:, None] * POINTS + np.arange(POINTS)
        rows = np.arange(0, weights.size + 1, POINTS)
        return csr_matrix((weights.ravel(), columns.ravel(), rows), shape=(len(r), len(self.nodes)))

    def _integrated(self) -> tuple[list[csr_matrix], Array]:
        """Return (4 pairs, nodes) for factors 1, d_x²/r², d_x d_y/r², d_y²/r², d_x, d_y; the pole's
        two integrals."""
        blocks: list[list[csr_matrix]] = [[] for _ in range(6)]
        poles, order = [], []
        for points in point_sets(self.pairs, (), self.orders):
            shapes, inverse = points.shapes(), 1.0 / points.r**2
            interpolation = self.interpolation(points.r)
            x, y = points.d
            factors = (np.ones_like(inverse), x**2 * inverse, x * y * inverse, y**2 * inverse, x, y)
            for block, factor in zip(blocks, factors, strict=True):
                block.append(shapes.multiply(factor).tocsr() @ interpolation)
            poles.append(np.stack([shapes @ (-d * inverse / TWO_PI) for d in points.d]))
            order.append((4 * points.pairs[:, None] + np.arange(4)).ravel())
        back = np.argsort(np.concatenate(order))
        jacobian = np.repeat(np.hypot(*self.pairs.a) * np.hypot(*self.pairs.b), 4)
        matrices = [
            vstack(block).tocsr()[back].multiply(jacobian[:, None]).tocsr() for block in blocks
        ]
        return matrices, np.concatenate(poles, axis=1)[:, back] * jacobian

    def _moments(self, kernels: Callable, fronts: Sequence[float]) -> NDArray:
        kernel_set: KernelSet = kernels(self.nodes)
        assert not len(fronts)
        phi, dphi, ddiff, g1, g2, inertia_p, inertia_s = kernel_set.hyper
        one, xx, xy, yy, d_x, d_y = self._matrices
        smooth = dphi + 1.0 / (TWO_PI * self.nodes**2)
        phi, inertia_p, inertia_s, isotropic = _product(one, [phi, inertia_p, inertia_s, g1])
        tensor = [
            isotropic - _product(xx, [g2])[0],
            -_product(xy, [g2])[0],
            isotropic - _product(yy, [g2])[0],
        ]
        along = [_product(d, [smooth, ddiff]) for d in (d_x, d_y)]
        normal = [along[0][0] + self._pole[0], along[1][0] + self._pole[1]]
        gradient = [along[0][1], along[1][1]]
        rows = [
            *tensor,
            *normal,
            *gradient,
            phi,
            *tensor,
            inertia_p,
            inertia_s,
            phi,
            *tensor,
            *normal,
            *gradient,
        ]
        return np.stack(rows).reshape(len(rows), -1, 2, 2)


def _product(matrix: csr_matrix, columns: list[NDArray]) -> NDArray:
    """Multiply a real matrix by k complex columns, without a complex copy of the matrix: (k,
    rows)."""
    values = np.ascontiguousarray(np.stack(columns, axis=1), complex)
    return np.asarray(matrix @ values.view(float)).view(complex).T
