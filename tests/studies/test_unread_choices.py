"""Choices without effect: each is refused in one sentence with its table and a remedy that works,
and every key of the laws and materials of case files changes the model, or is refused."""

from __future__ import annotations

import re
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.toml_file import format_value

COMM = MPI.COMM_WORLD
CASE = """
[mesh]
type = "TwoBlocks"
lower = {lengths = [3.0, 1.0], divisions = [3, 1]}
upper = {lengths = [1.0, 1.0], divisions = [1, 1]}
offset = [1.0]
[material.lower]
E = 1e8
nu = 0.2
rho = 2000.0
[material.upper]
E = 1e8
nu = 0.2
rho = 2000.0
[system]
fixed = "lower_bottom"
[[contact]]
type = "contact_pair"
facets1 = "upper_bottom"
facets2 = "lower_top"
[run]
dt = 1e-3
steps = 2
"""
RUBS = '[friction]\ntype = "Coulomb"\nmu = 0.5\n'
STRIKES = '[impact]\ntype = "Inelastic"\n[scheme]\ntype = "ZienkiewiczWoodTaylor"\n'
SHAKES = '[[excitation]]\ntype = "Ricker"\namplitude = 3.0\nfrequency = 4.0\n'
REACTIONS = (
    '[[record]]\ntype = "Reactions"\nname = "rock"\nfacets = "lower_bottom"\ncentre = [0.0, 0.0]\n'
    "gravity = [0.0, -9.80665]\n"
)
WEIGHS = '[[system.loads]]\ntype = "BodyForce"\nvalue = [0.0, -19620.0]\n'
STATIC = '[[stage]]\nname = "rest"\ntype = "static"\n'
MOVES = '[[stage]]\nname = "motion"\ntype = "dynamic"\n'
ALONE = re.sub(r"\[\[contact\]\](.*?)\[run\]", "[run]", CASE, flags=re.DOTALL)
SIDES = [f'facets = "lower_{side}"' for side in ("left", "right", "top")]
SPRINGS = CASE.replace(
    'type = "contact_pair"\nfacets1 = "upper_bottom"\nfacets2 = "lower_top"',
    'facets = "upper_top"\nsprings = 1e9\nobstacle = {type = "HalfSpace", point = [0.0, 2.0], '
    "normal = [0.0, -1.0]}",
)


def added(table: str, line: str, text: str = CASE) -> str:
    """The case with a line more in a table."""
    return text.replace(f"[{table}]\n", f"[{table}]\n{line}\n", 1)


# name -> (a case, what its sentence says after the file's name, the same case with the remedy of
# the sentence)
VAIN: dict[str, tuple[str, str, str]] = {
    "law without ratios": (
        added("system", 'damping = {type = "DampingRatio", frequency = 5.0}'),
        ": [system.damping] DampingRatio damps by the ratios of the materials, and none has one: "
        "give [material.lower] xi = 0.05, or another type of damping",
        added(
            "system",
            'damping = {type = "DampingRatio", frequency = 5.0}',
            added("material.lower", "xi = 0.05"),
        ),
    ),
    "ratios without law": (
        added("material.upper", 'xi = "3 %"'),
        ": [material.upper] has xi, which no damping reads here: give [system] damping = {type = "
        '"DampingRatio", '
        "frequency = …} with a frequency in Hz, or leave xi out",
        added(
            "material.upper",
            'xi = "3 %"',
            added("system", 'damping = {type = "DampingRatio", frequency = 5.0}'),
        ),
    ),
    "ratios under another law": (
        added(
            "material.upper",
            "xi = 0.03",
            added("system", 'damping = {type = "Rayleigh", alpha = 1.0, beta = 0.0}'),
        ),
        ": [material.upper] has xi, which no damping reads here",
        added("system", 'damping = {type = "Rayleigh", alpha = 1.0, beta = 0.0}'),
    ),
    "law of zeros": (
        added("system", 'damping = {type = "Rayleigh", alpha = 0.0, beta = 0.0}'),
        ': [system] assemble: [system.damping] type = "Rayleigh" and alpha = 0.0 and beta = 0.0 '
        "damps nothing, as its coefficients are zero",
        CASE,
    ),
    "material of nothing": (
        added("system", 'material = [["lower", "lower"], ["upper", "lower"]]'),
        ": [material.upper] is of nothing, as [system] does not name it: give its cell group in "
        "[system] material",
        CASE,
    ),
    "material of no group": (
        CASE + "[material.spare]\nE = 1e8\nnu = 0.2\nrho = 2000.0\n",
        ": [system] material[3][1] is 'spare', but the",
        CASE,
    ),
    "friction of nothing": (
        ALONE + RUBS,
        ": [friction] has no effect, as nothing rubs without [[contact]]",
        CASE + RUBS,
    ),
    "impact of nothing": (
        ALONE + STRIKES,
        ": [impact] has no effect, as nothing strikes without [[contact]]",
        CASE + STRIKES,
    ),
    "mass of nothing": (
        ALONE + '[mass]\ntype = "Redistributed"\n',
        ": [mass] has no effect, as nothing touches without [[contact]]",
        CASE + '[mass]\ntype = "Redistributed"\n',
    ),
    "impact on springs": (
        SPRINGS + STRIKES,
        ": [impact] has no effect, as every [[contact]] has springs, which do not collide",
        SPRINGS + '[scheme]\ntype = "ZienkiewiczWoodTaylor"\n',
    ),
    "impact without mass": (
        CASE + '[impact]\ntype = "Inelastic"\n[scheme]\ntype = "Trapezoidal"\n',
        '[impact] type = "Inelastic"',
        CASE + STRIKES,
    ),
    "method with friction": (
        CASE + RUBS + '[solver]\ntype = "Condensed"\nmethod = {type = "Hildreth"}\n',
        ": [solver] method is for contact without friction, and [friction] is given: give "
        "friction_method in its place",
        CASE + RUBS + '[solver]\ntype = "Condensed"\nfriction_method = {type = "NSGS"}\n',
    ),
    "method without friction": (
        CASE + '[solver]\ntype = "Condensed"\nfriction_method = {type = "NSGS"}\n',
        ": [solver] friction_method is for contact with friction, and there is no [friction]",
        CASE + RUBS + '[solver]\ntype = "Condensed"\nfriction_method = {type = "NSGS"}\n',
    ),
    "rates without rates": (
        CASE + RUBS + '[solver]\ntype = "Condensed"\nrates = {type = "RateIteration"}\n',
        ": [solver] rates is for friction that depends on the slip rate, and Coulomb does not",
        CASE + RUBS,
    ),
    "mu of another law": (
        CASE + '[friction]\ntype = "Tresca"\nthreshold = 1e4\nmu = 0.5\n',
        "has the unknown key 'mu' for Tresca",
        CASE + RUBS,
    ),
    "the same solver again": (
        CASE + '[solver]\ntype = "Condensed"\n[[escalation]]\ntype = "Condensed"\n',
        ": [[escalation]] names Condensed with the same keys as the solver before it, which has "
        "failed by then",
        CASE + '[solver]\ntype = "Condensed"\n[[escalation]]\ntype = "Volume"\n',
    ),
    "options of another solver": (
        CASE + '[gravity]\n[solver]\ntype = "Volume"\npetsc_options = {pc_typ = "lu"}\n',
        "nothing reads 'pc_typ' of petsc_options: did you mean 'pc_type'?",
        CASE + '[gravity]\n[solver]\ntype = "Volume"\npetsc_options = {pc_type = "lu"}\n',
    ),
    "weight and body force": (
        CASE + WEIGHS + "[gravity]\n",
        ": [gravity] with_weight: the system has this weight already among its constant "
        "loads, as a BodyForce or from an earlier with_weight, and would weigh twice as much; "
        "leave one of the two out",
        CASE + "[gravity]\n",
    ),
    "weight of nothing": (
        CASE + "[gravity]\nacceleration = 0.0\n",
        ": [gravity] with_weight: no unknown feels the weight",
        CASE + "[gravity]\nacceleration = 9.0\n",
    ),
    "weight of what is held": (
        added("system", f"prescribed = [{{{SIDES[0]}}}, {{{SIDES[1]}}}, {{{SIDES[2]}}}]", ALONE)
        + '[gravity]\ncells = "lower"\n',
        "no unknown feels the weight",
        CASE + '[gravity]\ncells = "upper"\n',
    ),
    "a comparison with nothing": (
        CASE + '[solver]\ntype = "CrossChecked"\nprimary = {type = "Condensed"}\nothers = []\n',
        ": [solver] CrossChecked: others names no solver, so that nothing is compared",
        CASE
        + (
            '[solver]\ntype = "CrossChecked"\nprimary = {type = "Condensed"}\nothers = [{type '
            '= "Volume"}]\n'
        ),
    ),
    "weight of a recorder": (
        CASE + REACTIONS,
        ": [[record]] Reactions has gravity, and the body has no weight: give [gravity], or leave "
        "it out",
        CASE + "[gravity]\n" + REACTIONS,
    ),
    "halved without contact": (
        ALONE.replace("dt = 1e-3", 'dt = {type = "HalvedAtImpact", dt = 1e-3}'),
        ": [run] dt is HalvedAtImpact, which halves nothing without [[contact]]",
        CASE.replace("dt = 1e-3", 'dt = {type = "HalvedAtImpact", dt = 1e-3}'),
    ),
    "mass of scheme and problem": (
        CASE
        + (
            '[mass]\ntype = "ConsistentMass"\n[scheme]\ntype = "Trapezoidal"\nmass = {type = '
            '"Redistributed"}\n'
        ),
        ": [scheme] mass is not read, as [mass] comes before it: leave one of the two out",
        CASE + '[mass]\ntype = "ConsistentMass"\n[scheme]\ntype = "Trapezoidal"\n',
    ),
    "a load twice": (
        CASE + 2 * WEIGHS,
        ": [[system.loads]] has two tables that are alike, word for word: leave one of them out",
        CASE + WEIGHS,
    ),
    "an excitation twice": (
        CASE + 2 * SHAKES,
        ": [[excitation]] has two tables that are alike, word for word: leave one of them out",
        CASE + SHAKES,
    ),
    "velocity before rest": (
        added("system", "initial_velocity = [0.0, 1.0]") + "[gravity]\n",
        ": [system] initial_velocity is lost, as [gravity] lets the body begin at rest, in "
        "equilibrium",
        added("system", "initial_velocity = [0.0, 1.0]"),
    ),
    "base without motion": (
        added("system", "base_inertia = false"),
        ": [system] base_inertia is about the inertia load of a ground motion",
        added("system", "base_inertia = false") + SHAKES,
    ),
    "table of no stage": (
        CASE
        + "[gravity]\n"
        + STATIC
        + "gravity = {acceleration = 9.0}\n"
        + MOVES
        + "gravity = {acceleration = 9.0}\n",
        ": [gravity] is read by no stage, as every [[stage]] that could read it has its own",
        CASE
        + STATIC
        + "gravity = {acceleration = 9.0}\n"
        + MOVES
        + "gravity = {acceleration = 9.0}\n",
    ),
    "key of no stage": (
        CASE
        + "[gravity]\n"
        + STATIC
        + 'system = {fixed = "lower_bottom"}\n'
        + MOVES
        + 'system = {fixed = "lower_bottom"}\n',
        ": [system] fixed is read by no stage, as every [[stage]] has its own",
        CASE + "[gravity]\n" + STATIC + MOVES,
    ),
    "start of a later stage": (
        CASE + "[gravity]\n" + STATIC + MOVES + "system = {initial_velocity = [0.0, 1.0]}\n",
        "system has initial_velocity, and a stage begins where the stage before has left the body",
        CASE + "[gravity]\n" + STATIC + MOVES,
    ),
    "release of nothing": (
        CASE + "[gravity]\n" + STATIC + MOVES + "release = true\n",
        ": [[stage]] 'motion' has release = true, and the supports of the stage before it",
        CASE + "[gravity]\n" + STATIC + MOVES,
    ),
    "section of another dimension": (
        added("system", 'section = {type = "Solid"}'),
        ': [system] assemble: [system.section] type = "Solid" is for a body in space and this '
        "one is plane",
        added("system", 'section = {type = "PlaneStress", thickness = 2.0}'),
    ),
    "thickness in space": (
        added(
            "system",
            'section = {type = "PlaneStress", thickness = 2.0}',
            CASE.replace("[3.0, 1.0]", "[3.0, 1.0, 1.0]")
            .replace("[3, 1]", "[3, 1, 1]")
            .replace("[1.0, 1.0]", "[1.0, 1.0, 1.0]")
            .replace("[1, 1]", "[1, 1, 1]"),
        ),
        "is a section of a plane body and this one has three dimensions",
        CASE,
    ),
}


def written(folder: Path, text: str) -> Path:
    path = folder / "case.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


# most are told when the file is read; those of Python below are found on several ranks
@pytest.mark.serial
@pytest.mark.parametrize("name", VAIN)
def test_a_choice_in_vain_is_refused(shared_tmp: Path, name: str) -> None:
    """In a sentence with table and remedy; the case with the remedy runs."""
    text, words, better = VAIN[name]
    with pytest.raises(InputError) as caught:
        read_case(written(shared_tmp, text)).run(COMM, progress=False)
    assert words in str(caught.value) and "\n" not in str(caught.value)
    (shared_tmp / "better").mkdir(exist_ok=True)
    solution = read_case(written(shared_tmp / "better", better)).run(COMM, progress=False)
    assert solution.facts["status"] == "finished"


@pytest.mark.serial
def test_the_case_itself_runs(tmp_path: Path) -> None:
    """What all of these begin with is in order, and so are the commands that check it."""
    assert (
        read_case(written(tmp_path, CASE)).run(COMM, progress=False).facts["status"] == "finished"
    )
    path = str(written(tmp_path, CASE))
    assert main(["run", path, "--check", "--quiet", "--out", str(tmp_path / "out")]) == 0


@pytest.mark.serial
def test_settings_may_leave_laws_of_the_file_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """``--set contact=`` asks for the body without contact; a law that is set beside it is in
    vain."""
    # or it would fly
    held = CASE.replace('fixed = "lower_bottom"', 'fixed = ["lower_bottom", "upper_top"]')
    path = str(written(tmp_path, held + RUBS + STRIKES))
    assert main(["run", path, "--quiet", "--out", str(tmp_path / "out"), "--set", "contact="]) == 0
    capsys.readouterr()
    command = [
        "run",
        path,
        "--quiet",
        "--out",
        str(tmp_path / "out"),
        "--set",
        "contact=",
        "--set",
        "friction.mu=0.3",
    ]
    assert main(command) == 1
    assert (
        "[friction] has no effect, as nothing rubs without [[contact]]" in capsys.readouterr().err
    )
    for option in (["--restart"], ["--restart-changed"], ["--wall-time", "10:00"]):
        assert (
            main(["run", path, "--check", "--quiet", "--out", str(tmp_path / "out"), *option]) == 1
        )
        assert (
            f"{option[0]} has no effect with --check, which computes no step"
            in capsys.readouterr().err
        )


def test_motions_of_static_stages_are_told(shared_tmp: Path) -> None:
    """The weight alone is looked at before the motion is added: a warning of ``run --check``, and
    no refusal."""
    text = CASE + RUBS + SHAKES + "[gravity]\n" + STATIC
    model = describe(read_case(written(shared_tmp, text)), COMM)
    (said,) = [one for one in model["warnings"] if "static" in one]
    assert said.startswith("[excitation] of ") and said.endswith(
        "is not read, as every [[stage]] is static"
    )


# The same in Python
# --------------------------------------------------------------------------------------------------
MATERIAL = vc.LinearElastic(E=1e8, nu=0.2, rho=2000.0)


def block() -> tuple[Any, Any]:
    return fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), COMM)


def assembled(**options: Any) -> Any:
    mesh, tags = block()
    given = {name: one(mesh, tags) if callable(one) else one for name, one in options.items()}
    return fem.assemble(mesh, MATERIAL, **{"clamped": tags["left"]} | given)


def none(mesh: Any) -> Any:
    """A boundary group without facets."""
    return fem.Facets("none", np.zeros(0, dtype=np.int32), mesh)


def shaken_twice() -> Any:
    system, wave = assembled(), vc.Ricker(1.0, 4.0)
    return vc.ContactProblem(system, empty_surface(system.algebra.comm, 2), excitation=[wave, wave])


def without_contact(**laws: Any) -> Any:
    system = assembled()
    return vc.ContactProblem(system, empty_surface(system.algebra.comm, 2), **laws)


def two_loads(mesh: Any, tags: Any) -> Any:
    return 2 * [fem.BodyForce((1.0, 0.0))]


PYTHON = {
    "weight twice": (
        lambda: vc.with_weight(vc.with_weight(assembled())),
        "the system has this weight already",
    ),
    "weight by 9.81": (
        lambda: vc.with_weight(assembled(loads=fem.BodyForce((0.0, -2000.0 * 9.81)))),
        "weight already",
    ),
    "no weight": (
        lambda: vc.with_weight(assembled(), acceleration=0.0),
        "no unknown feels the weight",
    ),
    "a load twice": (
        lambda: assembled(loads=two_loads),
        "loads names one BodyForce twice, which would act twice",
    ),
    "a motion twice": (shaken_twice, "excitation names .* twice, which would shake twice"),
    "nothing clamped": (
        lambda: assembled(clamped=lambda mesh, _: none(mesh)),
        "'none' of clamped has no facets",
    ),
    "nothing loaded": (
        lambda: assembled(loads=lambda mesh, _: fem.Traction(none(mesh), (1.0, 0.0))),
        "'none' of loads has no facets",
    ),
    "nothing prescribed": (
        lambda: assembled(prescribed=lambda mesh, _: fem.Prescribed(none(mesh))),
        "'none' of prescribed has no facets",
    ),
    "solid in the plane": (
        lambda: assembled(section=vc.Solid()),
        r"Solid\(\) is for a body in space",
    ),
    "mass of scheme and problem": (
        lambda: vc.simulate(
            without_contact(mass=vc.Redistributed()),
            dt=0.1,
            steps=1,
            scheme=vc.Trapezoidal(vc.ConsistentMass()),
        ),
        "mass=ConsistentMass.* is not read",
    ),
    "changed without restart": (
        lambda: vc.simulate(without_contact(), dt=0.1, steps=1, changed=True),
        "changed=True is for a run that is continued",
    ),
}


@pytest.mark.parametrize("name", PYTHON)
def test_a_choice_in_vain_is_refused_in_python(name: str) -> None:
    make, words = PYTHON[name]
    with pytest.raises(InputError, match=words):
        make()


def test_weights_that_add_up_are_taken() -> None:
    """Along another direction, of other bodies, buoyancy against it, and a load of another size."""
    system = vc.with_weight(assembled(loads=fem.BodyForce((0.0, 1000.0 * 9.80665))))
    pushed = vc.with_weight(system, acceleration=3.0, direction=(1.0, 0.0))
    plain = vc.with_weight(assembled(loads=fem.BodyForce((0.0, -0.5 * 2000.0 * 9.80665))))
    totals = [
        COMM.allreduce(float(one.load.constant @ one.influence[:, 1]), MPI.SUM)
        for one in (pushed, plain)
    ]
    # 1.5 and 0.5 times the weight, less at a side
    assert totals[1] == pytest.approx(3.0 * totals[0], rel=0.2)


# Every key of the laws changes the model
# ------------------------------------------------------------------------------ A block that flies
# at another one and slides on it: small, and every law that it may have does something.
FLIGHT: dict[str, Any] = {
    "mesh": {
        "type": "TwoBlocks",
        "lower": {"lengths": [3.0, 1.0], "divisions": [6, 2]},
        "upper": {"lengths": [1.0, 1.0], "divisions": [2, 2]},
        "offset": [1.0],
        "gap": 2e-3,
    },
    "material": {
        "lower": {"E": 1e8, "nu": 0.2, "rho": 2000.0},
        "upper": {"E": 1e8, "nu": 0.2, "rho": 2000.0},
    },
    "system": {"fixed": "lower_bottom", "initial_velocity": [1.0, -1.0]},
    "contact": {"type": "contact_pair", "facets1": "upper_bottom", "facets2": "lower_top"},
    "run": {"dt": 1e-3, "steps": 10},
    "record": [
        {"type": "Energy"},
        {"type": "Contact"},
        {"type": "Probe", "points": {"top": [1.0, 2.002]}},
    ],
}
SPACE = {
    "mesh": {
        "type": "TwoBlocks",
        "lower": {"lengths": [3.0, 1.0, 1.0], "divisions": [6, 2, 2]},
        "upper": {"lengths": [1.0, 1.0, 1.0], "divisions": [2, 2, 2]},
        "offset": [1.0, 0.0],
        "gap": 2e-3,
    },
    "system.initial_velocity": [1.0, -1.0, 0.3],
    "contact": {"type": "contact_pair", "facets1": "upper_bottom", "facets2": "lower_top"},
    "scheme": {"type": "ZienkiewiczWoodTaylor"},
    "record": [
        {"type": "Energy"},
        {"type": "Contact"},
        {"type": "Probe", "points": {"top": [1.0, 2.002, 0.0]}},
    ],
}
FINE = {"mesh.lower.divisions": [9, 3], "mesh.upper.divisions": [3, 3]}
RATIOS = {"system.damping": {"type": "DampingRatio", "frequency": 5.0}}
COULOMB = {"friction": {"type": "Coulomb", "mu": 0.3}}
HITS = {"scheme": {"type": "ZienkiewiczWoodTaylor"}}
GROUND = {
    "contact": {
        "facets": "upper_bottom",
        "obstacle": {"type": "HalfSpace", "point": [0.0, 1.0], "normal": [0.0, 1.0]},
    }
} | COULOMB
WAVE = {"type": "Ricker", "amplitude": 3.0, "frequency": 20.0}
RECORD = {"type": "synthetic", "spectrum": {"s0": 0.05}, "duration": 0.5, "dt": 0.005, "seed": 3}
SPRUCE = {
    "E1": 1e8,
    "E2": 5e7,
    "E3": 6e7,
    "nu12": 0.2,
    "nu13": 0.2,
    "nu23": 0.2,
    "G12": 3e7,
    "G13": 2e7,
    "G23": 1e7,
    "rho": 600.0,
    "axes": 0.3,
    "xi": 0.05,
}
MULTISTEP = {"a": [0.25, 0.5, 0.25], "b": [0.25, 0.5, 0.25], "gamma": [1.0, -2.0, 1.0], "mu": 1.0}

# (table, type, keys, another value of each key, what else is another in the case)
KEYS: list[tuple[str, str, dict[str, Any], dict[str, Any], dict[str, Any]]] = [
    (
        "material.upper",
        "LinearElastic",
        {"E": 1e8, "nu": 0.2, "rho": 2e3, "xi": 0.05},
        {"E": 2e8, "nu": 0.3, "rho": 3e3, "xi": 0.1},
        RATIOS,
    ),
    (
        "material.upper",
        "LinearElastic.from_wave_speeds",
        {"c_p": 300.0, "c_s": 150.0, "rho": 2e3, "xi": 0.05},
        {"c_p": 320.0, "c_s": 140.0, "rho": 3e3, "xi": 0.1},
        RATIOS,
    ),
    (
        "material.upper",
        "Orthotropic",
        SPRUCE,
        {key: 1.2 * value if key[0] in "EGr" else 1.4 * value for key, value in SPRUCE.items()},
        RATIOS | SPACE,
    ),
    (
        "material.upper",
        "Heterogeneous",
        {"E": 1e8, "nu": 0.2, "rho": 2e3, "xi": 0.05},
        {"E": "1e8*(1 + x)", "nu": "0.1 + 0.1*y", "rho": "2e3 + y", "xi": "0.01*y"},
        RATIOS,
    ),
    ("system.section", "PlaneStrain", {"thickness": 1.0}, {"thickness": 2.0}, {}),
    ("system.section", "PlaneStress", {"thickness": 1.0}, {"thickness": 2.0}, {}),
    (
        "system.damping",
        "DampingRatio",
        {"frequency": 5.0, "second": 20.0},
        {"frequency": 6.0, "second": 30.0},
        {"material.upper.xi": 0.05},
    ),
    ("system.damping", "KelvinVoigt", {"shear": 1e4, "bulk": 1e4}, {"shear": 2e4, "bulk": 2e4}, {}),
    ("system.damping", "MassProportional", {"c": 1e3}, {"c": 2e3}, {}),
    ("system.damping", "Rayleigh", {"alpha": 1.0, "beta": 1e-4}, {"alpha": 2.0, "beta": 2e-4}, {}),
    (
        "system.damping",
        "Rayleigh.from_frequencies",
        {"f1": 5.0, "f2": 20.0, "xi1": 0.05, "xi2": 0.05},
        {"f1": 6.0, "f2": 30.0, "xi1": 0.04, "xi2": 0.06},
        {},
    ),
    ("friction", "Coulomb", {"mu": 0.3}, {"mu": 0.4}, {}),
    ("friction", "Tresca", {"threshold": 1e4}, {"threshold": 2e4}, {}),
    (
        "friction",
        "SlipRateCoulomb",
        {"mu": {"type": "ExponentialDecay", "mu_s": 0.5, "mu_k": 0.2, "v_c": 0.5}},
        {"mu": {"type": "ExponentialDecay", "mu_s": 0.5, "mu_k": 0.2, "v_c": 0.8}},
        FINE,
    ),
    (
        "friction",
        "SlipRateCoulomb",
        {"mu": {"type": "StaticKinetic", "mu_s": 0.5, "mu_k": 0.2}},
        {"mu": {"type": "StaticKinetic", "mu_s": 0.5, "mu_k": 0.3}},
        FINE,
    ),
    (
        "impact",
        "Inelastic",
        {"update": {"type": "ComponentReset"}},
        {"update": {"type": "ImpulseUpdate"}},
        HITS,
    ),
    (
        "impact",
        "Newton",
        {"e": 0.5, "update": {"type": "ComponentReset"}},
        {"e": 0.8, "update": {"type": "ImpulseUpdate"}},
        HITS,
    ),
    (
        "impact",
        "Elastic",
        {"update": {"type": "ComponentReset"}},
        {"update": {"type": "ImpulseUpdate"}},
        HITS,
    ),
    ("mass", "Redistributed", {"lumping": 0.4}, {"lumping": 0.2}, COULOMB),
    (
        "excitation",
        "FullSine",
        {"amplitude": 3.0, "duration": 0.01, "direction": [1.0, 0.0]},
        {"amplitude": 2.0, "duration": 0.012, "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "HalfSine",
        {"amplitude": 3.0, "duration": 0.01, "direction": [1.0, 0.0]},
        {"amplitude": 2.0, "duration": 0.012, "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "Rectangular",
        {"amplitude": 3.0, "duration": 0.01, "direction": [1.0, 0.0]},
        {"amplitude": 2.0, "duration": 0.012, "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "Harmonic",
        {"amplitude": 3.0, "frequency": 20.0, "phase": 0.1, "direction": [1.0, 0.0]},
        {"amplitude": 2.0, "frequency": 25.0, "phase": 0.2, "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "Ricker",
        {"amplitude": 3.0, "frequency": 20.0, "delay": 0.01, "direction": [1.0, 0.0]},
        {"amplitude": 2.0, "frequency": 25.0, "delay": 0.02, "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "Tabulated",
        {"times": [0.0, 0.1], "values": [0.0, 3.0], "direction": [1.0, 0.0]},
        {"times": [0.0, 0.2], "values": [1.0, 3.0], "direction": [0.0, 1.0]},
        {},
    ),
    (
        "excitation",
        "GroundMotion",
        {"record": RECORD, "direction": [1.0, 0.0], "scale": 1.0},
        {"record": RECORD | {"seed": 4}, "direction": [0.0, 1.0], "scale": 2.0},
        {},
    ),
    (
        "contact",
        "contact_surface",
        {
            "facets": "upper_bottom",
            "held": False,
            "points": [[1.0, 1.002], [2.0, 1.002]],
            "obstacle": GROUND["contact"]["obstacle"],
        },
        {
            "facets": "upper_top",
            "held": True,
            "points": [[1.0, 1.002]],
            "springs": 1e8,
            "obstacle": {"type": "HalfSpace", "point": [0.0, 0.999], "normal": [0.0, 1.0]},
        },
        COULOMB,
    ),
    (
        "contact.obstacle",
        "HalfSpace",
        {"point": [0.0, 1.0], "normal": [0.0, 1.0]},
        {"point": [0.0, 1.001], "normal": [0.05, 1.0]},
        GROUND,
    ),
    (
        "contact.obstacle",
        "AnalyticGap",
        {"function": "y - 1.0"},
        {"function": "y - 1.0005"},
        GROUND,
    ),
    (
        "contact",
        "contact_pair",
        {
            "facets1": "upper_bottom",
            "facets2": "lower_top",
            "held": False,
            "matching": {"type": "DualMortar"},
            "points": [[1.1, 1.002], [2.1, 1.002]],
        },
        {
            "facets1": "upper_top",
            "facets2": "lower_bottom",
            "held": True,
            "matching": {"type": "NodeToNode"},
            "points": [[1.1, 1.002]],
        },
        {"mesh.offset": [1.1]},
    ),
    (
        "system.prescribed",
        "Prescribed",
        {
            "facets": "upper_left",
            "displacement": [0.0, 0.0],
            "velocity": [0.0, 0.0],
            "acceleration": [0.0, 0.0],
            "components": [0],
        },
        {
            "facets": "upper_right",
            "displacement": ["1e-3*t", 0.0],
            "velocity": [1e-3, 0.0],
            "acceleration": [1.0, 0.0],
            "components": [0, 1],
        },
        {"system.damping": {"type": "Rayleigh", "alpha": 1.0, "beta": 1e-4}},
    ),
    (
        "system.loads",
        "Traction",
        {"facets": "upper_top", "value": [1e4, 0.0], "history": "sin(t)"},
        {"facets": "upper_left", "value": [2e4, 0.0], "history": "cos(t)"},
        {},
    ),
    (
        "system.loads",
        "TangentialTraction",
        {"facets": "upper_top", "value": [1e4, 0.0], "history": "sin(t)"},
        {"facets": "upper_bottom", "value": [2e4, 0.0], "history": "cos(t)"},
        {},
    ),
    (
        "system.loads",
        "Pressure",
        {"facets": "upper_top", "value": 1e4, "history": "sin(t)"},
        {"facets": "upper_left", "value": 2e4, "history": "cos(t)"},
        {},
    ),
    (
        "system.loads",
        "BodyForce",
        {"value": [1e4, 0.0], "history": "sin(t)"},
        {"value": [2e4, 0.0], "history": "cos(t)"},
        {},
    ),
    (
        "system.dashpots",
        "Dashpots",
        {"facets": "upper_top", "normal": 1.0, "tangential": 1.0},
        {
            "facets": "upper_left",
            "normal": 0.5,
            "tangential": 0.5,
            "material": {"E": 2e8, "nu": 0.2, "rho": 2e3},
        },
        {},
    ),
    (
        "system.dashpots",
        "CompliantBase",
        {
            "facets": "upper_top",
            "normal": 1.0,
            "tangential": 1.0,
            "motion": {"motion": WAVE, "dt": 1e-3},
        },
        {
            "facets": "upper_left",
            "normal": 0.5,
            "tangential": 0.5,
            "material": {"E": 2e8, "nu": 0.2, "rho": 2e3},
            "motion": {"motion": WAVE, "dt": 1e-3, "outcrop": False},
        },
        {},
    ),
    (
        "gravity",
        "with_weight",
        {"acceleration": 9.0, "direction": [0.0, -1.0], "cells": "upper"},
        {"acceleration": 8.0, "direction": [0.0, 1.0], "cells": "lower"},
        {
            "system.initial_velocity": None,
            "system.prescribed": {"facets": "upper_right", "components": [0]},
            "mesh.gap": 0.0,
            "contact.roller": True,
        },
    ),
    ("scheme", "ContactStabilisedNewmark", {"projected": False}, {"projected": True}, {}),
    (
        "scheme",
        "GeneralisedAlpha",
        {"alpha_m": 0.0, "alpha_f": 0.1, "beta": 0.3, "gamma": 0.6},
        {"alpha_m": 0.05, "alpha_f": 0.12, "beta": 0.35, "gamma": 0.65},
        {},
    ),
    ("scheme", "GeneralisedAlpha.spectral_radius", {"rho_inf": 0.8}, {"rho_inf": 0.6}, {}),
    ("scheme", "HHT", {"alpha": -0.1}, {"alpha": -0.2}, {}),
    (
        "scheme",
        "LinearMultistep.newmark",
        {"beta": 0.25, "gamma": 0.5},
        {"beta": 0.3, "gamma": 0.55},
        {},
    ),
    ("scheme", "MoreauJean", {"theta": 0.5, "e": 0.0}, {"theta": 0.6, "e": 0.5}, {}),
    ("scheme", "Newmark", {"beta": 0.25, "gamma": 0.5}, {"beta": 0.3, "gamma": 0.55}, {}),
    ("scheme", "SS22", {"theta1": 0.5, "theta2": 0.5}, {"theta1": 0.6, "theta2": 0.6}, {}),
    (
        "scheme",
        "Trapezoidal",
        {"mass": {"type": "Redistributed"}},
        {"mass": {"type": "Redistributed", "lumping": 0.1}},
        {},
    ),
    ("scheme", "ZienkiewiczWoodTaylor", {"phi": 0.5}, {"phi": 0.6}, {}),
    (
        "system",
        "",
        {
            "initial_displacement": [0.0, 0.0],
            "initial_velocity": [1.0, -1.0],
            "base_inertia": True,
            "degree": 1,
            "integration": "full",
            "quadrature_degree": 2,
            "fixed": "lower_bottom",
        },
        {
            "initial_displacement": [1e-4, 0.0],
            "initial_velocity": [1.0, -2.0],
            "base_inertia": False,
            "degree": 2,
            "integration": "selective",
            "quadrature_degree": 1,
            "fixed": "lower_left",
            "tied": {"first": "lower_left", "second": "lower_right"},
        },
        {"excitation": WAVE},
    ),
]


def put(tables: dict[str, Any], where: str, value: Any) -> dict[str, Any]:
    """The tables with another value at this key; None takes it away."""
    first, _, rest = where.partition(".")
    if rest:
        return tables | {first: put(tables.get(first, {}), rest, value)}
    return {key: one for key, one in (tables | {first: value}).items() if one is not None}


class Answers:
    """What cases compute, and products with their matrices."""

    def __init__(self, folder: Path, tables: dict[str, Any]) -> None:
        lines = [f"{name} = {format_value(one)}" for name, one in tables.items()]
        self.case = read_case(written(folder, "\n".join(lines)))
        self.parts = self.case.parts(COMM)

    @cached_property
    def matrices(self) -> dict[str, Any]:
        system = self.parts.system
        x = np.cos(np.arange(system.rows))
        every = {name: getattr(system, name) for name in ("M", "C", "K")}
        return {name: one @ x for name, one in every.items() if one is not None}

    @cached_property
    def history(self) -> dict[str, Any]:
        self.case.check()
        with self.case.call(self.parts, None) as call:
            return dict(vc.simulate(**call, progress=False).history)


def changes(before: Answers, folder: Path, tables: dict[str, Any]) -> bool:
    """Whether these tables are refused, or have other matrices, or else another motion."""
    try:
        after = Answers(folder, tables)
        return differ(before.matrices, after.matrices) or differ(before.history, after.history)
    except InputError:
        return True


def differ(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether some number of two answers is another one, beyond round-off."""
    if one.keys() != other.keys():
        return True
    for name, a in one.items():
        a, b = np.asarray(a, dtype=float), np.asarray(other[name], dtype=float)
        if a.shape != b.shape or not np.allclose(
            a, b, rtol=1e-7, atol=1e-7 * np.abs(np.nan_to_num(a)).max(initial=0.0), equal_nan=True
        ):
            return True
    return False


@pytest.mark.serial
@pytest.mark.slow
@pytest.mark.parametrize(
    "number", range(len(KEYS)), ids=[f"{table} {word}".strip() for table, word, *_ in KEYS]
)
def test_every_key_changes_the_model(shared_tmp: Path, number: int) -> None:
    """One key after the other has another value: what is computed is another, or the case is
    refused."""
    table, word, keys, others, more = KEYS[number]
    base = FLIGHT
    for where, value in more.items():
        base = put(base, where, value)
    own = (
        base.get("system", {})
        if table == "system"
        else {"type": word}
        if table != "gravity"
        else {}
    )
    before = Answers(shared_tmp, put(base, table, own | keys))
    assert before.history  # the case runs
    for key, value in others.items():
        assert changes(before, shared_tmp, put(base, table, own | keys | {key: value})), (
            f"{table} {word}: {key} = {value} changes nothing"
        )
