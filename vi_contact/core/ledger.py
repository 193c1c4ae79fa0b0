"""Close the energy ledger of a step: where the energy went, and what the ledger cannot explain."""

from dataclasses import dataclass

import numpy as np

from .algebra import Array
from .problem import ContactProblem
from .step import Balance, State
from .system import SemiDiscreteSystem


@dataclass(frozen=True)
class StepEnergy:
    """Say where energy went [J].

    The ledger is change = input - damping - contact - friction - algorithmic + defect.
    """

    change: float
    input: float
    damping: float
    contact: float
    friction: float
    algorithmic: float

    @property
    def defect(self) -> float:
        """Return what the ledger cannot explain.

        It is rounding and the tolerance of the solver when the step was solved.
        """
        return self.change - (
            self.input - self.damping - self.contact - self.friction - self.algorithmic
        )


@dataclass(frozen=True)
class Energies:
    """Hold M v, K u and the energies of a state [J].

    A ledger carries them on, so that none is made twice.
    """

    momentum: Array
    elastic: Array
    kinetic: float
    strain: float

    @property
    def total(self) -> float:
        """Return ½ vᵀMv + ½ uᵀKu [J]."""
        return self.kinetic + self.strain


def energies(system: SemiDiscreteSystem, u: Array, v: Array) -> Energies:
    """Return the energies of displacement u and velocity v: two products, unless they are known."""
    momentum, elastic = system.product("M", v), system.product("K", u)
    kinetic, strain = _dots(system, (v, momentum), (u, elastic))
    return Energies(momentum, elastic, 0.5 * kinetic, 0.5 * strain)


def _dots(
    system: SemiDiscreteSystem, *pairs: tuple[Array, Array], sums: tuple[float, ...] = ()
) -> list[float]:
    """Inner products, and sums over the ranks, with one reduction for all."""
    comm, found = system.algebra.comm, [*[float(x.dot(y)) for x, y in pairs], *sums]
    return found if comm.size == 1 else comm.sum(np.array(found)).tolist()


def energy_balance(
    problem: ContactProblem,
    old: State,
    new: State,
    balance: Balance,
    *,
    before: Energies | None = None,
    after: Energies | None = None,
) -> StepEnergy:
    """Return the ledger of a step before the impact law, for any scheme.

    The step satisfied M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t with the averages of ``balance``.
    Times the increment du:

        input = f·du + work of a moving obstacle
        damping = du·C v
        contact = r_n·B_n du    (work lost to the support, stored or dissipated there)
        friction = r_t·B_t du
        algorithmic = du·M a - ½(v0 + v1)·M (v1 - v0) + du·K u - ½(u0 + u1)·K du

    algorithmic is 0 for the midpoint rule, and change is the difference of the energies themselves,
    so the defect measures the equation of motion. ``before``, ``after``: the energies of both
    states, when known; one product (two with damping) is left then.
    """
    system, surface = problem.equations, problem.surface
    before = before or energies(system, old.u, old.v)
    after = after or energies(system, new.u, new.v)
    du = new.u - old.u
    pushed, dragged = _obstacle_work(problem, old.t, new.t, balance)
    rubbing = (
        0.0 if balance.r_t is None else float(np.sum(balance.r_t * surface.tangential_values(du)))
    )
    work, inertia, kinetic, stiffness, lost, *local = _dots(
        system,
        (du, balance.f),
        (du, system.product("M", balance.a)),
        (0.5 * (old.v + new.v), after.momentum - before.momentum),
        (balance.u - 0.5 * (old.u + new.u), after.elastic - before.elastic),
        (balance.r_n, surface.normal_values(du)),
        sums=(
            rubbing,
            pushed,
            dragged,
            0.0 if system.C is None else float(du.dot(system.product("C", balance.v))),
        ),
    )
    rubbing, pushed, dragged, damping = local
    return StepEnergy(
        change=after.total - before.total,
        input=work + pushed + dragged,
        damping=damping,
        contact=lost + pushed,
        friction=rubbing + dragged,
        algorithmic=inertia - kinetic + stiffness,
    )


def _obstacle_work(
    problem: ContactProblem, start: float, end: float, balance: Balance
) -> tuple[float, float]:
    """Return the work that a moving obstacle does on the body on this rank.

    It is (normal, tangential): r_n·advance and -r_t·sliding.
    """
    advance, sliding = problem.surface.advance(start, end), problem.surface.sliding(start, end)
    pushed = 0.0 if advance is None else float(balance.r_n @ advance)
    dragged = (
        0.0 if sliding is None or balance.r_t is None else -float(np.sum(balance.r_t * sliding))
    )
    return pushed, dragged
