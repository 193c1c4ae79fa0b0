"""Set up four examples of Aimi, Di Credico and Gimperlein (2024).

They use boundary elements, by numpy and scipy only.

The data are those that square, disk and embedded have for finite elements.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from vi_contact.bem.boundary_mesh import BoundaryMesh, circle, polygon
from vi_contact.bem.contact import BoundaryContact, conditions_on
from vi_contact.bem.energetic import energetic_blocks
from vi_contact.bem.joined_bodies import TwoBodies
from vi_contact.bem.loads import traction_forces
from vi_contact.bem.poincare_steklov import BoundaryProblem, PoincareSteklov
from vi_contact.core.algebra import Array, Mask
from vi_contact.core.checks import function, instance, number, whole
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.protocols import FrictionLaw, Frictionless
from vi_contact.laws.materials import LinearElastic

Load = Callable[[float], float]
BOTTOM, RIGHT, TOP, LEFT = range(4)  # sides of a box


def steklov(
    mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int
) -> PoincareSteklov:
    """Return the symmetric Poincaré-Steklov operator of a homogeneous body."""
    return PoincareSteklov(energetic_blocks(mesh, material, dt=dt, steps=steps), material.rho)


def pressed(
    operator: PoincareSteklov, *, pressure: Load, top: int, contact: Mask, **more: Any
) -> BoundaryProblem:
    """Set up a body under pressure(t) [Pa] on elements ``top``.

    ``contact`` is a mask of elements; ``more`` has fixed and prescribed.
    """
    instance("pressed", "operator", operator, PoincareSteklov, "give steklov(...)")
    function("pressed", "pressure", pressure, "give a function of the time in Pa")
    blocks, mesh = operator.blocks, operator.mesh

    def traction(points: Array, normals: Array, t: float) -> Array:
        return -pressure(t) * normals

    loads = traction_forces(
        mesh, traction, dt=blocks.dt, steps=blocks.steps, elements=mesh.labels == top
    )
    return BoundaryProblem(operator, loads, contact=contact, **more)


def unloaded(operator: PoincareSteklov, *, contact: Mask, **more: Any) -> BoundaryProblem:
    """Set up a body that is moved by contact or supports only."""
    instance("unloaded", "operator", operator, PoincareSteklov, "give steklov(...)")
    loads = np.zeros((operator.blocks.steps, 2, len(operator.mesh)))
    return BoundaryProblem(operator, loads, contact=contact, **more)


def square_problem(
    elements: int,
    material: LinearElastic,
    *,
    dt: float,
    steps: int,
    pressure: Load = lambda t: 1.0,
    side: float = 1.0,
) -> BoundaryProblem:
    """Set up [-a/2, a/2]² of ``elements`` per side.

    It is pressed on its top; its bottom may come into contact.
    """
    a, h = _halves("square_problem", side, elements)
    mesh = polygon([(-a, -a), (a, -a), (a, a), (-a, a)], h)
    operator = steklov(mesh, material, dt=dt, steps=steps)
    return pressed(operator, pressure=pressure, top=TOP, contact=mesh.labels == BOTTOM)


def disk_problem(
    elements: int, material: LinearElastic, *, dt: float, steps: int, radius: float
) -> BoundaryProblem:
    """Set up a disk around (0, radius) of ``elements`` chords.

    Its foot, 60° to each side, may come into contact.
    """
    number("disk_problem", "radius", radius, positive=True, unit="m")
    mesh = circle(radius, elements, centre=(0.0, radius))
    foot = mesh.elements_where(lambda points: points[:, 1] <= radius * (1.0 - 0.5) * (1.0 + 1e-9))
    return unloaded(steklov(mesh, material, dt=dt, steps=steps), contact=foot)


def disk_contact(
    problem: BoundaryProblem, push: Load, friction: FrictionLaw | None = None
) -> BoundaryContact:
    """Set up the contact of the disk with the plane y = push(t)."""
    instance("disk_contact", "problem", problem, BoundaryProblem, "give disk_problem(...)")
    function("disk_contact", "push", push, "give a function of the time in m")
    plane = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    return BoundaryContact(
        problem.condensed(), obstacle=plane, friction=friction or Frictionless(), towards=push
    )


def _halves(owner: str, side: float, elements: int, *, multiple: int = 1) -> tuple[float, float]:
    """Return half a side [m] and the length of an element.

    It raises InputError unless its elements are such a multiple.
    """
    length = number(owner, "side", side, positive=True, unit="m")
    count = whole(owner, "elements", elements, least=1)
    if count % multiple:
        raise InputError(
            f"{owner}: elements is {count}; give an even number, half of them are in the notch"
        )
    return 0.5 * length, length / count


@dataclass(frozen=True, eq=False)
class EmbeddedBox:
    """Hold a box [-a/2, a/2]² in the notch of a block [-3a/2, 3a/2] x [-2a, 0].

    The block is clamped at its bottom.
    """

    bodies: TwoBodies

    def contact(self, friction: FrictionLaw | None = None) -> BoundaryContact:
        """Set up contact with floor and walls of the notch.

        A corner of the box has two conditions and does not rub.
        """
        condensed = self.bodies.condensed()
        mesh = self.bodies.one.operator.mesh
        in_notch = np.asarray(self.bodies.one.contact)
        sides = [in_notch & (mesh.labels == side) for side in (BOTTOM, LEFT, RIGHT)]
        rows = conditions_on(mesh, condensed, *sides)
        return self.bodies.contact(friction, conditions=rows)


def embedded_problem(
    elements: int,
    material: LinearElastic,
    *,
    dt: float,
    steps: int,
    pressure: Load,
    side: float = 1.0,
) -> EmbeddedBox:
    """Set up box and block with ``elements``, an even number, along a side of the box."""
    a, h = _halves("embedded_problem", side, elements, multiple=2)
    box = polygon([(-a, -a), (a, -a), (a, a), (-a, a)], h)
    corners = [(-3, -4), (3, -4), (3, 0), (1, 0), (1, -1), (-1, -1), (-1, 0), (-3, 0)]
    block = polygon(a * np.array(corners, float), h)
    make = partial(steklov, dt=dt, steps=steps)
    in_notch = box.elements_where(lambda points: points[:, 1] <= 1e-9 * side)
    one = pressed(make(box, material), pressure=pressure, top=TOP, contact=in_notch)
    clamped = np.tile(block.nodes_of(block.labels == 0), (2, 1))
    notch = (block.labels >= 3) & (block.labels <= 5)
    return EmbeddedBox(
        TwoBodies(one, unloaded(make(block, material), contact=notch, fixed=clamped))
    )
