"""Hold what schemes share: two families, the step in displacements, and what does not suit them.

A scheme derives from one family, or is like it:

- ``SingleStep``: the contact force is a mean over the step, an impulse; it needs mass at the
  contact nodes. Midpoint, ZienkiewiczWoodTaylor, SS22, ContactStabilisedNewmark, MoreauJean.
- ``BalanceStep``: the contact force stands in the balance of forces at a time; contact nodes should
  have no mass. Newmark, HHT, GeneralisedAlpha, LinearMultistep, Houbolt; Trapezoidal is like it.

Most of them solve for x = u1, the displacement at the end: ``position_stage`` makes the stage of
such a step, and ``end_state`` the next state. MoreauJean solves for v1. In all files 0 and 1 are
the beginning and the end of a step, a bar is a mean over it, and the arguments of the methods are
those of ``core.step.Scheme``, which explains them.
"""

import logging
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from ..core.algebra import Array, Mask, max_abs
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..core.stage import Affine, Answer, Stage
from ..core.step import Balance, State
from ..laws.mass import ConsistentMass, Redistributed

log = logging.getLogger(__name__)
ROUGH = 0.01  # of the largest force: what may be missing in the equilibrium of massless bodies


class SingleStep:
    """Share what one-step schemes have in common: they carry nothing but u and v.

    They start by themselves, and velocity jumps do not disturb them.

    Attributes:
        takes_massless_bodies: whether bodies without mass may be part of the problem.
    """

    takes_massless_bodies: ClassVar[bool] = False

    @property
    def mass(self) -> MassLaw:
        """Return the consistent mass: contact is an impulse within the step, which needs mass."""
        return ConsistentMass()

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for unknowns without mass, whose forces would swing for ever.

        Bodies without mass pass where the scheme ``takes_massless_bodies``.
        """
        if self.takes_massless_bodies and problem.system.has_massless_bodies:
            _check_massless_bodies(problem)
            return
        _refuse_massless_elsewhere(problem)
        if problem.equations.massless is not None:
            raise InputError(
                f"{type(self).__name__} needs mass at the contact nodes, else their forces "
                "oscillate: give the problem mass=ConsistentMass(), or use the default scheme "
                "Trapezoidal()"
            )

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state as it is: there is nothing to prepare.

        Warn where bodies without mass are not at rest in it.

        Args:
            problem: the problem that is marched.
            state: the state to go on from.
            dt: size of the next steps [s]; not read.
        """
        if problem.system.has_massless_bodies:
            _warn_of_rough_start(problem, state)
        return state

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """Return the state with the new velocity: there is nothing to restart.

        Args:
            problem: the problem that is marched; not read.
            state: the state before the impact.
            v: velocity after the impact (n,) [m/s].
            dt: size of the next step [s]; not read.
        """
        return state.with_velocity(v)


class BalanceStep:
    """Share what schemes with contact in the balance of forces have in common.

    They are safe only where contact nodes have no mass.

    Attributes:
        reads_reactions: whether the scheme reads reactions out of forces on the unknowns that it
            remembers, which traces do not tell.
    """

    reads_reactions: ClassVar[bool] = False

    @property
    def mass(self) -> MassLaw:
        """Return the redistributed mass, without which contact nodes create energy."""
        return Redistributed()

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for an impact law on massless nodes; warn of mass at contact nodes.

        Conditions that share unknowns are refused where the scheme ``reads_reactions``.
        """
        if self.reads_reactions and problem.surface.traces is not None:
            raise InputError(
                f"{self} remembers reactions as forces on the unknowns, of which contact "
                "conditions that share unknowns cannot be told apart: take Midpoint(), "
                "Trapezoidal(), SS22() or MoreauJean()"
            )
        check_balance(repr(self), problem)


def position_stage(
    problem: ContactProblem,
    state: State,
    dt: float,
    *,
    guess: Array,
    u: Affine,
    v: Affine,
    a: Affine,
    load: Array,
    scale: float = 1.0,
    active: Mask | None = None,
    carried: Array | None = None,
    carried_reactions: tuple[Array, Array | None] | None = None,
    weight: float = 1.0,
    before: Callable[[], Balance] | None = None,
    old: tuple[float, Array] | None = None,
    end: float = 1.0,
    of_momentum: bool = True,
    between: Array | None = None,
) -> Stage:
    """Return the stage of a step in x = u1, with gap and slip at the end of the step.

    Args:
        problem: the problem that is marched.
        state: the state at the beginning of the step.
        dt: size of the step [s].
        guess: predicted u1 (n,) [m].
        u: displacement at the stage [m].
        v: velocity at the stage [m/s].
        a: acceleration at the stage [m/s²].
        load: mean load (n,) [N].
        scale: what the balance is multiplied by, a pure number.
        active: predicted contact set (m,); None for that of the state.
        carried: Bᵀr (n,) [N] of reactions of the beginning; None for none.
        carried_reactions: these reactions [N]; None: they are read out of Bᵀr.
        weight: of this balance in the mean equation of the step.
        before: makes the balance at the beginning, with the weight 1 - ``weight``; None for none.
        old: (share, u0) where u is a sum share u0 + end u1 over both ends; None where it is no
            such sum.
        end: the share of u1 in that sum.
        of_momentum: whether the mean acceleration of the step is (v1 - v0)/dt.
        between: u0 (n,) where the internal force of a body that turns is that of both ends.

    Returns:
        The stage: bound is the gap (m,) [m] of the undeformed body at the end, slip is measured
        from B_t u0 and what the obstacle slides, and slip rates are slips over dt.
    """
    after = state.t + dt
    of_start = None
    if old is not None and problem.equations.internal is not None:
        share, u0 = old
        of_start = (share * u0, share * problem.equations.internal_force(u0))
    return Stage(
        guess=guess,
        u=u,
        v=v,
        a=a,
        load=load,
        scale=scale,
        bound=problem.surface.gap(after),
        turned=problem.surface.turned,
        slip0=problem.slip_origin(state.u, state.t, after),
        active=state.active if active is None else active,
        t=after,
        k=state.k + 1,
        rate_factor=1.0 / dt,
        carried=carried,
        carried_reactions=carried_reactions,
        weight=weight,
        before=before,
        old=of_start,
        end=end,
        of_momentum=of_momentum,
        between=between,
    )


def end_state(
    stage: Stage, answer: Answer, u: Array, v: Array, memory: Mapping[str, Array] | None = None
) -> State:
    """Return the state at the end of a step, with the reactions [N] of its answer.

    Args:
        stage: of the step.
        answer: its answer.
        u: displacement (n,) [m] at the end.
        v: velocity (n,) [m/s] at the end.
        memory: what the scheme carries on; None for nothing.
    """
    kept = {} if memory is None else memory
    contact = (answer.r_n, answer.active, kept, answer.r_t)
    return State(stage.t, stage.k, u, v, *contact, turned=stage.turned)


def check_balance(name: str, problem: ContactProblem) -> None:
    """Check a problem for schemes with contact in the balance of forces.

    It warns, once for a problem, of mass at the contact nodes: the energy ½ (r0 g1 - r1 g0) is
    created whenever a contact opens. Collective.

    Args:
        name: the scheme, as one writes it.
        problem: the problem.

    Raises:
        InputError: an impact law on massless contact nodes, which have no momentum to change.
    """
    _refuse_massless_elsewhere(problem)
    surface = problem.surface
    massless = problem.equations.massless is not None
    if massless and problem.impact is not None:
        raise InputError(
            f"the impact law {problem.impact} acts on the mass of contact nodes, which is zero in "
            "this problem: leave the law out, or give the problem mass=ConsistentMass()"
        )
    if massless or not surface.some(~surface.bilateral & surface.rigid):
        return

    # The system keeps a list, which is empty until the first run has warned.
    warnings = problem.equations.make_once(f"warnings of {name}", list, surface)
    if not warnings and surface.comm.rank == 0:
        log.warning(
            "%s with consistent mass can gain energy whenever a contact opens: leave out "
            "mass=ConsistentMass(), or take ContactStabilisedNewmark() or Midpoint()",
            name,
        )
    warnings.append(True)


def _refuse_massless_elsewhere(problem: ContactProblem) -> None:
    """Raise InputError for unknowns without mass beside contact nodes with mass."""
    if problem.system.has_massless_bodies:
        raise InputError(
            "a material has rho = 0, and this scheme needs mass in all bodies: take "
            "ZienkiewiczWoodTaylor() or Midpoint(), or give a density above zero"
        )
    layer = problem.equations.massless
    surface = problem.surface
    if layer is not None and surface.some(~layer[surface.touched()]):
        raise InputError(
            "rows of M are zero while contact nodes have mass: condense these unknowns out of K "
            "(it is exact, as for rotations of a lumped beam), give them mass, or use "
            "mass=Redistributed()"
        )


def _check_massless_bodies(problem: ContactProblem) -> None:
    """Raise InputError for what does not go with bodies without mass. Collective."""
    if not isinstance(problem.mass, ConsistentMass):
        raise InputError(
            f"a material has rho = 0, and {problem.mass} hands mass from contact nodes to others: "
            "give the problem mass=ConsistentMass()"
        )
    if problem.impact is not None:
        raise InputError(
            f"a material has rho = 0, and the impact law {problem.impact} needs mass at contact "
            "nodes: leave the law out, or give a density above zero"
        )
    if problem.equations.internal is not None:
        raise InputError(
            "a material has rho = 0 beside bodies that are not linear: give a density above zero"
        )


def _warn_of_rough_start(problem: ContactProblem, state: State) -> None:
    """Warn where bodies without mass are far from equilibrium off the contact. Collective.

    Their unknowns follow from C v + K u = f at a time inside each step. Without damping, what is
    missing in it at the start comes back with the other sign after every step.

    Args:
        problem: the problem that is marched.
        state: the state to go on from.
    """
    system = problem.equations
    inner = np.zeros(system.rows, dtype=bool) if system.massless is None else system.massless.copy()
    inner[problem.surface.touched(frictional=True)] = False
    load = system.load(state.t)
    force = system.internal_force(state.u)
    if system.C is not None:
        force = force + system.C @ state.v
    sizes = [max_abs((load - force)[..., inner]), max_abs(load), max_abs(force)]
    missing, *forces = system.algebra.comm.max(np.array(sizes))
    if missing > ROUGH * max(forces) and system.algebra.comm.rank == 0:
        log.warning(
            "bodies without mass (rho = 0) are not in equilibrium at the start, and would swing "
            "about it: give a static stage before, or damping by stiffness"
        )
