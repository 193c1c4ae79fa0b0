"""Hold what schemes share.

There are two families of them, the step in displacements, and what does not suit their contact.
"""

import logging

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..core.step import Balance, State, StepProblem, StepResult
from ..laws.mass import ConsistentMass, Redistributed

log = logging.getLogger(__name__)


class SingleStep:
    """Share what one-step schemes have in common.

    They start by themselves, and velocity jumps do not disturb them.
    """

    @property
    def mass(self) -> MassLaw:
        """Return the consistent mass.

        Contact is an impulse within the step, so contact nodes need their mass.
        """
        return ConsistentMass()

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for unknowns without mass, as contact nodes.

        Their forces would swing for ever.
        """
        _refuse_massless_elsewhere(problem)
        if problem.equations.massless is not None:
            raise InputError(
                f"{type(self).__name__} needs mass at the contact nodes, else their forces "
                "oscillate: give the problem mass=ConsistentMass(), or use the default scheme "
                "Trapezoidal()"
            )

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state: there is nothing to prepare."""
        return state

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the new velocity: nothing is to be restarted."""
        return state.with_velocity(v)


class BalanceStep:
    """Share what schemes have in common that are safe without mass at the contact nodes only."""

    @property
    def mass(self) -> MassLaw:
        """Return the redistributed mass.

        With contact in the balance of forces, mass at its nodes creates energy.
        """
        return Redistributed()

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for an impact law on massless contact nodes.

        Warn when they have mass.
        """
        check_balance(repr(self), problem)


def position_step(
    problem: ContactProblem,
    state: State,
    A: EffectiveMatrix,
    dt: float,
    *,
    b: Array,
    scale: float,
    guess: Array | None = None,
    active: Mask | None = None,
) -> StepProblem:
    """Return the step A x = b - …, x = u1.

    Gap and slip are those of the end of the step. By default free flight is the guess.
    """
    end = state.t + dt
    return StepProblem(
        A=A,
        b=b,
        bound=problem.surface.gap(end),
        surface=problem.surface,
        scale=scale,
        guess=state.u + dt * state.v if guess is None else guess,
        active=state.active if active is None else active,
        t=end,
        k=state.k + 1,
        friction=problem.friction,
        slip0=problem.slip_origin(state.u, state.t, end),
        rate_factor=1.0 / dt,
    )


def stepped(step: StepProblem, result: StepResult, u: Array, v: Array) -> State:
    """Return the state after the step, with the mean reactions r/scale.

    What another scheme remembered is forgotten.
    """
    r_t = None if result.r_t is None else result.r_t / step.scale
    return State(step.t, step.k, u, v, result.r_n / step.scale, result.active, r_t=r_t)


def means(
    problem: ContactProblem, old: State, new: State, dt: float, *, u: Array, f: Array
) -> Balance:
    """Return the equation of a step with means of u, f and the rates of u and v.

    The reactions are those of the new state.
    """
    v, a = problem.equations.rates(old.u, new.u, old.v, new.v, dt)
    return Balance(u=u, v=v, a=a, f=f, r_n=new.r_n, r_t=new.r_t)


def check_balance(name: str, problem: ContactProblem) -> None:
    """Check what schemes with contact in the acceleration balance march.

    Raises InputError for an impact law on massless contact nodes: there is no momentum that it
    could change. Warns, once for a problem, of mass at the contact nodes: the energy ½ (r0 g1 - r1
    g0) is created whenever a contact opens.
    """
    _refuse_massless_elsewhere(problem)
    massless, surface = problem.equations.massless is not None, problem.surface
    if massless and problem.impact is not None:
        raise InputError(
            f"the impact law {problem.impact} acts on the mass of contact nodes, which is zero in "
            "this problem: leave the law out, or give the problem mass=ConsistentMass()"
        )
    if massless or not surface.some(~surface.bilateral & surface.rigid):
        return
    told = problem.equations.cached(f"told of {name}", list, surface)
    if not told and surface.comm.rank == 0:
        log.warning(
            "%s with consistent mass can gain energy whenever a contact opens: leave out "
            "mass=ConsistentMass(), or take ContactStabilisedNewmark() or Midpoint()",
            name,
        )
    told.append(True)


def _refuse_massless_elsewhere(problem: ContactProblem) -> None:
    """Raise InputError for unknowns without mass beside contact nodes with mass."""
    layer, surface = problem.equations.massless, problem.surface
    if layer is not None and surface.some(~layer[surface.owned]):
        raise InputError(
            "rows of M are zero while contact nodes have mass: condense these unknowns out of K "
            "(it is exact, as for rotations of a lumped beam), give them mass, or use "
            "mass=Redistributed()"
        )
