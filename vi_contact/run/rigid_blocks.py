"""Hold rigid blocks in the plane and the joints between them, for bounds of limit loads.

A block has an area, a centre and a name. A joint is a segment between two blocks, or between a
block and what does not move, which is called -1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array, Indices
from ..core.checks import array, integers, provides, quote, several
from ..core.errors import InputError

OWNER = "RigidBlocks"
GROUND = -1  # what does not move
STRAIGHT = 1e-3  # of the length of a joint: so much the distance of its ends may differ from it


@dataclass(frozen=True, eq=False)
class RigidBlocks:
    """Hold n rigid blocks and m joints in the plane.

    Attributes:
        areas: (n,) [m²].
        centres: (n, 2) centres of gravity [m].
        bodies: (m, 2) the two blocks of each joint; -1 for what does not move.
        ends: (m, 2, 2) both ends of each joint [m].
        normals: (m, 2) unit normals, from the first block to the second.
        names: (n,) of the blocks; numbers from 1 on by default.
        outlines: (k, 2, 2) sides of blocks for pictures [m].
        outline_bodies: (k,) the blocks of these, -1 for what does not move.

    Raises:
        InputError: other shapes, areas that are not positive, blocks that do not exist.
    """

    areas: Array
    centres: Array
    bodies: Indices
    ends: Array
    normals: Array
    names: tuple[str, ...] = ()
    outlines: Array | None = None
    outline_bodies: Indices | None = None

    def __post_init__(self) -> None:
        areas = array(OWNER, "areas", self.areas, (None,), unit="m²")
        n = len(areas)
        if not n or areas.min() <= 0.0:
            raise InputError(f"{OWNER}: areas is {quote(self.areas)}; give positive numbers of m²")
        bodies = integers(OWNER, "bodies", self.bodies, (None, 2))
        m = len(bodies)
        if m and not (bodies.min() >= GROUND and bodies.max() < n):
            raise InputError(
                f"{OWNER}: bodies has numbers from {bodies.min()} to {bodies.max()} and there are "
                f"{n} blocks; give numbers from 0 on, or -1 for what does not move"
            )
        alike = np.flatnonzero(bodies[:, 0] == bodies[:, 1])
        if len(alike):
            raise InputError(
                f"{OWNER}: joint {alike[0]} is between block {bodies[alike[0], 0]} and itself; "
                "give two blocks"
            )
        normals = array(OWNER, "normals", self.normals, (m, 2))
        lengths = np.linalg.norm(normals, axis=1)
        if np.any(np.abs(lengths - 1.0) > 1e-6):
            raise InputError(f"{OWNER}: normals has a vector that is no unit vector; divide it")
        names = self.names or tuple(f"block {number + 1}" for number in range(n))
        if len(names) != n:
            raise InputError(f"{OWNER}: there are {len(names)} names and {n} blocks; give as many")
        for name, value in (
            ("areas", areas),
            ("centres", array(OWNER, "centres", self.centres, (n, 2), unit="m")),
            ("bodies", bodies),
            ("ends", array(OWNER, "ends", self.ends, (m, 2, 2), unit="m")),
            ("normals", normals),
            ("names", names),
        ):
            object.__setattr__(self, name, value)

    def describe(self, joint: int) -> str:
        """Return the names of the blocks of a joint, as words."""
        names = [*self.names, "the ground"]  # the last one is -1
        return " and ".join(names[body] for body in self.bodies[joint])


def rigid_blocks(joints: Any, *, fixed: Sequence[str | int]) -> RigidBlocks:
    """Make rigid blocks of the bodies of a mesh in the plane, and of the joints between them.

    Areas and centres are those of the polygons that the meshes are. Joints with a gap press on
    nothing, and are left out.

    Args:
        joints: what ``fem.find_joints`` found.
        fixed: names or numbers of the bodies that do not move, such as the ground.

    Raises:
        InputError: joints in space, curved joints, bodies that do not exist, none that is fixed or
            none that moves.
    """
    owner = "rigid_blocks"
    provides(owner, "joints", joints, ("outline_bodies", "corners"), "give fem.find_joints(…)")
    if joints.dimension != 2:
        raise InputError(
            f"{owner}: the bodies are in space, and the bound is for blocks in the plane: give a "
            "mesh in the plane"
        )
    held = _find_fixed(owner, joints.names, fixed)
    moving = np.setdiff1d(np.arange(len(joints.names)), held)
    if not len(moving):
        raise InputError(f"{owner}: fixed holds all bodies; leave some out, which may move")
    number = np.full(len(joints.names), GROUND)
    number[moving] = np.arange(len(moving))

    rows = []
    for joint in joints:
        bodies = number[list(joint.bodies)]
        if joint.gap == 0.0 and np.any(bodies != GROUND):
            length = float(np.linalg.norm(joint.ends[1] - joint.ends[0]))
            if abs(length - joint.size) > STRAIGHT * joint.size:
                raise InputError(
                    f"{owner}: the joint between {joint.names[0]} and {joint.names[1]} is "
                    f"{joint.size:.4g} m long and its ends are {length:.4g} m apart: the bound is "
                    "for straight joints, divide it"
                )
            rows.append((bodies, joint.ends, joint.normal))
    areas, centres = _measure(joints, moving)
    return RigidBlocks(
        areas=areas,
        centres=centres,
        bodies=np.array([row[0] for row in rows]).reshape(-1, 2),
        ends=np.array([row[1] for row in rows]).reshape(-1, 2, 2),
        normals=np.array([row[2] for row in rows]).reshape(-1, 2),
        names=tuple(joints.names[body] for body in moving),
        outlines=joints.outlines,
        outline_bodies=number[joints.outline_bodies],
    )


def _find_fixed(owner: str, names: Sequence[str], fixed: Any) -> Indices:
    """Return the numbers of the bodies that do not move; InputError for what is no body."""
    given = several(owner, "fixed", fixed, 'give names or numbers in a list, such as ["ground"]')
    if not given:
        raise InputError(f"{owner}: fixed is empty; give a body that does not move, or all fall")
    numbers = []
    for one in given:
        known = one in names if isinstance(one, str) else one in range(len(names))
        if not known:
            some = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
            raise InputError(f"{owner}: fixed has {quote(one)}; give one of {some}, or its number")
        numbers.append(names.index(one) if isinstance(one, str) else int(one))
    return np.unique(numbers)


def _measure(joints: Any, bodies: Indices) -> tuple[Array, Array]:
    """Return areas (n,) and centres (n, 2) of bodies, by integrals over their outlines.

    A = ½ ∮ x·n ds and A c = ½ ∮ x² n ds, component by component, from the middle of each body.

    Args:
        joints: of ``fem.find_joints``, in the plane.
        bodies: (n,) numbers of bodies.
    """
    areas = np.zeros(len(bodies))
    centres = np.zeros((len(bodies), 2))
    for row, body in enumerate(bodies):
        own = joints.outline_bodies == body
        x = joints.outlines[own]
        n = joints.outline_normals[own]
        middle = x.reshape(-1, 2).mean(axis=0)
        first, second = x[:, 0] - middle, x[:, 1] - middle
        lengths = np.linalg.norm(second - first, axis=1)
        areas[row] = 0.5 * np.sum(lengths * np.sum(0.5 * (first + second) * n, axis=1))
        squares = (first**2 + first * second + second**2) / 3.0
        moments = 0.5 * np.sum(lengths[:, None] * squares * n, axis=0)
        centres[row] = middle + moments / areas[row]
    return areas, centres
