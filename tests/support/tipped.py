"""A soft block that tips onto a plane with friction: open, sticking and slipping points in one
step."""

from __future__ import annotations

from typing import Any

import numpy as np
from fem_problems import block, turned

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass
from vi_contact.laws.materials import LinearElastic

POINTS = 13
ROUGH_ON_ONE_SIDE = [
    Coulomb(tuple(np.linspace(0.0, 1.2, POINTS))),
    Tresca(tuple(np.linspace(0.0, 2e4, POINTS))),
]
RUBBER = LinearElastic(E=1.0e6, nu=0.3, rho=1000.0)


def tipped(comm: Any, friction: FrictionLaw, *, simplices: bool, angle: float) -> ContactProblem:
    """A soft rectangle that lands on one corner, turning and gliding, on a plane that gets rougher
    on one side."""
    mesh, tags = block(
        comm, lengths=(1.5, 1.0), divisions=(POINTS - 1, 6), angle=angle, simplices=simplices
    )
    down, along = turned((0.0, -1.0), angle), turned((1.0, 0.0), angle)

    def throw(x: Any) -> Any:
        return np.outer(2.0 + x @ along, down) + np.outer(np.full(len(x), 0.5), along)

    system = assemble(mesh, RUBBER, loads=BodyForce(tuple(9.81e3 * down)), initial_velocity=throw)
    plane = HalfSpace(point=tuple(1e-3 * down), normal=tuple(-down))
    surface = contact_surface(system, tags["bottom"], obstacle=plane)
    return ContactProblem(system, surface, friction=friction, mass=ConsistentMass())
