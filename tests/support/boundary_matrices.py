"""Matrices V, K, D of a mesh for the material of ``plane_waves`` (density 1): at a frequency, or in
time up to t."""

from __future__ import annotations

from laplace_kernels import LaplaceKernels
from plane_waves import MATERIAL

from vi_contact.bem import BoundaryMesh, Galerkin, OperatorMatrices, Orders, TimeKernels


def laplace(mesh: BoundaryMesh, s: complex, orders: Orders = Orders()) -> OperatorMatrices:
    """S(s) = (M/2 + K)ᵀ V⁻¹ (M/2 + K) - D maps nodal displacements to nodal forces."""
    return Galerkin(mesh, MATERIAL.c_s, orders).assemble(
        LaplaceKernels(s, MATERIAL.c_p, MATERIAL.c_s)
    )


def in_time(mesh: BoundaryMesh, t: float, orders: Orders = Orders()) -> OperatorMatrices:
    """V integrated once in time, K twice, D three times."""
    c_p, c_s = MATERIAL.c_p, MATERIAL.c_s
    return Galerkin(mesh, c_s, orders).assemble(TimeKernels(t, c_p, c_s), (c_s * t, c_p * t))
