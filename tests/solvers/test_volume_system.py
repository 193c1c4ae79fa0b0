"""Parts of the volume route: the system with springs, the measure of its errors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("petsc4py")

from volume_cases import Case, pushed_block

from vi_contact.core.verify import kkt_residual
from vi_contact.solvers.volume.bounded_system import BoundedSystem
from vi_contact.solvers.volume.route import ReducedNewton, Volume
from vi_contact.solvers.volume.scaled_step import ScaledStep

M = 8
SPRINGS = {"compliance": np.array([0.3, 0.0] * 4), "scale": 2.0}


def system_of(c: Case) -> BoundedSystem:
    return BoundedSystem(c.step.A, c.step.surface, c.step.scale)


def dense(system: BoundedSystem) -> Any:
    """The enlarged matrix on one process."""
    return np.column_stack([system.apply(unit) for unit in np.eye(system.size)])


@pytest.mark.serial
@pytest.mark.parametrize("options", [{}, SPRINGS], ids=["rigid", "springs"])
def test_assembled_matrix_is_the_applied_one(options: dict[str, Any]) -> None:
    system = system_of(pushed_block(**options))
    A = dense(system)
    assembled = system.assemble()
    assert np.max(np.abs(A - A.T)) <= 1e-15 * np.max(np.abs(A))
    assert np.max(np.abs(assembled[:, :] - A)) <= 1e-15 * np.max(np.abs(A))
    assert np.max(np.sum(np.abs(A), axis=1)) <= system.norm()


@pytest.mark.parametrize("options", [{}, SPRINGS], ids=["rigid", "springs"])
def test_assembled_matrix_in_parallel(options: dict[str, Any]) -> None:
    """The renumbered rows and columns of all ranks multiply like the operator."""
    pytest.importorskip("mpi4py")
    system = system_of(pushed_block(parallel=True, **options))
    assembled = system.assemble()
    x, y = assembled.createVecs()
    x.array[:] = np.sin(1.0 + np.arange(system.size) + 10.0 * system.surface.comm.rank)
    assembled.mult(x, y)
    assert np.max(np.abs(y.array_r - system.apply(x.array_r)), initial=0.0) <= 1e-13


@pytest.mark.parametrize("options", [{}, SPRINGS], ids=["rigid", "springs"])
def test_error_measure_is_not_looser_than_the_certificate(options: dict[str, Any]) -> None:
    """Whatever y PETSc stops at, the certificate of the loop is not larger than the error the
    solver judged by."""
    pytest.importorskip("mpi4py")
    c = pushed_block(parallel=True, **options)
    prepared = Volume(method=ReducedNewton()).prepare(c.step.A, c.step.surface, c.step.scale)
    system = system_of(c)
    scaled = ScaledStep(system, 1e-9)
    scaled.set(c.step, system.start(c.step))
    prepared._scaled = scaled
    prepared.close()
    rng = np.random.default_rng(5)
    noise = rng.normal(size=(20, len(c.b) + 2 * M))
    for row in noise:
        y = np.minimum(np.resize(row, system.size), scaled.upper)
        F = scaled.residual(y)
        prepared._driver = SimpleNamespace(run=lambda found=(y, F, 1, 0): found)
        certificate = kkt_residual(c.step, prepared._solve_without_friction(c.step))
        assert certificate.worst <= (1.0 + 1e-12) * max(scaled.errors(y, F)[:2])
