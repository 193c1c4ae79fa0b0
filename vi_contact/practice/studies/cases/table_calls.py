"""Take a table as a call.

It is read against the signature of the function it names, before anything is computed.

    [friction]
    type = "Coulomb"       Coulomb(mu=0.3)
    mu = 0.3

``read`` turns a value of the file into a node by the type hint of the parameter it is for, and
refuses what does not fit in one sentence with file, table and key. ``build(node, context)`` makes
the calls; the context supplies what no file holds: communicator, mesh, its groups, system;
excitations for what must know them. Nothing of the file is ever evaluated as code.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cached_property
from inspect import Parameter, signature
from typing import Any

from ....core.errors import InputError
from ....core.quantities import Quantity, read_quantities

Context = Mapping[str, Any]
Node = (
    Any  # what has been read: a Group or Call, a tuple or dict of nodes; all else stands for itself
)
GIVEN = ("mesh", "system", "excitations")  # parameters that the context supplies


@dataclass(frozen=True)
class Spot:
    """Say where in the file: str() is "[system.damping] alpha"."""

    file: str
    table: str = ""
    key: str = ""
    unit: str | None = None  # of the key, where it is known

    def __str__(self) -> str:
        return f"[{self.table}] {self.key}".strip() if self.table else f"[{self.key}]"

    def at(self, key: str, unit: str | None = None) -> "Spot":
        """Return the spot of a key of the table that is here."""
        return Spot(self.file, self._here(), key, unit)

    def entry(self, number: int) -> "Spot":
        """Return the spot of an entry of the list that is here, counted from 1."""
        return Spot(self.file, self.table, f"{self.key}[{number}]", self.unit)

    def _here(self) -> str:
        return f"{self.table}.{self.key}" if self.table and self.key else self.table or self.key

    def wrong(self, text: str) -> InputError:
        """Return the error of what is wrong here; ``text`` continues the sentence."""
        return InputError(f"{self.file}: {self} {text}")

    def inside(self, text: str) -> InputError:
        """Return the error of what is wrong with the table that is here."""
        return InputError(f"{self.file}: [{self._here()}] {text}")


@dataclass(frozen=True)
class Group:
    """Name a group of the mesh; ``alias``: another name that it goes by."""

    name: str
    kind: type
    spot: Spot
    alias: str = ""

    def build(self, context: Context) -> Any:
        """Return the group of the mesh."""
        try:
            found = context["tags"][self.name]
        except InputError as error:
            raise self.spot.wrong(f"is '{self.name}', but the {error}") from None
        if not isinstance(found, self.kind):
            raise self.spot.wrong(
                f"is '{self.name}', {GROUP[type(found).__name__]}: {self._remedy(found)}"
            )
        return replace(context["tags"][self.name], name=self.alias) if self.alias else found

    def _remedy(self, found: Any) -> str:
        """Give the other kind.

        Where a boundary was saved without the body it bounds, the remedy is to save the body too.
        """
        way = f"give the name of {GROUP[self.kind.__name__]}"
        dim = found.mesh.topology.dim
        if self.kind.__name__ == "Cells" or dim > 2:
            return way
        body = "Physical Volume" if dim == 2 else "Physical Surface"
        return (
            f"{way}, or, if it bounds the body, the mesh has no {dim + 1}D cells: add a {body} "
            "in Gmsh"
        )


GROUP = {"Facets": "a boundary group", "Cells": "a cell group"}


@dataclass(frozen=True)
class Callee:
    """Describe a function that tables may call.

    It has what the annotations of its parameters say, those it needs, and those that are supplied.
    """

    name: str
    function: Callable[..., Any]
    said: Mapping[str, Quantity]
    required: frozenset[str] = frozenset()
    given: tuple[str, ...] = ()

    @cached_property
    def hints(self) -> Mapping[str, Any]:
        """Return the types of its parameters."""
        return {key: one.kind for key, one in self.said.items()}

    def unit(self, key: str) -> str | None:
        """Return the unit of a parameter, as one types it; None where it has none."""
        found = self.said[key].unit
        return None if found is None else found.typed


def callee(
    function: Callable[..., Any],
    *,
    name: str = "",
    only: Sequence[str] = (),
    given: Sequence[str] = GIVEN,
) -> Callee:
    """Return how to call a function or class.

    ``only`` is what a file may give; parameters ``given`` are supplied.
    """
    plain_class = isinstance(function, type) and not is_dataclass(function)
    said = read_quantities(function.__init__ if plain_class else function)  # type: ignore[misc]
    found = signature(function).parameters
    parameters = {
        key: one
        for key, one in found.items()
        if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)
    }
    settable = [one for one in parameters if one not in given and (not only or one in only)]
    return Callee(
        name or getattr(function, "__name__", ""),
        function,
        {one: said.get(one, Quantity(Any)) for one in settable},
        frozenset(one for one in settable if parameters[one].default is Parameter.empty),
        tuple(one for one in parameters if one in given),
    )


@dataclass(frozen=True)
class Call:
    """Call a function; its InputErrors get the place in the file."""

    callee: Callee
    arguments: dict[str, Node]
    spot: Spot = field(compare=False)

    def build(self, context: Context) -> Any:
        """Return what the call makes."""
        lacking = [name for name in self.callee.given if name not in context]
        if lacking:
            raise self.spot.inside(
                f"{self.callee.name} needs the {lacking[0]}, still unknown here: give numbers"
            )
        supplied = {name: context[name] for name in self.callee.given}
        arguments = build(self.arguments, context)
        try:
            return self.callee.function(**supplied, **arguments)
        except InputError as error:
            raise self.spot.inside(f"{error}") from error


def needs_body(node: Node) -> bool:
    """Return whether groups of the mesh are named in it, or the assembled system is asked for."""
    return any(
        isinstance(one, Group) or (isinstance(one, Call) and "system" in one.callee.given)
        for one in nodes_in(node)
    )


def build(node: Node, context: Context) -> Any:
    """Return what a node makes."""
    if isinstance(node, Group | Call):
        return node.build(context)
    if isinstance(node, dict):
        return {name: build(one, context) for name, one in node.items()}
    return tuple(build(one, context) for one in node) if isinstance(node, tuple) else node


def nodes_in(node: Node) -> Iterator[Node]:
    """Yield the node and all nodes in it."""
    yield node
    inside = node.arguments if isinstance(node, Call) else node
    for one in (
        inside.values() if isinstance(inside, dict) else inside if isinstance(inside, tuple) else ()
    ):
        yield from nodes_in(one)
