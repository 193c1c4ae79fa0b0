"""Choose and check how a problem is marched: scheme, solvers, tolerance, time steps, first state.

``choose_method`` serves every function that marches (march, simulate, march_many, …): it names the
function in its sentences, and fills in what is not said.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..core.algebra import from_each, max_abs
from ..core.checks import describe_point, provides, quote, real, several
from ..core.collective import Parts, agree, together
from ..core.errors import InputError
from ..core.internal import remembers, turns
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, check_sizes, read_start_time
from ..core.step import Scheme, Solver, State
from ..laws.mass import ConsistentMass
from ..schemes.energy_momentum import EnergyMomentum
from ..schemes.trapezoidal import Trapezoidal
from ..schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from ..solvers.automatic import Automatic
from .joint_steps import refuse_scheme
from .loose_bodies import refuse_loose_bodies
from .time_steps import TimeSteps, plan_steps

SCHEME = ("check", "start", "jump", "stage", "finish")
SLACK = 10.0  # of the tolerance, and of the largest displacement: what a state may penetrate


@dataclass(frozen=True)
class Method:
    """Hold how a problem is marched.

    This is scheme, solver and its escalation, time steps [s] as asked for, and tolerance.
    """

    problem: ContactProblem
    scheme: Scheme
    solvers: Sequence[Solver]
    dt: TimeSteps
    tolerance: float

    def bind(self) -> None:
        """Hand scheme and time steps to the motions that are marched beside the run.

        Those that have them already are left out.
        """
        for companion in (*self.problem.system.companions, *self.problem.surface.companions):
            companion.bind(self.scheme, self.dt)


def choose_method(
    owner: str,
    problem: ContactProblem,
    scheme: Scheme | None,
    solvers: tuple[Solver | None, Sequence[Solver]],
    dt: TimeSteps,
    *,
    steps: int | None,
    t_end: float | None,
    state: State | None,
    tolerance: float,
) -> Method:
    """Return how a problem is marched, with defaults for what is not said. Collective.

    Args:
        owner: the function of the user, for sentences of errors.
        problem: what is marched.
        scheme: None for the one of ``with_defaults``.
        solvers: the first one, None for Automatic(), and the escalation.
        dt: the time steps [s].
        steps: the number of base steps, or None.
        t_end: their end [s], or None.
        state: the first state, None for u0 and v0 of the system or a checkpoint.
        tolerance: of the certificate, relative.

    Raises:
        InputError: arguments of the wrong kind, or a state of another problem or inside the
            obstacle.
    """
    # All ranks were given the same, and of the right kinds.
    check_problem_given(owner, problem)
    comm = problem.surface.comm
    first, escalation = solvers
    agree(
        comm,
        owner,
        {
            "scheme": scheme,
            "solver": first,
            "escalation": escalation,
            "dt": dt,
            "steps": steps,
            "t_end": t_end,
            "state": Parts(state),
            "tolerance": tolerance,
        },
    )
    check_methods(owner, first, escalation, tolerance)
    problem.system.refuse_statics_only(owner)

    # Defaults of what is not said.
    problem, scheme = with_defaults(problem, scheme)
    refuse_scheme(problem, scheme)
    if first is None:
        first = Automatic()
    method = Method(problem, scheme, [first, *escalation], dt, tolerance)

    # Scheme, solver and state suit the problem.
    size = plan_steps(dt, steps, t_end, read_start_time(owner, state)).dt(0)
    with together(comm):  # what is the user's own may fail on one rank
        method.bind()
        problem.equations.forget_loads()
        _refuse_stage_forces(problem, scheme)
        scheme.check(problem)
        for solver in method.solvers:
            solver.check(problem)
        if state is not None:
            check_state(owner, problem, state, dt=size, tolerance=tolerance, scheme=scheme)

    # What continues a run was looked at when it began.
    if problem.system.floating and state is None:
        refuse_loose_bodies(problem)
    return method


def with_defaults(
    problem: ContactProblem, scheme: Scheme | None, others: Sequence[ContactProblem] = ()
) -> tuple[ContactProblem, Scheme]:
    """Return (the problem with a mass matrix, the scheme to run it with).

    Without a scheme: the trapezoidal rule on redistributed mass; with an impact law, with mass at
    the contact nodes asked for, with a joint, with bodies without mass, or of a body that is not
    linear, the Zienkiewicz-Wood-Taylor step at phi = ½, which never gains energy of a linear body;
    EnergyMomentum of a body that turns. Without a mass: the scheme's, and the consistent one of a
    body that is not linear.

    Args:
        problem: what is marched.
        scheme: None for the one above.
        others: problems; the first that has the same matrices lends them.
    """
    check_problem_given("march", problem)
    for other in several("march", "others", others, "give a list of problems, or leave it out"):
        check_problem_given("march", other)
    curved = problem.system.internal is not None
    if scheme is None and turns(problem.system.internal):
        scheme = EnergyMomentum()
    if scheme is None:
        massive = (
            isinstance(problem.mass, ConsistentMass)
            or problem.joint is not None
            or problem.system.has_massless_bodies
        )
        if problem.impact is None and not (curved or massive):
            scheme = Trapezoidal()
        else:
            scheme = ZienkiewiczWoodTaylor()
    provides(
        "march", "scheme", scheme, SCHEME, "give a time scheme, such as Trapezoidal(), or None"
    )
    if problem.mass is None:
        problem = replace(problem, mass=ConsistentMass() if curved else scheme.mass)
    if turns(problem.system.internal):
        _refuse_beside_turning(problem, scheme)
    for other in others:
        shared = problem.beside(other)
        if shared is not None:
            return shared, scheme
    return problem, scheme


def _refuse_stage_forces(problem: ContactProblem, scheme: Scheme) -> None:
    """Raise InputError for a scheme that asks for stresses between the ends of a step.

    What a material remembers is known at the ends alone.

    Args:
        problem: what is marched.
        scheme: the time scheme.
    """
    if remembers(problem.system.internal) and not getattr(scheme, "takes_ends", False):
        raise InputError(
            f"{type(scheme).__name__} takes the stress of a body that yields between the ends of a "
            "step, where it is not known: take Midpoint(), ZienkiewiczWoodTaylor(phi), "
            "Trapezoidal(), HHT(alpha), GeneralisedAlpha(…) or Newmark(…)"
        )


def _refuse_beside_turning(problem: ContactProblem, scheme: Scheme) -> None:
    """Raise InputError for a scheme or a mass law that is not for bodies that turn.

    Args:
        problem: with a mass law.
        scheme: by which it is marched.
    """
    if not getattr(scheme, "for_turning", False):
        raise InputError(
            f"march: {type(scheme).__name__} gains energy without bound where bodies turn: give "
            "EnergyMomentum(), or None"
        )
    if not isinstance(problem.mass, ConsistentMass):
        raise InputError(
            f"march: a body that turns does not go with mass={problem.mass}, whose inertia against "
            "spin changes as it turns (of a block of 4 x 8 cells by 3.6 % at 90 degrees): give the "
            "problem mass=ConsistentMass(), or leave mass= out"
        )


def check_solver(owner: str, value: Any, meaning: str = "solver") -> None:
    """Raise InputError unless ``value`` is a solver of steps.

    Args:
        owner: the function or class whose argument it is, for the sentence.
        value: what the user gave.
        meaning: what it should be, for the sentence.
    """
    provides(
        owner,
        meaning,
        value,
        ("check", "prepare"),
        "give a solver, such as Condensed() or Volume()",
    )


def check_methods(owner: str, solver: Any, escalation: Any, tolerance: Any) -> None:
    """Raise InputError unless these are solvers and a tolerance.

    Args:
        owner: the function of the user, for sentences of errors.
        solver: a solver, or None.
        escalation: a list of solvers.
        tolerance: above 0, at most 1.
    """
    if solver is not None:
        check_solver(owner, solver)
    for other in several(owner, "escalation", escalation, "give a list of solvers"):
        check_solver(owner, other, "a solver of escalation")
    if not 0.0 < real(tolerance) <= 1.0:
        raise InputError(
            f"{owner}: tolerance is {quote(tolerance)}; give a relative residual above 0, such as "
            "1e-9"
        )


def check_state(
    owner: str, problem: ContactProblem, state: State, *, dt: float, tolerance: float, scheme: Any
) -> None:
    """Raise InputError, on all ranks, for a state that no run can begin with. Collective.

    This is one of another problem, or one inside the obstacle. A scheme that ``penetrates``, whose
    condition is one on velocities, may go on from states of its own runs (k > 0).

    Args:
        owner: the function of the user, for sentences of errors.
        problem: that the state should be of.
        state: the user's.
        dt: the length of the first step [s].
        tolerance: of the certificate, relative.
        scheme: with which the run goes on.
    """
    check_sizes(owner, problem, state)
    surface = problem.surface
    if state.k > 0 and getattr(scheme, "penetrates", False):
        return

    # Gaps of rigid supports may be negative by round-off alone: SLACK times the tolerance of the
    # largest displacement, way of a step or gap of all ranks.
    rigid = surface.compliance == 0.0
    gap = np.where(rigid, surface.gap(state.t) - surface.normal_values(state.u), np.inf)
    deepest = np.max(-gap, initial=-np.inf)
    lengths = [max_abs(state.u), dt * max_abs(state.v), max_abs(surface.gap0[rigid])]
    inside, *sizes = surface.comm.max(np.array([deepest, *lengths]))
    if inside > SLACK * tolerance * max(sizes):
        worst = np.concatenate(from_each(surface.comm, surface.points[gap == -inside]))[0]
        raise InputError(
            f"{owner}: the state is {inside:.3g} m inside the obstacle at {describe_point(worst)}: "
            "give a state with every gap >= 0"
        )
