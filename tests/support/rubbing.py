"""A block that is thrown against a wall and rubs along it: three contact points, without finite element packages."""

from __future__ import annotations

import numpy as np
from chain import ChainSpace
from volume_cases import block

from vi_contact.core.algebra import SerialAlgebra, SerialComm, SerialMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import Load, SemiDiscreteSystem
from vi_contact.laws.mass import ConsistentMass


def rubbing_block(friction: FrictionLaw, *, gap: float = 0.05, damping: float = 0.0) -> ContactProblem:
    """4 x 3 elements on a clamped base, thrown to the right and upwards; the right side meets a wall."""
    body = block(4, 3)
    n, m = body.size, len(body.contact)
    motion = np.zeros((n, 2))
    motion[::2, 0] = motion[1::2, 1] = 1.0
    up = np.repeat(np.arange(1.0, 4.0), 5)  # height of the nodes, 5 in a row
    v0 = 0.3 * motion @ [1.0, 0.0] + 0.2 * motion @ [0.0, 1.0]
    system = SemiDiscreteSystem(
        algebra=SerialAlgebra(),
        M=SerialMatrix(body.M),
        C=SerialMatrix(damping * body.K) if damping else None,
        K=SerialMatrix(body.K),
        load=Load(np.zeros(n)),
        influence=motion,
        u0=np.zeros(n),
        v0=v0 * np.repeat(up, 2),
        space=ChainSpace(n),
    )
    surface = ContactSurface(
        comm=SerialComm(),
        points=np.column_stack([np.full(m, 4.0), np.arange(1.0, m + 1.0)]),
        normals=np.tile([1.0, 0.0], (m, 1)),
        weights=np.ones(m),
        gap0=np.full(m, gap),
        bilateral=np.zeros(m, dtype=bool),
        compliance=np.zeros(m),
        owned=np.asarray(body.contact),
        slots=np.arange(m),
        tangents=np.asarray(body.contact)[:, None] + 1,
    )
    return ContactProblem(system, surface, friction=friction, mass=ConsistentMass())
