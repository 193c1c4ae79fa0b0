"""From facets to contact conditions: nodes, weights, normals, gaps, turned frames, and every
refusal."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from all_ranks import seen
from fem_problems import BODIES, CONCRETE, block, dense, field, max_over_ranks, turned
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import AnalyticGap, HalfSpace, Touching
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import Facets
from vi_contact.laws.materials import PlaneStress

COMM = MPI.COMM_WORLD
GROUND = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
bodies = pytest.mark.parametrize("name", BODIES)


def body(name: str = "quadrilaterals", **data: Any) -> tuple[Any, Any]:
    """(system, tags)"""
    mesh, tags = block(COMM, **BODIES[name])
    return assemble(mesh, CONCRETE, **data), tags


def ring(n: int, *, simplices: bool = False) -> tuple[Any, Any]:
    """A quarter ring of radii 1 and 2 about the origin; "left" is the inner arc, "right" the
    outer."""

    def bend(x: Array) -> Array:
        return np.column_stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])])

    return block(
        COMM,
        lengths=(1.0, pi / 2.0),
        corner=(1.0, 0.0),
        divisions=(2, n),
        simplices=simplices,
        deform=bend,
    )


# Nodes, weights, normals
# ----------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@bodies
def test_weights_and_normals_of_a_flat_side(name):
    """Weights sum to the area, all normals are the side's, every node of the side is there once and
    in the order of the mesh's numbers, equal on all ranks."""
    d, lengths, angle = (
        len(BODIES[name]["lengths"]),
        BODIES[name]["lengths"],
        BODIES[name].get("angle", 0.0),
    )
    system, tags = body(name)
    surface = contact_surface(system, tags["right"])
    n = np.zeros(d)
    n[: min(d, 2)] = turned((1.0, 0.0), angle)[:d]
    assert seen(surface).weights.sum() == pytest.approx(np.prod(lengths[1:]), rel=1e-13)
    assert seen(surface).weights.min() > 0.0
    assert seen(surface).normals == pytest.approx(np.tile(n, (seen(surface).count, 1)), abs=1e-13)
    assert seen(surface).points @ n == pytest.approx(
        np.full(seen(surface).count, lengths[0]), rel=1e-13
    )
    assert seen(surface).count == np.prod(np.array(BODIES[name]["divisions"][1:]) + 1)
    points = field(system, system.u0)[0]
    numbers = system.space.find_nodes(seen(surface).points)
    assert np.all(np.diff(numbers) > 0) and np.array_equal(points[numbers], seen(surface).points)
    assert sum(COMM.allgather(len(surface.owned))) == seen(surface).count
    assert sorted(np.concatenate(COMM.allgather(surface.slots)).tolist()) == list(
        range(seen(surface).count)
    )


def test_weights_are_tributary_lengths():
    """2D: half the adjacent lengths times the section's thickness; listed points keep the order of
    the list."""
    system, tags = body(section=PlaneStress(0.2))
    surface = contact_surface(system, tags["right"])
    h = 1.5 / 4
    assert seen(surface).weights == pytest.approx(
        0.2 * h * np.array([0.5, 1.0, 1.0, 1.0, 0.5]), rel=1e-13
    )
    listed = contact_surface(system, tags["right"], points=[(2.0, 1.5), (2.0, 0.01), (1.99, 0.76)])
    assert seen(listed).points.tolist() == [[2.0, 1.5], [2.0, 0.0], [2.0, 0.75]]
    assert seen(listed).weights == pytest.approx(0.2 * h * np.array([0.5, 0.5, 1.0]), rel=1e-13)


@pytest.mark.two_ranks
@pytest.mark.parametrize("simplices", [False, True])
def test_normals_of_a_curved_side_are_those_of_the_chords(simplices):
    """∫ phi_i n over a polygon is half the sum of the two chord normals times their lengths: on an
    arc with equal chords the radial direction exactly inside, half a chord's angle off at the ends;
    weights are mean chord lengths."""
    n = 7
    mesh, tags = ring(n, simplices=simplices)
    surface = contact_surface(assemble(mesh, CONCRETE), tags["right"])
    angle = np.arctan2(seen(surface).points[:, 1], seen(surface).points[:, 0])
    half = pi / 4.0 / n
    found = np.arctan2(seen(surface).normals[:, 1], seen(surface).normals[:, 0])
    shift = np.where(
        np.isclose(angle, 0.0, atol=1e-9), half, np.where(np.isclose(angle, pi / 2.0), -half, 0.0)
    )
    assert found == pytest.approx(angle + shift, abs=1e-12)
    assert np.linalg.norm(seen(surface).normals, axis=1) == pytest.approx(np.ones(n + 1), rel=1e-14)
    assert seen(surface).weights == pytest.approx(
        4.0 * sin(half) * np.where(shift == 0.0, 1.0, 0.5), rel=1e-12
    )


def test_gaps_of_obstacles():
    """Touching: none. Half-space: distance of the node from the plane, along the plane's normal
    whatever the boundary's normal. AnalyticGap: the function, along the boundary's normal; a user's
    own obstacle needs the two methods only."""
    system, tags = body()
    assert not contact_surface(system, tags["bottom"]).gap0.any()
    slope = HalfSpace(point=(0.0, -0.1), normal=(3.0, 4.0))
    surface = contact_surface(system, tags["bottom"], obstacle=slope)
    x, y = seen(surface).points.T
    assert seen(surface).gap0 == pytest.approx(0.6 * x + 0.8 * (y + 0.1), rel=1e-13)
    assert seen(surface).normals == pytest.approx(
        np.tile([-0.6, -0.8], (seen(surface).count, 1)), rel=1e-13
    )
    curved = contact_surface(
        system, tags["bottom"], obstacle=AnalyticGap(lambda x: 0.1 * x[:, 0] ** 2)
    )
    assert curved.gap0 == pytest.approx(0.1 * curved.points[:, 0] ** 2, rel=1e-13)
    assert curved.normals == pytest.approx(np.tile([0.0, -1.0], (curved.count, 1)), abs=1e-13)

    class Own:
        def directions(self, points: Array, normals: Array) -> Array:
            return -turned(-normals, 0.1)

        def gap(self, points: Array, normals: Array) -> Array:
            return np.full(len(points), 0.25)

    own = contact_surface(system, tags["bottom"], obstacle=Own())
    assert seen(own).normals == pytest.approx(
        np.tile(turned((0.0, -1.0), 0.1), (seen(own).count, 1)), rel=1e-13
    )
    assert seen(own).gap0.tolist() == [0.25] * seen(own).count


@pytest.mark.two_ranks
def test_gap_of_round_off_is_no_penetration():
    """A plane that cuts the boundary by 1e-13 of the body's size counts as touching; 1e-6 is
    refused below."""
    system, tags = body()
    near = HalfSpace(point=(0.0, 1e-13), normal=(0.0, 1.0))
    assert not contact_surface(system, tags["bottom"], obstacle=near).gap0.any()


# Frames
# --------------------------------------------------------------------------------------------------


def some_field(x: Array) -> Array:
    d = x.shape[1]
    return np.cos(2.0 * x) + x @ np.arange(d * d, dtype=float).reshape(d, d)


@bodies
@pytest.mark.parametrize("side", ["left", "right"])
def test_normal_unknown_is_the_normal_displacement(name, side):
    """B_n û = u·n for any u = T û; T is orthogonal; along axes that point to the obstacle there is
    no T at all."""
    system, tags = body(name)
    surface = contact_surface(system, tags[side])
    problem = ContactProblem(system, surface)
    u = system.space.restrict(some_field(system.space.points))
    turned_u = u if surface.basis is None else surface.basis.transpose_apply(u)
    assert max_over_ranks(COMM, problem.cartesian(turned_u) - u) < 1e-14 * max_over_ranks(COMM, u)
    expected = np.sum(some_field(seen(surface).points) * seen(surface).normals, axis=1)
    assert seen(surface).normal_values(turned_u) == pytest.approx(
        expected, abs=1e-13 * np.abs(expected).max()
    )
    assert (surface.basis is None) == (side == "right" and "angle" not in BODIES[name])
    tangents = turned_u[surface.tangents]
    along = some_field(surface.points) - expected[surface.slots, None] * surface.normals
    assert np.linalg.norm(tangents, axis=1) == pytest.approx(
        np.linalg.norm(along, axis=1), abs=1e-12
    )


@pytest.mark.parametrize("name", ["triangles", "tetrahedra"])
def test_turned_system_is_the_same_system(name):
    """Energies, loads, initial values and inertia loads do not depend on the frames: TᵀMT, TᵀKT,
    Tᵀf, Tᵀr."""
    down = BodyForce(tuple(np.eye(len(BODIES[name]["lengths"]))[-1]))
    system, tags = body(
        name, loads=down, initial_velocity=some_field, initial_displacement=some_field
    )
    far = AnalyticGap(lambda x: np.full(len(x), 1e3))
    problem = ContactProblem(system, contact_surface(system, tags["left"], obstacle=far))
    other = problem.equations
    assert problem.surface.basis is not None
    assert other.kinetic_energy(other.v0) == pytest.approx(
        system.kinetic_energy(system.v0), rel=1e-13
    )
    assert other.strain_energy(other.u0) == pytest.approx(
        system.strain_energy(system.u0), rel=1e-12
    )
    pairs = [(other.v0, system.v0), (other.load(0.0), system.load(0.0))]
    for a, b in (*pairs, *zip(other.influence.T, system.influence.T, strict=True)):
        assert max_over_ranks(COMM, problem.cartesian(a) - b) < 1e-13 * max_over_ranks(COMM, b)
    rest = ContactProblem(system, contact_surface(system, tags["right"], obstacle=far)).equations
    assert system.algebra.dot(other.load(0.0), other.v0) == pytest.approx(
        system.algebra.dot(rest.load(0.0), rest.v0), rel=1e-13
    )


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.5, -0.7])
def test_rollers_beside_an_oblique_contact_in_space(angle):
    """Nodes held in y that touch a plane turned about the y axis: T keeps y to itself and stays
    orthogonal.

    The block presses on the plane by a force along -n; with rollers on two sides it moves straight
    onto it.
    """
    mesh, tags = block(COMM, lengths=(1.0, 1.0, 1.0), divisions=(2, 2, 2))
    towards = np.array([-sin(angle), 0.0, -cos(angle)]) * np.sign(cos(angle))
    side = tags["back"] if towards[2] < 0 else tags["front"]
    rollers = [
        Prescribed(tags["bottom"], components=(1,)),
        Prescribed(tags["top"], components=(1,)),
    ]
    system = assemble(mesh, CONCRETE, prescribed=rollers)
    plane = HalfSpace(point=tuple(5.0 * towards), normal=tuple(-towards))
    surface = contact_surface(system, side, obstacle=plane)
    unit = ContactProblem(system, surface).equations
    T = dense(COMM, system, surface.basis)
    assert np.abs(T.T @ T - np.eye(len(T))).max() < 1e-14
    r = system.influence @ towards
    normal = seen(surface).normal_values(unit.influence @ towards)
    assert normal == pytest.approx(np.ones(seen(surface).count), rel=1e-13)
    assert max_over_ranks(COMM, surface.basis @ surface.basis.transpose_apply(r) - r) < 1e-14


# Refusals, each with its sentence, on all ranks
# -----------------------------------------------------------------------


def test_no_contact_nodes():
    system, tags = body(clamped=())
    nothing = Facets("nothing", np.zeros(0, dtype=np.int32), system.space.mesh)
    with pytest.raises(
        InputError, match="no contact nodes: boundary group 'nothing' is empty: choose a group"
    ):
        contact_surface(system, nothing)
    with pytest.raises(
        InputError, match="no contact nodes: the list of contact points on 'right' is empty"
    ):
        contact_surface(system, tags["right"], points=[])


def test_clamped_contact_nodes():
    """Where the side meets the clamped base its node is left out; clamped all over, or listed, it
    is refused."""
    system, tags = body(clamped=None)
    whole = contact_surface(system, tags["right"]).total
    system, tags = body()
    mesh = system.space.mesh
    clamped = assemble(mesh, CONCRETE, clamped=tags["bottom"])
    surface = contact_surface(clamped, tags["right"])
    assert seen(surface).count == whole - 1 and seen(surface).points[:, 1].min() > 0.0
    with pytest.raises(
        InputError, match="no contact nodes: every node of boundary group 'bottom' is also fixed"
    ):
        contact_surface(clamped, tags["bottom"])
    with pytest.raises(
        InputError, match=r"contact point \(2, 0\) is also fixed: leave it out, or fix less"
    ):
        contact_surface(clamped, tags["right"], points=[(2.0, 1.5), (2.0, 0.0)])


@pytest.mark.two_ranks
def test_contact_direction_partly_prescribed():
    """Held along the contact direction is refused (on all ranks, whoever owns the node); held
    across it is fine."""
    mesh, tags = block(COMM, **BODIES["quadrilaterals"])
    across = assemble(mesh, CONCRETE, prescribed=Prescribed(tags["left"], components=(0,)))
    assert contact_surface(across, tags["bottom"]).total == 6
    along = assemble(mesh, CONCRETE, prescribed=Prescribed(tags["left"], components=(1,)))
    sentence = (
        r"contact node \(0, 0\) is also prescribed along its contact direction: free that "
        r"component or leave"
    )
    with pytest.raises(InputError, match=sentence):
        contact_surface(along, tags["bottom"])
    with pytest.raises(InputError, match=sentence):
        contact_surface(
            across, tags["bottom"], obstacle=HalfSpace(point=(-9.0, -9.0), normal=(1.0, 1.0))
        )


def test_points_off_the_boundary():
    system, tags = body()
    for points, sentence in (
        (
            [(9.0, 0.0)],
            r"contact point \(9, 0\) is 7 m away from boundary group 'right': give a point on it",
        ),
        ([(2.0, 0.0), (2.0, 0.01)], r"contact point \(2, 0.01\) is listed twice"),
        ([(2.0,)], "give 2 coordinates"),
    ):
        with pytest.raises(InputError, match=sentence):
            contact_surface(system, tags["right"], points=points)


@pytest.mark.two_ranks
def test_obstacles_that_cannot_be():
    system, tags = body()
    bottom = tags["bottom"]
    for obstacle, sentence in (
        (HalfSpace((0.0, 0.0), (0.0, -1.0)), r"points into the body .*turn its sign"),
        (
            HalfSpace((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            r"what directions returns has shape \(\d+, 3\); give numbers of",
        ),
        (
            HalfSpace((0.0, 0.02), (0.0, 1.0)),
            r"the body penetrates its obstacle by 0.02 m at \(.*, 0\) before",
        ),
        (
            AnalyticGap(lambda x: x[:, 0] - 1.0),
            r"the body penetrates its obstacle by 1 m at \(0, 0\)",
        ),
        (AnalyticGap(lambda x: x[:, 0] * np.nan), "the initial gap contains NaN"),
        (AnalyticGap(lambda x: x), "AnalyticGap: gap returned float64 of shape"),
    ):
        with pytest.raises(InputError, match=sentence):
            contact_surface(system, bottom, obstacle=obstacle)


@pytest.mark.two_ranks
def test_initial_displacement_into_the_obstacle():
    mesh, tags = block(COMM, **BODIES["quadrilaterals"])
    system = assemble(mesh, CONCRETE, initial_displacement=(0.0, -0.03))
    touching = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=GROUND))
    with pytest.raises(
        InputError, match="the initial displacement penetrates the obstacle by 0.03 m: reduce it"
    ):
        initial_state(touching)
    apart = HalfSpace(point=(0.0, -0.03), normal=(0.0, 1.0))
    assert not initial_state(
        ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=apart))
    ).r_n.any()


@pytest.mark.two_ranks
def test_support_stiffness():
    system, tags = body()
    surface = contact_surface(system, tags["bottom"], obstacle=Touching())
    for stiffness in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(
            InputError,
            match=rf"foundation modulus \[Pa/m\] is {stiffness}; give a finite number above zero",
        ):
            surface.on_springs(stiffness)


@pytest.mark.two_ranks
def test_system_of_another_kind():
    from chain import chain_system

    _, tags = body()
    with pytest.raises(InputError, match="contact_surface needs a system made by fem.assemble"):
        contact_surface(chain_system(3), tags["bottom"])


@pytest.mark.two_ranks
def test_a_listed_point_between_nodes_is_told(caplog: pytest.LogCaptureFixture) -> None:
    """It stands for the nearest node, and rank 0 says how far that is; a point on a node is not
    mentioned."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(8, 4))
    system = assemble(mesh, CONCRETE, clamped=tags["bottom"])
    surface = contact_surface(system, tags["right"], points=[(2.0, 0.5), (2.0, 0.98)])
    assert np.allclose(seen(surface).points, [(2.0, 0.5), (2.0, 1.0)])
    told = [
        record.getMessage() for record in caplog.records if "nearest node" in record.getMessage()
    ]
    assert told == (
        ["contact point (2, 0.98) is replaced by the nearest node, 0.02 m away"]
        if COMM.rank == 0
        else []
    )
