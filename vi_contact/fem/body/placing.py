"""Go on with other bodies: some are placed on what stands, others are taken away.

A body is placed free of stress on what has moved already. Its nodes begin at their own places, as
fill is placed up to the line that is drawn, and settlements of it count from then on; nodes that it
shares with others are where these are. Stresses grow from the strains after that. Gaps of new
contacts count from then on too: what is drawn in contact touches when it is placed, wherever the
other side has moved.

A body that is removed takes its stress and its weight away. The others are out of balance then, and
the static stage that follows finds their new equilibrium.

The stages of construction of PLAXIS and the like (Potts and Zdravkovic, Finite Element Analysis in
Geotechnical Engineering: Theory (1999), section 3.7) place and remove bodies so.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.algebra import Array, largest, max_abs
from ...core.errors import InputError
from ...core.internal import remembers, select_memory
from ...core.problem import ContactProblem
from ...core.state_checks import check_problem_given, check_sizes
from ...core.step import State
from ...core.surfaces import ContactSurface
from .released_supports import begin_from, stand_on
from .space import FemSpace

ALIKE = 0.9  # cosine of two normals of one condition
TOUCHING = 1e-9  # of the size of the body: a gap that is none


def place(
    before: ContactProblem, state: State, problem: ContactProblem
) -> tuple[ContactProblem, State]:
    """Return the problem with other bodies, and where its static stage begins. Collective.

    Both problems are of ``fem.assemble`` with ``absent=`` on one mesh, with the same materials in
    the same order. Hand both results to ``static_equilibrium(problem, state=)``. The unknowns of
    ``problem`` remember where its held nodes stand from now on, so assemble one for each placing.

    Args:
        before: the problem of the stage before.
        state: where that stage has ended, at rest.
        problem: that of the bodies which are there now.

    Raises:
        InputError: problems of other meshes, without ``absent=``, or with a joint that remembers.
    """
    for given in (before, problem):
        check_problem_given("place", given)
    check_sizes("place", before, state)
    old, new = before.system.space, problem.system.space
    if not isinstance(old, FemSpace) or not isinstance(new, FemSpace) or old.mesh is not new.mesh:
        raise InputError("place: give two problems of fem.assemble on one mesh")
    if old.absent is None or new.absent is None:
        raise InputError(
            "place: bodies are added and removed where stresses are remembered: assemble both "
            "systems with absent= (an empty list where nothing is absent)"
        )
    if before.joint is not None or problem.joint is not None:
        raise InputError(
            "place: a joint remembers what its points have gone through, and cannot go on in other "
            "contact points: give mu in the place of the joint"
        )

    # where nodes are, and what points of integration remember
    nodal = old.expand(before.cartesian(state.u), state.t)
    stand_on(old, new, nodal)
    u0 = new.restrict(nodal)
    after: Any = problem.system.internal
    known: Any = before.system.internal
    memory: Mapping[str, Array] = select_memory(state.memory)
    taken = after.take_over(known, memory or known.remember(before.cartesian(state.u)))

    # contact: conditions that were there keep their gaps, new ones count from here
    m = problem.surface.count
    bare = replace(
        state,
        r_n=np.zeros(m),
        r_t=np.zeros((m, problem.surface.tangents.shape[1])) if problem.frictional else None,
        active=np.zeros(m, dtype=bool),
        memory=taken,
    )
    still = np.zeros_like(u0)
    begun, first = begin_from(problem, u0, still, bare)
    surface = keep_gaps(before.surface, begun.surface, first.u)
    begun = replace(begun, surface=surface)
    gap = surface.gap(0.0) - surface.normal_values(first.u)
    return begun, replace(first, active=gap <= TOUCHING * new.size)


def keep_gaps(old: ContactSurface, new: ContactSurface, u: Array) -> ContactSurface:
    """Return a surface whose conditions have the gaps of those that were there before.

    Gaps of new ones are those drawn, in the displacements u.

    Args:
        old: the surface before.
        new: the surface.
        u: (n,) in the unknowns of the equations [m].
    """
    gap = new.gap0 + new.normal_values(u)
    rows: dict[bytes, list[int]] = {}
    for row, point in enumerate(old.points):
        rows.setdefault(point.tobytes(), []).append(row)
    for row, point in enumerate(new.points):
        for known in rows.get(point.tobytes(), ()):
            if float(old.normals[known] @ new.normals[row]) >= ALIKE:
                gap[row] = old.gap0[known]
    return replace(new, gap0=gap)


def same_bodies(before: ContactProblem, problem: ContactProblem) -> bool:
    """Say whether the same bodies are there in two problems of one mesh. Collective."""
    old: Any = before.system.space
    new: Any = problem.system.space
    if old.absent is None or new.absent is None:
        return True
    return not largest(new.comm, max_abs((old.absent != new.absent).astype(float)))


def adds_or_removes(problem: ContactProblem) -> bool:
    """Say whether a problem is of a run whose stages add or remove bodies."""
    space: Any = problem.system.space
    return getattr(space, "absent", None) is not None and remembers(problem.system.internal)
