"""The factor with contact unknowns last: beside dense algebra, compiled once for all processes,
done without (V4.0)."""

from __future__ import annotations

import logging
import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")  # whose CHOLMOD is taken

from petsc_packages import needs

from vi_contact.core import packages
from vi_contact.core.algebra import Array, SerialComm
from vi_contact.kernels import compiler, contact_last
from vi_contact.kernels.compiler import load_cholmod, load_loops
from vi_contact.kernels.contact_last import ContactLast

pytestmark = [pytest.mark.serial, needs("cholmod")]
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
    """Two grids of which contact unknowns 20 to 24 belong to both, and a row of the identity: three
    trees."""
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
    """L_cc L_ccᵀ is the Schur complement; forward, then backward, solves; any x_c leaves the others
    in equilibrium."""
    monkeypatch.setattr(contact_last, "SHORT_COLUMNS", short)
    A, last = MATRICES[name]
    c, dense, b = (
        np.array(last, dtype=np.int64),
        A.toarray(),
        np.random.default_rng(0).normal(size=A.shape[0]),
    )
    i = np.setdiff1d(np.arange(len(b)), c)
    factor, inverse = ContactLast(load_cholmod(SerialComm()), A, c), np.linalg.inv(dense)
    limit = 50.0 * EPS * np.linalg.cond(dense)
    schur = dense[np.ix_(c, c)] - dense[np.ix_(c, i)] @ np.linalg.solve(
        dense[np.ix_(i, i)], dense[np.ix_(i, c)]
    )
    assert np.array_equal(factor.corner, np.tril(factor.corner))
    assert (
        np.abs(factor.corner @ factor.corner.T - schur).max(initial=0.0)
        <= limit * np.abs(dense).max()
    )

    def near(found: Array, expected: Array) -> None:
        assert np.abs(found - expected).max(initial=0.0) <= limit * np.abs(inverse).max() * len(b)

    near(factor.solve(b), inverse @ b)
    near(factor.solve_corner(factor.forward(b)), (inverse @ b)[c])
    wanted = np.linspace(-1.0, 1.0, len(c))
    x = factor.backward(wanted)
    assert np.array_equal(x[c], wanted)
    near(x[i], np.linalg.solve(dense[np.ix_(i, i)], b[i] - dense[np.ix_(i, c)] @ wanted))
    factor.forget_load()
    near(factor.backward(factor.solve_corner(factor.reduce(wanted))), inverse[:, c] @ wanted)


def test_matrices_that_are_not_positive_definite_are_left_to_others() -> None:
    for wrong in (-1.0, 0.0, float("nan")):
        A = grid(4, 4).tolil()
        A[5, 5] = wrong
        with pytest.raises(ArithmeticError):
            ContactLast(load_cholmod(SerialComm()), sp.csr_matrix(A), np.array([3]))


@pytest.fixture
def cold(tmp_path: Path, monkeypatch: Any) -> Any:
    """An empty cache, no loops of a wheel, and a process that has loaded nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(compiler, "find_shipped", lambda: None)
    forget()
    yield tmp_path / "vi_contact"
    forget()


def forget() -> None:
    """Ask for compiled functions anew."""
    compiler._load_own_loops.cache_clear()
    compiler._compile_with_cholmod.cache_clear()
    compiler._report_no_cholmod.cache_clear()


def test_loops_of_a_wheel_are_taken(cold: Path, monkeypatch: Any, small: Path) -> None:
    """A file that is there serves without a compiler and is asked first; a damaged one does not."""
    file = cold.with_name("loops.abi3.so")
    subprocess.run(["cc", "-shared", "-fPIC", str(small), "-o", str(file)], check=True)
    monkeypatch.setenv("CC", "/no/compiler")
    monkeypatch.setattr(compiler, "find_shipped", lambda: file)
    assert compiler._load_own_loops().relax() == 1.0 and not cold.exists()
    forget()
    damaged = cold.with_name("loops.other.so")
    damaged.write_bytes(b"no library")
    monkeypatch.setattr(compiler, "find_shipped", lambda: damaged)
    assert compiler._load_own_loops() is None


@pytest.fixture
def small(cold: Path) -> Path:
    """A source that compiles in no time."""
    source = cold.with_name("small.c")
    source.write_text("long columns(void) { return 1; }\ndouble relax(void) { return 1.0; }\n")
    return source


NEEDS = "PETSc factorises, because the quicker way needs a C compiler and PETSc's CHOLMOD: "
SLOW = "numpy does what compiled loops would do faster, because they need a C compiler: "


@pytest.mark.parametrize(
    "how", ["no compiler", "no cache", "no header", "no CHOLMOD", "no PETSc", "two", "static"]
)
def test_without_it_today_s_factor_serves_and_the_log_says_so_once(
    how: str, cold: Path, small: Path, monkeypatch: Any, caplog: Any, tmp_path: Path
) -> None:
    """Whatever is missing is told, and the loops that need no CHOLMOD go on where there is a
    compiler."""
    monkeypatch.setattr(compiler, "LOOPS", [small])
    caplog.set_level(logging.INFO)
    maps, said = tmp_path / "maps", ""
    line = "7f00-7f01 r-xp 00000000 08:01 12 {}\n"
    if how == "no compiler":
        monkeypatch.setenv("CC", "/nowhere/cc")
        said = "there is no C compiler that works"
    elif how == "no cache":
        cold.write_text("a file where the folder should be")
        said = "there is no C compiler that works"
    elif how == "no header":
        monkeypatch.setattr(
            compiler, "locate_cholmod_of_petsc", lambda: Path("/nowhere/lib/libcholmod.so.3")
        )
        said = "there is no header cholmod.h beside /nowhere/lib/libcholmod.so.3"
    elif how == "no CHOLMOD":
        monkeypatch.setattr(packages, "petsc_has", lambda package: False)
        said = "this PETSc was built without CHOLMOD"
    elif how == "no PETSc":
        monkeypatch.setattr(packages, "PETSC", "nobody.PETSc")
        said = "no PETSc is in this process"
    else:
        maps.write_text(
            line.format("/lib/libm.so.6")
            + 2 * (how == "two") * line.format("/a/libcholmod.so.3")
            + (how == "two") * line.format("/b/libcholmod-1.so.4")
            + "7f02-7f03 r-xp 0 08:01 0\n"
        )
        monkeypatch.setattr(compiler, "MAPS", maps)
        said = (
            "there are 2 files of CHOLMOD in this process"
            if how == "two"
            else "there are 0 files of CHOLMOD"
        )
    assert load_cholmod(SerialComm()) is None and load_cholmod(SerialComm()) is None
    told = [record.getMessage() for record in caplog.records]
    assert (
        [one for one in told if one.startswith(NEEDS)] == [one for one in told if said in one] != []
    )
    assert (load_loops(SerialComm()) is None) == (how in ("no compiler", "no cache"))
    slow = sum(record.getMessage().startswith(SLOW) for record in caplog.records)
    assert slow == (how in ("no compiler", "no cache"))
    assert len(caplog.records) == 1 + slow
    assert not cold.is_dir() or all(one.name.startswith("small-") for one in cold.iterdir())


def test_the_loops_need_no_library_of_the_machine() -> None:
    """What every process loads names no CHOLMOD, and brings none."""
    script = (
        "from vi_contact.core.algebra import SerialComm; from vi_contact.kernels.compiler import "
        "load_cholmod, load_loops; "
        "print(load_loops(SerialComm()) is not None, load_cholmod(SerialComm()), "
        "'cholmod' in open('/proc/self/maps').read())"
    )
    told = subprocess.run(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, check=True
    ).stdout
    assert told.split() == ["True", "None", "False"]


def test_a_cholmod_of_another_version_than_its_header_is_left_alone(
    small: Path, monkeypatch: Any, tmp_path: Path
) -> None:
    """Structures change between versions: the compiled file itself compares."""
    if not packages.petsc_has("cholmod"):
        pytest.skip("PETSc has no CHOLMOD here")
    header = compiler._locate_header_folder(compiler.locate_cholmod_of_petsc()) / "cholmod.h"
    other = tmp_path / "cholmod.h"
    other.write_text(
        f'#include "{header}"\n#undef CHOLMOD_SUB_VERSION\n#define CHOLMOD_SUB_VERSION 99\n'
    )
    monkeypatch.setattr(compiler, "_locate_header_folder", lambda file: tmp_path)
    monkeypatch.setattr(compiler, "LOOPS", [small])
    forget()
    assert load_cholmod(SerialComm()) is None


def test_a_file_that_cannot_be_loaded_is_made_again(small: Path) -> None:
    """As after a change of CHOLMOD."""
    file = compiler.compile_library([small], [])
    file.write_bytes(b"not a library")
    os.utime(file, (0, 0))
    assert (
        compiler.compile_library([small], []) == file
        and file.stat().st_size > 1000
        and file.stat().st_mtime > 0
    )


def test_another_library_is_another_file(small: Path, tmp_path: Path) -> None:
    """What was compiled beside a library is not taken beside another one at the same place."""
    beside = compiler.compile_library([small], [])
    first = compiler.compile_library([small], [], beside)
    os.utime(beside, (1, 1))
    assert len({beside, first, compiler.compile_library([small], [], beside)}) == 3


@pytest.mark.long
def test_processes_that_compile_at_once_do_not_meet(small: Path, cold: Path) -> None:
    """Both find it missing, both make it, one file is left, and each has loaded a whole one."""
    script = (
        "import pathlib; from vi_contact.kernels import compiler; source = "
        f"pathlib.Path({str(small)!r}); print(compiler.compile_library([source], []))"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    told = {run.communicate()[0].strip() for run in runs}
    assert all(run.returncode == 0 for run in runs) and told == {
        str(file) for file in cold.iterdir()
    }


@pytest.mark.skipif(platform.machine() != "x86_64", reason="about processors with AVX2")
@pytest.mark.skipif("CC" in os.environ, reason="about Debian's own compiler")
def test_loops_are_compiled_twice_for_processors_with_avx2() -> None:
    """The macro FASTEST once did nothing in files that include no header of the C library first:
    the compiled loops were right, and slower."""
    library = compiler.compile_library(compiler.LOOPS, []).read_bytes()
    for source in compiler.LOOPS:
        names = re.findall(r"^FASTEST \w+\s+(\w+)\(", source.read_text("utf-8"), re.MULTILINE)
        assert names, source.name
        for name in names:
            assert f"{name}.avx2".encode() in library
