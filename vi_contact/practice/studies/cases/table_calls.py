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
from .sentences import write_for_case_files

Context = Mapping[str, Any]
# What has been read: a Group or Call, a tuple or dict of nodes; all else stands for itself.
Node = Any
SUPPLIED = ("mesh", "system", "excitations")  # parameters that the context supplies


@dataclass(frozen=True)
class Spot:
    """Say where in the file: str() is "[system.damping] alpha".

    Attributes:
        file: the path, or what else the sentence begins with.
        table: the path of the table, its names joined by dots.
        key: the key in this table.
        unit: of the key, where it is known.
    """

    file: str
    table: str = ""
    key: str = ""
    unit: str | None = None

    def __str__(self) -> str:
        return f"[{self.table}] {self.key}".strip() if self.table else f"[{self.key}]"

    def go_to_key(self, key: str, unit: str | None = None) -> "Spot":
        """Return the spot of a key of the table that is here."""
        return Spot(self.file, self._join_names(), key, unit)

    def go_to_entry(self, number: int) -> "Spot":
        """Return the spot of an entry of the list that is here, counted from 1."""
        return Spot(self.file, self.table, f"{self.key}[{number}]", self.unit)

    def _join_names(self) -> str:
        """Return the path of the table that is here, "system.damping"."""
        return ".".join(name for name in (self.table, self.key) if name)

    def make_error(self, text: str) -> InputError:
        """Return the error of what is wrong here; ``text`` continues the sentence."""
        return InputError(f"{self.file}: {self} {text}")

    def make_table_error(self, text: str) -> InputError:
        """Return the error of what is wrong with the table that is here."""
        return InputError(f"{self.file}: [{self._join_names()}] {text}")


@dataclass(frozen=True)
class Group:
    """Name a group of the mesh.

    Attributes:
        name: as the mesh has it.
        kind: ``Facets`` or ``Cells``.
        spot: where the file names it.
        alias: another name that it goes by.
    """

    name: str
    kind: type
    spot: Spot
    alias: str = ""

    def build(self, context: Context) -> Any:
        """Return the group of the mesh."""
        try:
            group = context["tags"][self.name]
        except InputError as error:
            raise self.spot.make_error(f"is '{self.name}', but the {error}") from None
        fits = isinstance(group, self.kind)
        if not fits:
            raise self.spot.make_error(
                f"is '{self.name}', {GROUP[type(group).__name__]}: {self._propose_remedy(group)}"
            )
        return replace(group, name=self.alias) if self.alias else group

    def _propose_remedy(self, group: Any) -> str:
        """Return the remedy for a group of the other kind.

        Where a boundary was saved without the body it bounds, the remedy is to save the body too.
        """
        remedy = f"give the name of {GROUP[self.kind.__name__]}"
        dim = group.mesh.topology.dim
        if self.kind.__name__ == "Cells" or dim > 2:
            return remedy
        body = "Physical Volume" if dim == 2 else "Physical Surface"
        return (
            f"{remedy}, or, if it bounds the body, the mesh has no {dim + 1}D cells: add a {body} "
            "in Gmsh"
        )


GROUP = {"Facets": "a boundary group", "Cells": "a cell group"}


@dataclass(frozen=True)
class Callee:
    """Describe a function that tables may call.

    Attributes:
        name: the word of the file that calls it.
        function: what is called.
        quantities: parameter that a file may give -> what its annotation says.
        required: parameters that a file must give.
        supplied: parameters that the context supplies.
        parameters: key of the file -> parameter, where their names differ.
    """

    name: str
    function: Callable[..., Any]
    quantities: Mapping[str, Quantity]
    required: frozenset[str] = frozenset()
    supplied: tuple[str, ...] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def hints(self) -> Mapping[str, Any]:
        """Return the types of its parameters."""
        return {key: quantity.kind for key, quantity in self.quantities.items()}

    def unit(self, key: str) -> str | None:
        """Return the unit of a parameter, as one types it; None where it has none."""
        unit = self.quantities[key].unit
        return None if unit is None else unit.typed


def make_callee(
    function: Callable[..., Any],
    *,
    name: str = "",
    only: Sequence[str] = (),
    supplied: Sequence[str] = SUPPLIED,
    keys: Mapping[str, str] | None = None,
) -> Callee:
    """Return how to call a function or class.

    Args:
        function: what a table calls.
        name: the word of the file for it; "" for its own name.
        only: the parameters that a file may give; empty for all.
        supplied: the parameters that the context supplies, if the function has them.
        keys: parameter -> key of the file, where the file has another word.
    """
    # A plain class has its annotations at __init__, a dataclass at its fields.
    plain_class = isinstance(function, type) and not is_dataclass(function)
    annotated: Any = function
    if plain_class:
        annotated = annotated.__init__
    quantity_of = read_quantities(annotated)

    # Parameters that collect others, such as *args, have no key.
    collecting = (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
    parameters = {
        key: parameter
        for key, parameter in signature(function).parameters.items()
        if parameter.kind not in collecting
    }
    settable = [key for key in parameters if key not in supplied and (not only or key in only)]
    words = keys or {}
    needed = [key for key in settable if parameters[key].default is Parameter.empty]
    return Callee(
        name or getattr(function, "__name__", ""),
        function,
        {words.get(key, key): quantity_of.get(key, Quantity(Any)) for key in settable},
        frozenset(words.get(key, key) for key in needed),
        tuple(key for key in parameters if key in supplied),
        {word: key for key, word in words.items()},
    )


@dataclass(frozen=True)
class Call:
    """Call a function; its InputErrors get the place in the file."""

    callee: Callee
    arguments: dict[str, Node]
    spot: Spot = field(compare=False)

    def build(self, context: Context) -> Any:
        """Return what the call makes."""
        lacking = [name for name in self.callee.supplied if name not in context]
        if lacking:
            raise self.spot.make_table_error(
                f"{self.callee.name} needs the {lacking[0]}, still unknown here: give numbers"
            )
        supplied = {name: context[name] for name in self.callee.supplied}
        parameters = self.callee.parameters
        arguments = {
            parameters.get(key, key): build(value, context) for key, value in self.arguments.items()
        }
        try:
            return self.callee.function(**supplied, **arguments)
        except InputError as error:
            raise self.spot.make_table_error(write_for_case_files(str(error))) from error


def needs_body(node: Node) -> bool:
    """Return whether groups of the mesh are named in it, or the assembled system is asked for."""
    return any(
        isinstance(one, Group) or (isinstance(one, Call) and "system" in one.callee.supplied)
        for one in walk_nodes(node)
    )


def build(node: Node, context: Context) -> Any:
    """Return what a node makes."""
    if isinstance(node, Group | Call):
        return node.build(context)
    if isinstance(node, dict):
        return {name: build(value, context) for name, value in node.items()}
    if isinstance(node, tuple):
        return tuple(build(entry, context) for entry in node)
    return node


def list_calls(node: Node) -> list[Call]:
    """Return the calls that a table, or an array of tables, makes itself; those in them not."""
    entries = node if isinstance(node, tuple) else (node,)
    return [entry for entry in entries if isinstance(entry, Call)]


def walk_nodes(node: Node) -> Iterator[Node]:
    """Yield the node and all nodes in it."""
    yield node
    inside = node.arguments if isinstance(node, Call) else node
    if isinstance(inside, dict):
        inside = tuple(inside.values())
    if isinstance(inside, tuple):
        for inner in inside:
            yield from walk_nodes(inner)
