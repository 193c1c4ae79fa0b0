"""Section forces through elements, reactions and contact resultants of bodies in space against
statics and momentum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from all_ranks import seen
from fem_problems import CONCRETE, block, field, linear
from two_bodies import blocks, forces, two_blocks

import vi_contact as vc
from vi_contact import engineering, fem, solvers
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks

WIDTH, HEIGHT, DEPTH = 0.5, 4.0, 0.7
SIX = ("N", "V_2", "V_3", "M_t", "M_2", "M_3")
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["hexahedra", "tetrahedra"])


def rotation(number: int) -> Array:
    """A rotation in space, none for 0."""
    q = np.linalg.qr(np.random.default_rng(number).standard_normal((3, 3)))[0]
    return np.eye(3) if number == 0 else q * np.linalg.det(q)


def level_cut(y: float, slope: float = 0.0) -> Array:
    """a, b, c of a cut of the column, e_2 up the slope from the left to the right, e_3 to the back,
    n upwards."""
    return np.array([(0.0, y, DEPTH), (WIDTH, y + slope * WIDTH, DEPTH), (0.0, y, 0.0)])


def six_of(row: Any, name: str) -> Array:
    return np.array([row[f"{quantity}_{name}"] for quantity in SIX])


# Section forces
# --------------------------------------------------------------------------------------------------

TIP, WIND, WEIGHT = (
    np.array([2e3, -5e3, 700.0]),
    np.array([900.0, 0.0, 0.0]),
    np.array([300.0, -24e3, 150.0]),
)


def above(y: float, slope: float) -> Array:
    """N, V_2, V_3, M_t, M_2, M_3 of a column from what is above a cut: loads of tip, left face and
    body."""
    e_2 = np.array([1.0, slope, 0.0]) / np.hypot(1.0, slope)
    e_3 = np.array([0.0, 0.0, -1.0])
    axes = np.array([np.cross(e_2, e_3), e_2, e_3])
    middle = np.array([0.5 * WIDTH, y + 0.5 * slope * WIDTH, 0.5 * DEPTH])
    x, share = np.polynomial.legendre.leggauss(3)  # exact for what the moments are made of
    x, share = 0.5 * WIDTH * (1.0 + x), 0.5 * WIDTH * share
    loads = [
        (TIP * WIDTH * DEPTH, (0.5 * WIDTH, HEIGHT)),
        (WIND * (HEIGHT - y) * DEPTH, (0.0, 0.5 * (y + HEIGHT))),
    ]
    loads += [
        (WEIGHT * w * DEPTH * (HEIGHT - y - slope * at), (at, 0.5 * (y + slope * at + HEIGHT)))
        for at, w in zip(x, share, strict=True)
    ]
    force = sum(load for load, _ in loads)
    moment = sum(np.cross((*place, 0.5 * DEPTH) - middle, load) for load, place in loads)
    return np.concatenate([axes @ force, axes @ moment])


@shapes
@pytest.mark.parametrize("turn", [0, 3])
@pytest.mark.promise("guide/outputs.md", "Tests compare it with statics to 1e-10")
def test_sections_of_a_column_are_those_of_statics(comm: Any, simplices: bool, turn: int) -> None:
    """Along faces of the mesh, through elements, inclined, in any orientation: all six to 1e-10;
    the foot's are minus its reactions."""
    Q = rotation(turn)
    mesh, tags = block(
        comm,
        lengths=(WIDTH, HEIGHT, DEPTH),
        divisions=(2, 6, 2),
        simplices=simplices,
        deform=lambda x: x @ Q.T,
    )
    loads = [
        fem.Traction(tags["top"], tuple(Q @ TIP)),
        fem.Traction(tags["left"], tuple(Q @ WIND)),
        fem.BodyForce(tuple(Q @ WEIGHT)),
    ]
    problem = linear(fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=loads))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    places = {
        "foot": (0.0, 0.0),
        "line": (2.0 * HEIGHT / 6.0, 0.0),
        "through": (1.7, 0.0),
        "inclined": (1.6, 0.8),
        "top": (3.95, 0.0),
    }
    cuts = {name: level_cut(*place) @ Q.T for name, place in places.items()}
    row = vc.SectionForces(cuts, loads=loads).start(problem, state)
    for name, place in places.items():
        expected = above(*place)
        assert np.abs(six_of(row, name) - expected).max() < 1e-10 * np.abs(expected).max(), name
    back = {name: cuts[name][[0, 2, 1]] for name in ("foot", "inclined")}  # sides exchanged
    turned = vc.SectionForces(back, loads=loads).start(problem, state)
    # the other way through: N and M_t stay, along the same axes the others change their signs
    for name in back:
        assert six_of(turned, name) == pytest.approx(
            six_of(row, name)[[0, 2, 1, 3, 5, 4]] * (1, -1, -1, 1, -1, -1)
        )
    held = vc.Reactions("foot", tags["bottom"], tuple(Q @ (0.25, 0.0, 0.35)), loads).start(
        problem, state
    )
    held_up = [[held[f"reaction_{kind}{axis}_foot"] for axis in "xyz"] for kind in ("", "M_")]
    axes = Q @ np.array([(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)]).T
    assert np.ravel(held_up @ axes) == pytest.approx(
        -six_of(row, "foot"), rel=1e-9, abs=1e-10 * WEIGHT[1] * -1.4
    )


@pytest.mark.two_ranks
def test_uniform_stress_on_any_plane(comm: Any) -> None:
    """A block of distorted elements under a uniform stress: sigma n A and no moment on planes that
    are inclined both ways, from a rectangle that is larger than the section."""
    stress = 1e5 * np.array([(2.0, 0.6, -0.3), (0.6, -1.0, 0.5), (-0.3, 0.5, 0.4)])
    E, nu = CONCRETE.E, CONCRETE.nu
    strain = ((1.0 + nu) * stress - nu * np.trace(stress) * np.eye(3)) / E

    def bent(x: Array) -> Array:
        inner = np.prod(
            [np.sin(np.pi * x[:, i] / size) for i, size in enumerate((1.0, 1.5, 1.2))], axis=0
        )
        return x + 0.1 * inner[:, None] * (1.0, -0.7, 0.8)

    mesh, tags = block(comm, lengths=(1.0, 1.5, 1.2), divisions=(3, 3, 3), deform=bent)
    outward = {
        "left": (-1, 0, 0),
        "right": (1, 0, 0),
        "top": (0, 1, 0),
        "back": (0, 0, -1),
        "front": (0, 0, 1),
    }
    loads = [fem.Traction(tags[name], tuple(stress @ n)) for name, n in outward.items()]
    held = fem.Prescribed(tags["bottom"], displacement=lambda x, t: x @ strain)
    problem = linear(fem.assemble(mesh, CONCRETE, prescribed=held, loads=loads))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    n = np.array([0.2, 1.0, -0.3]) / np.linalg.norm([0.2, 1.0, -0.3])
    e_2 = np.cross(n, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(n, (0.0, 0.0, 1.0)))
    axes = np.array([n, e_2, np.cross(n, e_2)])
    a = np.array([0.5, 0.7, 0.6]) - axes[1] - axes[2]
    cuts = {
        "skew": (a, a + 2.0 * axes[1], a + 2.0 * axes[2]),
        "huge": a + 1e6 * np.array([-axes[1] - axes[2], axes[1] - axes[2], axes[2] - axes[1]]),
    }
    row = vc.SectionForces(cuts, loads=loads).start(problem, state)
    area = 1.0 * 1.2 / n[1]
    expected = np.concatenate([axes @ stress @ n * area, np.zeros(3)])
    assert np.abs(six_of(row, "skew") - expected).max() < 1e-10 * np.abs(expected).max()
    # its lengths are known to 1e-10 m; about its middle 1e6 m away arms are, too
    assert np.abs(six_of(row, "huge")[:3] - expected[:3]).max() < 1e-7 * np.abs(expected).max()


def shaken_column(comm: Any) -> tuple[vc.ContactProblem, Any]:
    mesh, tags = block(comm, lengths=(WIDTH, HEIGHT, DEPTH), divisions=(1, 4, 1), simplices=True)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], damping=vc.Rayleigh(20.0, 1e-4))
    return linear(system, excitation=vc.Harmonic(3.0, 30.0, direction=(0.6, 0.48, 0.64))), tags


@pytest.mark.two_ranks
def test_sections_carry_inertia(comm: Any) -> None:
    """Of a shaken column with damping: forces on the planes of a layer of tetrahedra and inside it
    are one polynomial of the height, of degree four, as linear accelerations in tetrahedra make it;
    at the foot they are minus the reactions."""
    problem, tags = shaken_column(comm)
    heights = {"foot": 0.0} | {f"at_{k}": 1.0 + 0.2 * k for k in range(6)}
    sections = vc.SectionForces({name: level_cut(y) for name, y in heights.items()})
    held = vc.Reactions("foot", tags["bottom"], (0.25, 0.0, 0.35))
    solution = vc.simulate(
        problem, scheme=vc.Newmark(), dt=2e-3, steps=12, record=[sections, held], progress=False
    )
    found = {name: np.array([solution.history[f"{q}_{name}"] for q in SIX[:3]]) for name in heights}
    size = np.abs(found["foot"]).max()
    fifth = np.tensordot(
        (1.0, -5.0, 10.0, -10.0, 5.0, -1.0), [found[f"at_{k}"] for k in range(6)], axes=1
    )
    assert np.abs(fifth).max() < 1e-10 * size
    assert np.abs(found["at_0"] - found["at_5"]).max(axis=1).min() > 1e-2 * size
    reactions = np.array([solution.history[f"reaction_{axis}_foot"] for axis in "yxz"])
    assert np.abs(found["foot"] * [[1.0], [1.0], [-1.0]] + reactions).max() < 1e-10 * size


@pytest.mark.two_ranks
def test_one_leg_of_two(comm: Any) -> None:
    """The rectangle says which part of a plane is meant; it may not end inside a body, and has a
    right angle."""
    legs = {
        name: BlockMesh(lengths=(0.5, 2.0, 0.5), divisions=(1, 3, 1), corner=(x, 0.0, 0.0))
        for name, x in (("left", 0.0), ("right", 2.0))
    }
    mesh, tags = fem.build_mesh(Blocks(legs), comm)
    loads = [
        fem.Traction(tags[f"{name}_top"], (0.0, -p, 0.0))
        for name, p in (("left", 1e3), ("right", 3e3))
    ]
    clamped = [tags["left_bottom"], tags["right_bottom"]]
    problem = linear(fem.assemble(mesh, CONCRETE, clamped=clamped, loads=loads))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())

    def rectangle(x: float, width: float) -> Array:
        return np.array([(x, 0.9, 0.5), (x + width, 0.9, 0.5), (x, 0.9, 0.0)])

    cuts = {"left": rectangle(0.0, 0.5), "both": rectangle(-1.0, 4.5)}
    row = vc.SectionForces(cuts, loads=loads).start(problem, state)
    assert row["N_left"] == pytest.approx(-250.0, rel=1e-10)
    assert row["N_both"] == pytest.approx(-1000.0, rel=1e-10)
    # -∫ s_2 sigma
    assert row["M_3_both"] == pytest.approx(
        250.0 * (0.25 - 1.25) + 750.0 * (2.25 - 1.25), rel=1e-10
    )
    for corners, text in (
        (rectangle(0.0, 0.3), "ends inside"),
        (rectangle(0.6, 1.2), "elements cover 0 of its 0.6 m²"),
        (rectangle(0.0, 0.5) + np.array([(0, 0, 0), (0, 0, 0.1), (0, 0, 0)]), "right angle at a"),
        (rectangle(0.0, 0.5)[[0, 0, 1]], "same point"),
        (((0.0, 1.0), (0.5, 1.0)), "2 corners"),
        (((0.0, 1.0, 0.5), (0.5, 1.0, 0.5)), "2 points of 3 coordinates; give 2 ends"),
    ):
        with pytest.raises(InputError, match=text):
            vc.SectionForces({"bad": corners}).start(problem, state)


# Reactions
# --------------------------------------------------------------------------------------------------


@pytest.mark.promise("guide/outputs.md", "R is -D v + 2 D v_up to 1e-10")
def test_a_compliant_base_carries_all_momentum(comm: Any) -> None:
    """Base shear in three components of a block on soil that lets a wave in: rates of momentum and
    angular momentum of all masses, and rho c A (2 v_up - v) of the dashpots."""
    mesh, tags = block(comm, lengths=(3.0, 2.0, 2.0), divisions=(3, 2, 2))
    system, free = (
        fem.assemble(mesh, CONCRETE, dashpots=wave_on(tags["bottom"])),
        fem.assemble(mesh, CONCRETE),
    )
    problem, centre = linear(system), np.array([1.0, 0.0, 0.5])
    reactions = vc.Reactions("base", tags["bottom"], tuple(centre))
    assert not any(reactions.start(problem, initial_state(problem)).values())
    x = system.space.points
    rigid = [np.tile(e, (len(x), 1)) for e in np.eye(3)] + [
        np.cross(e, x - centre) for e in np.eye(3)
    ]
    momenta = np.array([free.M @ one.ravel() for one in rigid])
    edges = [(x[:, i] == 0.0) | (x[:, i] == size) for i, size in ((0, 3.0), (2, 2.0))]
    shares = np.where(edges, 0.5, 1.0).prod(axis=0) * (x[:, 1] == 0.0)  # m² of the base
    impedance = CONCRETE.rho * np.array([CONCRETE.c_s, CONCRETE.c_p, CONCRETE.c_s])
    rows, rates, dashpots = [], [], []
    for _, report in vc.march(
        problem, scheme=vc.Trapezoidal(), solver=vc.Condensed(), dt=1e-3, steps=20
    ):
        rows.append(list(reactions.row(report).values()))
        rates.append(comm.allreduce(momenta @ report.balance.a))
        up = 0.5 * (wave(report.old.t) + wave(report.new.t))
        dashpots.append(
            comm.allreduce(shares @ (impedance * (2.0 * up - report.balance.v.reshape(-1, 3))))
        )
    size = np.abs(rates).max(axis=0)
    assert np.abs(np.subtract(rows, rates)).max() < 1e-10 * size.max()
    assert (
        np.abs(np.array(rows)[:, :3] - dashpots).max() < 1e-10 * size.max()
        and size.min() > 1e-3 * size.max()
    )
    with pytest.raises(InputError, match="no dashpots"):
        vc.Reactions("top", tags["top"], tuple(centre)).start(problem, initial_state(problem))


def wave(t: float) -> Array:
    return 1e-2 * np.sin(60.0 * t) * np.array([1.0, 0.4, -0.7])


def wave_on(facets: Any) -> fem.CompliantBase:
    return fem.CompliantBase(facets, motion=wave)


# Resultants of contact
# ------------------------------------------------------------------------------------------------


def pushed(problem: vc.ContactProblem) -> vc.State:
    """Some reactions, of friction too, the same on any number of ranks; tangents that do not rub
    carry none."""
    surface, random = problem.surface, np.random.default_rng(8)
    r_n, r_t = random.random(surface.total), random.standard_normal((surface.total, 2))
    mine = np.where(surface.tangents >= 0, r_t[surface.slots], 0.0)
    u = v = np.zeros(problem.system.rows)
    return vc.State(0.0, 0, u, v, r_n[surface.slots], np.ones(surface.count, dtype=bool), {}, mine)


def of_nodes(
    problem: vc.ContactProblem, state: vc.State, centre: Any, body: int | None = None
) -> Array:
    """(6,) force and moment about a centre of the contact reactions on the nodes, of one body or of
    all."""
    load = problem.surface.reaction_load(state.r_n, problem.system.rows, state.r_t)
    every, points = -forces(problem, load), field(problem.system, np.zeros(problem.system.rows))[0]
    if body is not None:
        space: Any = problem.system.space
        every = every * (
            space.at_nodes(np.arange(len(every)), 1.0 + space.body_of_node[:, None]) == 1.0 + body
        )
    return np.concatenate([every.sum(axis=0), np.cross(points - centre, every).sum(axis=0)])


def force_and_moment(row: Any, name: str) -> Array:
    return np.array([row[f"{kind}_{axis}_{name}"] for kind in ("force", "M") for axis in "xyz"])


CENTRE = (0.3, -0.2, 0.4)


@pytest.mark.two_ranks
def test_edges_and_corners_rub_as_their_nodes_do(comm: Any) -> None:
    """Three faces that meet at oblique angles, turned: force and moment are those of the nodal
    forces, the parts of the faces add up, and the summary of a run agrees, whether it knows the
    nodes or only the places."""
    Q = rotation(5)

    def leaning(x: Array) -> Array:
        return (x + np.column_stack([0.3 * x[:, 1], 0.2 * x[:, 2], np.zeros(len(x))])) @ Q.T

    mesh, tags = block(comm, lengths=(1.5, 1.0, 1.2), divisions=(3, 2, 2), deform=leaning)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["top"])
    faces = np.concatenate([tags[name].indices for name in ("left", "bottom", "back")])
    surface = fem.contact_surface(
        system, fem.Facets("hull", faces, mesh)
    ).with_frictionless_corners()
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    state = pushed(problem)
    assert sorted({len(corner) for corner in seen(surface).corners}) == [2, 3]
    expected = of_nodes(problem, state, CENTRE)
    row = vc.Resultants("all", CENTRE).start(problem, state)
    assert force_and_moment(row, "all") == pytest.approx(expected, rel=1e-11)
    n = seen(surface).normals
    directions = [
        n[np.argmax(n @ Q @ way)] for way in ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
    ]
    parts = [
        vc.Resultants("face", CENTRE, where=lambda x, n, one=one: n @ one > 0.99)
        for one in directions
    ]
    added = sum(force_and_moment(part.start(problem, state), "face") for part in parts)
    assert added == pytest.approx(expected, rel=1e-11)
    whole = surface.whole()
    r_n, r_t, slip = (
        surface.everywhere(one) for one in (state.r_n, state.r_t, np.zeros_like(state.r_t))
    )
    history = {
        "t": np.zeros(1),
        "pressure": (r_n / whole.weights)[None],
        "gap": 0.0 * r_n[None],
        "active": np.ones((1, len(r_n))),
        "traction_t": (r_t / whole.weights[:, None])[None],
        "slip": slip[None],
    }
    for geometry in (surface, Places(whole.points, whole.normals, whole.weights)):
        found = engineering.contact_summary(history, geometry, centre=CENTRE)
        assert {name: float(one[0]) for name, one in found.items()} == pytest.approx(
            {name: row[f"{name}_all"] for name in found}, rel=1e-12, abs=1e-12
        )


@dataclass(frozen=True)
class Places:
    """What a run folder tells of contact points."""

    points: Array
    normals: Array
    weights: Array


@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_action_is_reaction_between_faces_that_do_not_match(comm: Any, gap: float) -> None:
    """The resultant of a mortar pair is what side 1 feels, side 2 minus that, moment included;
    across a gap the couple of gap and friction remains."""
    Q = rotation(2)
    meshes = blocks(3, upper=(3, 2, 2), lower=(2, 2, 3), gap=gap).blocks()
    turned = Blocks(
        {name: replace(one, deform=lambda x: x @ Q.T) for name, one in meshes.blocks.items()}
    )
    system, tags = two_blocks(comm, turned)
    surface = fem.contact_pair(
        system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    state = pushed(problem)
    found = force_and_moment(vc.Resultants("pair", CENTRE).start(problem, state), "pair")
    one, two = (
        of_nodes(problem, state, CENTRE, list(turned.blocks).index(name))
        for name in ("upper", "lower")
    )
    assert found == pytest.approx(one, rel=1e-11)
    one[3:] -= np.cross(Q @ (0.0, gap, 0.0), one[:3])
    assert two == pytest.approx(-one, rel=1e-11)


@pytest.mark.two_ranks
def test_turn_and_settlement_of_a_footing(comm: Any) -> None:
    """A stiff block on springs, level and in any orientation, under its weight, a push and an
    overturning: forces and moments are those of the loads, theta = M/(k I), settlement = N/(k A), e
    = M/N; vectors turn with the block."""
    size, k, force = (2.0, 1.0, 1.5), 1e7, np.array([4e3, -6e4, -3e3])  # m, Pa/m, N/m³
    rows = []
    for turn in (0, 4):
        Q = rotation(turn)
        mesh, tags = block(
            comm,
            lengths=size,
            divisions=(2, 2, 2),
            deform=lambda x, Q=Q: (x - (1.0, 0.0, 0.75)) @ Q.T,
        )
        stiff = vc.LinearElastic(E=1e4 * k, nu=0.2, rho=2000.0)
        system = fem.assemble(mesh, stiff, loads=fem.BodyForce(tuple(Q @ force)))
        ground = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=tuple(Q[:, 1]))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=ground).on_springs(k)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.9))
        state = vc.static_equilibrium(
            problem, solver=vc.Condensed(friction_method=solvers.FrictionNewton())
        )
        rows.append(vc.Resultants("base", (0.0, 0.0, 0.0)).start(problem, state))
        assert rows[-1]["uplift_base"] == 0.0

    def vector(row: Any, kind: str) -> Array:
        return np.array([row[f"{kind}_{axis}_base"] for axis in "xyz"])

    level, turned = rows
    volume, load = np.prod(size), force * np.prod(size)
    moment = np.cross((0.0, -0.5, 0.0), load)  # of the forces on the base
    assert vector(level, "force") == pytest.approx(-load, rel=1e-8)
    assert vector(level, "T") == pytest.approx(-load * (1.0, 0.0, 1.0), rel=1e-8, abs=1e-8 * volume)
    assert vector(level, "M")[[0, 2]] == pytest.approx(moment[[0, 2]], rel=1e-8)
    assert level["N_base"] == pytest.approx(-load[1], rel=1e-8)
    assert vector(level, "e")[[0, 2]] == pytest.approx(
        np.array([moment[2], -moment[0]]) / -load[1], rel=1e-8
    )
    assert level["e_base"] == pytest.approx(np.hypot(*moment[[0, 2]]) / -load[1], rel=1e-8)
    weights, x = seen(surface).weights, seen(surface).points @ Q
    stiffness = k * (weights @ x[:, 2] ** 2), k * (weights @ x[:, 0] ** 2)
    assert vector(level, "theta")[[0, 2]] == pytest.approx(-moment[[0, 2]] / stiffness, rel=1e-3)
    assert np.isnan(level["theta_y_base"])
    assert level["settlement_base"] == pytest.approx(-load[1] / (k * 3.0), rel=1e-3)
    for kind in ("force", "T", "M", "e"):
        expected = Q @ vector(level, kind)
        assert np.abs(vector(turned, kind) - expected).max() < 1e-8 * np.abs(expected).max(), kind
    expected = Q @ np.nan_to_num(vector(level, "theta"))
    assert np.abs(vector(turned, "theta") - expected).max() < 1e-7 * np.abs(expected).max()
    for name in ("N", "T", "e", "settlement"):
        assert turned[f"{name}_base"] == pytest.approx(level[f"{name}_base"], rel=1e-8), name
