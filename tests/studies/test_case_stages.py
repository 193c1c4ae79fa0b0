"""[[stage]] tables: gravity, other supports, motions, each from where the one before has left the
body."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.cli.batch import make_runs
from vi_contact.practice.soil import upgoing
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.short_settings import ShortOptions
from vi_contact.practice.studies.ida.runs import gather_ground_motions
from vi_contact.run import session, static

ROOT = Path(__file__).resolve().parents[2]
COMM = MPI.COMM_WORLD
(HOUSE,) = re.findall(
    r"^```toml\n(.*?)^```$", (ROOT / "docs/guide/stages.md").read_text("utf-8"), re.M | re.S
)
QUICK = [
    "run.t_end=0.12",
    "excitation.1.frequency=20",
    "excitation.1.amplitude=20",
    "friction.mu=0.1",
    "stage.3.run.t_end=0.08",
    "stage.3.excitation.1.frequency=40",
    "stage.3.excitation.1.amplitude=20",
]


def case(folder: Path, text: str = HOUSE, *settings: str) -> Any:
    """The case that every rank reads, written by the first."""
    path = folder / "house.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return read_case(path, [*QUICK, *settings] if text is HOUSE else settings)


def apart(one: Any, other: Any) -> float:
    """The largest difference of the columns that both have, over each one's size."""
    names = ("u_x_roof", "u_y_roof", "contact_resultant", "contact_max_slip", "u_y_field")
    sizes = [np.abs(other[name]).max() for name in names]
    apart = [np.abs(one[name] - other[name]).max() for name in names]
    return max(float(a / size) for a, size in zip(apart, sizes, strict=True) if size > 0.0)


def house(**supports: Any) -> Any:
    """The problem of the guide's case with these supports, in Python."""
    mesh, tags = house.mesh  # type: ignore[attr-defined]
    cells = [
        (tags["lower"], vc.LinearElastic.from_wave_speeds(400.0, 200.0, 2000.0)),
        (tags["upper"], vc.LinearElastic(E=2e9, nu=0.2, rho=800.0)),
    ]
    tied = fem.Tied(tags["lower_left"], tags["lower_right"])
    system = vc.with_weight(fem.assemble(mesh, cells, tied=tied, **supports))
    contact = fem.contact_pair(
        system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
    )
    return vc.ContactProblem(system, contact, friction=vc.Coulomb(0.1))


@pytest.mark.long
def test_the_case_of_the_guide_is_the_same_in_python(shared_tmp: Path) -> None:
    """static_equilibrium, release, simulate, and simulate again with another wave; every stage has
    a folder."""
    found = case(shared_tmp).run(COMM, out=shared_tmp / "run", progress=False)
    mesh, tags = house.mesh = fem.build_mesh(
        TwoBlocks(  # type: ignore[attr-defined]
            lower=BlockMesh(lengths=(12.0, 6.0), divisions=(8, 4)),
            upper=BlockMesh(lengths=(3.0, 4.0), divisions=(3, 4)),
            offset=(4.5,),
        ),
        COMM,
    )
    static = house(clamped=tags["lower_bottom"])

    def shaken(amplitude: float, frequency: float) -> Any:
        wave = upgoing([vc.Ricker(amplitude, frequency)], dt=0.002)
        return fem.release(
            static, rest, house(dashpots=fem.CompliantBase(tags["lower_bottom"], motion=wave))
        )

    rest = vc.static_equilibrium(static)
    record = [vc.Energy(), vc.Contact(), vc.Probe({"roof": (4.5, 10.0), "field": (0.0, 6.0)})]
    problem, start = shaken(20.0, 20.0)
    shock = vc.simulate(problem, dt=0.004, t_end=0.12, state=start, record=record, progress=False)
    problem, _ = shaken(20.0, 40.0)
    after = vc.simulate(
        problem,
        dt=0.002,
        t_end=0.08,
        state=replace(shock.state, t=0.0, k=0, memory={}),
        record=record,
        progress=False,
    )
    one = vc.read_run(shared_tmp / "run" / "stages" / "1_gravity")
    two = vc.read_run(shared_tmp / "run" / "stages" / "2_shock")
    assert len(one.history["t"]) == 1 and one.history["contact_resultant"][0] == pytest.approx(
        3.0 * 4.0 * 800.0 * 9.80665, rel=1e-9
    )
    assert apart(two.history, shock.history) < 1e-9 and apart(found.history, after.history) < 1e-9
    assert np.ptp(found.history["u_x_roof"]) > 1e-3 * np.abs(found.history["u_y_roof"]).max()
    assert found.history["contact_max_slip"][-1] > found.history["contact_max_slip"][0] > 0.0
    assert found.history["u_x_roof"][0] == pytest.approx(two.history["u_x_roof"][-1], rel=1e-12)
    assert vc.read_run(shared_tmp / "run").history["t"][-1] == pytest.approx(0.08)
    kinds = [
        [one["kind"] for one in json.loads((folder / "model.json").read_text("utf-8"))["supports"]]
        for folder in (shared_tmp / "run" / "stages" / "1_gravity", shared_tmp / "run")
    ]
    assert kinds[0] != kinds[1]


STILL = HOUSE.replace("amplitude = 3.0 ", "amplitude = 1e-300").split(
    '[[stage]]\nname = "aftershock"'
)[0]
PROPPED = """
[[stage]]
name = "propped"
type = "static"
system = {fixed = ["lower_bottom", "upper_top"]}

"""


@pytest.mark.serial
@pytest.mark.parametrize("extra", [pytest.param(False, marks=pytest.mark.serial), True])
@pytest.mark.promise("guide/soil.md", "moved by 1e-12 of the static displacement", bound="1e-11")
def test_nothing_moves_without_motion(shared_tmp: Path, extra: bool) -> None:
    """V8.9: gravity, perhaps a prop on the roof that then holds it where it is, then the compliant
    base for a second without motion: still to 1e-11 of the settlement."""
    text = STILL
    if extra:
        head, tail = STILL.split('[[stage]]\nname = "shock"')
        text = head + PROPPED + '[[stage]]\nname = "shock"' + tail
    found = case(shared_tmp, text, "run.t_end=1.0", "run.dt=0.05").run(COMM, progress=False).history
    size = np.abs(found["u_y_roof"]).max()
    weight = 3.0 * 4.0 * 800.0 * 9.80665
    assert size > 1e-4
    for name in ("u_x_roof", "u_y_roof", "u_x_field", "u_y_field"):
        assert np.ptp(found[name]) < 1e-11 * size, name
    assert np.abs(found["contact_resultant"] - weight).max() < 1e-9 * weight


@pytest.mark.long
def test_an_added_support_holds_the_body_where_it_is(shared_tmp: Path) -> None:
    """The prop: what it holds stays off its own place by the settlement, in the field output too,
    and carries nothing; then a push on the wall: the prop takes a share of it, which its release is
    refused for."""
    head, _ = STILL.split('[[stage]]\nname = "shock"')
    loaded = PROPPED.replace("propped", "loaded").replace(
        '"upper_top"]', '"upper_top"], loads = [{facets = "upper_left", value = [5.0e3, 0.0]}]'
    )
    record = (
        'record = [{type = "Reactions", name = "prop", facets = "upper_top", centre = [0.0, 0.0], '
        'gravity = [0.0, -9.80665]}, {type = "Probe", points = {roof = [7.5, 10.0]}}]\n'
    )
    found = case(shared_tmp, head + PROPPED + record + loaded + record).run(
        COMM, out=shared_tmp / "run", progress=False
    )
    before = vc.read_run(shared_tmp / "run" / "stages" / "2_propped").history
    weight = 3.0 * 4.0 * 800.0 * 9.80665
    assert before["u_y_roof"][0] < -1e-4 and found.history["u_y_roof"][0] == before["u_y_roof"][0]
    assert abs(before["reaction_y_prop"][0]) < 1e-9 * weight
    assert -4.0 * 5.0e3 < found.history["reaction_x_prop"][0] < -5.0e3
    bare = '\n[[stage]]\nname = "bare"\ntype = "static"\n' + loaded.split('type = "static"\n')[
        1
    ].replace(', "upper_top"', "")
    with pytest.raises(
        InputError,
        match=r"\[\[stage\]\] 4 'bare': it removes the support 'upper_top', which carries "
        r".* N: give release = true",
    ):
        case(shared_tmp, head + PROPPED + loaded + bare).run(COMM, progress=False)


def test_a_support_that_carries_load_is_not_forgotten(shared_tmp: Path) -> None:
    """One sentence with the group, its reaction (the weight of all) and the remedy."""
    weight = (12.0 * 6.0 * 2000.0 + 3.0 * 4.0 * 800.0) * 9.80665
    with pytest.raises(InputError) as told:
        case(shared_tmp, HOUSE.replace("release = true", "release = false")).run(
            COMM, progress=False
        )
    said = (
        "[[stage]] 2 'shock': it removes the support 'lower_bottom', which carries "
        f"{weight:.4g} N: give release"
    )
    assert said in f"{told.value}"


@pytest.mark.long
@pytest.mark.serial  # the stages above go from one to the next on two ranks
def test_after_the_shock_the_house_rests_where_it_has_slid(shared_tmp: Path) -> None:
    """A static stage after the motion, on the same dashpots: the slip stays but for the 3 % by
    which points slide on as the swinging load leaves them; the house carries its weight."""
    old, new = 'name = "aftershock"\ntype = "dynamic"', 'name = "rest"\ntype = "static"'
    text = HOUSE.split("excitation = [{")[0].replace(old, new)
    settings = [one for one in QUICK if "stage" not in one]
    found = (
        case(shared_tmp, text, *settings).run(COMM, out=shared_tmp / "run", progress=False).history
    )
    before = vc.read_run(shared_tmp / "run" / "stages" / "2_shock").history
    first, last = before["contact_max_slip"][[0, -1]]
    assert last > 2.0 * first > 0.0 and found["contact_max_slip"][0] == pytest.approx(last, rel=0.1)
    assert found["contact_resultant"][0] == pytest.approx(3.0 * 4.0 * 800.0 * 9.80665, rel=1e-9)
    assert found["energy_kinetic"][0] == 0.0 < before["energy_kinetic"][-1]


class PowerFailure(Exception):
    """What ends a run without a word."""


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.promise("guide/stages.md", "the uninterrupted run to the last bit")
def test_a_run_stopped_within_a_stage_goes_on_to_the_last_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ended in the shock, or in the aftershock: what --restart makes is the straight run. A new run
    keeps nothing."""
    stopped = case(
        tmp_path, HOUSE, "run.checkpoint_every=1", "run.t_end=0.04", "stage.3.run.t_end=0.02"
    )
    whole = stopped.run(MPI.COMM_SELF, out=tmp_path / "whole", progress=False).history
    record = session.Session._record
    for last, begun_from in ((6, 5), (10 + 5, 10)):
        rows: list[int] = []

        def record_or_fail(
            self: Any, report: Any, writer: Any, rows: list[int] = rows, last: int = last
        ) -> None:
            rows.append(report.new.k)
            if len(rows) == last:
                raise PowerFailure
            record(self, report, writer)

        with monkeypatch.context() as patched, pytest.raises(PowerFailure):
            patched.setattr(session.Session, "_record", record_or_fail)
            stopped.run(MPI.COMM_SELF, out=tmp_path / "parts", progress=False)
        assert (tmp_path / "parts" / "summary.json").is_file() == (last > 10)
        found = stopped.run(
            MPI.COMM_SELF, out=tmp_path / "parts", restart=True, progress=False
        ).history
        for name, values in whole.items():
            assert np.array_equal(values, found[name], equal_nan=True), name
        facts = json.loads(
            (tmp_path / "parts" / "stages" / "2_shock" / "summary.json").read_text("utf-8")
        )
        assert facts["restarted_from_step"] == begun_from and facts["steps"] == 10


@pytest.mark.long
@pytest.mark.serial
def test_a_stage_follows_from_the_end_of_the_one_before(tmp_path: Path) -> None:
    """A restart keeps the aftershock while the shock before it stays what it was, and makes it anew
    after a longer one; a stage of another name is refused, and replaced by a new run."""
    settings = [
        "run.t_end=0.04",
        "excitation.1.frequency=20",
        "excitation.1.amplitude=20",
        "friction.mu=0.1",
        "stage.3.run.t_end=0.02",
    ]
    longer = [*settings, "run.t_end=0.08"]
    folder, facts = tmp_path / "run", tmp_path / "run" / "summary.json"

    def run(text: str, settings: list[str], **options: Any) -> Any:
        return (
            case(tmp_path, text + " ", *settings)
            .run(MPI.COMM_SELF, progress=False, **options)
            .history
        )

    first = run(HOUSE, settings, out=folder)
    assert np.array_equal(
        run(HOUSE, settings, out=folder, restart=True)["u_x_roof"], first["u_x_roof"]
    )
    assert json.loads(facts.read_text("utf-8"))["restarted_from_step"] == 10
    whole, found = run(HOUSE, longer), run(HOUSE, longer, out=folder, restart=True)
    assert json.loads(facts.read_text("utf-8"))["restarted_from_step"] is None
    assert (
        np.abs(whole["u_x_roof"] - first["u_x_roof"]).max() > 1e-3 * np.abs(first["u_x_roof"]).max()
    )
    for name, values in whole.items():
        assert np.array_equal(values, found[name], equal_nan=True), name
    renamed = HOUSE.replace('"shock"', '"event"')
    with pytest.raises(
        InputError, match=r"2_shock' belongs to no stage of the case: give .* new run, which rem"
    ):
        run(renamed, longer, out=folder, restart=True)
    run(renamed, settings, out=folder)
    assert sorted(one.name for one in (folder / "stages").iterdir()) == ["1_gravity", "2_event"]


@pytest.mark.long
@pytest.mark.serial
def test_many_records_share_the_static_stages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What ida starts finds what single runs find, and solves one static stage for all: on a
    compliant base, which is assembled for each, and in the frame of the ground, where all share one
    body."""
    found = []
    solve = static.Equilibria.solve

    def counted(self: Any, old: Any, t: float) -> Any:
        found.append(t)
        return solve(self, old, t)

    monkeypatch.setattr(static.Equilibria, "solve", counted)
    base = HOUSE.split('[[stage]]\nname = "aftershock"')[0]
    frame = base.replace("release = true", "").replace(
        'dashpots = [{type = "CompliantBase", facets = "lower_bottom", motion = {dt = 0.002}}]',
        'fixed = "lower_bottom"',
    )
    for name, text in (("base", base), ("frame", frame)):
        folder = tmp_path / name
        folder.mkdir()
        settings = [
            ["run.t_end=0.1", "excitation.1.frequency=20", f"excitation.1.amplitude={a}"]
            for a in (5.0, 9.0)
        ]
        asked = {
            "case": str(case(folder, text).path),
            "allow": (),
            "settings": settings,
            "wall_time": None,
            "folders": [str(folder / f"{i}") for i in range(2)],
            "restart": [False, False],
        }
        found.clear()
        ended = dict(make_runs(asked, MPI.COMM_SELF, lambda share: None))
        assert len(found) == 1
        for number, setting in enumerate(settings):
            alone = case(folder, text, *setting).run(MPI.COMM_SELF, progress=False).history
            assert apart(ended[number].history, alone) < 1e-9
            assert np.ptp(alone["u_x_field" if name == "base" else "u_x_roof"]) > 1e-6


@pytest.mark.serial
def test_short_options_and_records_are_not_lost(tmp_path: Path) -> None:
    """They change the tables of the case; where the last stage has its own they would do nothing,
    and are refused."""
    head = HOUSE.split('[[stage]]\nname = "aftershock"')[0]
    assert ShortOptions(dt=0.001, scale=2.0).settings(case(tmp_path, head).tables) == [
        "run.dt=0.001",
        "excitation.1.amplitude=6.0",
    ]
    for option, table in ((ShortOptions(dt=0.001), "run"), (ShortOptions(scale=2.0), "excitation")):
        with pytest.raises(
            InputError, match=rf"\[{table}\], and the last .* has its own: .* stage.3.{table}"
        ):
            option.settings(case(tmp_path).tables)
    with pytest.raises(InputError, match=r"house.toml: ida changes \[excitation\], and the last"):
        gather_ground_motions(case(tmp_path))


STAGE = '[[stage]]\nname = "gravity"\n'
# what is replaced in the guide's case, by what, what the sentence says after the file's name
MISTAKES = {
    "key": (
        STAGE,
        STAGE + "sistem = 1\n",
        ": [[stage]] 1 has the unknown key 'sistem': did you mean system or s",
    ),
    "name": (
        'name = "shock"',
        'name = "../shock"',
        ": [[stage]] 2 has name = '../shock': give letters, dig",
    ),
    "type": (
        'type = "static"',
        'type = "gravity"',
        ": [[stage]] 1 has type = 'gravity': give \"stat",
    ),
    "release": (
        "release = true",
        'release = "yes"',
        ": [[stage]] 2: release is 'yes'; give True or False",
    ),
    "no list": (
        HOUSE[HOUSE.index("[[stage]]") :],
        "[stage]\nname = 1",
        ": [stage] is not a list of tables: write",
    ),
    "out": (
        "run = {dt = 0.002",
        'run = {out = "x", dt = 0.002',
        ": [[stage]] 3: run has the key 'out', which all",
    ),
    "moved while static": (
        STAGE,
        STAGE + "excitation = []\n",
        ": [[stage]] 1 is static and cannot use exci",
    ),
    "steps while static": (
        STAGE,
        STAGE + "run = {dtt = 0.5}\n",
        ": [[stage]] 1 is static and cannot use run.dtt",
    ),
    "unit while static": (
        STAGE,
        STAGE + 'run = {dt = "3 m"}\n',
        ": [[stage]] 1 is static and cannot use run.dt: ",
    ),
    "released first": (
        STAGE,
        STAGE + "release = true\n",
        ": [[stage]] 1 'gravity' has release = true, and is ",
    ),
    "friction": (
        'name = "shock"',
        'name = "shock"\nfriction = {type = "Coulomb", mu = 0.01}',
        ": [[stage]] 2 'shock' has another [friction] than the stage before it",
    ),
    "within": (
        '{fixed = "lower_bottom"}',
        "{fixt = 1}",
        ": [[stage]] 1 'gravity': [system] has the unknown key 'fixt' for assemble: did you mean "
        "fixed",
    ),
    "group": (
        '{fixed = "lower_bottom"}',
        '{fixed = "botom"}',
        ": [[stage]] 1 'gravity': [system] fixed is 'botom', but the mesh has no group 'botom'",
    ),
}


@pytest.mark.serial
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_one_sentence(tmp_path: Path, name: str) -> None:
    """File, stage, key and remedy, before anything is computed."""
    old, new, said = MISTAKES[name]
    assert HOUSE.count(old) == 1
    with pytest.raises(InputError) as told:
        case(tmp_path, HOUSE.replace(old, new)).meshed(MPI.COMM_SELF)
    assert f"{told.value}".startswith(f"{tmp_path / 'house.toml'}{said}"), f"{told.value}"


@pytest.mark.long
def test_another_friction_comes_with_a_static_stage(shared_tmp: Path) -> None:
    """As the refusal of another one in a motion says: under the new law the house slips to rest,
    and stays there."""
    law = 'system = {fixed = "lower_bottom"}\nfriction = {type = "Coulomb", mu = 0.01}\n'
    text = (
        HOUSE.split('[[stage]]\nname = "shock"')[0]
        + f'[[stage]]\nname = "wet"\ntype = "static"\n{law}'
        f'[[stage]]\nname = "still"\ntype = "dynamic"\n{law}excitation = []\nrun = {{dt = 0.001, '
        f"t_end = 0.02}}\n"
    )
    found = case(shared_tmp, text).run(COMM, out=shared_tmp / "run", progress=False).history
    dry = vc.read_run(shared_tmp / "run" / "stages" / "1_gravity").history
    wet = vc.read_run(shared_tmp / "run" / "stages" / "2_wet").history
    assert wet["contact_max_slip"][0] > 1e-3 * np.abs(wet["u_y_roof"][0]) > 0.0
    assert dry["contact_max_slip"][0] < 0.3 * wet["contact_max_slip"][0]
    assert np.ptp(found["contact_max_slip"]) < 1e-9 * wet["contact_max_slip"][0]
    assert found["energy_kinetic"].max() < 1e-15 * found["energy_strain"][0]


@pytest.mark.long
def test_what_stages_cannot_do(shared_tmp: Path) -> None:
    """Other supports after a motion; loads that begin with a motion."""
    moved = HOUSE.replace('name = "aftershock"', 'name = "aftershock"\nrelease = true').replace(
        "run = {dt = 0.002, t_end = 0.2}", "run = {steps = 1}"
    )
    head, tail = moved.rsplit("system = {", 1)
    held = f'{head}system = {{fixed = "lower_bottom"}}\n' + tail.split("\n", 1)[1]
    with pytest.raises(
        InputError, match=r"3 'aftershock': it has other supports than the dynamic stage before"
    ):
        case(shared_tmp, held, "run.t_end=0.004").run(COMM, progress=False)
    sudden = STILL.replace("[gravity] ", "# ").replace(
        'name = "shock"', 'name = "shock"\ngravity = {}'
    )
    with pytest.raises(
        InputError, match=r"2 'shock': .* N are missing where no support was released"
    ):
        case(shared_tmp, sudden).run(COMM, progress=False)
