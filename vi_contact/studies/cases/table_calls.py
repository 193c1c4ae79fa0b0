"""Take a table as a call: read it against the signature of the function it names, before anything is computed.

    [friction]
    type = "Coulomb"       Coulomb(mu=0.3)
    mu = 0.3

``read`` turns a value of the file into a node by the type hint of the parameter it is for, and refuses what does not
fit in one sentence with file, table and key. ``node.build(context)`` makes the calls; the context supplies what no file
holds: communicator, mesh, its groups, system; excitations, time step and scheme for what must know them. Nothing of the
file is ever evaluated as code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from inspect import Parameter, signature
from typing import Any, Protocol, get_type_hints

from ...core.errors import InputError

Context = Mapping[str, Any]
GIVEN = ("comm", "mesh", "system", "excitations", "run_dt")  # parameters that the context supplies


class Node(Protocol):
    """Hold a value that has been read; ``build`` makes it."""

    def build(self, context: Context) -> Any: ...


@dataclass(frozen=True)
class Spot:
    """Say where in the file: str() is "[system.damping] alpha"."""

    file: str
    table: str = ""
    key: str = ""

    def __str__(self) -> str:
        return f"[{self.table}] {self.key}".strip() if self.table else f"[{self.key}]"

    def at(self, key: str) -> Spot:
        """Return the spot of a key of the table that is here."""
        return Spot(self.file, self._here(), key)

    def entry(self, number: int) -> Spot:
        """Return the spot of an entry of the list that is here, counted from 1."""
        return Spot(self.file, self.table, f"{self.key}[{number}]")

    def _here(self) -> str:
        return f"{self.table}.{self.key}" if self.table and self.key else self.table or self.key

    def wrong(self, text: str) -> InputError:
        """Return the error of what is wrong here; ``text`` continues the sentence."""
        return InputError(f"{self.file}: {self} {text}")

    def inside(self, text: str) -> InputError:
        """Return the error of what is wrong with the table that is here."""
        return InputError(f"{self.file}: [{self._here()}] {text}")


@dataclass(frozen=True)
class Value:
    """Hold a plain value."""

    value: Any

    def build(self, context: Context) -> Any:
        return self.value


@dataclass(frozen=True)
class Group:
    """Name a group of the mesh."""

    name: str
    kind: type
    spot: Spot

    def build(self, context: Context) -> Any:
        try:
            found = context["tags"][self.name]
        except InputError as error:
            raise self.spot.wrong(f"is '{self.name}', but the {error}") from None
        if not isinstance(found, self.kind):
            raise self.spot.wrong(f"is '{self.name}', {GROUP[type(found).__name__]}: {self._remedy(found)}")
        return found

    def _remedy(self, found: Any) -> str:
        """Give the other kind; or, where a boundary was saved without the body it bounds, save the body too."""
        way = f"give the name of {GROUP[self.kind.__name__]}"
        dim = found.mesh.topology.dim
        if self.kind.__name__ == "Cells" or dim > 2:
            return way
        body = "Physical Volume" if dim == 2 else "Physical Surface"
        return f"{way}, or, if it bounds the body, the mesh has no {dim + 1}D cells: add a {body} in Gmsh"


GROUP = {"Facets": "a boundary group", "Cells": "a cell group"}


@dataclass(frozen=True)
class Items:
    """Hold a list; it becomes a tuple."""

    items: tuple[Node, ...]

    def build(self, context: Context) -> Any:
        return tuple(one.build(context) for one in self.items)


@dataclass(frozen=True)
class Named:
    """Hold a table of names."""

    items: Mapping[str, Node]

    def build(self, context: Context) -> Any:
        return {name: one.build(context) for name, one in self.items.items()}


@dataclass(frozen=True)
class Callee:
    """Describe a function that tables may call: hints of its parameters, which it needs, which are supplied."""

    name: str
    function: Callable[..., Any]
    hints: Mapping[str, Any]
    required: frozenset[str] = frozenset()
    given: tuple[str, ...] = ()


def callee(
    function: Callable[..., Any], *, name: str = "", only: Sequence[str] = (), given: Sequence[str] = GIVEN
) -> Callee:
    """Return how to call a function or class; ``only``: what a file may give; parameters ``given`` are supplied."""
    plain_class = isinstance(function, type) and not is_dataclass(function)
    hints = get_type_hints(function.__init__ if plain_class else function)  # type: ignore[misc]
    found = signature(function).parameters
    parameters = {key: one for key, one in found.items() if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)}
    settable = [one for one in parameters if one not in given and (not only or one in only)]
    return Callee(
        name or getattr(function, "__name__", ""),
        function,
        {one: hints.get(one, Any) for one in settable},
        frozenset(one for one in settable if parameters[one].default is Parameter.empty),
        tuple(one for one in parameters if one in given),
    )


@dataclass(frozen=True)
class Call:
    """Call a function; its InputErrors get the place in the file."""

    callee: Callee
    arguments: Mapping[str, Node]
    spot: Spot = field(compare=False)

    def build(self, context: Context) -> Any:
        lacking = [name for name in self.callee.given if name not in context]
        if lacking:
            raise self.spot.inside(f"{self.callee.name} asks for the {lacking[0]}, not known yet: give numbers")
        supplied = {name: context[name] for name in self.callee.given}
        arguments = {name: node.build(context) for name, node in self.arguments.items()}
        try:
            return self.callee.function(**supplied, **arguments)
        except InputError as error:
            raise self.spot.inside(f"{error}") from error


def needs_body(node: Node) -> bool:
    """Return whether groups of the mesh are named in it, or the assembled system is asked for."""
    return any(isinstance(one, Group) or (isinstance(one, Call) and "system" in one.callee.given)
               for one in nodes_in(node))


def nodes_in(node: Node) -> Iterator[Node]:
    """Yield the node and all nodes in it."""
    yield node
    inside: Iterable[Node] = ()
    if isinstance(node, Call):
        inside = node.arguments.values()
    elif isinstance(node, Items):
        inside = node.items
    elif isinstance(node, Named):
        inside = node.items.values()
    for one in inside:
        yield from nodes_in(one)
