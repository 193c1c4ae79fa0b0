"""A block that is thrown against a wall and rubs along it: three contact points, without finite
element packages."""

from __future__ import annotations

import numpy as np
from volume_cases import block

import vi_contact as vc
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.laws.mass import ConsistentMass


def rubbing_block(
    friction: FrictionLaw, *, gap: float = 0.05, damping: float = 0.0
) -> ContactProblem:
    """4 x 3 elements on a clamped base, thrown to the right and upwards; the right side meets a
    wall."""
    body = block(4, 3)
    points = np.column_stack([np.tile(np.arange(5.0), 3), np.repeat(np.arange(1.0, 4.0), 5)])
    v0 = points[:, 1:] * [0.3, 0.2]  # grows with the height
    C = damping * body.K if damping else None
    system = vc.system_from_arrays(body.M, C, body.K, coordinates=points, v0=v0.ravel())
    surface = vc.contact_points(system, np.asarray(body.contact) // 2, [1.0, 0.0], gap0=gap)
    return ContactProblem(system, surface, friction=friction, mass=ConsistentMass())
