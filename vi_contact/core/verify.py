"""Verify a step: its certificate, and its energy balance. These checks ship with the package."""

import math
from collections.abc import Callable
from ctypes import c_double
from dataclasses import dataclass
from typing import Any

import numpy as np

from .algebra import Array, max_abs
from .certificate import Certificate
from .collective import limit_of
from .compiled import already
from .contact_last import at
from .problem import ContactProblem
from .step import Balance, State, StepProblem, StepResult
from .system import SemiDiscreteSystem

COPIED = 5_000  # numbers
ROUNDED = 1e-5  # of |A||x|, and of what friction is compared with: see Certificate


def kkt_residual(step: StepProblem, result: StepResult) -> Certificate:
    """Return how well (x, r_n) satisfies the inequality problem of a step.

    ``Certificate`` defines the residuals.
    """
    return _judged(step, result, _sizes(step, result)[0])


def kkt_residuals(
    many: StepProblem, result: StepResult, own: Callable[[int], tuple[StepProblem, StepResult]]
) -> list[Certificate]:
    """Return the certificate of each of several steps on one rank.

    The arguments hold the steps as rows; ``own`` makes one of each.
    """
    rubs, rows = many.slip0 is not None, enumerate(_sizes(many, result))
    return [_judged(*(own(row) if rubs else (many, result)), sizes) for row, sizes in rows]


def _sizes(step: StepProblem, result: StepResult) -> list[list[float]]:
    """Return the largest sizes in the definitions, over all ranks, of each step in rows.

    They are infinite for NaN, which would go.
    """
    comm, functions = step.surface.comm, already()
    Ax = step.A.image(result.x)
    found = (
        _sizes_in_numpy(step, result, Ax)
        if functions is None
        else _sizes_compiled(step, result, Ax, functions)
    )
    return (found if comm.size == 1 else comm.max(found)).tolist()


def _sizes_compiled(step: StepProblem, result: StepResult, Ax: Array, functions: Any) -> Array:
    counts, fixed, _ = step.surface.readable
    arrays = Ax, step.b, result.x, step.guess, step.bound, result.r_n, result.r_t, result.active
    (*places, room, found), kept = _places(step.A.desk, counts, arrays)
    functions.largest(
        len(kept[-1]), Ax.shape[-1], *counts, *places, c_double(step.scale), *fixed, room, found
    )
    return np.asarray(kept[-1])


def _places(
    desk: dict[Any, tuple[list[Any], list[Any]]], counts: tuple[int, ...], arrays: tuple[Any, ...]
) -> tuple[list[Any], list[Any]]:
    """Return where compiled functions find the arrays, room and sizes, and what lies there.

    What lies there has their types and sizes, whatever a solver gave. These are copies on the desk
    where they are small, which takes less than to ask numpy where an array lies.
    """
    shapes = tuple([None if one is None else one.shape for one in arrays])
    if shapes in desk:
        for copy, one in zip(desk[shapes][1], arrays, strict=False):
            if one is not None:
                copy[...] = one
        return desk[shapes]
    *rows, n = arrays[0].shape
    small = arrays[0].size <= COPIED
    forms = *[(*rows, n)] * 4, counts[:1], (*rows, counts[0]), (*rows, *counts), (*rows, counts[0])
    kept = [
        None
        if one is None
        else (np.array if small else np.asarray)(np.broadcast_to(one, form), kind, order="C")
        for one, form, kind in zip(arrays, forms, [float] * 7 + [bool], strict=True)
    ]
    kept += [np.empty(n), np.empty((math.prod(rows), 10))]
    made = [None if one is None else at(one) for one in kept], kept
    if small:
        desk[shapes] = made
    return made


def _sizes_in_numpy(step: StepProblem, result: StepResult, Ax: Array) -> Array:
    surface, x, r_n, residual = step.surface, result.x, result.r_n, Ax - step.b
    if result.r_t is None:
        residual.T[surface.owned] += r_n.T
    else:
        residual += surface.reaction_load(r_n, x.shape[-1], result.r_t)
    gap, held, closed = (
        step.bound - surface.normal_values(x),
        surface.bilateral,
        result.active | surface.bilateral,
    )
    gap += surface.compliance * r_n / step.scale
    signed = [np.where(held, 0.0, np.minimum(one, 0.0)) for one in (gap, r_n)]
    arrays = (
        residual,
        step.b,
        Ax,
        x,
        step.guess,
        r_n,
        np.where(closed, gap, 0.0),
        np.where(closed, 0.0, r_n),
        *signed,
    )
    sizes = [np.maximum(one.max(-1, initial=0.0), -one.min(-1, initial=0.0)) for one in arrays]
    return np.nan_to_num(np.atleast_2d(np.array(sizes).T), nan=np.inf, posinf=np.inf)


def _judged(step: StepProblem, result: StepResult, maxima: list[float]) -> Certificate:
    """Return the certificate, of the largest sizes in its definitions."""
    residual_max, b_max, Ax_max, x_max, guess_max, r_max, apart, open_force, behind, pull = maxima
    x_ref, r_ref = max(x_max, guess_max), max(b_max, r_max)
    cone, dissipation = _friction_residuals(step, result, x_ref, r_ref)
    away, loose = _over(apart, x_ref), _over(open_force, r_ref)
    return Certificate(
        equilibrium=_over(residual_max, max(b_max, Ax_max, ROUNDED * step.A.largest * x_max)),
        penetration=_over(behind, x_ref),
        tension=_over(pull, r_ref),
        complementarity=away if away >= loose or np.isnan(away) else loose,  # keeps NaN
        cone=cone,
        dissipation=dissipation,
    )


def _maxima(step: StepProblem, *arrays: Array) -> list[float]:
    """Return the largest sizes of the entries on all ranks, by one reduction.

    They are infinite for NaN, which no reduction keeps.
    """
    sizes = [size if size >= 0.0 else np.inf for size in map(max_abs, arrays)]
    comm = step.surface.comm
    return sizes if comm.size == 1 else comm.max(np.array(sizes)).tolist()


def _friction_residuals(
    step: StepProblem, result: StepResult, x_ref: float, r_ref: float
) -> tuple[float, float]:
    """(cone, dissipation) of ``Certificate``; zero without friction."""
    if step.slip0 is None:
        return 0.0, 0.0
    surface = step.surface
    r_t = np.zeros_like(step.slip0) if result.r_t is None else result.r_t
    slip = surface.tangential_values(result.x) - step.slip0
    limit = limit_of(step.friction_at(slip), result.r_n, surface.weights, step.scale)
    size, way = np.linalg.norm(r_t, axis=1), np.linalg.norm(slip, axis=1)
    missing, beyond = limit * way - np.sum(r_t * slip, axis=1), np.maximum(size - limit, 0.0)
    limit_max, size_max, way_max, outside, lost = _maxima(step, limit, size, way, beyond, missing)
    t_ref = max(limit_max, size_max, ROUNDED**2 * r_ref)
    s_ref = max(way_max, ROUNDED * x_ref)
    return _over(outside, t_ref), _over(lost, t_ref * s_ref)


def _over(value: float, reference: float) -> float:
    """Return value/reference, with 0/0 = 0: nothing happens, nothing is wrong.

    It is NaN for infinity over infinity.
    """
    if value == 0.0 and reference < np.inf:
        return 0.0
    return value / reference if reference else np.inf


@dataclass(frozen=True)
class StepEnergy:
    """Say where energy went [J].

    The ledger is change = input - damping - contact - friction - algorithmic + defect.
    """

    change: float
    input: float
    damping: float
    contact: float
    friction: float
    algorithmic: float

    @property
    def defect(self) -> float:
        """Return what the ledger cannot explain.

        It is rounding and the tolerance of the solver when the step was solved.
        """
        return self.change - (
            self.input - self.damping - self.contact - self.friction - self.algorithmic
        )


@dataclass(frozen=True)
class Energies:
    """Hold M v, K u and the energies of a state [J].

    A ledger carries them on, so that none is made twice.
    """

    momentum: Array
    elastic: Array
    kinetic: float
    strain: float

    @property
    def total(self) -> float:
        """Return ½ vᵀMv + ½ uᵀKu [J]."""
        return self.kinetic + self.strain


def energies(system: SemiDiscreteSystem, u: Array, v: Array) -> Energies:
    """Return the energies of displacement u and velocity v: two products, unless they are known."""
    momentum, elastic = system.product("M", v), system.product("K", u)
    kinetic, strain = _dots(system, (v, momentum), (u, elastic))
    return Energies(momentum, elastic, 0.5 * kinetic, 0.5 * strain)


def _dots(
    system: SemiDiscreteSystem, *pairs: tuple[Array, Array], sums: tuple[float, ...] = ()
) -> list[float]:
    """Inner products, and sums over the ranks, with one reduction for all."""
    comm, found = system.algebra.comm, [*[float(x.dot(y)) for x, y in pairs], *sums]
    return found if comm.size == 1 else comm.sum(np.array(found)).tolist()


def energy_balance(
    problem: ContactProblem,
    old: State,
    new: State,
    balance: Balance,
    *,
    before: Energies | None = None,
    after: Energies | None = None,
) -> StepEnergy:
    """Return the ledger of a step before the impact law, for any scheme.

    The step satisfied M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t with the averages of ``balance``.
    Times the increment du:

        input = f·du + work of a moving obstacle
        damping = du·C v
        contact = r_n·B_n du    (work lost to the support, stored or dissipated there)
        friction = r_t·B_t du
        algorithmic = du·M a - ½(v0 + v1)·M (v1 - v0) + du·K u - ½(u0 + u1)·K du

    algorithmic is 0 for the midpoint rule, and change is the difference of the energies themselves,
    so the defect measures the equation of motion. ``before``, ``after``: the energies of both
    states, when known; one product (two with damping) is left then.
    """
    system, surface = problem.equations, problem.surface
    before = before or energies(system, old.u, old.v)
    after = after or energies(system, new.u, new.v)
    du = new.u - old.u
    pushed, dragged = _obstacle_work(problem, old.t, new.t, balance)
    rubbing = (
        0.0 if balance.r_t is None else float(np.sum(balance.r_t * surface.tangential_values(du)))
    )
    work, inertia, kinetic, stiffness, lost, *local = _dots(
        system,
        (du, balance.f),
        (du, system.product("M", balance.a)),
        (0.5 * (old.v + new.v), after.momentum - before.momentum),
        (balance.u - 0.5 * (old.u + new.u), after.elastic - before.elastic),
        (balance.r_n, surface.normal_values(du)),
        sums=(
            rubbing,
            pushed,
            dragged,
            0.0 if system.C is None else float(du.dot(system.product("C", balance.v))),
        ),
    )
    rubbing, pushed, dragged, damping = local
    return StepEnergy(
        change=after.total - before.total,
        input=work + pushed + dragged,
        damping=damping,
        contact=lost + pushed,
        friction=rubbing + dragged,
        algorithmic=inertia - kinetic + stiffness,
    )


def _obstacle_work(
    problem: ContactProblem, start: float, end: float, balance: Balance
) -> tuple[float, float]:
    """Return the work that a moving obstacle does on the body on this rank.

    It is (normal, tangential): r_n·advance and -r_t·sliding.
    """
    advance, sliding = problem.surface.advance(start, end), problem.surface.sliding(start, end)
    pushed = 0.0 if advance is None else float(balance.r_n @ advance)
    dragged = (
        0.0 if sliding is None or balance.r_t is None else -float(np.sum(balance.r_t * sliding))
    )
    return pushed, dragged
