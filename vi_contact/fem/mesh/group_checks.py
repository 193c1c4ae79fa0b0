"""Check groups of facets and cells where they are given: their kind, and the mesh they are of.

Their numbers are local ones of one mesh. On another mesh, or taken for those of cells, they would
name other places.
"""

from typing import Any, cast

from dolfinx.mesh import Mesh

from ...core.checks import array, function, quote, several, whole
from ...core.errors import InputError
from .tagged_mesh import Cells, Facets, Group

KINDS: dict[type[Group], str] = {Facets: "boundary group", Cells: "cell group"}


def facets_of(owner: str, meaning: str, group: Any, mesh: Mesh | None = None) -> Facets:
    """Return the boundary group, of this mesh if one is given.

    Args:
        owner: who asks.
        meaning: what messages call the group.
        group: what was given.
        mesh: the mesh that it must be of, or None for any.

    Raises:
        InputError: anything else; it tells the remedy.
    """
    return cast(Facets, _group(owner, meaning, group, mesh, Facets))


def cells_of(owner: str, meaning: str, group: Any, mesh: Mesh | None = None) -> Cells:
    """Return the cell group, of this mesh if one is given.

    Args:
        owner: who asks.
        meaning: what messages call the group.
        group: what was given.
        mesh: the mesh that it must be of, or None for any.

    Raises:
        InputError: anything else; it tells the remedy.
    """
    return cast(Cells, _group(owner, meaning, group, mesh, Cells))


def _group(owner: str, meaning: str, group: Any, mesh: Mesh | None, wanted: type[Group]) -> Group:
    """Return the group, if it is of the wanted kind and mesh.

    Args:
        owner: who asks.
        meaning: what messages call the group.
        group: what was given.
        mesh: the mesh that it must be of, or None for any.
        wanted: Facets or Cells.

    Raises:
        InputError: anything else; it tells the remedy.
    """
    kind = KINDS[wanted]
    if isinstance(group, wanted):
        if mesh is None or group.mesh is mesh:
            return group
        raise InputError(
            f"{owner}: {meaning} is the {kind} '{group.name}' of another mesh; give one of this "
            "mesh"
        )
    if isinstance(group, Group):
        raise InputError(
            f"{owner}: {meaning} is the {KINDS[type(group)]} '{group.name}'; give a {kind}"
        )
    if hasattr(group, "find") and hasattr(group, "indices"):
        raise InputError(
            f"{owner}: {meaning} is a DOLFINx MeshTags, with several values; give "
            f"fem.{wanted.__name__}.tagged(name, tags, value, mesh) with the value that is meant"
        )
    raise InputError(
        f"{owner}: {meaning} is {quote(group)}; give a {kind}, such as tags['name'] of "
        f"fem.read_mesh or fem.{wanted.__name__}(name, numbers, mesh)"
    )


def check_field(owner: str, meaning: str, value: Any) -> None:
    """Raise InputError unless it is a function or a vector of numbers.

    Size and NaN are told where it is used.

    Args:
        owner: who asks.
        meaning: what messages call the value.
        value: what was given.
    """
    if callable(value):
        function(owner, meaning, value, "give numbers, one per dimension, or a function")
        return
    remedy = "give numbers, one per dimension, or a function of points and time"
    for component in several(owner, meaning, value, remedy):
        if not isinstance(component, float):  # NaN too
            array(owner, f"a component of {meaning}", component, ())


def components_of(meaning: str, given: tuple[int, ...] | None, dimension: int) -> tuple[int, ...]:
    """Return the components that are given, all of them for None.

    Args:
        meaning: the beginning of messages.
        given: components, or None.
        dimension: d.

    Raises:
        InputError: one does not exist.
    """
    for c in given or ():
        if not 0 <= c < dimension:
            raise InputError(
                f"{meaning} component {c} does not exist: give numbers from 0 to {dimension - 1}"
            )
    return tuple(range(dimension) if given is None else given)


def check_components(owner: str, value: Any) -> None:
    """Raise InputError unless it is None or a tuple of whole numbers.

    Their range is told where they are used.
    """
    if value is None:
        return
    for component in several(owner, "components", value, "give a tuple, such as (0,), or None"):
        whole(owner, "a component", component)
