"""Case files: the same run as in Python to the last bit, and one sentence for every mistake."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.wall import Wall, build
from vi_contact import engineering, fem, ground_motion, laws, meshes, schemes, solvers
from vi_contact.core.errors import InputError
from vi_contact.core.step import Scheme, Solver
from vi_contact.core.surfaces import empty_surface
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.cli.entry import main
from vi_contact.practice.soil import FreeField, upgoing
from vi_contact.practice.studies import Case, read_case
from vi_contact.practice.studies.cases.library import locate
from vi_contact.practice.studies.cases.short_settings import REFERENCE, ROLLERS, ShortOptions
from vi_contact.practice.studies.cases.toml_file import with_settings
from vi_contact.practice.studies.cases.vocabulary import list_names, make_words
from vi_contact.solvers.friction.problem import FrictionMethod

ROOT = Path(__file__).resolve().parents[2]
WALL = ROOT / "demos" / "cases" / "wall.toml"
COMM = MPI.COMM_WORLD
# nothing but round-off in these runs
ROUND_OFF = ("certificate", "energy_defect", "loss_algorithmic")


def write(folder: Path, text: str, name: str = "case.toml") -> Path:
    """The same file on every rank, written by the first."""
    path = folder / name
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


def assert_same(one: Mapping[str, Any], other: Mapping[str, Any]) -> None:
    """The same columns; to the last bit on one rank, to round-off on several
    (docs/reference/files.md)."""
    assert set(one) == set(other)
    for name, values in one.items():
        if COMM.size == 1:
            assert np.array_equal(values, other[name], equal_nan=True), name
        elif name not in ROUND_OFF:
            size = float(np.nanmax(np.abs(np.asarray(other[name], dtype=float)), initial=0.0))
            assert np.allclose(values, other[name], rtol=0.0, atol=1e-9 * size, equal_nan=True), (
                name
            )


@pytest.mark.promise("guide/studies.md", "The numbers are the same to the last bit")
def test_readmes_first_example_to_the_last_bit() -> None:
    """demos/cases/wall.toml is the code of README, run for 60 of its 400 steps; dt is 1/560 s
    exactly."""
    code = re.search(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    assert code is not None
    names: dict[str, Any] = {}
    exec(code[1].split("solution = ")[0], names)
    solution = vc.simulate(
        names["problem"],
        scheme=vc.ZienkiewiczWoodTaylor(phi=0.5),
        solver=vc.Condensed(),
        dt=1.0 / 560.0,
        steps=60,
        record=[vc.Energy(), vc.Contact(), vc.Probe({"top": (6.0, 9.0)})],
        progress=False,
    )
    assert "dt=1.0 / 560.0, steps=400" in code[1] and "fields=fem.XDMF(every=10)" in code[1]
    case = read_case(WALL)
    assert case.tables["run"] == {"dt": 1.0 / 560.0, "steps": 400} and case.tables["fields"] == {
        "every": 10
    }
    tables = {name: value for name, value in case.nodes.items() if name != "fields"}
    found = Case(
        case.path, case.tables, (), tables | {"run": read_case(WALL, ["run.steps=60"]).nodes["run"]}
    ).run(COMM, progress=False)
    assert found.history["contact_resultant"].max() > 0.0
    assert_same(found.history, solution.history)


PAIR = """
[mesh]
type = "TwoBlocks"
lower = {lengths = [2.0, 1.0], divisions = [4, 2]}
upper = {lengths = [1.0, 1.0], divisions = [2, 2]}
offset = [0.5]

[material.lower]
E = 3e9
nu = 0.2
rho = 2400

[material.upper]
type = "LinearElastic.from_wave_speeds"
c_p = 2000
c_s = 1000
rho = 2000

[system]
fixed = ["lower_bottom"]
damping = {type = "Rayleigh.from_frequencies", f1 = 1, f2 = 10, xi1 = 0.05, xi2 = 0.05}
loads = [{facets = "upper_top", value = [0.0, -1e3]}]

[gravity]
acceleration = 9.81

[[contact]]
type = "contact_pair"
facets1 = "upper_bottom"
facets2 = "lower_top"

[friction]
type = "Coulomb"
mu = 0.3

[excitation]
type = "GroundMotion"
record = {path = "motion.txt", units = "g", processing = {pga = 4.0}}
scale = 1.5

[[record]]
type = "Energy"

[[record]]
type = "Contact"

[[record]]
type = "Reactions"
name = "foot"
facets = "lower_bottom"
centre = [1.0, 0.0]

[[record]]
type = "Resultants"
name = "joint"
centre = [1.0, 1.0]

[run]
dt = 0.005
"""


@pytest.mark.slow
def test_a_pair_with_weight_and_record_to_the_last_bit(shared_tmp: Path) -> None:
    """Two materials, static stage, Coulomb, a processed record beside the file: the run lasts as
    long as the record."""
    write(
        shared_tmp,
        "".join(f"{0.01 * k} {np.sin(30.0 * 0.01 * k)}\n" for k in range(11)),
        "motion.txt",
    )
    found = read_case(write(shared_tmp, PAIR)).run(COMM, progress=False)

    lower = BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2))
    upper = BlockMesh(lengths=(1.0, 1.0), divisions=(2, 2))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(0.5,)), COMM)
    soft = vc.LinearElastic.from_wave_speeds(2000.0, 1000.0, 2000.0)
    system = fem.assemble(
        mesh,
        [(tags["lower"], vc.LinearElastic(E=3e9, nu=0.2, rho=2400.0)), (tags["upper"], soft)],
        clamped=tags["lower_bottom"],
        damping=vc.Rayleigh.from_frequencies(1.0, 10.0, xi1=0.05, xi2=0.05),
        loads=fem.Traction(tags["upper_top"], (0.0, -1e3)),
    )
    system = vc.with_weight(system, acceleration=9.81)
    surface = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    record = ground_motion.scaled_to_pga(vc.read_record(shared_tmp / "motion.txt", "g"), 4.0)
    problem = vc.ContactProblem(
        system, surface, friction=vc.Coulomb(0.3), excitation=vc.GroundMotion(record, scale=1.5)
    )
    rest = vc.static_equilibrium(problem, solver=vc.Condensed())
    foot = vc.Reactions("foot", tags["lower_bottom"], (1.0, 0.0))
    expected = vc.simulate(
        problem,
        dt=0.005,
        t_end=0.1,
        state=rest,
        progress=False,
        record=[vc.Energy(), vc.Contact(), foot, vc.Resultants("joint", (1.0, 1.0))],
    )
    assert len(found.history["t"]) == 21 and np.abs(found.history["a_g_x"]).max() == pytest.approx(
        6.0, rel=1e-12
    )
    weight = 9.81 * (2000.0 * 1.0) + 1e3
    assert found.history["contact_resultant"][0] == pytest.approx(weight, rel=1e-9)
    assert found.history["contact_max_slip"].max() > 0.0
    assert_same(found.history, expected.history)


@pytest.mark.serial
def test_the_wall_with_other_values(shared_tmp: Path) -> None:
    """The case that ships is the wall beside its demo, its probes too, with the convention of its
    reference numbers."""
    given = (
        "contact.points=[[6.0, 3.0], [6.0, 5.25], [6.0, 7.5]]",
        "system.section.thickness=0.3",
        'mass={type="ConsistentMass"}',
        'excitation={type="Harmonic", amplitude=1, frequency=14}',
        "run.dt=0.0018",
        "run.steps=30",
        "scheme.phi=",
        "fields=",
    )
    found = read_case(locate("wall"), given).run(COMM, progress=False)
    model = build(Wall(thickness=0.3), COMM, base_inertia="catalogue")
    expected = vc.simulate(
        model.problem("a", excitation=vc.Harmonic(1.0, 14.0)),
        scheme=vc.ZienkiewiczWoodTaylor(),
        dt=0.0018,
        steps=30,
        record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
        progress=False,
    )
    assert_same(found.history, expected.history)


def test_the_channel_with_a_recorder_of_its_demo(shared_tmp: Path) -> None:
    """Keys of its mesh; a recorder that stands with the demo, its weight and static stage."""
    text = locate("channel").read_text("utf-8") + (
        '\n[[record]]\ntype = "demos.parts.problems.channel:SoilProbe"\n'
        "points = {7_of_soil = [14.0, 5.0]}\n"
    )
    path = write(shared_tmp, text)
    given = ("mesh.size=1.0", "mesh.wall=1.0", "mesh.slab=1.0", "run.steps=2", "fields=")
    history = read_case(path, given, allow=("demos",)).run(COMM, progress=False).history
    assert history["contact_resultant"][0] > 0.0 and "u_x_7_of_soil" in history


GROUND = """
[mesh]
type = "BlockMesh"
lengths = [6.0, 8.0]
divisions = [4, 8]

[material.soil]
type = "LinearElastic.from_wave_speeds"
c_p = 400
c_s = 200
rho = 2000

[[record]]
type = "Probe"
points = {top = [3.0, 8.0]}

[run]
dt = 0.004
steps = 20
"""
BASE = """{type = "CompliantBase", facets = "bottom",
 motion = {motion = {type = "Ricker", amplitude = 2.0, frequency = 4.0}, dt = 0.004}}""".replace(
    "\n", ""
)
COMPLIANT = (
    GROUND
    + f"""
[system]
dashpots = [{BASE}, {{type = "FreeField", facets = "left", base = {BASE}}},
            {{type = "FreeField", facets = "right", base = {BASE}}}]
"""
)
RIGID = (
    GROUND
    + """
[system]
fixed = "bottom"
dashpots = [{type = "FreeField", facets = "left"}, {type = "FreeField", facets = "right"}]

[excitation]
type = "Ricker"
amplitude = 2.0
frequency = 4.0
"""
)


@pytest.mark.slow
def test_soil_boundaries(shared_tmp: Path) -> None:
    """A compliant base and free-field sides; on a rigid base they take
    its excitations."""
    found = read_case(write(shared_tmp, COMPLIANT)).run(COMM, progress=False)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(6.0, 8.0), divisions=(4, 8)), COMM)
    base = fem.CompliantBase(tags["bottom"], motion=upgoing(vc.Ricker(2.0, 4.0), dt=0.004))
    sides = [FreeField(tags[side], base=base) for side in ("left", "right")]
    soil = vc.LinearElastic.from_wave_speeds(400.0, 200.0, 2000.0)
    system = fem.assemble(mesh, soil, dashpots=[base, *sides])
    problem = vc.ContactProblem(system, empty_surface(system.algebra.comm, 2))
    probe = vc.Probe({"top": (3.0, 8.0)})
    expected = vc.simulate(problem, dt=0.004, steps=20, record=[probe], progress=False)
    assert np.abs(found.history["u_x_top"]).max() > 0.0
    assert_same(found.history, expected.history)
    rigid = read_case(write(shared_tmp, RIGID, "rigid.toml")).run(COMM, progress=False)
    shaking = vc.Ricker(2.0, 4.0)
    sides = [FreeField(tags[side], base=(shaking,)) for side in ("left", "right")]
    system = fem.assemble(mesh, soil, dashpots=sides, clamped=tags["bottom"])
    problem = vc.ContactProblem(system, empty_surface(system.algebra.comm, 2), excitation=shaking)
    assert_same(
        rigid.history,
        vc.simulate(problem, dt=0.004, steps=20, record=[probe], progress=False).history,
    )


@pytest.mark.serial
def test_weight_is_the_body_force_of_the_density(comm: Any) -> None:
    """M r g of one material is BodyForce((0, -rho g)), to round-off."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(3, 2)), comm)
    material = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
    heavy = fem.assemble(
        mesh, material, clamped=tags["bottom"], loads=fem.BodyForce((0.0, -2000.0 * 9.80665))
    )
    system = fem.assemble(mesh, material, clamped=tags["bottom"])
    difference = vc.with_weight(system).load(0.0) - heavy.load(0.0)
    assert (
        comm.allreduce(float(np.abs(difference).max(initial=0.0)), op=MPI.MAX)
        < 1e-12 * 2000.0 * 9.80665
    )
    for direction, components in (((0.0, 2.0), 2), ((1.0,), 2)):
        with pytest.raises(
            InputError, match=f"direction .* give {components} components of a vector of length one"
        ):
            vc.with_weight(system, direction=direction)
    assert not vc.with_weight(system, bodies=()).load(0.0).any()
    assert np.array_equal(
        vc.with_weight(system, bodies=[0]).load(0.0), vc.with_weight(system).load(0.0)
    )
    with pytest.raises(
        InputError,
        match="the number of a body is 1; give a whole number of at least 0 and at most 0",
    ):
        vc.with_weight(system, bodies=[1])
    bare = fem.assemble(mesh, material, clamped=tags["bottom"], base_inertia=False)
    with pytest.raises(InputError, match="assemble with base_inertia=True"):
        vc.with_weight(bare)


# what is replaced in demos/cases/wall.toml, by what, what the sentence says after the file's name
MISTAKES = {
    "no TOML": ("[mesh]", "[mesh", ": Expected ']'"),
    "end of file": ("every = 10", "every =", ": Invalid value (at line 54"),
    "table twice": ("[impact]", "[solver]", ": Cannot declare ("),
    "table": (
        "[impact]",
        "[impakt]",
        ": the table [impakt] is unknown: did you mean impact or format? Known: format",
    ),
    "key": (
        "amplitude",
        "amplitute",
        ": [excitation[1]] has the unknown key 'amplitute' for Harmonic: did you mean "
        "amplitude? Known: amplitude, frequency, phase, direction",
    ),
    "type": (
        '"Condensed"',
        '"Condensd"',
        ": [solver] has the unknown type 'Condensd': did you mean Condensed?",
    ),
    "no type": (
        'type = "Inelastic"',
        "",
        ": [impact] has no type: give type = one of Inelastic, Newton, Elastic",
    ),
    "nameless": (
        "[material.concrete]",
        "[material]",
        ": [material] has the keys of one material and no name: ",
    ),
    "missing": (
        "rho = 2400.0",
        "",
        ": [material.concrete] lacks the key 'rho', which LinearElastic needs",
    ),
    "text": (
        "amplitude = 3.0",
        'amplitude = "big"',
        ": [excitation[1]] amplitude is 'big': give a number",
    ),
    "truth": (
        "amplitude = 3.0",
        "amplitude = true",
        ": [excitation[1]] amplitude is true: give a number",
    ),
    "fraction": ("[8, 12]", "[8, 12.5]", ": [mesh] divisions[2] is 12.5: give a whole number"),
    "count": ("[8, 12]", "[8, 12, 1]", ": [mesh] divisions has 3 entries: give 2"),
    "list": ("steps = 400", "steps = [400]", ": [run] steps is a list: give a whole number"),
    "name": (
        'fixed = "base"',
        'fixed = "base"\nmaterial = "steel"',
        ": [system] material names 'steel', which does not exist: Known: concrete",
    ),
    "function": (
        '"HalfSpace"',
        '"AnalyticGap"',
        ": [contact[1].obstacle] has the unknown key 'point' for AnalyticGap",
    ),
    "inner table": (
        'section = {type = "PlaneStress", thickness = 0.20}',
        "section = {type = 'PlaneStress', depth = 1}",
        ": [system.section] has the unknown key 'depth' for PlaneStress",
    ),
    "no dt": ("dt = 0.0017857142857142857", "", ": [run] lacks the key 'dt', which simulate needs"),
    "unknown table": (
        "[mesh]",
        '[model]\ntype = "Wall"\n[mesh]',
        ": the table [model] is unknown: ",
    ),
    "no mesh": (
        '[mesh]\ntype = "WallMesh"\nheight = 9.0              # m\nwidth = 6.0\ndivisions = [8, '
        "12]\n",
        "",
        ": the table [mesh] is missing: give the mesh of the body",
    ),
}


@pytest.mark.serial
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_one_sentence(tmp_path: Path, name: str) -> None:
    """File, table, key and remedy, before anything is computed; on the command line too."""
    old, new, said = MISTAKES[name]
    text = WALL.read_text("utf-8")
    assert old in text
    path = write(tmp_path, text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_case(path)
    assert str(caught.value).startswith(f"{path}{said}") and "\n" not in str(caught.value)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("rho = 2400.0", "rho = -1.0", "[material.concrete] LinearElastic: the mass density"),
        (
            'type = "Inelastic"',
            'type = "Newton"\ne = 2.0',
            "[impact] Newton: restitution coefficient e is 2.0",
        ),
        ("frequency = 14.0", "frequency = 0.0", "[excitation[1]] Harmonic: frequency is 0.0"),
    ],
)
def test_wrong_values_are_told_without_a_mesh(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        read_case(write(tmp_path, WALL.read_text("utf-8").replace(old, new, 1))).check()


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'fixed = "base"',
            'fixed = "foot"',
            "[system] fixed is 'foot', but the mesh has no group 'foot'",
        ),
        (
            'fixed = "base"',
            'fixed = ["wall"]',
            "[system] fixed[1] is 'wall', a cell group: give the name",
        ),
        (
            "steps = 400",
            "",
            "[run] has neither steps nor t_end, and the excitation has no end: give one",
        ),
    ],
)
def test_mistakes_that_need_the_mesh(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        read_case(write(tmp_path, WALL.read_text("utf-8").replace(old, new, 1))).run(COMM)


CORNER = """
[mesh]
type = "BlockMesh"
divisions = [3, 3]

[system]
material = {E = 1e6, nu = 0.3, rho = 1000}
fixed = "top"

[[contact]]
facets = "bottom"

[[contact]]
facets = "left"
points = [[0, 0]]
feature_angle = 0.4

[friction]
type = "Coulomb"
mu = 0.3

[run]
dt = 0.005
steps = 1
"""


@pytest.mark.serial
def test_corners_rub_on_all_faces_unless_they_are_said_to_slide(tmp_path: Path) -> None:
    assert read_case(write(tmp_path, CORNER)).problem(COMM).surface.traces is not None
    allowed = CORNER.replace("\nfacets", "\nfrictionless_corners = true\nfacets")
    surface = read_case(write(tmp_path, allowed)).problem(COMM).surface
    assert surface.frictionless_corners and [len(corner) for corner in surface.corners] == [2]


@pytest.mark.serial
def test_files_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    for path, said in (
        (tmp_path / "none.toml", "No such file"),
        (tmp_path, "cannot be read"),
        (tmp_path / "binary.toml", "no UTF-8"),
    ):
        with pytest.raises(InputError, match=said):
            read_case(path)


@pytest.mark.serial
def test_settings() -> None:
    """KEY=VALUE on a copy: values of TOML, other words as text, lists counted from 1, new tables on
    the way."""
    tables = {"run": {"dt": 1.0}, "excitation": [{"scale": 1.0}, {}]}
    made = with_settings(
        tables,
        ["run.dt=2", "excitation.2.scale=[1, 2]", "scheme.type=HHT", "a.b.c=true", "t= x = 1"],
    )
    assert made == {
        "run": {"dt": 2},
        "excitation": [{"scale": 1.0}, {"scale": [1, 2]}],
        "scheme": {"type": "HHT"},
        "a": {"b": {"c": True}},
        "t": "x = 1",
    }
    assert tables == {"run": {"dt": 1.0}, "excitation": [{"scale": 1.0}, {}]}
    for setting, said in (
        ("run.dt", "give KEY=VALUE"),
        ("excitation.3.scale=1", "number from 1 to 2"),
        ("run.dt.x=1", "plain value"),
        ("excitation.0.scale=1", "no entry '0'"),
    ):
        with pytest.raises(InputError, match=said):
            with_settings(tables, [setting])


@pytest.mark.serial
def test_short_options_are_settings() -> None:
    """What replaces comes before --set, what acts on the result after it; KEY= takes a key away."""
    tables = {
        "excitation": [{"type": "Harmonic", "amplitude": 2.0, "direction": [1.0, 0.0]}],
        "impact": {"type": "X"},
        "run": {"dt": 0.1, "t_end": 1.0},
        "system": {"prescribed": ROLLERS},
    }
    given = ["excitation.1.amplitude=3", "run.dt=0.2"]
    short = ShortOptions(
        scale=2.0, dt=0.5, steps=7, scheme="Newmark", solver="Hildreth", cross_check=True
    )
    made = with_settings(tables, short.settings(tables, given))
    assert made["excitation"][0]["amplitude"] == 6.0 and made["run"] == {"dt": 0.2, "steps": 7}
    assert "impact" not in made and made["scheme"] == {"type": "Newmark"}
    solver = made["solver"]
    assert solver["primary"] == {"type": "Condensed", "method": {"type": "Hildreth"}}
    assert solver["others"] == [REFERENCE]
    shaken = with_settings(tables, ShortOptions(motion="h.at2,v.at2", scale=3.0).settings(tables))
    assert [one["direction"] for one in shaken["excitation"]] == [[1.0, 0.0], [0.0, 1.0]]
    assert [one["scale"] for one in shaken["excitation"]] == [3.0, 3.0] and shaken["run"] == {
        "dt": 0.1
    }
    assert shaken["excitation"][1]["record"] == {"path": str(Path("v.at2").absolute())}
    assert shaken["system"] == {"tied": {"first": "left_side", "second": "right_side"}}
    assert tables["run"]["t_end"] == 1.0
    made = {
        "type": "GroundMotion",
        "direction": [0.0, 1.0],
        "scale": 0.8,
        "record": {"type": "synthetic", "seed": 1},
    }
    shaken = with_settings(
        {"excitation": [made]}, ShortOptions(motion="h.at2").settings({"excitation": [made]})
    )
    assert shaken["excitation"] == [made | {"record": {"path": str(Path("h.at2").absolute())}}]
    for wrong, said in (
        (ShortOptions(scale=2.0), "nothing shakes it"),
        (ShortOptions(motion="a,b,c"), "give FILE, or FILE,FILE"),
    ):
        with pytest.raises(InputError, match=said):
            wrong.settings({"mesh": {}})


@pytest.mark.serial
def test_what_follows_from_the_first_mode() -> None:
    """Harmonic and time step by the body's lowest frequency; where it is not known yet, a
    sentence."""
    settings = [
        "excitation.1={type='FirstModeHarmonic', amplitude=2, ratio=0.25}",
        "fields=",
        "run.steps=2",
        "run.dt={type='FirstModePeriod', parts=10}",
    ]
    case = read_case(WALL, settings)
    case.check()
    problem = case.problem(MPI.COMM_WORLD)
    f1 = engineering.lowest_frequency(problem.system)
    assert problem.excitations == (vc.Harmonic(2.0, 0.25 * f1, direction=(1.0, 0.0)),)
    solution = case.run(MPI.COMM_WORLD, progress=False)
    assert solution.history["t"] == pytest.approx(
        np.array([0.0, 1.0, 2.0]) / (10.0 * f1), rel=1e-14
    )
    with pytest.raises(InputError, match="needs the excitations, still unknown here"):
        read_case(WALL, [*settings, "system.dashpots=[{type='FreeField', facets='back'}]"]).problem(
            MPI.COMM_WORLD
        )


@pytest.mark.long
@pytest.mark.serial
def test_the_command_runs_checks_and_restarts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """20 steps at once are 10 steps, then --restart; case.toml in the folder tells the settings."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    quiet = ["--quiet", "--set", "solver.method.type=Hildreth"]
    assert main(["run", str(WALL), "--out", str(whole), "--set", "run.steps=20", *quiet]) == 0
    assert main(["run", str(WALL), "--out", str(parts), "--set", "run.steps=10", *quiet]) == 0
    assert (
        main(["run", str(WALL), "--out", str(parts), "--set", "run.steps=20", "--restart", *quiet])
        == 0
    )
    assert (whole / "history.csv").read_bytes() == (parts / "history.csv").read_bytes()
    assert (whole / "fields.xdmf").is_file()
    copy = (whole / "case.toml").read_text("utf-8")
    assert copy.startswith("# set run.steps=20\n# set solver.method.type=Hildreth\n")
    assert copy.endswith(WALL.read_text("utf-8"))
    printed = capsys.readouterr().out
    assert (
        printed.count("A concrete wall beside the ground, shaken\nrun finished:") == 3
        and "Hildreth" in printed
    )
    assert main(["run", str(WALL), "--check", "--out", str(tmp_path / "checked")]) == 0
    assert "in order" in capsys.readouterr().out
    assert main(["run", str(WALL), "--set", "run.stepps=1", "--check"]) == 1
    said = capsys.readouterr().err
    assert (
        said == f"vi-contact: {WALL}: [run] has the unknown key 'stepps' for simulate: "
        "did you mean steps? Known: dt, t_end, steps, out, tolerance, checkpoint_every\n"
    )


@pytest.mark.serial
def test_case_files_know_the_public_names() -> None:
    """Laws, obstacles, excitations, schemes, solvers, their methods and recorders, but those that
    take functions."""
    known = {
        name.split(".")[0] for choices in make_words(ROOT).choices.values() for name in choices
    }
    wanted = {*laws.__all__, *schemes.__all__, *solvers.__all__, *meshes.__all__}
    wanted |= {
        "Energy",
        "Contact",
        "Probe",
        "Resultants",
        "Racking",
        "Reactions",
        "SectionForces",
        "CompliantBase",
        "FreeField",
        "Schedule",
        "HalvedAtImpact",
        "CrossChecked",
        "GroundMotion",
    }
    # no words
    others = {
        "Geostatic",
        "JointWater",
        "Prestress",
        "ExponentialDecay",
        "StaticKinetic",
        "RateIteration",
        "with_weight",
        "PMatrix",
        "p_matrix",
    }
    assert wanted - known == others


@pytest.mark.serial
def test_schemes_and_solvers_have_one_vocabulary() -> None:
    """Case files, the command line, ``vc.`` and the rooms say the same names, each listed once."""
    assert (
        {name.split(".")[0] for name in list_names(Scheme)}
        == set(schemes.__all__)
        <= set(vc.__all__)
    )
    assert {"GeneralisedAlpha.spectral_radius", "LinearMultistep.newmark"} <= set(
        list_names(Scheme)
    )
    assert (
        set(list_names(Solver))
        == {"Automatic", "Condensed", "Iterative", "Volume", "CrossChecked"}
        <= set(vc.__all__)
    )
    assert set(list_names(FrictionMethod)) == set(solvers.friction.__all__) - {
        "Anderson",
        "Plain",
        "RateIteration",
    }


@pytest.mark.serial
def test_every_example_is_in_order() -> None:
    for path in sorted((ROOT / "demos" / "cases").glob("*.toml")):
        assert read_case(path).nodes


def test_a_component_of_a_record_by_its_name(shared_tmp: Path) -> None:
    """channel takes a number or a name in case files too; without it the components are listed."""
    rows = "".join(
        f"{0.01 * k:.2f} {np.sin(0.3 * k):.6f} {2.0 * np.sin(0.3 * k):.6f}\n" for k in range(11)
    )
    write(shared_tmp, "Time [s] North [g] East [g]\n" + rows, "motion.txt")
    plain = 'record = {path = "motion.txt", units = "g", processing = {pga = 4.0}}'
    for said, factor in (('"east"', 2.0), ("2", 2.0), ('"North"', 1.0)):
        chosen = f'record = {{path = "motion.txt", channel = {said}}}'
        case = read_case(write(shared_tmp, PAIR.replace(plain, chosen)))
        peak = np.max(np.abs(case.problem(COMM).excitation[0].record.acceleration))
        assert peak == pytest.approx(factor * 9.80665 * np.round(np.sin(1.5), 6), rel=1e-5)
    with pytest.raises(vc.InputError, match="1: North, 2: East"):
        read_case(write(shared_tmp, PAIR.replace(plain, 'record = {path = "motion.txt"}'))).problem(
            COMM
        )
