"""Condense the static steps of bodies that contact alone holds, with rigid motions as unknowns.

The small problem and its equations are in ``friction.floating``: it wants A = K + P condensed onto
the traces, body by body, and H = B R beside it.
"""

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, EffectiveMatrix, from_each
from ..core.step import StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..core.timing import report_time
from ..core.traces import Traces
from ..kernels.bodies import CondensedBodies
from .friction.condensed import CondensedFriction
from .friction.floating import Border, FloatingNewton
from .friction.newton import FrictionNewton
from .friction.slip_rate import RateIteration


class PreparedFloating:
    """Solve steps of one A = K + P with rigid motions as unknowns.

    Attributes:
        iterations: of Newton in the last step.
    """

    @report_time("condensing")
    def __init__(
        self,
        A: EffectiveMatrix,
        surface: ContactSurface,
        *,
        R: sp.csr_matrix,
        pull: sp.csr_matrix,
        S: sp.csr_matrix,
        method: FrictionNewton,
    ) -> None:
        """Condense A. Collective.

        Args:
            A: the stiffness with firm springs.
            surface: conditions that are traces.
            R: (n, k) rigid motions, rows of this rank.
            pull: P R (n, k).
            S: RᵀP R (k, k).
            method: of which results are said to be.
        """
        assert surface.traces is not None
        condensed = CondensedBodies(A, surface.traces, frictional=True)
        width = 1 + surface.tangents.shape[1]
        condensed.add_to_diagonal(
            np.arange(surface.total) * width, surface.everywhere(surface.compliance)
        )
        border = Border(_find_traces(surface.traces, R), S)
        self._friction = CondensedFriction(
            method, condensed, surface, rates=RateIteration(), border=border
        )
        self._surface = surface
        self._Rt = sp.csr_matrix(R.T)
        self._pull = pull
        self._rigid = surface.everywhere(surface.rigid)

    def solve(self, step: StepProblem, kappa: float, near: Array | None) -> StepResult:
        """Return the answer to a step. Collective.

        Args:
            step: the step; springs pull as A says.
            kappa: κ: springs are κ/(1 + κ) times as strong along rigid motions.
            near: (m, d) reactions like those of the answer; None where nothing is known.

        Raises:
            StepFailure: the states do not settle.
        """
        surface = self._surface
        condensed = self._friction.condensed
        small: FloatingNewton = self._friction.small
        small.kappa = kappa
        small.load = surface.comm.sum(self._Rt @ step.b)
        free = condensed.find_free_motion(step.b)
        if near is not None:
            near = surface.everywhere(near)
        found, held, values = self._friction.reactions(step, free, self._rigid, near)

        # x = A⁻¹(b + P R α - Bᵀr), which has R α in it.
        condensed.find_free_motion(step.b + self._pull @ small.motion)
        x = condensed.answer(found.r.ravel(), held, values)
        r = found.r[surface.slots]
        return StepResult(
            x,
            r_n=r[:, 0].copy(),
            active=found.active[surface.slots],
            iterations=found.iterations,
            method="condensed FrictionNewton",
            r_t=r[:, 1:].copy(),
            history=found.history,
        )


def _find_traces(traces: Traces, R: sp.csr_matrix) -> sp.csr_matrix:
    """Return B R (m d, k) of all conditions, on every rank. Collective.

    Args:
        traces: B.
        R: (n, k) rows of this rank.
    """
    own = sp.coo_matrix(R[traces.own])
    parts = from_each(traces.comm, (traces.places[own.row], own.col, own.data))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    shape = (len(traces.unknowns), R.shape[1])
    return sp.csr_matrix(traces.every @ sp.csr_matrix((values, (rows, columns)), shape=shape))
