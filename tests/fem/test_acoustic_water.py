"""Compressible water before dams: Chopra's closed forms, damped columns, runs, ledger and ranks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from mpi4py import MPI
from test_reservoir import stand

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError
from vi_contact.fem.body.acoustic_water import WaterData, find_water
from vi_contact.fem.body.released_supports import begin_from, carry_over
from vi_contact.fem.body.water_unknowns import add_entries
from vi_contact.meshes import BlockMesh, TwoBlocks
from vi_contact.run.damping import first_modes
from vi_contact.run.modal import lowest_frequency

H, C, RHO = 60.0, 1440.0, 1000.0
FIRST = np.pi * C / (2.0 * H)  # omega_1 of the reservoir [rad/s]


def fill(alpha: float, length: float, layers: int = 20, **others: Any) -> Any:
    """The water before an upright wall, or before its mirror image."""
    y = np.linspace(0.0, H, layers + 1)
    side = others.pop("side", 1.0)
    settings: dict[str, Any] = {"open_end": True, "speed": C, "highest": 2.0 * C / H} | others
    data = WaterData(density=RHO, reflection=alpha, length=length, thickness=1.0, **settings)
    return find_water(np.zeros_like(y), y, side, data)


def find_push(water: Any, omega: float) -> complex:
    """The force of a wall that moves with e^(i omega t) m/s², over rho h²."""
    layers = water.of_face.shape[0]
    volumes = np.full(layers, H / layers)
    volumes[0] *= 0.5
    A = np.diag(water.stiffness + 1j * omega * water.damping) - omega**2 * water.mass
    inner = np.linalg.solve(A, -water.coupling.T @ volumes)
    pressure = water.of_face @ volumes - omega**2 * (water.coupling @ inner)
    return complex(volumes @ pressure / (RHO * H**2))


def sum_up(omega: float, alpha: float, length: float | None = None) -> complex:
    """Chopra's sum for a wall, with the bottom of Fenves and Chopra; the far end at a distance."""
    leak = 1j * omega * (1.0 - alpha) / ((1.0 + alpha) * C)
    place, weights = np.polynomial.legendre.leggauss(400)
    y = 0.5 * H * (place + 1.0)
    force = 0.0j
    for n in range(1, 60):
        mu = (2 * n - 1) * np.pi / (2.0 * H) + 0.0j
        for share in np.linspace(0.1, 1.0, 10):  # cos(mu H) + leak/mu sin(mu H) = 0, from leak = 0
            for _ in range(5):
                s, c = np.sin(mu * H), np.cos(mu * H)
                value = mu * c + share * leak * s
                mu -= value / (c - mu * H * s + share * leak * H * c)
        shape = np.cos(mu * y) + leak / mu * np.sin(mu * y)
        k = np.sqrt(mu**2 - (omega / C) ** 2)
        k = k if (k * (1.0 + 1e-9j)).imag >= 0.0 or k.real > 0.0 else -k
        reach = 1.0 / k
        if length is not None:
            end = 1j * omega / (C * k)
            reach *= (1.0 + end * np.tanh(k * length)) / (np.tanh(k * length) + end)
        both = 0.5 * H * (weights @ shape) ** 2 / (weights @ shape**2)
        force += both * reach
    return complex(force / H**2)


@pytest.mark.parametrize("alpha", [1.0, 0.5])
def test_the_push_on_a_wall_over_frequency(alpha: float) -> None:
    """The closed form with this far end, to 2.5 omega_1; .622881423 at .5 omega_1."""
    water = fill(alpha, 300.0)
    for part, bound in ((0.01, 5e-3), (0.5, 5e-3), (0.8, 5e-3), (1.5, 0.025), (2.5, 0.05)):
        exact = sum_up(part * FIRST, alpha, 300.0)
        assert abs(find_push(water, part * FIRST) - exact) < bound * abs(exact)
    if alpha == 1.0:
        assert abs(sum_up(0.5 * FIRST, 1.0)) == pytest.approx(0.622881423, rel=1e-4)
        assert abs(find_push(water, 0.5 * FIRST)) == pytest.approx(0.622881423, rel=5e-3)
        assert abs(find_push(water, 0.01 * FIRST)) == pytest.approx(0.542754514, rel=5e-3)
    mirrored = fill(alpha, 300.0, side=-1.0)
    assert find_push(mirrored, FIRST) == pytest.approx(find_push(water, FIRST), rel=1e-9)


def test_errors_of_the_mesh_fall_with_its_square() -> None:
    """Twice the nodes of the face, about a quarter of the error at .5 omega_1."""
    exact = sum_up(0.5 * FIRST, 1.0, 120.0)
    errors = [
        abs(find_push(fill(1.0, 120.0, layers, highest=48.0 * layers / 10), 0.5 * FIRST) - exact)
        for layers in (10, 20)
    ]
    assert errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("alpha", [1.0, 0.8, 0.5])
def test_waves_of_a_column_come_back_alpha_times_as_large(alpha: float) -> None:
    """A wave takes 2 h/c to the bottom and back: period 4 h/c, rate c ln alpha/2h."""
    water = fill(alpha, 6.0, open_end=False)
    n = water.count
    nothing, one = np.zeros((n, n)), np.eye(n)
    first = np.block([[nothing, one], [-np.diag(water.stiffness), -np.diag(water.damping)]])
    second = np.block([[one, nothing], [nothing, water.mass]])
    values = scipy.linalg.eigvals(first, second)
    values = values[values.imag > 0.5 * FIRST]
    value = values[np.argmin(np.abs(values - 1j * FIRST))]
    assert value.imag == pytest.approx(FIRST, rel=2e-3)
    assert value.real == pytest.approx(C / (2.0 * H) * np.log(alpha), rel=3e-3, abs=1e-9 * FIRST)
    assert water.frequencies[0] == pytest.approx(C / (4.0 * H), rel=2e-3)


def test_energies_of_the_water_are_positive_and_its_modes_real() -> None:
    """M of face and water together, K and C have no negative direction."""
    water = fill(0.6, 120.0, layers=8)
    whole = np.block([[water.of_face, water.coupling], [water.coupling.T, water.mass]])
    values = np.linalg.eigvalsh(whole / np.sqrt(np.outer(np.diag(whole), np.diag(whole))))
    assert values[0] > -1e-12 * values[-1]
    assert water.stiffness.min() > 0.0 and water.damping.min() >= 0.0


def test_periods_of_a_dam(comm: Any) -> None:
    """joints.md has 0.3038 s for 1440 m/s; fast sound gives the period of incompressible water."""
    periods = {}
    for name, water in {
        "acoustic": {"model": "acoustic"},
        "fast": {"model": "acoustic", "speed": 1e6, "far_end": "closed"},
        "incompressible": {"model": "incompressible"},
    }.items():
        size = (100.0, 80.0, 8.0)
        system, _ = stand(comm, size, (8, 12), {"level": 100.0, **water}, E=30e9, degree=2)
        periods[name] = 1.0 / lowest_frequency(system)
    assert periods["acoustic"] == pytest.approx(0.3038, rel=3e-3)
    assert periods["fast"] == pytest.approx(periods["incompressible"], rel=3e-3)


def pose(comm: Any, size: tuple[float, float, float], cells: tuple[int, int], **others: Any) -> Any:
    """A dam on a base with friction, its face wet to 0.9 of its height; shaken by a sine."""
    frequency = others.pop("frequency", 2.0)
    amplitude = others.pop("amplitude", 3.0)
    water = {"level": 0.9 * size[0], "model": "acoustic"} | others.pop("water", {})
    system, base = stand(comm, size, cells, water, held=False, **others)
    system = laws.with_weight(system)
    return vc.ContactProblem(
        system,
        fem.contact_surface(system, base),
        friction=vc.Coulomb(0.8),
        mass=vc.ConsistentMass(),
        excitation=vc.Harmonic(amplitude=amplitude, frequency=frequency, direction=(1.0, 0.0)),
    )


SMALL = ((40.0, 30.0, 6.0), (4, 6))
RECORD = (vc.Energy, vc.Contact, vc.ReservoirWater)


def march(problem: Any, dt: Any, t_end: float, **others: Any) -> Any:
    """Run from rest under weight and water."""
    if "restart" not in others:
        others["state"] = vc.static_equilibrium(problem, tolerance=1e-7)
    settings: dict[str, Any] = {"scheme": vc.Midpoint(), "solver": vc.Condensed()} | others
    record = [recorder() for recorder in RECORD]
    return vc.simulate(problem, dt=dt, t_end=t_end, record=record, progress=False, **settings)


def test_a_stiff_wall_in_time_feels_what_it_feels_over_frequency(comm: Any) -> None:
    """The recorded force of a sine swings as Chopra's sum says, within 3 %.

    The bottom absorbs: before a rigid one the start of the sine rings on for long.
    """
    part = 0.6
    alpha = 0.5
    period = 2.0 * np.pi / (part * FIRST)
    size = (60.0, 60.0, 60.0)
    problem = pose(
        comm,
        size,
        (2, 16),
        E=1e13,
        water={"level": 60.0, "reflection": alpha},
        frequency=1.0 / period,
        amplitude=0.1,
    )
    run = march(problem, period / 40.0, 12.0 * period)
    if comm.rank == 0:
        force = run.history["water_force_x"][-80:]
        swing = 0.5 * (force.max() - force.min())
        exact = abs(sum_up(part * FIRST, alpha, 300.0))
        assert swing / (0.1 * RHO * H**2) == pytest.approx(exact, rel=0.03)


@pytest.mark.parametrize(
    "scheme",
    [vc.Midpoint(), vc.ZienkiewiczWoodTaylor(), vc.HHT(), vc.SS22(), vc.ContactStabilisedNewmark()],
    ids=lambda scheme: type(scheme).__name__,
)
def test_the_ledger_has_the_water(comm: Any, scheme: Any) -> None:
    """Every loss of a dam without damping is that of the water; certified, with friction."""
    problem = pose(comm, *SMALL, water={"reflection": 0.7}, slope=0.1)
    run = march(problem, 0.01, 0.4, scheme=scheme)
    h = run.history
    assert h["certificate"].max() < 1e-9
    assert np.abs(h["energy_defect"]).max() < 1e-8 * h["work_input"].max()
    lost = h["loss_radiated"][-1] + h["loss_bottom"][-1]
    assert lost == pytest.approx(h["loss_damping"][-1], rel=1e-9) and lost > 0.0
    assert h["loss_friction"][-1] > 0.0
    if not isinstance(scheme, vc.HHT):  # whose mean velocity is not du/dt
        assert np.diff(h["loss_radiated"]).min() > -1e-9 * lost
    total = h["energy_kinetic"] + h["energy_strain"]
    assert np.all(h["energy_water"] <= total) and h["energy_water"].max() > 0.0


def test_second_order_in_time(comm: Any) -> None:
    """Half the step, a quarter of the error, of a dam that stays closed."""
    problem = pose(comm, *SMALL, amplitude=0.05, damping=vc.Rayleigh(0.0, 2e-3))
    ends = [march(problem, dt, 0.32).history["energy_water"] for dt in (8e-3, 4e-3, 2e-3, 1e-3)]
    if comm.rank == 0:
        places = [ends[k][:: 2**k] for k in range(4)]
        steps = [np.abs(places[k + 1] - places[k]).max() for k in range(3)]
        assert 3.0 < steps[1] / steps[2] < 5.0


def test_restarts_and_halved_steps(comm: Any, shared_tmp: Path) -> None:
    """A restart goes on as the straight run does; a plan that halves steps is certified."""
    problem = pose(comm, *SMALL, water={"reflection": 0.7})
    straight = march(problem, 0.01, 0.2).history
    march(problem, 0.01, 0.1, out=shared_tmp)
    again = march(problem, 0.01, 0.2, out=shared_tmp, restart=True).history
    for name in ("energy_water", "loss_bottom", "water_force_x", "energy_kinetic"):
        size = np.abs(straight[name]).max()
        assert np.abs(again[name] - straight[name]).max() <= 1e-10 * size
    halved = march(problem, vc.HalvedAtImpact(0.02, halvings=2), 0.2).history
    assert halved["certificate"].max() < 1e-9
    assert np.abs(halved["energy_defect"]).max() < 1e-8 * halved["work_input"].max()


def test_any_number_of_ranks(comm: Any) -> None:
    """The numbers of one rank, to 1e-10 of the largest."""
    histories = [march(pose(c, *SMALL), 0.01, 0.1).history for c in (comm, MPI.COMM_SELF)]
    if comm.rank == 0:
        for name in ("energy_water", "loss_radiated", "water_force_x", "energy_strain"):
            first, second = (history[name] for history in histories)
            assert np.abs(first - second).max() <= 1e-10 * np.abs(second).max()


def assemble_on_rock(comm: Any, *, follower: bool) -> tuple[Any, Any]:
    """Return (system, tags) of a dam on rock whose sides are tied, with a wet face to its heel."""
    lower = BlockMesh(lengths=(60.0, 20.0), divisions=(6, 2))
    upper = BlockMesh(lengths=(20.0, 40.0), divisions=(2, 5))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(20.0,)), comm)
    sides = [tags["lower_left"], tags["lower_right"]]
    wet = fem.Reservoir(tags["upper_left"], 56.0, model="acoustic", reflection=0.8)
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=20e9, nu=0.2, rho=2400.0),
        prescribed=fem.Prescribed(tags["lower_bottom"]),
        tied=fem.Tied(*(sides[::-1] if follower else sides)),
        reservoir=wet,
    )
    return system, tags


def march_on_rock(comm: Any, *, follower: bool) -> Any:
    """Run that dam."""
    system, tags = assemble_on_rock(comm, follower=follower)
    system = laws.with_weight(system)
    surface = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    shake = vc.Harmonic(amplitude=3.0, frequency=3.0, direction=(1.0, 0.0))
    problem = vc.ContactProblem(
        system,
        surface,
        friction=vc.Coulomb(0.8),
        mass=vc.ConsistentMass(),
        excitation=shake,
    )
    return march(problem, 0.01, 0.1).history


def test_a_dam_on_tied_rock(comm: Any) -> None:
    """Certified and closed on any ranks; whichever side follows, the numbers are the same."""
    h = march_on_rock(comm, follower=False)
    alone = march_on_rock(MPI.COMM_SELF, follower=True)
    if comm.rank == 0:
        assert h["certificate"].max() < 1e-9
        assert np.abs(h["energy_defect"]).max() < 1e-8 * h["work_input"].max()
        for name in ("energy_water", "loss_bottom", "water_force_x"):
            assert np.abs(h[name] - alone[name]).max() <= 1e-10 * np.abs(alone[name]).max()


@pytest.mark.parametrize("follower", [False, True])
def test_what_is_stored_is_symmetric(follower: bool) -> None:
    """An entry that cancels stays stored: some orders of elimination do not end without it."""
    system, _ = assemble_on_rock(MPI.COMM_SELF, follower=follower)
    for matrix in (system.M, system.C, system.K):
        stored = system.algebra.entries(matrix, np.arange(matrix.rows))
        stored.data[:] = 1.0
        assert (stored != stored.T).nnz == 0


def test_a_sum_keeps_what_cancels() -> None:
    one = sp.csr_matrix([[1.0, 2.0], [0.0, 3.0]])
    other = sp.csr_matrix([[0.0, -2.0], [4.0, 1.0]])
    both = add_entries(one, other)
    assert both.nnz == 4 and np.array_equal(both.toarray(), [[1.0, 0.0], [4.0, 4.0]])


def test_modes_and_stages_know_the_water(comm: Any) -> None:
    """Periods with corners that rub, and a motion that begins where a static stage has ended."""
    system, base = stand(comm, *SMALL, {"level": 36.0, "model": "acoustic"}, held=False)
    system = laws.with_weight(system)
    surface = fem.contact_surface(system, base)
    still = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.8), mass=vc.ConsistentMass())
    closed = first_modes(still)
    assert 0.1 < closed.periods[0] < 0.2 and closed.rigid_motions == 0
    rest = vc.static_equilibrium(still, tolerance=1e-7)
    begun, first = fem.release(still, rest, still)
    run = vc.simulate(
        begun,
        scheme=vc.Midpoint(),
        solver=vc.Condensed(),
        dt=0.01,
        t_end=0.1,
        state=first,
        record=[vc.Energy(), vc.ReservoirWater()],
        progress=False,
    )
    # nothing shakes it, so nothing moves
    assert run.history["energy_water"].max() < 1e-9 * run.history["energy_strain"].max()
    push = 0.5 * 9806.65 * 36.0**2
    assert np.abs(run.history["water_force_x"]).max() < 1e-5 * push


def test_a_base_that_moves_is_a_ground_that_moves(comm: Any) -> None:
    """The motion of a held base pushes the water as the same acceleration of the ground does."""
    import dolfinx

    shape = dolfinx.mesh.CellType.quadrilateral
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [20.0, 40.0]], [2, 6], shape)
    at = {"base": (1, 0.0), "face": (0, 0.0), "top": (1, 40.0)}
    parts = {
        name: fem.Facets.where(name, mesh, lambda x, k=k, value=value: np.isclose(x[k], value))
        for name, (k, value) in at.items()
    }
    frequency = 3.0
    w = 2.0 * np.pi * frequency
    history = (
        lambda t: (t - np.sin(w * t) / w) / w,
        lambda t: (1.0 - np.cos(w * t)) / w,
        lambda t: np.sin(w * t),
    )
    moved = fem.Prescribed(parts["base"], displacement=(1.0, 0.0), history=history)
    forces = []
    for prescribed, shake in (
        (fem.Prescribed(parts["base"]), vc.Harmonic(1.0, frequency, direction=(1.0, 0.0))),
        (moved, ()),
    ):
        system = fem.assemble(
            mesh,
            vc.LinearElastic(E=20e9, nu=0.2, rho=2400.0),
            prescribed=prescribed,
            reservoir=fem.Reservoir(parts["face"], 36.0, model="acoustic", reflection=0.7),
        )
        roof = vc.HalfSpace(point=(0.0, 50.0), normal=(0.0, -1.0))
        surface = fem.contact_surface(system, parts["top"], obstacle=roof)
        problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass(), excitation=shake)
        run = vc.simulate(
            problem,
            scheme=vc.Midpoint(),
            solver=vc.Condensed(),
            dt=4e-3,
            t_end=0.2,
            record=[vc.Energy(), vc.ReservoirWater()],
            progress=False,
        )
        h = run.history
        assert np.abs(h["energy_defect"]).max() < 1e-8 * np.abs(h["work_input"]).max()
        forces.append(h["water_force_x"])
    # of second order in dt: the one takes the mean of accelerations, the other that in the middle
    assert np.abs(forces[0] - forces[1]).max() < 5e-3 * np.abs(forces[0]).max()


def test_a_stage_fills_the_reservoir(comm: Any) -> None:
    """The unknowns of the water begin at rest where a stage without water ended, and stay so."""
    problems = []
    for water in (None, {"level": 36.0, "model": "acoustic", "reflection": 0.5}):
        system, base = stand(comm, *SMALL, water, held=False)
        system = laws.with_weight(system)
        surface = fem.contact_surface(system, base)
        law = vc.Coulomb(0.8)
        problems.append(vc.ContactProblem(system, surface, friction=law, mass=vc.ConsistentMass()))
    dry, wet = problems
    rest = vc.static_equilibrium(dry)
    u = carry_over(dry, wet, dry.cartesian(rest.u))
    assert len(u) == wet.system.rows
    assert len(carry_over(wet, dry, u)) == dry.system.rows
    begun, _ = begin_from(wet, u, np.zeros_like(u), rest)
    full = vc.static_equilibrium(begun)
    largest = comm.allreduce(np.abs(full.u).max(initial=0.0), op=MPI.MAX)
    assert np.abs(wet.system.space.water.own_values(full.u)).max() < 1e-7 * largest


def test_water_that_does_not_weigh(comm: Any) -> None:
    """M r of a vertical acceleration is that of the dry dam, on a slope too."""
    systems = []
    for water in ({"level": 36.0, "model": "acoustic"}, None):
        damping = vc.Rayleigh(0.5, 0.0)
        systems.append(stand(comm, *SMALL, water, slope=0.2, damping=damping)[0])
    wet, dry = (np.sort(s.inertia(np.array([0.0, 1.0]))) for s in systems)
    both = [comm.allreduce(weight.sum()) for weight in (wet, dry)]
    assert both[0] == pytest.approx(both[1], rel=1e-9)
    assert systems[0].K.rows == systems[1].K.rows + (
        systems[0].space.water.equations.count if comm.rank == comm.size - 1 else 0
    )


@pytest.mark.serial
def test_what_does_not_go_with_the_water_is_refused(comm: Any) -> None:
    """Bodies that yield, bodies that come and go, and space."""
    import dolfinx

    water = {"level": 36.0, "model": "acoustic"}
    with pytest.raises(InputError, match="come and go"):
        stand(comm, *SMALL, water, absent=())
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [20.0, 40.0]], [2, 4])
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    base = fem.Prescribed(fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0)))
    soft = laws.J2(E=25e9, nu=0.2, rho=2400.0, yield_stress=1e6)
    with pytest.raises(InputError, match="before linear bodies"):
        fem.assemble(mesh, soft, prescribed=base, reservoir=fem.Reservoir(face, **water))
    box = dolfinx.mesh.create_box(comm, [[0.0] * 3, [20.0, 10.0, 40.0]], [1, 1, 2])
    face = fem.Facets.where("face", box, lambda x: np.isclose(x[0], 0.0))
    stone = vc.LinearElastic(E=25e9, nu=0.2, rho=2400.0)
    with pytest.raises(InputError, match="for the plane"):
        fem.assemble(box, stone, reservoir=fem.Reservoir(face, **water))


@pytest.mark.serial
def test_bad_water_is_refused_in_one_sentence(comm: Any) -> None:
    """By name and with a remedy."""
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"speed": 0.0}, "the speed of sound"),
        ({"reflection": 1.2}, "the reflection of the bottom"),
        ({"far_end": "rigid"}, "'open' or 'closed'"),
        ({"highest": -3.0}, "the highest frequency"),
        ({"highest": 500.0}, "give a lower highest"),
        ({"model": "added mass", "speed": 1500.0}, "speed is for compressible water"),
        ({"model": "added mass", "length": 50.0}, "length is for"),
        ({"level": 50.0}, "above the top"),
    ]
    for values, words in wrong:
        water = {"level": 36.0, "model": "acoustic"} | values
        with pytest.raises(InputError, match=words):
            stand(comm, *SMALL, water)
    for model in ("acoustic", "incompressible"):
        water = {"level": 36.0, "model": model, "length": 5.0}
        with pytest.raises(InputError, match="reaches 7.2 m over the water"):
            stand(comm, *SMALL, water, slope=-0.2)
    system, base = stand(comm, *SMALL, {"level": 36.0}, held=False)
    problem = vc.ContactProblem(system, fem.contact_surface(system, base))
    with pytest.raises(InputError, match="no compressible water"):
        vc.simulate(problem, dt=0.01, t_end=0.02, record=[vc.ReservoirWater()], progress=False)
    wet, base = stand(comm, *SMALL, {"level": 36.0, "model": "acoustic"}, held=False)
    problem = vc.ContactProblem(wet, fem.contact_surface(wet, base), mass=vc.Redistributed())
    with pytest.raises(InputError, match=r"ConsistentMass\(\)"):
        vc.simulate(problem, dt=0.01, t_end=0.02, progress=False)
