"""Choose the preconditioner by the share of inertia in A: the Courant number, as the matrices show it.

With A = m M + c C + k K the number

    C² = sum (A_ii - m M_ii) / sum m M_ii

compares stiffness and inertia of the diagonal over all unknowns. On uniform meshes it is 0.7 (hexahedra) to 1.0
times (tetrahedra) the Courant number c_p dt / h of the trapezoidal rule, infinite in statics, and needs no cells.
"""

import numpy as np

from ...core.algebra import EffectiveMatrix

JACOBI, ICC, GAMG = "jacobi", "icc", "gamg"
KINDS = (JACOBI, ICC, GAMG)
SMALL, LARGE = 0.5, 30.0  # CHOSEN: docs/guide/solvers.md has what was measured


def courant(A: EffectiveMatrix) -> float:
    """Return C; NaN when A does not know what inertia is in it. Collective."""
    if A.inertia is None:
        return float("nan")
    factor, M = A.inertia
    diagonal = float(np.sum(A.matrix.diagonal()))
    mass = factor * float(np.sum(M.diagonal())) if factor else 0.0
    total, inertia = A.algebra.comm.sum(np.array([diagonal, mass]))
    return float(np.sqrt(max(total - inertia, 0.0) / inertia)) if inertia > 0.0 else float("inf")


def chosen(number: float, modes: bool) -> str:
    """Return the preconditioner for a Courant number: Jacobi up to 0.5, ICC up to 30 or where it is not known, GAMG
    beyond. ``modes``: whether rigid motions are known, without which GAMG is no use."""
    if number <= SMALL:
        return JACOBI
    return GAMG if number > LARGE and modes else ICC
