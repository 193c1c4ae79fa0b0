"""Choose a direct factorisation among those that this PETSc was built with, and say why one failed.

PETSc's own factorisation is always there. MUMPS, SuiteSparse and others are packages, which a PETSc
may lack: whoever assumes one asks ``core.packages`` first. A cause is named only where PETSc or the
matrix tells it.
"""

import logging
from typing import Any

import numpy as np
from petsc4py import PETSc

from ...core import packages
from ...core.errors import InputError

log = logging.getLogger(__name__)
FULL_ROW = 40.0  # entries of a row: 2D meshes have fewer, 3D meshes more
FEW_ROWS = 10_000  # with full rows: beyond, MUMPS' dense blocks pay
# with sparse rows: a copy of the factor on every rank takes about 0.5 GB here
COPIED_ROWS = 300_000
ZERO_PIVOT = (71, 81)  # errors of PETSc: a zero pivot of LU, of Cholesky
MEMORY = (55,)  # PETSC_ERR_MEM
OUT_OF_MEMORY = 3  # PC_FACTOR_OUTMEMORY
MUMPS_SINGULAR = (-6, -10)  # INFOG(1): in its structure, in its numbers
MUMPS_MEMORY = (-8, -9, -11, -13, -14, -15, -17, -18, -19, -20)


def ordering() -> str:
    """Return PETSc's name of the order of elimination for its own factorisation.

    This is minimum degree, which needs SuiteSparse, or PETSc's nested dissection without it.
    """
    return "amd" if packages.petsc_has("amd") else "nd"


def complete_pattern(mat: Any) -> Any:
    """Return a symmetric matrix that stores (j, i) wherever it stores (i, j). Collective.

    Where an entry is zero by rounding, it may be stored on one side of the diagonal only. PETSc's
    nested dissection does not end on some graphs of this kind, so it is given another matrix, which
    has explicit zeros there. The order of elimination by SuiteSparse completes the graph by itself.
    """
    if ordering() != "nd":
        return mat
    other = mat.transpose(PETSc.Mat())
    other.zeroEntries()
    whole = mat.copy()
    whole.axpy(1.0, other, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    other.destroy()
    return whole


def own_serves(mat: Any) -> bool:
    """Say whether PETSc's own factorisation is faster than MUMPS. Collective.

    It is where rows are sparse (2D), on several ranks not too many of them, since each rank keeps a
    copy of the factor; and where rows are full (3D) but few.
    """
    rows = max(mat.getSize()[0], 1)
    if mat.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"] > FULL_ROW * rows:
        return bool(rows <= FEW_ROWS)
    return bool(mat.comm.size == 1 or rows <= COPIED_ROWS)


def by_mumps(mat: Any, *, symmetric: bool, own: bool) -> bool:
    """Say whether MUMPS factorises: where it is the better one, if PETSc has it. Collective.

    The log tells what takes the place of packages that this PETSc lacks, unless options of the user
    choose the factor.

    Args:
        mat: the PETSc matrix.
        symmetric: whether it is.
        own: whether options of the user choose the factor.
    """
    serves = symmetric and own_serves(mat)
    has_mumps = packages.petsc_has("mumps")
    mumps = has_mumps and not serves
    missing = []
    if not (packages.petsc_has("cholmod") and packages.petsc_has("amd")):
        missing.append("SuiteSparse (CHOLMOD, AMD)")
    if not (has_mumps or serves):
        missing.append("MUMPS")
    if missing and not own and mat.comm.rank == 0:
        kind = "Cholesky" if symmetric else "LU"
        taken = "MUMPS" if mumps else f"PETSc's own {kind}, ordered by '{ordering()}'"
        copied = "" if mat.comm.size == 1 or mumps else ", with a copy on every rank,"
        log.info(
            "%s%s factorises, as this PETSc has no %s", taken, copied, " and no ".join(missing)
        )
    return mumps


def failure(pc: Any, mat: Any, error: Any = None) -> InputError:
    """Return the error to raise for a factorisation that failed, with its cause and the remedy.

    A factorisation fails where PETSc raises, or where it solves to numbers that are not finite
    without a word. The call is collective in the second case.

    Args:
        pc: the preconditioner that was to factorise.
        mat: the PETSc matrix.
        error: what PETSc raised, or None.
    """
    rows = mat.getSize()[0]
    message = ""
    code = 0
    reason = None
    if error is None:
        reason = _find_reason(pc, mat)
    else:
        # the last line of PETSc's text is "[rank] what is wrong"
        message = str(error).splitlines()[-1].split("] ", 1)[-1].strip()
        code = error.ierr
    if code in MEMORY or reason == "memory":
        return InputError(
            f"there is not enough memory to factorise the effective matrix of {rows} unknowns: "
            "take Iterative(), which factorises nothing, or more memory"
        )
    # a symmetric matrix with a row that has no diagonal entry is not positive definite
    no_diagonal = "missing diagonal" in message
    if code in ZERO_PIVOT or no_diagonal or reason == "singular":
        return InputError(
            "the effective matrix cannot be factorised: it is singular or contains NaN: check the "
            "materials, and that every part of the body is fixed or has mass"
        )
    cause = reason if error is None else f"error {code}, {message}"
    return InputError(
        f"PETSc cannot factorise the effective matrix ({cause}): take Iterative(), which "
        "factorises nothing, or another factorisation by PETSc's options vi_contact_factor_…"
    )


def _find_reason(pc: Any, mat: Any) -> str:
    """Return why a factor gives numbers that are not finite, the same on every rank. Collective.

    The reason is "memory", "singular", or the words of MUMPS for another one. Where ranks differ
    the first that is not "singular" counts, as memory may be short on one rank only.
    """
    cause = _find_cause(pc)
    causes = [cause] if mat.comm.size == 1 else mat.comm.tompi4py().allgather(cause)
    return next((cause for cause in causes if cause != "singular"), "singular")


def _find_cause(pc: Any) -> str:
    """Return the reason that this rank knows (``_find_reason``)."""
    if hasattr(pc, "getFailedReason") and pc.getFailedReason() == OUT_OF_MEMORY:
        return "memory"
    if pc.getType() not in ("cholesky", "lu") or pc.getFactorSolverType() != "mumps":
        return "singular"  # PETSc's own factor stops at zero pivots only
    info = pc.getFactorMatrix().getMumpsInfog(1)
    if info in MUMPS_MEMORY:
        return "memory"
    return "singular" if info >= 0 or info in MUMPS_SINGULAR else f"MUMPS says INFOG(1) = {info}"


def finite(x: Any) -> bool:
    """Say whether all entries of a PETSc vector are finite. Collective."""
    return bool(np.isfinite(x.norm()))
