"""Water in the joint of a dam: closed forms of the crack, ledgers, restarts, ranks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.laws.joints_by_part import JointsByPart
from vi_contact.meshes import BlockMesh

GAMMA = 9810.0  # N/m³
WEIGHT = 24000.0  # N/m³ of the block
HEIGHT, WIDTH = 40.0, 24.0
WATER = laws.JointWater(heel=(0.0, 0.0), toe=(WIDTH, 0.0), level=HEIGHT, gamma=GAMMA)


def rigid(comm: Any, cells: int, water: Any, level: float = HEIGHT) -> vc.ContactProblem:
    """A rigid block on springs, without friction, with a reservoir on its left."""
    import dolfinx

    shape = dolfinx.mesh.CellType.quadrilateral
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [WIDTH, HEIGHT]], [cells, 20], shape)
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    loads = [
        fem.BodyForce((0.0, -WEIGHT)),
        fem.Pressure(face, lambda x, t: GAMMA * np.maximum(level - x[:, 1], 0.0)),
    ]
    stone = vc.LinearElastic(E=1e14, nu=0.2, rho=WEIGHT / 9.81)
    held = fem.Prescribed(base, components=(0,))
    system = fem.assemble(mesh, stone, prescribed=held, loads=loads)
    surface = fem.contact_surface(system, base).on_springs(1e9)
    return vc.ContactProblem(system, surface, joint=laws.Joint(water=water))


def read(problem: vc.ContactProblem, state: vc.State) -> dict[str, Any]:
    """The row of the recorder."""
    return vc.Uplift().start(problem, state)


@pytest.mark.long
def test_the_crack_is_that_of_the_usual_rule(comm: Any) -> None:
    """c = 3 (M_toe - p B²/2)/(W - p B) uncracked; order 2 in the cells."""
    p = GAMMA * HEIGHT
    W = WEIGHT * WIDTH * HEIGHT
    moment = W * WIDTH / 2.0 - GAMMA * HEIGHT**3 / 6.0
    exact = WIDTH - 3.0 * (moment - p * WIDTH**2 / 2.0) / (W - p * WIDTH)
    assert exact == pytest.approx(11.04439746, abs=1e-8)
    cracks = {}
    for cells in (24, 48):
        problem = rigid(comm, cells, WATER)
        state = vc.static_equilibrium(problem)
        assert state.certificate < 1e-8
        row = read(problem, state)
        cracks[cells] = row["crack_length"]
        # equilibrium: what the joint carries in all is the weight
        whole = row["uplift_force"] + row["uplift_effective"]
        assert whole == pytest.approx(W, rel=1e-9)
    errors = [exact - cracks[cells] for cells in (24, 48)]
    assert errors[1] == pytest.approx(0.0, abs=0.06)
    assert errors[0] > 2.5 * errors[1] > 0.0


def test_water_that_does_not_follow_cracks_less(comm: Any) -> None:
    """Linear from heel to toe whatever opens: uplift p B/2 exactly; drains."""
    p = GAMMA * HEIGHT
    problem = rigid(comm, 24, replace(WATER, follows=False))
    row = read(problem, vc.static_equilibrium(problem))
    assert row["uplift_force"] == pytest.approx(p * WIDTH / 2.0, rel=1e-12)
    assert 0.0 < row["crack_length"] < 9.0

    # level 18, drain 8 and tail 3 over 4 and 12 m, as dam A of the entry dams_by_hand has them
    drained = replace(WATER, toe=(16.0, 0.0), level=18.0, tail=3.0, drain=4.0)
    heads = drained.find_head(np.array([0.0, 0.125, 0.25, 1.0]), 0.0)
    assert heads == pytest.approx([18.0, 13.0, 8.0, 3.0], rel=1e-14)
    # a crack up to the drains; beyond them
    assert drained.find_head(np.array([0.1, 0.25]), 0.2) == pytest.approx([18.0, 8.0])
    assert drained.find_head(np.array([0.25, 0.75, 1.0]), 0.5) == pytest.approx([18.0, 10.5, 3.0])


def test_water_that_lifts_the_block_says_uplift(comm: Any) -> None:
    """A level at which no part of the base stays closed."""
    problem = rigid(comm, 12, replace(WATER, level=1.6 * HEIGHT))
    with pytest.raises(StepFailure, match="uplift: the water follows"):
        vc.static_equilibrium(problem)


@pytest.mark.parametrize("factor", [-0.5, math.nan, math.inf])
def test_a_factor_that_no_water_has_is_refused(comm: Any, factor: float) -> None:
    """A negative one would hold the joint together, without a word."""
    problem = rigid(comm, 12, replace(WATER, history=lambda t: factor))
    with pytest.raises(InputError, match="JointWater: history is .* return a factor of 0 or more"):
        vc.static_equilibrium(problem)


class LostByOpening(laws.Joint):
    """Lose the cohesion with the opening alone, as the independent program does."""

    def _make_beta(self, count: int) -> Any:
        return np.zeros(count)


def dam(
    comm: Any, water: Any, law: Any = laws.Joint, cells: tuple[int, int] = (17, 20)
) -> vc.ContactProblem:
    """An elastic block with a joint that loses its strength under water that rises."""
    import dolfinx

    shape = dolfinx.mesh.CellType.quadrilateral
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [17.0, 40.0]], cells, shape)
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    loads = [
        fem.BodyForce((0.0, -WEIGHT)),
        fem.Pressure(face, lambda x, t: GAMMA * np.maximum(32.0 - x[:, 1], 0.0), history=grow),
    ]
    stone = vc.LinearElastic(E=2e10, nu=0.2, rho=WEIGHT / 9.81)
    damping = vc.Rayleigh(alpha=0.0, beta=2e-3)
    system = fem.assemble(mesh, stone, loads=loads, damping=damping)
    surface = fem.contact_surface(system, base)
    joint = law(mu=1.5, cohesion=3e5, tension=1e5, opening=2e-4, water=water)
    return vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())


def grow(t: float) -> float:
    s = min(t / 0.6, 1.0)
    return 3.0 * s**2 - 2.0 * s**3


RISING = laws.JointWater(
    heel=(0.0, 0.0),
    toe=(17.0, 0.0),
    level=32.0,
    gamma=GAMMA,
    quake="follows",
    opening=2e-5,
    history=grow,
)


def march(problem: vc.ContactProblem, **others: Any) -> Any:
    settings: dict[str, Any] = {
        "dt": 8e-3,
        "t_end": 0.8,
        "scheme": vc.ZienkiewiczWoodTaylor(),
        "solver": vc.Condensed(),
        "record": [vc.Energy(), vc.Contact(), vc.JointEnergy(), vc.Uplift()],
        "progress": False,
    }
    return vc.simulate(problem, **(settings | others))


@pytest.mark.long
def test_water_in_time_closes_the_ledger_on_all_ranks(comm: Any) -> None:
    """Water rises and enters what opens: certified, its work booked; ranks alike."""
    problem = dam(comm, RISING)
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    history = march(problem, state=rest).history
    assert history["certificate"].max() < 1e-9
    assert np.abs(history["energy_defect"]).max() < 1e-9 * history["work_input"].max()
    assert history["work_joint_water"][-1] > 1.0
    assert history["crack_length"][-1] > 1.0
    losses = ("loss_fracture", "loss_rubbing", "loss_closing", "loss_dilatancy")
    parts = history["energy_joint"] - history["energy_joint"][0] - history["work_joint_water"]
    parts = parts + sum(history[name] for name in losses)
    both = history["loss_contact"] + history["loss_friction"]
    assert np.abs(parts - both).max() < 1e-6 * np.abs(both).max()

    alone = dam(MPI.COMM_SELF, RISING)
    one = march(alone, state=vc.static_equilibrium(alone, tolerance=1e-7)).history
    for name in ("uplift_force", "crack_length"):
        assert np.abs(history[name] - one[name]).max() < 1e-8 * np.abs(one[name]).max()


@pytest.mark.long
@pytest.mark.serial
def test_the_uplift_of_a_dam_that_cracks(comm: Any) -> None:
    """3234.0 kN/m within 1e-3, of an independent program with the water in the loop (2 ms)."""
    slow = lambda t: grow(0.6 * t)  # noqa: E731  # in one second, as that program has it
    problem = dam(comm, replace(RISING, history=slow), LostByOpening, (34, 40))
    load = problem.system.load
    system = problem.system.loaded(replace(load, separable=((load.separable[0][0], slow),)))
    problem = replace(problem, system=system)
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    history = march(problem, state=rest, dt=4e-3, t_end=2.0, record=[vc.Uplift()]).history
    assert history["uplift_force"][-1] == pytest.approx(3234.0e3, rel=1e-3)
    assert history["certificate"].max() < 1e-9


@pytest.mark.long
@pytest.mark.parametrize("quake", ["follows", "none"])
def test_a_restart_is_the_straight_run(comm: Any, shared_tmp: Any, quake: str) -> None:
    """The pressures of the last rest and of the last step are stored."""
    problem = dam(comm, replace(RISING, quake=quake))
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    straight = march(problem, state=rest).history
    march(problem, state=rest, out=shared_tmp, t_end=0.56)
    again = march(problem, out=shared_tmp, restart=True).history
    for name in ("uplift_force", "work_joint_water", "crack_length"):
        scale = np.abs(straight[name]).max()
        assert again[name][-1] == pytest.approx(straight[name][-1], abs=1e-10 * scale)


@pytest.mark.long
@pytest.mark.serial  # ranks: the restart has both
def test_an_earthquake_keeps_water_or_none(comm: Any) -> None:
    """kept: p B/2 all the time; none: nothing in what has opened, so less."""
    uplift = {}
    for quake in ("kept", "none"):
        problem = dam(comm, replace(RISING, quake=quake, opening=0.0, history=None, level=20.0))
        rest = vc.static_equilibrium(problem, tolerance=1e-7)
        history = march(problem, state=rest).history
        assert history["uplift_force"][0] == pytest.approx(GAMMA * 20.0 * 17.0 / 2.0, rel=1e-12)
        uplift[quake] = history["uplift_force"][-1] / history["uplift_force"][0]
        assert history["crack_length"][-1] > 1.0
    assert uplift["kept"] == pytest.approx(1.0, rel=1e-12)
    assert 0.5 < uplift["none"] < 0.95


def test_parts_may_have_water_of_their_own(comm: Any) -> None:
    """The joint of one part of two is that of the whole."""
    problem = rigid(comm, 12, WATER)
    whole = read(problem, vc.static_equilibrium(problem))
    part = np.zeros(problem.surface.total, dtype=int)
    both = JointsByPart({"wet": laws.Joint(water=WATER), "dry": laws.Joint()}, part)
    parted = replace(problem, joint=both)
    row = read(parted, vc.static_equilibrium(parted))
    for name in ("uplift_force", "crack_length"):
        assert row[name] == pytest.approx(whole[name], rel=1e-12)


@pytest.mark.serial
def test_bad_water_is_refused_in_one_sentence(comm: Any) -> None:
    """Every number that is wrong, by name and with a remedy."""
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"level": float("nan")}, "the level"),
        ({"level": -1.0}, "below the heel"),
        ({"tail": 50.0}, "exchange heel and toe"),
        ({"drain": 24.0}, "between heel and toe"),
        ({"drain": 0.0}, "the drain"),
        ({"efficiency": 1.5}, "efficiency"),
        ({"quake": "some"}, "'kept' or 'follows' or 'none'"),
        ({"toe": (0.0, 0.0)}, "no two ends of a joint"),
        ({"opening": -1e-3}, "the opening"),
    ]
    for changes, words in wrong:
        with pytest.raises(InputError, match=words):
            replace(WATER, **changes)
    with pytest.raises(InputError, match="implicit=False"):
        laws.Joint(water=WATER, implicit=False)
    for ends in ({"heel": (-99.0, 0.0)}, {"toe": (9.0, 0.0)}):
        with pytest.raises(InputError, match="are not the ends of the joint, whose points"):
            rigid(comm, 4, replace(WATER, **ends))
    with pytest.raises(InputError, match="3 coordinates"):
        rigid(comm, 4, laws.JointWater(heel=(0.0,) * 3, toe=(1.0, 0.0, 0.0), level=1.0))


def shaken(comm: Any) -> vc.ContactProblem:
    """A dam 30 m high whose heel has opened and shut, so that a point there reopens by microns."""
    block = BlockMesh(lengths=(21.0, 30.0), divisions=(14, 14), deform=taper)
    mesh, tags = fem.build_mesh(block, comm)
    reservoir = fem.Reservoir(face=tags["left"], level=26.0, model="incompressible")
    concrete = vc.LinearElastic(E=25e9, nu=0.2, rho=2400.0)
    damping = vc.Rayleigh(alpha=0.0, beta=2e-3)
    system = laws.with_weight(fem.assemble(mesh, concrete, damping=damping, reservoir=reservoir))
    rock = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=rock)
    water = laws.JointWater(heel=(0.0, 0.0), toe=(21.0, 0.0), level=26.0, opening=2e-5)
    joint = laws.Joint(mu=0.8, cohesion=6e5, tension=2e5, energy=200.0, water=water)
    return vc.ContactProblem(
        system,
        surface,
        joint=joint,
        mass=vc.ConsistentMass(),
        excitation=vc.Harmonic(amplitude=2.4, frequency=4.0, direction=(1.0, 0.0)),
    )


def taper(points: Any) -> Any:
    width = 21.0 - 17.0 * points[:, 1] / 30.0
    return np.column_stack([points[:, 0] * width / 21.0, points[:, 1]])


@pytest.mark.long
@pytest.mark.two_ranks
def test_a_dam_goes_on_where_its_tension_is_steep(comm: Any) -> None:
    """Step 107 needs the tension on springs. All steps are certified with their strength, the
    ledger closes to 2e-13, and ranks are alike. The crack is 6.4 m long, of a base of 21 m."""
    runs = []
    for ranks in (comm, MPI.COMM_SELF):
        problem = shaken(ranks)
        rest = vc.static_equilibrium(problem)
        run = march(problem, state=rest, dt=2e-3, t_end=0.26)
        assert run.history["certificate"].max() < 1e-9
        defect = np.abs(run.history["energy_defect"]).max()
        assert defect < 1e-11 * np.abs(run.history["work_input"]).max()
        runs.append(run.history)
    ours, alone = runs
    assert alone["crack_length"].max() > 4.0
    for name in ("uplift_force", "crack_length", "loss_fracture"):
        assert np.abs(ours[name] - alone[name]).max() < 1e-8 * np.abs(alone[name]).max(), name
