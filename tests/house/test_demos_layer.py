"""The demos of the boundary layer: key numbers and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

from demos.parts.pictures.layer import plot_thin_limit

serial = pytest.mark.serial


@pytest.mark.slow
@serial
def test_the_particle_demo(tmp_path: Path, capsys: Any) -> None:
    """V5.1: Figs. 1 to 3 and their numbers."""
    numbers = demo("particle_layer").main(quick=True, out=tmp_path, progress=False)
    assert numbers["closed form - integration"] < 1e-9
    assert (numbers["e 2 5"], numbers["t_f 2 5"]) == pytest.approx(
        (0.352379, 0.676189), abs=5.001e-7
    )
    assert numbers["DOMINANT 0.8"] == pytest.approx(numbers["DOMINANT 1"], abs=1e-8)
    assert numbers["FULL 1"] == pytest.approx(0.56918, abs=5.1e-6)
    assert numbers["wanted"] == pytest.approx(0.7, abs=1e-12)
    assert all(is_drawn(tmp_path / f"figure_{number}.png") for number in (1, 2, 3))
    assert "0.593624" in capsys.readouterr().out  # k = c = 2


@serial
def test_the_rigid_body_demo(tmp_path: Path) -> None:
    """V5.2: the loss, order 1 in the width; the ellipsoid's bounce."""
    numbers = demo("rigid_body_layer").main(quick=True, out=tmp_path, progress=False)
    assert numbers["loss"] == pytest.approx(0.310982436, abs=5e-7)
    assert numbers["order"] == pytest.approx(1.0, abs=0.01)
    assert (
        numbers["contacts"] == 2.0
        and numbers["worst_restitution"] < 2e-4
        and numbers["energy_error"] < 1e-4
    )
    assert is_drawn(tmp_path / "thin_limit.png") and is_drawn(tmp_path / "tumbling.png")


@pytest.mark.slow
@serial
def test_the_contact_layer_demo(comm: Any, shared_tmp: Path) -> None:
    """V1.1 in layers of 1 and ½ m: errors halve; the stiff block rebounds with ½ within 1 %."""
    numbers = demo("contact_layer").main(quick=True, out=shared_tmp, progress=False)
    assert numbers["BLENDED e 0.5"] == pytest.approx(0.5, rel=1e-2)
    errors = [
        numbers[f"ThrownBar {run}: error"] for run in ("FLAT b 1", "FLAT b 0.5", "exact inequality")
    ]
    assert 1.8 < errors[0] / errors[1] < 2.2 and errors[1] > errors[2]
    assert numbers["ThrownBar FLAT b 0.5: impulse"] == pytest.approx(1.0, rel=1e-2)
    assert 0.97 < numbers["ThrownBar FLAT b 0.5: energy"] < 1.0
    assert numbers["wall b 8e-06: error"] < 0.05 * numbers["wall: largest displacement"]
    assert 0.0 < numbers["wall b 8e-06: deepest"] < 8e-6
    if comm.rank == 0:
        assert all(
            is_drawn(shared_tmp / f"{name}.png")
            for name in ("ThrownBar", "ThrownBar_limit", "wall_limit")
        )


@serial
def test_thin_limit_figure(tmp_path: Path) -> None:
    """One curve is enough."""
    widths = np.array([1.0, 0.1])
    assert is_drawn(
        plot_thin_limit({"x": (widths, widths)}, tmp_path / "a.png", quantity="error [m]")
    )
