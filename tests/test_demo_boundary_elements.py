"""The boundary element demo: both methods near each other on coarse meshes, figures and table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_demos import demo

pytestmark = pytest.mark.serial


@pytest.mark.slow
def test_the_boundary_elements_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V7.1 to V7.3 on 4 to 24 elements: energies within 2 % (rms) of coarse finite elements, impulses within 8 % (ball)
    and 1 %; Uzawa's iteration and the march agree; every step certified."""
    numbers: dict[str, Any] = demo("boundary_elements").main(quick=True, out=tmp_path, progress=False)
    of = {name.split(": ")[0] for name in numbers}
    assert len(of) == 9
    for name in of:
        assert 0.0 < numbers[f"{name}: energy off"] < 0.02, name
        impulse = numbers[f"{name}: fem impulse"]
        assert numbers[f"{name}: impulse"] == pytest.approx(impulse, rel=0.08 if "ball" in name else 0.01), name
        assert numbers[f"{name}: friction"] == pytest.approx(numbers[f"{name}: fem friction"], rel=0.06, abs=1e-4), name
        assert 0.0 < numbers[f"{name}: uzawa off"] < 1e-6 and 5 < numbers[f"{name}: uzawa"] < 600, name
        assert numbers[f"{name}: certificate"] < 1e-12
    for figure in ("snapshots.png", "tractions.png", "energies.png"):
        assert (tmp_path / figure).stat().st_size > 20_000, figure
    assert "fem energy" in capsys.readouterr().out
