"""Stand a column under its weight."""

from __future__ import annotations

import numpy as np
from fem_problems import CONCRETE, block, turned
from mpi4py import MPI

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.materials import LinearElastic

COMM = MPI.COMM_WORLD
G = 9.80665
COLUMN = LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)


def standing(
    *,
    material: LinearElastic = CONCRETE,
    lengths: tuple[float, ...] = (1.0, 3.0),
    divisions: tuple[int, ...] = (4, 10),
    gap: float = 0.0,
    angle: float = 0.0,
    push: float = 0.0,
    points: list[tuple[float, ...]] | None = None,
    held: bool = False,
    start: tuple[float, ...] | None = None,
    up: bool = False,
    simplices: bool = False,
) -> ContactProblem:
    """A block on the ground under its weight; ``push`` [Pa] along x on its top, ``held``: u_x = 0
    at its bottom."""
    d = len(lengths)
    mesh, tags = block(COMM, lengths=lengths, divisions=divisions, angle=angle, simplices=simplices)
    normal = np.zeros(d)
    normal[:2] = turned((0.0, 1.0), angle)
    weight = material.rho * G * (normal if up else -normal)
    along = np.eye(d)[0]
    system = assemble(
        mesh,
        material,
        loads=(BodyForce(tuple(weight)), Traction(tags["top"], tuple(push * along))),
        prescribed=Prescribed(tags["bottom"], components=(0,)) if held else (),
        initial_displacement=start,
    )
    assert system.floating
    ground = HalfSpace(point=tuple(-gap * normal), normal=tuple(normal))
    return ContactProblem(
        system, contact_surface(system, tags["bottom"], obstacle=ground, points=points)
    )
