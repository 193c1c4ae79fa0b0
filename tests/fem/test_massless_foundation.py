"""A block on ground without mass (rho = 0): the limit of small densities, with a joint that may
crack and slide between them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import bem, fem, ground_motion, laws, soil
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

STONE = vc.LinearElastic(E=2e10, nu=0.2, rho=2400.0)
JOINT = laws.Joint(mu=0.7, cohesion=3e5, tension=5e4, opening=2e-5)
STEPS, DT = 60, 0.008
SHAKEN = vc.Harmonic(3.0, 3.0)


def foundation(
    rho: float,
    comm: Any = MPI.COMM_WORLD,
    *,
    stone: float = STONE.rho,
    pushed: bool = False,
    unlike: bool = False,
    dashpots: str | None = None,
    **data: Any,
) -> tuple[Any, Any]:
    """(system, tags) of a block of 10 m x 20 m with weight on ground of 10 m, held below."""
    mesh = TwoBlocks(
        lower=BlockMesh(lengths=(10.0, 10.0), divisions=(4 if unlike else 5, 4)),
        upper=BlockMesh(lengths=(10.0, 20.0), divisions=(5, 6)),
    )
    built, tags = fem.build_mesh(mesh, comm)
    weight = fem.BodyForce((0.0, -24000.0), cells=tags["upper"])
    push = fem.Traction(tags["lower_left"], (1e5, 0.0))
    above = vc.LinearElastic(E=STONE.E, nu=STONE.nu, rho=stone)
    ground = vc.LinearElastic(E=1e10, nu=0.25, rho=rho)
    given: dict[str, Any] = {
        "clamped": tags["lower_bottom"],
        "loads": [weight, push] if pushed else weight,
        "damping": vc.Rayleigh(alpha=0.0, beta=2e-3),
    }
    if dashpots is not None:
        given["dashpots"] = fem.Dashpots(tags[dashpots])
    materials = [(tags["upper"], above), (tags["lower"], ground)]
    return fem.assemble(built, materials, **given | data), tags


def block(
    rho: float,
    comm: Any = MPI.COMM_WORLD,
    *,
    turned: bool = False,
    pushed: bool = False,
    unlike: bool = False,
    **more: Any,
) -> Any:
    """The problem; ``turned`` makes the ground side 1 of the contact, ``pushed`` loads it,
    ``unlike`` has a mesh of its own in it."""
    system, tags = foundation(rho, comm, pushed=pushed, unlike=unlike)
    matching = fem.DualMortar() if unlike else None
    sides = [tags["upper_bottom"], tags["lower_top"]]
    surface = fem.contact_pair(system, *(sides[::-1] if turned else sides), matching=matching)
    given = {"joint": JOINT, "excitation": SHAKEN} | more
    return vc.ContactProblem(system, surface, **given)


def march(problem: Any, steps: int = STEPS, **more: Any) -> Any:
    rest = {} if "restart" in more else {"state": vc.static_equilibrium(problem)}
    return vc.simulate(problem, dt=DT, steps=steps, progress=False, **rest | more)


def distance(one: Any, other: Any) -> dict[str, float]:
    """How far ends of runs are apart, of the largest numbers: displacements and velocities of the
    bodies, reactions."""
    comm = one.problem.surface.comm
    apart = {}
    for name in ("u", "v", "r_n"):
        a, b = (getattr(each.state, name) for each in (one, other))
        if name != "r_n":
            a, b = (each.problem.cartesian(x) for each, x in ((one, a), (other, b)))
        if name == "v":  # that of small masses swings about the one without mass
            heavy = ~np.asarray(other.problem.system.massless)
            a, b = a[heavy], b[heavy]
        parts = [np.max(np.abs(a - b), initial=0.0), np.max(np.abs(b), initial=0.0)]
        difference, size = comm.max(np.array(parts))
        apart[name] = float(difference / size)
    return apart


@cache
def massless() -> Any:
    """The run whose ground has no mass, on all ranks; every test reads it."""
    return march(block(0.0))


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize("turned", [False, True], ids=["block is side 1", "ground is side 1"])
@pytest.mark.parametrize("law", ["joint", "friction", "mortar"])
def test_no_mass_is_the_limit_of_small_masses(law: str, turned: bool) -> None:
    """Distances fall a thousandfold with a thousandth of the density, and joints crack and slide;
    1e-3 kg/m³ is 1e-6 of the density of stone, and so are distances, within a factor of 3."""
    others: dict[str, Any] = {"turned": turned, "unlike": law == "mortar"}
    if law == "friction":
        others |= {"joint": None, "friction": vc.Coulomb(0.7), "mass": vc.ConsistentMass()}
    limit = march(block(0.0, **others))
    far, near = (distance(march(block(rho, **others)), limit) for rho in (1e-3, 1e-6))
    for name, value in far.items():
        assert value < 3.0e-3 / STONE.rho, name
        assert near[name] < 3e-3 * value, name
    history = limit.history
    assert history["certificate"].max() < 2e-9
    moved = np.max(history["energy_kinetic"])
    assert np.max(np.abs(history["energy_defect"])) < 1e-9 * moved
    assert history["loss_friction"][-1] > 0.01 * moved


@pytest.mark.two_ranks
def test_velocities_do_not_swing() -> None:
    """Nodes without mass have the mean velocity of the step, on either side of the contact."""
    run = massless()
    problem = run.problem
    old = march(block(0.0), STEPS - 1).state
    rate = problem.cartesian(run.state.u - old.u) / DT
    v = problem.cartesian(run.state.v)
    ground = np.asarray(problem.system.massless)
    size = problem.surface.comm.max(np.array([np.max(np.abs(v), initial=0.0)]))[0]
    assert np.max(np.abs(v - rate)[ground], initial=0.0) < 1e-9 * size


@pytest.mark.two_ranks
def test_a_restart_is_the_straight_run(shared_tmp: Any) -> None:
    """To the last digits but round-off."""
    straight = massless()
    march(block(0.0), 35, out=shared_tmp)
    again = march(block(0.0), out=shared_tmp, restart=True)
    for value in distance(again, straight).values():
        assert value < 1e-12
    kept = [each.state.memory["joint_kappa"] for each in (again, straight)]
    assert np.max(np.abs(kept[0] - kept[1]), initial=0.0) <= 1e-15


@pytest.mark.two_ranks
def test_ranks_change_nothing() -> None:
    """Of one rank and of several: the ledgers of the joint, to round-off."""
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    alone = march(block(0.0, MPI.COMM_SELF)).history
    ours = massless().history
    for name in ("loss_fracture", "loss_friction", "energy_kinetic", "energy_strain"):
        assert np.max(np.abs(ours[name] - alone[name])) <= 1e-9 * np.max(np.abs(alone[name])), name


@pytest.mark.parametrize(
    ("others", "said"),
    [
        ({"mass": vc.Redistributed()}, "rho = 0, and redistributed mass needs"),
        ({"scheme": vc.SS22()}, "a material has rho = 0, and this scheme needs mass in all bodies"),
        ({"scheme": vc.Trapezoidal(), "mass": vc.ConsistentMass()}, "rho = 0, and this scheme"),
        ({"scheme": vc.MoreauJean()}, "rho = 0, and this scheme"),
        ({"impact": vc.Inelastic()}, "a material has rho = 0, and the impact law"),
    ],
)
def test_what_needs_mass_is_refused(others: dict[str, Any], said: str) -> None:
    others = dict(others)
    scheme = others.pop("scheme", None)
    problem = block(0.0, joint=None, friction=vc.Coulomb(0.7), **others)
    with pytest.raises(InputError, match=said):
        vc.simulate(problem, scheme=scheme, dt=DT, steps=1, progress=False)


def test_bodies_that_need_mass_are_refused() -> None:
    with pytest.raises(InputError, match="all materials have rho = 0"):
        foundation(0.0, stone=0.0)
    with pytest.raises(InputError, match="MassProportional damps by the mass"):
        foundation(0.0, damping=vc.MassProportional(3.0))
    with pytest.raises(InputError, match="dashpots absorb nothing without mass"):
        foundation(0.0, dashpots="lower_left")


def test_a_rough_start_is_told(caplog: pytest.LogCaptureFixture) -> None:
    """A pushed ground that starts from zero would swing; one in equilibrium does not."""
    rough = "not in equilibrium at the start"
    problem = block(0.0, pushed=True)
    march(problem, 2)
    assert rough not in caplog.text
    vc.simulate(problem, dt=DT, steps=2, progress=False)
    assert (rough in caplog.text) == (MPI.COMM_WORLD.rank == 0)


@pytest.mark.serial
def test_many_runs_are_single_runs() -> None:
    """Two strengths of the motion, marched together."""
    problem = block(0.0, joint=None, friction=vc.Coulomb(0.7))
    motions = [vc.Harmonic(size, 3.0) for size in (1.0, 3.0)]
    problems = [replace(problem, excitation=motion) for motion in motions]
    rest = vc.static_equilibrium(problem)
    settings = {"dt": DT, "steps": 20, "state": rest, "progress": False}
    runs = [{"problem": one, **settings} for one in problems]
    for number, run in vc.simulate_many(runs):
        assert max(distance(march(problems[number], 20), run).values()) < 1e-10


@pytest.mark.serial
def test_waves_without_mass_are_refused() -> None:
    """Speeds would be infinite: boundary elements and columns of soil say so."""
    stone = vc.LinearElastic(E=1e9, nu=0.2, rho=0.0)
    sand = vc.LinearElastic(E=1e8, nu=0.3, rho=1900.0)
    curves = soil.SoilCurves.seed_idriss()
    record = ground_motion.Record(np.ones(50), 0.01)
    square = bem.polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 2)
    calls: list[Any] = [
        lambda: soil.equivalent_linear([(5.0, stone, curves)], record, rock=sand),
        lambda: soil.equivalent_linear([(5.0, sand, curves)], record, rock=stone),
        lambda: bem.energetic_blocks(square, stone, dt=1e-4, steps=2),
    ]
    for call in calls:
        with pytest.raises(InputError, match="has rho = 0, and no wave runs without mass"):
            call()
