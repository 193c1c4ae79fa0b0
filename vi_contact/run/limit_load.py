"""Find the limit load of bodies in contact by load steps, and the tilt at which they first move.

From the equilibrium under the loads that stay, the load that is multiplied grows in steps,

    K u_k = f + lambda_k p - B_nᵀ r_n - B_tᵀ r_t,

each an equilibrium with Coulomb friction that is certified (``static``). Where no equilibrium is
found the step is halved, until lambda lies in a bracket that is as tight as asked
(``limit_search``). A tilt is the same path with the weight M g turned by an angle, of the tangent
lambda.

Each state is an equilibrium with forces in their cones. So lambda is no more than the bound of
associated flow (``rigid_limit``), where nodes stand at the ends of joints; how far below it lies
depends on the path.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.checks import array, find_shape, instance, number, whole
from ..core.collective import agree, together
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, initial_state
from ..core.step import Solver, State
from ..core.system import Load
from ..core.units import STANDARD_GRAVITY
from ..solvers.certified import TOLERANCE
from .limit_search import LoadPath, seek_limit
from .method import check_methods
from .proximal import Proximal
from .rigid_limit import RigidLimit
from .static import Equilibria

RTOL = 1e-2  # of the bracket, by default
SHARE = 0.25  # of the ratio of both loads: the first step, by default
ABOVE = 1e-6  # of the bound, by which a multiplier may exceed it
GRAVITY = (0.0, -STANDARD_GRAVITY, 0.0)
Histories = tuple[tuple[Array, Callable[[float], float]], ...]


@dataclass(frozen=True, eq=False)
class LimitLoad:
    """Hold a limit load that load steps have found, with the path and the mechanism.

    Attributes:
        multiplier: the largest multiple lambda of the load at which an equilibrium is certified; of
            a tilt, the tangent of the angle.
        lost_at: the least multiple tried above it at which none was found.
        multipliers: (k,) of the states, increasing from 0 on.
        states: the equilibria; ``State.t`` is the multiplier.
        mechanism: a state whose u is the increment of displacement where equilibrium is lost,
            scaled so that its largest component is one.
        proven: whether the motion at ``lost_at`` is a rigid one that the loads drive and nothing
            stops; otherwise no answer was certified there.
        reason: the sentence that said so.
        bound: of associated flow, as given; None without.
        problem: the problem under both loads, at the time lambda.
    """

    multiplier: float
    lost_at: float
    multipliers: Array
    states: tuple[State, ...] = field(repr=False)
    mechanism: State = field(repr=False)
    proven: bool
    reason: str = field(repr=False)
    bound: RigidLimit | None = field(repr=False)
    problem: ContactProblem = field(repr=False)


def limit_load(
    problem: ContactProblem,
    *,
    force: Any,
    first: float | None = None,
    rtol: float = RTOL,
    most: int = 100,
    bound: RigidLimit | None = None,
    t: float = 0.0,
    solver: Solver | None = None,
    tolerance: float = TOLERANCE,
) -> LimitLoad:
    """Return the largest multiple of a load that bodies bear beside the loads of the problem.

    It is found by load steps from the equilibrium under the loads of the problem, each certified;
    the head of this module has the equations. Bodies that contact alone holds lose their
    equilibrium by a rigid motion, bodies that yield because no state is certified any more.
    Collective.

    Args:
        problem: the bodies, their contact and the loads that stay, such as the weight.
        force: the load p that is multiplied: (d,) an acceleration a [m/s²], p = M r a, which is a
            push in proportion to mass; or (n,) forces [N] on the unknowns of ``problem.system``.
        first: the first load step, in multiples; None for a quarter of the bound, or without one of
            the ratio of both loads.
        rtol: of the bracket of the multiplier, relative.
        most: steps of the first size, at most.
        bound: of ``rigid_limit_load`` for the same bodies and loads, above which the multiplier
            must not be.
        t: the time [s] at which the loads of the problem are taken.
        solver: of the load steps, Automatic() when None.
        tolerance: of the certificates, relative.

    Returns:
        the multiplier, the states and the mechanism.

    Raises:
        InputError: wrong arguments; no equilibrium under the loads that stay; obstacles that move.
        StepFailure: no certified state under the loads that stay; a load that is borne at any size
            that was tried; a multiplier above the bound.
    """
    owner = "limit_load"
    _check_problem(owner, problem)
    n, d = problem.system.influence.shape
    if find_shape(force) == (d,) and d != n:
        acceleration = array(owner, "force", force, (d,), unit="m/s²")
        live = problem.system.inertia(acceleration)
    else:
        live = array(owner, "force", force, (n,), unit="N")
    comm = problem.surface.comm
    driving = _add_up(problem, live)
    if driving == 0.0:
        raise InputError(f"{owner}: force is zero everywhere; give the load that grows")
    if bound is not None:
        instance(owner, "bound", bound, RigidLimit, "give the answer of rigid_limit_load")
    dead = problem.system.load.at_rest(number(owner, "t", t, unit="s"))
    if first is None:
        whole_load = _add_up(problem, dead)
        first = SHARE * (whole_load / driving if bound is None else bound.multiplier)
        if not (first > 0.0 and math.isfinite(first)):
            raise InputError(
                f"{owner}: no load stays, and none tells the size of a step: give first="
            )
    given = {"first": first, "rtol": rtol, "most": most, "solver": solver, "tolerance": tolerance}
    agree(comm, owner, given)
    loads = ((live, _proportional),)
    found = _seek(owner, problem, dead, loads, first, rtol, most, solver, tolerance)
    if bound is not None and found.multiplier > (1.0 + ABOVE) * bound.multiplier:
        raise StepFailure(
            f"{owner}: load steps have equilibrium at {found.multiplier:.7g} times the load, above "
            f"the bound {bound.multiplier:.7g}: give the bound of the same loads and friction, or "
            "bodies with nodes at the ends of joints"
        )
    return replace(found, bound=bound)


def tilt(
    problem: ContactProblem,
    *,
    towards: Sequence[float] = (1.0, 0.0),
    gravity: Sequence[float] | None = None,
    first: float = 0.1,
    rtol: float = RTOL,
    most: int = 100,
    solver: Solver | None = None,
    tolerance: float = TOLERANCE,
) -> LimitLoad:
    """Tilt bodies that stand under their weight until they first move.

    The weight M g of the problem is turned towards a direction e, as on a table that tilts:

        f(theta) = f - M r g + M r (g cos theta + |g| e sin theta),    lambda = tan theta.

    A stack slides at tan theta = mu and topples at the ratio of its width to its height.
    Collective.

    Args:
        problem: the bodies under their weight and other loads, which stay as they are.
        towards: (d,) the direction e to which the weight turns, at right angles to gravity.
        gravity: (d,) acceleration g of the weight [m/s²]; None for the standard one along -y.
        first: the first step of tan theta.
        rtol: of the bracket of tan theta, relative.
        most: steps of the first size, at most.
        solver: of the steps, Automatic() when None.
        tolerance: of the certificates, relative.

    Returns:
        tan theta as the multiplier, the states and the mechanism.

    Raises:
        InputError: wrong arguments; a problem without weight; no equilibrium before the tilt.
        StepFailure: no certified state before the tilt; bodies that stay at any tilt.
    """
    owner = "tilt"
    _check_problem(owner, problem)
    d = problem.system.influence.shape[1]
    if gravity is None:
        gravity = GRAVITY[:d]
    g = array(owner, "gravity", gravity, (d,), unit="m/s²")
    e = array(owner, "towards", towards, (d,))
    size = float(np.linalg.norm(g))
    length = float(np.linalg.norm(e))
    if size == 0.0 or length == 0.0 or abs(float(g @ e)) > 1e-9 * size * length:
        raise InputError(
            f"{owner}: gravity is {tuple(g)} and towards {tuple(e)}; give two vectors at right "
            "angles"
        )
    dead = problem.system.load.at_rest(0.0)
    weight = problem.system.inertia(g)
    # loads that do less work along g than half the weight hold no weight of this direction
    along = problem.system.influence @ g
    algebra = problem.system.algebra
    if algebra.dot(along, dead) < 0.5 * algebra.dot(along, weight):
        raise InputError(
            f"{owner}: the loads of the problem hold no weight along gravity {tuple(g)}: add it by "
            "with_weight, or by BodyForce"
        )
    given = {"first": first, "rtol": rtol, "most": most, "solver": solver, "tolerance": tolerance}
    agree(problem.surface.comm, owner, given)
    sideways = problem.system.inertia(size / length * e)
    loads = ((weight, _lose), (sideways, _gain))
    return _seek(owner, problem, dead, loads, first, rtol, most, solver, tolerance)


def _proportional(value: float) -> float:
    """Return the multiple of the load at a value of the path."""
    return value


def _lose(tangent: float) -> float:
    """Return cos theta - 1, the weight's share that a tilt takes away."""
    return math.cos(math.atan(tangent)) - 1.0


def _gain(tangent: float) -> float:
    """Return sin theta, the weight's share along the direction of the tilt."""
    return math.sin(math.atan(tangent))


def _check_problem(owner: str, problem: ContactProblem) -> None:
    """Raise InputError for what is no problem, and for obstacles that move."""
    check_problem_given(owner, problem)
    if problem.surface.motion is not None or problem.surface.slide is not None:
        raise InputError(
            f"{owner}: the obstacle moves with the time, and the time is the load here: give one "
            "at rest"
        )


def _add_up(problem: ContactProblem, load: Array) -> float:
    """Return the sum of |load| of all ranks [N]."""
    return float(problem.surface.comm.sum(np.array([np.abs(load).sum()]))[0])


def _seek(
    owner: str,
    problem: ContactProblem,
    dead: Array,
    loads: Histories,
    first: float,
    rtol: float,
    most: int,
    solver: Solver | None,
    tolerance: float,
) -> LimitLoad:
    """Return the limit of loads that grow with the multiplier beside those that stay.

    Args:
        owner: the function of the user.
        problem: the bodies.
        dead: (n,) what stays [N].
        loads: pairs of a vector (n,) [N] and what multiplies it, a function of the multiplier.
        first: size of the first step.
        rtol: of the bracket, relative.
        most: steps of the first size, at most.
        solver: of the steps, or None.
        tolerance: of the certificates, relative.
    """
    number(owner, "first", first, positive=True)
    if not 1e-12 < number(owner, "rtol", rtol, positive=True) < 1.0:
        raise InputError(f"{owner}: rtol is {rtol}; give a share below one, such as 1e-2")
    whole(owner, "most", most, least=1)
    check_methods(owner, solver, (), tolerance)

    # The multiplier takes the place of the time: the loads of the problem are those of one time.
    system = problem.system.loaded(Load(dead, separable=loads))
    loaded = replace(problem, system=system)
    equilibria = Equilibria(loaded, solver=solver, tolerance=tolerance)
    with together(problem.surface.comm):
        start = initial_state(loaded, 0.0)
    start = equilibria.solve(start, 0.0)
    path = seek_limit(equilibria.solve, start, value=0.0, first=first, rtol=rtol, most=most)
    return LimitLoad(
        multiplier=path.values[-1],
        lost_at=path.lost,
        multipliers=np.array(path.values),
        states=path.states,
        mechanism=_find_mechanism(loaded, equilibria, path),
        proven=path.proven,
        reason=path.reason,
        bound=None,
        problem=loaded,
    )


def _find_mechanism(problem: ContactProblem, equilibria: Equilibria, path: LoadPath) -> State:
    """Return the increment of displacement where equilibrium is lost, of the largest component one.

    Where contact alone holds the bodies it is the last increment of the iteration that failed, a
    motion on springs that are as weak as it gets. Otherwise it is that of the last step, in which
    what yields moves most.

    Args:
        problem: the bodies.
        equilibria: of it, after the last attempt.
        path: of the states.
    """
    last = path.states[-1]
    if isinstance(equilibria.solver, Proximal):
        motion = equilibria.solver.motion
    else:
        before = path.states[-2].u if len(path.states) > 1 else np.zeros_like(last.u)
        motion = last.u - before
    size = largest(problem.surface.comm, max_abs(problem.cartesian(motion))) or 1.0
    nothing = np.zeros_like(last.r_n)
    return State(
        path.lost,
        last.k,
        motion / size,
        np.zeros_like(motion),
        nothing,
        nothing > 0.0,
        r_t=None if last.r_t is None else np.zeros_like(last.r_t),
        turned=last.turned,
    )
