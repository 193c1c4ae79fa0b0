"""What unknowns mean: prescribed motions, rollers, initial values, nodes near points."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import BODIES, CONCRETE, block, field, held_by, linear, max_over_ranks, run
from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.mesh.tagged_mesh import Facets
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.materials import LinearElastic, Rayleigh

COMM = MPI.COMM_WORLD
SOFT = LinearElastic(E=2.0e8, nu=0.2, rho=CONCRETE.rho)


def test_initial_values():
    """Constants and functions of position, on the free unknowns, read back at nodes."""
    mesh, tags = block(COMM, **BODIES["triangles"])
    system = assemble(
        mesh,
        CONCRETE,
        clamped=tags["bottom"],
        initial_displacement=lambda x: x**2,
        initial_velocity=(3.0, -4.0),
    )
    points, u = field(system, system.u0)
    clamped = np.isclose(points @ [-np.sin(0.4), np.cos(0.4)], 0.0, atol=1e-9)
    assert 0 < clamped.sum() < len(points)
    assert np.array_equal(u, np.where(clamped[:, None], 0.0, points**2))
    assert np.array_equal(
        field(system, system.v0)[1][~clamped], np.tile([3.0, -4.0], ((~clamped).sum(), 1))
    )


@pytest.mark.two_ranks
def test_rollers_hold_one_component():
    """A roller keeps one component at zero and leaves the others free, in number and in the
    solution."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0, 1.0), divisions=(2, 2, 2))
    rollers = [
        Prescribed(tags["left"], components=(0,)),
        Prescribed(tags["bottom"], components=(1, 2)),
    ]
    system = assemble(mesh, CONCRETE, prescribed=rollers, loads=BodyForce((0.0, -1e5, 2e4)))
    assert system.space.unknowns == 27 * 3 - 9 - 9 * 2
    points, values = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    left, bottom = points[:, 0] == 0.0, points[:, 1] == 0.0
    assert not values[left, 0].any() and not values[bottom, 1:].any()
    assert np.all(values[left & ~bottom][:, 1:] != 0.0) and np.all(
        values[bottom & ~left][:, 0] != 0.0
    )


@pytest.mark.two_ranks
def test_where_conditions_meet_the_later_one_counts():
    """Corner nodes of two prescribed sides."""
    mesh, tags = block(COMM, lengths=(1.0, 1.0), divisions=(2, 2))
    sides = [
        held_by(tags, "left", lambda x: 0.0 * x + 1.0),
        held_by(tags, "bottom", lambda x: 0.0 * x + 2.0, 1),
    ]
    for order, corner in ((sides, [1.0, 2.0]), (sides[::-1], [1.0, 1.0])):
        system = assemble(mesh, CONCRETE, prescribed=order)
        points, values = field(system, system.u0)
        assert values[(points == 0.0).all(axis=1)].tolist() == [corner]
    system = assemble(mesh, CONCRETE, prescribed=[sides[0], Prescribed(tags["bottom"])])
    assert not field(system, system.u0)[1][points[:, 1] == 0.0].any()


def test_prescribed_displacement_makes_its_linear_field():
    """Linear displacements on the whole boundary give the same linear field inside (patch test of
    assembly)."""
    gradient = np.array([[1e-3, 4e-4], [-2e-4, 7e-4]])
    for simplices in (False, True):
        mesh, tags = block(
            COMM,
            lengths=(2.0, 1.0),
            divisions=(4, 3),
            simplices=simplices,
            deform=lambda x: x + 0.05 * np.sin(np.pi * x[:, :1] / 2.0) * np.sin(np.pi * x[:, 1:]),
        )
        sides = [
            held_by(tags, side, lambda x: x @ gradient.T)
            for side in ("left", "right", "bottom", "top")
        ]
        system = assemble(mesh, CONCRETE, prescribed=sides)
        points, values = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
        assert np.abs(values - points @ gradient.T).max() < 1e-13 * np.abs(values).max()


def shaken_base(t: float) -> tuple[float, float, float]:
    """Displacement, velocity and acceleration of the base: smooth, at rest at t = 0."""
    w = 60.0
    return 1e-3 * (1.0 - np.cos(w * t)), 1e-3 * w * np.sin(w * t), 1e-3 * w**2 * np.cos(w * t)


def moving_base(mesh, tags, damping=None, material=CONCRETE) -> SemiDiscreteSystem:
    motions = [lambda x, t, i=i: np.tile([shaken_base(t)[i], 0.0], (len(x), 1)) for i in range(3)]
    return assemble(
        mesh, material, prescribed=Prescribed(tags["bottom"], *motions), damping=damping
    )


@pytest.mark.two_ranks
@pytest.mark.parametrize("damping", [None, Rayleigh(alpha=0.0, beta=1e-3)])
def test_moving_base_is_the_body_force_of_the_relative_frame(damping):
    """With u = r U(t) + w the pull of the moving base is K r U + C r U' minus the inertia of the
    whole body, rho U'' per volume, on the free unknowns: an identity, whatever the motion.
    (Mass-proportional damping brakes U' too.)"""
    mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(3, 5))
    system = moving_base(mesh, tags, damping)
    weight = assemble(
        mesh, CONCRETE, clamped=tags["bottom"], loads=BodyForce((-CONCRETE.rho, 0.0))
    ).load(0.0)
    r = system.influence[:, 0]
    for t in (0.0, 0.013, 0.4):
        U, V, A = shaken_base(t)
        expected = U * (system.K @ r) + A * (weight + system.M @ r)
        if system.C is not None:
            expected += V * (system.C @ r)
        assert max_over_ranks(COMM, system.load(t) - expected) < 1e-12 * max_over_ranks(
            COMM, expected
        )


def relative_frame(mesh, tags, excitation=()) -> ContactProblem:
    """Clamped base; without excitation the inertia -rho U'' acts as a body force on every
    element."""
    inertia = (
        () if excitation else BodyForce((-CONCRETE.rho, 0.0), history=lambda t: shaken_base(t)[2])
    )
    return linear(
        assemble(mesh, SOFT, clamped=tags["bottom"], loads=inertia), excitation=excitation
    )


@pytest.mark.slow
def test_moving_base_and_relative_frame_converge_to_one_motion():
    """Base displaced (absolute frame) or inertia -rho U'' per volume (relative frame): they differ
    by the time error of the sampled motion alone, which is of second order."""
    mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(3, 5))
    absolute, relative = linear(moving_base(mesh, tags, material=SOFT)), relative_frame(mesh, tags)
    differences = []
    for steps in (40, 80, 160):
        a, b = (
            run(problem, dt=0.08 / steps, steps=steps).u[-1] for problem in (absolute, relative)
        )
        differences.append(np.abs(a - [shaken_base(0.08)[0], 0.0] - b).max() / np.abs(b).max())
    assert differences[-1] < 2e-4
    assert np.log2(differences[0] / differences[1]) == pytest.approx(2.0, abs=0.1)
    assert np.log2(differences[1] / differences[2]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.two_ranks
def test_inertia_load_of_an_excitation_is_the_body_force_of_the_relative_frame():
    """The inertia load of an excitation counts the mass that elements share with the base: -rho U''
    per volume, to round-off. Without that mass, as in the reference of V4.1, h/6 of the height is
    missing: an effect of h²."""
    shake = Harmonic(3.6, 60.0 / (2.0 * np.pi), phase=np.pi / 2.0)  # U'' of shaken_base
    assert shake.acceleration(0.011) == pytest.approx(shaken_base(0.011)[2], rel=1e-12)
    effects = []
    for n in (1, 2):
        mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(3 * n, 5 * n))
        problems = (
            relative_frame(mesh, tags),
            relative_frame(mesh, tags, excitation=shake),
            linear(
                assemble(mesh, SOFT, clamped=tags["bottom"], base_inertia=False), excitation=shake
            ),
        )
        a, b, c = (run(problem, dt=1e-3, steps=80).u[-1] for problem in problems)
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()
        effects.append(np.abs(a - c).max() / np.abs(a).max())
    assert effects[0] < 1e-2 and np.log2(effects[0] / effects[1]) > 1.8


def test_unknown_boundary_is_told_with_the_known_ones():
    _, tags = block(COMM, lengths=(2.0, 2.0), divisions=(4, 4))
    with pytest.raises(
        InputError, match="mesh has no group 'botom'; its boundary groups are .*bottom"
    ):
        tags["botom"]


def test_points_outside_the_body():
    """Probes: the nearest node, or a sentence when there is none near; the same on all ranks."""
    mesh, _ = block(COMM, lengths=(2.0, 2.0), divisions=(4, 4))
    system = assemble(mesh, CONCRETE)
    points = field(system, system.u0)[0]
    found = system.space.find_nodes(np.array([[0.0, 0.0], [1.02, 1.49], [2.0, 2.0]]))
    assert points[found].tolist() == [[0.0, 0.0], [1.0, 1.5], [2.0, 2.0]]
    with pytest.raises(
        InputError,
        match=r"point \(3, 1\) is 1 m away from the nearest node: give a point of the body",
    ):
        system.space.find_nodes(np.array([[0.0, 0.0], [3.0, 1.0]]))
    with pytest.raises(InputError, match="has 3 coordinates: give 2"):
        system.space.find_nodes(np.array([[0.0, 0.0, 0.0]]))


def test_empty_boundary_is_refused():
    """A group without facets on any rank would hold and load nothing; without it the floating body
    is recognised."""
    mesh, _ = block(COMM, lengths=(2.0, 2.0), divisions=(4, 4))
    nothing = Facets("nothing", np.zeros(0, dtype=np.int32), mesh)
    with pytest.raises(InputError, match="the boundary group 'nothing' of clamped has no facets"):
        assemble(mesh, CONCRETE, clamped=nothing)
    with pytest.raises(InputError, match="the boundary group 'nothing' of loads has no facets"):
        assemble(mesh, CONCRETE, loads=Traction(nothing, (1.0, 1.0)))
    system = assemble(mesh, CONCRETE)
    assert system.floating and system.space.unknowns == 50
    assert not system.load(0.0).any()
