"""The wall model: numbering of its points, its cases, its meshes (numbers:
validation/test_shaken_wall.py)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import field, max_over_ranks
from mpi4py import MPI

from demos.parts.problems.wall import CASES, Wall, build
from vi_contact.core.errors import InputError
from vi_contact.core.units import STANDARD_GRAVITY
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import Elastic, Inelastic
from vi_contact.laws.materials import LinearElastic, Rayleigh
from vi_contact.practice.ground_motion import read_record
from vi_contact.practice.ground_motion.excitation import GroundMotion
from vi_contact.practice.studies.cases.case import Case, read_case
from vi_contact.practice.studies.cases.library import locate
from vi_contact.practice.studies.cases.short_settings import ShortOptions
from vi_contact.practice.studies.cases.toml_file import read_toml
from vi_contact.run.march import march
from vi_contact.run.modal import lowest_frequency
from vi_contact.run.simulate import simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

COMM = MPI.COMM_WORLD
COARSE = Wall(divisions=(4, 6))


def test_forty_points_around_the_boundary():
    """V4.2, anticlockwise, 0.75 m apart: 12 top right corner, 20 top left, 32 bottom left, 40
    bottom right."""
    wall = Wall()
    points = np.array([wall.point(number) for number in range(1, 41)])
    assert [wall.point(n) for n in (12, 20, 32, 40)] == [
        (6.0, 9.0),
        (0.0, 9.0),
        (0.0, 0.0),
        (6.0, 0.0),
    ]
    assert [wall.point(n) for n in (1, 4, 26)] == [(6.0, 0.75), (6.0, 3.0), (0.0, 4.5)]
    assert np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1) == pytest.approx(
        np.full(40, 0.75)
    )
    for number in (0, 41, -3):
        with pytest.raises(InputError, match=f"points 1 to 40 .*, there is no point {number}"):
            wall.point(number)


def test_every_point_is_a_node_of_the_mesh():
    model = build(Wall(), COMM)
    points = np.array([model.wall.point(number) for number in range(1, 41)])
    nodes, _ = field(model.system, model.system.u0)
    assert nodes[model.system.space.find_nodes(points)] == pytest.approx(points, abs=1e-12)
    assert len(nodes) == 9 * 13 and model.system.space.unknowns == 2 * 9 * 12
    assert set(model.probes()) == {"4", "6", "7", "10", "12", "26"}


@pytest.mark.serial
def test_mass_section_and_damping():
    """rho · width · height · d as the mass, thickness in the contact weights, damping handed on."""
    wall = Wall(divisions=(4, 6), thickness=0.5, damping=Rayleigh(alpha=0.2, beta=0.0))
    system = build(wall, COMM).system
    ones = system.influence[:, 0]
    # Mfree: the lowest row of elements keeps a third of its mass
    free = 1.0 - 1.5 / 9.0 * 2.0 / 3.0
    assert 2.0 * system.kinetic_energy(ones) == pytest.approx(
        2400.0 * 6.0 * 9.0 * 0.5 * free, rel=1e-12
    )
    assert max_over_ranks(COMM, system.C @ ones - 0.2 * (system.M @ ones)) < 1e-12 * max_over_ranks(
        COMM, system.C @ ones
    )
    assert build(wall, COMM).surface("face").whole().weights.sum() == pytest.approx(
        0.5 * (9.0 - 0.75), rel=1e-12
    )


@pytest.mark.parametrize("case", CASES)
def test_cases(case):
    """Contact points in the order of their numbers, along +x, no gap; held in the bilateral case,
    none when free."""
    model = build(Wall(), COMM)
    surface = model.surface(case).whole()
    expected = [model.wall.point(number) for number in CASES[case]]
    assert surface.count == len(expected) == {"a": 3, "b": 11, "bilateral": 11, "free": 0}[case]
    assert surface.points == pytest.approx(np.array(expected).reshape(-1, 2), abs=1e-12)
    assert (
        np.array_equal(surface.normals, np.tile([1.0, 0.0], (surface.count, 1)))
        and surface.basis is None
    )
    assert not surface.gap0.any() and np.all(surface.bilateral == (case == "bilateral"))


@pytest.mark.serial
def test_whole_face_and_unknown_case():
    model = build(Wall(), COMM)
    face = model.surface("face").whole()
    assert face.count == 12 and face.points[:, 1].min() == pytest.approx(0.75)
    with pytest.raises(InputError, match="unknown case 'c': choose one of a, b, bilateral, free"):
        model.surface("c")


def test_defaults_of_a_problem():
    """Harmonic at half the first frequency, a fortieth of its period as the time step, the seed's
    inelastic rule."""
    model = build(COARSE, COMM)
    problem = model.problem("face")
    f1 = lowest_frequency(model.system)
    assert problem.impact == Inelastic() and problem.excitation == Harmonic(1.0, 0.5 * f1)
    assert model.time_step() == 1.0 / (20.0 * f1)
    assert model.harmonic(2.5).amplitude == 2.5
    other = model.problem("free", excitation=(), impact=Elastic())
    assert other.excitations == () and other.impact == Elastic()


@pytest.mark.serial
@pytest.mark.parametrize(
    "wall",
    [Wall(triangles=True), Wall(size=0.9), Wall(size=0.9, triangles=True), Wall(divisions=(5, 7))],
)
def test_other_meshes_are_the_same_wall(wall):
    """First frequency within 3 % and the mean sag of the top under its weight within 0.5 %, on
    irregular meshes too."""
    model = build(wall, COMM, weight=True)
    f1 = lowest_frequency(build(Wall(), COMM).system)
    assert lowest_frequency(model.system) == pytest.approx(f1, rel=0.03)
    base = static_equilibrium(model.problem("free", excitation=()), solver=Condensed())
    points, u = field(model.system, base.u)
    top = u[np.isclose(points[:, 1], 9.0)][:, 1]
    # nu = 0: a column under its own weight
    sag = -2400.0 * STANDARD_GRAVITY * 9.0**2 / (2.0 * 2.0e10)
    assert top.mean() == pytest.approx(sag, rel=5e-3)


@pytest.mark.serial
def test_contact_points_need_nodes_near_them():
    """Eleven contact points on six elements are refused: one by one too far away, or two on one
    node."""
    with pytest.raises(
        InputError, match=r"contact point \(6, 2.25\) is 0.75 m away from boundary group 'face'"
    ):
        build(COARSE, COMM).surface("b")
    with pytest.raises(InputError, match="is listed twice"):
        build(Wall(divisions=(4, 9)), COMM).surface("b")


def test_the_ground_accelerates_the_whole_mass():
    """All that stands above the middle of the lowest row of elements hangs on the free nodes. The
    convention of the catalogue leaves out a sixth of that row more, 1.4 % of the force; it must be
    asked for by name."""
    whole, catalogue = (
        build(Wall(), COMM, **word).system for word in ({}, {"base_inertia": "catalogue"})
    )
    for column, direction in enumerate(np.eye(2)):
        force = [
            one.algebra.dot(one.influence[:, column], one.inertia(direction))
            for one in (whole, catalogue)
        ]
        assert force == pytest.approx(
            [2400.0 * 6.0 * 0.2 * height for height in (8.625, 8.5)], rel=1e-12
        )
    assert (
        "the whole mass" in whole.notes[0] and "convention of the catalogue" in catalogue.notes[0]
    )
    with pytest.raises(
        InputError, match="unknown base_inertia 'False': choose one of whole, catalogue"
    ):
        build(COARSE, COMM, base_inertia=False)


def built_in(*given: str, **short: Any) -> Case:
    """The wall that ships with the package."""
    path = locate("wall")
    return read_case(path, ShortOptions(**short).settings(read_toml(path), given))


def test_which_mass_a_run_shakes():
    """All of it under a record; under the harmonic of the figures what their reference numbers
    have; or as asked."""
    conventions = {
        True: (built_in(motion="f"), built_in(motion="f,g"), built_in("system.base_inertia=true")),
        False: (
            built_in(),
            built_in("contact.points="),
            built_in("system.base_inertia=false", motion="f"),
        ),
    }
    for word, cases in conventions.items():
        assert [case.tables["system"]["base_inertia"] for case in cases] == [word] * 3
    with pytest.raises(InputError, match=r"\[system\] base_inertia is 'half': give true or false"):
        built_in("system.base_inertia=half")


@pytest.mark.serial
def test_every_case_is_a_setting_of_the_one_that_ships():
    """Points, sides of the law and their number."""
    points = [list(Wall().point(number)) for number in CASES["a"]]
    settings = {
        "a": f"contact.points={points}",
        "face": "contact.points=",
        "bilateral": "contact.roller=true",
        "free": "contact=",
        "b": "impact.type=Inelastic",
    }
    model = build(Wall(), COMM)
    for case, setting in settings.items():
        found, expected = (
            one.whole() for one in (built_in(setting).problem(COMM).surface, model.surface(case))
        )
        assert np.array_equal(found.points, expected.points) and np.array_equal(
            found.normals, expected.normals
        )
        assert np.array_equal(found.bilateral, expected.bilateral)


@pytest.mark.parametrize("recorded", [True, False])
def test_records_shake_the_whole_mass(shared_tmp, recorded):
    """The run and the same problem assembled here; log and summary tell when it shakes less."""
    path, given, shaking, short = shared_tmp / "pulse.txt", [], None, {}
    if recorded:
        if COMM.rank == 0:
            path.write_text("0.00 0.0\n0.01 2.0\n0.02 0.0\n")
        COMM.Barrier()
        short, given = {"motion": str(path)}, ["excitation.1.record.units=m/s2"]
        shaking = GroundMotion(read_record(path, "m/s2"))
    case = built_in("contact.points=", "fields=", *given, dt=1e-3, steps=3, **short)
    found = case.run(COMM, out=shared_tmp / "run", progress=False)
    told, log = (
        "the convention of the catalogue",
        (shared_tmp / "run" / "run.log").read_text(encoding="utf-8"),
    )
    assert [told in one for one in found.facts["boundaries"]] == [True][recorded:] and (
        told in log
    ) is not recorded
    problem = build(Wall(), COMM, base_inertia="whole" if recorded else "catalogue").problem(
        "face", excitation=shaking
    )
    expected = simulate(problem, scheme=ZienkiewiczWoodTaylor(), dt=1e-3, steps=3, progress=False)
    off, size = (
        max_over_ranks(COMM, u) for u in (found.state.u - expected.state.u, expected.state.u)
    )
    assert off < 1e-10 * size  # the other mass makes 1e-2


@pytest.mark.serial
def test_the_case_that_ships_is_the_wall_of_the_figures():
    """Its harmonic, time step and number of steps are those of the model, to the last bit."""
    case, model = built_in(), build(Wall(), COMM, base_inertia="catalogue")
    assert case.excitations(system=model.system) == (model.harmonic(),)
    own = case.nodes["run"].build({"system": model.system})
    assert own == {"dt": model.time_step(), "steps": 400}


def test_gravity_stage_with_contact_then_shaking():
    """Poisson's ratio 0.2: the weight presses the wall against the ground; the run goes on from
    there, certified."""
    wall = Wall(divisions=(4, 6), material=LinearElastic(E=2.0e10, nu=0.2, rho=2400.0))
    model = build(wall, COMM, weight=True)
    problem = model.problem("face")
    start = static_equilibrium(problem, solver=Condensed())
    surface = problem.surface
    assert surface.some(start.r_n > 0.0) and not start.v.any() and start.t == 0.0
    assert surface.everywhere(surface.normal_values(start.u)).max() == 0.0
    quiet = model.problem("face", excitation=())
    dt = model.time_step()
    for state, _ in march(
        quiet, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=dt, steps=5, state=start
    ):
        assert max_over_ranks(COMM, state.u - start.u) < 1e-12 * max_over_ranks(COMM, start.u)
    seen = []
    scheme = ZienkiewiczWoodTaylor()
    for state, report in march(
        problem, scheme=scheme, solver=Condensed(), dt=dt, steps=30, state=start
    ):
        seen.append(COMM.allreduce(int(state.active.sum())))
        assert report.certificate.worst < 1e-12
    assert len(set(seen)) > 1
