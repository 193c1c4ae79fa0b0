"""A column of P1 elements with two displacement components at every node, standing on a base with
friction.

Node i sits at height y = i H/n; its unknowns are u_x (2 i) and u_y (2 i + 1), which shear and
pressure waves move independently. The base y = 0 may touch the half-space below, so the contact
direction is -y and the basis turns the sign of u_y there. Cross section 1 m². Without finite
element packages: V1.5, V1.6, V2.7 on one process.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from bar import bar_matrices

import vi_contact as vc
from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.laws.materials import LinearElastic

UNIT = LinearElastic(E=2.0, nu=0.0, rho=1.0)  # c_S = 1, c_P = √2


def two_component_system(
    M: Any,
    K_x: Any,
    K_y: Any,
    heights: Array,
    *,
    load: Any = (0.0, 0.0),
    u0: Any = (0.0, 0.0),
    v0: Any = (0.0, 0.0),
) -> SemiDiscreteSystem:
    """Matrices (n, n) of both components into one system; nodal load, u0 and v0 uniform over the
    nodes."""
    n = len(heights)
    x, y = sp.csr_matrix([[1.0, 0.0], [0.0, 0.0]]), sp.csr_matrix([[0.0, 0.0], [0.0, 1.0]])
    every = [np.tile(np.asarray(one, dtype=float), n) for one in (load, u0, v0)]
    return vc.system_from_arrays(
        sp.kron(M, sp.identity(2)),
        None,
        sp.kron(K_x, x) + sp.kron(K_y, y),
        coordinates=np.column_stack([np.zeros(n), heights]),
        load=every[0],
        u0=every[1],
        v0=every[2],
    )


def base(system: SemiDiscreteSystem, *, bilateral: bool = False) -> ContactSurface:
    """Node 0 on the half-space below it."""
    surface = vc.contact_points(system, [0], [0.0, -1.0])
    return surface.bilateral_everywhere() if bilateral else surface


def column(
    n: int = 100,
    *,
    v0: Any,
    height: float = 1.0,
    material: LinearElastic = UNIT,
    held: bool = False,
    **problem: Any,
) -> ContactProblem:
    """The column with the uniform initial velocity v0 (x, y); other keywords go to
    ContactProblem."""
    M, K_x = bar_matrices(n, length=height, E=material.shear_modulus, rho=material.rho)
    _, K_y = bar_matrices(n, length=height, E=material.rho * material.c_p**2, rho=material.rho)
    system = two_component_system(M, K_x, K_y, np.linspace(0.0, height, n + 1), v0=v0)
    return ContactProblem(system, base(system, bilateral=held), **problem)


def rubbing_mass(
    *,
    u0: float,
    kilograms: float = 1.0,
    stiffness: float = 1.0e4,
    normal_force: float = 1.0,
    **problem: Any,
) -> ContactProblem:
    """One mass on a horizontal spring, pressed onto its base (V2.7 iii)."""
    one = sp.csr_matrix([[1.0]])
    system = two_component_system(
        kilograms * one,
        stiffness * one,
        stiffness * one,
        np.zeros(1),
        load=(0.0, -normal_force),
        u0=(u0, 0.0),
    )
    return ContactProblem(system, base(system), **problem)
