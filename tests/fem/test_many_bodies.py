"""Nodes in several pairs and corners that rub on all their faces: stones, crossings, corners.

Conditions share unknowns there and are linear traces; the answers are by hand."""

from __future__ import annotations

from math import atan, cos, pi, sin
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError, ViContactError
from vi_contact.core.ledger import energy_balance
from vi_contact.core.problem import ContactProblem
from vi_contact.meshes import BlockMesh, Blocks, CutApart, GeoFile
from vi_contact.run.damping import first_modes

COMM = MPI.COMM_WORLD
MU = 0.6
STONE = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
PLAIN = vc.LinearElastic(E=1e9, nu=0.0, rho=2000.0)
GRAVITY = 9.81


def several(mesh: Any, tags: Any, *names: str) -> fem.Facets:
    """Several boundary groups as one."""
    indices = np.unique(np.concatenate([tags[name].indices for name in names]))
    return fem.Facets("+".join(names), indices.astype(np.int32), mesh)


def pressures(problem: ContactProblem, state: Any) -> Array:
    surface = seen(problem.surface)
    return np.asarray(surface.all(state.r_n) / surface.weights)


# Stones in running bond
# --------------------------------------------------------------------------------------------------

# name -> length, corner [m]: two courses on the ground, half stones in the upper one
BOND = {
    "a": (1.0, (0.0, 0.5)),
    "b": (1.0, (1.0, 0.5)),
    "left": (0.5, (0.0, 1.0)),
    "c": (1.0, (0.5, 1.0)),
    "right": (0.5, (1.5, 1.0)),
    "ground": (2.0, (0.0, 0.0)),
}
BEDS = (
    (("left_bottom", "c_bottom", "right_bottom"), ("a_top", "b_top")),
    (("a_bottom", "b_bottom"), ("ground_top",)),
)
HEADS = (("a_right", "b_left"), ("left_right", "c_left"), ("c_right", "right_left"))


def bond(
    d: int = 2,
    n: int = 4,
    unlike: bool = False,
    push: tuple[float, float] = (0.0, -1e6),
    heads: bool = True,
    materials: Any = None,
) -> tuple[Any, ContactProblem]:
    """Return the system and the problem of a bonded wall under a traction [Pa].

    Args:
        d: 2, or 3 with half a metre across.
        n: cells along a stone of one metre.
        unlike: whether stones have meshes of their own, and beds are mortared.
        push: traction on the top.
        heads: whether head joints touch too.
        materials: of stones with others than ``PLAIN``, by name.
    """
    blocks = {}
    for i, (name, (length, corner)) in enumerate(BOND.items()):
        cells = round(n * length) + (i % 2 if unlike else 0)
        lengths, divisions, where = [length, 0.5], [cells, n], list(corner)
        if d == 3:
            lengths, divisions, where = [*lengths, 0.5], [*divisions, 2], [*where, 0.0]
        blocks[name] = BlockMesh(
            lengths=tuple(lengths), divisions=tuple(divisions), corner=tuple(where)
        )
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    traction = (*push, 0.0)[:d]
    system = fem.assemble(
        mesh,
        [(tags[name], (materials or {}).get(name, PLAIN)) for name in BOND],
        clamped=tags["ground_bottom"],
        loads=[fem.Traction(tags[f"{name}_top"], traction) for name in ("left", "c", "right")],
    )
    matching = fem.DualMortar() if unlike else None
    pairs = []
    for ours, theirs in BEDS:
        one, other = (several(mesh, tags, *names) for names in (ours, theirs))
        pairs.append(fem.contact_pair(system, one, other, matching=matching))
    for ours, theirs in HEADS if heads else ():
        pairs.append(fem.contact_pair(system, tags[ours], tags[theirs]))
    surface = fem.joined_surfaces(*pairs)
    return system, ContactProblem(system, surface, friction=vc.Coulomb(MU))


@pytest.mark.serial  # ranks: the shaken wall, of the same stones
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("unlike", [False, True], ids=["nodes", "mortar"])
def test_stones_in_running_bond_press_alike(d, unlike):
    """1 MPa on top is 1 MPa in all bed joints and nothing in head joints (nu = 0), also at the
    nodes of three stones, whose joints are a ring. Stones that contact alone holds are in
    equilibrium to 1e-9 of the largest forces of all bodies, pressures of small facets to 2e-8."""
    _, problem = bond(d, 2 if d == 3 else 4, unlike)
    assert problem.surface.traces is not None
    state = vc.static_equilibrium(problem)
    upright = np.abs(seen(problem.surface).normals[:, 1]) > 0.5
    pressure = pressures(problem, state)
    assert pressure[upright] == pytest.approx(np.full(upright.sum(), 1e6), rel=1e-7)
    assert np.abs(pressure[~upright]).max() < 1e-7 * 1e6
    assert np.abs(seen(problem.surface).all(state.r_t)).max() < 1e-7 * 1e6
    assert state.certificate <= 1e-9


@pytest.mark.long
@pytest.mark.serial
def test_a_mirrored_wall_has_mirrored_forces():
    """A softer stone on the left and a push to the right, and the other way round: the forces are
    mirror images to rounding, in rings too."""
    soft = vc.LinearElastic(E=3e8, nu=0.0, rho=2000.0)
    found = []
    for way, name in ((1.0, "a"), (-1.0, "b")):
        _, problem = bond(push=(way * 2e5, -1e6), materials={name: soft})
        state = vc.static_equilibrium(problem)
        found.append((problem.surface, state))
    (one, first), (other, second) = found
    mirror = np.array([-1.0, 1.0])
    places = np.column_stack([one.points, one.normals])
    images = np.column_stack([other.points * mirror + (2.0, 0.0), other.normals * mirror])
    # a head joint has its other side first in the mirror: the force is that of the other body
    flip = np.abs(other.normals[:, 0]) > 0.5
    images[flip, 2:] *= -1.0
    # of two conditions of one node and direction the one with the larger force comes last
    keys = (
        np.column_stack([np.round(np.abs(state.r_n) / 1e3, 3), np.round(rows, 6)])
        for rows, state in ((places, first), (images, second))
    )
    a, b = (np.lexsort(rows.T) for rows in keys)
    size = first.r_n.max()
    assert np.abs(first.r_n[a] - second.r_n[b]).max() < 1e-9 * size
    assert np.abs(np.abs(first.r_t[a]) - np.abs(second.r_t[b])).max() < 1e-9 * size
    assert (first.r_n > 0.0).sum() > 20 and np.abs(first.r_t).max() > 0.01 * size


def shaken(ranks_of: Any = None) -> tuple[Any, list[Any]]:
    _, problem = bond(n=6, materials={"a": vc.LinearElastic(E=2e9, nu=0.2, rho=2500.0)})
    problem = ContactProblem(
        problem.system,
        problem.surface,
        friction=vc.Coulomb(MU),
        excitation=vc.Harmonic(20.0, 8.0, direction=(1.0, 0.3)),
    )
    return problem, [report for _, report in vc.march(problem, dt=5e-4, steps=30)]


@pytest.mark.long
@pytest.mark.two_ranks
def test_the_ledger_of_a_shaken_wall_closes():
    """Rings, contact nodes without mass, slip and uplift: every step is certified and its energy
    accounted for, on any number of ranks."""
    problem, reports = shaken()
    assert max(report.certificate.worst for report in reports) <= 1e-9
    defects, sizes, rubbed = [], [], 0.0
    for report in reports:
        energy = energy_balance(report.problem, report.old, report.new, report.balance)
        defects.append(abs(energy.defect))
        sizes.append(abs(energy.input))
        rubbed += energy.friction
    assert max(defects) < 1e-10 * max(sizes)
    assert rubbed > 1e-6 * max(sizes)
    closed = [int(seen(problem.surface).all(report.new.active).sum()) for report in reports]
    assert min(closed) < max(closed)


@pytest.mark.serial
def test_pyramid_of_three_stones():
    """By symmetry each lower stone carries one weight and a half, and each side of the upper one
    half a weight, whether the lower ones touch or not; nothing but contact holds the stones."""
    for heads in (True, False):
        blocks = {
            name: BlockMesh(lengths=(1.0, 0.5), divisions=(4, 3), corner=corner)
            for name, corner in {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (0.5, 0.5)}.items()
        }
        mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
        load = fem.BodyForce((0.0, -2000.0 * GRAVITY))
        system = fem.assemble(mesh, STONE, loads=load)
        parts = [fem.contact_surface(system, tags[f"{name}_bottom"]) for name in "ab"]
        parts.append(
            fem.contact_pair(system, tags["c_bottom"], several(mesh, tags, "a_top", "b_top"))
        )
        if heads:
            parts.append(fem.contact_pair(system, tags["a_right"], tags["b_left"]))
        surface = fem.joined_surfaces(*parts)
        problem = ContactProblem(system, surface, friction=vc.Coulomb(MU))
        state = vc.static_equilibrium(problem)
        weight = 2000.0 * GRAVITY * 0.5
        ground = [state.r_n[:5].sum(), state.r_n[5:10].sum()]
        assert ground == pytest.approx([1.5 * weight, 1.5 * weight], rel=1e-8)
        # the node in the middle of the upper stone has a condition for each of the lower ones
        assert len(parts[2].gap0) == 6
        sides = np.where(parts[2].points[:, 0] < 1.0 - 1e-9, 1, 0)
        upper = state.r_n[10:16]
        lonely = upper[sides == 1].sum()
        middle = upper[np.abs(parts[2].points[:, 0] - 1.0) < 1e-9]
        assert len(middle) == 2 and middle[0] == pytest.approx(middle[1], abs=1e-8 * weight)
        assert lonely + middle[0] == pytest.approx(0.5 * weight, rel=1e-8)


@pytest.mark.serial
def test_pyramid_of_ten_stones_on_pads():
    """Stones on two pads each, in the middle of the bed joints, smooth: the ground carries 1.5,
    3.5, 3.5 and 1.5 weights, and the pads of the rows above .5, 1, 1.5, 1.5, 1, .5, then .5, 1, 1,
    .5 and .5, .5."""
    rows = (4, 3, 2, 1)
    blocks = {
        f"s{row}{i}": BlockMesh(
            lengths=(1.0, 0.5), divisions=(4, 2), corner=(i + 0.5 * row, 0.5 * row)
        )
        for row, count in enumerate(rows)
        for i in range(count)
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    load = fem.BodyForce((0.0, -2000.0 * GRAVITY))
    system = fem.assemble(mesh, STONE, loads=load)
    parts = [fem.contact_surface(system, tags[f"s0{i}_bottom"]) for i in range(4)]
    for row in (1, 2, 3):
        for i in range(rows[row]):
            below = several(mesh, tags, *(f"s{row - 1}{j}_top" for j in (i, i + 1)))
            pads = [(i + 0.5 * row + x, 0.5 * row) for x in (0.25, 0.75)]
            parts.append(fem.contact_pair(system, tags[f"s{row}{i}_bottom"], below, points=pads))
    problem = ContactProblem(system, fem.joined_surfaces(*parts))
    state = vc.static_equilibrium(problem)
    weights = state.r_n / (2000.0 * GRAVITY * 0.5)
    ground = weights[:20].reshape(4, 5).sum(axis=1)
    assert ground == pytest.approx([1.5, 3.5, 3.5, 1.5], rel=1e-8)
    by_hand = [0.5, 1.0, 1.5, 1.5, 1.0, 0.5, 0.5, 1.0, 1.0, 0.5, 0.5, 0.5]
    assert weights[20:] == pytest.approx(by_hand, rel=1e-8)


@pytest.mark.long
@pytest.mark.serial
def test_a_block_cut_from_its_ground_is_lifted_off(tmp_path):
    """Case 02: both are drawn between the same corner points. Cut apart the block of 47 kN is
    lifted by 80 kN and has no equilibrium; under 40 kN it stands, and nothing hangs on corners."""
    pytest.importorskip("gmsh")
    path = tmp_path / "rim.geo"
    path.write_text(RIM)
    mesh, tags = fem.build_mesh(CutApart(source=GeoFile(path=str(path))), COMM)
    materials = [(tags["block"], STONE), (tags["soil"], STONE)]
    for lift in (20e3, 40e3):
        load = fem.Traction(tags["top"], (0.0, lift))
        system = fem.assemble(mesh, materials, clamped=tags["rock"], loads=load)
        system = vc.with_weight(system, acceleration=GRAVITY)
        problem = ContactProblem(system, fem.contact_pairs(system, tags=tags))
        if 2.0 * lift < 2.0 * 2000.0 * GRAVITY:
            state = vc.static_equilibrium(problem)
            assert state.r_n.sum() == pytest.approx(2.0 * (2000.0 * GRAVITY - lift), rel=1e-8)
        else:
            with pytest.raises(ViContactError, match="no static equilibrium"):
                vc.static_equilibrium(problem)


# block on soil; both surfaces use the corner points 1 and 2, each has a line of its own between
RIM = """
h = 0.5;
Point(1) = {0,0,0,h}; Point(2) = {2,0,0,h}; Point(3) = {2,1,0,h}; Point(4) = {0,1,0,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Point(12) = {-3,0,0,h}; Point(13) = {-3,-3,0,1}; Point(14) = {5,-3,0,1}; Point(15) = {5,0,0,h};
Line(11) = {1,12}; Line(12) = {12,13}; Line(13) = {13,14}; Line(14) = {14,15};
Line(15) = {15,2}; Line(16) = {2,1};
Curve Loop(2) = {11:16}; Plane Surface(2) = {2};
Transfinite Curve {1,16} = 5;
Physical Surface("block") = {1}; Physical Surface("soil") = {2};
Physical Curve("rock") = {13}; Physical Curve("top") = {3};
"""


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize(("mu", "limit"), [(0.7, 0.5), (0.3, 0.3)], ids=["topples", "slides"])
def test_a_stack_that_tilts(mu, limit):
    """Four stones of 1 × 0.5 m: they slide at tan θ = mu, and topple at b/h = 1/2, whichever comes
    first; 3 % below they stand."""
    blocks = {
        f"s{i}": BlockMesh(lengths=(1.0, 0.5), divisions=(4, 2), corner=(0.0, 0.5 * i))
        for i in range(4)
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    for tangent in (0.97 * limit, 1.03 * limit):
        tilt = atan(tangent)
        load = fem.BodyForce((2e4 * sin(tilt), -2e4 * cos(tilt)))
        system = fem.assemble(mesh, STONE, loads=load)
        parts = [fem.contact_surface(system, tags["s0_bottom"])]
        for i in range(3):
            parts.append(fem.contact_pair(system, tags[f"s{i + 1}_bottom"], tags[f"s{i}_top"]))
        surface = fem.joined_surfaces(*parts)
        problem = ContactProblem(system, surface, friction=vc.Coulomb(mu))
        if tangent < limit:
            state = vc.static_equilibrium(problem)
            assert state.r_n[:5].sum() == pytest.approx(4 * 0.5 * 2e4 * cos(tilt), rel=1e-8)
        else:
            with pytest.raises(ViContactError, match="no static equilibrium"):
                vc.static_equilibrium(problem)


# Crossings
# --------------------------------------------------------------------------------------------------


def crossing(friction: Any = None, mortar: bool = False) -> ContactProblem:
    """Four blocks of one metre about a point, pressed by 1 MPa from all sides, on no support."""
    blocks = {
        f"{a}{b}": BlockMesh(divisions=(4, 5 if mortar and b else 4), corner=(float(a), float(b)))
        for a in (0, 1)
        for b in (0, 1)
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    loads = []
    for i in (0, 1):
        loads += [
            fem.Traction(tags[f"1{i}_right"], (-1e6, 0.0)),
            fem.Traction(tags[f"0{i}_left"], (1e6, 0.0)),
            fem.Traction(tags[f"{i}1_top"], (0.0, -1e6)),
            fem.Traction(tags[f"{i}0_bottom"], (0.0, 1e6)),
        ]
    system = fem.assemble(mesh, STONE, loads=loads)
    ring = (
        ("00_right", "10_left"),
        ("10_top", "11_bottom"),
        ("11_left", "01_right"),
        ("01_bottom", "00_top"),
    )
    matching = fem.DualMortar() if mortar else None
    pairs = [fem.contact_pair(system, tags[a], tags[b], matching=matching) for a, b in ring]
    law = {} if friction is None else {"friction": friction}
    return ContactProblem(system, fem.joined_surfaces(*pairs), **law)


@pytest.mark.two_ranks
@pytest.mark.parametrize("mortar", [False, True], ids=["nodes", "mortar"])
@pytest.mark.parametrize("mu", [None, 0.6])
def test_crossing_of_four_stones(mu, mortar):
    """1 MPa everywhere, also at the point of all four, whose ring could carry other forces."""
    problem = crossing(None if mu is None else vc.Coulomb(mu), mortar)
    state = vc.static_equilibrium(problem)
    pressure = pressures(problem, state)
    assert pressure == pytest.approx(np.full(len(pressure), 1e6), rel=1e-8)
    if mu is not None:
        assert np.abs(seen(problem.surface).all(state.r_t)).max() < 1e-8 * 1e6


# One body in a corner
# --------------------------------------------------------------------------------------------------


def particle(mu: Any, force: Array, normals: Array, v0: Array | None = None) -> ContactProblem:
    """A mass of 20 kg at rest or in motion against rigid walls with these normals."""
    d = len(force)
    system = vc.system_from_arrays(
        20.0 * np.eye(d),
        None,
        np.zeros((d, d)),
        coordinates=np.zeros((1, d)),
        load=force,
        **({} if v0 is None else {"v0": v0}),
    )
    surface = vc.contact_points(system, [0] * len(normals), normals)
    friction = vc.Coulomb(mu)
    return ContactProblem(system, surface, friction=friction, mass=vc.ConsistentMass())


@pytest.mark.serial
@pytest.mark.parametrize("turn", [0.0, pi / 6])
@pytest.mark.parametrize(
    ("mu", "push", "walls", "lift"),
    [
        (0.3, 45.0, (707.106781187, 707.106781187), 624.264068712),
        (0.5, 45.0, (707.106781187, 707.106781187), 907.106781187),
        (0.3, 30.0, (866.025403784, 500.0), 609.807621135),
    ],
)
def test_lifted_in_the_corner_of_two_walls(mu, push, walls, lift, turn):
    """200 N, pressed with 1000 N into the corner of two vertical walls at ``push`` to the normal of
    the first: both walls rub with mu N, so that it moves up when lifted by 200 N + mu (N1 + N2),
    and stays below; also turned by 30° about the vertical."""
    normals = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    c, s = cos(turn), sin(turn)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    angle = np.radians(push)
    for share in (0.99, 1.01):
        force = np.array([-1000.0 * cos(angle), -1000.0 * sin(angle), share * lift - 200.0])
        problem = particle(mu, R @ force, normals @ R.T)
        *_, (state, report) = vc.march(problem, dt=1e-3, steps=5, scheme=vc.MoreauJean())
        total = problem.surface.reaction_load(report.result.r_n, 3, report.result.r_t) / 1e-3
        v = R.T @ problem.cartesian(state.v)
        if share < 1.0:
            assert np.abs(v).max() < 1e-12
            assert R.T @ total == pytest.approx(force, abs=1e-9 * 1000.0)
        else:
            assert state.r_n == pytest.approx(walls, rel=1e-9)
            assert v[2] == pytest.approx((force[2] - (lift - 200.0)) / 20.0 * 5e-3, rel=1e-7)


@pytest.mark.serial
@pytest.mark.parametrize("mu", [0.3, 0.5])
def test_a_cube_that_slides_up_in_the_corner_of_two_walls(mu):
    """The same of a cube that deforms, pressed first without friction: it rises as its forces by
    hand say, with 707.107 N on each wall and mu of that against it, and every step's energy is
    accounted for."""
    side, dt = 0.2, 1e-3
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(side,) * 3, divisions=(2, 2, 2)), COMM)
    push = 1000.0 * cos(pi / 4.0)
    cube = vc.LinearElastic(E=1e8, nu=0.0, rho=20.0 / side**3)
    rise = 2.0 * mu * push + 100.0  # 100 N more than friction bears, weight taken off
    problems = []
    for lift in (0.0, rise):
        force = np.array([-push, -push, lift]) / side**3
        system = fem.assemble(mesh, cube, loads=fem.BodyForce(tuple(force)))
        parts = [fem.contact_surface(system, tags[name]) for name in ("left", "bottom")]
        first = len(parts[0].gap0)
        surface = fem.joined_surfaces(*parts).with_own_laws()
        problems.append(ContactProblem(system, surface, friction=vc.Coulomb(mu)))
    smooth = ContactProblem(problems[0].system, problems[0].surface)
    rest = vc.static_equilibrium(smooth)
    worst, size = 0.0, 0.0
    walls, drag = [], []
    problem = problems[1]
    for state, report in vc.march(problem, state=rest, dt=dt, steps=30, scheme=vc.MoreauJean()):
        energy = energy_balance(report.problem, report.old, report.new, report.balance)
        worst = max(worst, abs(energy.defect))
        size += abs(energy.input)
        r_n, r_t = report.result.r_n, report.result.r_t
        walls.append([r_n[:first].sum() / dt, r_n[first:].sum() / dt])
        reaction = problem.surface.reaction_load(r_n, len(state.u), r_t)
        drag.append(reaction.reshape(-1, 3)[:, 2].sum() / dt)
    assert worst < 1e-9 * size
    # both walls alike; over two swings of the cube, when it slides as a whole
    last = np.mean(walls[-12:], axis=0)
    assert last[0] == pytest.approx(last[1], rel=1e-9)
    assert last[0] == pytest.approx(push, rel=4e-3)
    assert np.mean(drag[-12:]) == pytest.approx(2.0 * mu * push, rel=4e-3)


@pytest.mark.serial
@pytest.mark.parametrize("mu", [0.3, 0.5])
@pytest.mark.parametrize("half", [30.0, 45.0, 60.0])
def test_sliding_along_a_groove(mu, half):
    """Pressed by P into a groove of half angle a and drawn along it: N = P/(2 sin a) on each face,
    and friction mu P/sin a."""
    a = np.radians(half)
    normals = np.array([[cos(a), -sin(a), 0.0], [-cos(a), -sin(a), 0.0]])
    P, pull = 1000.0, 3000.0
    problem = particle(mu, np.array([0.0, -P, pull]), normals)
    *_, (state, _) = vc.march(problem, dt=1e-3, steps=3, scheme=vc.MoreauJean())
    assert state.r_n == pytest.approx(np.full(2, P / (2.0 * sin(a))), rel=1e-9)
    along = (pull - mu * P / sin(a)) / 20.0 * 3e-3
    assert problem.cartesian(state.v) == pytest.approx([0.0, 0.0, along], abs=1e-9 * along)


@pytest.mark.serial
def test_a_groove_that_locks_carries_nothing_without_load():
    """tan a <= mu: forces of any size would balance; the least are none."""
    a = atan(0.3)
    normals = np.array([[cos(a), -sin(a)], [-cos(a), -sin(a)]])
    problem = particle(0.5, np.zeros(2), normals)
    *_, (state, _) = vc.march(problem, dt=1e-3, steps=3, scheme=vc.MoreauJean())
    assert np.abs(state.r_n).max() == 0.0 and np.abs(state.r_t).max() == 0.0
    problem = particle(0.5, np.array([0.0, -100.0]), normals)
    *_, (state, _) = vc.march(problem, dt=1e-3, steps=3, scheme=vc.MoreauJean())
    # both walls alike, with as much friction as they can have: N sin a + mu N cos a = P/2
    assert state.r_n == pytest.approx(np.full(2, 50.0 / (sin(a) + 0.5 * cos(a))), rel=1e-9)


@pytest.mark.serial
def test_each_face_has_its_own_coefficient():
    """Two walls with mu 0.2 and 0.6: friction of the lifted mass is mu_1 N_1 + mu_2 N_2."""
    normals = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    problem = particle((0.2, 0.6), np.array([-600.0, -300.0, 1000.0]), normals)
    *_, (state, _) = vc.march(problem, dt=1e-3, steps=3, scheme=vc.MoreauJean())
    assert state.r_n == pytest.approx([600.0, 300.0], rel=1e-9)
    assert np.abs(state.r_t).max(axis=1) == pytest.approx([120.0, 180.0], rel=1e-9)


def thrown(angle: float, law: Any, **how: Any) -> tuple[ContactProblem, list[Any]]:
    """A block thrown into the corner of a floor and a wall, all turned by an angle."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 0.8), divisions=(5, 4), angle=angle), COMM)
    R = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    v, g = R @ (-1.0, -2.0), R @ (-3.0, -9.0)
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=1e7, nu=0.3, rho=2000.0),
        initial_velocity=lambda x: np.tile(v, (len(x), 1)),
        loads=fem.BodyForce(tuple(2000.0 * g)),
    )
    near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
    parts = [fem.contact_surface(system, tags[n], obstacle=near) for n in ("bottom", "left")]
    surface = fem.joined_surfaces(*parts)
    problem = ContactProblem(system, surface, friction=vc.Coulomb(0.4), **law)
    return problem, [report for _, report in vc.march(problem, dt=5e-4, steps=60, **how)]


CONSISTENT = {"mass": vc.ConsistentMass(), "impact": vc.Inelastic()}
IMPULSES = {"mass": vc.ConsistentMass(), "impact": vc.Newton(0.3, vc.ImpulseUpdate())}


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("law", "how"),
    [
        ({}, {}),
        ({}, {"scheme": vc.Trapezoidal()}),
        (CONSISTENT, {"scheme": vc.Midpoint()}),
        (IMPULSES, {"scheme": vc.Midpoint()}),
        ({}, {"scheme": vc.MoreauJean()}),
    ],
    ids=["massless", "trapezoidal", "inelastic", "newton", "moreau-jean"],
)
def test_a_corner_turned_by_30_degrees(law, how):
    """The same forces in newtons, along tangents of each face; ledgers close."""
    runs = [thrown(angle, law, **how) for angle in (0.0, pi / 6)]
    histories = []
    for problem, reports in runs:
        assert problem.surface.traces is not None
        assert max(report.certificate.worst for report in reports) <= 1e-9
        histories.append(np.array([seen(problem.surface).all(r.new.r_n) for r in reports]))
        worst, size = 0.0, 0.0
        for report in reports:
            before = report.new.with_velocity(report.v_minus)
            energy = energy_balance(report.problem, report.old, before, report.balance)
            size = max(size, abs(energy.change) + abs(energy.input) + abs(energy.friction))
            worst = max(worst, abs(energy.defect))
        assert worst < 1e-9 * size
    straight, turned = histories
    assert np.abs(straight - turned).max() < 1e-8 * straight.max()
    surface = seen(runs[0][0].surface)
    both = [
        bool(seen(runs[0][0].surface).all(r.new.active)[surface.corners[0]].all())
        for r in runs[0][1]
    ]
    assert any(both)


@pytest.mark.serial
def test_frictionless_corners_stay_a_choice():
    """Beside friction the corner of the thrown block slides freely when it is told to."""
    mesh, tags = fem.build_mesh(BlockMesh(divisions=(3, 3)), COMM)
    system = fem.assemble(mesh, STONE)
    parts = [fem.contact_surface(system, tags[name]) for name in ("bottom", "left")]
    surface = fem.joined_surfaces(*parts)
    free = surface.with_frictionless_corners()
    assert ContactProblem(system, free, friction=vc.Coulomb(0.3)).surface is free
    rubbing = ContactProblem(system, surface, friction=vc.Coulomb(0.3)).surface
    assert rubbing.traces is not None
    again = ContactProblem(system, surface, friction=vc.Coulomb(0.5)).surface
    assert again is rubbing  # and with it all that was made for it once
    assert ContactProblem(system, surface).surface is surface


@pytest.mark.serial
@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ({"solver": vc.Volume()}, "needs an unknown for each contact condition.*use Condensed"),
        ({"scheme": vc.HHT(-0.1)}, "remembers reactions as forces on the unknowns"),
        ({"scheme": vc.Houbolt()}, "remembers reactions as forces on the unknowns"),
    ],
)
def test_what_needs_an_unknown_for_each_condition_says_so(how, sentence):
    _, problem = bond()
    with pytest.raises(InputError, match=sentence):
        next(vc.march(problem, dt=1e-3, steps=1, **how))


@pytest.mark.serial
def test_walls_that_slide_past_a_corner():
    """Tangents of conditions as traces are those of each face: such walls are asked for by
    with_own_laws(), and other slides are refused at corners."""
    mesh, tags = fem.build_mesh(BlockMesh(divisions=(2, 2)), COMM)
    system = fem.assemble(mesh, STONE)
    parts = [fem.contact_surface(system, tags[name]) for name in ("bottom", "left")]
    surface = fem.joined_surfaces(*parts)
    along = 0.5
    with pytest.raises(InputError, match=r"take surface = surface.with_own_laws\(\) before"):
        ContactProblem(system, surface.moving(along=lambda t: along), friction=vc.Coulomb(0.3))
    moved = surface.with_own_laws().moving(along=lambda t: along)
    problem = ContactProblem(system, moved, friction=vc.Coulomb(0.3))
    assert problem.surface.slide(0.0) == pytest.approx(np.full((moved.count, 1), along))
    joined = fem.joined_surfaces(*(part.moving(along=lambda t: along) for part in parts))
    problem = ContactProblem(system, joined, friction=vc.Coulomb(0.3))
    assert problem.surface.slide(0.0) == pytest.approx(np.full((joined.count, 1), along))


# What else such surfaces do
# --------------------------------------------------------------------------------------------------


@pytest.mark.serial
@pytest.mark.parametrize("kind", ["springs", "held", "frictionless corners"])
def test_other_conditions_of_a_wall(kind):
    """Joints on springs, joints that may pull, and nodes in several pairs that slide freely: 1 MPa
    in the beds all the same, and certified steps. Joints that may pull hold a little friction in
    the heads, which depends on the way of the iteration: up to 2e-5 of the pressure."""
    system, problem = bond()
    surface = {
        "springs": lambda s: s.on_springs(1e10),
        "held": lambda s: s.bilateral_everywhere(),
        "frictionless corners": lambda s: s.with_frictionless_corners(),
    }[kind](problem.surface)
    problem = ContactProblem(system, surface, friction=vc.Coulomb(MU))
    state = vc.static_equilibrium(problem)
    upright = np.abs(surface.normals[:, 1]) > 0.5
    pressure = state.r_n / surface.weights
    near = 1e-4 if kind == "held" else 1e-7
    assert pressure[upright] == pytest.approx(np.full(upright.sum(), 1e6), rel=near)
    reports = [report for _, report in vc.march(problem, dt=5e-4, steps=5)]
    assert max(report.certificate.worst for report in reports) <= 1e-9
    if kind == "frictionless corners":
        corners = np.concatenate(surface.corners)
        for report in reports:
            assert np.abs(report.new.r_t[corners]).max() <= 1e-20 * np.abs(report.new.r_t).max()


@pytest.mark.serial
@pytest.mark.parametrize("simplices", [False, True])
def test_stones_of_second_order(simplices):
    """A stone on two stones by elements of degree 2, with the joint below: 1 MPa everywhere."""
    blocks = {
        "up": BlockMesh(
            lengths=(2.0, 0.5), divisions=(4, 2), corner=(0.0, 1.0), simplices=simplices
        ),
        "a": BlockMesh(divisions=(2, 2), simplices=simplices),
        "b": BlockMesh(divisions=(2, 2), corner=(1.0, 0.0), simplices=simplices),
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    system = fem.assemble(
        mesh,
        PLAIN,
        degree=2,
        clamped=[tags["a_bottom"], tags["b_bottom"]],
        prescribed=fem.Prescribed(tags["up_left"], components=(0,)),
        loads=fem.Traction(tags["up_top"], (0.0, -1e6)),
    )
    bed = fem.contact_pair(system, tags["up_bottom"], several(mesh, tags, "a_top", "b_top"))
    surface = fem.joined_surfaces(bed, fem.contact_pair(system, tags["a_right"], tags["b_left"]))
    problem = ContactProblem(system, surface, friction=vc.Coulomb(0.5))
    state = vc.static_equilibrium(problem)
    pressure = state.r_n / surface.weights
    assert pressure[: bed.total] == pytest.approx(np.full(bed.total, 1e6), rel=1e-8)
    assert np.abs(pressure[bed.total :]).max() < 1e-2


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme",
    [
        vc.Midpoint(),
        vc.SS22(0.6, 0.7),
        vc.ZienkiewiczWoodTaylor(0.6),
        vc.ContactStabilisedNewmark(),
    ],
    ids=lambda scheme: type(scheme).__name__,
)
def test_conditions_as_traces_are_the_same_conditions(scheme):
    """Two stones, one on the other, where every condition can have an unknown of its own: as traces
    they give the same motion, forces and first periods."""
    blocks = {"a": BlockMesh(divisions=(4, 4)), "b": BlockMesh(divisions=(4, 4), corner=(0.0, 1.0))}
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    system = fem.assemble(
        mesh,
        STONE,
        clamped=tags["a_bottom"],
        loads=fem.BodyForce((0.0, -2000.0 * GRAVITY)),
    )
    surface = fem.contact_pair(system, tags["b_bottom"], tags["a_top"])
    shaken = vc.Harmonic(30.0, 9.0, direction=(1.0, 0.4))
    runs = []
    for part in (surface, surface.with_own_laws()):
        problem = ContactProblem(system, part, friction=vc.Coulomb(0.4), excitation=shaken)
        reports = [report for _, report in vc.march(problem, dt=5e-4, steps=40, scheme=scheme)]
        runs.append((problem, reports))
    (one, first), (other, second) = runs
    assert one.surface.traces is None and other.surface.traces is not None
    size = max(report.new.r_n.max() for report in first)
    for a, b in zip(first, second, strict=True):
        assert np.abs(a.new.r_n - b.new.r_n).max() < 1e-8 * size
        assert np.abs(a.new.r_t - b.new.r_t).max() < 1e-8 * size
    u, v = (problem.cartesian(run[-1].new.u) for problem, run in runs)
    assert np.abs(u - v).max() < 1e-9 * np.abs(u).max()
    # stiff springs hold traces, a million times as stiff as the stones
    assert first_modes(other).periods == pytest.approx(first_modes(one).periods, rel=1e-5)
    for name in ("contact_pressure", "contact_gap"):
        functions = [fem.as_function(problem, run[-1].new, name).x.array for problem, run in runs]
        scale = max(np.abs(functions[0]).max(), 1e-9 * np.abs(u).max())
        assert np.abs(functions[0] - functions[1]).max() < 1e-7 * scale


@pytest.mark.long
@pytest.mark.serial
def test_a_restart_goes_on_bit_for_bit():
    """A wall of rings that is stopped after six steps goes on as if it had not been."""
    _, problem = bond(push=(3e5, -1e6))
    straight = [state for state, _ in vc.march(problem, dt=5e-4, steps=12)]
    *_, half = [state for state, _ in vc.march(problem, dt=5e-4, steps=6)]
    *_, end = [state for state, _ in vc.march(problem, dt=5e-4, steps=6, state=half)]
    for name in ("u", "v", "r_n", "r_t"):
        assert np.array_equal(getattr(end, name), getattr(straight[-1], name))


@pytest.mark.serial
def test_scaled_units_scale_the_forces():
    """Lengths in millimetres and forces in kilonewtons: the same wall, to rounding."""
    found = []
    for length, stress in ((1.0, 1.0), (1e3, 1e-9)):
        blocks = {
            "up": ((2.0, 0.5), (8, 2), (0.0, 1.0)),
            "a": ((1.0, 1.0), (4, 4), (0.0, 0.0)),
            "b": ((1.0, 1.0), (4, 4), (1.0, 0.0)),
        }
        meshes = {
            name: BlockMesh(
                lengths=tuple(length * x for x in lengths),
                divisions=cells,
                corner=tuple(length * x for x in corner),
            )
            for name, (lengths, cells, corner) in blocks.items()
        }
        mesh, tags = fem.build_mesh(Blocks(meshes), COMM)
        stones = {
            name: vc.LinearElastic(E=E * stress, nu=0.2, rho=1.0)
            for name, E in (("up", 1e9), ("a", 1e9), ("b", 2e9))
        }
        system = fem.assemble(
            mesh,
            [(tags[name], stone) for name, stone in stones.items()],
            clamped=[tags["a_bottom"], tags["b_bottom"]],
            loads=fem.Traction(tags["up_top"], (1e5 * stress, -1e6 * stress)),
        )
        bed = fem.contact_pair(system, tags["up_bottom"], several(mesh, tags, "a_top", "b_top"))
        head = fem.contact_pair(system, tags["a_right"], tags["b_left"])
        surface = fem.joined_surfaces(bed, head)
        problem = ContactProblem(system, surface, friction=vc.Coulomb(0.5))
        state = vc.static_equilibrium(problem)
        found.append(np.column_stack([state.r_n, state.r_t]) / (stress * length))
    assert np.abs(found[0] - found[1]).max() < 1e-7 * found[0].max()
