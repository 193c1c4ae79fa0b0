"""Name bodies that nothing holds and that no contact condition touches.

They are named before a run computes a step.

They are seldom meant. Where nodes of such a body lie at the places of another body's nodes, the
meshes of the two have not been merged: they look like one body in a picture, and fly apart without
a word.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array, Indices, Mask, from_each
from ..core.checks import describe_point
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..laws.free_motions import free_motions, rows_of_bodies

log = logging.getLogger(__name__)
SAME = 1e-9  # of the size of the bodies: nodes that are nearer lie at one place


@dataclass(frozen=True)
class LooseBody:
    """Hold where a loose body is.

    Attributes:
        middle: of its box (d,) [m].
        nodes: how many it has.
        coinciding: how many of them lie at nodes of other bodies.
    """

    middle: Array
    nodes: int
    coinciding: int


def find_loose_bodies(problem: ContactProblem) -> list[LooseBody]:
    """Return the bodies with a rigid motion that neither a stiffness nor a contact condition meets.

    Collective.
    """
    # Nearly every body is touched: the rest, which gathers nodes, is for those that are not.
    system = problem.system
    rows = rows_of_bodies(system)
    touched = _find_touched(problem, rows)
    if touched.all():
        return []
    from scipy.spatial import cKDTree  # late: no other run needs it

    comm = system.algebra.comm
    points = system.space.coordinates
    nodes = [_merge(from_each(comm, points[own])) for own in rows]
    size = float(np.max(np.ptp(np.concatenate(nodes), axis=0), initial=0.0))
    loose = []
    for number, free in enumerate(free_motions(system)):
        if not free.motions.shape[1] or touched[number]:
            continue
        others = [nodes[other] for other in range(len(nodes)) if other != number]
        coinciding = 0
        if others:
            distance, _ = cKDTree(np.concatenate(others)).query(nodes[number])
            coinciding = int(np.count_nonzero(distance <= SAME * size))
        middle = 0.5 * (nodes[number].min(axis=0) + nodes[number].max(axis=0))
        loose.append(LooseBody(middle, len(nodes[number]), coinciding))
    return loose


def _merge(parts: list[Array]) -> Array:
    """Return the places of all ranks, each once."""
    return np.asarray(np.unique(np.concatenate(parts), axis=0))


def _find_touched(problem: ContactProblem, bodies: list[Indices]) -> Mask:
    """Return for every body whether it is on a side of some contact condition. Collective.

    A translation of such a body alone moves the condition.
    """
    surface = problem.surface
    moved = np.zeros(len(bodies))
    for number, rows in enumerate(bodies):
        for translation in problem.system.influence.T:
            alone = np.zeros_like(translation)
            alone[rows] = translation[rows]
            alone = surface.in_frames(alone)
            # relative to the other side: see SemiDiscreteSystem.in_relative
            if surface.coupling is not None:
                alone = 2.0 * alone - surface.coupling @ alone
            for values in (surface.normal_values(alone), surface.tangential_values(alone)):
                moved[number] = max(moved[number], np.max(np.abs(values), initial=0.0))
    return np.asarray(surface.comm.max(moved) > 0.0)


def judge_loose_bodies(problem: ContactProblem) -> Iterator[tuple[str, bool]]:
    """Yield a sentence on every loose body, and whether it is refused. Collective.

    It is refused where its nodes lie at another's.
    """
    for body in find_loose_bodies(problem):
        size = "one node" if body.nodes == 1 else f"{body.nodes} nodes"
        sentence = (
            f"nothing holds the body of {size} around {describe_point(body.middle)}, and "
            "no contact touches it"
        )
        if body.coinciding:
            nodes = "one of its nodes lies"
            if body.coinciding > 1:
                nodes = f"{body.coinciding} of its nodes lie"
            yield (
                f"{sentence}: {nodes} where another body has one, as of meshes that are not "
                "merged: merge them (Coherence in Gmsh), or make a contact or a tie between both",
                True,
            )
        else:
            yield f"{sentence}: it moves freely", False


def refuse_loose_bodies(problem: ContactProblem) -> None:
    """Raise InputError for a loose body whose nodes lie at another body's. Collective.

    Warn, on rank 0, of other loose bodies.
    """
    for sentence, refused in judge_loose_bodies(problem):
        if refused:
            raise InputError(sentence)
        if problem.surface.comm.rank == 0:
            log.warning("%s", sentence)
