"""V7.2: concrete on steel against an independent script, the static solution and boundary
elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.square import Square, build, concrete
from vi_contact.core.algebra import Array

pytestmark = pytest.mark.slow

LAWS = {"smooth": vc.Frictionless(), "on steel": vc.Coulomb(0.3)}
REFERENCE = {  # kg m/ms² at 5, 10, 15, 20 ms
    "smooth": (4.1329e-6, 5.8575e-5, 1.9498e-4, 2.9966e-4),
    "on steel": (4.0992e-6, 5.8100e-5, 1.9339e-4, 2.9717e-4),
}


def pressed(box: Square, law: str, scheme: Any, *, dt: float, t_end: float) -> Mapping[str, Array]:
    """The history of the box, with the energy."""
    model = build(box, MPI.COMM_WORLD)
    solution = vc.simulate(
        model.problem(friction=LAWS[law]),
        scheme=scheme,
        dt=dt,
        t_end=t_end,
        progress=False,
        record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
    )
    assert 0.0 < solution.facts["worst_certificate"] <= 1e-9
    assert 0.0 < solution.facts["energy_defect"] <= 1e-10
    history = solution.history
    return {**history, "energy": history["energy_kinetic"] + history["energy_strain"]}


@pytest.mark.serial
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scheme", [vc.Midpoint(), None])
@pytest.mark.promise("guide/pressed_blocks.md", "All five digits of REF")
@pytest.mark.promise("guide/pressed_blocks.md", "the energy is f²/(2E') to 0.02 %", bound="0.1 %")
@pytest.mark.promise("guide/pressed_blocks.md", "½ nu (1 + nu) f/E to 0.03 %", bound="0.1 %")
def test_energies(scheme, law):
    """V7.2, 20 x 20 cells, dt = 0.05 ms: energies to all five digits with the midpoint rule, to
    1e-4 with the default scheme; on steel the base sticks everywhere."""
    history = pressed(concrete(), law, scheme, dt=5e-5, t_end=0.02)
    energy = history["energy"][[100, 200, 300, 400]] / 1e6  # kg m/ms² is 1e6 J
    if scheme is None:
        assert energy == pytest.approx(REFERENCE[law], rel=1e-4)
    else:
        last_digit = 10.0 ** (np.floor(np.log10(REFERENCE[law])) - 4)
        assert np.all(np.abs(energy - REFERENCE[law]) < 0.5001 * last_digit)
    if law == "on steel":
        assert history["loss_friction"][-1] == 0.0 and not history["slip"].any()
    else:
        quasi_static(history)


def quasi_static(history: Mapping[str, Array]) -> None:
    """E = f²/(2E'), u_x = ½ nu (1 + nu) f/E, force f, to 0.1 %; E' = E/(1 - nu²) = 23809.8 MPa; u_x
    as the script has it."""
    material = concrete().material
    f = 4e6 * np.tanh((20.0 / 15.0) ** 2)
    plane = material.E / (1.0 - material.nu**2)
    assert plane == pytest.approx(23809.8e6, rel=5e-5) and f == pytest.approx(3.777e6, rel=5e-4)
    assert history["energy"][-1] == pytest.approx(f**2 / (2.0 * plane), rel=1e-3)
    corner = history["u_x_corner"][-1]
    assert corner == pytest.approx(
        0.5 * material.nu * (1.0 + material.nu) * f / material.E, rel=1e-3
    )
    assert corner == pytest.approx(1.9830e-5, rel=0.0, abs=0.5001e-9)
    assert history["contact_resultant"][-1] == pytest.approx(f, rel=1e-3)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("law", "top", "tolerance"), [("smooth", 175.308e-6, 5e-4), ("on steel", 173.75e-6, 5e-3)]
)
def test_space_time_boundary_elements(law, top, tolerance):
    """V7.2 with rho = 2300 kg/m³ at 40 ms against an independent script of space-time boundary
    elements: displacement of the top, static to 0.05 %; with the base sticking, and stress peaks at
    its ends, to 0.5 %."""
    box = concrete()
    lighter = replace(box, material=vc.LinearElastic.from_wave_speeds(3253.0, 1992.0, 2300.0))
    history = pressed(lighter, law, None, dt=1e-4, t_end=0.04)
    assert -history["u_y_top"][-1] == pytest.approx(top, rel=tolerance)


@pytest.mark.serial
def test_the_concrete_demo(comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V7.2 with steps of 0.25 ms: certified, ledgers closed, static at the end to 1 %; figures
    drawn."""
    numbers = demo("concrete_on_steel").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    for name in LAWS:
        assert (
            0.0 < numbers[f"{name}: certificate"] <= 1e-9
            and 0.0 < numbers[f"{name}: ledger defect"] <= 1e-10
        )
        assert numbers[f"{name}: energy"] == pytest.approx(1.0, abs=0.01)
        assert numbers[f"{name}: force"] == pytest.approx(1.0, abs=0.01)
    assert (
        numbers["smooth: corner"] == pytest.approx(1.0, abs=0.01)
        and numbers["on steel: corner"] == 0.0
    )
    for figure in ("snapshots", "tractions", "energies"):
        assert (shared_tmp / f"{figure}.png").stat().st_size > 6_000
    assert comm.rank or "on steel" in capsys.readouterr().out
