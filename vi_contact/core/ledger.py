"""Close the energy ledger of a step: where the energy went, and what the ledger cannot explain.

Every scheme satisfies an equation of motion with averages of its own (``core.step.Balance``).
Multiplied by the displacement increment du of the step, each term is the work of one cause; the
sum of these works is the change of energy, whatever the scheme, unless the step was not solved.
``energy_balance`` does it, and the recorder ``Energy`` adds the steps up.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .algebra import Array
from .internal import remembers
from .problem import ContactProblem
from .step import Balance, State
from .system import SemiDiscreteSystem


@dataclass(frozen=True)
class StepEnergy:
    """Say where energy went in a step [J].

    The ledger is change = input - damping - contact - friction - plastic - algorithmic + defect.

    Attributes:
        change: of kinetic and strain energy.
        input: work of loads and of a moving obstacle.
        damping: work lost in viscous damping.
        contact: work lost to the support, stored or dissipated there.
        friction: work lost in friction.
        algorithmic: what the time scheme loses, or gains where it is negative.
        plastic: work dissipated where materials yield, >= 0.
    """

    change: float
    input: float
    damping: float
    contact: float
    friction: float
    algorithmic: float
    plastic: float = 0.0

    @property
    def defect(self) -> float:
        """Return what the ledger cannot explain [J].

        It is rounding and the tolerance of the solver when the step was solved.
        """
        explained = self.input - self.damping - self.contact - self.friction - self.algorithmic
        explained -= self.plastic
        return self.change - explained


@dataclass(frozen=True)
class Energies:
    """Hold the energies of a state; a ledger carries them on, so that none is made twice.

    Attributes:
        momentum: M v (n,) [N s].
        elastic: K u, or p(u) of a body that is not linear (n,) [N].
        kinetic: ½ vᵀMv [J].
        strain: ½ uᵀKu, or W(u) [J].
    """

    momentum: Array
    elastic: Array
    kinetic: float
    strain: float

    @property
    def total(self) -> float:
        """Return ½ vᵀMv + ½ uᵀKu [J]."""
        return self.kinetic + self.strain


def compute_energies(
    system: SemiDiscreteSystem,
    u: Array,
    v: Array,
    *,
    momentum: Array | None = None,
    elastic: Array | None = None,
) -> Energies:
    """Return the energies of a state: two products, unless they are known. Collective.

    Args:
        system: the equations that are marched.
        u: displacement (n,) [m].
        v: velocity (n,) [m/s].
        momentum: M v (n,) [N s], when it is known.
        elastic: K u, or p(u) (n,) [N], when it is known.
    """
    momentum = system.M @ v if momentum is None else momentum
    elastic = system.internal_force(u) if elastic is None else elastic
    kinetic, strain = _dot_pairs(system, (v, momentum), (u, elastic))
    stored = 0.5 * strain if system.internal is None else system.internal.energy(u)
    return Energies(momentum, elastic, 0.5 * kinetic, stored)


def _dot_pairs(
    system: SemiDiscreteSystem, *pairs: tuple[Array, Array], sums: tuple[float, ...] = ()
) -> list[float]:
    """Return inner products and sums over all ranks, by one reduction.

    Args:
        system: whose ranks count.
        pairs: pairs of vectors (n,), for the inner products.
        sums: terms of this rank, for the sums.
    """
    comm = system.algebra.comm
    terms = [float(x.dot(y)) for x, y in pairs]
    terms += sums
    return terms if comm.size == 1 else comm.sum(np.array(terms)).tolist()


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
    so the defect measures the equation of motion. Of a body that yields

        plastic = ∫ D,    algorithmic has du·(p̄ - p1) + R in the place of its terms with K

    with the mean p̄ of the scheme and p1 at the end of the step. R has a formula of its own
    (``laws.yielding``), so the defect measures p1·du = ΔW + D + R too. Collective.

    Args:
        problem: the problem that is marched; materials stand at ``old``.
        old: the state before the step.
        new: the state after it, before the impact law.
        balance: the equation of motion that the step satisfied.
        before: the energies of ``old``, when they are known.
        after: those of ``new``. With both, one product is left with damping, and one where a is not
            (v1 - v0)/dt.
    """
    system = problem.equations
    surface = problem.surface
    before = before or compute_energies(system, old.u, old.v)
    after = after or compute_energies(system, new.u, new.v)
    du = new.u - old.u
    law: Any = system.internal if remembers(system.internal) else None

    # Works of this rank that are not there in every problem: of an obstacle that moves, of friction
    # and of damping.
    pushing, dragging = _compute_obstacle_work(problem, old.t, new.t, balance)
    rubbing = 0.0
    if balance.r_t is not None:
        rubbing = float(np.sum(balance.r_t * surface.tangential_values(du)))
    damping = 0.0
    if system.C is not None:
        damping = float(du.dot(system.C @ balance.v))

    # The work of inertia is that of the change of momentum, which is known, where the scheme says
    # so; else M a is one product more. The work of K (u - ½(u0 + u1)) on du needs none, as K is
    # symmetric and K du is known.
    gained = after.momentum - before.momentum
    if balance.of_momentum is None:
        inertial = (du, system.M @ balance.a)
    else:
        inertial = (du / balance.of_momentum, gained)
    if balance.internal is None:
        elastic = (balance.u - 0.5 * (old.u + new.u), after.elastic - before.elastic)
    elif law is None:
        elastic = (balance.internal, du)
    else:
        elastic = (balance.internal - after.elastic, du)

    # One reduction adds them up over the ranks, and others with them: the work of loads, the change
    # of kinetic energy, and the work of normal reactions.
    works = _dot_pairs(
        system,
        (du, balance.f),
        inertial,
        (0.5 * (old.v + new.v), gained),
        elastic,
        (balance.r_n, surface.normal_values(du)),
        sums=(rubbing, pushing, dragging, damping),
    )
    loading, inertia, kinetic, stiffness, pressing, rubbing, pushing, dragging, damping = works
    plastic = 0.0
    if law is not None:
        plastic = law.dissipation(new.u)
        stiffness += law.remainder(new.u)
    elif balance.internal is not None:
        stiffness -= after.strain - before.strain

    # The support takes what reactions do on the motion relative to it. What they do on its own
    # motion is input.
    return StepEnergy(
        change=after.total - before.total,
        input=loading + pushing + dragging,
        damping=damping,
        contact=pressing + pushing,
        friction=rubbing + dragging,
        algorithmic=inertia - kinetic + stiffness,
        plastic=plastic,
    )


def _compute_obstacle_work(
    problem: ContactProblem, start: float, end: float, balance: Balance
) -> tuple[float, float]:
    """Return the work [J] of a moving obstacle on this rank: r_n·advance and -r_t·sliding.

    The obstacle presses the body with -r_n along the direction towards itself, and comes the other
    way by ``advance``; it drags the body with -r_t along its own ``sliding``.

    Args:
        problem: the problem that is marched.
        start: time of the beginning of the step [s].
        end: time of its end [s].
        balance: the equation of motion, with the reactions [N].

    Returns:
        The works in normal and in tangential direction, zero for an obstacle at rest.
    """
    advance = problem.surface.advance(start, end)
    sliding = problem.surface.sliding(start, end)
    normal = 0.0 if advance is None else float(balance.r_n @ advance)
    tangential = 0.0
    if sliding is not None and balance.r_t is not None:
        tangential = -float(np.sum(balance.r_t * sliding))
    return normal, tangential
