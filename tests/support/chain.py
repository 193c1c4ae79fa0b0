"""A spring-mass chain with walls at its ends: the smallest contact problem, for tests without
finite elements.

Masses sit at X = 1, 2, …, n [m]; spring i joins mass i - 1 to mass i, spring 1 joins mass 1 to the
ground (clamped) or is absent (floating). The wall on the right bounds u_n <= gap; the wall on the
left bounds -u_1 <= left_gap, so that its contact direction is -1 and the change of basis is not the
identity. It runs on one process (SerialAlgebra).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

import vi_contact as vc
from vi_contact.core.algebra import Array, SerialComm, SerialMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.laws.mass import ConsistentMass


def chain_system(
    n: int = 5,
    *,
    mass: float = 2.0,
    stiffness: float = 1.0e3,
    damping: float = 0.0,
    consistent: bool = False,
    floating: bool = False,
    constant: float = 0.0,
    u0: Array | None = None,
    v0: Array | None = None,
) -> SemiDiscreteSystem:
    """n masses [kg] and springs [N/m], C = damping * K [s], a constant force [N] on the last mass.

    ``consistent``: mass/6 times tridiag(1, 4, 1), which component resets of velocities see (V9.6);
    lumped by default.
    """
    k = np.full(n, 2.0)
    k[-1] = 1.0
    if floating:
        k[0] -= 1.0
    off = np.full(n - 1, -1.0)
    K = stiffness * sp.diags([off, k, off], [-1, 0, 1])
    side = np.full(n - 1, mass / 6.0)
    spread = [side, np.full(n, 4.0 * mass / 6.0), side]
    M = sp.diags(spread, [-1, 0, 1]) if consistent else sp.diags([np.full(n, mass)], [0])
    force = np.zeros(n)
    force[-1] = constant
    points = np.arange(1.0, n + 1.0)[:, None]
    return vc.system_from_arrays(
        M, damping * K if damping else None, K, coordinates=points, load=force, u0=u0, v0=v0
    )


def chain_surface(
    n: int, *, gap: float = 0.0, left_gap: float | None = None, weight: float = 0.5
) -> ContactSurface:
    """The wall on the right of mass n and, when ``left_gap`` is given, the wall on the left of mass
    1 (condition 1)."""
    ends = [n - 1] if left_gap is None else [n - 1, 0]
    direction = np.ones(n)
    if left_gap is not None:
        direction[0] = -1.0
    m = len(ends)
    return ContactSurface(
        comm=SerialComm(),
        points=np.array(ends, dtype=float)[:, None] + 1.0,
        normals=direction[ends][:, None],
        weights=np.full(m, weight),
        gap0=np.array([gap, left_gap][:m], dtype=float),
        bilateral=np.zeros(m, dtype=bool),
        compliance=np.zeros(m),
        owned=np.array(ends, dtype=np.int64),
        slots=np.arange(m),
        tangents=np.zeros((m, 0), dtype=np.int64),
        basis=None if left_gap is None else SerialMatrix(sp.diags([direction], [0])),
    )


def chain_problem(
    n: int = 5,
    *,
    gap: float = 0.0,
    left_gap: float | None = None,
    impact: Any = None,
    excitation: Any = (),
    **system: Any,
) -> ContactProblem:
    """The chain between its walls; other keywords go to ``chain_system``."""
    surface = chain_surface(n, gap=gap, left_gap=left_gap)
    return ContactProblem(
        chain_system(n, **system),
        surface,
        impact=impact,
        excitation=excitation,
        mass=ConsistentMass(),
    )
