"""The damping that a model has at its first modes, and ratios of materials: closed forms, and what
is refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.cli.entry import main
from vi_contact.practice.engineering import first_modes
from vi_contact.practice.ground_motion.record import Record
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.run.damping import describe_damping

COMM = MPI.COMM_WORLD
E, NU, RHO, XI = 1.8e9, 0.2, 2000.0, 0.05
TIMBER = {
    "E1": 1e10,
    "E2": 5e8,
    "E3": 5e8,
    "nu12": 0.3,
    "nu13": 0.3,
    "nu23": 0.4,
    "G12": 5e8,
    "G13": 5e8,
    "G23": 1e8,
    "rho": 600.0,
}
CASE = """
[mesh]
type = "TwoBlocks"
lower = {lengths = [1.0, 2.0], divisions = [2, 4]}
upper = {lengths = [1.0, 2.0], divisions = [2, 4]}
[material.lower]
E = 1.8e9
nu = 0.2
rho = 2000.0
xi = 0.05
[material.upper]
E = 1.8e9
nu = 0.2
rho = 2000.0
xi = "5 %"
[system]
fixed = "lower_bottom"
damping = {type = "DampingRatio", frequency = 20.0}
[[contact]]
type = "contact_pair"
facets1 = "upper_bottom"
facets2 = "lower_top"
roller = true
[friction]
type = "Coulomb"
mu = 0.5
[run]
dt = 1e-3
steps = 2
"""


def column(comm: Any = COMM, material: Any = None, **options: Any) -> vc.ContactProblem:
    """A block on its base, without contact."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 4.0), divisions=(2, 8)), comm)
    given = vc.LinearElastic(E, NU, RHO) if material is None else material
    boundaries = [fem.Dashpots(tags[name]) for name in options.pop("absorbing", ())]
    system = fem.assemble(mesh, given, clamped=tags["bottom"], dashpots=boundaries, **options)
    return vc.ContactProblem(system, empty_surface(system.algebra.comm, 2))


@pytest.mark.parametrize(
    "material",
    [
        vc.LinearElastic(E, NU, RHO, xi=XI),
        vc.LinearElastic.from_wave_speeds(900.0, 500.0, RHO, xi=XI),
        vc.Orthotropic(**TIMBER, xi=XI),
        fem.Heterogeneous(E, NU, RHO, XI),
    ],
    ids=["isotropic", "wave speeds", "orthotropic", "heterogeneous"],
)
@pytest.mark.parametrize("second", [0.0, 90.0])
def test_every_material_has_a_ratio(material: Any, second: float) -> None:
    """One frequency: xi f / f1 at f. Two: alpha / (2 w) + beta w / 2. Exact, whatever the
    material."""
    modes = first_modes(column(material=material, damping=vc.DampingRatio(30.0, second)))
    f = 1.0 / np.array(modes.periods)
    law = (
        vc.Rayleigh(0.0, 2.0 * XI / (2.0 * np.pi * 30.0))
        if not second
        else (vc.Rayleigh.from_frequencies(30.0, second, xi1=XI, xi2=XI))
    )
    assert len(f) == 3 and modes.rigid_motions == 0
    assert modes.ratios == pytest.approx([law.ratio(one) for one in f], rel=1e-8)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (vc.Rayleigh(2.0, 1e-4), "Rayleigh(alpha=2.0, beta=0.0001)"),
        (vc.NoDamping(), "none"),
        (vc.MassProportional(4e3), "MassProportional(c=4000.0)"),
    ],
)
def test_laws_of_the_whole_body(law: Any, words: str) -> None:
    """The ratio of Rayleigh's law at the frequency of each mode; none without a law."""
    problem = column(damping=law)
    assert describe_damping(problem) == words
    modes = first_modes(problem)
    alpha, beta = law.coefficients(vc.LinearElastic(E, NU, RHO))
    w = 2.0 * np.pi / np.array(modes.periods)
    assert modes.ratios == pytest.approx(0.5 * (alpha / w + beta * w), rel=1e-8)
    assert describe_damping(problem).startswith(words)
    assert (" at T1 = " in describe_damping(problem)) == (words != "none")


def test_dashpots_count() -> None:
    """A bar of one column of cells with a dashpot of rho c at its end: phi² rho c / (2 w ∫ rho
    phi²) of each mode."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0,), divisions=(200,)), COMM)
    material = vc.LinearElastic(E, 0.0, RHO)
    system = fem.assemble(
        mesh, material, clamped=tags["left"], dashpots=fem.Dashpots(tags["right"], normal=0.01)
    )
    modes = first_modes(vc.ContactProblem(system, empty_surface(system.algebra.comm, 1)))
    # phi = sin((2 k - 1) pi x / 2), phi(1)² = 1, ∫ phi² = 1/2, w = (2 k - 1) pi c / 2: xi = 0.01 ·
    # 2 / ((2 k - 1) pi)
    assert modes.ratios == pytest.approx(
        [0.01 * 2.0 / ((2 * k - 1) * np.pi) for k in (1, 2, 3)], rel=2e-4
    )


def test_one_mode_in_two_directions_has_one_ratio() -> None:
    """A square column in space bends along x as along z; a mass that is damped along x alone would
    tell them apart only by chance, so both have their mean."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 4.0, 1.0), divisions=(1, 4, 1)), COMM)
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E, NU, RHO),
        clamped=tags["bottom"],
        dashpots=fem.Dashpots(tags["left"], tangential=0.0, normal=0.1),
    )
    modes = first_modes(vc.ContactProblem(system, empty_surface(system.algebra.comm, 3)))
    assert modes.periods[0] == pytest.approx(modes.periods[1], rel=1e-8)
    assert modes.ratios[0] == pytest.approx(modes.ratios[1], rel=1e-9) and modes.ratios[0] > 0.0


def test_any_number_of_ranks_finds_the_same() -> None:
    ours, alone = (
        first_modes(column(comm, damping=vc.Rayleigh(0.0, 1e-4), absorbing=("top",)))
        for comm in (COMM, MPI.COMM_SELF)
    )
    assert ours.ratios == pytest.approx(alone.ratios, rel=1e-6) and min(ours.ratios) > 0.0


def written(folder: Path, text: str = CASE) -> Path:
    if COMM.rank == 0:
        (folder / "case.toml").write_text(text, encoding="utf-8")
    COMM.Barrier()
    return folder / "case.toml"


def test_a_case_tells_what_it_has(shared_tmp: Path) -> None:
    """A ratio by number and by per cent; the contact is closed, so the two blocks are one
    column."""
    model = describe(read_case(written(shared_tmp)), COMM)
    together = [XI / 20.0 / T for T in model["periods"]]
    assert model["damping_ratios"] == pytest.approx(together, rel=1e-3)
    told = ", ".join(
        f"{100 * xi:.3g} % at T{k} = {T:.3g} s"
        for k, (xi, T) in enumerate(zip(together, model["periods"], strict=True), start=1)
    )
    assert model["damping"] == f"5 % at f1 = 20 Hz; {told}"
    assert model["bodies"][0]["material"]["xi"] == XI
    plain = describe(
        read_case(written(shared_tmp, without_ratios(CASE)), ["system.damping="]), COMM
    )
    assert plain["damping"] == "none" and "xi" not in plain["bodies"][0]["material"]
    assert plain["damping_ratios"] == [0.0, 0.0, 0.0] and plain["periods"] == pytest.approx(
        model["periods"], rel=1e-8
    )
    large = describe(read_case(written(shared_tmp)), COMM, most=10)
    assert (
        large["damping"]
        == "5 % at f1 = 20 Hz; not computed at its periods, as the model has more than 10 unknowns"
    )
    other = describe(read_case(written(shared_tmp, CASE.replace('"5 %"', "0.02"))), COMM)
    assert other["damping"].startswith("2 to 5 % at f1 = 20 Hz; ")


def without_ratios(text: str) -> str:
    return "\n".join(line for line in text.splitlines() if not line.startswith("xi"))


@pytest.mark.long
@pytest.mark.serial
def test_check_and_summary_print_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = str(written(tmp_path)), tmp_path / "out"
    assert main(["run", path, "--check", "--quiet", "--out", str(out / "check")]) == 0
    checked = capsys.readouterr().out
    assert main(["run", path, "--quiet", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "damping" in printed and "5 % at f1 = 20 Hz; " in printed and " % at T3 = " in printed
    assert re.search(r"\n  law +5 % at f1 = 20 Hz\n", checked)
    assert re.search(
        r"\n  natural period T3, contact closed +[0-9.]+  s +damping [0-9.]+ %\n", checked
    )
    (written(tmp_path, without_ratios(CASE)))
    assert main(["run", path, "--quiet", "--out", str(out), "--set", "system.damping="]) == 0
    assert "\n  damping                    none\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"damping": vc.DampingRatio(2.0)},
            "damps by the ratios xi of the materials, and none of them has one",
        ),
        (
            {"material": vc.LinearElastic(E, NU, RHO, xi=XI)},
            "xi = 0.05, which NoDamping() does not read",
        ),
        (
            {"material": vc.LinearElastic(E, NU, RHO, xi=XI), "damping": vc.Rayleigh(1.0, 0.0)},
            "which Rayleigh(",
        ),
        ({"material": vc.Orthotropic(**TIMBER, xi=XI)}, "which NoDamping() does not read"),
        (
            {"material": fem.Heterogeneous(E, NU, RHO, lambda x: 0.0 * x[0] + XI)},
            "which NoDamping() does not read",
        ),
        ({"damping": vc.Rayleigh(0.0, 0.0)}, "damps nothing, as its coefficients are zero"),
        ({"damping": vc.MassProportional(0.0)}, "damps nothing"),
        ({"damping": vc.KelvinVoigt(0.0)}, "damps nothing"),
    ],
)
def test_damping_without_effect_is_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        column(**change)
    assert words in str(caught.value)


@pytest.mark.parametrize("ratio", [-0.01, 1.0, 5.0, "a", float("nan")])
def test_ratios_are_not_per_cents(ratio: Any) -> None:
    for make in (
        lambda: vc.LinearElastic(E, NU, RHO, xi=ratio),
        lambda: vc.Orthotropic(**TIMBER, xi=ratio),
    ):
        with pytest.raises(InputError, match="the damping ratio xi is"):
            make()


@pytest.mark.serial
def test_ratios_that_nobody_reads_elsewhere() -> None:
    """Dashpots, boundary elements and columns of waves have no use for the ratio of a material."""
    damped, plain = vc.LinearElastic(E, NU, RHO, xi=XI), vc.LinearElastic(E, NU, RHO)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 4.0), divisions=(2, 8)), COMM)
    with pytest.raises(
        InputError, match=r"the material of Dashpots on 'bottom' has the damping ratio xi = 0\.05"
    ):
        fem.assemble(mesh, plain, dashpots=fem.Dashpots(tags["bottom"], damped))
    both = fem.assemble(
        mesh, damped, damping=vc.DampingRatio(2.0), dashpots=fem.Dashpots(tags["bottom"], damped)
    )
    assert both.C is not None
    shakes, curve = Record(np.sin(np.arange(100.0)), 0.01), soil.SoilCurves.linear(0.02)
    with pytest.raises(InputError, match="the curves of the layer give its damping; leave xi out"):
        soil.equivalent_linear([(3.0, damped, curve)], shakes)
    with pytest.raises(InputError, match="give rock_damping, and leave xi out"):
        soil.equivalent_linear([(3.0, plain, curve)], shakes, rock=damped)
    cells = [fem.Cells.where("all", mesh, lambda x: x[1] > -1.0)]
    with pytest.raises(
        InputError, match="the curves of its cells give another one; leave xi out there"
    ):
        soil.strain_compatible(mesh, [(cells[0], damped)], [(cells[0], curve)], lambda *_: None)
