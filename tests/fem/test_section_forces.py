"""Section forces, reactions and contact resultants of finite element bodies against equilibrium, on
any ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import CONCRETE, block, linear

import vi_contact as vc
from demos.parts.problems.channel import Channel, build
from vi_contact import fem, solvers
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.fem import compat
from vi_contact.practice.soil.moving_base import base_motion
from vi_contact.run.recorders.contact_parts import make_tangent_vectors

WIDTH, HEIGHT = 0.5, 4.0
TIP, WIND, WEIGHT = (2000.0, -5000.0), 700.0, (300.0, -24000.0)  # Pa, Pa, N/m³


def cantilever(comm: Any, simplices: bool) -> tuple[vc.ContactProblem, Any, list[Any]]:
    """A wall clamped at its foot under a tip load, a uniform pressure on its left face and a body
    force."""
    mesh, tags = block(comm, lengths=(WIDTH, HEIGHT), divisions=(2, 8), simplices=simplices)
    loads = [
        fem.Traction(tags["top"], TIP),
        fem.Traction(tags["left"], (WIND, 0.0)),
        fem.BodyForce(WEIGHT),
    ]
    return linear(fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=loads)), tags, loads


def above(y: float) -> dict[str, float]:
    """N (tension), V, M by equilibrium of what is above a cut drawn from the left face to the right
    one."""
    length = HEIGHT - y
    across = TIP[0] * WIDTH + (WIND + WEIGHT[0] * WIDTH) * length
    axial = (TIP[1] + WEIGHT[1] * length) * WIDTH
    bending = TIP[0] * WIDTH * length + 0.5 * (WIND + WEIGHT[0] * WIDTH) * length**2
    return {"N": axial, "V": across, "M": -bending}  # bent to the right: tension on the left


@pytest.mark.slow
@pytest.mark.parametrize("simplices", [False, True], ids=["quadrilaterals", "triangles"])
@pytest.mark.promise("guide/outputs.md", "Tests compare it with statics to 1e-10")
def test_section_forces_are_those_of_equilibrium(comm: Any, simplices: bool) -> None:
    """N, V, M of a cantilever under tip, uniform and body loads to 1e-10, on a mesh two elements
    wide."""
    problem, tags, loads = cantilever(comm, simplices)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    levels = {"foot": 0.0, "through": 1.3, "middle": 2.0, "close": 2.001, "high": 3.5}
    cuts = {name: ((0.0, y), (WIDTH, y)) for name, y in levels.items()}
    row = vc.SectionForces(cuts | {"back": ((WIDTH, 2.0), (0.0, 2.0))}, loads=loads).start(
        problem, state
    )
    for name, y in levels.items():
        for quantity, expected in above(y).items():
            assert row[f"{quantity}_{name}"] == pytest.approx(expected, rel=1e-10), (quantity, name)
    # the other way through: the same tension and shear, the moment's sign is that of the other end
    assert row["N_back"] == pytest.approx(row["N_middle"], rel=1e-10)
    assert row["V_back"] == pytest.approx(row["V_middle"], rel=1e-10)
    assert row["M_back"] == pytest.approx(-row["M_middle"], rel=1e-10)


def test_a_section_through_what_is_pulled_along(comm: Any) -> None:
    """An inclined wall under a tangential traction of its left face: the part of it above a cut
    through elements."""
    angle = 0.7
    mesh, tags = block(comm, lengths=(WIDTH, HEIGHT), divisions=(2, 5), angle=angle)
    up, right = np.array([-np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), np.sin(angle)])
    pull = fem.TangentialTraction(tags["left"], tuple(3e3 * up + 7e3 * right))
    problem = linear(fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=pull))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    row = vc.SectionForces({"a": (1.9 * up, 1.9 * up + WIDTH * right)}, loads=pull).start(
        problem, state
    )
    force = 3e3 * (HEIGHT - 1.9)
    assert row["N_a"] == pytest.approx(force, rel=1e-10)
    assert row["V_a"] == pytest.approx(0.0, abs=1e-10 * force)
    assert row["M_a"] == pytest.approx(-force * 0.5 * WIDTH, rel=1e-10)


def test_reactions_carry_all_loads(comm: Any, caplog: pytest.LogCaptureFixture) -> None:
    """Force and moment of the clamped foot balance tip, wind and weight, the part on the held nodes
    included."""
    problem, tags, loads = cantilever(comm, False)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    row = vc.Reactions("foot", tags["bottom"], (0.5 * WIDTH, 0.0), loads).start(problem, state)
    whole = above(0.0)
    assert row["reaction_x_foot"] == pytest.approx(-whole["V"], rel=1e-10)
    assert row["reaction_y_foot"] == pytest.approx(-whole["N"], rel=1e-10)
    assert row["reaction_M_foot"] == pytest.approx(-whole["M"], rel=1e-10)
    assert "give the loads" not in caplog.text
    without = vc.Reactions("foot", tags["bottom"], (0.5 * WIDTH, 0.0)).start(problem, state)
    assert ("give the loads of fem.assemble" in caplog.text) == (comm.rank == 0)
    share = WEIGHT[1] * 0.5 * 0.5 * WIDTH  # of the lowest row of elements, half its height
    assert without["reaction_y_foot"] == pytest.approx(-whole["N"] + share, rel=1e-10)


@pytest.mark.serial
def test_weight_as_gravity(comm: Any) -> None:
    """Two materials under ``with_weight``: the foot carries both, a cut what is above it."""
    mesh, tags = block(comm, lengths=(WIDTH, HEIGHT), divisions=(2, 8))
    heavy = vc.LinearElastic(E=3.0e10, nu=0.1, rho=7800.0)
    low = mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, 1].mean(axis=1) < 2.0
    parts = [
        (fem.Cells("low", np.flatnonzero(one).astype(np.int32), mesh), material)
        for one, material in ((low, heavy), (~low, CONCRETE))
    ]
    problem = linear(vc.with_weight(fem.assemble(mesh, parts, clamped=tags["bottom"])))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    g = (0.0, -9.80665)
    held = vc.Reactions("foot", tags["bottom"], (0.0, 0.0), gravity=g).start(problem, state)
    cuts = {"joint": ((0.0, 2.0), (WIDTH, 2.0)), "low": ((0.0, 1.0), (WIDTH, 1.0))}
    row = vc.SectionForces(cuts, cells=tags["block"], gravity=g).start(problem, state)
    column = 9.80665 * WIDTH
    assert held["reaction_y_foot"] == pytest.approx(column * 2.0 * (2400.0 + 7800.0), rel=1e-10)
    assert held["reaction_M_foot"] == pytest.approx(
        column * 2.0 * (2400.0 + 7800.0) * 0.5 * WIDTH, rel=1e-10
    )
    assert row["N_joint"] == pytest.approx(-column * 2.0 * 2400.0, rel=1e-10)
    assert row["N_low"] == pytest.approx(-column * (2.0 * 2400.0 + 7800.0), rel=1e-10)


CUTS = {
    "ends inside": (
        ((0.0, 2.0), (0.25, 2.0)),
        ((0.25, 2.0), (WIDTH, 2.0)),
        ((0.0, 2.2), (0.3, 2.3)),
    ),
    "elements cover": (
        ((0.0, 2.0), (0.6, 2.0)),
        ((-0.1, 2.0), (WIDTH, 2.0)),
        ((0.0, 9.0), (WIDTH, 9.0)),
    ),
    "same point": (((0.0, 2.0), (0.0, 2.0)),),
    "3 corners": (((0.0, 2.0, 0.0), (1.0, 2.0, 0.0), (0.0, 2.0, 1.0)),),
}


@pytest.mark.parametrize("reason", CUTS)
def test_cuts_that_are_none_are_refused(comm: Any, reason: str) -> None:
    problem, *_ = cantilever(comm, False)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    for cut in CUTS[reason]:
        with pytest.raises(InputError, match=reason):
            vc.SectionForces({"bad": cut}).start(problem, state)


@pytest.mark.serial
def test_what_cannot_be_measured_is_refused(comm: Any) -> None:
    problem, tags, _ = cantilever(comm, False)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    with pytest.raises(InputError, match="nothing is prescribed"):
        vc.Reactions("top", tags["top"], (0.0, HEIGHT)).start(problem, state)
    with pytest.raises(InputError, match="3 coordinates"):
        vc.Reactions("foot", tags["bottom"], (0.0, 0.0, 0.0)).start(problem, state)
    with pytest.raises(InputError, match="letters"):
        vc.Reactions("the foot", tags["bottom"], (0.0, 0.0))


SHAKE = vc.Harmonic(3.0, 9.0, direction=(1.0, 0.0))
DT, STEPS, SCHEME = 1.0 / 360.0, 40, vc.Newmark()


def shaken(comm: Any, moving: bool) -> tuple[vc.ContactProblem, Any]:
    """A wall between nothing and a stop on its right, shaken in the relative frame or by its
    foot."""
    mesh, tags = block(comm, lengths=(2.0, 6.0), divisions=(2, 6))
    ground = base_motion(SHAKE)
    foot = fem.Prescribed(tags["bottom"], ground.displacement, ground.velocity, ground.acceleration)
    data: dict[str, Any] = {"prescribed": foot} if moving else {"clamped": tags["bottom"]}
    system = fem.assemble(mesh, CONCRETE, damping=vc.Rayleigh(0.0, 1e-4), **data)
    return linear(system, excitation=() if moving else SHAKE), tags


def histories(comm: Any, moving: bool) -> dict[str, Array]:
    problem, tags = shaken(comm, moving)
    record = [
        vc.Reactions("foot", tags["bottom"], (1.0, 0.0)),
        vc.SectionForces({"low": ((0.0, 1.0), (2.0, 1.0)), "foot": ((0.0, 0.0), (2.0, 0.0))}),
        vc.Racking({"wall": ((0.0, 0.0), (2.0, 0.0), (2.0, 6.0), (0.0, 6.0))}),
    ]
    solution = vc.simulate(
        problem, scheme=SCHEME, dt=DT, steps=STEPS, record=record, progress=False
    )
    return dict(solution.history)


@pytest.mark.slow
def test_frames_give_the_same_forces(comm: Any) -> None:
    """The relative frame with its inertia load and the foot moved by hand: reactions, N, V, M,
    racking to 1e-8."""
    one, two = histories(comm, False), histories(comm, True)
    names = [name for name in one if name.startswith(("reaction", "N_", "V_", "M_", "racking"))]
    assert len(names) == 10
    for name in names:
        # vertical forces are zero by symmetry
        size = np.abs(one[name if "racking" in name else "V_foot"]).max()
        assert np.abs(one[name] - two[name]).max() < 1e-8 * size, name
    assert (
        np.abs(one["reaction_x_foot"] + one["V_foot"]).max() < 1e-10 * np.abs(one["V_foot"]).max()
    )


def test_reactions_move_all_masses(comm: Any) -> None:
    """R + contact force + weight = rᵀ M (a + a_g) of the whole body, with a mass matrix assembled
    without supports."""
    mesh, tags = block(comm, lengths=(2.0, 6.0), divisions=(2, 6))
    weight = fem.BodyForce((0.0, -9.80665 * CONCRETE.rho))
    system = fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=weight)
    free = fem.assemble(mesh, CONCRETE)
    stop = vc.HalfSpace(point=(2.0, 0.0), normal=(-1.0, 0.0))
    problem = vc.ContactProblem(
        system,
        fem.contact_surface(system, tags["right"], obstacle=stop),
        excitation=SHAKE,
        mass=vc.ConsistentMass(),
    )
    reactions = vc.Reactions("foot", tags["bottom"], (1.0, 0.0), weight)
    touched = 0
    reactions.start(problem, initial_state(problem))
    for _, report in vc.march(
        problem, scheme=vc.Trapezoidal(), solver=vc.Condensed(), dt=DT, steps=STEPS
    ):
        row = reactions.row(report)
        contact = problem.surface.comm.sum(0.0 - report.balance.r_n @ problem.surface.normals)
        ground = 0.5 * (
            problem.ground_acceleration(report.old.t) + problem.ground_acceleration(report.new.t)
        )
        a = system.space.expand(problem.cartesian(report.balance.a), report.new.t, 2) + ground
        inertia = comm.allreduce(free.influence.T @ (free.M @ a.ravel()))
        total = comm.allreduce(free.influence.T @ (free.M @ np.tile((0.0, -9.80665), len(a))))
        for axis, i in (("x", 0), ("y", 1)):
            sum_of_forces = row[f"reaction_{axis}_foot"] + contact[i] + total[i]
            assert sum_of_forces == pytest.approx(inertia[i], abs=1e-9 * abs(total[1]))
        touched += bool(contact[0])
    assert 0 < touched < STEPS


B, BLOCK_HEIGHT, FOUNDATION, RHO = 1.0, 4.0, 1.0e7, 2000.0
BLOCK_WEIGHT = RHO * 9.80665 * 2.0 * B * BLOCK_HEIGHT
THETA_CR = BLOCK_WEIGHT / (2.0 * FOUNDATION * B**2)


def block_on_springs(
    comm: Any, divisions: int, stiffness: float, **data: Any
) -> tuple[vc.ContactProblem, Any]:
    mesh, tags = block(comm, lengths=(2.0 * B, BLOCK_HEIGHT), divisions=(divisions, 2))
    stiff = vc.LinearElastic(E=stiffness * FOUNDATION * B, nu=0.2, rho=RHO)
    system = fem.assemble(mesh, stiff, **{name: make(tags) for name, make in data.items()})
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground).on_springs(FOUNDATION)
    return vc.ContactProblem(system, surface), tags


@pytest.mark.serial
def test_s3_7_winkler_moment_and_rotation(comm: Any) -> None:
    """S3.7: M/(W b) = 1/3, .5286, .6667, .7892, .9333 at theta/theta_cr = 1, 2, 4, 10, 100, N = W,
    contact c/2b.

    A stiff block is turned by its top, so far down that the Winkler bed carries W: t =
    theta/theta_cr - 1.
    """
    ratios = np.array([1.0, 2.0, 4.0, 10.0, 100.0])

    def turned(x: Array, t: float) -> Array:
        theta = (1.0 + t) * THETA_CR
        contact = 2.0 * B / np.sqrt(1.0 + t)  # from the left end
        return np.column_stack([-theta * x[:, 1], theta * (x[:, 0] - contact)])

    problem, _ = block_on_springs(
        comm, 160, 1e6, prescribed=lambda tags: fem.Prescribed(tags["top"], displacement=turned)
    )
    recorder = vc.Resultants("base", (B, 0.0))
    start = vc.static_equilibrium(problem, solver=vc.Condensed())
    rows = [recorder.start(problem, start)]
    rows += [
        recorder.start(problem, state)
        for state in vc.quasi_static(problem, ratios[1:] - 1.0, solver=vc.Condensed(), state=start)
    ]
    printed = np.array([1.0 / 3.0, 0.5286, 0.6667, 0.7892, 0.9333])
    found = {
        name: np.array([row[f"{name}_base"] for row in rows])
        for name in ("N", "M", "theta", "uplift", "e")
    }
    assert np.abs(found["theta"] / (ratios * THETA_CR) - 1.0).max() < 2e-3
    assert np.abs(found["N"] / BLOCK_WEIGHT - 1.0).max() < 5e-3
    assert np.abs(-found["M"] / (found["N"] * B) - printed).max() < 1e-3
    assert np.abs(found["e"] - found["M"] / found["N"]).max() < 1e-15
    assert np.abs(found["uplift"] - (1.0 - 1.0 / np.sqrt(ratios))).max() < 1.5 / 160


@pytest.mark.serial
def test_s3_7_lift_off_and_uplift_under_a_horizontal_load(comm: Any) -> None:
    """S3.7: a block with its weight at height h lifts off at a/g = b/(3h), later uplift = 1 - 3(1 -
    e/b)/2, e = h a/g.

    Load controlled: held by contact alone and a roller along its base. M is W h a/g, R_x -W a/g to
    what the static stage of a body without supports leaves (1e-9 of the elastic forces of a stiff
    body).
    """
    h = 0.5 * BLOCK_HEIGHT
    for ratio, uplift in ((0.99, 0.0), (1.06, 0.09), (2.0, 0.5)):
        part = ratio * B / (3.0 * h)  # a/g
        load = fem.BodyForce((RHO * 9.80665 * part, -RHO * 9.80665))
        problem, tags = block_on_springs(
            comm,
            40,
            1e3,
            prescribed=lambda tags: fem.Prescribed(tags["bottom"], components=(0,)),
            loads=lambda tags, load=load: load,
        )
        state = vc.static_equilibrium(problem, solver=vc.Condensed())
        row = vc.Resultants("base", (B, 0.0)).start(problem, state)
        held = vc.Reactions("base", tags["bottom"], (B, 0.0), load).start(problem, state)
        assert row["N_base"] == pytest.approx(BLOCK_WEIGHT, rel=1e-6)
        assert row["M_base"] == pytest.approx(BLOCK_WEIGHT * h * part, rel=1e-6)
        assert row["e_base"] == pytest.approx(h * part, rel=1e-6)
        assert held["reaction_x_base"] == pytest.approx(-BLOCK_WEIGHT * part, rel=1e-6)
        assert row["uplift_base"] == pytest.approx(
            1.0 - 1.5 * (1.0 - h * part / B) if uplift else 0.0, abs=1.0 / 40
        )
        assert (row["uplift_base"] > 0.0) == (ratio > 1.0)


def test_ranks_agree(comm: Any) -> None:
    """All ranks together and each alone give the same histories to 1e-10."""
    from mpi4py import MPI

    together, alone = histories(comm, False), histories(MPI.COMM_SELF, False)
    for name, values in together.items():
        if name.startswith(("reaction", "N_", "V_", "M_", "racking", "rotation")):
            size = np.abs(
                alone[name if name[0] == "r" and "reaction" not in name else "V_foot"]
            ).max()
            assert np.abs(values - alone[name]).max() < 1e-10 * size, name


@pytest.mark.serial
def test_tangents_are_those_of_the_surfaces() -> None:
    """Of axes and inclined directions in the plane and in space, as ``fem.frames`` makes them."""
    rng = np.random.default_rng(3)
    for d in (2, 3):
        inclined = rng.normal(size=(40, d))
        inclined[:10, 0] = 0.0
        directions = np.vstack(
            [np.eye(d), -np.eye(d), inclined / np.linalg.norm(inclined, axis=1)[:, None]]
        )
        tangents = make_tangent_vectors(directions, np.arange(len(directions)))
        for direction, found in zip(directions, tangents, strict=True):
            frame = np.column_stack([direction, found])
            assert np.allclose(frame.T @ frame, np.eye(d), atol=1e-14)
            across = np.flatnonzero(direction == 0.0)  # axes across the direction keep their places
            others = [i for i in range(d) if i != np.argmax(np.abs(direction))]
            if len(across) == d - 1:
                assert np.array_equal(found, np.eye(d)[:, others])


ANGLES = [pytest.param(turns * np.pi, marks=pytest.mark.serial) for turns in (0.0, 0.5, 1.0, 1.5)]


@pytest.mark.parametrize("angle", [*ANGLES, 0.7], ids="{:.2f}".format)
def test_friction_of_walls_in_all_directions(comm: Any, angle: float) -> None:
    """Forces of a rubbing face that looks down, right, up, left or askew, against Contact's
    friction force."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2), angle=angle)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    push = fem.Traction(tags["top"], tuple(turn @ [3.0e4, -1.0e5]))
    system = fem.assemble(mesh, CONCRETE, clamped=tags["left"], loads=push)
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=tuple(turn @ [0.0, 1.0]))
    problem = vc.ContactProblem(
        system,
        fem.contact_surface(system, tags["bottom"], obstacle=ground),
        friction=vc.Coulomb(0.3),
    )
    state = vc.static_equilibrium(
        problem, solver=vc.Condensed(friction_method=solvers.FrictionNewton())
    )
    whole = vc.Contact().start(problem, state)
    row = vc.Resultants("base", tuple(turn @ [1.0, 0.0])).start(problem, state)
    size = row["N_base"]
    assert row["T_base"] < -0.05 * size  # against the push, along t = (-n_y, n_x) of the face
    for axis in "xy":
        total = whole[f"contact_force_{axis}"] + whole[f"friction_force_{axis}"]
        assert row[f"force_{axis}_base"] == pytest.approx(total, abs=1e-12 * size)
    held = vc.Reactions("left", tags["left"], tuple(turn @ [1.0, 0.0]), push).start(problem, state)
    assert row["M_base"] + held["reaction_M_left"] == pytest.approx(6.0e4, rel=1e-8)


def test_friction_resultants_are_the_recorded_forces(comm: Any) -> None:
    """N, T, force and M of a rubbing surface against Contact's forces; M is what the reactions and
    loads leave."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    push = fem.Traction(tags["top"], (3.0e4, -1.0e5))
    system = fem.assemble(mesh, CONCRETE, clamped=tags["left"], loads=push)
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    state = vc.static_equilibrium(
        problem, solver=vc.Condensed(friction_method=solvers.FrictionNewton())
    )
    whole = vc.Contact().start(problem, state)
    row = vc.Resultants("base", (1.0, 0.0)).start(problem, state)
    held = vc.Reactions("left", tags["left"], (1.0, 0.0), push).start(problem, state)
    assert abs(whole["friction_force_x"]) > 0.0
    assert row["T_base"] == pytest.approx(whole["friction_force_x"], rel=1e-12)
    assert row["force_x_base"] == pytest.approx(whole["friction_force_x"], rel=1e-12)
    assert row["N_base"] == pytest.approx(whole["contact_force_y"], rel=1e-12)
    moment_of_push = -3.0e4 * 2.0 * 1.0  # about the base's middle, of the drag along the top
    total = row["M_base"] + held["reaction_M_left"] + moment_of_push
    assert total == pytest.approx(0.0, abs=1e-9 * abs(moment_of_push))
    halves = [
        vc.Resultants(name, (1.0, 0.0), where=mask).start(problem, state)
        for name, mask in (("a", lambda x, n: x[:, 0] <= 1.0), ("b", lambda x, n: x[:, 0] > 1.0))
    ]
    assert halves[0]["M_a"] + halves[1]["M_b"] == pytest.approx(row["M_base"], rel=1e-12)


@pytest.mark.serial
@pytest.mark.promise("guide/outputs.md", "the contact forces above the cut to 1e-8")
def test_wall_of_the_channel_is_in_equilibrium(comm: Any) -> None:
    """Buried channel after gravity, with friction: its weight is the contact force on base and
    walls, and N, V, M at the foot of a wall are those of the wall's weight and of the contact
    forces above the cut."""
    model = build(Channel(), comm)
    x, y = model.channel.shape.x, model.channel.shape.y
    left, inner, top_of_slab = x[1], x[2], y[2]
    problem = model.problem(friction=vc.Coulomb(0.5))
    state = vc.static_equilibrium(
        problem, solver=vc.Condensed(friction_method=solvers.FrictionNewton())
    )
    middle = (0.5 * (left + inner), top_of_slab)
    whole = vc.Resultants("all", middle, normal=(0.0, -1.0)).start(problem, state)
    above_cut = vc.Resultants(
        "wall", middle, where=lambda p, n: (n[:, 0] < -0.5) & (p[:, 1] > top_of_slab + 1e-6)
    ).start(problem, state)
    cut = {"foot": ((left, top_of_slab), (inner, top_of_slab))}
    g = 9.80665
    section = vc.SectionForces(cut, cells=model.tags["channel"], gravity=(0.0, -g)).start(
        problem, state
    )
    area = (x[4] - x[1]) * (y[3] - y[1]) - (x[3] - x[2]) * (y[3] - y[2])
    weight = 2400.0 * g * area
    wall = 2400.0 * g * (inner - left) * (y[3] - top_of_slab)
    assert whole["force_y_all"] == pytest.approx(weight, rel=1e-8)
    assert whole["force_x_all"] == pytest.approx(0.0, abs=1e-8 * weight)
    assert section["N_foot"] == pytest.approx(above_cut["force_y_wall"] - wall, rel=1e-8)
    assert section["V_foot"] == pytest.approx(above_cut["force_x_wall"], rel=1e-8)
    assert section["M_foot"] == pytest.approx(above_cut["M_wall"], rel=1e-8)


@pytest.mark.slow
def test_reactions_in_space(comm: Any) -> None:
    """A block on its foot under weight and a drag along its top: force and moment vectors about a
    corner."""
    mesh, tags = block(comm, lengths=(2.0, 1.0, 1.5), divisions=(2, 2, 2))
    loads = [fem.BodyForce((0.0, -2.4e4, 0.0)), fem.Traction(tags["top"], (0.0, 0.0, 5.0e3))]
    problem = linear(fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=loads))
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    row = vc.Reactions("foot", tags["bottom"], (0.0, 0.0, 0.0), loads).start(problem, state)
    weight, drag = 2.4e4 * 3.0, 5.0e3 * 3.0  # N, at (1, .5, .75) and (1, 1, .75)
    expected = {
        "x": 0.0,
        "y": weight,
        "z": -drag,
        "M_x": -drag * 1.0 - weight * 0.75,
        "M_y": drag,
        "M_z": weight,
    }
    found = {part: row[f"reaction_{part}_foot"] for part in expected}
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-10 * weight)
