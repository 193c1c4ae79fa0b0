"""Factors of safety by reduced strength: a slope with a published factor, refusals, the command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import Iwan, MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice import plots, studies
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies.cases.case import Case
from vi_contact.practice.studies.cases.library import locate

pytestmark = pytest.mark.serial
HEIGHT, GAMMA = 10.0, 20e3


def make_slope(comm: Any, law: Any) -> vc.ContactProblem:
    """A slope of 1:2, 10 m high, on 2.5 m of the same soil."""

    def bend(x: np.ndarray) -> np.ndarray:
        top = np.clip(HEIGHT - 0.5 * (x[:, 0] - 12.0), 0.0, HEIGHT)
        return np.stack([x[:, 0], -2.5 + x[:, 1] * (top + 2.5)], axis=1)

    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(42.0, 1.0), divisions=(21, 6), deform=bend), comm
    )
    sides = [fem.Prescribed(tags[side], components=(0,)) for side in ("left", "right")]
    system = fem.assemble(
        mesh,
        law,
        integration="bbar",
        clamped=tags["bottom"],
        prescribed=sides,
        loads=fem.BodyForce((0.0, -GAMMA)),
    )
    return vc.ContactProblem(system, empty_surface(system.space.comm, 2))


def make_soil(share: float = 1.0) -> MohrCoulomb:
    """Griffiths and Lane's soil, c = 0.05 gamma H, phi 20 degrees, psi 0, with its strength over a
    share."""
    soil = MohrCoulomb(1e8, 0.3, GAMMA / 9.81, 0.05 * GAMMA * HEIGHT, 20.0, 0.0)
    return soil.weaken(share)


@pytest.mark.long
def test_a_slope_with_a_published_factor(comm: Any, tmp_path: Path) -> None:
    """Bishop and Morgenstern 1.38, Griffiths and Lane (1999, example 1) 1.4 by elements; found
    1.41 with cells of 2 m. Every equilibrium is certified, and slopes slip the more the nearer."""
    found = studies.strength_reduction(make_slope(comm, make_soil()), tolerance=0.02)
    assert 1.36 <= found.factor < found.failed <= 1.45
    assert found.failed <= 1.02 * found.factor
    standing = [trial for trial in found.trials if trial.stands]
    assert all(trial.certificate <= 1e-9 for trial in standing)
    assert np.all(np.diff([trial.displacement for trial in standing]) > 0.0)
    assert standing[-1].displacement > 3.0 * standing[0].displacement
    assert "over 1.4" in str(found)
    picture = plots.plot_strength_reduction(found, tmp_path / "slope.png")
    assert picture.stat().st_size > 10_000
    _, strain = fem.at_points(found.problem, found.state, "plastic_strain")
    assert strain.max() > 0.01


@pytest.mark.long
def test_a_weaker_soil_has_a_smaller_factor(comm: Any) -> None:
    """The factor of a soil with its strength over 2 is half: the search goes down from 1."""
    found = studies.strength_reduction(make_slope(comm, make_soil(2.0)), tolerance=0.1)
    assert 0.6 <= found.factor < found.failed <= 0.8


def test_what_has_no_factor_is_refused(comm: Any) -> None:
    elastic = make_slope(comm, make_soil())
    with pytest.raises(InputError, match="Iwan does not say"):
        studies.strength_reduction(make_slope(comm, Iwan(1e8, 0.3, 2e3, [(1e-4, 0.9)])))
    with pytest.raises(InputError, match="give a ContactProblem"):
        studies.strength_reduction(None)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(1, 1)), comm)
    system = fem.assemble(mesh, vc.LinearElastic(1e7, 0.3, 2e3), clamped=tags["bottom"])
    elastic = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    with pytest.raises(InputError, match="no material of this body yields"):
        studies.strength_reduction(elastic)


@pytest.mark.long
def test_the_command(
    comm: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It reads a case and writes a table and a picture; a case without yielding soil is refused."""
    table = tmp_path / "slope.csv"
    wall = str(locate("wall"))
    assert main(["strength-reduction", wall, "--out", str(table)]) == 1
    assert "no material of this body yields" in capsys.readouterr().err
    monkeypatch.setattr(Case, "problem", lambda *_: make_slope(comm, make_soil()))
    given = ["--tolerance", "0.2", "--start", "1.2", "--out", str(table)]
    assert main(["strength-reduction", wall, *given]) == 0
    assert "the body stands with its strength over 1.35" in capsys.readouterr().out
    assert table.read_text().startswith("factor,displacement_m,certificate,reason\n")
    assert (tmp_path / "slope.png").exists()


@pytest.mark.serial
@pytest.mark.parametrize("name", ["start", "tolerance", "certificate"])
def test_numbers_that_are_not_above_zero_are_refused(comm: Any, name: str) -> None:
    """By the name of the function that was called."""
    for value in (0.0, -1.0, np.nan, "1"):
        with pytest.raises(InputError, match=f"^strength_reduction: {name} is "):
            studies.strength_reduction(None, **{name: value})
