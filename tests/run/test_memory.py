"""What a run takes of the memory and of the time to set it up, in its summary and its log."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from marched_chain import run, run_wall, wall
from summaries import summary_of

from vi_contact.run.memory import describe_memory, measure_memory


def test_the_summary_counts_the_bytes(comm: Any, shared_tmp: Path) -> None:
    """Twelve bytes an entry of every matrix that there is, and nine for the copy in blocks of 2 × 2
    that products read, on all ranks together; a peak for every rank."""
    pytest.importorskip("dolfinx")
    problem = wall(comm)
    solution = run_wall(comm, shared_tmp, 3, problem=problem)
    found = solution.facts["memory"]
    entry = 8 + problem.system.K.mat.getValuesCSR()[1].dtype.itemsize
    own = problem.system.K.mat.getInfo()["nz_used"]
    known = found["bytes"]
    both = entry + 8 + (entry - 8) / 4
    assert known["K"] == both * (own + problem.turned.K.mat.getInfo()["nz_used"])
    assert known["A"] >= entry * own and known["mesh"] > 8 * 3 * problem.system.space.unknowns // 2
    assert "factor" in known or comm.size > 1  # PETSc's copies of its own do not tell
    assert len(found["peak_bytes"]) == comm.size and all(
        2**20 < one < 2**40 for one in found["peak_bytes"]
    )
    if comm.rank == 0:
        assert summary_of(shared_tmp)["memory"] == found
        told = (shared_tmp / "run.log").read_text()
        assert told.count("INFO memory [MB]: at most ") == 2 and describe_memory(found) in told
        assert re.search(
            r"set up: .*mesh [\d.e-]+ s, assembling [\d.e-]+ s, contact [\d.e-]+ s, mass ", told
        )
        assert re.search(r"INFO preparing [\d.e-]+ s\n", told)
    comm.Barrier()


@pytest.mark.serial
def test_what_nothing_tells_is_left_out(tmp_path: Path) -> None:
    """Matrices of scipy do not count their bytes; a failed run has the last report."""
    found = run(tmp_path, 5).facts["memory"]
    assert found["bytes"] == {} and len(found["peak_bytes"]) == 1
    assert np.array_equal(summary_of(tmp_path)["memory"]["peak_bytes"], found["peak_bytes"])


def test_memory_before_a_step(comm: Any) -> None:
    """Without a step there is neither A nor a factor."""
    pytest.importorskip("dolfinx")
    assert set(measure_memory(wall(comm), None)["bytes"]) == {"K", "M", "mesh"}
