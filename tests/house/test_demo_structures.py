"""The demo of beams, frames and plates in contact: stops, the ground and throws beside closed
forms, on both routes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from pictures import is_drawn

import vi_contact as vc
from demos.parts.exact.structures import DiskOnGround, LiftedBeam, disk_on_ground, square_plate
from demos.parts.problems.structures import plate_on_a_stop, residual


@pytest.mark.serial
def test_closed_forms() -> None:
    """Tables of the plate (Timoshenko, Woinowsky-Krieger: 0.00406, 0.01160); what holds where disk
    and beam touch."""
    assert square_plate() == pytest.approx((0.0040624, 0.0116008), abs=5e-8)
    disk, h = disk_on_ground(0.3 / 64.0), 1e-3
    assert isinstance(disk, DiskOnGround) and 0.2 < disk.b < 0.21
    assert disk.deflection(np.array([0.0, disk.b, 1.0])) == pytest.approx(
        [disk.gap, disk.gap, 0.0], abs=1e-15
    )
    # flat with slope and curvature zero: what it falls by is of third order
    r = disk.b + h * np.arange(3)
    assert (
        np.all(disk.gap - disk.deflection(r[1:]) < 3.0 * h**2 * h)
        and disk.deflection(r)[2] < disk.gap
    )
    middle = 0.6 + h * np.arange(-2.0, 3.0)
    slope = np.diff(disk.deflection(middle)) / h
    laplacian = np.diff((middle[:-1] + h / 2) * slope) / h / middle[1:-1]
    # 2 pi r Q: what the ground carries, less the load within r
    shear = (laplacian[2] - laplacian[0]) / (2.0 * h)
    assert np.pi * 0.6**2 - 2.0 * np.pi * 0.6 * shear == pytest.approx(disk.force, rel=1e-5)
    beam = LiftedBeam(EI=2.0, q=3.0, P=6.0)
    assert (beam.length, beam.height) == (4.0, 16.0) and beam.shape(
        np.array([0.0, 4.0, 5.0])
    ).tolist() == [16.0, 0, 0]


def test_a_plate_on_any_number_of_ranks(comm: Any) -> None:
    """Edges between ranks are integrated once: the stop's force is that of one rank, 1.6 % above
    the exact one."""
    problem, exact = plate_on_a_stop(comm, disk=False, cells=8, share=0.0)
    state = vc.static_equilibrium(problem)
    assert residual(problem, state) <= 1e-9
    assert comm.allreduce(float(state.r_n.sum())) == pytest.approx(1.015565381173 * exact, rel=1e-9)


@pytest.mark.serial
@pytest.mark.slow
@pytest.mark.promise("guide/bring_your_own.md", "force within 1e-12", bound="1e-9")
@pytest.mark.promise("guide/bring_your_own.md", "the route on all unknowns agree within 2e-8")
@pytest.mark.promise("guide/bring_your_own.md", "leaves a residual of at most 4e-10", bound="1e-9")
@pytest.mark.promise("guide/bring_your_own.md", "the ledger closes within 6e-12", bound="1e-10")
@pytest.mark.promise("guide/bring_your_own.md", "length exact; height 0.6 % on 20 elements")
def test_the_demo_of_structures(
    comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Forces, lift-off, contact radius and times of touch beside closed forms; certificates, routes
    and ledgers."""
    numbers = demo("structures").main(quick=True, out=shared_tmp)
    comm.Barrier()  # rank 0 draws
    assert numbers["frame: force"] == pytest.approx(numbers["frame: exact"], rel=1e-9)
    for count, error in ((20, 5.92e-3), (40, 1.48e-3)):
        assert numbers[f"beam {count}: off the ground"] == pytest.approx(6.5, rel=1e-12)
        assert numbers[f"beam {count}: height error"] == pytest.approx(error, rel=0.01)
    for name, coarse, fine in (
        ("square 0", 0.05, 0.02),
        ("square 0.5", 0.02, 0.01),
        ("disk 0", 0.03, 0.02),
        ("disk 0.5", 0.14, 0.025),
        ("ground", 0.2, 0.06),
    ):
        assert (
            0.0 < numbers[f"{name} 8: force error"] < coarse
            and 0.0 < numbers[f"{name} 16: force error"] < fine
        )
    for cells in (8, 16):
        assert (
            abs(numbers[f"ground {cells}: radius"] - numbers["ground: exact radius"]) < 2.0 / cells
        )
    for name in ("beam", "plate"):
        late = numbers[f"thrown {name}: touches"] - numbers[f"thrown {name}: exact"]
        assert 0.0 < late < 3.0 * numbers[f"thrown {name}: step"]
        assert (
            numbers[f"thrown {name}: rise"] <= 1e-10
            and 0.5 < numbers[f"thrown {name}: left"] < 1.0 - 1e-4
        )
        assert numbers[f"thrown {name}: defect"] <= 1e-10
    told = {name: value for name, value in numbers.items() if name.endswith(("residual", "apart"))}
    assert len(told) == 2 + 3 + 16 + 4 + 4 and max(told.values()) <= 1e-9
    assert comm.rank or is_drawn(shared_tmp / "structures.png")
    assert comm.rank or "relative error on meshes that halve" in capsys.readouterr().out
