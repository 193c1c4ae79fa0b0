"""Let the cells of a body yield: stresses, stored energy and tangents at points of integration.

    p(u)·v = ∫ sigma : eps(v),    sigma = the law's, after the way Δeps = eps(u) - eps(u_0)

u_0 is where the body stands. What its points remember there is never written to: asking for another
u begins from it anew, so that a step that is thrown away leaves nothing behind. ``remember`` says
what the points know at u, and ``go_on`` makes the force of a body that stands there.

Tangents of laws whose flow is not along the normal of the yield surface (psi < phi) are not
symmetric. Beside contact the matrix is made of their symmetric part: it only leads the iterations
of a step, whose answer is certified without it, and all solvers for symmetric matrices stay. A body
without contact takes the whole tangent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, Matrix, freeze, total
from ...core.checks import describe_point, on_all, refuse
from ...core.internal import MATERIAL
from ...laws.mandel import PAIRS, ROOT, norm
from ...laws.materials import LinearElastic
from ...laws.yielding import ROUND_OFF, PointState, YieldingMaterial, equivalent_stress
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra
from .space import FemSpace
from .strain_points import StrainPoints, find_known

KEPT = 3  # displacements whose stresses are remembered: the end of a step is asked for repeatedly
ROUNDED = 1e-10  # of the strain: a plastic one that is the rounding of many steps
TENSION = "give a stress that the material can carry, or a stronger material"


@dataclass(frozen=True, eq=False)
class Part:
    """Hold the owned cells of one material.

    Attributes:
        name: how the names of its arrays begin in the memory of a state.
        law: the material.
        cells: (k,) the owned cells, counted from 0 on this rank.
        points: (k each,) their points, among all of this rank.
    """

    name: str
    law: YieldingMaterial
    cells: Indices
    points: Indices


@dataclass(frozen=True, eq=False)
class Reached:
    """Hold what the points know at a displacement.

    Attributes:
        u: the displacement (n,) [m].
        way: Δeps (points, n) from where the body stands.
        states: of the points of each part.
        sigma: (points, n) [Pa].
    """

    u: Array
    way: Array
    states: Sequence[PointState]
    sigma: Array


class YieldingForce:
    """Hold the internal force of a body that stands somewhere (``core.internal``)."""

    def __init__(
        self,
        space: FemSpace,
        points: StrainPoints,
        parts: Sequence[Part],
        starts: Sequence[PointState],
    ) -> None:
        """Stand at no displacement.

        Args:
            space: the body's unknowns.
            points: of integration.
            parts: of the body, which cover its owned cells once.
            starts: state of the points of each part.
        """
        self._space = space
        self._points = points
        self._parts = parts
        self._virgin = starts
        self._states = starts
        self._u = np.zeros(len(space.ids))
        self._known: list[Reached] = []
        self._algebra = PetscAlgebra(space.comm.mpi)

    # Where it stands
    # ----------------------------------------------------------------------------------------------

    def go_on(self, memory: Mapping[str, Array], u: Array) -> "YieldingForce":
        """Return the force of steps from a state; of a new body where it remembers nothing.

        Args:
            memory: of the state.
            u: displacement (n,) [m] of the state.
        """
        known = any(name.startswith(MATERIAL) for name in memory)
        other = YieldingForce(self._space, self._points, self._parts, self._virgin)
        if not known:
            return other
        other._u = np.array(u)
        other._states = [
            {name: self._by_points(memory[f"{part.name}{name}"]) for name in start}
            for part, start in zip(self._parts, self._virgin, strict=True)
        ]
        return other

    def remember(self, u: Array) -> Mapping[str, Array]:
        """Return the memory at u: arrays (owned cells of a part, points of a cell, …)."""
        memory: dict[str, Array] = {}
        each = self._points.each
        for part, state in zip(self._parts, self._reach(u).states, strict=True):
            for name, values in state.items():
                rows = values.reshape(len(part.cells), each, *values.shape[1:])
                memory[f"{part.name}{name}"] = freeze(rows)
        return memory

    def _by_points(self, rows: Array) -> Array:
        """Return the rows (points, …) of an array (cells, points of a cell, …)."""
        return rows.reshape(-1, *rows.shape[2:])

    def take_over(self, before: "YieldingForce", memory: Mapping[str, Array]) -> dict[str, Array]:
        """Return the memory of a body of other present cells, where those that stay go on.

        New cells have never yielded, and are free of stress.

        Args:
            before: the force of the body that has the memory.
            memory: of its state.
        """
        taken: dict[str, Array] = {}
        each = self._points.each
        for part, old in zip(self._parts, before._parts, strict=True):
            q = len(part.cells) * each
            virgin = part.law.start(np.zeros((q, self._points.components)))
            stay = np.isin(part.cells, old.cells)
            rows = np.searchsorted(old.cells, part.cells[stay])
            for name, values in virgin.items():
                new = values.reshape(len(part.cells), each, *values.shape[1:])
                new[stay] = memory[f"{old.name}{name}"][rows]
                taken[f"{part.name}{name}"] = freeze(new)
        return taken

    def find_cells(self, name: str) -> Indices:
        """Return the numbers (k,) of the owned cells of an array of the memory."""
        cells = self._cells_of(name)
        return compat.cell_numbers(self._space.mesh)[cells]

    def find_middles(self, name: str) -> Array:
        """Return the middles (k, d) [m] of the owned cells of an array of the memory."""
        middles: Array = self._points.places[self._cells_of(name)].mean(axis=1)
        return middles

    def _cells_of(self, name: str) -> Indices:
        """Return the owned cells (k,) of an array of the memory; none of another body's."""
        for part in self._parts:
            if name.startswith(part.name):
                return part.cells
        return np.zeros(0, dtype=np.int64)

    def fits(self, memory: Mapping[str, Array]) -> bool:
        """Say whether a memory has the arrays of this body on this rank, in their shapes."""
        wanted = {
            f"{part.name}{name}": (len(part.cells), self._points.each, *values.shape[1:])
            for part, start in zip(self._parts, self._virgin, strict=True)
            for name, values in start.items()
        }
        return wanted == {name: values.shape for name, values in memory.items()}

    @property
    def places(self) -> Mapping[str, Array]:
        """Return the points (cells, points of a cell, d) [m] of each part, by its name."""
        return {part.name: self._points.places[part.cells] for part in self._parts}

    @property
    def bytes_per_point(self) -> float:
        """Return the bytes that a point of integration takes on this rank, with its state."""
        kept = self._points.bytes
        for state in self._states:
            kept += sum(values.nbytes for values in state.values())
        return kept / max(self._points.cells * self._points.each, 1)

    @property
    def points(self) -> StrainPoints:
        """Return the points of integration."""
        return self._points

    def tell(self, name: str) -> Array:
        """Return a quantity of the points where the body stands. Collective.

        Args:
            name: "stress" [Pa] or "strain" (points, n) in Mandel's notation, or "equivalent_stress"
                [Pa], "plastic_strain" or "mobilised_strength" (points,).
        """
        if name == "strain":
            return self._strain
        eps = self._strain  # on all ranks, also on those without points
        values = np.zeros(eps.shape if name == "stress" else len(eps))
        for part, state, start in zip(self._parts, self._states, self._virgin, strict=True):
            if name == "stress":
                own = state["sigma"]
            elif name == "equivalent_stress":
                own = equivalent_stress(state["sigma"])
            elif name == "mobilised_strength":
                own = part.law.mobilised(state)
            else:
                own = _find_plastic(part.law, eps[part.points], state["sigma"] - start["sigma"])
            values[part.points] = own
        return values

    def weaken(self, factor: float) -> "YieldingForce":
        """Return the force of a new body whose laws have the strength of these over a factor.

        Args:
            factor: F > 0, by which c and tan phi are divided.

        Raises:
            InputError: a law does not say what it is with another strength.
        """
        parts = []
        for part in self._parts:
            parts.append(replace(part, law=part.law.weaken(factor)))
        return YieldingForce(self._space, self._points, parts, self._virgin)

    # What is asked for
    # ----------------------------------------------------------------------------------------------

    def force(self, u: Array) -> Array:
        """Return p(u) (n,) [N]. Collective."""
        return self._points.force(self._reach(u).sigma)

    def stress(self, u: Array) -> Array:
        """Return sigma (points, n) [Pa] at a displacement, in Mandel's notation. Collective."""
        return self._reach(u).sigma

    def energy(self, u: Array) -> float:
        """Return W(u) [J] with hardening, of all ranks. Collective."""
        reached = self._reach(u)
        parts = zip(self._parts, reached.states, strict=True)
        return self._add_up([part.law.stored(state) for part, state in parts])

    def tangent(self, u: Array) -> Matrix:
        """Return the symmetric part of p'(u) (n, n) [N/m]. Collective."""
        D = self._compute_tangents(self._points.strain(u) - self._strain)
        symmetric = 0.5 * (D + D.swapaxes(1, 2))
        return self._algebra.store(self._points.free_matrix(symmetric))

    @property
    def symmetric(self) -> bool:
        """Say whether p' is a symmetric matrix: whether all laws flow along their normals."""
        return all(part.law.symmetric for part in self._parts)

    def whole_tangent(self, u: Array) -> Matrix:
        """Return p'(u) (n, n) [N/m], which need not be symmetric. Collective."""
        D = self._compute_tangents(self._points.strain(u) - self._strain)
        return self._algebra.store(self._points.free_matrix(D))

    def dissipation(self, u: Array) -> float:
        """Return what the way to u dissipates [J], of all ranks. Collective."""
        reached = self._reach(u)
        lost = []
        for part, old, new in zip(self._parts, self._states, reached.states, strict=True):
            lost.append(part.law.dissipation(reached.way[part.points], old, new))
        return self._add_up(lost)

    def remainder(self, u: Array) -> float:
        """Return R [J] of the way to u, of all ranks. Collective."""
        reached = self._reach(u)
        parts = zip(self._parts, self._states, reached.states, strict=True)
        return self._add_up([part.law.remainder(old, new) for part, old, new in parts])

    def residual(self, u: Array) -> float:
        """Return the largest residual of the laws at u, of all ranks. Collective.

        Stresses are judged beside the largest of the body at both ends of the way, strains beside
        its elastic strain.
        """
        reached = self._reach(u)
        comm = self._space.comm
        stress = strain = 0.0
        for part, old, new in zip(self._parts, self._states, reached.states, strict=True):
            for state in (old, new):  # the end alone may be free of stress
                sigma = state["sigma"]
                stress = max(stress, float(np.max(norm(sigma), initial=0.0)))
                elastic = part.law.elastic_strain(sigma)
                strain = max(strain, float(np.max(norm(elastic), initial=0.0)))
        stress, strain = comm.max(np.array([stress, strain])).tolist()
        if stress == 0.0:
            return 0.0
        worst = 0.0
        for part, old, new in zip(self._parts, self._states, reached.states, strict=True):
            way = reached.way[part.points]
            own = part.law.residual(way, old, new, (stress, strain))
            size = float(np.max(own, initial=0.0))  # which keeps NaN
            worst = max(worst, size if size >= 0.0 else np.inf)
        return float(comm.max(np.array([worst]))[0])

    def _add_up(self, densities: Sequence[Array]) -> float:
        """Return the integral [J] of densities [J/m³] of the points of each part. Collective."""
        weights = self._points.weights.ravel()
        own = 0.0
        for part, density in zip(self._parts, densities, strict=True):
            own += float(weights[part.points] @ density)
        return total(self._space.comm, own)

    # Stresses
    # ----------------------------------------------------------------------------------------------

    @cached_property
    def _strain(self) -> Array:
        """Return eps (points, n) where the body stands."""
        return self._points.strain(self._u)

    def _reach(self, u: Array) -> Reached:
        """Return what the points know at a displacement. Collective."""
        comm = self._space.comm
        stands = [self._u, *(known.u for known in self._known)]
        place = find_known(comm, u, stands)
        if place:
            return self._known[place - 1]
        way = self._points.strain(u) - self._strain
        if place == 0:  # where it stands nothing flows, not by rounding either
            states = list(self._states)
        else:
            states = on_all(comm, "a material that yields", lambda: self._follow(way))
        sigma = np.zeros_like(way)
        for part, state in zip(self._parts, states, strict=True):
            sigma[part.points] = state["sigma"]
        reached = Reached(np.array(u), way, states, sigma)
        self._known = [*self._known[-(KEPT - 1) :], reached]
        return reached

    def _follow(self, way: Array) -> list[PointState]:
        """Return the states of the parts after strain increments (points, n)."""
        states: list[PointState] = []
        for part, old in zip(self._parts, self._states, strict=True):
            new, _ = part.law.stress(way[part.points], old, tangent=False)
            states.append(new)
        return states

    def _compute_tangents(self, way: Array) -> Array:
        """Return D (points, n, n) [Pa] after strain increments (points, n). Collective."""

        def ask() -> Array:
            D = np.zeros((*way.shape, way.shape[1]))
            for part, old in zip(self._parts, self._states, strict=True):
                _, own = part.law.stress(way[part.points], old)
                D[part.points] = own
            return D

        return on_all(self._space.comm, "a material that yields", ask)


def _find_plastic(law: YieldingMaterial, eps: Array, change: Array) -> Array:
    """Return √(2/3) |eps - C⁻¹ Δsigma| (q,), zero where it is rounding.

    Args:
        law: the material.
        eps: strain since the start (q, n).
        change: of the stress since the start (q, n) [Pa].
    """
    elastic = np.linalg.solve(law.stiffness(eps.shape[-1]), change.T).T
    size = norm(eps - elastic)
    rounding = ROUNDED * (norm(eps) + norm(elastic))
    return np.where(size > rounding, np.sqrt(2.0 / 3.0) * size, 0.0)


def make_parts(
    points: StrainPoints, materials: Sequence[tuple[Any, YieldingMaterial | LinearElastic]]
) -> list[Part]:
    """Return the parts of a body.

    Args:
        points: of integration.
        materials: pairs of local cells and a material; one that is linear never yields.
    """
    parts = []
    for k, (where, law) in enumerate(materials):
        if isinstance(law, LinearElastic):
            law = YieldingMaterial(law.E, law.nu, law.rho, xi=law.xi)
        cells = np.asarray(where)
        cells = np.sort(cells[cells < points.cells])
        each = np.arange(points.each)
        own = (cells[:, None] * points.each + each).ravel()
        parts.append(Part(f"{MATERIAL}{k}_", law, cells, own))
    return parts


def make_starts(
    space: FemSpace, points: StrainPoints, parts: Sequence[Part], stress: Any
) -> list[PointState]:
    """Return the states that points begin with. Collective.

    Args:
        space: the body's unknowns.
        points: of integration.
        parts: of the body.
        stress: function of places (k, d) [m] that returns components (k, n) [Pa] in the order of
            ``fem.assemble``; None for no stress.

    Raises:
        InputError: the stress is no number, or outside of the yield surface.
    """
    n = points.components
    sigma = np.zeros((points.cells * points.each, n))
    if stress is not None:
        places = points.places.reshape(-1, space.dimension)
        own = on_all(space.comm, "initial_stress", lambda: np.asarray(stress(places), dtype=float))
        wrong = ""
        if own.shape != sigma.shape or not np.all(np.isfinite(own)):
            wrong = (
                f"assemble: initial_stress returned an array of shape {own.shape} for "
                f"{len(places)} places; return finite numbers of shape (k, {n})"
            )
        refuse([wrong] if wrong else [], space.comm)
        sigma = own.copy()
        sigma[:, 3 : 3 + len(PAIRS[n])] *= ROOT
    starts: list[PointState] = [part.law.start(sigma[part.points]) for part in parts]
    defects = []
    for part, state in zip(parts, starts, strict=True):
        f = part.law.f(state)
        size = np.max(np.abs(state["sigma"]), initial=0.0)
        outside = np.flatnonzero(f > 1e3 * ROUND_OFF * size)
        if len(outside):
            worst = part.points[outside[np.argmax(f[outside])]]
            place = points.places.reshape(-1, space.dimension)[worst]
            defects.append(
                f"assemble: initial_stress is outside of the yield surface of "
                f"{type(part.law).__name__} at {len(outside)} points, most at "
                f"{describe_point(place)}; {TENSION}"
            )
    refuse(defects, space.comm)
    return starts


def make_elastic_matrix(
    points: StrainPoints, parts: Sequence[Part], factors: Sequence[float] | None = None
) -> Any:
    """Return K of all components where no point yields, a PETSc matrix. Collective.

    Args:
        points: of integration.
        parts: of the body.
        factors: of each part; None for ones.
    """
    n = points.components
    D = np.zeros((points.cells * points.each, n, n))
    for k, part in enumerate(parts):
        factor = 1.0 if factors is None else factors[k]
        D[part.points] = factor * part.law.stiffness(n)
    return points.full_matrix(D)
