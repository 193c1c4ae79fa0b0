"""Steps of contact on finite elements that every solver must agree on, on any number of ranks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from fem_problems import block, shaken_wall, thrown_box, turned
from mpi4py import MPI
from two_bodies import SOFT, blocks, thrown, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.laws.friction import ExponentialDecay, SlipRateCoulomb

COMM = MPI.COMM_WORLD
WEAKENING = SlipRateCoulomb(ExponentialDecay(0.5, 0.3, 2.0))  # mu falls from 0.5 to 0.3


def wall(**how: Any) -> vc.ContactProblem:
    """The shaken wall, under motion that closes about half of its points."""
    return replace(shaken_wall(COMM, simplices=True, **how), impact=None)


def on_rollers(d: int) -> vc.ContactProblem:
    """A quarter of a block between two symmetry planes, whose nodes keep some of their components,
    thrown down."""
    mesh, tags = block(COMM, lengths=(1.5, 1.0, 1.2)[:d], divisions=(4, 3, 3)[:d])
    planes = [("left", 0), ("back", 2)][: d - 1]
    held = [fem.Prescribed(tags[name], components=(c,)) for name, c in planes]
    speed = (0.0, -1.0, 0.0)[:d]
    system = fem.assemble(mesh, SOFT, prescribed=held, initial_velocity=speed)
    wavy = vc.AnalyticGap(lambda x: 1e-3 * (1.0 + np.sin(7.0 * x[:, 0])))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=wavy)
    return vc.ContactProblem(system, surface, mass=vc.ConsistentMass())


def pair(d: int, **how: Any) -> vc.ContactProblem:
    """Two blocks thrown at one another, obliquely; unknowns of the contact are relative ones."""
    mesh = blocks(d, angle=0.4, simplices=True, gap=1e-4, upper=(3, 2, 2), lower=(3, 2, 2))
    system, tags = two_blocks(COMM, mesh)
    down = np.append(turned((0.0, -1.0), 0.4), np.zeros(d - 2))
    system = thrown(system, lambda x: 0.0 * x, lambda x: 0.0 * x + down)
    one, two = (tags[side] for side in mesh.interface)
    return vc.ContactProblem(
        system, fem.contact_pair(system, one, two, **how), mass=vc.ConsistentMass()
    )


def corner() -> vc.ContactProblem:
    """A parallelogram in a notch: three faces, no right angle."""
    mesh, tags = block(
        COMM,
        lengths=(1.5, 1.0),
        divisions=(4, 3),
        deform=lambda x: x @ np.array([[1, 0.2], [0.35, 1]]),
    )
    system = fem.assemble(mesh, SOFT, initial_velocity=(-1.0, -2.0))
    near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
    surfaces = (
        fem.contact_surface(system, tags[name], obstacle=near)
        for name in ("left", "bottom", "right")
    )
    return vc.ContactProblem(system, fem.joined_surfaces(*surfaces), mass=vc.ConsistentMass())


def moving() -> vc.ContactProblem:
    """A plane that rises towards a box which it then throws up."""
    given = thrown_box(COMM)
    return replace(
        given, surface=given.surface.moving(lambda t: 0.5 * np.sin(40.0 * t) ** 2 / 40.0)
    )


def some_bilateral() -> vc.ContactProblem:
    given = thrown_box(COMM, simplices=True, angle=0.4)
    first = np.arange(given.surface.count) % 4 == 0
    return replace(
        given, surface=replace(given.surface, bilateral=first & (given.surface.gap0 < 0.1))
    )


PROBLEMS: dict[str, tuple[Callable[[], vc.ContactProblem], float]] = {  # name -> problem, dt
    "box, C = 0.2": (lambda: thrown_box(COMM), 1e-3),
    "box, C = 5": (lambda: thrown_box(COMM), 3e-2),
    "box, C = 50": (lambda: thrown_box(COMM), 0.3),
    "springs": (lambda: wall(springs=1e9), 1.0 / 140.0),
    "inclined": (lambda: wall(angle=0.5), 1.0 / 140.0),
    "bilateral": (some_bilateral, 3e-3),
    "rollers, 2D": (lambda: on_rollers(2), 2e-3),
    "rollers, 3D": (lambda: on_rollers(3), 2e-3),
    "pair, 2D": (lambda: pair(2, matching=fem.DualMortar()), 2e-3),
    "pair, 3D": (lambda: pair(3), 2e-3),
    "corner": (corner, 2e-3),
    "moving": (moving, 2e-3),
}


def pressed(d: int) -> vc.ContactProblem:
    """A block, clamped at its top and pressed on a wavy plane by its weight; static."""
    mesh, tags = block(COMM, lengths=(1.5, 1.0, 1.2)[:d], divisions=(6, 4, 4)[:d])
    weight = fem.BodyForce((0.0, -2e4, 0.0)[:d])
    system = fem.assemble(mesh, SOFT, clamped=tags["top"], loads=weight)
    wavy = vc.AnalyticGap(lambda x: 2e-3 * (1.0 + np.sin(7.0 * x[:, 0])))
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=wavy))
