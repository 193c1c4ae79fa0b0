"""Describe prescribed displacements, tractions and body forces (boundary method, eqs. 3, 4, 6).

Fields are given at points: a callable takes points (k, d) [m] and the time [s] and returns values
(k, d). They are interpolated at the nodes and then integrated exactly, so a load costs one sparse
product a step.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import ufl
from dolfinx.mesh import Mesh

from ...core.algebra import Array, Comm, Indices
from ...core.checks import explain_error, function, number, optional, quote, refuse, several
from ...core.errors import InputError
from ...core.quantities import Unit
from .. import compat
from ..mesh.group_checks import (
    cells_of,
    check_components,
    check_field,
    components_of,
    facets_of,
)
from ..mesh.tagged_mesh import Cells, Facets

Field = Callable[[Array, float], Array]
Value = tuple[float, ...] | Field


def evaluate(name: str, value: Value, points: Array, t: float, comm: Comm) -> Array:
    """Return the values (k, d) at this rank's points. Collective.

    Args:
        name: what messages call the value.
        value: (d,) numbers, or a function of points and time.
        points: (k, d) of this rank [m].
        t: time [s].
        comm: the ranks.

    Raises:
        InputError: on all ranks, NaN, other shapes, and what a function of the user's raises.
    """
    result, defect = evaluate_here(name, value, points, t)
    refuse([defect], comm)
    return result


def evaluate_here(name: str, value: Value, points: Array, t: float) -> tuple[Array, str]:
    """Return the values at points, and what is wrong with them instead of raising it.

    Args:
        name: what messages call the value.
        value: (d,) numbers, or a function of points and time.
        points: (k, d) [m].
        t: time [s].

    Returns:
        (k, d), zeros where something is wrong, and a sentence, empty where nothing is.
    """
    if len(points) == 0:
        return np.zeros_like(points), ""  # users' functions need not cope with no points
    try:
        result = (
            np.asarray(value(points, t))
            if callable(value)
            else np.tile(np.asarray(value), (len(points), 1))
        )
    except Exception as error:
        # of a user's function, at the points of one rank: the others must not wait for it
        return np.zeros_like(points), explain_error(f"{name} at t = {t:g} s", error)
    if result.dtype.kind not in "iuf":
        defect = f"{name} returned {quote(result)}: return real numbers"
    elif result.shape != points.shape:
        shape = f"shape {result.shape} for {len(points)} points"
        defect = f"{name} returned {shape}: return {points.shape[1]} components per point"
    elif not np.all(np.isfinite(result)):
        defect = (
            f"{name} contains NaN or infinite values at t = {t:g} s: check its function or data"
        )
    else:
        return result.astype(float, copy=False), ""
    return np.zeros_like(points), defect


def _zero(points: Array, t: float) -> Array:
    """Return no motion at points (k, d) at any time."""
    return np.zeros_like(points)


@dataclass(frozen=True)
class _Scaled:
    """Multiply a field constant in time by a function of the time.

    Attributes:
        value: (d,) numbers, or a function of points, asked at t = 0.
        factor: f(t).
    """

    value: Value
    factor: Callable[[float], float]

    def __call__(self, points: Array, t: float) -> Array:
        """Return f(t) times the field at points (k, d)."""
        value = self.value
        field = value(points, 0.0) if callable(value) else np.tile(value, (len(points), 1))
        return float(self.factor(t)) * np.asarray(field)


@dataclass(frozen=True)
class Prescribed:
    """Prescribe u_i = U_i(x, t) on facets, with the velocity and acceleration of the same motion.

    The mass and damping of the boundary nodes enter the equations, so all three time functions are
    needed; left out they are zero (a clamped part, or a displacement constant in time).

    Args:
        facets: the part of the boundary.
        displacement: U, (d,) numbers or points (k, d) [m] and t [s] -> (k, d).
        velocity: the like, U'.
        acceleration: the like, U''.
        components: which displacement components are prescribed, all when None; the others stay
            free (rollers).
        history: a factor f(t) of a displacement constant in time, U = f(t) U_0(x), as that of
            loads. One function is enough for load steps, which ask for no rates; for motion in time
            give three, (f, f', f''), which make U' = f' U_0 and U'' = f'' U_0 as well. A
            displacement that is a function is then asked once, at t = 0.
    """

    facets: Facets
    displacement: Annotated[Value, Unit("m")] = _zero
    velocity: Annotated[Value, Unit("m/s")] = _zero
    acceleration: Annotated[Value, Unit("m/s²")] = _zero
    components: tuple[int, ...] | None = None
    history: Callable[[float], float] | tuple[Callable[[float], float], ...] | None = None

    def __post_init__(self) -> None:
        facets_of("Prescribed", "facets", self.facets)
        for name in ("displacement", "velocity", "acceleration"):
            check_field("Prescribed", name, getattr(self, name))
        check_components("Prescribed", self.components)
        if self.history is not None:
            self._check_history()

    def _check_history(self) -> None:
        """Raise InputError for a history that is no function or three, or has nothing to turn."""
        remedy = "give a function f of the time [s], or three, (f, f', f'')"
        for factor in self._list_factors(remedy):
            function("Prescribed", "history", factor, remedy)
        if self.displacement is _zero:
            raise InputError(
                "Prescribed: history is a factor of the displacement, which is left out; give it"
            )
        if self.velocity is not _zero or self.acceleration is not _zero:
            raise InputError(
                "Prescribed has a history, and a velocity or an acceleration of its own; give "
                "history=(f, f', f'') in their place"
            )

    def _list_factors(self, remedy: str) -> tuple[Any, ...]:
        """Return f, or f, f' and f''; InputError, which ends with the remedy, for another number.

        Args:
            remedy: what to give instead.
        """
        if callable(self.history):
            return (self.history,)
        factors = several("Prescribed", "history", self.history, remedy)
        if len(factors) != 3:
            raise InputError(f"Prescribed: history has {len(factors)} members; {remedy}")
        return factors

    @property
    def name(self) -> str:
        """Return the name of the facets."""
        return self.facets.name

    @property
    def motions(self) -> tuple[Value, Value, Value]:
        """Return the motion and its rates (U, U', U'')."""
        if self.history is None:
            return self.displacement, self.velocity, self.acceleration
        factors = self._list_factors("give three")
        motions: list[Value] = [_Scaled(self.displacement, factor) for factor in factors]
        if len(motions) == 1:  # load steps ask for no rates
            motions += [_zero, _zero]
        motion, velocity, acceleration = motions
        return motion, velocity, acceleration

    @property
    def moves(self) -> bool:
        """Return whether it moves: False for a clamped part."""
        return any(value is not _zero for value in self.motions)

    def support(self, blocks: Indices, dimension: int) -> "Support":
        """Return what is held of a displacement space.

        Args:
            blocks: (k,) owned blocks of unknowns on the facets.
            dimension: d, components of a block.

        Raises:
            InputError: a component that does not exist.
        """
        held = components_of("prescribed", self.components, dimension)
        return Support(self, (blocks[:, None], held), self.moves)

    def at(
        self, points: Array, places: tuple[Any, Any], t: float, derivative: int
    ) -> tuple[Any, str]:
        """Return values of the motion or a rate at the places, and what is wrong with them.

        Args:
            points: (owned nodes, d) coordinates [m].
            places: owned blocks (k, 1) and components that are held.
            t: time [s].
            derivative: 0 for U, 1 for U', 2 for U''.

        Returns:
            values (k, components), and a sentence, empty where nothing is wrong.
        """
        name = f"prescribed motion on '{self.facets.name}'"
        motion, defect = evaluate_here(name, self.motions[derivative], points[places[0][:, 0]], t)
        return motion[:, places[1]], defect

    def on_facets(self, space: Any, facets: Any) -> list[tuple[Any, Any]]:
        """Return which of the facets are held, in which components."""
        held = components_of("prescribed", self.components, space.dimension)
        return [(np.intersect1d(facets, self.facets.indices), held)]

    @property
    def companions(self) -> tuple[Any, ...]:
        """Return the motions that are marched beside the run.

        They are objects whose methods are given, as ``BaseMotion``.
        """
        # each once: the three functions are usually methods of one object
        owners = {}
        for value in self.motions:
            owner = getattr(value, "__self__", None)
            owners[id(owner)] = owner
        companions: list[Any] = []
        for owner in owners.values():
            companions += getattr(owner, "companions", ())
        return tuple(companions)

    def same_motion(self, other: "Prescribed") -> bool:
        """Return whether both say the same of the components that both prescribe."""
        mine = self.components
        theirs = other.components
        if mine is not None and theirs is not None and not set(mine) & set(theirs):
            return True
        return all(map(_agree, self.motions, other.motions))


@dataclass(frozen=True, eq=False)
class Support:
    """Hold a condition on displacements, and which components of nodes it holds on this rank.

    Attributes:
        condition: a ``Prescribed``, or ``GivenValues`` of a dirichletbc.
        places: (owned blocks, components), indices of an array of nodal values.
        moves: whether it moves what it holds.
    """

    condition: Any
    places: tuple[Any, Any]
    moves: bool

    def at(self, points: Array, t: float, derivative: int) -> tuple[Any, str]:
        """Return values of the motion or a rate at the places, and what is wrong with them.

        Args:
            points: (owned nodes, d) coordinates [m].
            t: time [s].
            derivative: 0 for U, 1 for U', 2 for U''.

        Returns:
            values at the places, and a sentence, empty where nothing is wrong.
        """
        return self.condition.at(points, self.places, t, derivative)


def _agree(value: Value, other: Value) -> bool:
    """Say whether two values are one function, or equal constants; one not given is zero."""
    if callable(value) or callable(other):
        return bool(value == other) or (_at_rest(value) and _at_rest(other))
    return np.array_equal(value, other)


def _at_rest(value: Value) -> bool:
    """Say whether a value is zero at all times."""
    return value is _zero or (not callable(value) and not np.any(value))


class ActingLoad:
    """Say where and how a load acts in forms; by default in the whole body, and all of it.

    The load of nodal values g is ∫ acting(g)·v over ``measure``.
    """

    value: Value
    history: Callable[[float], float] | None

    def __post_init__(self) -> None:
        owner = type(self).__name__
        check_field(owner, "value", self.value)
        optional(
            function, owner, "history", self.history, "give a function of the time [s], or None"
        )

    @property
    def is_constant(self) -> bool:
        """Return whether one assembly serves all times."""
        return self.history is not None or not callable(self.value)

    def measure(self, mesh: Mesh) -> Any:
        """Return the measure of integration over the part on which the load acts."""
        return ufl.dx

    def acting(self, g: Any, mesh: Mesh) -> Any:
        """Return the part that acts of a load with the values ``g``."""
        return g


@dataclass(frozen=True)
class Traction(ActingLoad):
    """Apply the traction S_i = F_i(x, t) [Pa] on facets.

    With a history, or with a tuple, the load is assembled once; a callable without history is
    evaluated every step.

    Args:
        facets: the part of the boundary.
        value: (d,) numbers, or a function of points (k, d) [m] and the time [s] -> (k, d).
        history: factor f(t) of the value at t = 0 s.
    """

    facets: Facets
    value: Annotated[Value, Unit("Pa")]
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        facets_of(type(self).__name__, "facets", self.facets)
        super().__post_init__()

    def measure(self, mesh: Mesh) -> Any:
        """Return the measure of the facets."""
        return compat.measure(mesh, mesh.topology.dim - 1, self.facets.indices)


@dataclass(frozen=True)
class TangentialTraction(Traction):
    """Apply the tangential traction S_T = C_T(x, t) on the contact boundary.

    It is ``value`` less its normal part.
    """

    def acting(self, g: Any, mesh: Mesh) -> Any:
        """Return the traction less its normal part."""
        n = ufl.FacetNormal(mesh)
        return g - ufl.dot(g, n) * n


@dataclass(frozen=True)
class Pressure(Traction):
    """Apply S = -p(x, t) n [Pa], a pressure p > 0 against the outward normal n of the facets.

    Such are water, uplift in a joint. p is interpolated at nodes: resultants of one that is linear
    between them are exact, so let a node lie at the water level.

    Args:
        facets: the part of the boundary.
        value: a number, or a function of points (k, d) [m] and the time [s] -> (k,), asked at all
            nodes of the body; it is kept as the first component of a vector field.
        history: as of ``Traction``.
    """

    # what is given
    value: Annotated[  # type: ignore[assignment]
        float | Callable[[Array, float], Array], Unit("Pa")
    ]

    def __post_init__(self) -> None:
        given: Any = self.value
        if callable(given):
            function("Pressure", "value", given, "give a number or a function of points and time")

            def field(points: Array, t: float) -> Array:
                pressures = np.broadcast_to(given(points, t), len(points))
                return np.multiply.outer(pressures, np.eye(points.shape[1])[0])

            object.__setattr__(self, "value", field)
        else:
            d = facets_of("Pressure", "facets", self.facets).mesh.geometry.dim
            pressure = number("Pressure", "value", given, unit="Pa")
            object.__setattr__(self, "value", (pressure, *[0.0] * (d - 1)))
        super().__post_init__()

    def acting(self, g: Any, mesh: Mesh) -> Any:
        """Return the traction -p n."""
        return -g[0] * ufl.FacetNormal(mesh)


@dataclass(frozen=True)
class BodyForce(ActingLoad):
    """Apply a volume force f_i(x, t) [N/m³].

    The weight of a material is BodyForce((0, -rho * 9.80665)).

    Args:
        value: (d,) numbers, or a function of points (k, d) [m] and the time [s] -> (k, d).
        history: factor f(t) of the value at t = 0 s.
        cells: the group of cells on which it acts; all of the mesh when None.
    """

    value: Annotated[Value, Unit("N/m³")]
    history: Callable[[float], float] | None = None
    cells: Cells | None = None

    def __post_init__(self) -> None:
        optional(cells_of, "BodyForce", "cells", self.cells)
        super().__post_init__()

    def measure(self, mesh: Mesh) -> Any:
        """Return the measure of the cells."""
        if self.cells is None:
            return ufl.dx
        cells = cells_of("BodyForce", "cells", self.cells, mesh)
        return compat.measure(mesh, mesh.topology.dim, cells.indices)
