"""The buried channel: mesh, points, contact conditions, records, runs (numbers: validation/test_buried_channel.py)."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from channel_runs import CHANNEL, DT, FRICTION, follow, model
from mpi4py import MPI

import vi_contact as vc
from vi_contact.cli.entry import main
from vi_contact.core.errors import InputError
from vi_contact.core.units import STANDARD_GRAVITY
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.meshes.extract import arrays_from_script
from vi_contact.models.channel.model import BODIES, Channel, build
from vi_contact.models.channel.points import SoilProbe
from vi_contact.models.channel.run import ChannelRun, prepared
from vi_contact.models.channel.sides import Fixed, Rollers, TiedSides
from vi_contact.models.choices import SCHEMES

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


# Mesh -----------------------------------------------------------------------------------------------------------------

@serial
@meshes
def test_two_bodies_divided_alike(name):
    """Areas of both bodies; interface nodes at the same places, none in common; boundaries where their names say."""
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
        assert np.abs(points[one] - points[two]).max() < 1e-9 and np.all(one < two)  # probes find the channel's
    x, y, left = points[:, 0], points[:, 1], mesh.x[1]
    where = {
        "bedrock": np.isclose(y, 0.0), "surface": np.isclose(y, 8.0), "left_side": np.isclose(x, 0.0),
        "right_side": np.isclose(x, 24.0), "channel_top": np.isclose(y, 8.0), "soil_left": np.isclose(x, left),
        "soil_right": np.isclose(x, left + 4.0), "soil_base": np.isclose(y, 5.0),
        "channel_inside": (x > left + 0.49) & (x < left + 3.51) & (y > 5.49),
    }
    for group, mask in where.items():
        assert mask[groups[group]].all(), group
    length = {group: np.linalg.norm(np.diff(points[groups[group]], axis=1), axis=2).sum() for group in where}
    assert length["bedrock"] == pytest.approx(24.0) and length["surface"] == pytest.approx(20.0)
    assert length["channel_inside"] == pytest.approx(8.0) and length["channel_top"] == pytest.approx(1.0)


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
        ({"height": 8.0}, "soil under it"),
        ({"left": 20.0}, "needs soil on both sides"),
        ({"size": 0.0}, "size is 0.0 m"),
        ({"size": 0.5, "far": 0.25}, "at least those at it, 0.5 m"),
        ({"depth": float("nan")}, "depth is nan m"),
    ],
)
def test_no_such_mesh(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ChannelMesh(**wrong)


# Model ----------------------------------------------------------------------------------------------------------------

@serial
def test_nineteen_points():
    """CHOSEN: 1 and 7 bottom corners, 13 and 19 tops of the right and the left wall, even distances."""
    points = np.array([CHANNEL.point(number) for number in range(1, 20)])
    assert [CHANNEL.point(n) for n in (1, 7, 13, 19)] == [(10.0, 5.0), (14.0, 5.0), (14.0, 8.0), (10.0, 8.0)]
    assert np.linalg.norm(np.diff(points[:13], axis=0), axis=1) == pytest.approx([4.0 / 6] * 6 + [0.5] * 6)
    assert points[13:, 1] == pytest.approx(np.arange(5.5, 8.1, 0.5)) and np.all(points[13:, 0] == 10.0)
    with pytest.raises(InputError, match="points 1 to 19, there is no point 20"):
        CHANNEL.point(20)


def test_twenty_three_conditions():
    """V4.2: 9 + 7 + 7; the corners carry both normals; the arc runs over 3 + 4 + 3 m."""
    one = model()
    surface, sides = one.surface, one.sides
    assert surface.count == 23 and [int(mask.sum()) for mask in sides.values()] == [9, 7, 7]
    assert list(sides) == ["base", "left", "right"] and not surface.gap0.any()
    for corner, normal in (((10.0, 5.0), (-1.0, 0.0)), ((14.0, 5.0), (1.0, 0.0))):
        here = np.abs(surface.points - corner).max(axis=1) < 1e-9
        assert sorted(map(tuple, surface.normals[here])) == sorted([normal, (0.0, -1.0)])
    assert one.arc[sides["left"]] == pytest.approx(8.0 - surface.points[sides["left"], 1])
    assert one.arc[sides["base"]] == pytest.approx(surface.points[sides["base"], 0] - 7.0)
    assert one.arc[sides["right"]] == pytest.approx(surface.points[sides["right"], 1] + 2.0)
    for side, length in (("left", 3.0), ("base", 4.0), ("right", 3.0)):
        assert surface.weights[sides[side]].sum() == pytest.approx(length)


@pytest.mark.parametrize("sides", [Rollers(), Rollers(component=0), TiedSides(), Fixed()], ids=str)
def test_weight_rests_on_the_base(sides):
    """Smooth walls: the base carries the channel's weight, the walls push against each other; certified."""
    one = build(CHANNEL, COMM, sides=sides)
    start = vc.static_equilibrium(one.problem(), solver=vc.Condensed())
    push = {side: start.r_n[mask].sum() for side, mask in one.sides.items()}
    assert push["base"] == pytest.approx(WEIGHT, rel=1e-9)
    assert push["left"] == pytest.approx(push["right"], rel=1e-8) and push["left"] > 0.0


def test_who_weighs():
    """The load is the weight of the bodies asked for; a body that does not exist is refused."""
    up = {}
    for weighing in ((), ("channel",), ("soil",), ("channel", "soil")):
        system = build(CHANNEL, COMM, weighing=weighing, sides=Rollers(component=0)).system
        up[weighing] = COMM.allreduce(float(system.influence[:, 1] @ system.load(0.0)))
    lowest = 0.5 * 0.5 * 1800.0 * STANDARD_GRAVITY * 24.0  # half of the lowest row of cells rests on the bedrock
    soil = -1800.0 * STANDARD_GRAVITY * (24.0 * 8.0 - 12.0) + lowest
    assert up[()] == 0.0 and up[("channel",)] == pytest.approx(-WEIGHT, rel=1e-12)
    assert up[("soil",)] == pytest.approx(soil, rel=1e-12)
    assert up["channel", "soil"] == pytest.approx(soil - WEIGHT, rel=1e-12)
    with pytest.raises(InputError, match="unknown body 'water': channel and soil may have weight"):
        build(CHANNEL, COMM, weighing=("water",))


def test_defaults_of_a_problem():
    """V4.2: a_g = 2 sin(2 pi 2 t), dt = 1/80 s, the inelastic rule as an M-orthogonal impulse on consistent mass."""
    problem = model().problem()
    assert problem.excitation == vc.Harmonic(2.0, 2.0, direction=(1.0, 0.0)) and DT == 1.0 / 80.0
    assert isinstance(problem.impact.reading, vc.MassProjection) and problem.mass == vc.ConsistentMass()
    assert not problem.frictional and not problem.surface.bilateral.any()
    other = model().problem(bilateral=True, friction=FRICTION, impact=vc.NoImpact(), excitation=())
    assert other.mass is None and other.surface.bilateral.all() and other.frictional and other.excitations == ()


def test_records_of_both_sides():
    """Channel minus soil at a point is its opening along the normal; the openings of the sides are their largest."""
    one = model()
    history = follow(one, one.problem(friction=FRICTION), 12).history
    size = max(np.abs(history[name]).max() for name in ("u_x_1", "u_x_19"))
    gap, points = np.asarray(history["gap"]), one.surface.points
    for label, side, axis, sign in (("19", "left", "x", 1), ("13", "right", "x", -1), ("4", "base", "y", 1)):
        here = (np.abs(points - CHANNEL.point(int(label))).max(axis=1) < 1e-9) & one.sides[side]
        apart = sign * (history[f"u_{axis}_{label}"] - history[f"u_{axis}_{label}_soil"])
        assert np.abs(apart - gap[:, here][:, 0]).max() < 1e-13 * size
    for side, mask in one.sides.items():
        assert np.abs(history[f"opening_{side}"] - gap[:, mask].max(axis=1)).max() < 1e-15 * size
    assert max(history["opening_left"].max(), history["opening_right"].max()) > 0.01 * size
    with pytest.raises(InputError, match="not at the interface"):
        SoilProbe({"far": (0.0, 4.0)}).start(one.problem(), vc.static_equilibrium(one.problem(), solver=vc.Condensed()))


@pytest.mark.parametrize("friction", [None, FRICTION], ids=["sliding", "rubbing"])
def test_any_number_of_ranks(friction):
    """The same run on all ranks together and on each alone, to 1e-10 of the largest displacement and pressure."""
    runs = []
    for alone in (False, True):
        one = model(alone=alone)
        runs.append(follow(one, one.problem(friction=friction), 40).history)
    together, single = runs
    for names in ([n for n in single if n.startswith("u_")], ["pressure"]):
        size = max(np.abs(np.asarray(single[name])).max() for name in names)
        for name in names:
            assert np.abs(np.asarray(together[name]) - np.asarray(single[name])).max() < 1e-10 * size, name


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


# Runs -----------------------------------------------------------------------------------------------------------------

@pytest.mark.slow
def test_the_command(shared_tmp, capsys):
    """vi-contact channel: histories, fields and figures in the folder, the summary on rank 0."""
    options = ["--contact", "coulomb", "--mu", "0.4", "--damping", "0.05", "1", "10", "--steps", "10", "--quiet"]
    assert main(["channel", *options, "--out", str(shared_tmp)]) == 0
    text = capsys.readouterr().out
    assert (text.startswith("Channel, coulomb\n") and str(shared_tmp) in text) == (COMM.rank == 0)
    wanted = {"history.csv", "history.h5", "fields.xdmf", "contact.png", "displacements_x.png", "displacements_y.png"}
    assert wanted <= {path.name for path in shared_tmp.iterdir()}
    table = np.genfromtxt(shared_tmp / "history.csv", delimiter=",", names=True)
    one = build(Channel(damping=vc.Rayleigh.from_frequencies(1.0, 10.0, xi1=0.05, xi2=0.05)), COMM)
    straight = follow(one, one.problem(friction=FRICTION), 10).history
    assert np.abs(table["u_x_19"] - straight["u_x_19"]).max() < 1e-9 * np.abs(straight["u_x_19"]).max()


@serial
def test_a_command_that_makes_no_sense(capsys):
    assert main(["channel", "--contact", "coulomb"]) == 1
    assert "needs its friction coefficient mu" in capsys.readouterr().err


@serial
@pytest.mark.parametrize("sides, scheme", [(None, "hht"), ("free-field", "zwt"), ("dashpots", "zwt")])
def test_a_moved_bedrock_from_options(tmp_path, sides, scheme):
    """--base prescribed: the same contact forces, with records in both directions, whatever the sides."""
    t = 0.01 * np.arange(31)
    record = tmp_path / "record.txt"
    record.write_text("".join(f"{a:.4f} {b:.9e}\n" for a, b in zip(t, np.sin(20.0 * t), strict=True)))
    found = []
    for base in ("relative", "prescribed"):
        ready = prepared(
            ChannelRun(
                motion=str(record), vertical=str(record), units="m/s2", scheme=scheme, dt=0.01, base=base,
                sides=sides, gravity="all",
            ), COMM,
        )  # fmt: skip
        assert ready.steps == 31 and len(ready.problem.excitations) == (2 if base == "relative" else 0)
        assert ready.model.system.space.tied.any() == (sides is None)  # tied sides with a vertical record
        march = follow(ready.model, ready.problem, 20, dt=ready.dt, state=ready.start, scheme=SCHEMES[scheme].scheme)
        found.append(np.asarray(march.history["pressure"]))
    same_dashpots = sides != "dashpots"  # these resist the velocity that they see: another problem in another frame
    assert (np.abs(found[0] - found[1]).max() < 1e-8 * found[0].max()) == same_dashpots
    assert np.abs(found[0] - found[0][0]).max() > 0.1 * found[0].max()


@serial
@pytest.mark.parametrize("sides", ["tied", "free-field"])
def test_waves_from_below_from_options(sides):
    """--base compliant: at rest without waves, on what the released bedrock carried; with waves stiff rock brings
    nearly the motion of a rigid base, whose acceleration is that of the outcrop."""
    quiet = prepared(ChannelRun(base="compliant", sides=sides, scale=0.0, gravity="all"), COMM)
    history = follow(quiet.model, quiet.problem, 20, state=quiet.start).history
    size = np.abs(history["u_y_1"]).max()
    assert max(np.ptp(history[name]) for name in ("u_x_1", "u_y_1", "u_x_13")) < 1e-10 * size
    rock = vc.LinearElastic(E=2.0e14, nu=0.25, rho=2400.0)
    options = {"sides": sides, "dt": 0.005}
    opening = []
    for run in (ChannelRun(**options), ChannelRun(base="compliant", rock=rock, **options)):
        one = prepared(run, COMM)
        opening.append(follow(one.model, one.problem, 60, state=one.start, dt=one.dt).history["opening_left"])
    assert np.abs(opening[1] - opening[0]).max() < 0.03 * opening[0].max()


@serial
@pytest.mark.parametrize(
    "wrong, sentence",
    [
        ({"contact": "glued"}, "unknown contact 'glued': choose one of sliding, coulomb, bilateral"),
        ({"contact": "coulomb"}, "contact 'coulomb' needs its friction coefficient mu"),
        ({"mu": 0.3}, "the other contacts take none"),
        ({"sides": "walls"}, "unknown sides 'walls': choose one of rollers"),
        ({"gravity": "moon"}, "unknown gravity 'moon': choose one of channel, all, none"),
        ({"base": "free"}, "unknown base 'free': choose one of relative, prescribed, compliant"),
        ({"rock": CHANNEL.concrete}, "rock is what is under a compliant base"),
        ({"pga": 3.0}, "pga speaks of a record"),
        ({"solver": "magic"}, "unknown solver 'magic'"),
    ],
)
def test_wrong_options(wrong, sentence):
    with pytest.raises(InputError, match=sentence):
        ChannelRun(**wrong)
