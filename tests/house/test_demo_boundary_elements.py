"""The boundary element demo: both methods near each other on coarse meshes, figures and table."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

from demos.parts.pictures import deformed
from demos.parts.pictures.boundary import SHEAR, plot_panels

pytestmark = pytest.mark.serial


@pytest.mark.slow
def test_the_boundary_elements_demo(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """V7.1 to V7.3 on 4 to 24 elements: energies within 2 % (rms) of coarse finite elements,
    impulses within 8 % (ball) and 1 %; Uzawa's iteration and the march agree; every step
    certified."""
    module, drawn = demo("boundary_elements"), list[Any]()
    monkeypatch.setattr(
        module,
        "plot_panels",
        lambda rows, *a, **k: drawn.append(rows) or plot_panels(rows, *a, **k),
    )
    inside = partial(module.points_inside, spacing=0.4)  # fewer dots in the picture
    monkeypatch.setattr(module, "points_inside", inside)
    numbers: dict[str, Any] = module.main(quick=True, out=tmp_path, progress=False)
    # concrete on steel: the support holds the corners together, by both methods
    shear = drawn[0][1][2]
    assert shear.quantity == SHEAR and all(curve.y[0] > 0.0 > curve.y[-1] for curve in shear.curves)
    of = {name.split(": ")[0] for name in numbers}
    assert len(of) == 9
    for name in of:
        assert 0.0 < numbers[f"{name}: energy off"] < 0.02, name
        impulse = numbers[f"{name}: fem impulse"]
        assert numbers[f"{name}: impulse"] == pytest.approx(
            impulse, rel=0.08 if "ball" in name else 0.01
        ), name
        assert numbers[f"{name}: friction"] == pytest.approx(
            numbers[f"{name}: fem friction"], rel=0.06, abs=1e-4
        ), name
        assert 0.0 < numbers[f"{name}: uzawa off"] < 1e-6 and 5 < numbers[f"{name}: uzawa"] < 600, (
            name
        )
        assert numbers[f"{name}: certificate"] < 1e-12
    for figure in ("snapshots.png", "tractions.png", "energies.png"):
        assert is_drawn(tmp_path / figure)
    assert "fem energy" in capsys.readouterr().out


@pytest.mark.parametrize("normal", [(0.0, -1.0), (0.0, 1.0)])
def test_the_shear_of_histories_is_drawn_on_the_body(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, normal: tuple[float, float]
) -> None:
    """Histories hold what the body does to its support along +x; drawn is the opposite, and the
    axis says so."""
    shown: list[Any] = []
    monkeypatch.setattr(deformed, "save", lambda figure, path: shown.append(figure))
    history = {"t": [1.0], "pressure": [[1.0, 2.0]], "traction_t": [[[3.0], [-3.0]]]}
    contact = SimpleNamespace(
        points=np.array([(0.0, 0.0), (1.0, 0.0)]),
        normals=np.array([normal, normal]),
        frame_nodes=None,
    )
    run = SimpleNamespace(
        contact=contact, history={name: np.array(values) for name, values in history.items()}
    )
    monkeypatch.setattr("demos.parts.pictures.tractions.read_run", lambda folder: run)
    deformed.plot_tractions({"box": tmp_path}, (1.0,), tmp_path / "none.png", title="")
    axis = shown[0].axes[1]
    assert axis.get_ylabel() == "shear $p_t$ on the body,\nalong +x [Pa]"
    assert list(axis.lines[0].get_ydata()) == [-3.0, 3.0]
