"""Take Dirichlet data as a user of DOLFINx has them: ``dirichletbc`` objects.

They are on the displacement's space V, on a space like it, or on a component V.sub(i). Such a space
may number its unknowns in another order than V, and a component of it knows nothing of the others.
So each is translated, once, into a table of V: which components of which nodes it holds, and at
which values (``GivenValues``). From there on it is a support like ``fem.Prescribed``.

A *block* is the d unknowns of one node; blocks are numbered on each rank, owned ones first.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Mask, from_each, largest, max_abs
from ...core.checks import provides, refuse
from ...core.errors import InputError
from .. import compat
from ..mesh.communicators import MpiComm
from ..mesh.numbering import facet_rows
from .loads import Support

REMEDY = (
    "give dirichletbc(value, dofs, V) on the vector-valued Lagrange space V of this mesh, or "
    "on V.sub(i)"
)


@dataclass(frozen=True, eq=False)
class GivenValues:
    """Hold components of nodes at the values of a ``dirichletbc``, as they were when given.

    It answers what ``loads.Support`` asks of a condition: ``name``, ``at``, ``on_facets``.

    Attributes:
        name: what messages call it, such as "bcs[0]".
        mask: (blocks, d) which components of local blocks of V are held, ghosts too.
        values: (blocks, d) their values [m], zero elsewhere.
        moves: whether some value, of any rank, is not zero.
    """

    name: str
    mask: Mask
    values: Array
    moves: bool

    def support(self, owned: int) -> Support:
        """Return what this rank holds.

        Args:
            owned: how many blocks of V this rank owns.
        """
        blocks, components = np.nonzero(self.mask[:owned])
        return Support(self, (blocks, components), self.moves)

    def at(
        self, points: Array, places: tuple[Any, Any], t: float, derivative: int
    ) -> tuple[Any, str]:
        """Return the values at the places, and no defect: zero for rates, as they do not move.

        Args:
            points: (owned nodes, d) coordinates [m]; nothing here needs them.
            places: owned blocks and components.
            t: time [s].
            derivative: 0 for the values, 1 and 2 for their rates.
        """
        return (0.0 if derivative else self.values[places]), ""

    def on_facets(self, space: Any, facets: Any) -> list[tuple[Any, tuple[int, ...]]]:
        """Return, for each component, the facets of which every node is held in it."""
        held = self.mask[facet_rows(space.V, facets)].all(axis=1)
        return [(facets[held[:, c]], (c,)) for c in range(space.dimension)]


def refuse_uneven(comm: MpiComm, bcs: Sequence[Any]) -> None:
    """Raise InputError, on all ranks, where some have more conditions than others. Collective."""
    counts = from_each(comm, len(bcs))
    if min(counts) < max(counts):
        raise InputError(
            f"assemble: bcs has {max(counts)} items on one rank and {min(counts)} on another; give "
            "all ranks the same list, also where a rank has none of its unknowns"
        )


def choose_space(mesh: Any, V: Any, bcs: Sequence[Any]) -> tuple[Any, int]:
    """Return the displacement's space and its degree, 1 or 2. Collective.

    It is the user's, or else one that the first condition is on.

    Args:
        mesh: that of the body.
        V: the user's space, or None.
        bcs: ``dirichletbc`` objects, at least one where V is None.

    Raises:
        InputError: a space of another mesh or kind, and what is no dirichletbc.
    """
    for bc in bcs:
        provides("assemble", "bcs", bc, ("dof_indices", "function_space", "g"), REMEDY)
        if not compat.is_on(bc.function_space, mesh):
            raise InputError(f"assemble: a dirichletbc of bcs is on another mesh; {REMEDY}")
    if V is None:
        # a condition does not tell the degree of its space; the blocks of the right one fit
        for degree in (1, 2):
            known = compat.vector_space(mesh, degree)
            if _match_blocks(known, bcs[0].function_space) is not None:
                return known, degree
        raise InputError(f"assemble: a dirichletbc of bcs is on a space of another kind; {REMEDY}")
    provides(
        "assemble",
        "space",
        V,
        ("dofmap", "ufl_element", "component"),
        "give a DOLFINx function space, or None",
    )
    if not compat.is_on(V, mesh):
        raise InputError("assemble: space is on another mesh; give a space on this one")
    # the displacement's space has the element of degree 1 or 2, and is no part of another space
    for degree in (1, 2):
        known = compat.vector_space(mesh, degree)
        alike = V.ufl_element() == known.ufl_element()
        if alike and _match_blocks(known, V) is not None and not len(V.component()):
            return V, degree
    raise InputError(
        f"assemble: space is one of {V.ufl_element()}; give the Lagrange space of degree 1 or 2 "
        f"with {mesh.geometry.dim} components, not a part of another space"
    )


def read_values(mesh: Any, V: Any, bcs: Sequence[Any]) -> tuple[GivenValues, ...]:
    """Translate conditions into tables of a displacement's space. Collective.

    Args:
        mesh: that of the body.
        V: the displacement's space.
        bcs: ``dirichletbc`` objects on V, a space like it, or a component of one.

    Raises:
        InputError: on all ranks, a condition on another space, one that holds nothing, and values
            that are not finite.
    """
    comm = MpiComm(mesh.comm)
    d = mesh.geometry.dim
    local = V.dofmap.index_map
    shape = (local.size_local + local.num_ghosts, d)
    conditions = []
    for k, bc in enumerate(bcs):
        name = f"bcs[{k}]"
        block = _match_blocks(V, bc.function_space)
        if block is None:
            raise InputError(
                f"assemble: {name} is on another space than the displacement's; {REMEDY}"
            )
        # unknown i of the condition's space is component i % d of its block i // d: also where the
        # space is a component of another one, whose numbers it keeps
        dofs, values = compat.bc_values(bc, d * len(block))
        known = block[dofs // d] >= 0
        places = block[dofs[known] // d], dofs[known] % d
        mask = np.zeros(shape, dtype=bool)
        held = np.zeros(shape)
        mask[places] = True
        held[places] = values[known]
        finite = np.all(np.isfinite(values))
        refuse(
            ["" if finite else f"assemble: {name} has NaN or infinite values; correct them"], comm
        )
        if not largest(comm, len(dofs)):
            raise InputError(
                f"assemble: {name} prescribes no unknown on any rank; check how its dofs were "
                "located"
            )
        moves = bool(largest(comm, max_abs(values)))
        conditions.append(GivenValues(name, mask, held, moves))
    return tuple(conditions)


def refuse_contradictions(space: Any) -> None:
    """Raise InputError, on all ranks, where a dirichletbc and a ``Prescribed`` contradict.

    They do where one of them holds all components of nodes that the other one holds, at different
    values; a function of time may become different. Conditions that only meet, as at the edge of
    two boundaries, do not contradict: the later one counts. Collective.

    Args:
        space: the FemSpace of the body.
    """
    is_given = np.array([isinstance(each, GivenValues) for each in space.prescribed], dtype=bool)
    # the values (k, d) that each holds at t = 0, NaN at the components that it does not hold
    held = [np.full(space.held.shape, np.nan) for _ in is_given]
    for values, support in zip(held, space.supports, strict=True):
        values[support.places], _ = support.at(space.points, 0.0, 0)
    for i, j in product(np.flatnonzero(~is_given), np.flatnonzero(is_given)):
        stated = space.prescribed[i]
        moves = stated.moves and callable(stated.motions[0])
        # NaN where one of them holds nothing
        apart = np.abs(held[i] - held[j])
        counts = np.array([np.isfinite(values).sum() for values in (apart, held[i], held[j])])
        both, *each = space.comm.sum(counts)
        contained = both and both in each
        if contained and (moves or largest(space.comm, np.nanmax(apart, initial=0.0))):
            raise InputError(
                f"assemble: {space.prescribed[j].name} and what is prescribed on "
                f"'{stated.name}' differ at an unknown of both: leave one of them out"
            )


def _match_blocks(V: Any, S: Any) -> Indices | None:
    """Return which block of V each block of a space is, -1 of those without cells. Collective.

    Spaces made twice may be numbered differently; but a node has the same place in its cell in
    both, so that the tables of their cells tell.

    Args:
        V: the displacement's space.
        S: a space like V, or V.sub(i).

    Returns:
        (blocks of S,), or None on all ranks where S is of another kind.
    """
    # S has d unknowns a block or is one of d components, and as many nodes a cell as V
    d = V.mesh.geometry.dim
    theirs = S.dofmap.index_map
    mine = compat.cell_blocks(V)
    rows = compat.blocks_of_cells(S)
    fits = (
        S.dofmap.index_map_bs == d
        and S.dofmap.bs == (1 if len(S.component()) else d)
        and rows.shape == mine.shape
    )
    block = np.full(theirs.size_local + theirs.num_ghosts, -1, dtype=np.int64)
    if fits:
        # written from all cells and read back: a block of S must be the same one of V in each
        block[rows] = mine
        fits = (
            np.array_equal(block[rows], mine)
            and V.dofmap.index_map.size_global == theirs.size_global
        )
    return None if largest(MpiComm(V.mesh.comm), not fits) else block
