"""Contact boundaries that turn: one condition for every face of a node, at any angle between the
faces (V2.8)."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from math import pi, radians
from typing import Any

import h5py
import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import dense, field, max_over_ranks, turned
from mpi4py import MPI
from reference_lcp import enumerate_lcp
from two_bodies import SOFT, forces, relative

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import ContactSurface
from vi_contact.fem.mesh.tagged_mesh import Facets
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import MeshArrays, add_arrays
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.practice.soil.moving_base import base_motion
from vi_contact.run.files.identity import FRAMES, find_differences
from vi_contact.solvers.volume.route import Volume

COMM = MPI.COMM_WORLD
SIDES = ("left", "bottom", "right", "top", "back", "front")


def trapezoid(x: Array) -> Array:
    """Of a 3 x 1 rectangle: base 3, sides at 60 degrees. The boundary turns by 120 degrees below,
    by 60 above."""
    return np.column_stack([x[:, 0] + (1.0 - x[:, 0] / 1.5) * x[:, 1] / np.sqrt(3.0), x[:, 1]])


def leaning(x: Array) -> Array:
    """A parallelepiped without right angles."""
    return x @ np.array([[1.0, 0.2, 0.1], [0.35, 1.0, -0.25], [-0.15, 0.3, 1.0]])


BODIES: dict[str, dict[str, Any]] = {
    "rectangle": {"lengths": (1.5, 1.0), "divisions": (4, 3)},
    "turned rectangle": {
        "lengths": (1.5, 1.0),
        "divisions": (4, 3),
        "simplices": True,
        "angle": 0.4,
    },
    "trapezoid": {"lengths": (3.0, 1.0), "divisions": (6, 3), "deform": trapezoid},
    "turned trapezoid": {
        "lengths": (3.0, 1.0),
        "divisions": (6, 3),
        "deform": trapezoid,
        "angle": 0.7,
    },
    "box": {"lengths": (1.5, 1.0, 1.2), "divisions": (3, 2, 2)},
    "leaning box": {"lengths": (1.5, 1.0, 1.2), "divisions": (3, 2, 2), "deform": leaning},
    "leaning tetrahedra": {
        "lengths": (1.5, 1.0, 1.2),
        "divisions": (3, 2, 2),
        "deform": leaning,
        "simplices": True,
    },
}


def on_ranks(names: Any, *several: Any) -> list[Any]:
    """Cases, all but the ``several`` on one rank only."""
    return [
        name if name in several else pytest.param(name, marks=pytest.mark.serial) for name in names
    ]


def body(name: str, **data: Any) -> tuple[Any, Any]:
    mesh, tags = fem.build_mesh(BlockMesh(**BODIES[name]), COMM)
    return fem.assemble(mesh, SOFT, **data), tags


def group(tags: Any, *names: str) -> Facets:
    """Several groups as one."""
    indices = np.unique(np.concatenate([tags[name].indices for name in names]))
    return Facets("wall", indices.astype(np.int32), tags[names[0]].mesh)


def sides_of(name: str) -> tuple[str, ...]:
    return SIDES[: 2 * len(BODIES[name]["lengths"])]


def order(surface: Any) -> Any:
    """Conditions by place and direction."""
    return np.lexsort(np.round(np.column_stack([surface.points, surface.normals]), 6).T)


def same(one: ContactSurface, other: ContactSurface) -> None:
    """The same conditions in another order, to round-off."""
    one, other = seen(one), seen(other)
    a, b = order(one), order(other)
    for attribute in ("points", "normals", "weights", "gap0"):
        assert getattr(one, attribute)[a] == pytest.approx(
            getattr(other, attribute)[b], rel=1e-13, abs=1e-13
        )


# One group is as many groups as it has faces
# --------------------------------------------------------------------------


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", on_ranks(BODIES, "turned trapezoid", "leaning tetrahedra"))
def test_one_group_is_a_group_for_each_face(name):
    """All sides of a body as one group and as four (six), joined: nodes, normals, weights, 2 (3) of
    each at corners."""
    system, tags = body(name)
    sides = sides_of(name)
    one = fem.contact_surface(system, group(tags, *sides))
    several = fem.joined_surfaces(*(fem.contact_surface(system, tags[side]) for side in sides))
    same(one, several)
    one, d = seen(one), one.points.shape[1]
    assert sorted({len(corner) for corner in one.corners}) == list(range(2, d + 1))
    assert sum(len(corner) == d for corner in one.corners) == 2**d
    # a closed boundary
    assert np.linalg.norm(one.weights @ one.normals) < 1e-13 * one.weights.sum()


def thrown(name: str, surface_of: Any, **how: Any) -> tuple[ContactSurface, Array, Array, Array]:
    """(surface, r_n and active of every step, last u along the axes) of a body thrown about in a
    box 1 mm wider."""
    near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
    d = len(BODIES[name]["lengths"])
    speed = np.array([-1.0, -2.0, 0.7])[:d]
    speed[:2] = turned(speed[:2], BODIES[name].get("angle", 0.0))
    system, tags = body(name, initial_velocity=lambda x: np.tile(speed, (len(x), 1)))
    surface = surface_of(system, tags, near)
    problem = ContactProblem(system, surface)
    reports = [report for _, report in vc.march(problem, dt=1e-3, steps=25, **how)]
    assert max(report.certificate.worst for report in reports) <= 1e-9
    r_n, active = (
        np.array([seen(surface).all(getattr(report.new, what)) for report in reports])
        for what in ("r_n", "active")
    )
    return surface, r_n, active, problem.cartesian(reports[-1].new.u)


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", on_ranks(("rectangle", "trapezoid", "leaning box"), "trapezoid"))
def test_both_move_alike(name):
    """In every step to round-off, with corners closed on one and on several faces."""
    sides = sides_of(name)
    one, r_n, active, u = thrown(
        name,
        lambda system, tags, near: fem.contact_surface(system, group(tags, *sides), obstacle=near),
    )
    other, r_n_, active_, u_ = thrown(
        name,
        lambda system, tags, near: fem.joined_surfaces(
            *(fem.contact_surface(system, tags[side], obstacle=near) for side in sides)
        ),
    )
    one, other = seen(one), seen(other)
    a, b = order(one), order(other)
    assert np.array_equal(active[:, a], active_[:, b])
    assert np.abs(r_n[:, a] - r_n_[:, b]).max() < 1e-9 * r_n.max()
    assert max_over_ranks(COMM, u - u_) < 1e-10 * max_over_ranks(COMM, u)
    closed = {int(active[k, corner].sum()) for k in range(len(active)) for corner in one.corners}
    assert {0, 1, 2} <= closed


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme", [vc.Midpoint(), vc.MoreauJean()], ids=["midpoint", "moreau-jean"]
)
def test_a_turned_corner_is_the_same(scheme):
    """The trapezoid and its turned copy: reactions in newtons along each face's own normal."""
    runs = []
    for name in ("trapezoid", "turned trapezoid"):
        runs.append(
            thrown(
                name,
                lambda system, tags, near: fem.contact_surface(
                    system, group(tags, *SIDES[:4]), obstacle=near
                ),
                scheme=scheme,
            )
        )
    (_, r_n, active, _), (_, turned_r_n, turned_active, _) = runs
    assert np.array_equal(active, turned_active)
    assert np.abs(turned_r_n - r_n).max() < 1e-8 * r_n.max()


@pytest.mark.serial
def test_mirror_symmetry_of_an_oblique_wall():
    """The trapezoid shaken to the right is the mirror image of the one shaken to the left, to
    1e-10."""
    system, tags = body("trapezoid")
    near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
    surface = fem.contact_surface(system, group(tags, *SIDES[:4]), obstacle=near)
    images = []
    for way in (1.0, -1.0):
        problem = ContactProblem(
            system, surface, excitation=vc.Harmonic(10.0, 8.0, direction=(way, -0.8))
        )
        reports = [report for _, report in vc.march(problem, dt=2e-3, steps=40)]
        images.append((reports, field(system, problem.cartesian(reports[-1].new.u))))
    points = seen(surface).points * (-1.0, 1.0) + (3.0, 0.0)
    mirrored = replace(surface, points=points, normals=seen(surface).normals * (-1.0, 1.0))
    a, b = order(seen(surface)), order(mirrored)
    largest = max(report.new.r_n.max() for report in images[0][0])
    for one, other in zip(images[0][0], images[1][0], strict=True):
        assert np.array_equal(one.new.active[a], other.new.active[b])
        assert np.abs(one.new.r_n[a] - other.new.r_n[b]).max() < 1e-10 * largest
    assert np.any([report.new.active[seen(surface).corners[0]].all() for report in images[0][0]])


# Oblique frames
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", ["trapezoid", "leaning box"])
def test_the_oblique_system_is_the_same_system(name):
    """u = T û with u_n = u·n on every face; energies, work of loads, inertia loads; forces on the
    conditions are r_n n. T⁻ᵀ is the ``dual``."""
    d = len(BODIES[name]["lengths"])
    pull = {"loads": fem.BodyForce(tuple(np.arange(1.0, d + 1.0)))}

    def some_field(x: Array) -> Array:
        return np.cos(2.0 * x) + x @ np.arange(d * d, dtype=float).reshape(d, d)

    system, tags = body(name, initial_displacement=some_field, initial_velocity=some_field, **pull)
    far = vc.AnalyticGap(lambda x: np.full(len(x), 1e3))
    surface = fem.contact_surface(system, group(tags, *sides_of(name)), obstacle=far)
    problem = ContactProblem(system, surface)
    other = problem.equations
    T, dual = dense(COMM, system, surface.basis), dense(COMM, system, surface.dual)
    assert (
        np.abs(T.T @ dual - np.eye(len(T))).max() < 1e-13
        and np.abs(T.T @ T - np.eye(len(T))).max() > 0.1
    )
    u = system.space.restrict(some_field(system.space.points))
    assert max_over_ranks(
        COMM, problem.cartesian(relative(problem, u)) - u
    ) < 1e-13 * max_over_ranks(COMM, u)
    expected = np.sum(some_field(seen(surface).points) * seen(surface).normals, axis=1)
    assert seen(surface).normal_values(relative(problem, u)) == pytest.approx(expected, abs=1e-12)
    assert other.kinetic_energy(other.v0) == pytest.approx(
        system.kinetic_energy(system.v0), rel=1e-12
    )
    assert other.strain_energy(other.u0) == pytest.approx(
        system.strain_energy(system.u0), rel=1e-12
    )
    work = system.algebra.dot(system.load(0.0), system.v0)
    assert other.algebra.dot(other.load(0.0), other.v0) == pytest.approx(work, rel=1e-12)
    assert max_over_ranks(COMM, problem.cartesian(other.u0) - system.u0) < 1e-13 * max_over_ranks(
        COMM, u
    )
    random = np.random.default_rng(2).random(seen(surface).count)
    push = forces(problem, seen(surface).reaction_load(random, system.rows))
    by_node = np.zeros_like(push)
    np.add.at(by_node, seen(surface).nodes, random[:, None] * seen(surface).normals)
    assert push == pytest.approx(by_node, abs=1e-12)


def test_redistributed_mass_at_oblique_corners():
    """No inertia on contact unknowns; all of the body's own: mass, centre and moments of inertia,
    with lumping too."""
    from vi_contact.laws.mass_transfer import rigid_motions

    for name, count, lumpings in (("trapezoid", 3, (0.0, 0.4, 1.0)), ("leaning box", 6, (0.4,))):
        fine = BODIES[name] | {"divisions": (12, 6) if count == 3 else (5, 5, 5)}
        mesh, tags = fem.build_mesh(BlockMesh(**fine), COMM)
        system = fem.assemble(mesh, SOFT)
        surface = fem.contact_surface(system, group(tags, "bottom", "left"))
        for lumping in lumpings:
            problem = ContactProblem(system, surface, mass=vc.Redistributed(lumping=lumping))
            ours, sums = problem.equations, system.algebra.comm.sum
            assert np.all(ours.massless[surface.owned]) and surface.dual is not None
            masses = []
            for one in (ours, ContactProblem(system, surface).equations):
                R = rigid_motions(one.influence, system.space.coordinates)
                assert R.shape[1] == count
                masses.append(sums(R.T @ np.column_stack([one.M @ mode for mode in R.T])))
            assert np.abs(masses[0] - masses[1]).max() < 1e-11 * np.abs(masses[1]).max()


@pytest.mark.serial
def test_lumped_mass_does_not_depend_on_the_frames():
    """Lumped mass before the contact nodes give theirs away: the kinetic energy of any rigid
    motion."""
    from vi_contact.core.corners import lump_masses

    system, tags = body("trapezoid")
    surface = fem.contact_surface(system, group(tags, *SIDES[:4]))
    equations = ContactProblem(system, surface).equations
    row_sums = sum(r * (equations.M @ r) for r in equations.influence.T)
    lumped = system.algebra.local(*lump_masses(surface, row_sums), system.rows)
    masses = []
    for matrix, frame in ((lumped, equations), (system.M, system)):
        rigid = frame.influence.T
        masses.append(system.algebra.comm.sum(rigid @ np.column_stack([matrix @ r for r in rigid])))
    assert masses[0] == pytest.approx(masses[1], rel=1e-12, abs=1e-12 * masses[1].max())


# Against other answers
# ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", on_ranks(("trapezoid", "turned trapezoid"), "turned trapezoid"))
def test_static_answer_by_enumeration(name):
    """The trapezoid, its top moved into a notch with gaps: r_n of all sets of contacts tried, on
    dense matrices along the axes."""
    angle = BODIES[name].get("angle", 0.0)
    push = turned((0.004, -0.02), angle)
    mesh, tags = fem.build_mesh(BlockMesh(**(BODIES[name] | {"divisions": (3, 1)})), COMM)
    system = fem.assemble(
        mesh, SOFT, prescribed=fem.Prescribed(tags["top"], lambda x, t: np.tile(push, (len(x), 1)))
    )
    gap = vc.AnalyticGap(lambda x: 0.005 * np.cos(3.0 * x[:, 0]) ** 2)
    surface = fem.contact_surface(system, group(tags, "left", "bottom", "right"), obstacle=gap)
    assert seen(surface).count == 6 and len(seen(surface).corners) == 2
    problem = ContactProblem(system, surface)
    K, size = dense(COMM, system, system.K), len(dense(COMM, system, system.K))
    ids, rank = np.unique(
        np.concatenate(COMM.allgather(np.asarray(system.space.ids))), return_inverse=True
    )
    assert len(rank) == size
    B = np.zeros((seen(surface).count, size))
    for row, (node, normal) in enumerate(
        zip(seen(surface).nodes, seen(surface).normals, strict=True)
    ):
        B[row, np.searchsorted(ids, 2 * node + np.arange(2))] = normal
    f = np.zeros(int(ids.max()) + 1)
    np.add.at(f, system.space.ids, system.load(0.0))
    free = np.linalg.solve(K, system.algebra.comm.sum(f)[ids])
    r = enumerate_lcp(
        B @ np.linalg.solve(K, B.T), seen(surface).gap0 - B @ free, seen(surface).bilateral
    )
    for solver in (vc.Condensed(), Volume()):
        state = vc.static_equilibrium(problem, solver=solver)
        assert seen(surface).all(state.r_n) == pytest.approx(r, abs=1e-9 * r.max())
    assert np.count_nonzero(r) >= 3 and (r[seen(surface).corners[0]] > 0.0).any()


@pytest.mark.parametrize("name", on_ranks(("trapezoid", "leaning box"), "leaning box"))
def test_a_block_wedged_in_a_notch(name):
    """Held by contact alone, without friction: the reactions of the faces are the components of the
    weight along their normals. Contact force of the recorder, resultants of each face, nodal forces
    along the axes: all the same."""
    d = len(BODIES[name]["lengths"])
    down = np.array([-0.3, 1.0]) if d == 2 else np.array([-0.5, -1.0, -0.4])
    sides = ("left", "top") if d == 2 else ("left", "bottom", "back")
    system, tags = body(name, loads=fem.BodyForce(tuple(1e3 * down)))
    surface = fem.contact_surface(system, group(tags, *sides))
    problem = ContactProblem(system, surface)
    weight = system.algebra.comm.sum(system.influence.T @ system.load(0.0))
    _, normals_of = np.unique(np.round(seen(surface).normals, 6), axis=0, return_inverse=True)
    normals_of = normals_of.ravel()
    normals = np.array([seen(surface).normals[normals_of == face][0] for face in range(d)])
    expected = np.linalg.solve(normals.T, weight)
    assert expected.min() > 0.0
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    found = np.array([seen(surface).all(state.r_n)[normals_of == face].sum() for face in range(d)])
    assert found == pytest.approx(expected, rel=1e-8)
    push = forces(problem, surface.reaction_load(state.r_n, system.rows))
    assert push.sum(axis=0) == pytest.approx(weight, rel=1e-8)
    row = vc.Contact().start(problem, state)
    assert [row[f"contact_force_{axis}"] for axis in "xyz"[:d]] == pytest.approx(-weight, rel=1e-8)
    for face in range(d):
        part = vc.Resultants(
            "face", np.zeros(d), where=lambda points, n, face=face: normals_of == face
        )
        assert part.start(problem, state)["N_face"] == pytest.approx(expected[face], rel=1e-8)


@pytest.mark.serial
def test_ledger_of_a_block_that_slams_into_a_notch():
    """Contact work and impact losses at oblique corners, by several schemes and a law; the ledger
    closes to 1e-11."""
    cases: list[dict[str, Any]] = [
        {"scheme": None},
        {"scheme": vc.MoreauJean(e=0.5)},
        {"scheme": vc.ContactStabilisedNewmark()},
        {
            "scheme": vc.ZienkiewiczWoodTaylor(),
            "impact": vc.Inelastic(),
            "mass": vc.ConsistentMass(),
        },
    ]
    system, tags = body("trapezoid", initial_velocity=lambda x: np.tile((-0.8, -1.5), (len(x), 1)))
    for case in cases:
        near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
        surface = fem.contact_surface(system, group(tags, "left", "bottom", "right"), obstacle=near)
        problem = ContactProblem(system, surface, impact=case.get("impact"), mass=case.get("mass"))
        energy = vc.Energy()
        found = vc.simulate(
            problem, scheme=case["scheme"], dt=1e-3, steps=30, record=[energy], progress=False
        )
        history = found.history
        start = history["energy_kinetic"][0]
        assert np.abs(history["energy_defect"]).max() < 1e-11 * start
        assert history["energy_kinetic"][-1] + history["energy_strain"][-1] < 1.0001 * start


@pytest.mark.serial
def test_an_inelastic_impact_on_one_face_of_a_corner():
    """The velocity of the corner node changes along the normal of the closed face, not along the
    open one."""
    system, tags = body("trapezoid")
    surface = fem.contact_surface(system, group(tags, "left", "bottom"))
    corner = seen(surface).corners[0]
    problem = ContactProblem(system, surface, mass=vc.ConsistentMass())
    v = np.tile((0.3, -0.7), (len(system.space.points), 1))
    target = np.full(seen(surface).count, np.nan)
    target[corner[0]] = 0.0
    after = vc.ComponentReset()(
        problem.equations, surface, relative(problem, system.space.restrict(v)), target
    )
    values = field(system, problem.cartesian(after))[1][seen(surface).nodes[corner[0]]]
    n = seen(surface).normals[corner[0]]
    assert values == pytest.approx(np.array([0.3, -0.7]) - n * (n @ (0.3, -0.7)), abs=1e-14)


# Obstacles
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_one_direction_is_one_condition():
    """A half-space below a group that goes round its corners: one condition for a node, with the
    weight of all faces, to the last digit as if the boundary were smooth; so with listed points,
    and an obstacle of the user's own."""
    system, tags = body("rectangle")
    wall = group(tags, "left", "bottom", "right")
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface, smooth = (
        fem.contact_surface(system, wall, obstacle=ground, feature_angle=a) for a in (pi / 6, pi)
    )
    assert not seen(surface).corners
    for attribute in ("points", "normals", "weights", "gap0", "owned", "tangents"):
        assert np.array_equal(getattr(surface, attribute), getattr(smooth, attribute)), attribute
    corners = [(0.0, 0.0), (1.5, 0.0)]
    listed = fem.contact_surface(system, wall, obstacle=ground, points=corners)
    assert seen(listed).count == 2 and seen(listed).weights == pytest.approx(
        [0.5 * (1.5 / 4 + 1.0 / 3)] * 2, rel=1e-13
    )
    fitted = fem.contact_surface(system, wall, points=corners)
    assert seen(fitted).count == 4
    assert seen(fitted).weights.sum() == pytest.approx(seen(listed).weights.sum(), rel=1e-13)
    assert seen(fitted).points == pytest.approx(np.repeat(corners, 2, axis=0), abs=1e-14)

    class Own:
        def directions(self, points: Array, normals: Array) -> Array:
            return np.tile((0.0, -1.0), (len(points), 1))

        def gap(self, points: Array, normals: Array) -> Array:
            return points[:, 1] + 0.25 + 0.125 * np.abs(normals[:, 0])

    own = fem.contact_surface(system, wall, obstacle=Own())
    assert not seen(own).corners and seen(own).gap0[seen(own).points[:, 1] == 0.0] == pytest.approx(
        [0.25] * 5
    )
    # seen from the corner, its side looks away from the ground
    leaning_sides, names = body("trapezoid")
    below = fem.contact_surface(
        leaning_sides, group(names, "left", "bottom"), obstacle=ground, points=[(0.0, 0.0)]
    )
    assert seen(below).count == 1 and seen(below).normals[0] == pytest.approx([0.0, -1.0])
    with pytest.raises(InputError, match="points into the body"):
        fem.contact_surface(leaning_sides, group(names, "left", "bottom"), obstacle=ground)


@pytest.mark.serial
def test_a_wall_moved_with_its_ground():
    """Oblique corners on an obstacle that moves with the base: the same as in the frame of the
    ground."""
    shake = (
        vc.Harmonic(8.0, 6.0, direction=(1.0, 0.0)),
        vc.Harmonic(5.0, 9.0, direction=(0.0, 1.0)),
    )
    motion = base_motion(shake)
    near = vc.AnalyticGap(lambda x: np.full(len(x), 2e-4))
    answers = []
    for moved in (False, True):
        mesh, tags = fem.build_mesh(BlockMesh(**BODIES["trapezoid"]), COMM)
        names = ("displacement", "velocity", "acceleration")
        held = fem.Prescribed(
            tags["top"], **({name: getattr(motion, name) for name in names} if moved else {})
        )
        system = fem.assemble(mesh, SOFT, prescribed=held)
        surface = fem.contact_surface(system, group(tags, "left", "bottom", "right"), obstacle=near)
        surface = motion.carrying(surface, system) if moved else surface
        problem = ContactProblem(system, surface, excitation=() if moved else shake)
        steps = vc.march(problem, dt=2e-3, steps=40)
        answers.append(np.array([seen(surface).all(report.new.r_n) for _, report in steps]))
    assert answers[0][:, seen(surface).corners[0]].max() > 0.0
    assert np.abs(answers[0] - answers[1]).max() < 1e-9 * answers[0].max()


@pytest.mark.serial
def test_supports_released_beside_an_oblique_notch(tmp_path):
    """A static stage whose top is held goes on without that support, and nothing moves. The field
    file has the pressure of the corner's face that is pressed most."""
    mesh, tags = fem.build_mesh(BlockMesh(**BODIES["trapezoid"]), COMM)
    weight = fem.BodyForce((-300.0, -2e3))
    systems = [fem.assemble(mesh, SOFT, loads=weight, clamped=held) for held in (tags["top"], ())]
    places = [(k / 3.0 / np.sqrt(3.0), k / 3.0) for k in (2, 1, 0)] + [
        (0.5 * k, 0.0) for k in range(1, 7)
    ]
    static, free = (
        ContactProblem(one, fem.contact_surface(one, group(tags, "left", "bottom"), points=places))
        for one in systems
    )
    state = vc.static_equilibrium(static, solver=vc.Condensed())
    corner = seen(static.surface).corners[0]
    assert state.r_n[corner].min() > 0.0
    problem, start = fem.release(static, state, free)
    found = vc.simulate(
        problem,
        dt=1e-3,
        steps=5,
        state=start,
        out=tmp_path / "run",
        fields=fem.XDMF(every=1),
        progress=False,
    )
    u = systems[1].space.expand(problem.cartesian(found.state.u), 0.0)
    before = systems[0].space.expand(static.cartesian(state.u), 0.0)
    assert np.abs(u - before).max() < 1e-11 * np.abs(before).max()
    assert np.abs(found.state.r_n - state.r_n).max() < 1e-9 * state.r_n.max()
    with h5py.File(tmp_path / "run" / "fields" / "frame_000001.h5") as file:
        pressure = file["contact_pressure"][seen(static.surface).nodes[corner[0]]]
    assert pressure == pytest.approx(
        (state.r_n / seen(static.surface).weights)[corner].max(), rel=1e-8
    )


# The feature angle
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@pytest.mark.parametrize("turn", on_ranks((29.0, 31.0, 45.0), 31.0))
def test_the_angle(turn, caplog: pytest.LogCaptureFixture):
    """A ring of chords that turn by this many degrees is smooth up to the feature angle, 30 degrees
    by default; the log says how many nodes are corners, and where."""
    caplog.set_level(logging.INFO)

    def ring(x: Array) -> Array:
        return (1.0 + x[:, 1:]) * np.column_stack(
            [np.sin(radians(turn) * x[:, 0]), np.cos(radians(turn) * x[:, 0])]
        )

    mesh, tags = fem.build_mesh(BlockMesh(lengths=(4.0, 0.2), divisions=(4, 1), deform=ring), COMM)
    system = fem.assemble(mesh, SOFT)
    for angle, splits in (
        (pi / 6, turn > 30.0),
        (radians(turn) * 1.01, False),
        (radians(turn) * 0.99, True),
    ):
        caplog.clear()
        for side in ("top", "bottom"):  # outside, and inside
            assert fem.contact_surface(system, tags[side], feature_angle=angle).total == (
                8 if splits else 5
            )
        told = [
            record.getMessage()
            for record in caplog.records
            if "turns by more than" in record.getMessage()
        ]
        assert len(told) == (2 if splits and COMM.rank == 0 else 0)
        if told:
            assert "'top' turns by more than" in told[0] and "degrees at 3 contact nodes" in told[0]


@dataclass(frozen=True)
class Blade:
    """A triangle whose edge at the origin is sharper than a node's directions may be: 0.3
    degrees."""

    def build(self, gmsh: Any) -> None:
        points = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.005)])
        cells, sides = np.array([(0, 1, 2)]), np.array([(0, 1), (0, 2)])
        add_arrays(
            gmsh,
            MeshArrays(
                "triangle", points, cells, {"body": np.ones(1, dtype=bool)}, {"sides": sides}
            ),
        )


@dataclass(frozen=True)
class Pyramid:
    """Four sides that meet in a point, (0, 0, 1), on a square base."""

    def build(self, gmsh: Any) -> None:
        points = np.array([(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0), (0, 0, 1)], dtype=float)
        sides = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 3, 4)])
        cells = np.array([(0, 1, 2, 4), (0, 2, 3, 4)])
        add_arrays(
            gmsh,
            MeshArrays(
                "tetrahedron", points, cells, {"body": np.ones(2, dtype=bool)}, {"sides": sides}
            ),
        )


@pytest.mark.two_ranks
def test_refusals():
    """More faces than dimensions, angles that are none, friction on two faces: a sentence with the
    remedy."""
    mesh, tags = fem.build_mesh(Pyramid(), COMM)
    system = fem.assemble(mesh, SOFT)
    with pytest.raises(
        InputError, match=r"\(0, 0, 1\) has 4 contact directions, more than its 3 dimensions: treat"
    ):
        fem.contact_surface(system, tags["sides"])
    assert fem.contact_surface(system, tags["sides"], feature_angle=pi).total == 5
    mesh, tags = fem.build_mesh(Blade(), COMM)
    with pytest.raises(
        InputError, match=r"\(0, 0\) has 2 contact directions, not independent in its 2 dimensions"
    ):
        fem.contact_surface(fem.assemble(mesh, SOFT), tags["sides"])
    system, tags = body("trapezoid")
    wall = group(tags, "left", "bottom")
    for angle in (0.0, 30.0, -1.0, float("nan"), "sharp"):
        with pytest.raises(InputError, match="feature_angle is .*give"):
            fem.contact_surface(system, wall, feature_angle=angle)
    surface = fem.contact_surface(system, wall)
    for friction in (vc.Coulomb(0.3), vc.Tresca(1e3)):
        assert ContactProblem(system, surface, friction=friction).surface.traces is not None
        free = surface.with_frictionless_corners()
        assert ContactProblem(system, free, friction=friction).surface is free
        ContactProblem(
            system, fem.contact_surface(system, wall, feature_angle=3.0), friction=friction
        )
    ContactProblem(system, surface)


# Pairs
# --------------------------------------------------------------------------------------------------


def notch(gap: float = 0.0, upper: int = 2) -> tuple[Any, Any]:
    """A box in a notch of three blocks, which meet at its lower corners."""

    def smaller(x: Array) -> Array:
        return np.column_stack([np.clip(x[:, 0], gap, 2.0 - gap), np.maximum(x[:, 1], gap)])

    places = {
        "box": (0.0, 0.0, 2.0, 1.0),
        "under": (0.0, -1.0, 2.0, 1.0),
        "west": (-1.0, 0.0, 1.0, 1.0),
        "east": (2.0, 0.0, 1.0, 1.0),
    }
    n = {"box": (2 * upper, upper), "under": (4, 2), "west": (2, 2), "east": (2, 2)}
    mesh, tags = fem.build_mesh(
        Blocks(
            {
                name: BlockMesh(
                    lengths=(w, h),
                    divisions=n[name],
                    corner=(x, y),
                    deform=smaller if name == "box" else None,
                )
                for name, (x, y, w, h) in places.items()
            }
        ),
        COMM,
    )
    clamped = [tags["under_bottom"], tags["west_left"], tags["east_right"]]
    return fem.assemble(mesh, SOFT, clamped=clamped, loads=fem.BodyForce((200.0, -1e3))), tags


PAIRS = (("box_bottom", "under_top"), ("box_left", "west_right"), ("box_right", "east_left"))


@pytest.mark.parametrize(
    "matching", on_ranks((fem.NodeToNode(), fem.DualMortar()), fem.NodeToNode()), ids=repr
)
def test_a_pair_that_bends_round_corners(matching):
    """Box and notch as one pair and as three: the same conditions and the same equilibrium."""
    system, tags = notch(upper=2 if isinstance(matching, fem.NodeToNode) else 3)
    sides = [group(tags, *names) for names in zip(*PAIRS, strict=True)]
    one = fem.contact_pair(system, *sides, matching=matching)
    pairs = [
        fem.contact_pair(system, *(tags[name] for name in p), matching=matching) for p in PAIRS
    ]
    several = fem.joined_surfaces(*pairs)
    same(one, several)
    assert [len(corner) for corner in seen(one).corners] == [2, 2]
    problems = [ContactProblem(system, surface) for surface in (one, several)]
    found = [vc.static_equilibrium(problem, solver=vc.Condensed()) for problem in problems]
    a, b = order(seen(one)), order(seen(several))
    r_n, expected = (seen(s).all(state.r_n) for s, state in zip((one, several), found, strict=True))
    assert np.abs(r_n[a] - expected[b]).max() < 1e-9 * expected.max()
    # with friction on both faces of the corners too
    frictional = [ContactProblem(system, s, friction=vc.Coulomb(0.3)) for s in (one, several)]
    found = [vc.static_equilibrium(problem) for problem in frictional]
    for name in ("r_n", "r_t"):
        r, expected = (
            seen(s).all(getattr(state, name))
            for s, state in zip((one, several), found, strict=True)
        )
        assert np.abs(r[a] - expected[b]).max() < 1e-9 * np.abs(found[0].r_n).max()


@pytest.mark.serial
def test_a_pair_with_gaps_round_corners():
    """The partner of a corner lies on the mean of its normals; its gaps are those of both faces.
    Faces in front of nothing have no conditions with mortar, and are refused by nodes."""
    system, tags = notch(gap=0.125)
    one = fem.contact_pair(system, *(group(tags, *names) for names in zip(*PAIRS, strict=True)))
    assert one.gap0 == pytest.approx(np.full(one.count, 0.125)) and len(one.corners) == 2
    system, tags = notch(upper=3)
    hull, floor = group(tags, "box_bottom", "box_left"), tags["under_top"]
    lone = fem.contact_pair(system, hull, floor, matching=fem.DualMortar())
    same(lone, fem.contact_pair(system, tags["box_bottom"], floor, matching=fem.DualMortar()))
    with pytest.raises(InputError, match="have no node of 'under_top' opposite"):
        fem.contact_pair(system, hull, floor)


def tilted_walls() -> tuple[Any, Any]:
    """A block between two half-spaces that are tilted by 0.15 rad, so that its corner is oblique
    to the axes, and the surface of both faces."""
    mesh, tags = fem.build_mesh(BlockMesh(divisions=(2, 2)), COMM)
    stone = vc.LinearElastic(E=1e7, nu=0.2, rho=2000.0)
    system = fem.assemble(mesh, stone, loads=[fem.Traction(tags["top"], (2e4, -1e5))])
    c, s = np.cos(0.15), np.sin(0.15)
    floor = vc.HalfSpace(point=(0.0, -0.2), normal=(s, c))
    wall = vc.HalfSpace(point=(1.2, 0.0), normal=(-c, s))
    parts = [
        fem.contact_surface(system, tags[name], obstacle=obstacle)
        for name, obstacle in (("bottom", floor), ("right", wall))
    ]
    return system, fem.joined_surfaces(*parts)


@pytest.mark.long
@pytest.mark.serial
def test_states_of_other_frames_are_refused(tmp_path):
    """Where corners rub, displacements are along the axes: a state in the frames of nodes is
    refused by stages, runs and restarts, both ways, and one on the traces goes on rightly."""
    system, surface = tilted_walls()
    mass = vc.ConsistentMass()

    def pose(where: Any, **laws: Any) -> ContactProblem:
        return ContactProblem(system, where, mass=mass, **laws)

    smooth, rough = pose(surface), pose(surface, friction=vc.Coulomb(0.3))
    traced = pose(surface.with_own_laws())
    pressed, right = vc.static_equilibrium(smooth), vc.static_equilibrium(traced)
    refused = r"those of the problem along the axes, .*: make both problems on surface.with_own_la"
    how: dict[str, Any] = {"dt": 1e-3, "scheme": vc.Midpoint()}
    moved, _ = next(vc.march(smooth, steps=1, **how))
    for state in (pressed, moved, moved.with_velocity(0.0 * moved.v)):
        with pytest.raises(InputError, match="quasi_static: .*" + refused):
            next(vc.quasi_static(rough, [1.0], state=state))
        with pytest.raises(InputError, match="march: .*" + refused):
            next(vc.march(rough, steps=1, state=state, **how))
    with pytest.raises(InputError, match="those of the problem in frames of contact nodes"):
        next(vc.march(smooth, steps=1, state=vc.static_equilibrium(rough), **how))
    # restarts, also those that change the problem
    for name, problem in (("smooth", smooth), ("traced", traced)):
        vc.simulate(problem, steps=2, out=tmp_path / name, record=[vc.Energy()], **how)
    for changed in (False, True):
        again: dict[str, Any] = {"steps": 3, "changed": changed, "record": [vc.Energy()]}
        with pytest.raises(InputError, match=r"frames = .* make both problems on surface.with_own"):
            vc.simulate(rough, restart=tmp_path / "smooth", out=tmp_path / "rough", **again, **how)
    # the same place, by hand along the axes and by the problem on the traces: the same answer
    place = smooth.cartesian(pressed.u)
    by_hand = replace(pressed, u=place, turned=None)
    assert np.abs(right.u - place).max() < 1e-9 * np.abs(place).max()
    expected, found = (next(vc.quasi_static(rough, [1.0], state=s)) for s in (by_hand, right))
    size = np.abs(expected.r_n).max()
    assert np.abs(found.r_n - expected.r_n).max() < 1e-7 * size
    assert np.abs(found.r_t - expected.r_t).max() < 1e-7 * size
    assert 0.0 < np.abs(found.r_t).max() < 0.1 * size  # 0.29 of it where frames are mistaken
    solution = vc.simulate(
        rough, restart=tmp_path / "traced", out=tmp_path / "rough", **again, **how
    )
    assert solution.state.k == 3 and solution.facts["worst_certificate"] <= 1e-9
    # a checkpoint that does not tell its frames, of an earlier commit, is not refused for that
    assert find_differences({FRAMES: "along the axes"}, {}) == {}
