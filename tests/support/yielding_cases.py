"""Bodies that yield, which several tests share: a block thrown on rough ground, and one at rest."""

from __future__ import annotations

from typing import Any

import vi_contact as vc
from vi_contact import fem
from vi_contact.laws import J2, DruckerPrager, Iwan, MohrCoulomb
from vi_contact.meshes.block import BlockMesh

STEEL = J2(200e9, 0.3, 7800.0, 250e6, isotropic=2e9, kinematic=4e9)
SOIL = MohrCoulomb(50e6, 0.3, 1900.0, cohesion=10e3, phi=30.0, psi=10.0)
SMOOTH_SOIL = DruckerPrager(50e6, 0.3, 1900.0, cohesion=10e3, phi=30.0, psi=10.0)
SHAKEN_SOIL = Iwan(
    50e6,
    0.3,
    1900.0,
    curve=[(1e-4 * 2.0**k, 1.0 / (1.0 + 0.5 * 2.0**k)) for k in range(-3, 8)],
)
LAWS: dict[str, Any] = {
    "J2": STEEL,
    "MohrCoulomb": SOIL,
    "DruckerPrager": SMOOTH_SOIL,
    "Iwan": SHAKEN_SOIL,
}
SPEEDS = {"J2": (6.0, -20.0), "MohrCoulomb": (1.0, -2.0), "DruckerPrager": (1.0, -2.0)}


def throw(
    comm: Any, law: str = "J2", *, n: int = 4, mu: float = 0.3, degree: int = 1, **more: Any
) -> vc.ContactProblem:
    """A block 0.5 m wide and 1 m high, thrown obliquely on the ground below it."""
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(0.5, 1.0), divisions=(n, 2 * n), simplices=degree == 2), comm
    )
    system = fem.assemble(
        mesh,
        LAWS[law],
        degree=degree,
        integration="full" if degree == 2 else "bbar",
        initial_velocity=SPEEDS.get(law, (1.0, -2.0)),
        **more,
    )
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    friction = vc.Coulomb(mu) if mu else None
    given = {} if friction is None else {"friction": friction}
    return vc.ContactProblem(system, surface, **given)


def step_of(law: str, n: int = 4) -> float:
    """A time step [s] in which a wave crosses about two elements of the block."""
    return 2.0 * (0.5 / n) / float(LAWS[law].elastic.c_p)
