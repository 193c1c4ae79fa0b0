"""Solve the smallest problems with friction in the plane by trying all states of their conditions.

Each of k conditions is open, sticks, or slips to one of two sides: 4^k sets of linear equations and
inequalities in r, each decided exactly by linear programming, also where G is singular:

    open    r_n = 0, w_n >= 0             closed  w_n = 0, r_n >= 0   (bilateral: w_n = 0)
    stick   w_t = 0, |r_t| <= limit       slip    r_t = ± limit, ± w_t <= 0

with limit = cohesion + slope r_n, and r_t = 0 of open conditions: cohesion is of those that touch.
It is the last way where iterations find no answer.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from ...core.algebra import Array
from .problem import ScaledProblem

MOST_CONDITIONS = 4  # 4^4 linear programs of a millisecond
SLACK = 1e-10  # of the largest gap or slip: by how much inequalities may be missed


def find_by_states(step: ScaledProblem) -> Array | None:
    """Return reactions (m, 2), scaled, of the first set of states that has any; None without one.

    Args:
        step: a problem of few conditions in the plane.
    """
    for r in list_answers(step):
        return r
    return None


def list_answers(step: ScaledProblem) -> Iterator[Array]:
    """Yield reactions (m, 2), scaled, of every set of states that has any.

    Args:
        step: a problem of few conditions in the plane.
    """
    from scipy.optimize import linprog  # late: it takes a while

    m = step.count
    unit = step.unit or 1.0
    q = step.q.ravel() / unit
    G = step.delassus.matrix
    choices = []
    for bilateral in step.delassus.bilateral:
        closed = [(True, side) for side in (0.0, 1.0, -1.0)]
        choices.append(closed if bilateral else [(False, 0.0), *closed])
    for states in product(*choices):
        equal, less = _pose(step, states, G, q, unit)
        # the least sum of the normal forces
        found = linprog(
            np.tile([1.0, 0.0], m),
            A_ub=less[0],
            b_ub=less[1] + SLACK,
            A_eq=equal[0],
            b_eq=equal[1],
            bounds=(None, None),
            method="highs",
        )
        if found.status == 0:
            yield found.x.reshape(m, 2) * unit


def _pose(
    step: ScaledProblem,
    states: tuple[tuple[bool, float], ...],
    G: Array,
    q: Array,
    unit: float,
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return (matrix, right side) of the equations and of the inequalities  a r <= b  of states.

    Args:
        step: the problem.
        states: of each condition whether it is closed, and the side of its slip, 0 for none.
        G: (2 m, 2 m).
        q: (2 m,) over the unit.
        unit: of forces and displacements.
    """
    one = np.eye(len(q))
    equal = []
    less = []
    for i, (closed, side) in enumerate(states):
        n, t = 2 * i, 2 * i + 1
        slope = step.slope[i]
        cohesion = step.cohesion[i] / unit
        if not closed:
            equal += [(one[n], 0.0), (one[t], 0.0)]
            less.append((-G[n], q[n]))
            continue
        equal.append((G[n], -q[n]))
        if not step.delassus.bilateral[i]:
            less.append((-one[n], 0.0))
        if side:
            equal.append((one[t] - side * slope * one[n], side * cohesion))
            less.append((side * G[t], -side * q[t]))
        else:
            equal.append((G[t], -q[t]))
            less += [(way * one[t] - slope * one[n], cohesion) for way in (1.0, -1.0)]
    matrices = []
    for rows in (equal, less):
        matrices.append((np.array([a for a, _ in rows]), np.array([b for _, b in rows])))
    return matrices[0], matrices[1]
