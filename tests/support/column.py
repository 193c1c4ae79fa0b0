"""A column of P1 elements with two displacement components at every node, standing on a base with friction.

Node i sits at height y = i H/n; its unknowns are u_x (2 i) and u_y (2 i + 1), which shear and pressure waves move
independently. The base y = 0 may touch the half-space below, so the contact direction is -y and the basis turns the
sign of u_y there. Cross section 1 m². Without finite element packages: V1.5, V1.6, V2.7 on one process.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from bar import bar_matrices

from vi_contact.core.algebra import Array, SerialAlgebra, SerialComm, SerialMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import Load, SemiDiscreteSystem
from vi_contact.laws.materials import LinearElastic

UNIT = LinearElastic(E=2.0, nu=0.0, rho=1.0)  # c_S = 1, c_P = √2


@dataclass(frozen=True)
class ColumnSpace:
    """Two unknowns at every height."""

    heights: Array
    dimension: int = 2

    @property
    def unknowns(self) -> int:
        return 2 * len(self.heights)

    @property
    def ids(self) -> Any:
        return np.arange(self.unknowns)

    @property
    def coordinates(self) -> Array:
        return np.column_stack([np.zeros(self.unknowns), np.repeat(self.heights, 2)])

    @property
    def bodies(self) -> Any:
        return np.zeros(self.unknowns, dtype=np.int64)

    def find_nodes(self, points: Array) -> Any:
        return np.argmin(np.abs(np.asarray(points)[:, 1][:, None] - self.heights), axis=1)

    def sample(self, u: Array, nodes: Any, t: float, derivative: int = 0) -> Array:
        return np.asarray(u).reshape(-1, 2)[nodes]


def two_component_system(
    M: Any, K_x: Any, K_y: Any, heights: Array, *, load: Any = (0.0, 0.0), u0: Any = (0.0, 0.0), v0: Any = (0.0, 0.0)
) -> SemiDiscreteSystem:
    """Matrices (n, n) of both components into one system; nodal load, u0 and v0 uniform over the nodes."""
    n = len(heights)
    x, y = sp.csr_matrix([[1.0, 0.0], [0.0, 0.0]]), sp.csr_matrix([[0.0, 0.0], [0.0, 1.0]])
    return SemiDiscreteSystem(
        algebra=SerialAlgebra(),
        M=SerialMatrix(sp.kron(M, sp.identity(2))),
        C=None,
        K=SerialMatrix(sp.kron(K_x, x) + sp.kron(K_y, y)),
        load=Load(np.tile(np.asarray(load, dtype=float), n)),
        influence=np.tile(np.eye(2), (n, 1)),
        u0=np.tile(np.asarray(u0, dtype=float), n),
        v0=np.tile(np.asarray(v0, dtype=float), n),
        space=ColumnSpace(heights),
        floating=True,
    )


def base(rows: int, *, bilateral: bool = False) -> ContactSurface:
    """Node 0 on the half-space below it."""
    direction = np.ones(rows)
    direction[1] = -1.0
    return ContactSurface(
        comm=SerialComm(),
        points=np.zeros((1, 2)),
        normals=np.array([[0.0, -1.0]]),
        weights=np.ones(1),
        gap0=np.zeros(1),
        bilateral=np.array([bilateral]),
        compliance=np.zeros(1),
        owned=np.array([1]),
        slots=np.array([0]),
        tangents=np.array([[0]]),
        basis=SerialMatrix(sp.diags(direction)),
    )


def column(
    n: int = 100, *, v0: Any, height: float = 1.0, material: LinearElastic = UNIT, held: bool = False, **problem: Any
) -> ContactProblem:
    """The column with the uniform initial velocity v0 (x, y); other keywords go to ContactProblem."""
    M, K_x = bar_matrices(n, length=height, E=material.shear_modulus, rho=material.rho)
    _, K_y = bar_matrices(n, length=height, E=material.rho * material.c_p**2, rho=material.rho)
    system = two_component_system(M, K_x, K_y, np.linspace(0.0, height, n + 1), v0=v0)
    return ContactProblem(system, base(2 * n + 2, bilateral=held), **problem)


def rubbing_mass(
    *, u0: float, kilograms: float = 1.0, stiffness: float = 1.0e4, normal_force: float = 1.0, **problem: Any
) -> ContactProblem:
    """One mass on a horizontal spring, pressed onto its base (V2.7 iii)."""
    one = sp.csr_matrix([[1.0]])
    system = two_component_system(
        kilograms * one, stiffness * one, stiffness * one, np.zeros(1), load=(0.0, -normal_force), u0=(u0, 0.0)
    )
    return ContactProblem(replace(system, floating=False), base(2), **problem)
