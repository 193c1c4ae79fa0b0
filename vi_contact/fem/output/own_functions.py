"""Take the user's DOLFINx Functions into the frames of a run."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, on_first
from ...core.checks import provides
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import State
from .. import compat
from ..body.space import FemSpace, space_of

REMEDY = (
    "give a DOLFINx Function of a Lagrange space on the mesh of the body, or of one that is "
    "constant in each cell"
)


@dataclass(frozen=True)
class Kind:
    """Say what a Function is.

    Attributes:
        in_cells: whether it has a value in each cell; else at each node.
        shape: () of a number, (d,) of a vector, (d, d) of a tensor.
    """

    in_cells: bool
    shape: tuple[int, ...]

    @property
    def components(self) -> tuple[int, ...]:
        """Return the shape of a row in the file: a vector has three components, a tensor nine."""
        return ((), (3,), (9,))[len(self.shape)]


class OwnFunctions:
    """Hold the user's Functions of a run, or functions of its state that return them.

    Attributes:
        names: of all.
        kinds: name -> what it is; of a function of the state once it has returned something.
    """

    def __init__(self, owner: str, problem: ContactProblem, given: Mapping[str, Any]) -> None:
        """Look at the Functions. Collective.

        Args:
            owner: the beginning of messages.
            problem: that of the run, on whose mesh they are.
            given: name -> Function, or a function of a state that returns one.

        Raises:
            InputError: of another mesh, or of a space that frames cannot hold.
        """
        self._space: FemSpace = space_of(owner, problem.system)
        self._owner = owner
        self._given = dict(given)
        self._places: dict[str, tuple[Any, Indices]] = {}
        self.names = list(given)
        self.kinds: dict[str, Kind] = {}
        for name, function in given.items():
            if hasattr(function, "function_space"):
                self.kinds[name] = _find_kind(f"{owner}: '{name}'", function, self._space)

    def gather_values(self, state: State) -> dict[str, Array]:
        """Return the values of all on rank 0, in the order of the input mesh. Collective."""
        rows = {}
        for name, given in self._given.items():
            function = given
            if callable(given) and not hasattr(given, "function_space"):
                function = given(state)
            rows[name] = self._gather_rows(name, function)
        return rows

    def _gather_rows(self, name: str, function: Any) -> Array:
        """Return the rows of a Function on rank 0, (nodes or cells, …). Collective.

        Args:
            name: in the frames.
            function: what the user gave, or what the user's function returned.
        """
        owner = f"{self._owner}: '{name}'"
        provides(owner, "it", function, ("function_space", "x"), REMEDY)
        V = function.function_space
        kind = _find_kind(owner, function, self._space)
        if self.kinds.setdefault(name, kind) != kind:
            raise InputError(f"{owner} is of another shape or space than in the first frame")

        # Values at nodes are those of the Function's own interpolation; those of cells stay as they
        # are.
        space = self._space
        blocks: Any
        if kind.in_cells:
            count = space.mesh.topology.index_map(space.mesh.topology.dim).size_local
            blocks = compat.cell_blocks(V)[:count, 0]
            numbers = compat.cell_numbers(space.mesh)
        else:
            if name not in self._places:
                W = compat.lagrange(space.mesh, space.degree, kind.shape)
                block = np.zeros(len(space.node_of_block), dtype=np.int64)
                block[compat.cell_blocks(space.V)] = compat.cell_blocks(W)
                self._places[name] = (compat.function(W), block[: len(space.nodes)])
            nodal, blocks = self._places[name]
            nodal.interpolate(function)
            function = nodal
            numbers = space.nodes
        size = int(np.prod(kind.shape, dtype=int))
        values = function.x.array.reshape(-1, size)[blocks]
        return _pad(on_first(space.comm, numbers, values), kind)


def _find_kind(owner: str, function: Any, space: FemSpace) -> Kind:
    """Return what a Function is.

    Args:
        owner: the beginning of messages.
        function: a DOLFINx Function.
        space: that of the body.

    Raises:
        InputError: on another mesh, or of a space that frames cannot hold.
    """
    V = function.function_space
    shape = tuple(function.ufl_shape)
    if not compat.is_on(V, space.mesh):
        raise InputError(f"{owner} is on another mesh; {REMEDY}")
    d = space.dimension
    if shape not in ((), (d,), (d, d)) or np.iscomplexobj(function.x.array):
        raise InputError(
            f"{owner} has values of shape {shape}; give real numbers, vectors or tensors of the "
            f"body's {d} axes"
        )
    size = int(np.prod(shape, dtype=int))
    if not compat.nodal(V) or V.dofmap.index_map_bs != size or len(V.component()):
        raise InputError(f"{owner} is of the space {V.ufl_element()}; {REMEDY}")
    in_cells = compat.cell_blocks(V).shape[1] == 1
    if not in_cells and not compat.continuous(V):
        raise InputError(f"{owner} jumps between cells and changes in them; {REMEDY}")
    return Kind(in_cells, shape)


def _pad(values: Array, kind: Kind) -> Array:
    """Return rows with zeros for the missing axes: (k,) numbers, (k, 3) vectors, (k, 9) tensors."""
    k = len(values)
    if not kind.shape:
        return values[:, 0]
    rows = values.reshape(k, *kind.shape)
    padded = np.zeros((k, *(3 for _ in kind.shape)))
    padded[(slice(None), *(slice(n) for n in kind.shape))] = rows
    return padded.reshape(k, *kind.components)
