"""Tell the damping that a problem has: its law, and the damping ratios of its first natural modes.

    xi_k = phi_kᵀ C phi_k / (2 w_k phi_kᵀ M phi_k),    K phi_k = w_k² M phi_k

with the whole C, of materials and of dashpots, and the contact as it is at the start: closed where
it is held or has no gap, sticking where there is friction.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, Mask, Matrix, largest, max_abs, total
from ..core.checks import quote
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given
from ..core.surfaces import ContactSurface
from ..core.system import SemiDiscreteSystem
from ..core.traces import Traces
from ..laws.free_motions import free_motions
from ..laws.materials import DampingRatio, NoDamping
from .modal import natural_modes

TOUCHING = 1e-9  # of the size of the bodies: a gap that is none
STIFF = 1e6  # of the largest K_ii: springs that hold traces, to six digits of a frequency
ALIKE = 1e-6  # of a frequency: modes that are closer are one motion in several directions
CACHE = "modes at the start"  # the name of what ``_list_modes`` returns, in a system's cache
NOT_COMPUTED = "not computed at its periods"


@dataclass(frozen=True)
class FirstModes:
    """Hold the first natural modes with the contact closed where it touches at the start.

    Attributes:
        periods: T_k [s], the longest first.
        ratios: damping ratios xi_k.
        rigid_motions: how many motions meet no stiffness.
    """

    periods: tuple[float, ...]
    ratios: tuple[float, ...]
    rigid_motions: int


@dataclass(frozen=True)
class _CachedModes:
    """Hold the modes that were computed for a surface, and whether it had friction.

    A system is shared by problems that differ in these two, on which the modes depend.
    """

    surface: ContactSurface
    frictional: bool
    modes: FirstModes

    def are_of(self, problem: ContactProblem) -> bool:
        """Say whether these are the modes of a problem on the same system."""
        return self.surface is problem.surface and self.frictional == problem.frictional


def first_modes(problem: ContactProblem) -> FirstModes:
    """Return the first three undamped natural modes of a problem, with the ratios that its C gives.

    They are computed once for a system, a surface, and contact with or without friction. A body
    that is not linear has those of its reference stiffness. Collective.
    """
    check_problem_given("first_modes", problem)
    problem.system.refuse_statics_only("first_modes")
    modes = _recall_modes(problem)
    if modes is None:
        modes = _compute_modes(problem)
        entry = _CachedModes(problem.surface, problem.frictional, modes)
        _list_modes(problem.system).append(entry)
    return modes


def _list_modes(system: SemiDiscreteSystem) -> list[_CachedModes]:
    """Return the list of modes computed so far, which the system holds."""
    entries: list[_CachedModes] = system.make_once(CACHE, list)
    return entries


def _recall_modes(problem: ContactProblem) -> FirstModes | None:
    """Return the modes of a problem if they have been computed before."""
    for entry in _list_modes(problem.system):
        if entry.are_of(problem):
            return entry.modes
    return None


def describe_damping(problem: ContactProblem, *, unknown: str = "") -> str:
    """Return the damping of a problem as a text: "none", or its law and the ratios of its modes.

    The ratios are told if ``first_modes`` has been called before: nothing is computed here.

    Args:
        problem: whose damping it is.
        unknown: what stands in the place of ratios that have not been computed.
    """
    law = "; ".join(_describe_sources(problem.system))
    if not law:
        return "none"
    modes = _recall_modes(problem)
    if modes is None:
        return f"{law}; {unknown}" if unknown else law
    ratios = []
    for number, (xi, T) in enumerate(zip(modes.ratios, modes.periods, strict=True), start=1):
        ratios.append(f"{_in_per_cent(xi)} at T{number} = {T:.3g} s")
    return f"{law}; {', '.join(ratios) or 'no natural mode was found'}"


def first_open_period(problem: ContactProblem) -> float | None:
    """Return the first natural period [s] with the contact open.

    It is None where none of the contact touches at the start.

    A body that has lifted off may swing faster than with its contact closed. Collective.
    """
    surface = problem.surface
    if not surface.some(_find_closed(problem) & ~surface.bilateral):
        return None
    K, M, _ = _assemble_closed(problem, surface.bilateral)
    algebra = problem.static_load.algebra
    frequencies, _, _ = natural_modes(algebra, K, M, rigid=_count_rigid_motions(problem))
    return float(1.0 / frequencies[0]) if len(frequencies) else None


def _find_closed(problem: ContactProblem) -> Mask:
    """Return which conditions (m,) are held, or have no gap at the start."""
    surface = problem.surface
    size: float = getattr(problem.system.space, "size", 0.0)  # of the bodies [m]
    return np.asarray((surface.gap0 <= TOUCHING * size) | surface.bilateral)


def _assemble_closed(problem: ContactProblem, closed: Mask) -> tuple[Matrix, Matrix, Mask]:
    """Return K and M of the free unknowns, and which unknowns (n,) these are. Collective.

    The system is that of the nodal frames, without excitation. A closed condition on a rigid
    support takes its unknown out, and with friction the tangential ones too (sticking); one on a
    spring adds 1 / compliance to K_ii. Traces have no unknowns to take out: stiff springs hold
    them. The outlets of a reservoir are closed too.

    Args:
        problem: whose matrices they are.
        closed: which conditions (m,) are closed.
    """
    system = problem.static_load
    surface = problem.surface
    algebra = system.algebra
    rigid = closed & surface.rigid
    soft = closed & ~surface.rigid

    free = np.ones(system.rows, dtype=bool)
    outlets: Mask | None = getattr(system.space, "outlets", None)
    if surface.traces is not None:
        stiff = STIFF * largest(surface.comm, max_abs(system.K.diagonal()))
        if outlets is not None:
            rows = np.flatnonzero(outlets)
            held = algebra.local(rows, rows, np.full(len(rows), stiff), system.rows)
            system = system.changed(K=algebra.combine([(1.0, system.K), (1.0, held)]))
        normal = np.where(rigid, stiff, 0.0)
        normal[soft] = 1.0 / surface.compliance[soft]
        along = np.where(closed, stiff, 0.0)
        springs_of_traces = _make_trace_springs(problem, surface.traces, normal, along)
        return algebra.combine([(1.0, system.K), *springs_of_traces]), system.M, free
    if outlets is not None:
        free &= ~outlets
    free[surface.owned[rigid]] = False
    if problem.frictional:
        has_unknown = surface.tangents >= 0  # else the component is prescribed
        free[surface.tangents[has_unknown & closed[:, None]]] = False

    springs = np.zeros(system.rows)
    springs[surface.owned[soft]] = 1.0 / surface.compliance[soft]
    rows = np.arange(system.rows)
    on_springs = algebra.local(rows, rows, springs, system.rows)
    K = algebra.block(algebra.combine([(1.0, system.K), (1.0, on_springs)]), free)
    M = algebra.block(system.M, free)
    return K, M, free


def _make_trace_springs(
    problem: ContactProblem, traces: Traces, normal: Array, tangential: Array
) -> list[tuple[float, Matrix]]:
    """Return terms (factor, matrix) whose sum is Bᵀ k B, springs k along traces. Collective.

    Args:
        problem: whose unknowns they are.
        traces: the conditions.
        normal: (m,) stiffness [N/m] along the normals.
        tangential: (m,) along the tangents, which is used with friction only.
    """
    surface = problem.surface
    algebra = problem.static_load.algebra
    n = problem.static_load.rows
    width = surface.tangents.shape[1]
    along = np.repeat(tangential[:, None], width, axis=1)
    k = np.column_stack([normal, along if problem.frictional else np.zeros_like(along)])
    B = traces.every
    whole = sp.csr_matrix(B.T.multiply(surface.everywhere(k).ravel()) @ B)

    # An algebra replaces rows of the identity: those of springs are added to it, and it is taken
    # away again.
    own = sp.csr_matrix(whole[traces.places])
    shape = (len(traces.own), problem.system.space.unknowns)
    rows = sp.csr_matrix((own.data, traces.unknowns[own.indices], own.indptr), shape=shape)
    places = (np.arange(shape[0]), traces.own + algebra.first(n))
    rows = rows + sp.csr_matrix((np.ones(shape[0]), places), shape=shape)
    every = np.arange(n)
    identity = algebra.local(every, every, np.ones(n), n)
    replaced = algebra.replace_identity_rows(n, traces.own, sp.csr_matrix(rows))
    return [(1.0, replaced), (-1.0, identity)]


def _count_rigid_motions(problem: ContactProblem) -> int:
    """Return how many rigid motions all bodies have at most, when no contact holds them."""
    return sum(body.motions.shape[1] for body in free_motions(problem.system))


def _compute_modes(problem: ContactProblem) -> FirstModes:
    """Return the first modes of a problem; see ``first_modes``. Collective."""
    system = problem.static_load
    algebra = system.algebra
    K, M, free = _assemble_closed(problem, _find_closed(problem))
    most = _count_rigid_motions(problem)
    frequencies, modes, rigid_motions = natural_modes(algebra, K, M, rigid=most)

    # The share of each mode in C: xi = phiᵀ C phi / (2 w phiᵀ M phi).
    ratios = np.zeros(len(frequencies))
    if system.C is not None:
        C = algebra.block(system.C, free)
        columns = [np.ascontiguousarray(mode) for mode in modes.T]
        damped = np.array([total(algebra.comm, phi @ (C @ phi)) for phi in columns])
        moving = np.array([total(algebra.comm, phi @ (M @ phi)) for phi in columns])
        w = 2.0 * np.pi * frequencies
        ratios = _average_alike(frequencies, damped / (2.0 * w * moving))
    return FirstModes(tuple((1.0 / frequencies).tolist()), tuple(ratios.tolist()), rigid_motions)


def _average_alike(frequencies: Array, ratios: Array) -> Array:
    """Return the ratios (k,), each the mean over all modes of its frequency.

    Modes of one frequency are any basis of a space, and the mean does not depend on which of them
    the eigensolver returned.
    """
    close = np.abs(frequencies[:, None] - frequencies) <= ALIKE * frequencies[:, None]
    return np.asarray((close @ ratios) / close.sum(axis=1))


def _describe_sources(system: SemiDiscreteSystem) -> Iterator[str]:
    """Yield what damps a system, in words."""
    if system.C is None:
        return
    forms: Any = getattr(system.space, "forms", None)
    if forms is None or forms.foreign(system, "C"):
        yield "a matrix C of its own"
        return
    if isinstance(forms.damping, DampingRatio):
        yield f"{_describe_ratios(forms)} at {_describe_frequencies(forms.damping)}"
    elif not isinstance(forms.damping, NoDamping):
        yield quote(forms.damping)
    if forms.own_damping:
        yield "a damping form of its own"
    if getattr(system.space, "outlets", None) is not None:
        yield "water that leaves the reservoir, which the ratios of modes do not count"
    boundaries = []
    for boundary in forms.boundaries:
        boundaries.append(f"{type(boundary).__name__} on '{boundary.facets.name}'")
    if boundaries:
        yield ", ".join(boundaries)


def _describe_ratios(forms: Any) -> str:
    """Return the damping ratios of the materials: one, or from the least to the largest."""
    ratios = [material.xi for _, material in forms.materials]
    if any(callable(xi) for xi in ratios):  # a function of the place
        return f"up to {_in_per_cent(forms.largest_ratio)}"
    least = min(ratios)
    largest = max(ratios)
    if least == largest:
        return _in_per_cent(least)
    return f"{100.0 * least:.3g} to {_in_per_cent(largest)}"


def _describe_frequencies(law: DampingRatio) -> str:
    """Return the frequencies at which a law has the damping ratios of the materials."""
    first = f"f1 = {law.frequency:.4g} Hz"
    return f"{first} and f2 = {law.second:.4g} Hz" if law.second else first


def _in_per_cent(ratio: float) -> str:
    """Return a ratio in per cent, with three digits."""
    return f"{100.0 * ratio:.3g} %"
