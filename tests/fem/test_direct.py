"""Direct factorisations of a PETSc that lacks packages: the same answers, what is taken in the log,
known causes."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from mpi4py import MPI
from petsc4py import PETSc

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.core import packages
from vi_contact.core.errors import InputError
from vi_contact.fem.matrices import direct
from vi_contact.fem.matrices.petsc_algebra import (
    PREFIX,
    PetscAlgebra,
    PetscMatrix,
    UnsymmetricAlgebra,
)
from vi_contact.fem.matrices.petsc_rows import aij_of, rows_of
from vi_contact.kernels import compiler
from vi_contact.solvers import ReducedNewton, SemismoothNewton, TaoTron
from vi_contact.solvers.volume.failures import make_petsc_failure
from vi_contact.solvers.volume.options import choose_direct as direct_of_volume

COMM = MPI.COMM_WORLD
EVERY = packages.petsc_has


def without(monkeypatch: Any, *missing: str) -> None:
    """Be a PETSc that was built without these packages, in a process that has asked for none
    yet."""
    gone = {*missing, *packages.OF_SUITESPARSE} if "suitesparse" in missing else {*missing}
    monkeypatch.setattr(
        packages, "petsc_has", lambda package: package not in gone and EVERY(package)
    )
    compiler._report_no_cholmod.cache_clear()


def falling_block(d: int, friction: bool) -> vc.ContactProblem:
    """A block that slides as it falls on an oblique plane."""
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(4, 2, 2)[:d]), COMM
    )
    soft = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)
    system = fem.assemble(
        mesh, soft, damping=vc.Rayleigh(1.0, 1e-4), initial_velocity=(1.0, -1.0, 0.2)[:d]
    )
    plane = vc.HalfSpace((0.0, -1e-3, 0.0)[:d], (0.2, 1.0, 0.1)[:d])
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    return vc.ContactProblem(
        system, surface, friction=vc.Coulomb(0.3) if friction else vc.Frictionless()
    )


def last_step(problem: vc.ContactProblem, solver: Any) -> tuple[Any, Any]:
    """Displacements of this rank and all reactions after some steps in contact, all of them
    certified."""
    steps = list(vc.march(problem, steps=12, dt=4e-4, solver=solver))
    assert max(report.certificate.worst for _, report in steps) <= 1e-9
    state = steps[-1][0]
    r_n = problem.surface.everywhere(state.r_n)
    assert np.max(r_n) > 0.0
    return problem.cartesian(state.u), r_n


def test_a_pattern_is_completed_for_nested_dissection(monkeypatch):
    """PETSc's nested dissection may run for ever where (i, j) is stored and (j, i) is not."""
    n = 6
    first = n * COMM.rank
    rows = np.arange(first, first + n)
    size = n * COMM.size
    below = rows[rows > 0]
    entries = sp.csr_matrix(
        (
            np.concatenate([np.full(len(rows), 2.0), np.full(len(below), 1e-20)]),
            (np.concatenate([rows, below]) - first, np.concatenate([rows, below - 1])),
        ),
        shape=(n, size),
    )
    mat = aij_of(entries, COMM)
    assert direct.complete_pattern(mat) is mat or not EVERY("amd")

    without(monkeypatch, "suitesparse")
    whole = direct.complete_pattern(mat)
    assert COMM.allreduce(rows_of(whole).nnz) == size + 2 * (size - 1)
    factor = PetscAlgebra(COMM).factor(PetscMatrix(mat))
    assert factor.solve(np.ones(n)) == pytest.approx(np.full(n, 0.5), rel=1e-14)


SOLVERS = {
    "condensed": vc.Condensed(),
    "volume": vc.Volume(ReducedNewton()),
    "semismooth": vc.Volume(SemismoothNewton()),
    "tron": vc.Volume(TaoTron()),
    "iterative": vc.Iterative(),
}
MISSING = {
    "no SuiteSparse": ("suitesparse",),
    "no MUMPS": ("mumps",),
    "nothing": (
        "suitesparse",
        "mumps",
        "superlu_dist",
        "superlu",
        "hypre",
        "scalapack",
        "ptscotch",
        "metis",
        "hdf5",
    ),
}


@pytest.mark.parametrize(
    ("name", "missing"),
    # each solver without anything, the first without each
    [(name, "nothing") for name in SOLVERS]
    + [(next(iter(SOLVERS)), missing) for missing in list(MISSING)[:-1]],
)
def test_a_petsc_that_lacks_packages_gives_the_same_answer(name, missing, monkeypatch):
    """Without friction every solver goes on, whatever is missing; by CHOLMOD and MUMPS first, then
    by what there is."""
    problem = falling_block(2, friction=False)
    u, r_n = last_step(problem, SOLVERS[name])
    without(monkeypatch, *MISSING[missing])
    there, pressed = last_step(problem, SOLVERS[name])
    for found, wanted in ((there, u), (pressed, r_n)):
        off = COMM.allreduce(np.abs(found - wanted).max(initial=0.0), op=MPI.MAX)
        assert off <= 1e-9 * COMM.allreduce(np.abs(wanted).max(initial=0.0), op=MPI.MAX)


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        *((name, "nothing") for name in ("condensed", "volume", "iterative")),
        *(("volume", missing) for missing in list(MISSING)[:-1]),
    ],
)
def test_friction_beside_missing_packages(name, missing, monkeypatch):
    """The same with friction; Volume() needs rows exchanged, and says so where PETSc has nothing
    that does it."""
    problem = falling_block(2, friction=True)
    u, _ = last_step(problem, SOLVERS[name])
    without(monkeypatch, *MISSING[missing])
    only_mumps = not (EVERY("umfpack") or EVERY("superlu"))  # as the PETSc of PyPI
    if name == "volume" and (missing == "nothing" or (missing == "no MUMPS" and only_mumps)):
        with pytest.raises(
            InputError, match=r"this PETSc has none .*: take Condensed\(\) or Iterative\(\)"
        ):
            last_step(problem, SOLVERS[name])
        return
    there, _ = last_step(problem, SOLVERS[name])
    off = COMM.allreduce(np.abs(there - u).max(initial=0.0), op=MPI.MAX)
    assert off <= 1e-9 * COMM.allreduce(np.abs(u).max(initial=0.0), op=MPI.MAX)


def test_the_log_says_what_is_taken(monkeypatch, caplog):
    """Nothing while all is there; what is missing and what stands in for it otherwise, without any
    option left over."""
    caplog.set_level(logging.INFO, logger="vi_contact")
    problem = falling_block(2, friction=False)
    if EVERY("cholmod") and EVERY("mumps"):
        last_step(problem, vc.Condensed())
        assert "factorises" not in caplog.text
    without(monkeypatch, "suitesparse", "mumps")
    last_step(problem, vc.Condensed())
    last_step(problem, vc.Volume(ReducedNewton()))
    if COMM.rank == 0:
        assert (
            "needs a C compiler and PETSc's CHOLMOD: this PETSc was built without CHOLMOD"
            in caplog.text
        )
        copied = "" if COMM.size == 1 else ", with a copy on every rank,"
        own = f"PETSc's own Cholesky, ordered by 'nd'{copied} factorises"
        assert f"{own}, as this PETSc has no SuiteSparse" in caplog.text
        assert "Volume: cholesky of 'petsc' factorises, as this PETSc has no MUMPS" in caplog.text
    assert not PETSc.Options(PREFIX).getAll()


def rows(A: sp.csr_matrix) -> PetscMatrix:
    """A matrix shared among the ranks."""
    ends = np.arange(COMM.size + 1) * A.shape[0] // COMM.size
    return PetscMatrix(aij_of(A[ends[COMM.rank] : ends[COMM.rank + 1]], COMM))


def chain(n: int) -> sp.csr_matrix:
    """A chain of springs on springs."""
    return sp.csr_matrix(sp.diags([np.full(n, 4.0), -np.ones(n - 1), -np.ones(n - 1)], [0, 1, -1]))


@pytest.mark.parametrize("missing", [(), *MISSING.values()])
@pytest.mark.parametrize("algebra", [PetscAlgebra, UnsymmetricAlgebra])
def test_factors_of_both_kinds_in_one_process(algebra, missing, monkeypatch):
    """Cholesky and LU, and again, with the options of neither in the other."""
    without(monkeypatch, *missing)
    for upper in (0.0, 1.0) if algebra is UnsymmetricAlgebra else (0.0,):
        A = sp.csr_matrix(chain(60) + sp.diags([np.full(59, upper)], [1]))
        wanted = np.linspace(-1.0, 1.0, 60)
        b = A @ wanted
        here = slice(*(60 * k // COMM.size for k in (COMM.rank, COMM.rank + 1)))
        for one in (PetscAlgebra, algebra) if not upper else (algebra,):
            factor = one(COMM).factor(rows(A))
            found = factor.solve(b[here])
            assert np.abs(found - wanted[here]).max(initial=0.0) <= 1e-13


@pytest.mark.parametrize("missing", [(), *MISSING.values()])
@pytest.mark.parametrize("value", [0.0, float("nan")])
@pytest.mark.parametrize("algebra", [PetscAlgebra, UnsymmetricAlgebra])
def test_singular_is_said_of_singular_matrices(algebra, value, missing, monkeypatch):
    """An unknown without stiffness, or one that is NaN, whatever factorises."""
    without(monkeypatch, *missing)
    A = chain(60)
    A[30] *= 0.0
    A[:, 30] = A[30].T
    A = sp.csr_matrix(A)
    A[30, 30] = value
    with pytest.raises(
        InputError,
        match="the effective matrix cannot be factorised: it is singular or contains NaN",
    ):
        algebra(COMM).factor(rows(A))


def test_no_cause_is_guessed(monkeypatch):
    """An order of elimination that PETSc does not know is what PETSc says, and no word of a
    singular matrix."""
    monkeypatch.setattr("vi_contact.fem.matrices.petsc_algebra.ordering", lambda: "of nobody")
    with pytest.raises(
        InputError, match=r"cannot factorise the effective matrix \(error 63, .*of nobody"
    ) as said:
        PetscAlgebra(COMM).factor(rows(chain(60)))
    assert "singular" not in str(said.value) and "NaN" not in str(said.value)


@pytest.mark.serial
def test_errors_of_petsc_keep_their_causes():
    """Memory, zero pivots and what is not known, of a factor and of Volume()."""

    def error(code: int, text: str) -> Any:
        made = RuntimeError(f"error code {code}\n[0] {text}")
        made.ierr = code  # type: ignore[attr-defined]
        return made

    A = rows(chain(10)).mat
    for code, text, said in (
        (
            55,
            "Memory requested 1",
            "there is not enough memory to factorise the effective matrix of 10 unknowns",
        ),
        (71, "Zero pivot row 3", "it is singular or contains NaN"),
        (81, "Zero pivot row 3", "it is singular or contains NaN"),
        (73, "Matrix is missing diagonal entry 7", "it is singular or contains NaN"),
        (
            92,
            "Could not locate solver type mumps",
            r"\(error 92, Could not locate solver type mumps",
        ),
        (76, "Error in external library", r"\(error 76, Error in external library"),
    ):
        with pytest.raises(InputError, match=said):
            raise direct.failure(None, A, error(code, text))
    assert "no memory left" in str(make_petsc_failure("Volume", error(55, "Memory requested 1")))
    assert "zero pivot" in str(make_petsc_failure("Volume", error(71, "Zero pivot row 3")))
    assert "positive definite" not in str(
        make_petsc_failure("Volume", error(92, "Could not locate solver type mumps"))
    )


def test_options_of_a_volume_solver(monkeypatch):
    """MUMPS where it is; PETSc's own on one rank, a copy of it on several; what exchanges rows
    where that is needed."""
    if EVERY("mumps"):
        assert direct_of_volume("lu", 2)["pc_factor_mat_solver_type"] == "mumps"
    without(monkeypatch, "mumps")
    assert direct_of_volume("cholesky", 1)["pc_factor_mat_solver_type"] == "petsc"
    assert direct_of_volume("cholesky", 2)["redundant_pc_type"] == "cholesky"
    if EVERY("cholmod"):
        assert direct_of_volume("lu", 1, exchanges=True)["pc_factor_mat_solver_type"] == "umfpack"
        assert (
            direct_of_volume("lu", 2, exchanges=True)["redundant_pc_factor_mat_solver_type"]
            == "umfpack"
        )
