"""Dual mortar coupling of sides in space that are not meshed alike: linear fields, forces and
moments, partial overlap, several layers, curved sides, the patch test (V2.1), sliding, thrown
bodies, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import field, held_by, max_over_ranks, run
from mpi4py import MPI
from turned_blocks import rotation, unlike
from two_bodies import SOFT, forces, momenta, per_body, relative, thrown, two_blocks

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact.clipping import areas, hats, intersect, rule, subtract
from vi_contact.fem.contact.joined import joined_surfaces
from vi_contact.fem.contact.matching import Matched, Side
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.nodes import Nodes, join_nodes
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import Facets, build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.iterative import Iterative
from vi_contact.solvers.volume.route import ReducedNewton, Volume

COMM = MPI.COMM_WORLD
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["hexahedra", "tetrahedra"])
facets = pytest.mark.parametrize("kinds", ["tt", "qq", "tq", "qt"])
serial = pytest.mark.serial


TURN = rotation(1)


def face(
    kind: str,
    divisions: tuple[int, int],
    *,
    up: bool,
    size: tuple[float, float] = (1.0, 1.0),
    height: float = 0.0,
    corner: tuple[float, float] = (0.0, 0.0),
    distorted: float = 0.3,
    bend: Any = None,
    name: str = "face",
) -> Side:
    """A side of triangles ("t") or quadrilaterals ("q") in the plane z = height, bent, then turned;
    nodal normals are means over the facets, weights ∫ phi_i where it is plane."""
    x = np.stack(
        np.meshgrid(*(np.linspace(0.0, 1.0, n + 1) for n in divisions), indexing="ij"), axis=-1
    )
    moved = distorted * (np.random.default_rng(sum(divisions)).random(x.shape) - 0.5) / divisions
    moved[[0, -1], :, 0] = moved[:, [0, -1], 1] = 0.0
    plane = (x + moved).reshape(-1, 2) * size + corner
    points = np.column_stack([plane, np.full(len(plane), height)])
    points = (points if bend is None else bend(points)) @ TURN.T
    ids = np.arange(len(points)).reshape(x.shape[:2])
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(
        -1, 4
    )
    rows = quads if kind == "q" else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    corners = points[rows]
    normals, weights = np.zeros_like(points), np.zeros(len(points))
    for i in range(rows.shape[1]):
        turned = np.cross(
            np.roll(corners, -1, axis=1)[:, i] - corners[:, i], corners[:, i - 1] - corners[:, i]
        )
        np.add.at(normals, rows[:, i], turned if up else -turned)
        # ∫ phi_i of bilinear functions: 4/36, 2/36, 1/36, 2/36 of the parallelograms
        for j in range(rows.shape[1]):
            share = 1.0 / 18.0 if kind == "t" else (4.0, 2.0, 1.0, 2.0)[j - i] / 36.0
            np.add.at(weights, rows[:, j], share * np.linalg.norm(turned, axis=1))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    numbers, held = np.arange(len(points)) + 1000 * up, np.zeros(points.shape, dtype=bool)
    return Side(
        name,
        Nodes(numbers, points, normals, weights, held, np.zeros(points.shape, dtype=np.int64)),
        rows,
    )


def faced(kinds: str, one: dict[str, Any], two: dict[str, Any]) -> tuple[Side, Side, Matched]:
    """(side 1, seen from above, side 2 below it, what they share)"""
    sides = face(kinds[0], (5, 4), up=False, **one), face(kinds[1], (3, 6), up=True, **two)
    return (*sides, DualMortar().match(*sides, 1.0))


def offset(one: Side, two: Side, found: Matched) -> tuple[Array, Array]:
    """(distance along the normal, what lies beside the normal) of what every node faces."""
    away = found.P @ two.nodes.points - one.nodes.points[found.rows]
    normals = one.nodes.normals[found.rows]
    along = np.sum(away * normals, axis=1)
    return along, away - along[:, None] * normals


# Polygons
# --------------------------------------------------------------------------------------------------


@serial
def test_polygons():
    """Areas of what random quadrilaterals and triangles share, and of what is outside, make up the
    whole; what they share does not depend on which is cut; integrals of polynomials and of shape
    functions are exact."""
    random = np.random.default_rng(5)
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    one = square + 0.3 * random.random((200, 4, 2))
    two = np.array([(0.2, -0.3), (1.4, 0.5), (-0.1, 0.8)]) + 0.3 * random.random((200, 3, 2))
    common = areas(intersect(one, two))
    assert common.min() > 0.1 and common == pytest.approx(areas(intersect(two, one)), rel=1e-12)
    owner, parts = subtract(one, two, np.zeros(200))
    assert np.bincount(owner, areas(parts), 200) + common == pytest.approx(areas(one))
    assert not areas(intersect(one, two + 9.0)).any()
    places, weights = rule(3)
    x, y = places[:, 0], places[:, 1]
    # 2 a! b! / (a + b + 2)!
    assert weights @ (x**2 * y**2) == pytest.approx(2.0 * 4.0 / 720.0, rel=1e-14)
    inner = np.einsum("qc,kcx->kqx", places, one[:, :3])
    assert np.einsum("kqv,kvx->kqx", hats(one, inner), one) == pytest.approx(inner, abs=1e-14)


# The matrix P
# --------------------------------------------------------------------------------------------------


@serial
@facets
@pytest.mark.parametrize("distorted", [0.0, 0.4])
def test_linear_fields_and_uniform_pressure(kinds, distorted):
    """Rows of P sum to 1 and reproduce positions; the nodal forces of a uniform pressure on side 1
    arrive as those of the same pressure on side 2."""
    one, two, found = faced(kinds, {"distorted": distorted}, {"distorted": distorted})
    assert np.array_equal(found.rows, np.arange(30))
    assert np.asarray(found.P.sum(axis=1)).ravel() == pytest.approx(np.ones(30), abs=1e-13)
    assert found.P @ two.nodes.points == pytest.approx(one.nodes.points, abs=1e-13)
    assert found.weights == pytest.approx(one.nodes.weights, rel=1e-10)
    assert found.P.T @ found.weights == pytest.approx(two.nodes.weights, rel=1e-10)


@serial
@facets
@pytest.mark.parametrize("corner", [(0.33, 0.21), (0.5, 0.0), (-0.41, 0.77)])
def test_partly_covered_sides(kinds, corner):
    """A small face before a large one, at any place, over the ends, seen from either: weights are
    positive and sum to the area that they share, a uniform pressure on it arrives as the same force
    at the same place."""
    size = (0.6, 0.5)
    low, high = np.maximum(corner, 0.0), np.minimum(np.add(corner, size), 1.0)
    small, large = {"corner": corner, "size": size}, {}
    for one, two, found in (faced(kinds, small, large), faced(kinds, large, small)):
        area = np.prod(high - low)
        assert found.weights.min() > 0.0 and found.weights.sum() == pytest.approx(area, rel=1e-12)
        assert found.P @ two.nodes.points == pytest.approx(one.nodes.points[found.rows], abs=1e-11)
        force = found.P.T @ found.weights
        assert force.sum() == pytest.approx(area, rel=1e-12)
        middle = TURN @ [*(0.5 * (low + high)), 0.0]
        assert force @ two.nodes.points == pytest.approx(area * middle, abs=1e-12)


@serial
@facets
@pytest.mark.parametrize("length", [1.0, 0.7])
def test_only_what_is_nearest_counts(kinds, length):
    """A slanting step above a part of side 2: weights arrive there, and on the rest as before, also
    where side 2 ends below the step."""

    def slanting(x: Array) -> Array:
        return x + np.outer(0.3 * x[:, 0], [0.0, 0.0, 1.0])

    low = face(kinds[1], (3, 6), up=True, size=(length, 1.0), bend=slanting)
    step = face(
        kinds[1], (4, 2), up=True, size=(0.5, 0.4), corner=(0.3, 0.2), height=0.1, bend=slanting
    )
    count = len(low.nodes.numbers)
    upper = replace(step.nodes, numbers=step.nodes.numbers + count)
    two = Side(
        "both", join_nodes([low.nodes, upper]), np.concatenate([low.facets, step.facets + count])
    )
    one = face(kinds[0], (5, 4), up=False, height=0.5)
    found = DualMortar().match(one, two, 1.0)
    force = found.P.T @ found.weights
    below = length - 0.4 * (min(length, 0.8) - 0.3)
    assert force[count:].sum() == pytest.approx(0.2, rel=1e-12)
    assert force[:count].sum() == pytest.approx(below, rel=1e-12)
    assert force[count:] @ step.nodes.points == pytest.approx(
        0.2 * TURN @ [0.55, 0.4, 0.1 + 0.3 * 0.55], abs=1e-12
    )
    assert np.abs(offset(one, two, found)[1]).max() < 1e-12


@serial
@facets
def test_a_hidden_layer_of_the_same_outline_is_not_felt(kinds):
    """Two layers with one outline, whose facets have edges in common up to round-off: only the near
    one counts."""
    near, far = (face(kinds[1], (4, 4), up=True, height=height) for height in (-0.05, -0.1))
    count = len(near.nodes.numbers)
    behind = replace(far.nodes, numbers=far.nodes.numbers + count)
    two = Side(
        "both",
        join_nodes([near.nodes, behind]),
        np.concatenate([near.facets, far.facets + count]),
    )
    one = face(kinds[0], (4, 4), up=False)
    found, alone = (DualMortar().match(one, side, 1.0) for side in (two, near))
    assert found.weights == pytest.approx(alone.weights, rel=1e-12)
    assert (
        np.abs((found.P[:, :count] - alone.P).toarray()).max() < 1e-12
        and abs(found.P[:, count:]).max() < 1e-12
    )


@pytest.mark.two_ranks
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_sides_of_a_block_do_not_see_the_ground_beside_it(gap):
    """Side 1 is the bottom of a block, or the bottom and all vertical sides: the same
    conditions."""
    upper = BlockMesh(lengths=(1.0,) * 3, divisions=(3,) * 3)
    lower = BlockMesh(lengths=(2.0, 1.0, 2.0), divisions=(4, 2, 5))
    mesh, tags = build_mesh(
        TwoBlocks(upper=upper, lower=lower, offset=(0.5, 0.5), gap=gap), MPI.COMM_WORLD
    )
    system = assemble(mesh, LinearElastic(E=1e6, nu=0.3, rho=1e3), clamped=tags["lower_bottom"])
    sides = [tags[f"upper_{name}"].indices for name in ("bottom", "left", "right", "front", "back")]
    bottom, all_sides = (
        contact_pair(
            system,
            Facets("block", np.unique(np.concatenate(some)), mesh),
            tags["lower_top"],
            matching=DualMortar(),
        )
        for some in (sides[:1], sides)
    )
    assert all_sides.total == bottom.total == 16
    for name in ("normals", "weights", "gap0"):
        one, other = (getattr(seen(surface), name) for surface in (all_sides, bottom))
        assert one == pytest.approx(other, abs=1e-12)


def dome(radius: float) -> Any:
    def bend(x: Array) -> Array:
        a, b = 1.2 * (x[:, :2] - 0.5).T
        return radius * np.column_stack([np.sin(a) * np.cos(b), np.sin(b), -np.cos(a) * np.cos(b)])

    return bend


@serial
@facets
@pytest.mark.parametrize("gap", [0.0, 0.1, 3.0])
def test_curved_sides(kinds, gap):
    """Facets of two spheres: what a node faces lies on its normal, whatever the gap, so that normal
    forces have no moment; gaps are right to the height of the caps between facets and sphere."""
    one, two, found = faced(kinds, {"bend": dome(1.0)}, {"bend": dome(1.0 + gap)})
    along, beside = offset(one, two, found)
    assert len(found.rows) == 30 and np.abs(beside).max() < 1e-14 * (1.0 + gap)
    longest = [
        np.ptp(side.nodes.points[side.facets], axis=1).max() * np.sqrt(3.0) for side in (one, two)
    ]
    assert np.abs(along - gap).max() < longest[0] ** 2 / 8.0 + longest[1] ** 2 / 8.0 / (1.0 + gap)
    assert np.asarray(found.P.sum(axis=1)).ravel() == pytest.approx(np.ones(30), abs=1e-13)
    assert (along + found.overlap).min() > 0.0


@serial
def test_matching_sides_are_the_special_case():
    """On sides that are meshed alike P is the identity, on distorted quadrilaterals too."""
    for kind in "tq":
        one, two = face(kind, (5, 4), up=False), face(kind, (5, 4), up=True)
        found = DualMortar().match(one, two, 1.0)
        assert np.abs(found.P - np.eye(30)).max() < 1e-12


# Bodies
# --------------------------------------------------------------------------------------------------

FINER = ((3, 5, 4), (5, 5, 4))


def paired(mesh: TwoBlocks, comm: Any = COMM, swapped: bool = False, **data: Any) -> ContactProblem:
    friction = data.pop("friction", None)
    mass = data.pop("mass", None)
    system, tags = two_blocks(comm, mesh, **data)
    sides = [tags[side] for side in mesh.interface]
    surface = contact_pair(system, *(sides[::-1] if swapped else sides), matching=DualMortar())
    return ContactProblem(
        system, surface, mass=mass, **({} if friction is None else {"friction": friction})
    )


P = 1.0e8
STEEL, BRASS = (
    LinearElastic(E=2.1e11, nu=0.3, rho=7850.0),
    LinearElastic(E=1.0e11, nu=0.2, rho=8400.0),
)


@shapes
@pytest.mark.parametrize("swapped", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_v2_1_pressure_through_meshes_that_do_not_match(simplices, swapped):
    """Steel on brass, turned in space, distorted: pressure p across the interface; displacements
    and pressures at every node to 1e-10."""
    mesh, turn = unlike(turn=2, simplices=simplices, distorted=(0.08, -0.1)), rotation(2)

    def uniform(material: LinearElastic, height: float = 0.0) -> Any:
        strain = P / material.E * np.array([material.nu, -1.0, material.nu])
        return lambda x: (x @ turn * strain + [0.0, height, 0.0]) @ turn.T

    lower, upper = uniform(BRASS), uniform(STEEL, P / STEEL.E - P / BRASS.E)
    built, tags = build_mesh(mesh, COMM)
    hold = [held_by(tags, "lower_bottom", lower), held_by(tags, "upper_top", upper)]
    system = assemble(built, [(tags["lower"], BRASS), (tags["upper"], STEEL)], prescribed=hold)
    pair = [tags[side] for side in mesh.interface]
    surface = contact_pair(system, *(pair[::-1] if swapped else pair), matching=DualMortar())
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=Condensed())
    exact = per_body(system, lower, upper)
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-10 * max_over_ranks(
        COMM, exact
    )
    assert seen(surface).all(state.active).all() and surface.total == 12
    assert np.abs(seen(surface).all(state.r_n) / seen(surface).weights / P - 1.0).max() < 1e-10


@shapes
def test_action_is_reaction(simplices):
    """Force and moment of the pair vanish for any reactions, tangential ones included, on sides
    that partly overlap."""
    problem = paired(unlike(turn=3, simplices=simplices, distorted=(0.0, 0.05), offset=(0.4, -0.3)))
    surface = seen(problem.surface)
    random = np.random.default_rng(3)
    r_n, r_t = random.random(surface.count), random.standard_normal((surface.count, 2))
    push = forces(problem, surface.reaction_load(r_n, problem.system.rows, r_t))
    moment = np.einsum("ki,kj->ij", field(problem.system, problem.system.u0)[0], push)
    assert np.abs(push).max() > 0.1
    assert np.abs(push.sum(axis=0)).max() < 1e-12 and np.abs(moment - moment.T).max() < 1e-12
    assert surface.weights.sum() == pytest.approx(1.1 * 0.9, rel=1e-12)


def sliding(comm: Any, turn: int, mu: float) -> ContactProblem:
    """A block that slides down a longer one, inclined by 30 degrees and turned in space as a
    whole."""
    down = 9.81e3 * rotation(turn) @ [0.5, -np.sqrt(0.75), 0.0]
    mesh = unlike(turn=turn, upper=(0.8, 0.5, 0.7), offset=(0.2, 0.3), divisions=FINER)
    problem = paired(
        mesh,
        comm,
        friction=Coulomb(mu),
        mass=Redistributed(),
        loads=BodyForce(tuple(down)),
        clamped=lambda tags: tags["lower_bottom"],
    )
    push = rotation(turn) @ [0.5, -0.3, 0.1]
    system = thrown(problem.system, np.zeros_like, lambda x: np.tile(push, (len(x), 1)))
    return replace(problem, system=system)


@pytest.mark.long
@pytest.mark.serial
def test_a_block_slides_down_a_plane_alike_in_any_orientation():
    """Displacements and forces turned back are the same to 1e-9, on all ranks together as on each
    alone."""
    first, found = (
        run(sliding(comm, turn, 0.3), scheme=Trapezoidal(), dt=1e-3, steps=8)
        for comm, turn in ((MPI.COMM_SELF, 0), (COMM, 4))
    )
    assert first.active.any() and first.certificate.max() <= 1e-9
    friction = sliding(MPI.COMM_SELF, 0, 0.3).surface.everywhere(first.state.r_t)
    # all of it slides
    assert np.linalg.norm(friction, axis=1) == pytest.approx(0.3 * first.r_n[-1], rel=1e-9)
    assert np.abs(found.u @ rotation(4) - first.u).max() < 1e-9 * np.abs(first.u).max()
    assert np.abs(found.r_n - first.r_n).max() < 1e-9 * first.r_n.max()


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "scheme",
    [(Midpoint(), ConsistentMass()), (Trapezoidal(), Redistributed())],
    ids=["midpoint", "trapezoidal"],
)
def test_what_one_body_gains_the_other_loses(scheme):
    """V9.8: momentum and angular momentum of two bodies thrown at each other, with curved sides of
    warped facets, are kept to 1e-12 over the collision."""
    mesh = unlike(
        turn=2,
        upper=(0.8, 0.6, 0.7),
        offset=(0.5, 0.4),
        gap=0.05,
        distorted=(0.05, 0.0),
        divisions=FINER,
        bent=0.2,
    )
    problem = paired(mesh, mass=scheme[1])
    down, points = rotation(2) @ [0.0, -2.0, 0.0], problem.system.space.points
    system = thrown(problem.system, np.zeros_like, lambda x: np.outer(1.0 + 0.2 * x[:, 0], down))
    problem = replace(problem, system=system)
    spins = [np.cross(axis, points) for axis in np.eye(3)]
    spins = np.column_stack([relative(problem, system.space.restrict(spin)) for spin in spins])

    def balance(v: Array) -> Array:
        angular = COMM.allreduce(spins.T @ (problem.equations.M @ v))
        return np.concatenate([momenta(problem, v).sum(axis=0), angular])

    start, before = balance(problem.equations.v0), momenta(problem, problem.equations.v0)
    for state, report in march(problem, scheme=scheme[0], dt=2e-3, steps=25):
        assert report.certificate.worst <= 1e-9
        assert balance(state.v) == pytest.approx(start, abs=1e-12 * np.abs(start).max())
    assert np.abs(momenta(problem, state.v) - before).max() > 0.1 * np.abs(before).max()


@pytest.mark.parametrize(
    "moves", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["rest", "moving"]
)
def test_a_body_held_everywhere_is_an_obstacle(moves):
    """A block thrown on a block that is prescribed all over rubs as on the half-space, at rest and
    moving: same displacements (1e-10) and reactions (1e-9)."""
    turn = rotation(2)
    mesh = unlike(turn=2, upper=(0.8, 0.5, 0.7), offset=(0.2, 0.3), gap=1e-3, divisions=FINER)
    built, tags = build_mesh(mesh, COMM)
    along, up = turn @ [0.3, 0.7, 0.2], turn @ [0.0, 1.0, 0.0]
    motion = {
        name: lambda x, t, n=n: np.tile(
            1e-2 * 20.0**n * np.sin(20.0 * t + 0.5 * np.pi * n) * along, (len(x), 1)
        )
        for n, name in enumerate(("displacement", "velocity", "acceleration") if moves else ())
    }
    hold = [
        Prescribed(tags[f"lower_{side}"], **motion)
        for side in ("left", "right", "bottom", "top", "back", "front")
    ]
    system = assemble(built, SOFT, prescribed=hold)
    system = thrown(
        system, np.zeros_like, lambda x: np.outer(2.0 + x[:, 0], turn @ [0.3, -1.0, 0.1])
    )
    one, two = (tags[side] for side in mesh.interface)
    alone = contact_surface(system, one, obstacle=HalfSpace(point=tuple(up), normal=tuple(up)))
    if moves:
        t0 = alone.tangential_values(
            relative(ContactProblem(system, alone), system.influence @ along)
        )[:1]
        alone = alone.moving(
            towards=lambda t: 1e-2 * np.sin(20.0 * t) * float(along @ up),
            along=lambda t: 1e-2 * np.sin(20.0 * t) * t0,
        )
    found, expected = (
        run(
            ContactProblem(system, surface, friction=Coulomb(0.4)),
            scheme=Trapezoidal(),
            dt=2e-3,
            steps=20,
        )
        for surface in (contact_pair(system, one, two, matching=DualMortar()), alone)
    )
    assert expected.active.any() and not expected.active.all() and found.certificate.max() <= 1e-9
    assert np.abs(found.u - expected.u).max() < 1e-10 * np.abs(expected.u).max()
    assert np.abs(found.r_n - expected.r_n).max() < 1e-9 * expected.r_n.max()


@pytest.mark.two_ranks
def test_a_side_that_bends_round_an_edge():
    """The bottom and a side of a box in a step of two others, as one pair and as two: the same
    conditions; nodes on the edge have two."""
    boxes = {
        "box": ((0, 0, 0), (1, 1, 1), (3, 3, 2)),
        "under": ((0, -1, 0), (1, 1, 1), (2, 2, 3)),
        "west": ((-1, 0, 0), (1, 1, 1), (2, 4, 3)),
    }
    mesh = Blocks(
        {
            name: BlockMesh(
                lengths=lengths,
                divisions=n,
                corner=corner,
                simplices=True,
                deform=lambda x: x @ TURN.T,
            )
            for name, (corner, lengths, n) in boxes.items()
        }
    )
    built, tags = build_mesh(mesh, COMM)
    system, pairs = assemble(built, SOFT), (("box_bottom", "under_top"), ("box_left", "west_right"))
    sides = [
        Facets("side", np.concatenate([tags[name].indices for name in names]), built)
        for names in zip(*pairs, strict=True)
    ]
    one = contact_pair(system, *sides, matching=DualMortar())
    apart = [
        contact_pair(system, *(tags[name] for name in pair), matching=DualMortar())
        for pair in pairs
    ]
    two = joined_surfaces(*apart)
    assert [len(corner) for corner in seen(one).corners] == [
        2,
        2,
        2,
    ] and one.total == two.total == 24
    u = system.space.restrict(np.cos(system.space.points) + system.space.points[:, ::-1] ** 2)
    rows = []
    for surface in (one, two):
        x = relative(ContactProblem(system, surface), u)
        found = seen(surface)
        columns = np.column_stack(
            [found.points, found.normals, found.weights, found.normal_values(x)]
        )
        rows.append(columns[np.lexsort(np.round(columns[:, :6], 9).T)])
    assert rows[0] == pytest.approx(rows[1], abs=1e-12)


@pytest.mark.parametrize(
    ("scheme", "mass", "friction"),
    [
        (Midpoint(), ConsistentMass(), None),
        pytest.param(Trapezoidal(), Redistributed(), None, marks=serial),
        pytest.param(Trapezoidal(), Redistributed(), Coulomb(0.3), marks=serial),
    ],
    ids=["midpoint", "trapezoidal", "rough"],
)
def test_routes_agree(scheme, mass, friction):
    """Condensed, volume and iterative route, every step from the same state, partly covered sides:
    to 1e-9."""
    mesh = unlike(turn=2, upper=(0.8, 0.6, 0.7), offset=(1.0, -0.4), gap=1e-3, divisions=FINER)
    problem = paired(mesh, mass=mass, friction=friction)
    throw = np.outer([1.0, 0.2], rotation(2) @ [0.5, -2.0, 0.3])
    system = thrown(problem.system, np.zeros_like, lambda x: throw[0] + np.outer(x[:, 0], throw[1]))
    solvers = (Condensed(), Volume(method=ReducedNewton()), Iterative())
    problem = replace(problem, system=system)
    assert cross_check(problem, scheme=scheme, solvers=solvers, dt=1e-3, steps=3).worst <= 1e-9


# Refusals
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_refusals():
    mesh = unlike(gap=-0.1)
    with pytest.raises(InputError, match="'lower_top' lies 0.1 m behind 'upper_bottom' at"):
        paired(mesh)
    built, tags = build_mesh(unlike(), COMM)
    system = assemble(built, SOFT)
    for one, two, sentence in (
        ("upper_bottom", "lower_bottom", "'lower_bottom' does not face 'upper_bottom' at"),
        (
            "upper_bottom",
            "lower_left",
            "no part of 'lower_left' lies opposite 'upper_bottom', along the normals",
        ),
        ("upper_top", "lower_bottom", "'lower_bottom' lies 2 m behind 'upper_top' at"),
        ("upper_top", "upper_top", "are the same nodes, so that nothing can part there"),
    ):
        with pytest.raises(InputError, match=sentence):
            contact_pair(system, tags[one], tags[two], matching=DualMortar())
    with pytest.raises(
        InputError, match=r"a facet of both 'twice' and 'lower_top' at \(.*\): a facet cannot touch"
    ):
        twice = Facets(
            "twice",
            np.concatenate([tags[name].indices for name in ("upper_bottom", "lower_top")]),
            built,
        )
        contact_pair(system, twice, tags["lower_top"], matching=DualMortar())


@serial
def test_refused_facets():
    """Facets that are so thin that their normals mean nothing, and quadrilaterals with a corner
    that points inwards."""
    for kind, moved in (("t", 1e-9), ("q", 0.7)):
        one, two = (
            face(kind, (5, 4), up=False, distorted=0.0, name="bad"),
            face("t", (3, 6), up=True),
        )
        points = one.nodes.points.copy()
        points[6] += (
            (1.0 - moved) * (points[0] - points[6])
            if kind == "t"
            else moved * (points[12] - points[6])
        )
        bad = replace(one, nodes=replace(one.nodes, points=points))
        for sides in ((bad, two), (two, bad)):
            with pytest.raises(
                InputError, match="a facet of 'bad' at .* is a sliver or not convex: its normal"
            ):
                DualMortar().match(*sides, 1.0)
