"""Finite element problems that several tests share, small enough for any number of ranks.

Everything here takes the communicator, so that a test can solve the same problem on all ranks
together (COMM_WORLD) and on each rank alone (COMM_SELF) and compare. Fields and matrices come back
in the numbering of the mesh's input, equal on all ranks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array, Mask, total
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Scheme, Solver, State
from vi_contact.core.surfaces import empty_surface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.matrices.petsc_algebra import as_petsc
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.laws.materials import LinearElastic, PlaneStress
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.march import march
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

CONCRETE = LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
BODIES = {
    "bar": {"lengths": (2.0,), "divisions": (7,)},
    "quadrilaterals": {"lengths": (2.0, 1.5), "divisions": (5, 4)},
    "triangles": {"lengths": (2.0, 1.5), "divisions": (5, 4), "simplices": True, "angle": 0.4},
    "hexahedra": {"lengths": (2.0, 1.5, 1.2), "divisions": (3, 2, 3)},
    "tetrahedra": {
        "lengths": (2.0, 1.5, 1.2),
        "divisions": (3, 2, 3),
        "simplices": True,
        "angle": 0.4,
    },
}


def block(comm: Any, **spec: Any) -> tuple[Any, Any]:
    """(mesh, tags) of a BlockMesh."""
    return build_mesh(BlockMesh(**spec), comm)


def linear(system: SemiDiscreteSystem, **data: Any) -> ContactProblem:
    """A system without contact."""
    return ContactProblem(system, empty_surface(system.space.comm, system.space.dimension), **data)


def nodal(system: SemiDiscreteSystem, function: Callable[[Array], Array]) -> Array:
    """A field at the nodes as a vector of free unknowns."""
    return np.asarray(system.space.restrict(np.asarray(function(system.space.points))))


def resultant(system: SemiDiscreteSystem, load: Array) -> Array:
    """Sum of the nodal forces (d,) of a system without prescribed components."""
    return system.space.comm.sum(load.reshape(-1, system.space.dimension).sum(axis=0))


def max_over_ranks(comm: Any, values: Array) -> float:
    """Largest absolute value of owned arrays."""
    return float(comm.allreduce(float(np.max(np.abs(values), initial=0.0)), op=max))


def spread(comm: Any, ids: Array, values: Array) -> Array:
    """Owned values at their rank-independent numbers, on every rank."""
    parts = comm.allgather((ids, values))
    total = np.zeros(1 + max(int(np.max(part[0], initial=-1)) for part in parts))
    for numbers, part in parts:
        total[numbers] = part
    return total


def dense(comm: Any, system: SemiDiscreteSystem, matrix: Any) -> Array:
    """A matrix of a system as a dense array over its free unknowns in ascending ids, on every
    rank."""
    mat = as_petsc(matrix).mat
    first, last = mat.getOwnershipRange()
    rows = np.array(
        [mat.getValues([row], range(mat.getSize()[1]))[0] for row in range(first, last)]
    )
    parts = comm.allgather(
        (np.asarray(system.space.ids), rows.reshape(last - first, mat.getSize()[1]))
    )
    order = np.argsort(np.concatenate([ids for ids, _ in parts]))
    return np.vstack([part for _, part in parts])[np.ix_(order, order)]


def field(
    system: SemiDiscreteSystem, u: Array, t: float = 0.0, derivative: int = 0
) -> tuple[Array, Array]:
    """(points, values), each (nodes, d), of a Cartesian vector of free unknowns, all nodes in input
    numbering."""
    space = system.space
    count = int(total(space.comm, len(space.nodes)))
    points, values = np.zeros((count, space.dimension)), np.zeros((count, space.dimension))
    points[space.nodes] = space.points
    values[space.nodes] = space.expand(u, t, derivative)
    return space.comm.sum(points), space.comm.sum(values)


def turned(vectors: Any, angle: float) -> Array:
    """Plane vectors (..., 2) turned anticlockwise."""
    rotation = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    return np.asarray(vectors, dtype=float) @ rotation.T


@dataclass(frozen=True)
class Run:
    """Histories of a march: u (steps, nodes, d), r_n and active (steps, m), iterations and
    certificates (steps,)."""

    u: Array
    r_n: Array
    active: Mask
    iterations: Array
    certificate: Array
    state: State


def run(
    problem: ContactProblem,
    *,
    dt: float,
    steps: int,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    state: State | None = None,
    nodes: Array | None = None,
) -> Run:
    """March, keeping Cartesian displacements of nodes (all by default), reactions and contact sets
    of every step."""
    system = problem.system
    if nodes is None:
        nodes = np.arange(len(field(system, system.u0)[0]))
    rows = []
    for new, report in march(
        problem,
        scheme=scheme or ZienkiewiczWoodTaylor(),
        solver=solver or Condensed(),
        dt=dt,
        steps=steps,
        state=state,
    ):
        u = system.space.sample(problem.cartesian(new.u), nodes, new.t)
        r_n, active = (problem.surface.everywhere(values) for values in (new.r_n, new.active))
        rows.append((u, r_n, active, report.result.iterations, report.certificate.worst))
    u, r_n, active, iterations, certificate = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    return Run(u, r_n, active, iterations, certificate, new)


def shaken_wall(
    comm: Any,
    *,
    angle: float = 0.0,
    metre: float = 1.0,
    divisions: tuple[int, int] = (4, 6),
    simplices: bool = False,
    nu: float = 0.2,
    contacts: Sequence[float] | None = None,
    springs: float | None = None,
    gap: float = 0.0,
) -> ContactProblem:
    """The wall of seed 000, coarser, turned by ``angle`` and written in a length unit of which a
    metre has ``metre``.

    ``contacts``: heights [m] of the contact points, the whole side when None; ``springs``:
    foundation modulus [Pa/m]. Seconds and kilograms stay: a stress E in Pa = kg/(m s²) becomes
    E/metre, a density rho/metre³.
    """
    lengths = (6.0 * metre, 9.0 * metre)
    mesh, tags = block(comm, lengths=lengths, divisions=divisions, simplices=simplices, angle=angle)
    material = LinearElastic(E=2.0e10 / metre, nu=nu, rho=2400.0 / metre**3)
    system = assemble(mesh, material, section=PlaneStress(0.2 * metre), clamped=tags["bottom"])
    foot = turned((lengths[0] + gap * metre, 0.0), angle)
    ground = HalfSpace(point=tuple(foot), normal=tuple(turned((-1.0, 0.0), angle)))
    points = (
        None if contacts is None else [turned((lengths[0], y * metre), angle) for y in contacts]
    )
    surface = contact_surface(system, tags["right"], obstacle=ground, points=points)
    if springs is not None:
        surface = surface.on_springs(springs / metre**2)
    shake = Harmonic(3.0 * metre, 14.0, direction=tuple(turned((1.0, 0.0), angle)))
    return ContactProblem(
        system, surface, impact=Inelastic(), excitation=shake, mass=ConsistentMass()
    )


WALL_DT = 1.0 / (40.0 * 14.0)


def thrown_box(
    comm: Any,
    *,
    simplices: bool = False,
    angle: float = 0.0,
    divisions: tuple[int, ...] = (3, 2, 3),
) -> ContactProblem:
    """A soft box in three dimensions, thrown obliquely onto a plane that may be inclined about the
    z axis."""
    material = LinearElastic(E=1.0e6, nu=0.3, rho=1000.0)
    mesh, tags = block(
        comm, lengths=(1.5, 1.0, 1.2), divisions=divisions, simplices=simplices, angle=angle
    )
    down, along = turned((0.0, -1.0), angle), turned((1.0, 0.0), angle)

    def throw(x: Array) -> Array:
        return np.column_stack([2.0 * np.outer(1.0 + 0.2 * x[:, 2], down), 0.3 * x[:, :2] @ along])

    system = assemble(
        mesh, material, loads=BodyForce((*(9.81e3 * down), 0.0)), initial_velocity=throw
    )
    plane = HalfSpace(point=(*(1e-3 * down), 0.0), normal=(*(-down), 0.0))
    surface = contact_surface(system, tags["bottom"], obstacle=plane)
    return ContactProblem(system, surface, mass=ConsistentMass())


BOX_DT = 1.0e-3


def held_by(tags: Any, name: str, motion: Callable[[Array], Array], *components: int) -> Prescribed:
    """A displacement constant in time on a named boundary, in all components or in the given
    ones."""
    return Prescribed(
        tags[name], displacement=lambda x, t: motion(x), components=components or None
    )


def signorini_field(
    points: Array, *, x0: float = 1.0 / 7.0, shear: float = 0.4, nu: float = 0.3, a: float = 1.0
) -> Array:
    """Displacement (k, 2) of V2.2: plane strain, body y > 0, contact on y = 0 for x < x0, open for
    x > x0.

    With p + iq = √z, z = x - x0 + iy: Z = ia√z, Z~ = (2/3) ia z√z, 2 mu u_x = ½(kappa - 1) Re Z~ -
    y Im Z and 2 mu u_y = ½(kappa + 1) Im Z~ - y Re Z. Half angles instead of a complex power, so
    that u_y = 0 exactly in contact.
    """
    x, y = points[:, 0] - x0, points[:, 1]
    r = np.hypot(x, y)
    p, q = np.sqrt(np.maximum(0.5 * (r + x), 0.0)), np.sqrt(np.maximum(0.5 * (r - x), 0.0))
    kappa = 3.0 - 4.0 * nu
    re_cube, im_cube = x * p - y * q, x * q + y * p  # z√z
    u_x = -0.5 * (kappa - 1.0) * (2.0 / 3.0) * a * im_cube - y * a * p
    u_y = 0.5 * (kappa + 1.0) * (2.0 / 3.0) * a * re_cube + y * a * q
    return np.column_stack([u_x, u_y]) / (2.0 * shear)


def signorini_pressure(x: Array, *, x0: float = 1.0 / 7.0, a: float = 1.0) -> Array:
    """Contact pressure a √(x0 - x), zero beyond x0."""
    return a * np.sqrt(np.maximum(x0 - x, 0.0))


def plane_strain(shear: float, nu: float, rho: float) -> LinearElastic:
    """The material of a shear modulus."""
    return LinearElastic(E=2.0 * shear * (1.0 + nu), nu=nu, rho=rho)


@dataclass(frozen=True)
class Errors:
    """Of a Q1 field on a rectangle against a smooth one: L2, H1 seminorm, energy norm relative to
    the exact field's."""

    l2: float
    h1: float
    energy: float


def field_errors(
    points: Array,
    values: Array,
    divisions: tuple[int, int],
    exact: Callable[[Array], Array],
    *,
    lame: float,
    shear: float,
    simplices: bool = False,
) -> Errors:
    """Gauss quadrature over an evenly divided rectangle of Q1 or P1 cells, nodes in BlockMesh's
    order (x fastest).

    Written without the finite element library on purpose. Gradients of ``exact`` by central
    differences of 1e-6 cells, which costs 1e-10 of the gradient.
    """
    nx, ny = divisions
    grid = values.reshape(ny + 1, nx + 1, 2)
    low, high = points.min(axis=0), points.max(axis=0)
    size = (high - low) / np.array(divisions)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    corners = [grid[j + dj, i + di] for dj in (0, 1) for di in (0, 1)]
    l2 = h1 = energy = total = 0.0
    for a, b, w in _quadrature(simplices):
        x = low + np.column_stack([i + a, j + b]) * size
        u, u_a, u_b = _interpolated(corners, a, b, simplices)
        e_x, e_y = (
            (exact(x + h * np.eye(2)[k]) - exact(x - h * np.eye(2)[k])) / (2.0 * h)
            for k, h in enumerate(1e-6 * size)
        )
        d_x, d_y, weight = u_a / size[0] - e_x, u_b / size[1] - e_y, w * size.prod()
        l2 += weight * float(np.sum((u - exact(x)) ** 2))
        h1 += weight * float(np.sum(d_x**2 + d_y**2))
        energy += weight * _energy(d_x, d_y, lame, shear)
        total += weight * _energy(e_x, e_y, lame, shear)
    return Errors(sqrt(l2), sqrt(h1), sqrt(energy / total))


def _quadrature(simplices: bool, order: int = 6) -> list[tuple[float, float, float]]:
    """(a, b, weight) on the unit square; with simplices on its triangles below and above the
    diagonal a = b."""
    s, w = np.polynomial.legendre.leggauss(order)
    line = list(zip(0.5 * (s + 1.0), 0.5 * w, strict=True))
    if not simplices:
        return [(a, b, wa * wb) for a, wa in line for b, wb in line]
    below = [(a, a * b, a * wa * wb) for a, wa in line for b, wb in line]
    return below + [(b, a, weight) for a, b, weight in below]


def _interpolated(
    corners: list[Array], a: float, b: float, simplices: bool
) -> tuple[Array, Array, Array]:
    """(u, du/da, du/db) in every cell, from its corners (0,0), (1,0), (0,1), (1,1)."""
    c00, c10, c01, c11 = corners
    if simplices:
        u_a, u_b = (c10 - c00, c11 - c10) if b <= a else (c11 - c01, c01 - c00)
        return c00 + a * u_a + b * u_b, u_a, u_b
    u_a = (1.0 - b) * (c10 - c00) + b * (c11 - c01)
    u_b = (1.0 - a) * (c01 - c00) + a * (c11 - c10)
    return c00 + a * (c10 - c00) + b * u_b, u_a, u_b


def _energy(u_x: Array, u_y: Array, lame: float, shear: float) -> float:
    """Sum of lambda tr(eps)² + 2 mu eps:eps."""
    trace = u_x[:, 0] + u_y[:, 1]
    twice = 2.0 * (u_x[:, 0] ** 2 + u_y[:, 1] ** 2) + (u_x[:, 1] + u_y[:, 0]) ** 2
    return float(np.sum(lame * trace**2 + shear * twice))


def orders(errors: Sequence[float]) -> Array:
    """Observed orders when every problem halves the mesh size or time step of the one before."""
    values = np.asarray(errors)
    return np.asarray(np.log2(values[:-1] / values[1:]))
