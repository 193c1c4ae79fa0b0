"""Two blocks of finite elements, one on top of the other, for tests of contact between deformable
bodies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from fem_problems import field

from vi_contact.core.algebra import Array, largest
from vi_contact.core.problem import ContactProblem
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

SOFT = LinearElastic(E=1.0e6, nu=0.3, rho=1000.0)
LENGTHS, UPPER, LOWER = (1.5, 1.0, 1.2), (4, 3, 3), (4, 2, 3)


def blocks(
    d: int = 2,
    *,
    upper: tuple[int, ...] = UPPER,
    lower: tuple[int, ...] = LOWER,
    simplices: bool = False,
    angle: float = 0.0,
    gap: float = 0.0,
    offset: tuple[float, ...] = (0.0, 0.0),
    deform: Any = None,
    lengths: tuple[float, ...] = LENGTHS,
) -> TwoBlocks:
    """Matching by default."""
    one, two = (
        BlockMesh(lengths=lengths[:d], divisions=divisions[:d], simplices=simplices, deform=deform)
        for divisions in (upper, lower)
    )
    return TwoBlocks(upper=one, lower=two, angle=angle, gap=gap, offset=offset)


def two_blocks(
    comm: Any, mesh: Any, material: Any = SOFT, **data: Any
) -> tuple[SemiDiscreteSystem, Any]:
    """(system, tags); ``data`` for fem.assemble, functions of the tags for what needs them."""
    built, tags = build_mesh(mesh, comm)
    given = {
        name: value(tags) if callable(value) and name in NEED_TAGS else value
        for name, value in data.items()
    }
    return assemble(built, material, **given), tags


NEED_TAGS = ("clamped", "prescribed", "loads")


def per_body(system: SemiDiscreteSystem, *functions: Callable[[Array], Array]) -> Array:
    """A vector of free unknowns that is one function of the points in body 0, another in body 1,
    ..."""
    space: Any = system.space
    values = np.column_stack(
        [space.restrict(np.asarray(function(space.points))) for function in functions]
    )
    return np.asarray(values[np.arange(system.rows), space.bodies])


def thrown(system: SemiDiscreteSystem, *functions: Callable[[Array], Array]) -> SemiDiscreteSystem:
    """The system with an initial velocity for each body."""
    return system.changed(v0=per_body(system, *functions))


def momenta(problem: ContactProblem, v: Array) -> Array:
    """(bodies, d) linear momentum of each body, with the mass matrix of the equations."""
    system, bodies = problem.system, problem.system.space.bodies
    # on the unknowns of the equations: forces, hence back with the transpose
    momentum = problem.equations.M @ v
    rows = []
    for body in range(int(largest(system.algebra.comm, bodies.max(initial=0))) + 1):
        rigid = np.column_stack(
            [relative(problem, column * (bodies == body)) for column in system.influence.T]
        )
        rows.append(system.algebra.comm.sum(rigid.T @ momentum))
    return np.array(rows)


def relative(problem: ContactProblem, u: Array) -> Array:
    """A Cartesian vector in the unknowns of the equations."""
    surface = problem.surface
    u = surface.in_frames(u)
    return u if surface.coupling is None else 2.0 * u - surface.coupling @ u


def forces(problem: ContactProblem, load: Array) -> Array:
    """(nodes, d) Cartesian nodal forces of a load on the unknowns of the equations."""
    surface = problem.surface
    load = load if surface.coupling is None else 2.0 * load - surface.coupling.transpose_apply(load)
    return field(problem.system, surface.along_axes(load))[1]
