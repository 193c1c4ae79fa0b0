"""Hold conditions at the nodes of a contact boundary, and what these nodes face."""

from dataclasses import dataclass

import scipy.sparse as sp

from ...core.algebra import Array, Indices
from .borrowing import Borrowed
from .nodes import Nodes


@dataclass(frozen=True, eq=False)
class Facing:
    """Hold what m contact nodes face: opposite node s the other body moves by sum_j P_sj u_j.

    Attributes:
        nodes: the n nodes j, of all ranks.
        P: (m, n).
    """

    nodes: Nodes
    P: sp.csr_matrix


@dataclass(frozen=True, eq=False)
class NodalConditions:
    """Hold this rank's m conditions u·direction <= gap at nodes.

    Attributes:
        nodes: their nodes.
        directions: (m, d) unit vectors.
        slots: (m,) their numbers among those of all ranks, ascending.
        facing: what they face if that deforms too: u is relative to it.
        bubbles: what the bubbles of edges add to u, where displacements have them (``.bubbles``).
        borrowed: pressures of nodes without a condition.
    """

    nodes: Nodes
    directions: Array
    slots: Indices
    facing: Facing | None = None
    bubbles: tuple[Facing, ...] = ()
    borrowed: Borrowed | None = None


def list_faced(part: NodalConditions) -> list[Facing]:
    """Return all that displacements of conditions are relative to: what they face, and bubbles."""
    return [other for other in (part.facing, *part.bubbles) if other is not None]
