"""Gather what holds, ties, damps and loads a body, and check that it goes together.

Groups must be of this mesh and have facets, nothing may act twice, and conditions may not
contradict.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh

from ...core.checks import instance, refuse
from ...core.errors import InputError
from ..mesh.communicators import MpiComm
from ..mesh.group_checks import cells_of, facets_of
from ..mesh.tagged_mesh import Facets
from .dashpots import Dashpots
from .linear_forms import LOADS
from .loads import BodyForce, Prescribed
from .ties import Tied

OWNER = "assemble"
SIDES = ("facets", "first", "second")  # attributes of conditions and loads that are boundary groups
KINDS: dict[str, tuple[type, ...]] = {
    "prescribed": (Prescribed,),
    "tied": (Tied,),
    "dashpots": (Dashpots,),
    "loads": LOADS,
}


@dataclass(frozen=True, eq=False)
class Conditions:
    """Hold what acts on a body at facets and inside.

    Attributes:
        held: facets that are clamped, as ``Prescribed`` at rest, then those that are prescribed.
        prescribed: the latter alone.
        tied: boundaries that move together.
        dashpots: absorbing boundaries.
        loads: tractions, body forces, linear forms, initial strains.
    """

    held: tuple[Prescribed, ...]
    prescribed: tuple[Prescribed, ...]
    tied: tuple[Tied, ...]
    dashpots: tuple[Dashpots, ...]
    loads: tuple[Any, ...]


def as_tuple(items: Any) -> tuple[Any, ...]:
    """Return one item or a sequence of items, as a tuple; None is none."""
    if items is None:
        return ()
    return tuple(items) if isinstance(items, list | tuple) else (items,)


def gather_conditions(
    mesh: Mesh, *, clamped: Any, prescribed: Any, tied: Any, dashpots: Any, loads: Any
) -> Conditions:
    """Return what acts on a body. Collective.

    Args:
        mesh: that of the body.
        clamped: facets with u = 0, one group or several.
        prescribed: ``Prescribed``, one or several.
        tied: ``Tied``, one or several.
        dashpots: ``Dashpots``, one or several.
        loads: tractions and the like, one or several.

    Raises:
        InputError: on all ranks, objects of another kind, groups of another mesh or without
            facets, an object named twice, prescribed displacements that contradict each other on
            the same facets, ties with dashpots.
    """
    given = {
        "clamped": as_tuple(clamped),
        "prescribed": as_tuple(prescribed),
        "tied": as_tuple(tied),
        "dashpots": as_tuple(dashpots),
        "loads": as_tuple(loads),
    }
    # kinds of all objects first, then all groups that they name
    for name, kinds in KINDS.items():
        remedy = (
            f"give {' or '.join(f'fem.{kind.__name__}(…)' for kind in kinds)}, or a list of them"
        )
        for item in given[name]:
            instance(OWNER, name, item, kinds, remedy)
    groups = _list_groups(given)
    rest = [Prescribed(group) for group in given["clamped"] if isinstance(group, Facets)]
    for name, group in groups:
        meaning = name if name == "clamped" else f"the facets of {name}"
        facets_of(OWNER, meaning, group, mesh)
    _refuse_repeated(loads=given["loads"], dashpots=given["dashpots"])
    _refuse_empty(mesh, groups)
    _refuse_empty(mesh, _list_force_groups(mesh, given["loads"]), "cell")
    conditions = Conditions(
        held=(*rest, *given["prescribed"]),
        prescribed=given["prescribed"],
        tied=given["tied"],
        dashpots=given["dashpots"],
        loads=given["loads"],
    )
    refuse(
        _find_contradictions(conditions.held, conditions.tied, conditions.dashpots),
        MpiComm(mesh.comm),
    )
    return conditions


def _list_groups(given: dict[str, tuple[Any, ...]]) -> list[tuple[str, Any]]:
    """Return (name of the argument, group) of all boundary groups that arguments name."""
    named = [("clamped", group) for group in given["clamped"]]
    for name in KINDS:
        for item in given[name]:
            groups = [getattr(item, side, None) for side in SIDES]
            named += [(name, group) for group in groups if group is not None]
    return named


def _refuse_repeated(**lists: Sequence[Any]) -> None:
    """Raise InputError for an object that a list names twice: it would act twice."""
    for name, items in lists.items():
        for first, second in combinations(items, 2):
            if first is second:
                raise InputError(
                    f"assemble: {name} names one {type(first).__name__} twice, which would act "
                    "twice; leave it out once, or give one of twice the size"
                )


def _list_force_groups(mesh: Mesh, loads: Sequence[Any]) -> list[tuple[str, Any]]:
    """Return ("loads", group) of the cells that body forces act on, checked to be of the mesh."""
    groups: list[tuple[str, Any]] = []
    for load in loads:
        if isinstance(load, BodyForce) and load.cells is not None:
            groups.append(("loads", cells_of(OWNER, "the cells of loads", load.cells, mesh)))
    return groups


def _refuse_empty(mesh: Mesh, groups: Sequence[tuple[str, Any]], kind: str = "boundary") -> None:
    """Raise InputError, on all ranks, for a group without facets or cells on any rank.

    Such a group holds and loads nothing, which is seldom meant. Collective.

    Args:
        mesh: that of the body.
        groups: (name of the argument, group) of all that are given.
        kind: "boundary" or "cell".
    """
    members = "facets" if kind == "boundary" else "cells"
    own = np.array([len(group.indices) for _, group in groups], dtype=float)
    for (name, group), count in zip(groups, mesh.comm.allreduce(own), strict=True):
        if not count:
            raise InputError(
                f"assemble: the {kind} group '{group.name}' of {name} has no {members}, so it has "
                "no effect; correct the group, or leave it out"
            )


def _find_contradictions(
    held: Sequence[Prescribed], tied: Sequence[Tied], damped: Sequence[Dashpots]
) -> Iterator[str]:
    """Yield a sentence on each pair of conditions that contradict on facets of this rank.

    Such are two values of one component, and dashpots on a boundary that is tied as a whole.

    Args:
        held: what is clamped or prescribed.
        tied: boundaries that move together.
        damped: absorbing boundaries.
    """
    for first, second in combinations(held, 2):
        both = np.intersect1d(first.facets.indices, second.facets.indices)
        if len(both) and not first.same_motion(second):
            yield (
                f"assemble: boundary groups '{first.facets.name}' and '{second.facets.name}' share "
                "facets on which different displacements are prescribed: leave out one of the two"
            )
    sides = [side for tie in tied if tie.components is None for side in (tie.first, tie.second)]
    for side, absorbing in product(sides, damped):
        if len(np.intersect1d(side.indices, absorbing.facets.indices)):
            yield (
                f"assemble: boundary '{side.name}' is tied and has dashpots, which would brake the "
                "waves through the ties: leave out one of the two"
            )
