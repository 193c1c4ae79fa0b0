"""Which points are open, stick and slip does not depend on the number of ranks."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI
from thrown_blocks import status, thrown_blocks

import vi_contact as vc


@pytest.mark.long
def test_the_same_sets_on_any_number_of_ranks():
    """Two blocks with curved faces that do not match, from the first touch: all ranks together and
    each alone have the same points open, sticking and slipping in every step, and the same
    reactions to 1e-9."""
    sets, forces = [], []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        problem = thrown_blocks(comm, friction=0.4, bent=0.2)
        reports = [
            report for _, report in vc.march(problem, solver=vc.Condensed(), dt=4e-3, steps=14)
        ]
        sets.append(np.array([status(report) for report in reports]))
        forces.append(np.array([problem.surface.everywhere(report.new.r_n) for report in reports]))
    assert all(np.bincount(sets[1].ravel(), minlength=3) > 20)
    assert np.array_equal(*sets)
    assert np.abs(forces[0] - forces[1]).max() < 1e-9 * forces[1].max()
