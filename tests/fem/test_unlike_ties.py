"""Ties of boundaries that are not meshed alike: a constant stress passes through them to round-off,
forces and moments balance, and any number of ranks gives the same."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import field, linear
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.laws import MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks

E, NU = 1e9, 0.3
STONE = vc.LinearElastic(E=E, nu=NU, rho=2000.0)
STRESS = np.array([[2e5, 3e5, -1e5], [3e5, -4e5, 2e5], [-1e5, 2e5, 1e5]])  # Pa, full
NORMALS = {
    "left": (-1.0, 0.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "bottom": (0.0, -1.0, 0.0),
    "top": (0.0, 1.0, 0.0),
    "back": (0.0, 0.0, -1.0),
    "front": (0.0, 0.0, 1.0),
}
MORTAR = fem.DualMortar()


def strain(d):
    """The strain (d, d) of the constant stress, in plane strain where d = 2."""
    stress = STRESS[:d, :d]
    beside = NU * np.trace(stress) * (1.0 + NU if d == 2 else 1.0)
    return ((1.0 + NU) * stress - beside * np.eye(d)) / E


def pulled(tags, d, inner):
    """The tractions of the constant stress on all outer sides, those of ``inner`` left out."""
    loads = []
    for name, group in tags.items():
        side = name.rsplit("_", 1)[-1]
        if side in NORMALS and name not in inner:
            loads.append(fem.Traction(group, tuple(STRESS[:d, :d] @ NORMALS[side][:d])))
    return loads


def errors(system, d):
    """Residual of the constant stress over its largest force, and of its displacements, which
    followers must have, over the strain."""
    space, comm = system.space, system.space.comm
    exact = space.points @ strain(d).T
    u = space.restrict(exact)
    force = system.load(0.0)
    residual = comm.max(np.abs(system.K @ u - force).max(initial=0.0))
    wrong = comm.max(np.abs(space.expand(u, 0.0) - exact).max(initial=0.0))
    return residual / comm.max(np.abs(force).max(initial=0.0)), wrong / np.abs(strain(d)).max()


def rigid_error(system):
    """How far followers are from rigid motions of the whole, and the forces that these meet."""
    space, comm = system.space, system.space.comm
    x, d = space.points, space.dimension
    motions = [np.tile(e, (len(x), 1)) for e in np.eye(d)]
    for i, j in [(0, 1), (1, 2), (2, 0)][: 3 if d == 3 else 1]:
        turn = np.zeros_like(x)
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
        motions.append(turn)
    wrong = []
    for motion in motions:
        u = space.restrict(motion)
        wrong.append(comm.max(np.abs(space.expand(u, 0.0) - motion).max(initial=0.0)))
        stiffness = comm.max(np.abs(system.K.diagonal()).max(initial=0.0))
        wrong.append(comm.max(np.abs(system.K @ u).max(initial=0.0)) / stiffness)
    return max(wrong)


def stack(comm, d, degree, *, simplices=False, deform=None, **tie):
    """Two blocks, 4 x 2 (x 2) and 6 x 3 (x 3) cells, one on the other."""
    lower, upper = (
        BlockMesh(lengths=(2.0, 1.0, 1.5)[:d], divisions=n[:d], simplices=simplices, deform=deform)
        for n in ((4, 2, 2), (6, 3, 3))
    )
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), comm)
    sides = (tags["lower_top"], tags["upper_bottom"])
    return mesh, tags, fem.Tied(*sides, matching=MORTAR, **tie)


@pytest.mark.promise("guide/stones.md", "A constant stress passes through plane boundaries")
@pytest.mark.two_ranks
@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_a_constant_stress_passes(comm, d, degree, simplices):
    """Six components of stress, statics and displacements exact to round-off on both orders."""
    mesh, tags, tie = stack(comm, d, degree, simplices=simplices)
    loads = pulled(tags, d, ("lower_top", "upper_bottom"))
    system = fem.assemble(mesh, STONE, tied=tie, loads=loads, degree=degree)
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-13
    assert rigid_error(system) < 1e-13


@pytest.mark.parametrize("d", [2, 3])
def test_a_constant_stress_passes_a_kink(comm, d):
    """Both blocks have the kink of their face at a node, x = 1, and all other nodes elsewhere."""

    def roof(x):
        lift = 0.3 * (1.0 - np.abs(x[:, 0] - 1.0)) * (1.0 - np.abs(x[:, 1] - 1.0))
        return x + np.outer(lift, np.eye(d)[1])

    blocks = {
        name: BlockMesh(
            lengths=(2.0, 1.0, 1.5)[:d],
            divisions=n[:d],
            corner=(0.0, float(name == "upper"), 0.0)[:d],
            deform=roof,
        )
        for name, n in (("lower", (4, 2, 2)), ("upper", (6, 3, 3)))
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), comm)
    joint = ("lower_top", "upper_bottom")
    tie = fem.Tied(*(tags[name] for name in joint), matching=MORTAR)
    system = fem.assemble(mesh, STONE, tied=tie, loads=pulled(tags, d, joint))
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-13


@pytest.mark.promise("guide/stones.md", "Forces and moments balance to round-off")
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_forces_and_moments_balance_on_a_curve(comm, d, degree):
    """Chords of an arc do not lie in each other: rigid motions meet no forces all the same, so that
    every force and moment that one block gets is what the other one loses. With a gap too."""

    beside = 0.05 if d == 3 else 0.0

    def bent(x):
        return x + np.outer(0.1 * (x[:, 0] - 1.0) ** 2 + beside * x[:, -1] ** 2, np.eye(d)[1])

    for gap in (0.0, 0.05):
        lower, upper = (
            BlockMesh(
                lengths=(2.0, 1.0, 1.5)[:d],
                divisions=n[:d],
                simplices=d == 3,
                deform=bent,
            )
            for n in ((4, 1, 2), (6, 1, 3))
        )
        mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, gap=gap), comm)
        tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
        system = fem.assemble(mesh, STONE, tied=tie, degree=degree)
        assert rigid_error(system) < 1e-12


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_small_on_large_and_partly_covered(comm, d):
    """The side that is covered wholly follows, whatever its place; blocks that cover each other in
    part are exact for a constant strain at all nodes that follow."""
    small = BlockMesh(lengths=(1.0, 1.0, 1.5)[:d], divisions=(3, 3, 3)[:d])
    large = BlockMesh(lengths=(4.0, 1.0, 1.5)[:d], divisions=(8, 2, 2)[:d])
    offset = (1.5, 0.0)[: d - 1]
    mesh, tags = fem.build_mesh(TwoBlocks(lower=large, upper=small, offset=offset), comm)
    systems = [
        fem.assemble(mesh, STONE, tied=fem.Tied(one, two, matching=MORTAR))
        for one, two in (
            (tags["lower_top"], tags["upper_bottom"]),
            (tags["upper_bottom"], tags["lower_top"]),
        )
    ]
    assert systems[0].space.unknowns == systems[1].space.unknowns
    for system in systems:
        assert rigid_error(system) < 1e-12 and errors_of_followers(system, d) < 1e-12
    # a push on top of the small block reaches the foot of the large one: 1e5 Pa on its area
    push = fem.Traction(tags["upper_top"], tuple(-1e5 * np.eye(d)[1]))
    held = fem.assemble(
        mesh,
        STONE,
        tied=fem.Tied(tags["upper_bottom"], tags["lower_top"], matching=MORTAR),
        clamped=tags["lower_bottom"],
        loads=push,
    )
    area = 1.0 if d == 2 else 1.5
    lift = foot_force(held, tags["lower_bottom"], push, d)
    assert lift == pytest.approx(1e5 * area, rel=1e-11)
    # shifted: 1.3 and 1.7 of 4 columns of facets in front of nothing
    other = BlockMesh(lengths=(4.0, 1.0, 1.5)[:d], divisions=(7, 2, 3)[:d])
    mesh, tags = fem.build_mesh(
        TwoBlocks(lower=large, upper=other, offset=(1.3, 0.4)[: d - 1]), comm
    )
    tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
    system = fem.assemble(mesh, STONE, tied=tie)
    assert rigid_error(system) < 1e-12 and errors_of_followers(system, d) < 1e-12


def errors_of_followers(system, d):
    """How far followers are from a constant strain, over it."""
    space = system.space
    exact = space.points @ strain(d).T
    wrong = np.abs(space.expand(space.restrict(exact), 0.0) - exact).max(initial=0.0)
    return space.comm.max(wrong) / np.abs(strain(d)).max()


def foot_force(system, group, load, d):
    """The vertical force of the support [N] in statics under a load."""
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    recorder = vc.Reactions("foot", group, (0.0,) * d, loads=load)
    return recorder.start(problem, state)["reaction_y_foot"]


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_ties_that_cross(comm, d):
    """Four blocks round an edge, four ties, all meshes unlike: in the plane, and in space where
    nodes of the edge coincide, a constant stress passes."""
    corners = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (1.0, 1.0), "d": (0.0, 1.0)}
    divisions = {"a": (2, 2), "b": (3, 4), "c": (2, 3), "d": (4, 3)}
    blocks = {
        name: BlockMesh(
            lengths=(1.0, 1.0, 1.0)[:d],
            divisions=(*divisions[name], 2)[:d],
            corner=(*corner, 0.0)[:d],
            simplices=True,
        )
        for name, corner in corners.items()
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), comm)
    joints = [
        ("a_right", "b_left"),
        ("b_top", "c_bottom"),
        ("c_left", "d_right"),
        ("d_bottom", "a_top"),
    ]
    ties = [fem.Tied(tags[one], tags[two], matching=MORTAR) for one, two in joints]
    loads = pulled(tags, d, [name for joint in joints for name in joint])
    system = fem.assemble(mesh, STONE, tied=ties, loads=loads)
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-12
    assert rigid_error(system) < 1e-12


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_held_sides_beside_a_tie(comm, d):
    """Confined compression between rollers that hold one block's side from x = 0 on, at the tie
    too: uniaxial strain is exact. A roller that pushes the sides of both blocks moves what follows
    it, and supports take all forces."""
    mesh, tags, tie = stack(comm, d, 1)
    sides = [(body, side) for body in ("lower", "upper") for side in NORMALS]
    rollers = []
    for body, side in sides:
        axis = int(np.argmax(np.abs(NORMALS[side])))
        name = f"{body}_{side}"
        if name in tags and axis != 1:
            rollers.append(fem.Prescribed(tags[name], components=(axis,)))
    push = fem.Traction(tags["upper_top"], tuple(-1e5 * np.eye(d)[1]))
    foot = fem.Prescribed(tags["lower_bottom"], components=(1,))
    system = fem.assemble(mesh, STONE, tied=tie, loads=push, prescribed=[foot, *rollers])
    points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    confined = STONE.rho * STONE.c_p**2
    exact = -1e5 / confined * np.outer(points[:, 1], np.eye(d)[1])
    assert np.abs(u - exact).max() < 1e-12 * 1e5 / confined
    # settle the foot and lean the left sides: rigid motions and shear of what moves with them
    lean = [
        fem.Prescribed(tags[f"{body}_left"], (0.01, 0.02, 0.03)[:d]) for body in ("lower", "upper")
    ]
    system = fem.assemble(mesh, STONE, tied=tie, prescribed=lean)
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    points, u = field(system, problem.cartesian(state.u))
    assert np.abs(u - np.array([0.01, 0.02, 0.03][:d])).max() < 1e-12
    system = fem.assemble(mesh, STONE, tied=tie, prescribed=lean, loads=push)
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    carried = sum(
        vc.Reactions("side", tags[f"{body}_left"], (0.0,) * d, loads=push).start(problem, state)[
            "reaction_y_side"
        ]
        for body in ("lower", "upper")
    )
    assert carried == pytest.approx(1e5 * (2.0 if d == 2 else 3.0), rel=1e-10)


def halves(mesh, tags):
    """Left and right halves of both sides of the interface of two blocks of length 2."""
    import dolfinx

    found = {}
    mesh.topology.create_connectivity(1, 2)
    for name in ("lower_top", "upper_bottom"):
        indices = tags[name].indices
        x = dolfinx.mesh.compute_midpoints(mesh, 1, indices)[:, 0]
        for side, mask in (("left", x < 1.0), ("right", x > 1.0)):
            found[name, side] = fem.Facets(f"{name}_{side}", indices[mask], mesh)
    return found


@pytest.mark.two_ranks
def test_a_tie_beside_a_contact(comm):
    """The left half of unlike boundaries is tied, the right half is a contact, and both meet at
    x = 1: pressed by 1 MPa the pressure is 1 MPa; pulled, the right half opens, as on a mesh of 8
    and 8 cells, whose end goes up by 17.25 mm, to the error of the mesh."""
    lower, upper = (BlockMesh(lengths=(2.0, 1.0), divisions=(n, 4)) for n in (8, 6))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), comm)
    part = halves(mesh, tags)
    material = vc.LinearElastic(E=1e9, nu=0.0, rho=2000.0)
    one, two = (part[name, "left"] for name in ("lower_top", "upper_bottom"))
    ends = []
    for tie in (fem.Tied(one, two, matching=MORTAR), fem.Tied(two, one, matching=MORTAR)):
        for load in (-1e6, 1e6):
            pressed = fem.Traction(tags["upper_top"], (0.0, load))
            system = fem.assemble(
                mesh, material, clamped=tags["lower_bottom"], loads=pressed, tied=tie
            )
            sides = (part["upper_bottom", "right"], part["lower_top", "right"])
            surface = fem.contact_pair(system, *sides, matching=MORTAR)
            problem = vc.ContactProblem(system, surface)
            state = vc.static_equilibrium(problem)
            pressure = surface.everywhere(state.r_n / surface.weights)
            assert len(pressure) == 3
            assert pressure == pytest.approx(np.full(3, max(-load, 0.0)), rel=1e-9, abs=1e-3)
            points, u = field(system, problem.cartesian(state.u))
            ends.append(u[np.linalg.norm(points - [2.0, 1.0], axis=1) < 1e-9, 1].max())
        whole = (tags["upper_bottom"], tags["lower_top"])
        for sides in (whole, whole[::-1]):
            with pytest.raises(
                InputError, match="is tied by matching= to several nodes: a contact"
            ):
                fem.contact_pair(system, *sides, matching=MORTAR)
    assert ends[0] == pytest.approx(-1e-3, rel=1e-9) and ends[2] == pytest.approx(-1e-3, rel=1e-9)
    assert ends[1] == pytest.approx(17.25e-3, rel=0.06) and ends[3] == pytest.approx(ends[1])


@pytest.mark.two_ranks
def test_unlike_sides_of_one_period(comm):
    """Sides of one period meshed unlike: a constant and a shear that repeats itself are exact, and
    a rotation, which does not repeat itself, is none."""
    left = BlockMesh(lengths=(1.0, 1.0), divisions=(3, 4))
    right = BlockMesh(lengths=(1.0, 1.0), divisions=(3, 7), corner=(1.0, 0.0))
    mesh, tags = fem.build_mesh(Blocks({"one": left, "two": right}), comm)
    ties = [
        fem.Tied(tags["one_right"], tags["two_left"], matching=MORTAR),
        fem.Tied(tags["one_left"], tags["two_right"], matching=MORTAR),
    ]
    shear = 1e5
    system = fem.assemble(
        mesh,
        STONE,
        tied=ties,
        clamped=[tags["one_bottom"], tags["two_bottom"]],
        loads=[fem.Traction(tags[f"{name}_top"], (shear, 0.0)) for name in ("one", "two")],
    )
    points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    exact = np.outer(points[:, 1], [2.0 * (1.0 + NU) * shear / E, 0.0])
    assert np.abs(u - exact).max() < 1e-12 * np.abs(exact).max()


def test_a_tie_in_time_and_when_a_body_yields(comm):
    """A wave crosses the tie: the ledger closes in 200 steps. The tangent of a body that yields is
    that of the elastic one while it does not."""
    mesh, tags, tie = stack(comm, 2, 1)
    hit = fem.Traction(tags["upper_top"], (0.0, -1e6))
    system = fem.assemble(mesh, STONE, tied=tie, loads=hit, clamped=tags["lower_bottom"])
    solution = vc.simulate(
        linear(system), scheme=vc.Newmark(), dt=1e-5, steps=200, record=[vc.Energy()]
    )
    assert solution.facts["energy_defect"] < 1e-11
    strong = MohrCoulomb(E, NU, 2000.0, cohesion=1e12, phi=30.0, psi=30.0)
    yielding = fem.assemble(mesh, strong, tied=tie, loads=hit, clamped=tags["lower_bottom"])
    states = [vc.static_equilibrium(linear(one)) for one in (system, yielding)]
    assert np.abs(states[1].u - states[0].u).max() < 1e-9 * np.abs(states[0].u).max()


def test_what_cannot_be_tied_is_refused(comm):
    """Another matching, sides that look the same way, a facet of second order that nothing covers
    as a whole, and boundaries without a part in common."""
    mesh, tags, tie = stack(comm, 2, 1)
    sides = (tags["lower_top"], tags["upper_bottom"])
    with pytest.raises(InputError, match=r"matching must be DualMortar\(\) or None, got NodeToN"):
        fem.Tied(*sides, matching=fem.NodeToNode())
    with pytest.raises(InputError, match=r"mesh both sides alike, or give matching=DualMortar\(\)"):
        fem.assemble(mesh, STONE, tied=fem.Tied(*sides))
    with pytest.raises(InputError, match="normals point the same way: choose the two boundaries"):
        fem.assemble(
            mesh, STONE, tied=fem.Tied(tags["lower_top"], tags["upper_top"], matching=MORTAR)
        )
    shifted = BlockMesh(lengths=(2.0, 1.0), divisions=(3, 2))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=shifted, upper=shifted, offset=(0.4,)), comm)
    tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
    with pytest.raises(InputError, match="facets of second order are tied as a whole, so mesh"):
        fem.assemble(mesh, STONE, tied=tie, degree=2)
    apart = TwoBlocks(lower=shifted, upper=shifted, offset=(5.0,))
    mesh, tags = fem.build_mesh(apart, comm)
    for degree in (1, 2):
        with pytest.raises(InputError, match="'upper_bottom' lies opposite|'lower_top' lies oppos"):
            tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
            fem.assemble(mesh, STONE, tied=tie, degree=degree)


@pytest.mark.serial
def test_a_case_file_names_the_matching(tmp_path):
    """The table of a tie says matching = {type = "DualMortar"}; another word is refused."""
    from vi_contact.practice.studies import read_case

    text = """
    [mesh]
    type = "TwoBlocks"
    lower = {lengths = [2.0, 1.0], divisions = [3, 1]}
    upper = {lengths = [2.0, 1.0], divisions = [4, 1]}
    [material.lower]
    E = 1e9
    nu = 0.3
    rho = 2000.0
    [material.upper]
    E = 1e9
    nu = 0.3
    rho = 2000.0
    [system]
    fixed = "lower_bottom"
    tied = [{first = "lower_top", second = "upper_bottom", matching = {type = "WORD"}}]
    [run]
    dt = 1e-4
    steps = 1
    """
    path = tmp_path / "tied.toml"
    path.write_text(text.replace("WORD", "DualMortar"))
    problem = read_case(path).problem(MPI.COMM_SELF)
    assert len(problem.system.space.mean_nodes) == 3
    path.write_text(text.replace("WORD", "NodeToNode"))
    with pytest.raises(InputError, match="NodeToNode"):
        read_case(path).problem(MPI.COMM_SELF)
