"""Cases without a mesh, [beam] and [particle], and the law [layer]: they compute what the rooms do,
go on after a stop, are described, and refuse what does not go with them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import beam, layer
from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case, refine, report
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.description.words import put_in_words
from vi_contact.practice.studies.cases.library import locate

pytestmark = pytest.mark.serial
COMM = MPI.COMM_WORLD
SMALL = ["beam.elements.count=20", "run.dt=0.01", "run.t_end=0.5"]
BLOCK = """
[mesh]
type = "BlockMesh"
lengths = [1.0, 0.1]
divisions = [1, 1]
[material.stiff]
E = 1e9
nu = 0.0
rho = 1.0
[system]
initial_velocity = [0.0, -1.0]
[[contact]]
facets = "bottom"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}
[layer]
e = 0.5
mass = 0.1
speed = 1.0
width = 0.01
[run]
dt = 2.5e-4
t_end = 0.05
"""


def alike(one: vc.Solution, other: vc.Solution) -> None:
    """Two runs have the same histories, to the last bit."""
    assert set(one.history) == set(other.history)
    for name, column in one.history.items():
        assert np.array_equal(column, other.history[name], equal_nan=True), name


def beam_of_python(kind: str) -> vc.ContactProblem:
    """The problem of the case that ships, with 20 elements, or one of its likes."""
    elements, start = beam.Elements(20), beam.published_start()
    rod = beam.Rod(viscosity=0.002, gap=0.05, body_force=lambda t: 20.0 * (t <= 1.5))
    body = beam.TimoshenkoBeam(viscosity=0.001)
    if kind == "rod_problem":
        return beam.rod_problem(rod, elements)
    friction = vc.Coulomb(0.3)
    if kind == "rubbing_problem":
        return beam.rubbing_problem(rod, body, elements, friction=friction, start=start)
    force = {"normal_force": lambda t: 100.0, "load": lambda t: 5.0}
    return beam.beam_problem(body, elements, friction=friction, start=start, **force)


KINDS = {
    "rubbing_problem": [],
    "rod_problem": [
        'beam={type="rod_problem", elements={count=20}, rod={viscosity=0.002, gap=0.05, '
        'body_force="20*step(1.5 - t)"}}',
        "record.3=",
        "friction=",
    ],
    "beam_problem": [
        'beam={type="beam_problem", elements={count=20}, beam={viscosity=0.001}, load=5.0, '
        'normal_force="0.1 kN", start={u="-x/200", v="-x"}}'
    ],
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_beam_of_a_case_is_that_of_the_room(kind):
    """The numbers of a case and of the Python interface are the same."""
    settings = [*KINDS[kind], *SMALL[1:]] if KINDS[kind] else SMALL
    found = read_case(locate("beam"), settings).run(COMM, progress=False)
    record = [vc.Energy(), vc.Contact(), vc.Probe({"tip": (5.0, 0.0)})]
    own = vc.simulate(
        beam_of_python(kind),
        scheme=vc.MoreauJean(),
        dt=0.01,
        t_end=0.5,
        record=record[: 2 if kind == "rod_problem" else 3],
        progress=False,
    )
    alike(found, own)
    assert found.facts["worst_certificate"] < 1e-12 and found.facts["energy_defect"] < 1e-10


@pytest.mark.long
def test_a_particle_returns_as_its_layer_was_asked_to():
    """e is found to the order of the time step, and the case is that of the room."""
    found = read_case(locate("layer")).run(COMM, progress=False)
    history = found.history
    left = np.sqrt(history["energy_kinetic"][-1] / history["energy_kinetic"][0])
    assert left == pytest.approx(0.7, rel=2e-4)
    assert history["contact_min_gap"].min() > 0.0 and history["gap"][0] == pytest.approx(0.15)
    assert found.facts["worst_certificate"] < 1e-12
    law = layer.contact_layer(0.7, mass=1.0, speed=1.0, width=0.05)
    problem = layer.particle_problem(1.0, speed=1.0, distance=0.15)
    record = [vc.Energy(), vc.Contact(), vc.Probe({"particle": (0.0,)})]
    scheme = layer.BoundaryLayer(law=law)
    own = vc.simulate(problem, scheme=scheme, dt=1e-3, t_end=0.5, record=record, progress=False)
    np.testing.assert_allclose(history["u_x_particle"], own.history["u_x_particle"], atol=1e-12)


def test_a_particle_may_have_an_impact_law_in_place_of_a_layer():
    settings = ["layer=", 'impact={type="Newton", e=0.5}', "scheme.type=ZienkiewiczWoodTaylor"]
    history = read_case(locate("layer"), settings).run(COMM, progress=False).history
    left = history["energy_kinetic"][-1] / history["energy_kinetic"][0]
    assert left == pytest.approx(0.25, rel=1e-9)


def test_the_force_of_a_particle_acts_towards_the_wall():
    """Far from the wall it moves by s = v t + f t²/(2 m)."""
    settings = ["particle.distance=10.0", "particle.force=3.0", "particle.mass=2.0"]
    history = read_case(locate("layer"), settings).run(COMM, progress=False).history
    t = history["t"]
    np.testing.assert_allclose(history["u_x_particle"], t + 0.75 * t**2, rtol=1e-9, atol=1e-12)


def test_a_motion_shakes_a_particle_along_its_way(tmp_path):
    """In the frame of the ground, u'' = -a, before the particle is at the layer."""
    t = 0.01 * np.arange(11)
    np.savetxt(tmp_path / "motion.txt", np.column_stack([t, 0.0 * t + 2.0]), fmt="%.6f")
    out, more = str(tmp_path / "out"), ["--set", "excitation.1.record.units=m/s2"]
    words = ["run", "layer", "--motion", str(tmp_path / "motion.txt"), *more]
    assert main([*words, "--set", "particle.distance=1.0", "--quiet", "--out", out]) == 0
    history = vc.read_run(out).history
    found = history["u_x_particle"][-1]
    assert history["t"][-1] == pytest.approx(0.1) and found == pytest.approx(0.09, rel=1e-9)


@pytest.mark.long
def test_a_body_with_a_mesh_may_have_a_layer(tmp_path):
    """A stiff block that starts at rest on its support, moving into it, returns at half its
    speed: the layer stands before the support."""
    case = tmp_path / "block.toml"
    case.write_text(BLOCK)
    history = read_case(case).run(COMM, progress=False).history
    left = np.sqrt(history["energy_kinetic"][-1] / history["energy_kinetic"][0])
    assert left == pytest.approx(0.5, rel=2e-3)
    assert history["contact_min_gap"].min() > 0.0


@pytest.mark.long
@pytest.mark.parametrize("name", ["beam", "layer"])
def test_a_run_goes_on_after_a_stop(name, tmp_path):
    """A run that has stopped half way, within the layer too, ends as one that has not."""
    settings = SMALL if name == "beam" else []
    end = "run.t_end=0.25" if name == "beam" else "run.t_end=0.13"
    read_case(locate(name), [*settings, end]).run(COMM, out=tmp_path / "two", progress=False)
    for out, restart in (("two", True), ("one", False)):
        read_case(locate(name), settings).run(
            COMM, out=tmp_path / out, restart=restart, progress=False
        )
    one, two = ((tmp_path / out / "history.csv").read_bytes() for out in ("one", "two"))
    assert one == two


@pytest.mark.slow
@pytest.mark.parametrize("name", ["beam", "layer"])
def test_a_run_folder_is_whole_and_is_reported(name, tmp_path):
    settings = SMALL if name == "beam" else ["run.dt=0.002"]
    read_case(locate(name), settings).run(COMM, out=tmp_path, progress=False)
    kept = {path.name for path in tmp_path.iterdir()}
    assert {"case.toml", "history.csv", "history.h5", "model.json", "summary.json"} <= kept
    model = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert model["contact"][0]["points"] == 1 and not model["defects"]
    _, files = report(tmp_path, out=tmp_path / "report.pdf")
    assert all(path.stat().st_size > 0 for path in files) and len(files) >= 3


@pytest.mark.slow
def test_a_beam_is_refined_and_a_particle_has_no_elements(tmp_path):
    read_case(locate("beam"), SMALL).run(COMM, out=tmp_path / "beam", progress=False)
    assert refine(tmp_path / "beam", COMM, progress=False) == {}
    finer = json.loads((tmp_path / "beam" / "refined" / "h" / "model.json").read_text())
    assert finer["bodies"][0]["cells"] == 40
    read_case(locate("layer")).run(COMM, out=tmp_path / "layer", progress=False)
    failed = refine(tmp_path / "layer", COMM, progress=False)
    assert failed == {"h": "a particle has no elements to halve: halve the time step alone"}


def test_check_describes_a_beam(tmp_path, capsys):
    out = str(tmp_path / "run")
    assert main(["run", "beam", "--check", "--out", out]) == 0
    said = capsys.readouterr().out
    lines = [line.split() for line in said.splitlines()]
    assert ["tip:", "gap", "at", "the", "start", "50", "mm"] in lines
    assert ["tip:", "friction", "mu", "=", "0.3", "Coulomb"] in lines
    assert ["beam:", "mass", "5", "kg", "200", "cells"] in lines
    assert ["start", "fixed", "along", "x,", "y"] in lines
    assert ["body_force", "20", "N/m", "20", "at", "the", "start,"] in [one[:7] for one in lines]
    assert (tmp_path / "run" / "model.png").stat().st_size > 0
    model = describe(read_case(locate("beam"), SMALL), COMM)
    # of the clamped rod, c = 10 m/s: 4 l/c
    assert model["periods"][1] == pytest.approx(2.0, rel=1e-3)
    assert model["mass"] == 5.0 and model["waves"][0]["c_s"] == 10.0


def test_check_describes_a_particle_and_warns_of_a_step_too_long_for_the_layer():
    model = describe(read_case(locate("layer"), ["run.dt=0.01"]), COMM)
    lines = [line.split() for line in put_in_words(model).splitlines()]
    assert ["particle:", "mass", "1", "kg"] in lines
    assert ["particle:", "gap", "at", "the", "start", "150", "mm"] in lines
    assert ["width", "of", "the", "layer", "50", "mm", "passed", "in", "0.05", "s"] in lines
    (warning,) = model["warnings"]
    assert "longer than a tenth of the time in which a body passes the layer" in warning
    assert describe(read_case(locate("layer"), ["run.dt=0.005"]), COMM)["warnings"] == []


REFUSED = {
    "beam": {
        "gravity={}": r"\[gravity\] is for a body with a \[mesh\], and \[beam\] is .* give its",
        'mesh.type="WallMesh"': r"\[mesh\] and \[beam\] are two bodies: leave one of them out",
        "particle.mass=1.0": r"\[beam\] and \[particle\] are two bodies: leave one of them out",
        'contact.facets="a"': r"\[contact\] is for a body with a \[mesh\]",
        'mass.type="ConsistentMass"': r"\[mass\] is .*: leave it out, as the body keeps its",
        'stage=[{name="a", type="static"}]': r"\[stage\] is for a body with a \[mesh\]",
        "material.a.E=1.0": r"\[material\] is for a body with a \[mesh\]",
        "beam.rod.length=4.0": r"\[beam\] the rod is 4 m long and the beam 5 m: they are one body",
        "beam.beam.E=-1": r"\[beam.beam\] TimoshenkoBeam: E is -1.0; give a finite number above",
        "beam.elements.count=1": r"\[beam.elements\] Elements: count is 1; give a whole number",
        'beam.start.u="y"': r"\[beam.start\] the expression 'y' has y, .* use these only",
        'beam.rod.body_force="20 N"': r"\[beam.rod\] body_force is '20 N': .* give it in N/m",
        'beam.type="bar"': r"\[beam\] has the unknown type 'bar': Known: rod_problem, beam_pro",
        'beam.type="rod_problem"': r"\[beam\] has the unknown key 'beam' for rod_problem",
        'record=[{type="Resultants", part="a", centre=[0.0, 0.0]}]': (
            r"\[record\[1\]\] part is 'a', and \[beam\] has no mesh with groups: leave it out"
        ),
    },
    "layer": {
        "particle.speed=": r"\[particle\] lacks the key 'speed', which particle_problem needs",
        "particle.mass=0": r"\[particle\] particle_problem: mass is 0.0; give .* above zero in kg",
        "layer.e=0": r"\[layer\] contact_layer: the restitution coefficient e is 0.0; give a num",
        'layer.metric="full"': r"\[layer\] metric is \"full\": give 'blended' or 'flat'",
        'scheme.type="HHT"': r"\[scheme\] does not go with \[layer\], which has a time scheme of",
        'impact.type="Inelastic"': r"\[impact\] does not go with \[layer\], which makes the rebou",
        "friction.mu=0.5": r"\[friction\] does not go with \[layer\], which is a law without fric",
        "particle=": r"the table \[mesh\] is missing: .* or \[beam\] or \[particle\] in its place",
    },
}


@pytest.mark.parametrize(
    ("name", "setting"), [(name, one) for name, every in REFUSED.items() for one in every]
)
def test_what_does_not_go_together_is_refused(name, setting):
    """In one sentence, with the file, the table and a remedy, before a step is computed."""
    with pytest.raises(InputError, match=REFUSED[name][setting]) as error:
        read_case(locate(name), [setting]).check()
    assert str(error.value).startswith(str(locate(name))) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            "[[contact]]",
            "[[contact]]\nroller = true",
            "[[contact]] has roller, and [layer] is a law",
        ),
        ("[layer]", "[gravity]\n[layer]", "[gravity] does not go with [layer], which does not"),
        (r"[[contact]]", None, "[layer] has no effect, as nothing touches without [[contact]]"),
    ],
)
def test_what_does_not_go_with_a_layer_is_refused(old, new, says, tmp_path):
    case = tmp_path / "block.toml"
    alone = re.sub(r"\[\[contact\]\].*?\[layer\]", "[layer]", BLOCK, flags=re.DOTALL)
    case.write_text(alone if new is None else BLOCK.replace(old, new))
    with pytest.raises(InputError, match=re.escape(says)):
        read_case(case).check()


@pytest.mark.long
def test_friction_of_a_body_that_cannot_slide_is_refused(tmp_path):
    """In the file itself; after ``--set`` it has nothing to act on, and is let be."""
    text = Path(locate("beam")).read_text(encoding="utf-8")
    straight = 'beam={type="rod_problem", elements={count=20}, rod={gap=0.05}}'
    assert read_case(locate("beam"), [straight, "record.3=", *SMALL[1:]]).run(COMM, progress=False)
    case = tmp_path / "rod.toml"
    case.write_text(
        re.sub(r"\[beam.beam\].*?\[friction\]", "[friction]", text, flags=re.DOTALL)
        .replace('"rubbing_problem"', '"rod_problem"')
        .replace('start = {u = "-x/200", v = "-x"}', "")
    )
    with pytest.raises(InputError, match=r"\[friction\] has no effect, as the tip of a rod moves"):
        read_case(case)


def test_a_body_without_a_mesh_takes_one_process():
    class Two:
        size = 2

    case = read_case(locate("beam"))
    with pytest.raises(InputError, match=r"\[beam\] is computed by one process, and there are 2"):
        case.parts(Two())
