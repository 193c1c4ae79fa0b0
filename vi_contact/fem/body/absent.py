"""Let cells of a mesh be absent: of bodies that are not yet placed, or that have been removed.

Absent cells have neither stiffness nor mass, and carry nothing. A node of absent cells alone is
held where it is, so that it is no unknown; one that a present cell shares belongs to this cell.

Stresses of a body whose stages add and remove parts are those of its past and not of its
displacement. All its materials remember their stress therefore, and one that is linear is taken as
one that never yields.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.algebra import Mask, from_each, total
from ...core.checks import refuse
from ...core.errors import InputError
from ...laws.materials import LinearElastic
from ...laws.yielding import YieldingMaterial
from .. import compat
from ..mesh.communicators import MpiComm
from ..mesh.group_checks import cells_of
from ..mesh.numbering import NodeTable
from ..mesh.tagged_mesh import Cells, Facets, local_count
from .dirichlet import GivenValues
from .loads import Support

NAME = "absent bodies"


def find_absent(mesh: Any, absent: Any) -> Mask:
    """Return which local cells, ghosts among them, are absent. Collective.

    Args:
        mesh: of the body.
        absent: cell groups, or one of them.

    Raises:
        InputError: what is no cell group of this mesh, and where all cells are absent.
    """
    groups = [absent] if isinstance(absent, Cells) else list(absent)
    missing = np.zeros(local_count(mesh, 0), dtype=bool)
    for group in groups:
        missing[cells_of("assemble", "absent", group, mesh).indices] = True
    if not total(MpiComm(mesh.comm), float((~missing).sum())):
        raise InputError("assemble: all cells of the mesh are absent; leave one body there")
    return missing


def refuse_inner(mesh: Any, loads: Sequence[Any]) -> None:
    """Raise InputError for loads on facets between two cells. Collective.

    Integrals over facets are of the boundary of the whole mesh. A load on a line that is drawn
    inside a body, or on the floor of a pit that is not yet dug, would be left out without a word.

    Args:
        mesh: of the body.
        loads: of ``fem.assemble``.
    """
    if not any(isinstance(getattr(load, "facets", None), Facets) for load in loads):
        return
    outer = Facets.where("", mesh, lambda x: np.ones(x.shape[1], dtype=bool))
    dim = mesh.topology.dim - 1
    defects = []
    for load in loads:
        facets = getattr(load, "facets", None)
        if not isinstance(facets, Facets) or facets.mesh is not mesh:
            continue  # refused elsewhere, or no load on facets
        owned = facets.indices[facets.indices < mesh.topology.index_map(dim).size_local]
        if not np.isin(owned, outer.indices).all():
            defects.append(
                f"assemble: the load on '{facets.name}' acts on facets between two cells of the "
                "mesh, where it is not seen: give facets of the outer boundary, draw the body that "
                "covers them with points of its own, or load a thin layer by BodyForce"
            )
    refuse(defects, MpiComm(mesh.comm))


def find_present(mesh: Any, absent: Mask | None, facets: Facets) -> Mask:
    """Return which facets (k,) have a present cell on this rank.

    Args:
        mesh: of the body.
        absent: which local cells are absent, or None where all are there for good.
        facets: a group of its boundary.
    """
    if absent is None:
        return np.ones(len(facets.indices), dtype=bool)
    dim = mesh.topology.dim
    mesh.topology.create_connectivity(dim - 1, dim)
    beside = mesh.topology.connectivity(dim - 1, dim)
    there = [not absent[beside.links(facet)].all() for facet in facets.indices]
    return np.array(there, dtype=bool)


def let_remember(material: Any, forms: Any) -> Any:
    """Return materials of which the linear ones remember their stress.

    Args:
        material: one, or (cells, material) pairs.
        forms: the user's own, or None.

    Raises:
        InputError: materials that do not yield and are not LinearElastic, and forms.
    """
    if forms is not None:
        raise InputError(
            "assemble: bodies are added and removed where materials state their stress: give "
            "material= in the place of forms="
        )
    if isinstance(material, Sequence):
        return [(cells, let_remember(own, None)) for cells, own in material]
    if isinstance(material, LinearElastic):
        return YieldingMaterial(material.E, material.nu, material.rho, xi=material.xi)
    if material is not None and not isinstance(material, YieldingMaterial):
        raise InputError(
            f"assemble: bodies of {type(material).__name__} cannot be added or removed: give "
            "LinearElastic or a material that yields"
        )
    return material


def hold_absent(comm: MpiComm, V: Any, nodes: NodeTable, missing: Mask) -> list[Support]:
    """Return the support of the nodes that no present cell has. Collective.

    Args:
        comm: the ranks.
        V: the displacement's space.
        nodes: its nodes.
        missing: which local cells are absent.
    """
    blocks = np.unique(compat.cell_blocks(V)[~missing])
    present = np.unique(np.concatenate(from_each(comm, nodes.numbers[blocks])))
    alone = ~np.isin(nodes.numbers, present)
    mask = np.repeat(alone[:, None], V.mesh.geometry.dim, axis=1)
    return [GivenValues(NAME, mask, np.zeros(mask.shape), False).support(nodes.owned)]
