"""One figure of what was recorded, with every axis labelled, of runs with a folder and without."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from matplotlib.figure import Figure

import vi_contact as vc
from vi_contact.practice.plots import plot_overview

pytestmark = pytest.mark.serial
SHAKE = vc.Harmonic(-30.0, 3.0, direction=(1.0,))


def run(*record: Any, steps: int = 40, **more: Any) -> vc.Solution:
    return vc.simulate(
        chain_problem(5, gap=1e-3, excitation=SHAKE),
        dt=5e-3,
        steps=steps,
        record=record,
        **more,
        scheme=vc.ZienkiewiczWoodTaylor(),
        progress=False,
    )


def curves(axis: Any) -> dict[str, Any]:
    return {line.get_label(): line.get_ydata() for line in axis.lines}


def test_probes_force_ledger_and_certificates(tmp_path: Path) -> None:
    """The curves are the columns in the unit of their axis; a run that is read back gives the same
    figure."""
    solution = run(vc.Energy(), vc.Contact(), vc.Probe({"end": (5.0,)}), out=tmp_path)
    for one in (solution, vc.read_run(tmp_path)):
        figure = one.plot() if one is solution else plot_overview(one)
        assert isinstance(figure, Figure)
        labels = [f"{axis.get_title(loc='left')} {axis.get_ylabel()}" for axis in figure.axes]
        assert labels == [
            "displacement [mm]",
            "contact force [N]",
            "energy [J]",
            "certificate of every step worst residual [-]",
        ]
        assert figure.axes[-1].get_xlabel() == "time [s]"
        probe, force, energy, certificate = map(curves, figure.axes)
        assert probe["u_x_end"] == pytest.approx(1e3 * one.history["u_x_end"], rel=1e-12)
        assert np.array_equal(force["contact_resultant"], one.history["contact_resultant"])
        assert np.array_equal(energy["kinetic"], one.history["energy_kinetic"])
        assert force["contact_resultant"].any()
        assert certificate["tolerance 1e-09"][0] == solution.facts["tolerance"]
        assert all(axis.get_legend() is not None for axis in figure.axes)


@pytest.mark.filterwarnings("error")
def test_what_was_not_recorded_has_no_panel() -> None:
    """Certificates always; nothing at rest and without steps; of many probes the first eight."""
    assert [axis.get_ylabel() for axis in run().plot().axes] == ["worst residual [-]"]
    rest = vc.simulate(chain_problem(3), dt=1e-3, steps=0, progress=False, scheme=vc.Midpoint())
    rest.plot().savefig("/dev/null", format="png")
    many = run(vc.Probe({f"p{i}": (1.0 + i % 5,) for i in range(12)}))
    assert len(many.plot().axes[0].lines) == 8
