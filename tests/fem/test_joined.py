"""Several contact surfaces as one: stacks of bodies, bodies on obstacles, corners with two and
three directions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import dense, field, max_over_ranks, turned
from mpi4py import MPI
from two_bodies import SOFT, blocks, forces, momenta, per_body, relative, thrown, two_blocks

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import AnalyticGap, HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.core.surfaces import ContactSurface, empty_surface
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce
from vi_contact.fem.contact.joined import joined_surfaces
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import Redistributed
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.run.march import march
from vi_contact.schemes.midpoint import Midpoint

COMM = MPI.COMM_WORLD


def wavy(x: Array) -> Array:
    return np.cos(2.0 * x + 0.3) + x[:, ::-1] ** 2


def linear(x: Array) -> Array:
    d = x.shape[1]
    return x @ np.arange(1.0, d * d + 1.0).reshape(d, d)


def cubic(x: Array) -> Array:
    return x**3 - x[:, ::-1]


def tower(angle: float = 0.4, d: int = 2) -> tuple[Any, Any]:
    """Three blocks, one on top of the other: "a" lowest."""
    lengths, divisions = (1.0, 0.5, 0.8)[:d], (4, 2, 3)[:d]
    parts = {
        name: BlockMesh(
            lengths=lengths, divisions=divisions, corner=(0.0, 0.5 * i, 0.0)[:d], angle=angle
        )
        for i, name in enumerate("abc")
    }
    mesh, tags = build_mesh(Blocks(parts), COMM)
    return assemble(mesh, SOFT), tags


@pytest.mark.parametrize("d", [2, 3])
def test_two_pairs_and_an_obstacle(d):
    """Side 1: the lower sides of c and b; a stands on a plane. All conditions in order, each
    relative to the right body; the middle body is side 1 of one pair and side 2 of the other, with
    different nodes."""
    system, tags = tower(d=d)
    up = np.zeros(d)
    up[:2] = turned((0.0, 1.0), 0.4)
    ground = contact_surface(
        system, tags["a_bottom"], obstacle=HalfSpace(point=(0.0,) * d, normal=tuple(up))
    )
    parts = [
        ground,
        *(
            contact_pair(system, tags[f"{one}_bottom"], tags[f"{two}_top"])
            for one, two in ("ba", "cb")
        ),
    ]
    surface = joined_surfaces(*parts)
    problem = ContactProblem(system, surface)
    m = parts[0].total
    parts = [seen(part) for part in parts]
    assert seen(surface).count == 3 * m
    u = per_body(system, wavy, linear, cubic)
    x = relative(problem, u)
    assert max_over_ranks(COMM, problem.cartesian(x) - u) < 1e-12
    jumps = [f(part.points) for f, part in zip((wavy, linear, cubic), parts, strict=True)]
    jumps[2] -= linear(parts[2].points)
    jumps[1] -= wavy(parts[1].points)
    for i, jump in enumerate(jumps):
        rows = slice(i * m, (i + 1) * m)
        assert seen(surface).normal_values(x)[rows] == pytest.approx(-jump @ up, abs=1e-12)
        along = np.linalg.norm(jump - np.outer(jump @ up, up), axis=1)
        assert np.linalg.norm(seen(surface).tangential_values(x)[rows], axis=1) == pytest.approx(
            along, abs=1e-12
        )
        assert np.array_equal(seen(surface).points[rows], parts[i].points)
    same = ContactProblem(system, empty_surface(system.space.comm, d))
    assert problem.equations.strain_energy(x) == pytest.approx(
        same.equations.strain_energy(u), rel=1e-11
    )


def leaning(x: Array) -> Array:
    """No two sides at right angles."""
    lean = np.array([[1.0, 0.2, 0.1], [0.35, 1.0, -0.25], [-0.15, 0.3, 1.0]])
    return np.asarray(x @ lean[: x.shape[1], : x.shape[1]])


@pytest.mark.parametrize("shape", [0.0, 0.4, leaning], ids=["straight", "turned", "leaning"])
@pytest.mark.parametrize("d", [2, 3])
def test_corners(d, shape):
    """A block in the corner between another block and a wall (in space: two walls): its corner
    nodes have two (three) conditions, each exact; T stays orthogonal, unless the sides lean; they
    rub along the edge only. The walls also touch the lower block: nodes of side 2 with a turned
    frame of their own."""
    mesh = blocks(d, deform=shape) if callable(shape) else blocks(d, angle=shape)
    system, tags = two_blocks(COMM, mesh)
    sides = ["left", "back"][: d - 1]
    walls = [
        contact_surface(system, tags[f"{body}_{side}"])
        for side in sides
        for body in ("upper", "lower")
    ]
    pair = contact_pair(system, *(tags[side] for side in mesh.interface))
    surface = joined_surfaces(pair, *walls)
    problem = ContactProblem(system, surface)
    u = per_body(system, wavy, linear)
    x = relative(problem, u)
    assert max_over_ranks(COMM, problem.cartesian(x) - u) < 1e-12
    expected = [
        np.sum((linear(seen(pair).points) - wavy(seen(pair).points)) * seen(pair).normals, axis=1)
    ]
    for i, wall in enumerate(walls):
        expected.append(
            np.sum((wavy if i % 2 else linear)(seen(wall).points) * seen(wall).normals, axis=1)
        )
    assert seen(surface).normal_values(x) == pytest.approx(np.concatenate(expected), abs=1e-12)
    if surface.basis is not None:
        T = dense(COMM, system, surface.basis)
        assert (
            (np.abs(T.T @ T - np.eye(len(T))).max() < 1e-14)
            == (shape is not leaning)
            == (surface.dual is None)
        )
    places = np.round(seen(surface).points, 9) + 0.0
    body = np.repeat([1, *[1, 0] * len(sides)], [seen(pair).count, *(wall.total for wall in walls)])
    _, place, count = np.unique(
        np.column_stack([places, body]), axis=0, return_inverse=True, return_counts=True
    )
    free = seen(surface).all(surface.tangents >= 0)
    assert np.array_equal(free.all(axis=1), count[place.ravel()] == 1)
    assert free.sum() == sum((d - n) for n in count)
    assert count.max() == d
    # a push on every condition of the pair moves nothing as a whole, corner nodes included
    r_n = np.zeros(seen(surface).count)
    r_n[: seen(pair).count] = 1.0
    push = forces(problem, seen(surface).reaction_load(r_n, system.rows))
    upper = field(system, (system.space.bodies == 1).astype(float))[1][:, 0] > 0.0
    assert push[upper].sum(axis=0) == pytest.approx(
        seen(pair).count * seen(pair).normals[0], abs=1e-12
    )
    assert push[~upper].sum(axis=0) == pytest.approx(
        -seen(pair).count * seen(pair).normals[0], abs=1e-12
    )


def corner_run(angle: float, **how: Any) -> tuple[ContactSurface, Array, Array]:
    """(surface, r_n, active of every step) of a block thrown into the corner of a wall and another
    block."""
    mesh = blocks(2, upper=(8, 6), lower=(8, 6), angle=angle, gap=1e-3)
    system, tags = two_blocks(COMM, mesh, loads=BodyForce(tuple(turned((-2e3, -9.81e3), angle))))
    system = thrown(
        system, np.zeros_like, lambda x: np.tile(turned((-1.0, -2.0), angle), (len(x), 1))
    )
    near = AnalyticGap(lambda x: np.full(len(x), 1e-3))
    walls = [
        contact_surface(system, tags[f"{name}_left"], obstacle=near) for name in ("upper", "lower")
    ]
    ground = contact_surface(system, tags["lower_bottom"])
    surface = joined_surfaces(
        contact_pair(system, *(tags[side] for side in mesh.interface)), *walls, ground
    )
    problem = ContactProblem(system, surface.with_frictionless_corners(), friction=Coulomb(0.3))
    reports = [report for _, report in march(problem, dt=1e-3, steps=60, **how)]
    assert max(report.certificate.worst for report in reports) <= 1e-9
    everything = seen(surface).all
    r_n, active = (
        [everything(getattr(r.new, name)) for r in reports] for name in ("r_n", "active")
    )
    return surface, np.array(r_n), np.array(active)


@pytest.mark.two_ranks
@pytest.mark.parametrize("scheme", [None, Midpoint()], ids=["default", "midpoint"])
def test_a_block_thrown_into_a_corner(scheme):
    """Gravity, speed and friction: every step certified, both conditions of the corner node active
    in some steps."""
    surface, _, active = corner_run(0.0, scheme=scheme)
    corner = [0, 9]  # first node of the pair, first node of the wall: the same
    assert seen(surface).points[corner[0]] == pytest.approx(
        seen(surface).points[corner[1]], abs=1e-12
    )
    assert np.any(active[:, corner].all(axis=1)) and not active.all()


@pytest.mark.long
@pytest.mark.two_ranks
def test_a_turned_corner_is_the_same():
    """With consistent mass; redistributed mass depends on the axes (0.1 to 3 % of the forces
    here)."""
    _, r_n, active = corner_run(0.0, scheme=Midpoint())
    _, turned_r_n, turned_active = corner_run(0.4, scheme=Midpoint())
    assert np.array_equal(active, turned_active)
    assert np.abs(turned_r_n - r_n).max() < 1e-8 * r_n.max()


@pytest.mark.two_ranks
def test_what_surfaces_know_is_kept():
    """Gaps, springs, bilateral points, motions, each in its place; joined surfaces may be joined
    again."""
    mesh = blocks(2, gap=0.125)
    system, tags = two_blocks(COMM, mesh)
    pair = contact_pair(system, *(tags[side] for side in mesh.interface)).bilateral_everywhere()
    ground = (
        contact_surface(system, tags["lower_bottom"])
        .on_springs(1e6)
        .moving(towards=lambda t: 2.0 * t)
    )
    wall = contact_surface(system, tags["upper_right"])
    once, twice = (
        joined_surfaces(pair, ground, wall),
        joined_surfaces(joined_surfaces(pair, ground), wall),
    )
    for surface in (once, twice):
        assert seen(surface).bilateral.tolist() == [True] * 5 + [False] * (5 + 4)
        assert seen(surface).gap(0.5).tolist() == [0.125] * 5 + [-1.0] * 5 + [0.0] * 4
        assert np.array_equal(seen(surface).compliance[5:10], seen(ground).compliance)
        assert np.count_nonzero(seen(surface).compliance) == 5
        assert seen(surface).sliding(0.0, 1.0) is None
        assert np.array_equal(surface.owned, once.owned) and np.array_equal(
            surface.tangents, once.tangents
        )


@pytest.mark.long
def test_redistributed_mass_at_corners():
    """No inertia on any contact unknown, that of the edge included; each body keeps its mass."""
    mesh = blocks(3, angle=0.4, upper=(6, 5, 5), lower=(6, 4, 5))
    system, tags = two_blocks(COMM, mesh)
    sides = [tags[f"{body}_{side}"] for side in ("left", "back") for body in ("upper", "lower")]
    walls = [contact_surface(system, side) for side in sides]
    surface = joined_surfaces(
        contact_pair(system, *(tags[side] for side in mesh.interface)), *walls
    )
    surface = surface.with_frictionless_corners()
    for friction in (Frictionless(), Coulomb(0.3)):
        problem = ContactProblem(system, surface, friction=friction, mass=Redistributed())
        massless = problem.equations.massless
        assert seen(surface).all(massless[surface.owned]).all()
        random = np.random.default_rng(5).random(system.rows)
        inertia = problem.equations.M @ random
        assert np.abs(inertia[massless]).max(initial=0.0) < 1e-14 * max_over_ranks(COMM, inertia)
        momentum = momenta(problem, problem.equations.influence[:, 0])
        assert momentum == pytest.approx(np.array([[1800.0, 0.0, 0.0]] * 2), abs=1e-9 * 1800.0)


@pytest.mark.two_ranks
def test_sliding_obstacles_at_corners():
    """A floor that slides along the edge and across: corner nodes feel the part along the edge."""
    system, tags = two_blocks(COMM, blocks(3, angle=0.0))
    floor = contact_surface(system, tags["lower_bottom"]).moving(
        along=lambda t: np.array([2.0 * t, 3.0 * t])
    )
    wall = contact_surface(system, tags["lower_left"])
    surface = joined_surfaces(floor, wall)
    x = system.influence @ np.array([0.0, 0.0, 1.0])  # the edge runs along z
    along = seen(surface).tangential_values(x)
    edge = np.flatnonzero(
        np.isclose(seen(surface).points[:, 0], 0.0) & np.isclose(seen(surface).points[:, 1], 0.0)
    )
    slide, alone = seen(surface).sliding(0.0, 1.0), seen(floor).sliding(0.0, 1.0)[0]
    z = seen(floor).tangential_values(x)[0]  # components of the z axis in the floor's own tangents
    for slot in edge[: len(edge) // 2]:
        assert (
            np.sum(along[slot] * slide[slot]) == pytest.approx(alone @ z)
            and np.count_nonzero(slide[slot]) == 1
        )
    assert not slide[edge[len(edge) // 2 :]].any() and not along[edge[len(edge) // 2 :]].any()
    inside = np.setdiff1d(np.arange(seen(floor).count), edge)
    assert np.array_equal(slide[inside], np.tile(alone, (len(inside), 1)))


# Refusals
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_refusals():
    mesh = blocks(2)
    system, tags = two_blocks(COMM, mesh)
    one, two = (tags[side] for side in mesh.interface)
    pair, wall = contact_pair(system, one, two), contact_surface(system, tags["upper_left"])
    slope = contact_surface(
        system,
        tags["upper_left"],
        obstacle=HalfSpace(point=(-9.0, 0.0), normal=(1.0, 0.5)),
        points=[(0.0, 1.0)],
    )
    nearly = contact_surface(
        system, one, obstacle=HalfSpace(point=(0.0, -9.0), normal=(0.005, 1.0)), points=[(0.0, 1.0)]
    )
    other, names = two_blocks(COMM, mesh)
    chain = contact_surface(system, two)
    for surfaces, sentence in (
        (
            (pair, pair),
            r"contact node \(0, 1\) is on several contact surfaces with one contact direction: "
            r"list every",
        ),
        ((wall, wall), "list every boundary and every pair once"),
        (
            (pair, nearly),
            r"contact node \(0, 1\) has 2 contact directions, not independent in its 2 dimensions: "
            r"treat",
        ),
        (
            (pair, wall, slope),
            r"contact node \(0, 1\) has 3 contact directions, more than its 2 dimensions: treat",
        ),
        (
            (pair, contact_surface(other, names["lower_bottom"])),
            "joined_surfaces: give surfaces of .* of one system",
        ),
        ((), "joined_surfaces: give surfaces of"),
        ((pair, empty_surface(system.space.comm, 2)), "joined_surfaces: give surfaces of"),
    ):
        with pytest.raises(InputError, match=sentence):
            joined_surfaces(*surfaces)
    assert joined_surfaces(pair, slope).dual is not None  # directions at any angle
    assert joined_surfaces(pair, chain).total == 10  # side 2 may touch an obstacle


def test_a_node_on_both_sides():
    """Three blocks about a point: one of them is on side 1 of a pair and on side 2 of another at
    the same node. The conditions are traces then, each relative to the right body, and those with
    the sides exchanged, but for the sign of the slip."""
    parts = {
        name: BlockMesh(divisions=(2, 2), corner=corner)
        for name, corner in {"sw": (0.0, 0.0), "se": (1.0, 0.0), "ne": (1.0, 1.0)}.items()
    }
    mesh, tags = build_mesh(Blocks(parts), COMM)
    system = assemble(mesh, SOFT)
    first = contact_pair(system, tags["sw_right"], tags["se_left"])
    good = joined_surfaces(first, contact_pair(system, tags["ne_bottom"], tags["se_top"]))
    chain = joined_surfaces(first, contact_pair(system, tags["se_top"], tags["ne_bottom"]))
    assert good.total == chain.total == 6 and good.traces is None and chain.traces is not None
    u = per_body(system, wavy, linear, cubic)
    values = []
    for surface in (good, chain):
        x = relative(ContactProblem(system, surface), u)
        values.append((seen(surface).normal_values(x), seen(surface).tangential_values(x)))
    assert values[1][0] == pytest.approx(values[0][0], abs=1e-12)
    slips = values[0][1] * np.repeat([1.0, -1.0], 3)[:, None]  # tangents stay along the axes
    assert values[1][1] == pytest.approx(slips, abs=1e-12)
    with pytest.raises(InputError, match="faces a node of another contact pair that faces it"):
        joined_surfaces(first, contact_pair(system, tags["se_left"], tags["sw_right"]))
