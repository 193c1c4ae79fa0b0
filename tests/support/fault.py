"""Two elastic half planes with a fault between them, prestressed as TPV205 is in the plane."""

from __future__ import annotations

from typing import Any

import numpy as np

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.meshes import BlockMesh, TwoBlocks

C_P, C_S, RHO = 6000.0, 3464.0, 2670.0  # m/s, m/s, kg/m³
SHEAR = RHO * C_S**2
NU = (C_P**2 - 2.0 * C_S**2) / (2.0 * (C_P**2 - C_S**2))
ROCK = vc.LinearElastic(E=2.0 * SHEAR * (1.0 + NU), nu=NU, rho=RHO)
SIGMA, KINETIC, DISTANCE = 120e6, 0.525, 0.5  # Pa, -, m
HALF, DEPTH = 18e3, 9e3  # m of each half plane


def fault(comm: Any, h: float, matching: Any = None) -> vc.ContactProblem:
    """The fault, 36 km long with its middle at x = HALF, on squares of edge h [m]."""
    rock = BlockMesh(
        lengths=(2.0 * HALF, DEPTH), divisions=(round(2.0 * HALF / h), round(DEPTH / h))
    )
    blocks = TwoBlocks(lower=rock, upper=rock)
    mesh, tags = fem.build_mesh(blocks, comm)
    upper, lower = blocks.interface
    sides = ("lower_left", "lower_right", "lower_bottom", "upper_left", "upper_right", "upper_top")
    system = fem.assemble(mesh, ROCK, dashpots=[fem.Dashpots(tags[side]) for side in sides])
    surface = fem.contact_pair(system, tags[upper], tags[lower], matching=matching)
    joint = laws.SlipWeakening(
        static=lambda x: np.where(np.abs(x[:, 0] - HALF) < 10e3, 0.677, 1e4),
        kinetic=KINETIC,
        distance=DISTANCE,
        prestress=laws.Prestress(
            normal=SIGMA,
            shear=lambda x: np.where(np.abs(x[:, 0] - HALF) < 1600.0, 82e6, 71e6),
            nucleate=True,
        ),
    )
    return vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())
