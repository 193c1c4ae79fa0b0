"""Histories as a Dataset of xarray, which need not be installed."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem

import vi_contact as vc
from vi_contact.core.errors import InputError

SHAKE = vc.Harmonic(30.0, 3.0, direction=(1.0,))


@pytest.mark.serial
def test_without_xarray(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence with the remedy."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    solution = vc.simulate(
        chain_problem(3, excitation=SHAKE), scheme=vc.Midpoint(), dt=1e-3, steps=5, progress=False
    )
    with pytest.raises(InputError, match="to_xarray: xarray is not installed: pip install xarray"):
        solution.to_xarray()


def test_numbers_units_and_points(comm: Any, shared_tmp: Path) -> None:
    """Every column with its unit and meaning, arrays along the contact points with their places; a
    folder gives the same."""
    pytest.importorskip("xarray", reason="xarray is not installed: pip install xarray")
    pytest.importorskip("dolfinx")
    from fem_problems import WALL_DT, shaken_wall

    problem = replace(shaken_wall(comm), friction=vc.Coulomb(0.3))
    record = [vc.Energy(), vc.Contact(), vc.Probe({"top": (6.0, 9.0)}, nearest=True)]
    solution = vc.simulate(
        problem, dt=WALL_DT, steps=8, record=record, out=shared_tmp, progress=False
    )
    dataset = solution.to_xarray()
    assert set(dataset.variables) >= set(solution.history)
    for name, values in solution.history.items():
        unit, meaning = solution.columns[name]
        assert np.array_equal(dataset[name].values, values, equal_nan=values.dtype.kind == "f")
        assert dataset[name].dims[0] == "t" and dataset[name].attrs["long_name"] == meaning
        assert dataset[name].attrs["units"] == ("1" if unit == "-" else unit)
    points = problem.surface.on_first(problem.surface.points)
    assert dataset.pressure.dims == ("t", "point")
    assert np.array_equal(dataset.y.values, points[:, 1])
    assert dataset.attrs["worst_certificate"] == solution.facts["worst_certificate"]
    later = float(solution.history["t"][5])
    assert dataset.u_x_top.sel(t=later) == solution.history["u_x_top"][5]
    comm.Barrier()
    if comm.rank == 0:
        again = vc.read_run(shared_tmp).to_xarray()
        assert again.drop_attrs().equals(dataset.drop_attrs())
        assert dataset.slip.dims == ("t", "point", "tangent") and len(points) > 0
