"""THE CONTRACT between time schemes and solvers, and the values that pass between them.

Every time scheme turns a step into the same one-step problem, and every solver solves it:

    A x = b - B_nᵀ r_n - B_tᵀ r_t,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0
    |r_t| <= limit(r_n),    r_t = limit(r_n) slip/|slip| where slip = B_t x - slip0 is not zero

(bilateral rows: equality and r_n of either sign). A is constant as long as dt is, so it is factorised once.
``r_n`` and ``r_t`` are ``scale`` times the reactions of the step in newtons, those of the body on its support;
``compliance`` is zero on a rigid support. Vectors are arrays of owned unknowns in the rotated basis; contact arrays
have shape (m,) or, tangential ones, (m, d - 1), and are equal on all ranks; r_t is None without friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from .algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from .errors import InputError
from .problem import ContactProblem
from .protocols import FrictionLaw, Frictionless, MassLaw
from .surfaces import ContactSurface


@dataclass(frozen=True)
class State:
    """Displacement, velocity and contact at time t = t_k, in the rotated basis.

    ``r_n``, ``r_t`` [N] are the reactions of the step that led here (mean or end values, as the scheme says);
    ``memory`` holds what a scheme carries besides u and v.
    """

    t: float
    k: int
    u: Array
    v: Array
    r_n: Array
    active: Mask
    memory: Mapping[str, Array] = field(default_factory=dict)
    r_t: Array | None = None


@dataclass(frozen=True)
class StepProblem:
    """One step, as every solver sees it. ``guess``: predicted x; ``active``: predicted contact set.

    ``rate_factor``: slip rate [m/s] = rate_factor (B_t x - slip0): 1/dt for displacements, 1 for velocities, 0 in
    static problems, where friction is that of rest.
    """

    A: EffectiveMatrix
    b: Array
    bound: Array
    surface: ContactSurface
    scale: float
    guess: Array
    active: Mask
    t: float
    k: int
    friction: FrictionLaw = field(default_factory=Frictionless)
    slip0: Array | None = None
    rate_factor: float = 0.0

    def __post_init__(self) -> None:
        rows, conditions = len(self.guess), self.surface.count
        if (len(self.b), len(self.bound), len(self.active)) != (rows, conditions, conditions):
            raise InputError(f"StepProblem has {len(self.b)} loads for {rows} unknowns, {len(self.bound)} bounds and a "
                             f"contact set of {len(self.active)} for {conditions} conditions: give one of each")

    def friction_at(self, slip: Array) -> FrictionLaw:
        """The friction law at the rates [m/s] of this slip, B_t x - slip0 (m, d - 1)."""
        return self.friction.at(self.rate_factor * np.linalg.norm(slip, axis=1))


@dataclass(frozen=True)
class StepResult:
    """x, reactions, active set; iterations count changes of the active set, sweeps or Newton steps (method says).

    ``history``: what the method with friction logs of its convergence, see there.
    """

    x: Array
    r_n: Array
    active: Mask
    iterations: int
    method: str
    r_t: Array | None = None
    history: tuple[float, ...] = ()


@dataclass(frozen=True)
class Balance:
    """The equation of motion that the step satisfied, with the scheme's own averages:

        M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t

    Multiplying it by the displacement increment gives the energy ledger of any scheme (verify.energy_balance).
    """

    u: Array
    v: Array
    a: Array
    f: Array
    r_n: Array
    r_t: Array | None = None


class Scheme(Protocol):
    """A time scheme: turns a state into a StepProblem and its solution into the next state.

    ``mass``: the mass matrix it takes when the problem does not say which. One whose contact condition is on velocities
    says ``penetrates = True``: states of its own runs may lie inside the obstacle, and it goes on from them.
    """

    @property
    def mass(self) -> MassLaw: ...

    def check(self, problem: ContactProblem) -> None: ...
    def start(self, problem: ContactProblem, state: State, dt: float) -> State: ...
    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State: ...
    def effective_matrix(self, problem: ContactProblem, dt: float) -> EffectiveMatrix: ...
    def step(self, problem: ContactProblem, state: State, A: EffectiveMatrix, dt: float) -> StepProblem: ...
    def finish(
        self, problem: ContactProblem, state: State, step: StepProblem, result: StepResult, dt: float
    ) -> State: ...
    def balance(self, problem: ContactProblem, old: State, new: State, dt: float) -> Balance: ...


class PreparedSolver(Protocol):
    """A solver bound to one effective matrix and one surface."""

    def solve(self, step: StepProblem) -> StepResult: ...


class Solver(Protocol):
    """Settings of a one-step solver; ``prepare`` does the work that is shared by all steps with the same A."""

    def check(self, problem: ContactProblem) -> None: ...
    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedSolver: ...


@dataclass(frozen=True)
class Report:
    """What happened in one step, for recorders. ``new.v`` is after the impact law, ``v_minus`` before it.

    ``problem`` is the one that was solved, with the mass matrix that the scheme chose when none was given.
    """

    problem: ContactProblem
    old: State
    new: State
    v_minus: Array
    step: StepProblem
    result: StepResult
    certificate: Certificate
    averages: Callable[[], Balance]
    escalated: bool

    @cached_property
    def balance(self) -> Balance:
        """The equation of motion that the step satisfied; made when somebody asks."""
        return self.averages()


@dataclass(frozen=True)
class Certificate:
    """Dimensionless residuals of the inequality problem of one step (design idea 5); each is 0 for an exact solution.

    equilibrium: |A x - b + B_nᵀ r_n|_max / max(|b|_max, |A x|_max, 1e-5 |A_ii|_max |x|_max). The last term matters on
    fine meshes only, where the parts of A x cancel: it keeps the rounding errors of the residual itself (1e-16 |A||x|)
    below the tolerance; what passes at 1e-9 is then at most 1e-14 |A||x|.
    penetration: max(-gap, 0) / x_ref;  tension: max(-r_n, 0) / r_ref.
    complementarity: max |gap| / x_ref over active and bilateral conditions, max |r_n| / r_ref over the others: the set
    that the impact law will see is certified too.
    cone: max(|r_t| - limit(r_n), 0) / t_ref;  dissipation: max (limit |slip| - r_t·slip) / (t_ref s_ref), the maximum
    dissipation that Coulomb's and Tresca's law ask for: it is 0 where the slip or the limit is, or where r_t lies
    along the slip on the edge of the cone. t_ref = max(limit, |r_t|, 1e-10 r_ref), s_ref = max(|slip|, 1e-5 x_ref): a
    step slides a small part of the way and rubs with a small part of the inertia. Both are 0 without friction.
    x_ref = max(|x|, |guess|), r_ref = max(|b|, |r_n|), maxima over all unknowns: a wide gap blunts no residual.
    resultant: of static stages, the largest |w·(b - B_nᵀ r_n - B_tᵀ r_t)| over max |w| times the sum of |b| and |Bᵀr|
    on a body, for its rigid motions w that no prescribed displacement holds: nodal residuals may be small and add up.
    """

    equilibrium: float
    penetration: float
    tension: float
    complementarity: float
    cone: float = 0.0
    dissipation: float = 0.0
    resultant: float = 0.0

    @property
    def worst(self) -> float:
        """The largest residual; NaN counts as infinite."""
        values = vars(self).values()
        return float("inf") if any(np.isnan(value) for value in values) else max(values)


class Recorder(Protocol):
    """Listens to the loop. ``columns`` names what ``row`` returns each step: name -> (unit, meaning)."""

    def columns(self) -> Mapping[str, tuple[str, str]]: ...
    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Mapping[str, Any]:
        """The row of the initial state; ``resumed`` is the last row of the run that a restart continues."""
        ...

    def row(self, report: Report) -> Mapping[str, Any]:
        """The row of a step: numbers, or arrays (which go to HDF5 only)."""
        ...


Columns = Mapping[str, tuple[str, str]]


Row = Mapping[str, Any]


AXES = "xyz"


def initial_state(problem: ContactProblem, t: float = 0.0) -> State:
    """u0, v0 of the system, in the rotated basis, no reaction; InputError when u0 penetrates the obstacle."""
    system, surface = problem.equations, problem.surface
    gap = surface.gap(t) - surface.normal_values(system.u0)
    u_max = largest(surface.comm, max_abs(system.u0))
    size = max(u_max, float(np.max(surface.gap0, initial=0.0)))
    if len(gap) and gap.min() < -1e-9 * size:
        raise InputError(
            f"the initial displacement penetrates the obstacle by {-gap.min():.3g} m: reduce it or enlarge the gap"
        )
    none = np.zeros(surface.count)
    return State(t, 0, system.u0.copy(), system.v0.copy(), none, surface.bilateral.copy())
