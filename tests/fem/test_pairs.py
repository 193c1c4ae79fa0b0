"""Contact between two deformable bodies: relative unknowns, action and reaction, gaps, rigid
obstacles, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import field, held_by, max_over_ranks, run, turned
from mpi4py import MPI
from two_bodies import SOFT, blocks, forces, per_body, relative, thrown, two_blocks

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact import matching
from vi_contact.fem.contact.matching import NodeToNode
from vi_contact.fem.contact.nodes import Nodes
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import CutOpen
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.trapezoidal import Trapezoidal

COMM = MPI.COMM_WORLD
CASES: dict[str, dict[str, Any]] = {
    "bar": {"d": 1},
    "quadrilaterals": {"d": 2},
    "triangles": {"d": 2, "simplices": True, "angle": 0.4},
    "hexahedra": {"d": 3},
    "tetrahedra": {"d": 3, "simplices": True, "angle": 0.4},
}
cases = pytest.mark.parametrize("name", CASES)


def paired(name: str, comm: Any = COMM, *, gap: float = 0.0, **data: Any) -> ContactProblem:
    mesh = blocks(**CASES[name], gap=gap)
    system, tags = two_blocks(comm, mesh, **data)
    return ContactProblem(system, contact_pair(system, *(tags[side] for side in mesh.interface)))


def wavy(x: Array) -> Array:
    return np.cos(2.0 * x + 0.3) + x[:, ::-1] ** 2


def linear(x: Array) -> Array:
    d = x.shape[1]
    return x @ np.arange(1.0, d * d + 1.0).reshape(d, d)


def of_body(problem: ContactProblem, u: Array, body: int) -> tuple[Array, Array]:
    """(points, values) of a Cartesian vector at the nodes of one body."""
    system = problem.system
    inside = field(system, (system.space.bodies == body).astype(float))[1][:, 0] > 0.0
    points, values = field(system, u)
    return points[inside], values[inside]


# Relative unknowns
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@cases
def test_unknowns_are_relative_displacements(name):
    """B_n ǔ = (u_1 - u_2)·n and |B_t ǔ| = |tangential part| for any two fields on the bodies; all
    else as it was."""
    problem = paired(name)
    system, surface = problem.system, problem.surface
    u = per_body(system, wavy, linear)  # lower, upper: the upper block is side 1
    x = relative(problem, u)
    assert max_over_ranks(COMM, problem.cartesian(x) - u) < 1e-13 * max_over_ranks(COMM, u)
    jump = linear(seen(surface).points) - wavy(seen(surface).points)
    normal = np.sum(jump * seen(surface).normals, axis=1)
    assert seen(surface).normal_values(x) == pytest.approx(normal, abs=1e-13 * np.abs(jump).max())
    along = np.linalg.norm(jump - normal[:, None] * seen(surface).normals, axis=1)
    assert np.linalg.norm(seen(surface).tangential_values(x), axis=1) == pytest.approx(
        along, abs=1e-12
    )
    d = system.space.dimension
    down = np.zeros(d)
    down[: min(d, 2)] = turned((0.0, -1.0), CASES[name].get("angle", 0.0)) if d > 1 else -1.0
    assert seen(surface).normals == pytest.approx(
        np.tile(down, (seen(surface).count, 1)), abs=1e-13
    )
    assert seen(surface).count == np.prod(
        np.delete(np.add(blocks(d).upper.divisions, 1), 0 if d == 1 else 1)
    )
    assert not seen(surface).gap0.any() and seen(surface).weights.sum() == pytest.approx(
        {1: 1.0, 2: 1.5, 3: 1.8}[d]
    )


@cases
def test_relative_system_is_the_same_system(name):
    """Energies, work of loads and inertia loads do not depend on the unknowns."""
    d = CASES[name]["d"]
    pull = {"loads": BodyForce(tuple(np.arange(1.0, d + 1.0)))}
    problem = paired(
        name, initial_displacement=lambda x: 1e-2 * linear(x), initial_velocity=wavy, **pull
    )
    system, other = problem.system, problem.equations
    assert other.kinetic_energy(other.v0) == pytest.approx(
        system.kinetic_energy(system.v0), rel=1e-13
    )
    assert other.strain_energy(other.u0) == pytest.approx(
        system.strain_energy(system.u0), rel=1e-12
    )
    work = system.algebra.dot(system.load(0.0), system.v0)
    assert other.algebra.dot(other.load(0.0), other.v0) == pytest.approx(work, rel=1e-13)
    for a, b in zip(other.influence.T, system.influence.T, strict=True):
        assert max_over_ranks(COMM, problem.cartesian(a) - b) < 1e-13
    opening = seen(problem.surface).normal_values(other.influence[:, 0])
    assert np.abs(opening).max() < 1e-13  # a common motion opens nothing


@cases
def test_action_is_reaction(name):
    """Any reactions push with r on the nodes of side 1 and with -r on those of side 2: force and
    moment of the pair vanish, each body feels their sum."""
    problem = paired(name)
    system, surface = problem.system, problem.surface
    random = np.random.default_rng(3)
    m, k = surface.total, surface.tangents.shape[1]
    r_n, r_t = random.random(m), random.standard_normal((m, k))
    push = forces(problem, seen(surface).reaction_load(r_n, system.rows, r_t))
    upper = field(system, (system.space.bodies == 1).astype(float))[1][:, 0] > 0.0
    total = push[upper].sum(axis=0)
    assert push[~upper].sum(axis=0) == pytest.approx(-total, abs=1e-13)
    points = field(system, system.u0)[0]
    moment = np.einsum("ki,kj->ij", points, push)
    assert np.abs(moment - moment.T).max() < 1e-13
    assert total @ seen(surface).normals[0] == pytest.approx(r_n.sum(), rel=1e-13)
    assert np.count_nonzero(np.abs(push).max(axis=1)) == 2 * seen(surface).count


def test_gaps_and_listed_points():
    """Gap along the normal, partners opposite; only the nodes listed, in their order; weights times
    the thickness."""
    mesh = blocks(2, gap=0.25, angle=0.4)
    system, tags = two_blocks(COMM, mesh)
    one, two = (tags[side] for side in mesh.interface)
    surface = contact_pair(system, one, two)
    assert seen(surface).gap0 == pytest.approx(np.full(5, 0.25), rel=1e-12)
    assert seen(contact_pair(system, two, one)).normals == pytest.approx(
        -seen(surface).normals, abs=1e-13
    )
    points = turned([(1.5, 1.25), (0.375, 1.25)], 0.4)
    listed = contact_pair(system, one, two, points=points)
    assert seen(listed).points == pytest.approx(points, abs=1e-12)
    u = per_body(system, lambda x: 0.1 * x, linear)
    x = relative(ContactProblem(system, listed), u)
    below = seen(listed).points + 0.25 * seen(listed).normals
    expected = np.sum((linear(seen(listed).points) - 0.1 * below) * seen(listed).normals, axis=1)
    assert seen(listed).normal_values(x) == pytest.approx(expected, rel=1e-12)


def rings(n: int = 12) -> Blocks:
    """Half a ring inside another one, 0.1 apart."""

    def bend(x: Array) -> Array:
        return np.column_stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])])

    def ring(radius: float) -> BlockMesh:
        return BlockMesh(lengths=(1.0, np.pi), divisions=(2, n), corner=(radius, 0.0), deform=bend)

    return Blocks({"inner": ring(1.0), "outer": ring(2.1)})


@pytest.mark.two_ranks
def test_curved_sides_pair_along_their_normals():
    """Rings one inside the other: radial partners, gap 0.1; at the ends, where the normal of the
    last chord is half an angle off, its component."""
    system, tags = two_blocks(COMM, rings())
    surface = contact_pair(
        system, tags["inner_right"], tags["outer_left"], matching=NodeToNode(0.05)
    )
    half = np.pi / 24.0
    ends = np.isclose(np.abs(seen(surface).points[:, 0]), 2.0)
    assert seen(surface).gap0 == pytest.approx(np.where(ends, 0.1 * np.cos(half), 0.1), rel=1e-12)
    assert ends.sum() == 2 and seen(surface).count == 13


def test_a_crack_rubs_on_itself():
    """A crack inside one body: its tip, one node for both faces, has no condition; its faces are
    relative to each other."""

    class Cracked:
        def build(self, gmsh: Any) -> None:
            BlockMesh(lengths=(4.0, 2.0), divisions=(4, 2)).build(gmsh)
            line = gmsh.model.addDiscreteEntity(1)
            gmsh.model.mesh.addElementsByType(line, 1, [], [6, 7, 7, 8])
            gmsh.model.setPhysicalName(1, gmsh.model.addPhysicalGroup(1, [line]), "crack")

    mesh, tags = build_mesh(CutOpen(Cracked(), "crack", towards=(0.0, 1.0)), COMM)
    system = assemble(mesh, SOFT)
    problem = ContactProblem(system, contact_pair(system, tags["crack_1"], tags["crack_2"]))
    surface = problem.surface
    assert sorted(seen(surface).points.tolist()) == [[0.0, 1.0], [1.0, 1.0]]
    assert seen(surface).normals == pytest.approx(np.tile([0.0, 1.0], (2, 1)), abs=1e-13)
    smooth = relative(problem, system.space.restrict(wavy(system.space.points)))
    assert np.abs(seen(surface).normal_values(smooth)).max() < 1e-14


# Bodies that do not deform
# --------------------------------------------------------------------------------------------


def thrown_down(problem: ContactProblem, angle: float) -> ContactProblem:
    def down(x: Array) -> Array:
        return np.outer(2.0 + x[:, 0], turned((0.0, -1.0), angle)) + 0.3 * turned((1.0, 0.0), angle)

    def rest(x: Array) -> Array:
        return np.zeros_like(x)

    return replace(problem, system=thrown(problem.system, rest, down))


@pytest.mark.two_ranks
@pytest.mark.parametrize("friction", [None, Coulomb(0.4)], ids=["smooth", "rough"])
@pytest.mark.parametrize("moves", [False, True], ids=["rest", "moving"])
def test_a_body_held_everywhere_is_an_obstacle(moves, friction):
    """The upper block thrown on a lower one that is prescribed all over does what it does on the
    half-space, at rest and moving: same displacements (1e-10) and reactions (1e-9). With friction
    on redistributed mass."""
    angle, speed = 0.4, turned((0.4, 0.7), 0.4)
    mesh = blocks(2, gap=1e-3, angle=angle)

    def shift(x: Array, t: float) -> Array:
        return np.tile(1e-2 * np.sin(20.0 * t) * speed, (len(x), 1))

    def rate(x: Array, t: float) -> Array:
        return np.tile(0.2 * np.cos(20.0 * t) * speed, (len(x), 1))

    def bend(x: Array, t: float) -> Array:
        return np.tile(-4.0 * np.sin(20.0 * t) * speed, (len(x), 1))

    def hold(tags: Any) -> list[Prescribed]:
        motion = {"displacement": shift, "velocity": rate, "acceleration": bend} if moves else {}
        return [
            Prescribed(tags[f"lower_{side}"], **motion)
            for side in ("left", "right", "bottom", "top")
        ]

    system, tags = two_blocks(COMM, mesh, prescribed=hold)
    one, two = (tags[side] for side in mesh.interface)
    pair = contact_pair(system, one, two)
    foot, up = turned((0.0, 1.0), angle), turned((0.0, 1.0), angle)
    alone = contact_surface(system, one, obstacle=HalfSpace(point=tuple(foot), normal=tuple(up)))
    if moves:
        problem = ContactProblem(system, alone)
        along = relative(problem, system.influence @ speed)
        t0 = seen(alone).tangential_values(along)[:1]
        alone = alone.moving(
            towards=lambda t: 1e-2 * np.sin(20.0 * t) * float(speed @ up),
            along=lambda t: 1e-2 * np.sin(20.0 * t) * t0,
        )
    found, expected = (
        run(
            thrown_down(
                ContactProblem(
                    system, surface, **({} if friction is None else {"friction": friction})
                ),
                angle,
            ),
            scheme=Midpoint() if friction is None else Trapezoidal(),
            dt=2e-3,
            steps=40,
        )
        for surface in (pair, alone)
    )
    assert expected.active.any() and not expected.active.all()
    assert np.abs(found.u - expected.u).max() < 1e-10 * np.abs(expected.u).max()
    assert np.abs(found.r_n - expected.r_n).max() < 1e-9 * expected.r_n.max()
    assert found.certificate.max() <= 1e-9


@pytest.mark.parametrize("held", [(0,), (1,)])
def test_held_components_of_partners_drop_out(held):
    """Rollers under the interface: the relative unknown keeps the free component of the partner
    only."""
    mesh = blocks(2, angle=0.0)
    system, tags = two_blocks(
        COMM, mesh, prescribed=lambda tags: Prescribed(tags["lower_top"], components=held)
    )
    problem = ContactProblem(system, contact_pair(system, *(tags[side] for side in mesh.interface)))
    u = per_body(system, wavy, linear)
    kept = np.ones(2)
    kept[list(held)] = 0.0
    jump = linear(seen(problem.surface).points) - kept * wavy(seen(problem.surface).points)
    x = relative(problem, u)
    assert seen(problem.surface).normal_values(x) == pytest.approx(-jump[:, 1], abs=1e-12)
    assert np.abs(seen(problem.surface).tangential_values(x))[:, 0] == pytest.approx(
        np.abs(jump[:, 0]), abs=1e-12
    )


@pytest.mark.two_ranks
def test_nodes_clamped_on_both_sides_are_left_out():
    mesh = blocks(2)
    system, tags = two_blocks(
        COMM, mesh, clamped=lambda tags: [tags["lower_left"], tags["upper_left"]]
    )
    surface = contact_pair(system, *(tags[side] for side in mesh.interface))
    assert seen(surface).count == 4 and seen(surface).points[:, 0].min() > 0.0


# Refusals, each with its sentence, on all ranks
# -----------------------------------------------------------------------


def test_partners_are_looked_for_nearby():
    """On two waved faces, touching or apart, a table holds the few nodes next to each one; partners
    are those that all nodes of the other side would give."""
    x = np.stack(
        np.meshgrid(np.linspace(0.0, 1.0, 24), np.linspace(0.0, 2.0, 24)), axis=-1
    ).reshape(-1, 2)
    x = np.column_stack([x, 0.1 * np.sin(6.0 * x[:, 0])])
    normals = np.column_stack([-0.6 * np.cos(6.0 * x[:, 0]), np.zeros(len(x)), np.ones(len(x))])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    order, looked = np.random.default_rng(1).permutation(len(x)), []

    def side(points, directions):
        none = np.zeros(len(points))
        return matching.Side("side", Nodes(none, points, directions, none, none, none), none)

    def opposite(one, two, places, reach):
        looked.append(places.size)
        return plain(one, two, places, reach)

    with pytest.MonkeyPatch.context() as patch:
        plain = matching._find_opposite
        patch.setattr(matching, "_find_opposite", opposite)
        for gap in (0.0, 0.01):
            other = side((x + gap * normals)[order], -normals[order])
            found = NodeToNode().match(side(x, normals), other, 2.0).P.indices
            assert np.array_equal(order[found], np.arange(len(x)))
    assert looked == [matching.NEARBY * len(x)] * 2


def test_sides_that_do_not_pair():
    system, tags = two_blocks(COMM, blocks(2, lower=(5, 2)))
    one, two = tags["upper_bottom"], tags["lower_top"]
    with pytest.raises(
        InputError, match="3 of 5 nodes of 'upper_bottom' have no node of 'lower_top' opposite"
    ):
        contact_pair(system, one, two)
    system, tags = two_blocks(COMM, blocks(2, offset=(0.375,)))
    sentence = (
        r"1 of 5 nodes of 'lower_top' have no node of 'upper_bottom' opposite, the first at "
        r"\(0, 1\): mesh both"
    )
    with pytest.raises(InputError, match=sentence):
        contact_pair(system, tags["lower_top"], tags["upper_bottom"])
    with pytest.raises(
        InputError, match=r"several nodes of 'upper_bottom' face the node of 'lower_top' at \(0"
    ):
        system, tags = two_blocks(COMM, blocks(2, lower=(2, 2)))
        contact_pair(system, tags["upper_bottom"], tags["lower_top"], matching=NodeToNode(1.1))


@pytest.mark.two_ranks
def test_sides_that_do_not_face_each_other():
    system, tags = two_blocks(COMM, blocks(2))
    with pytest.raises(
        InputError,
        match=r"'lower_bottom' does not face 'upper_bottom' at \(.*\), where both outward",
    ):
        contact_pair(system, tags["upper_bottom"], tags["lower_bottom"])
    with pytest.raises(
        InputError,
        match=r"'lower_bottom' lies 2 m behind 'upper_top' at \(0, 2\): the bodies overlap",
    ):
        contact_pair(system, tags["upper_top"], tags["lower_bottom"])
    system, tags = two_blocks(COMM, blocks(2, gap=-0.01))
    with pytest.raises(InputError, match=r"'lower_top' lies 0.01 m behind 'upper_bottom' at"):
        contact_pair(system, tags["upper_bottom"], tags["lower_top"])


@pytest.mark.two_ranks
def test_one_boundary_is_no_pair():
    system, tags = two_blocks(COMM, blocks(2))
    with pytest.raises(
        InputError, match="'upper_bottom' and 'upper_bottom' are the same nodes, so that nothing"
    ):
        contact_pair(system, tags["upper_bottom"], tags["upper_bottom"])


@pytest.mark.two_ranks
def test_inner_boundaries():
    class Uncut:
        def build(self, gmsh: Any) -> None:
            BlockMesh(lengths=(4.0, 2.0), divisions=(4, 2)).build(gmsh)
            line = gmsh.model.addDiscreteEntity(1)
            gmsh.model.mesh.addElementsByType(line, 1, [], [6, 7, 7, 8])
            gmsh.model.setPhysicalName(1, gmsh.model.addPhysicalGroup(1, [line]), "joint")

    mesh, tags = build_mesh(Uncut(), COMM)
    system = assemble(mesh, SOFT)
    with pytest.raises(
        InputError, match="boundary group 'joint' lies inside the body, where cells on"
    ):
        contact_pair(system, tags["joint"], tags["joint"])


def test_clamped_nodes_and_directions():
    system, tags = two_blocks(COMM, blocks(2), clamped=lambda tags: tags["upper_left"])
    sentence = (
        r"contact node \(0, 1\) of 'upper_bottom' is fixed but faces a free node of "
        r"'lower_top': make"
    )
    with pytest.raises(InputError, match=sentence):
        contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    assert contact_pair(system, tags["lower_top"], tags["upper_bottom"]).total == 5
    system, tags = two_blocks(
        COMM, blocks(2), prescribed=lambda tags: held_by(tags, "upper_left", wavy, 1)
    )
    with pytest.raises(
        InputError, match=r"contact node \(0, 1\) is also prescribed along its contact direction"
    ):
        contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    clamped = {"clamped": lambda tags: [tags["upper_bottom"], tags["lower_top"]]}
    system, tags = two_blocks(COMM, blocks(2), **clamped)
    with pytest.raises(
        InputError, match="no contact nodes: every node of 'upper_bottom' that faces 'lower_top' is"
    ):
        contact_pair(system, tags["upper_bottom"], tags["lower_top"])


@pytest.mark.two_ranks
def test_system_of_another_kind():
    from chain import chain_system

    _, tags = two_blocks(COMM, blocks(1))
    with pytest.raises(InputError, match="contact_pair needs a system made by fem.assemble"):
        contact_pair(chain_system(), tags["upper_left"], tags["lower_right"])


def test_every_body_has_its_own_initial_velocity():
    """(cells, value) pairs: nodes at the same place move with their own body."""
    mesh, tags = build_mesh(blocks(2), COMM)

    def flying(x: Array) -> Array:
        return np.column_stack([x[:, 1], 0.0 * x[:, 0]])

    system = assemble(
        mesh, SOFT, initial_velocity=[(tags["upper"], (0.0, -1.0)), (tags["lower"], flying)]
    )
    assert np.array_equal(
        system.v0, per_body(system, flying, lambda x: np.tile([0.0, -1.0], (len(x), 1)))
    )
