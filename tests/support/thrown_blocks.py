"""Two free blocks in space, thrown at each other obliquely and with spin, on meshes that do not
match (dual mortar)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from two_bodies import SOFT, relative, thrown, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.step import Report, find_slipping
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

OPEN, STICKS, SLIPS = range(3)


def thrown_blocks(
    comm: Any,
    *,
    friction: float = 0.0,
    bent: float = 0.0,
    gap: float = 0.0,
    simplices: bool = False,
) -> vc.ContactProblem:
    """Two blocks of rubber, turned out of all axes. ``bent``: curvature [1/m] of the faces between
    them."""
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)

    def placed(x: Array) -> Array:
        a, b = x[:, 0] - 0.9, x[:, 2] - 0.6
        moved = np.column_stack(
            [0.05 * np.sin(4.0 * x[:, 2]), bent * (a**2 + 0.5 * a * b), 0.05 * np.sin(3.0 * a)]
        )
        return np.asarray((x + moved) @ turn.T)

    upper, lower = (
        BlockMesh(lengths=lengths, divisions=divisions, simplices=simplices, deform=placed)
        for lengths, divisions in (((0.8, 0.6, 0.7), (3, 3, 4)), ((1.5, 0.8, 1.2), (5, 3, 4)))
    )
    mesh = TwoBlocks(upper=upper, lower=lower, offset=(0.5, 0.3), gap=gap)
    system, tags = two_blocks(comm, mesh, SOFT)
    surface = fem.contact_pair(
        system, *(tags[side] for side in mesh.interface), matching=fem.DualMortar()
    )
    speed, spin = turn @ [0.6, -1.5, 0.4], turn @ [0.5, 0.8, -0.6]
    middle = turn @ [0.9, 1.1, 0.65]
    system = thrown(
        system, lambda x: 0.1 * np.cross(spin, x), lambda x: speed + np.cross(spin, x - middle)
    )
    return vc.ContactProblem(
        system, surface, **({"friction": vc.Coulomb(friction)} if friction else {})
    )


def rigid_motions(problem: vc.ContactProblem) -> Array:
    """(unknowns of the equations, 6): translations and rotations of both bodies as one."""
    system = problem.system
    turns = [system.space.restrict(np.cross(axis, system.space.points)) for axis in np.eye(3)]
    return np.column_stack([relative(problem, mode) for mode in (*system.influence.T, *turns)])


def status(report: Report) -> NDArray[Any]:
    """What each condition of all ranks does in a step: OPEN, STICKS or SLIPS, as all closed ones do
    if it is smooth."""
    slides = find_slipping(report) if report.problem.frictional else True
    return report.problem.surface.everywhere(
        np.where(report.new.active, np.where(slides, SLIPS, STICKS), OPEN)
    )
