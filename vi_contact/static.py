"""Where a run starts: the initial state of the data, or the equilibrium of a static (gravity) stage with contact.

A body that contact alone holds (floating: a block standing on the ground) has a singular K. Its equilibrium is the
limit of the proximal-point iteration (Martinet 1970; Rockafellar, SIAM J. Control Optim. 14, 1976, thm 1)

    (K + eps M) u_{k+1} = f + eps M u_k - B_nᵀ r - B_tᵀ r_t,   contact conditions on u_{k+1}

each step of which is an ordinary problem of the contract, with one factorisation for all. It converges from any start
if there is an equilibrium. If there is none, the steps d = u_{k+1} - u_k tend to a rigid motion that no contact stops
and that the loads drive; that is how it is recognised (K d = 0, B_n d <= 0, f·d > 0: the energy has no minimum).

Rigid motions that no load drives stay where they start: along them M-weighted means of u are those of u0 (the centre
of mass of a block free to slide on level ground does not move). On a conservative problem all else is unique.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .algebra import Array, Mask, max_abs
from .certified import TOLERANCE, CertifiedSolver
from .errors import InputError, StepFailure
from .step import ContactProblem, EffectiveMatrix, Solver, State, StepProblem, StepResult
from .verify import kkt_residual

REGULARISATION = 1e-6  # eps over max diag K / max diag M: keeps 10 digits of rigid motions, few steps for elastic ones
ITERATIONS = 200
NEAR = 1e3  # tolerance of a step over that of the problem: what counts is the residual of the problem itself
RIGID = 1e-7  # dᵀKd over eps dᵀMd below which a motion deforms nothing
UNBRAKED = 0.99999  # of the step before: a motion that only a new contact can stop
STOPPED = 1e-9  # of the largest motion: what a contact point may move towards its obstacle in a free motion


def initial_state(problem: ContactProblem, t: float = 0.0) -> State:
    """u0, v0 of the system, in the rotated basis, no reaction; InputError when u0 penetrates the obstacle."""
    system, surface = problem.equations, problem.surface
    gap = surface.gap(t) - surface.normal_values(system.u0)
    u_max = float(surface.comm.max(np.array([np.max(np.abs(system.u0), initial=0.0)]))[0])
    size = max(u_max, float(np.max(surface.gap0, initial=0.0)))
    if len(gap) and gap.min() < -1e-9 * size:
        raise InputError(
            f"the initial displacement penetrates the obstacle by {-gap.min():.3g} m: reduce it or enlarge the gap"
        )
    none = np.zeros(surface.count)
    return State(t, 0, system.u0.copy(), system.v0.copy(), none, surface.bilateral.copy())


def static_equilibrium(
    problem: ContactProblem, *, solver: Solver, t: float = 0.0, tolerance: float = TOLERANCE
) -> State:
    """The gravity stage: K u = f(t) - B_nᵀ r_n - B_tᵀ r_t with contact active, without excitation.

    The state it leaves has v = 0, keeps stresses, reactions and contact set, and is the start of the dynamic stage. A
    body that no prescribed displacement holds is brought to rest on its contacts; free rigid motions that no load
    drives keep the mean position of u0 (see the head of this file).

    Raises:
        InputError: the loads drive a rigid motion that nothing stops: there is no equilibrium.
        StepFailure: no answer below the certificate tolerance.
    """
    return Equilibria(problem, solver=solver, tolerance=tolerance).after(initial_state(problem, t), t)


class Equilibria:
    """Static stages of one problem, with one factorisation for all."""

    def __init__(self, problem: ContactProblem, *, solver: Solver, tolerance: float = TOLERANCE) -> None:
        system = problem.static_load
        self._problem = problem
        self._K = EffectiveMatrix(system.algebra.combine([(1.0, system.K)]), system.algebra)
        self._solve: Callable[[StepProblem], StepResult]
        if system.floating:
            self._solve = _Proximal(problem, self._K, solver, tolerance).solve
        else:
            certified = CertifiedSolver(problem, self._K, 1.0, [solver], tolerance)
            self._solve = lambda step: certified.solve(step)[0]

    def after(self, old: State, t: float) -> State:
        """The equilibrium at time t, of a body that rubs and slides from where ``old`` left it; numbered as ``old``."""
        problem = self._problem
        step = StepProblem(
            A=self._K,
            b=problem.static_load.load.at_rest(t),
            bound=problem.surface.gap(t),
            surface=problem.surface,
            scale=1.0,
            guess=old.u,
            active=old.active,
            t=t,
            k=old.k,
            friction=problem.friction,
            slip0=problem.slip_origin(old.u, old.t, t),
        )
        result = self._solve(step)
        return State(t, old.k, result.x, np.zeros_like(old.u), result.r_n, result.active, r_t=result.r_t)


@dataclass(frozen=True)
class _Motion:
    """One step d of the iteration: M d, its size ‖d‖_M, B_n d, the contact set it ended in."""

    d: Array
    momentum: Array
    pace: float
    closing: Array
    active: Mask


class _Proximal:
    """The proximal-point iteration for the matrix ``K``, which is singular."""

    step: StepProblem

    def __init__(self, problem: ContactProblem, K: EffectiveMatrix, solver: Solver, tolerance: float) -> None:
        system = self.system = problem.static_load
        mass = EffectiveMatrix(system.M, system.algebra)
        self.eps = REGULARISATION * K.largest / mass.largest
        self.A = EffectiveMatrix(system.algebra.combine([(1.0, system.K), (self.eps, system.M)]), system.algebra)
        self.certified = CertifiedSolver(problem, self.A, 1.0, [solver], NEAR * tolerance)
        self.tolerance = tolerance

    def solve(self, step: StepProblem) -> StepResult:
        """Iterates to the tolerance and on until neither the residual of the problem itself nor the step has got
        smaller twice running: the residual of a stiff body is at its round-off long before soft motions are."""
        self.step, near = step, replace(step, A=self.A)
        u, active = step.guess, step.active
        best: StepResult | None = None
        least, slowest, vain, old = np.inf, np.inf, 0, None
        for _ in range(ITERATIONS):
            b = step.b + self.eps * (self.system.M @ u)
            result, _, _ = self.certified.solve(replace(near, b=b, guess=u, active=active))
            worst = kkt_residual(step, result).worst
            new = self._motion(result, u)
            better = worst < least or (worst <= self.tolerance and new.pace < slowest)
            vain, best = (0, result) if better else (vain + 1, best)
            least, slowest = min(worst, least), min(new.pace, slowest)
            if vain == 2 and best is not None and least <= self.tolerance:
                return best
            if least > self.tolerance:
                self._refuse_flight(new)
            # once the tolerance is met steps are round-off: to go far along one would shift the body
            ahead = 0.0 if old is None or least <= self.tolerance else self._ahead(old, new, result)
            u, active = result.x + ahead * new.d, result.active
            old = new if ahead == 0.0 else None
        if best is not None and least <= self.tolerance:
            return best
        raise StepFailure(
            f"the static stage of a body held by contact alone stayed at the residual {least:.1e} after {ITERATIONS} "
            "iterations: start closer to the obstacle, use stiffer supports, or hold a part of the body"
        )

    def _motion(self, result: StepResult, u: Array) -> _Motion:
        d = result.x - u
        momentum = self.system.M @ d
        return _Motion(d, momentum, self._size(d, momentum), self.step.surface.normal_values(d), result.active)

    def _closes(self, motion: _Motion) -> Mask:
        """Contact points that come nearer to their obstacle."""
        largest = self.step.surface.comm.max(np.array([max_abs(motion.d)]))[0]
        return np.asarray((motion.closing > STOPPED * largest) & np.isfinite(self.step.bound))

    def _refuse_flight(self, motion: _Motion) -> None:
        """InputError for a driven rigid motion without end."""
        bending = 2.0 * self.system.strain_energy(motion.d)
        if bending > RIGID * self.eps * motion.pace**2 or self._closes(motion).any():
            return
        push = self.system.algebra.comm.sum(self.system.influence.T @ motion.momentum)
        way = ", ".join(f"{x:.2g}" for x in np.where(np.abs(push) < 1e-4 * max_abs(push), 0.0, push) / max_abs(push))
        raise InputError(
            f"the body has no static equilibrium: its loads carry it off along ({way}) and neither contact nor a "
            "prescribed displacement stops that; hold it there, change the loads, or start the dynamics from rest"
        )

    def _ahead(self, old: _Motion, new: _Motion, result: StepResult) -> float:
        """How many times d to go further at once: the sum of the steps to come when each is ‖d_new‖/‖d_old‖ of the
        one before (Aitken), or only to the next contact. 0 unless d_new and d_old are parallel, to the accuracy which
        that distance needs. Any start of the next step will do, so nothing but the speed depends on it.
        """
        if new.pace == 0.0 or not np.array_equal(old.active, new.active):
            return 0.0
        surface, ratio = self.step.surface, new.pace / old.pace
        rows = self._closes(new) & ~result.active
        gap = (self.step.bound - surface.normal_values(result.x))[rows]
        stop = float(np.min(np.maximum(gap, 0.0) / new.closing[rows], initial=np.inf))
        ahead = min(stop, ratio / (1.0 - ratio) if ratio < UNBRAKED else np.inf)
        aside = self._size(new.d - ratio * old.d, new.momentum - ratio * old.momentum)
        return ahead if np.isfinite(ahead) and ahead * aside <= 0.5 * new.pace else 0.0

    def _size(self, d: Array, momentum: Array) -> float:
        """‖d‖_M = √(d·M d)."""
        return float(np.sqrt(max(self.system.algebra.dot(d, momentum), 0.0)))
