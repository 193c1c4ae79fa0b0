"""The factor with contact unknowns last: beside dense algebra, compiled once for all processes, done without (V4.0)."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from vi_contact.core import compiled, contact_last
from vi_contact.core.algebra import Array, SerialComm
from vi_contact.core.compiled import library
from vi_contact.core.contact_last import ContactLast

pytestmark = pytest.mark.serial
EPS = np.finfo(float).eps


def grid(*lengths: int) -> sp.csr_matrix:
    """The negative Laplacian on a grid, times random stiffnesses."""
    rng, n = np.random.default_rng(3), int(np.prod(lengths))
    places, edges = np.arange(n).reshape(lengths), []
    for axis in range(len(lengths)):
        one = np.moveaxis(places, axis, 0)
        edges.append(np.column_stack([one[:-1].ravel(), one[1:].ravel()]))
    i, j = np.vstack(edges).T
    B = sp.coo_matrix((np.ones(len(i)), (np.arange(len(i)), i)), (len(i), n))
    B -= sp.coo_matrix((np.ones(len(i)), (np.arange(len(i)), j)), (len(i), n))
    return sp.csr_matrix(B.T @ sp.diags(rng.uniform(0.5, 2.0, len(i))) @ B + 0.1 * sp.identity(n))


def two_bodies() -> sp.csr_matrix:
    """Two grids of which contact unknowns 20 to 24 belong to both, and a row of the identity: three trees."""
    whole = sp.block_diag([grid(5, 5), sp.csr_matrix((20, 20)), sp.identity(1)], format="lil")
    whole[20:45, 20:45] += grid(5, 5)
    return sp.csr_matrix(whole)


MATRICES: dict[str, tuple[sp.csr_matrix, list[int]]] = {
    "plane": (grid(12, 17), [3, 200, 7, 100, 11]),
    "space": (grid(7, 8, 9), list(range(63, 0, -9))),
    "opposite sides": (grid(9, 20), [0, 179, 20, 159, 40, 139]),
    "two bodies": (two_bodies(), [24, 0, 22, 41, 2, 21, 20, 23]),
    "none": (grid(6, 6), []),
    "all": (grid(3, 3), [4, 2, 0, 8, 6, 1, 3, 5, 7]),
}


@pytest.mark.parametrize("short", [contact_last.SHORT_COLUMNS, 0.0], ids=["columns", "supernodes"])
@pytest.mark.parametrize("name", MATRICES)
def test_parts_beside_dense_algebra(name: str, short: float, monkeypatch: Any) -> None:
    """L_cc L_ccᵀ is the Schur complement; forward, then backward, solves; any x_c leaves the others in equilibrium."""
    monkeypatch.setattr(contact_last, "SHORT_COLUMNS", short)
    A, last = MATRICES[name]
    c, dense, b = np.array(last, dtype=np.int64), A.toarray(), np.random.default_rng(0).normal(size=A.shape[0])
    i = np.setdiff1d(np.arange(len(b)), c)
    factor, inverse = ContactLast(library(SerialComm()), A, c), np.linalg.inv(dense)
    limit = 50.0 * EPS * np.linalg.cond(dense)
    schur = dense[np.ix_(c, c)] - dense[np.ix_(c, i)] @ np.linalg.solve(dense[np.ix_(i, i)], dense[np.ix_(i, c)])
    assert np.array_equal(factor.corner, np.tril(factor.corner))
    assert np.abs(factor.corner @ factor.corner.T - schur).max(initial=0.0) <= limit * np.abs(dense).max()

    def near(found: Array, expected: Array) -> None:
        assert np.abs(found - expected).max(initial=0.0) <= limit * np.abs(inverse).max() * len(b)

    near(factor.solve(b), inverse @ b)
    near(factor.free(factor.forward(b)), (inverse @ b)[c])
    wanted = np.linspace(-1.0, 1.0, len(c))
    x = factor.backward(wanted)
    assert np.array_equal(x[c], wanted)
    near(x[i], np.linalg.solve(dense[np.ix_(i, i)], b[i] - dense[np.ix_(i, c)] @ wanted))
    factor.unloaded()
    near(factor.backward(factor.free(factor.reduced(wanted))), inverse[:, c] @ wanted)


def test_matrices_that_are_not_positive_definite_are_left_to_others() -> None:
    for wrong in (-1.0, 0.0, float("nan")):
        A = grid(4, 4).tolil()
        A[5, 5] = wrong
        with pytest.raises(ArithmeticError):
            ContactLast(library(SerialComm()), sp.csr_matrix(A), np.array([3]))


@pytest.fixture
def cold(tmp_path: Path, monkeypatch: Any) -> Any:
    """An empty cache, and a process that has loaded nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    compiled._loops.cache_clear()
    yield tmp_path / "vi_contact"
    compiled._loops.cache_clear()


@pytest.fixture
def small(cold: Path, monkeypatch: Any) -> Path:
    """A source of the same names that compiles in no time."""
    source = cold.with_name("small.c")
    source.write_text("long columns(void) { return 1; }\ndouble relax(void) { return 1.0; }\n")
    monkeypatch.setattr(compiled, "SOURCE", source)
    return source


@pytest.mark.parametrize("how", ["no compiler", "no header", "no cache"])
def test_without_it_today_s_factor_serves_and_the_log_says_so_once(
    how: str, cold: Path, monkeypatch: Any, caplog: Any
) -> None:
    caplog.set_level(logging.INFO)
    if how == "no compiler":
        monkeypatch.setenv("CC", "/nowhere/cc")
    elif how == "no header":
        monkeypatch.setenv("CC", "cc -DCHOLMOD_H -nostdinc")
    else:
        cold.write_text("a file where the folder should be")
    assert library(SerialComm()) is None and library(SerialComm()) is None
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 1 and said[0].startswith("PETSc factorises, because the quicker way needs")
    assert not cold.is_dir() or not list(cold.iterdir())


def test_a_file_that_cannot_be_loaded_is_made_again(small: Path) -> None:
    """As after a change of CHOLMOD."""
    file = compiled.compiled()
    file.write_bytes(b"not a library")
    os.utime(file, (0, 0))
    assert compiled.compiled() == file and file.stat().st_size > 1000 and file.stat().st_mtime > 0


def test_processes_that_compile_at_once_do_not_meet(small: Path, cold: Path) -> None:
    """Both find it missing, both make it, one file is left, and each has loaded a whole one."""
    script = f"import pathlib; from vi_contact.core import compiled; compiled.SOURCE = pathlib.Path({str(small)!r}); " \
             "print(compiled.compiled())"
    runs = [subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    told = {run.communicate()[0].strip() for run in runs}
    assert all(run.returncode == 0 for run in runs) and told == {str(file) for file in cold.iterdir()}
