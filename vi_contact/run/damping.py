"""Tell the damping that a problem has: its law, and the damping ratios of its first natural modes.

    xi_k = phi_kᵀ C phi_k / (2 w_k phi_kᵀ M phi_k),    K phi_k = w_k² M phi_k

with the whole C, of materials and of dashpots, and the contact as it is at the start: closed where
it is held or has no gap, sticking where there is friction.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array, Mask, total
from ..core.checks import shown
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given
from ..core.system import SemiDiscreteSystem
from ..laws.free_motions import free_motions
from ..laws.materials import DampingRatio, NoDamping
from .modal import natural_modes

TOUCHING = 1e-9  # of the size of the bodies: a gap that is none
ALIKE = 1e-6  # of a frequency: modes that are closer are one motion in several directions
KNOWN = "modes at the start"  # in the cache of a system
NOT_COMPUTED = "not computed at its periods"


@dataclass(frozen=True)
class FirstModes:
    """Hold the first natural modes with the contact closed where it touches at the start.

    periods: T_k [s], the longest first; ratios: xi_k; rigid_motions: how many motions meet no
    stiffness.
    """

    periods: tuple[float, ...]
    ratios: tuple[float, ...]
    rigid_motions: int


def first_modes(problem: ContactProblem) -> FirstModes:
    """Return the first three undamped natural modes of a problem, with the ratios that its C gives.

    They are found once for a system and a surface. Collective.
    """
    check_problem_given("first_modes", problem)
    problem.system.refuse_statics_only("first_modes")
    surface, frictional = problem.surface, problem.frictional
    known: list[tuple[Any, bool, FirstModes]] = problem.system.cached(KNOWN, list)
    for one, rubbing, modes in known:
        if one is surface and rubbing == frictional:
            return modes
    known.append((surface, frictional, _found(problem)))
    return known[-1][2]


def damping_in_words(problem: ContactProblem, *, unknown: str = "") -> str:
    """Return the damping of a problem as a text: "none", or its law and the ratios of its modes.

    The ratios are told where ``first_modes`` have been found; ``unknown``: why they have not.
    """
    system = problem.system
    law = "; ".join(_sources(system))
    if not law:
        return "none"
    known: list[tuple[Any, bool, FirstModes]] = system.cached(KNOWN, list)
    for surface, rubbing, modes in known:
        if surface is problem.surface and rubbing == problem.frictional:
            pairs = enumerate(zip(modes.ratios, modes.periods, strict=True), start=1)
            told = [f"{_per_cent(xi)} at T{number} = {T:.3g} s" for number, (xi, T) in pairs]
            return f"{law}; {', '.join(told) or 'no natural mode was found'}"
    return f"{law}; {unknown}" if unknown else law


def first_open_period(problem: ContactProblem) -> float | None:
    """Return the first natural period [s] with the contact open.

    It is None where none of the contact touches at the start.

    A body that has lifted off may swing faster than with its contact closed. Collective.
    """
    surface = problem.surface
    if not surface.some(_closed_at_start(problem) & ~surface.bilateral):
        return None
    algebra, K, M, _, most = _matrices(problem, surface.bilateral)
    frequencies, _, _ = natural_modes(algebra, K, M, rigid=most)
    return float(1.0 / frequencies[0]) if len(frequencies) else None


def _closed_at_start(problem: ContactProblem) -> Mask:
    """Return which conditions (m,) are held, or have no gap at the start."""
    surface = problem.surface
    size: float = getattr(problem.system.space, "size", 0.0)  # of the bodies [m]
    return np.asarray((surface.gap0 <= TOUCHING * size) | surface.bilateral)


def _matrices(problem: ContactProblem, closed: Mask) -> tuple[Any, Any, Any, Mask, int]:
    """Return (algebra, K, M, which unknowns are free, rigid motions at most).

    These are with the conditions (m,) closed.

    The system is that of the nodal frames, without excitation; closed conditions become supports or
    springs.
    """
    system, surface = problem.static_load, problem.surface
    held, springs = np.zeros((2, system.rows))
    rigid = closed & surface.rigid
    held[surface.owned[rigid]] = 1.0
    held[surface.tangents[(surface.tangents >= 0) & closed[:, None] & problem.frictional]] = 1.0
    springs[surface.owned[closed & ~rigid]] = 1.0 / surface.compliance[closed & ~rigid]
    algebra, every, free = system.algebra, np.arange(system.rows), held == 0.0
    K = algebra.combine([(1.0, system.K), (1.0, algebra.local(every, every, springs, system.rows))])
    K, M = (algebra.block(one, free) for one in (K, system.M))
    most = sum(body.motions.shape[1] for body in free_motions(problem.system))
    return algebra, K, M, free, most


def _found(problem: ContactProblem) -> FirstModes:
    system = problem.static_load
    algebra, K, M, free, most = _matrices(problem, _closed_at_start(problem))
    frequencies, modes, rigid_motions = natural_modes(algebra, K, M, rigid=most)
    # The share of each mode in C: phiᵀ C phi / (2 w phiᵀ M phi).
    ratios = np.zeros(len(frequencies))
    if system.C is not None:
        C, w = algebra.block(system.C, free), 2.0 * np.pi * frequencies
        columns = [np.ascontiguousarray(one) for one in modes.T]
        damped, moving = (
            np.array([total(algebra.comm, one @ (A @ one)) for one in columns]) for A in (C, M)
        )
        ratios = _of_alike(frequencies, damped / (2.0 * w * moving))
    return FirstModes(tuple((1.0 / frequencies).tolist()), tuple(ratios.tolist()), rigid_motions)


def _of_alike(frequencies: Array, ratios: Array) -> Array:
    """Return the ratios with their mean over modes of one frequency.

    Of these none is more a mode than another, so that the answer does not depend on the basis that
    the solver found.
    """
    close = np.abs(frequencies[:, None] - frequencies) <= ALIKE * frequencies[:, None]
    return np.asarray((close @ ratios) / close.sum(axis=1))


def _sources(system: SemiDiscreteSystem) -> Iterator[str]:
    """Yield what damps a system, in words."""
    if system.C is None:
        return
    forms: Any = getattr(system.space, "forms", None)
    if forms is None or forms.foreign(system, "C"):
        yield "a matrix C of its own"
        return
    if isinstance(forms.damping, DampingRatio):
        yield f"{_ratios(forms)} at {_frequencies(forms.damping)}"
    elif not isinstance(forms.damping, NoDamping):
        yield shown(forms.damping)
    if forms.own_damping:
        yield "a damping form of its own"
    boundaries = [f"{type(one).__name__} on '{one.facets.name}'" for one in forms.boundaries]
    if boundaries:
        yield ", ".join(boundaries)


def _ratios(forms: Any) -> str:
    """Return the damping ratios of the materials: one, or from the least to the largest."""
    given = [one.xi for _, one in forms.materials]
    if any(callable(one) for one in given):
        return f"up to {_per_cent(forms.largest_ratio)}"
    least = min(given)
    if least == max(given):
        return _per_cent(least)
    return f"{100.0 * least:.3g} to {_per_cent(max(given))}"


def _frequencies(law: DampingRatio) -> str:
    return f"f1 = {law.frequency:.4g} Hz" + (f" and f2 = {law.second:.4g} Hz" if law.second else "")


def _per_cent(ratio: float) -> str:
    return f"{100.0 * ratio:.3g} %"
