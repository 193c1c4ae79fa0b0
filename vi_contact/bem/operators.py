"""Build the matrices of one body: at a complex frequency, or integrated in time up to a time t."""

from __future__ import annotations

from ..core.checks import instance, number
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .boundary_operators import Galerkin, OperatorMatrices
from .fundamental_solution import LaplaceKernels, TimeKernels
from .quadrature import Orders


def check_body(mesh: BoundaryMesh, material: LinearElastic, orders: Orders) -> None:
    """Raise InputError unless these are a boundary mesh, a material and numbers of points."""
    owner = "boundary elements"
    instance(owner, "the mesh", mesh, BoundaryMesh, "give a BoundaryMesh, for example polygon(...)")
    instance(owner, "the material", material, LinearElastic, "give a LinearElastic")
    instance(owner, "orders", orders, Orders, "give numbers of points, Orders()")


class Operators:
    """Build single layer V, double layer K and hypersingular D of a body in plane strain, per metre of thickness.

    mesh: its boundary; material: its wave speeds and density. The radial kernels see speeds only; the density rho
    enters as V/rho, K, rho D.
    """

    def __init__(self, mesh: BoundaryMesh, material: LinearElastic, orders: Orders = Orders()) -> None:
        check_body(mesh, material, orders)
        self.mesh, self.material = mesh, material
        self.c_p, self.c_s = material.c_p, material.c_s
        self.galerkin = Galerkin(mesh, self.c_s, orders)

    def laplace(self, s: complex) -> OperatorMatrices:
        """Return V(s), K(s), D(s), Re s > 0 [1/s]; S(s) = (M/2 + K)ᵀ V⁻¹ (M/2 + K) - D maps nodal u to nodal forces."""
        return self.with_density(self.galerkin.assemble(LaplaceKernels(s, self.c_p, self.c_s)))

    def in_time(self, t: float, *, hyper: bool = True) -> OperatorMatrices:
        """Return A = V integrated once in time, B = K twice, C = D three times, up to t > 0 [s]."""
        return self.with_density(self.unit_in_time(t, hyper=hyper))

    def unit_in_time(self, t: float, *, hyper: bool = True) -> OperatorMatrices:
        """Return the matrices in time for density 1."""
        number("Operators", "the time t", t, positive=True, unit="s")
        kernels = TimeKernels(t, self.c_p, self.c_s, hyper)
        return self.galerkin.assemble(kernels, (self.c_s * t, self.c_p * t))

    def with_density(self, unit: OperatorMatrices) -> OperatorMatrices:
        """Turn matrices of density 1 into those of the material."""
        rho = self.material.rho
        return OperatorMatrices(
            None if unit.single is None else unit.single / rho,
            unit.double,
            None if unit.hyper is None else unit.hyper * rho,
        )
