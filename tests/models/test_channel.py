"""The buried channel: mesh, points, contact conditions, records, runs (numbers:
validation/test_buried_channel.py)."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from channel_runs import CHANNEL, DT, FRICTION, SCHEME, follow, model
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.channel import BODIES, REFERENCE, Channel, SoilProbe, build, staged
from demos.parts.problems.channel_sides import (
    DashpotSides,
    Fixed,
    FreeFieldSides,
    Rollers,
    TiedSides,
    bedrock,
)
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.units import STANDARD_GRAVITY
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.meshes.extract import arrays_from_script
from vi_contact.practice.cli.entry import main
from vi_contact.practice.engineering import contact_summary
from vi_contact.practice.ground_motion import Record, read_record
from vi_contact.practice.studies.cases.case import read_case
from vi_contact.practice.studies.cases.library import locate
from vi_contact.practice.studies.cases.short_settings import ShortOptions
from vi_contact.practice.studies.cases.table_calls import build as build_call
from vi_contact.practice.studies.cases.toml_file import read_toml

COMM = MPI.COMM_WORLD
serial = pytest.mark.serial
WEIGHT = 2400.0 * STANDARD_GRAVITY * (4.0 * 0.5 + 2 * 2.5 * 0.5)  # of a metre of channel [N]
MESHES = {
    "V4.2": ChannelMesh(),
    "triangles": ChannelMesh(triangles=True),
    "to one side": ChannelMesh(left=6.0, size=0.4),
    "irregular": ChannelMesh(size=0.25, far=1.0),
}
meshes = pytest.mark.parametrize("name", MESHES)


def polygon_area(points, cells):
    x, y = points[cells].T
    return np.abs(0.5 * (x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum(axis=0))


# Mesh
# --------------------------------------------------------------------------------------------------


@pytest.mark.long
@serial
@meshes
def test_two_bodies_divided_alike(name):
    """Areas of both bodies; interface nodes at the same places, none in common; boundaries where
    their names say."""
    mesh = MESHES[name]
    arrays = arrays_from_script(mesh)
    points, groups = arrays.points, arrays.facet_groups
    area = polygon_area(points, arrays.cells)
    assert area[arrays.cell_groups["channel"]].sum() == pytest.approx(4.5, rel=1e-9)
    assert area[arrays.cell_groups["soil"]].sum() == pytest.approx(24.0 * 8.0 - 12.0, rel=1e-9)
    assert np.all(arrays.cell_groups["channel"] != arrays.cell_groups["soil"])
    channel, soil = (np.unique(arrays.cells[arrays.cell_groups[body]]) for body in BODIES)
    assert channel.min() < soil.min()  # so that the channel is the first body
    for side in ("left", "base", "right"):
        one, two = (np.unique(groups[f"{body}_{side}"]) for body in BODIES)
        assert np.isin(one, channel).all() and np.isin(two, soil).all()
        one, two = (nodes[np.lexsort(np.round(points[nodes], 6).T)] for nodes in (one, two))
        # probes find the channel's
        assert np.abs(points[one] - points[two]).max() < 1e-9 and np.all(one < two)
    x, y, left = points[:, 0], points[:, 1], mesh.x[1]
    where = {
        "bedrock": np.isclose(y, 0.0),
        "surface": np.isclose(y, 8.0),
        "left_side": np.isclose(x, 0.0),
        "right_side": np.isclose(x, 24.0),
        "channel_top": np.isclose(y, 8.0),
        "soil_left": np.isclose(x, left),
        "soil_right": np.isclose(x, left + 4.0),
        "soil_base": np.isclose(y, 5.0),
        "channel_inside": (x > left + 0.49) & (x < left + 3.51) & (y > 5.49),
    }
    for group, mask in where.items():
        assert mask[groups[group]].all(), group
    length = {
        group: np.linalg.norm(np.diff(points[groups[group]], axis=1), axis=2).sum()
        for group in where
    }
    assert length["bedrock"] == pytest.approx(24.0) and length["surface"] == pytest.approx(20.0)
    assert length["channel_inside"] == pytest.approx(8.0) and length[
        "channel_top"
    ] == pytest.approx(1.0)


@serial
@pytest.mark.parametrize("triangles", [False, True])
def test_the_mesh_of_a_symmetric_layer_is_symmetric(triangles):
    arrays = arrays_from_script(ChannelMesh(triangles=triangles))
    centres = arrays.points[arrays.cells].mean(axis=1)
    image = np.column_stack([24.0 - centres[:, 0], centres[:, 1]])
    assert np.array_equal(*(np.unique(np.round(places, 6), axis=0) for places in (centres, image)))


@serial
@pytest.mark.parametrize(
    "wrong, sentence",
    [
        ({"wall": 2.0}, "does not fit a layer 8.0 m deep"),
        ({"height": 8.0}, "soil below it"),
        ({"left": 20.0}, "needs soil on both sides"),
        ({"size": 0.0}, "size is 0.0; give a finite number above zero"),
        ({"size": 0.5, "far": 0.25}, "at least the cell size at the channel, 0.5 m"),
        ({"depth": float("nan")}, "depth is nan; give a finite"),
    ],
)
def test_no_such_mesh(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ChannelMesh(**wrong)


# Model
# --------------------------------------------------------------------------------------------------


@serial
def test_nineteen_points():
    """CHOSEN: 1 and 7 bottom corners, 13 and 19 tops of the right and the left wall, even
    distances."""
    points = np.array([CHANNEL.point(number) for number in range(1, 20)])
    assert [CHANNEL.point(n) for n in (1, 7, 13, 19)] == [
        (10.0, 5.0),
        (14.0, 5.0),
        (14.0, 8.0),
        (10.0, 8.0),
    ]
    assert np.linalg.norm(np.diff(points[:13], axis=0), axis=1) == pytest.approx(
        [4.0 / 6] * 6 + [0.5] * 6
    )
    assert points[13:, 1] == pytest.approx(np.arange(5.5, 8.1, 0.5)) and np.all(
        points[13:, 0] == 10.0
    )
    with pytest.raises(InputError, match="points 1 to 19, there is no point 20"):
        CHANNEL.point(20)


def test_twenty_three_conditions():
    """V4.2: 9 + 7 + 7; the corners carry both normals; the sides are 3 + 4 + 3 m long."""
    one = model()
    surface, sides = one.surface.whole(), one.sides
    assert surface.count == 23 and [int(mask.sum()) for mask in sides.values()] == [9, 7, 7]
    assert list(sides) == ["base", "left", "right"] and not surface.gap0.any()
    for corner, normal in (((10.0, 5.0), (-1.0, 0.0)), ((14.0, 5.0), (1.0, 0.0))):
        here = np.abs(surface.points - corner).max(axis=1) < 1e-9
        assert sorted(map(tuple, surface.normals[here])) == sorted([normal, (0.0, -1.0)])
    for side, length in (("left", 3.0), ("base", 4.0), ("right", 3.0)):
        assert surface.weights[sides[side]].sum() == pytest.approx(length)


@pytest.mark.serial
@pytest.mark.parametrize(
    "sides",
    [
        TiedSides(),
        *(pytest.param(one, marks=serial) for one in (Rollers(), Rollers(component=0), Fixed())),
    ],
    ids=str,
)
def test_weight_rests_on_the_base(sides):
    """Smooth walls: the base carries the channel's weight, the walls push against each other;
    certified."""
    one = build(CHANNEL, COMM, sides=sides)
    start = vc.static_equilibrium(one.problem(), solver=vc.Condensed())
    r_n = one.surface.everywhere(start.r_n)
    push = {side: r_n[mask].sum() for side, mask in one.sides.items()}
    assert push["base"] == pytest.approx(WEIGHT, rel=1e-9)
    assert push["left"] == pytest.approx(push["right"], rel=1e-8) and push["left"] > 0.0


@pytest.mark.slow
@serial
def test_who_weighs():
    """The load is the weight of the bodies asked for; a body that does not exist is refused."""
    up = {}
    for weighing in ((), ("channel",), ("soil",), ("channel", "soil")):
        system = build(CHANNEL, COMM, weighing=weighing, sides=Rollers(component=0)).system
        up[weighing] = COMM.allreduce(float(system.influence[:, 1] @ system.load(0.0)))
    # half of the lowest row of cells rests on the bedrock
    lowest = 0.5 * 0.5 * 1800.0 * STANDARD_GRAVITY * 24.0
    soil = -1800.0 * STANDARD_GRAVITY * (24.0 * 8.0 - 12.0) + lowest
    assert up[()] == 0.0 and up[("channel",)] == pytest.approx(-WEIGHT, rel=1e-12)
    assert up[("soil",)] == pytest.approx(soil, rel=1e-12)
    assert up["channel", "soil"] == pytest.approx(soil - WEIGHT, rel=1e-12)
    with pytest.raises(InputError, match="unknown body 'water': channel and soil may have weight"):
        build(CHANNEL, COMM, weighing=("water",))


def test_bodies_of_a_cell_group():
    """Numbers of whole bodies, the same on every rank; a group that shares nodes with other cells
    is none."""
    one = model()
    assert [fem.bodies_of(one.system, one.tags[name]) for name in BODIES] == [(0,), (1,)]
    whole = fem.Cells.where("all", one.mesh, lambda x: np.isfinite(x[0]))
    half = fem.Cells.where("half", one.mesh, lambda x: x[0] < 12.1)
    assert fem.bodies_of(one.system, whole) == (0, 1)
    with pytest.raises(
        InputError,
        match="the cell group 'half' is a part of a body .* give a group of whole bodies",
    ):
        fem.bodies_of(one.system, half)


def test_defaults_of_a_problem():
    """V4.2: a_g = 2 sin(2 pi 2 t), dt = 1/80 s, the inelastic rule as an M-orthogonal impulse on
    consistent mass."""
    problem = model().problem()
    assert problem.excitation == vc.Harmonic(2.0, 2.0, direction=(1.0, 0.0)) and DT == 1.0 / 80.0
    assert (
        isinstance(problem.impact.update, vc.ImpulseUpdate) and problem.mass == vc.ConsistentMass()
    )
    assert not problem.frictional and not problem.surface.bilateral.any()
    other = model().problem(bilateral=True, friction=FRICTION, impact=None, excitation=())
    assert (
        other.mass is None
        and other.surface.bilateral.all()
        and other.frictional
        and other.excitations == ()
    )


@pytest.mark.serial
def test_records_of_both_sides():
    """Channel minus soil at a point is its opening along the normal; the openings of the sides are
    their largest."""
    one = model()
    history = follow(one, one.problem(friction=FRICTION), 12).history
    size = max(np.abs(history[name]).max() for name in ("u_x_1", "u_x_19"))
    gap, points = np.asarray(history["gap"]), one.surface.whole().points
    for label, side, axis, sign in (
        ("19", "left", "x", 1),
        ("13", "right", "x", -1),
        ("4", "base", "y", 1),
    ):
        here = (np.abs(points - CHANNEL.point(int(label))).max(axis=1) < 1e-9) & one.sides[side]
        apart = sign * (history[f"u_{axis}_{label}"] - history[f"u_{axis}_{label}_soil"])
        assert np.abs(apart - gap[:, here][:, 0]).max() < 1e-13 * size
    for side, mask in one.sides.items():
        assert np.abs(history[f"opening_{side}"] - gap[:, mask].max(axis=1)).max() < 1e-15 * size
    assert max(history["opening_left"].max(), history["opening_right"].max()) > 0.01 * size
    for surface in (one.surface, one.surface.whole()):
        force = contact_summary(history, surface, centre=(12.0, 5.0), normal=(0.0, -1.0))["force_y"]
        recorded = history["contact_force_y"] + history["friction_force_y"]
        assert np.abs(force - recorded).max() < 1e-12 * np.abs(recorded).max()
    with pytest.raises(InputError, match="not at the interface"):
        SoilProbe({"far": (0.0, 4.0)}).start(
            one.problem(), vc.static_equilibrium(one.problem(), solver=vc.Condensed())
        )


@pytest.mark.long
@pytest.mark.parametrize("friction", [None, FRICTION], ids=["sliding", "rubbing"])
def test_any_number_of_ranks(friction):
    """The same run on all ranks together and on each alone, to 1e-10 of the largest displacement
    and pressure."""
    runs = []
    for alone in (False, True):
        one = model(alone=alone)
        runs.append(follow(one, one.problem(friction=friction), 20).history)
    together, single = runs
    for names in ([n for n in single if n.startswith("u_")], ["pressure"]):
        size = max(np.abs(np.asarray(single[name])).max() for name in names)
        for name in names:
            assert (
                np.abs(np.asarray(together[name]) - np.asarray(single[name])).max() < 1e-10 * size
            ), name


@pytest.mark.slow
@serial
@pytest.mark.parametrize("name", ["triangles", "to one side", "irregular"])
def test_other_meshes(name):
    """Certified, with a closed ledger; the settlement is that of V4.2 to 10 %."""
    one = build(Channel(MESHES[name]), COMM)
    solution = follow(one, one.problem(), 20)
    assert solution.facts["worst_certificate"] < 1e-9 and solution.facts["energy_defect"] < 1e-10
    settlement = follow(model(), model().problem(), 1).history["u_y_4"][0]
    assert solution.history["u_y_4"][0] == pytest.approx(settlement, rel=0.1)


# Runs
# --------------------------------------------------------------------------------------------------


@pytest.mark.serial
@pytest.mark.slow
def test_the_command(shared_tmp, capsys):
    """vi-contact run channel: histories and fields in the folder, the summary on rank 0."""
    damping = '{type="Rayleigh.from_frequencies", f1=1, f2=10, xi1=0.05, xi2=0.05}'
    options = ["friction.type=Coulomb", "friction.mu=0.4", f"system.damping={damping}"]
    command = [
        "run",
        "channel",
        *(word for one in options for word in ("--set", one)),
        "--steps",
        "10",
        "--quiet",
    ]
    assert main([*command, "--out", str(shared_tmp)]) == 0
    text = capsys.readouterr().out
    assert (text.startswith("A channel buried in soil") and str(shared_tmp) in text) == (
        COMM.rank == 0
    )
    assert {"history.csv", "history.h5", "fields.xdmf", "case.toml"} <= {
        path.name for path in shared_tmp.iterdir()
    }
    table = np.genfromtxt(shared_tmp / "history.csv", delimiter=",", names=True)
    one = build(Channel(damping=vc.Rayleigh.from_frequencies(1.0, 10.0, xi1=0.05, xi2=0.05)), COMM)
    straight = follow(one, one.problem(friction=FRICTION), 10).history
    assert (
        np.abs(table["u_x_19"] - straight["u_x_19"]).max() < 1e-9 * np.abs(straight["u_x_19"]).max()
    )
    # the same columns of soil and openings as the model's own recorders have
    for name in ("u_x_19_soil", "u_y_4_soil", "opening_left", "opening_right", "opening_base"):
        assert table[name] == pytest.approx(straight[name], abs=1e-9 * np.abs(straight[name]).max())


@pytest.mark.serial
def test_the_case_that_ships_is_the_channel_of_the_figures():
    """Shape, materials, points, harmonic and time step are those of the model, its reference that
    of the catalogue."""
    case = built_in()
    assert case.excitations() == (CHANNEL.harmonic(),)
    assert build_call(case.nodes["run"], {}) == {"dt": CHANNEL.time_step(), "steps": 400}
    assert build_call(case.nodes["mesh"], {}) == CHANNEL.shape
    assert build_call(case.nodes["material"], {}) == {
        "channel": CHANNEL.concrete,
        "soil": CHANNEL.soil,
    }
    assert build_call(case.nodes["system"].arguments["damping"], {}) == CHANNEL.damping
    assert build_call(case.nodes["record"][2], {}).points == CHANNEL.probes()
    assert build_call(case.nodes["escalation"], {})[0] == REFERENCE
    impact = build_call(case.nodes["impact"], {})
    assert isinstance(impact, vc.Inelastic) and isinstance(impact.update, vc.ImpulseUpdate)


def built_in(*given, **short):
    """The channel that ships with the package."""
    path = locate("channel")
    return read_case(path, ShortOptions(**short).settings(read_toml(path), given))


def on_base(base, ends, shaking, *, dt, steps, weighing=BODIES, rock=None, hht=False):
    """(problem, history) on this base, from rest under the weight of these bodies; released where
    ends hold none."""
    bottom = bedrock(base, shaking, dt=dt, rock=rock)
    sides = FreeFieldSides(bottom or shaking) if ends is FreeFieldSides else ends()
    one, firm = staged(CHANNEL, COMM, sides=sides, weighing=weighing, base=bottom)
    rule = {"impact": None} if hht else {}
    problem = one.problem(excitation=shaking if bottom is None else (), **rule)
    static = problem if firm is None else firm.problem(excitation=(), **rule)
    start = vc.static_equilibrium(static, solver=vc.Condensed())
    problem, start = (problem, start) if firm is None else fem.release(static, start, problem)
    solution = vc.simulate(
        problem,
        scheme=vc.HHT() if hht else SCHEME,
        solver=vc.Condensed(),
        dt=dt,
        steps=steps,
        state=start,
        record=one.recorders(),
        progress=False,
    )
    return problem, solution.history


@pytest.mark.long
@serial
@pytest.mark.parametrize(
    "ends, hht", [(TiedSides, True), (FreeFieldSides, False), (DashpotSides, False)]
)
def test_a_moved_bedrock(ends, hht):
    """Base "prescribed": the same contact forces, with records in both directions, whatever the
    sides."""
    record = Record(np.sin(20.0 * 0.01 * np.arange(31)), 0.01)
    shaking = tuple(vc.GroundMotion(record, direction=way) for way in ((1.0, 0.0), (0.0, 1.0)))
    found = []
    for base in ("relative", "prescribed"):
        problem, history = on_base(base, ends, shaking, dt=0.01, steps=20, hht=hht)
        assert len(problem.excitations) == (2 if base == "relative" else 0)
        assert problem.system.space.tied.any() == (ends is TiedSides)
        found.append(np.asarray(history["pressure"]))
    # these resist the velocity they see: another problem in another frame
    same_dashpots = ends is not DashpotSides
    assert (np.abs(found[0] - found[1]).max() < 1e-8 * found[0].max()) == same_dashpots
    assert np.abs(found[0] - found[0][0]).max() > 0.1 * found[0].max()


@pytest.mark.long
@serial
def test_a_vertical_record_ties_the_ends_of_the_case(tmp_path):
    """--motion H,V on the case that ships: rollers would hold what shakes upwards; one record
    leaves them alone."""
    record = tmp_path / "record.txt"
    record.write_text("".join(f"{0.01 * k:.2f} {np.sin(0.2 * k):.9e}\n" for k in range(31)))
    units = [f"excitation.{k}.record.units=m/s2" for k in (1, 2)]
    both = built_in(
        "fields=",
        "gravity.cells=",
        *units,
        motion=f"{record},{record}",
        dt=0.01,
        steps=20,
        scheme="HHT",
    )
    problem = both.problem(COMM)
    assert (
        len(problem.excitations) == 2 and problem.impact is None and problem.system.space.tied.any()
    )
    shaking = tuple(
        vc.GroundMotion(read_record(record, "m/s2"), direction=way)
        for way in ((1.0, 0.0), (0.0, 1.0))
    )
    _, expected = on_base("relative", TiedSides, shaking, dt=0.01, steps=20, hht=True)
    pressure = np.asarray(both.run(COMM, progress=False).history["pressure"])
    assert np.abs(pressure - expected["pressure"]).max() < 1e-10 * np.abs(pressure).max()
    assert not built_in(units[0], motion=f"{record}", dt=0.01).problem(COMM).system.space.tied.any()


@pytest.mark.long
@serial
@pytest.mark.parametrize("ends", [TiedSides, FreeFieldSides])
def test_waves_from_below(ends):
    """Base "compliant": at rest without waves, on what the released bedrock carried; with waves
    stiff rock brings nearly the motion of a rigid base, whose acceleration is that of the
    outcrop."""
    _, history = on_base("compliant", ends, (CHANNEL.harmonic(0.0),), dt=DT, steps=20)
    size = np.abs(history["u_y_1"]).max()
    assert max(np.ptp(history[name]) for name in ("u_x_1", "u_y_1", "u_x_13")) < 1e-10 * size
    opening = []
    for base, rock in (
        ("relative", None),
        ("compliant", vc.LinearElastic(E=2e14, nu=0.25, rho=2400.0)),
    ):
        _, history = on_base(
            base, ends, (CHANNEL.harmonic(),), dt=0.005, steps=40, weighing=("channel",), rock=rock
        )
        opening.append(history["opening_left"])
    assert np.abs(opening[1] - opening[0]).max() < 0.03 * opening[0].max()


@serial
def test_no_such_base():
    with pytest.raises(
        InputError, match="unknown base 'free': choose one of relative, prescribed, compliant"
    ):
        bedrock("free", (), dt=None)
    with pytest.raises(InputError, match="rock is what is under a compliant base"):
        bedrock("relative", (), dt=None, rock=CHANNEL.concrete)


@pytest.mark.serial
def test_at_rest_before_the_shaking():
    """Python's way to the same: ends that hold no static load come after the gravity stage, and
    stay at rest."""
    model, firm = staged(
        Channel(ChannelMesh(size=1.0)), COMM, sides=DashpotSides(), weighing=("channel",), base=None
    )
    static = firm.problem(excitation=())
    problem, start = fem.release(
        static, vc.static_equilibrium(static), model.problem(excitation=())
    )
    solution = vc.simulate(
        problem,
        scheme=SCHEME,
        dt=DT,
        steps=2,
        state=start,
        record=model.recorders(),
        progress=False,
    )
    size = np.abs(solution.history["u_y_1"]).max()
    assert (
        size > 0.0
        and max(np.ptp(solution.history[name]) for name in ("u_x_1", "u_y_1")) < 1e-10 * size
    )


@serial
@pytest.mark.parametrize(
    "wrong, sentence",
    [
        ("friction.mu=0.3", r"\[friction\] has no type"),
        ("friction.type=Coulomb", "lacks the key 'mu', which Coulomb needs"),
        ("gravity.cells=moon", r"\[gravity\] cells is 'moon', but the mesh has no group 'moon'"),
        ("gravity.cells=bedrock", "a boundary group: give the name of a cell group"),
        ("mesh.wide=3", "unknown key 'wide' for ChannelMesh: did you mean width"),
        ("mesh.size=-1", "size is -1.0; give a finite number"),
    ],
)
def test_wrong_options(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        built_in(wrong).problem(COMM)


@serial
def test_the_case_held_and_on_another_mesh():
    """Keys of the mesh and of its contact: the linear comparison is that of the model."""
    coarse = build(Channel(ChannelMesh(size=1.0)), COMM)
    held = [f"contact.{k}.roller=true" for k in (1, 2, 3)]
    problem = built_in("mesh.size=1", *held).problem(COMM)
    assert (
        problem.system.space.unknowns
        == coarse.system.space.unknowns
        < model().system.space.unknowns
    )
    other = coarse.problem(bilateral=True).surface
    assert problem.surface.bilateral.all() and np.array_equal(problem.surface.gap0, other.gap0)
    assert np.array_equal(problem.surface.points, other.points)
