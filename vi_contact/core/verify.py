"""Verify a step: its certificate, and its energy balance. These checks ship with the package."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .algebra import Array, lowest, max_abs
from .certificate import Certificate
from .problem import ContactProblem
from .step import Balance, State, StepProblem, StepResult
from .system import SemiDiscreteSystem

ROUNDED = 1e-5  # of |A||x|, and of what friction is compared with: see Certificate


def kkt_residual(step: StepProblem, result: StepResult) -> Certificate:
    """Return how well (x, r_n) satisfies the inequality problem of a step; definitions: ``Certificate``."""
    surface, x, r_n = step.surface, result.x, result.r_n
    Ax = step.A.image(x)
    residual = Ax - step.b
    if result.r_t is None:
        residual[surface.owned] += r_n
    else:
        residual += surface.reaction_load(r_n, len(x), result.r_t)
    gap, closed = step.bound - surface.normal_values(x), result.active
    signed = gap, r_n
    if not surface.plain:
        gap += surface.compliance * r_n / step.scale
        closed, signed = closed | surface.bilateral, (gap[~surface.bilateral], r_n[~surface.bilateral])
    maxima = _maxima(step, residual, step.b, Ax, x, step.guess, r_n, gap[closed], r_n[~closed], signed=signed)
    return _judged(step, result, maxima)


def kkt_residuals(
    many: StepProblem, result: StepResult, steps: Sequence[StepProblem], results: Sequence[StepResult]
) -> list[Certificate]:
    """Return the certificate of each of several steps on one rank: ``many`` and ``result`` hold their rows."""
    surface, x, r_n = many.surface, result.x, result.r_n
    Ax = many.A.image(x)
    residual = Ax - many.b + surface.reaction_load(r_n, x.shape[-1], result.r_t)
    gap, held, closed = many.bound - surface.normal_values(x), surface.bilateral, result.active
    if not surface.plain:
        gap += surface.compliance * r_n / many.scale
        closed = closed | held
    lowest = [np.where(held, 0.0, np.minimum(one, 0.0)) for one in (gap, r_n)]
    small = np.abs([r_n, np.where(closed, gap, 0.0), np.where(closed, 0.0, r_n), *lowest]).max(-1, initial=0.0)
    large = [np.maximum(one.max(-1), -one.min(-1)) for one in (residual, many.b, Ax, x, many.guess)]
    rows = np.concatenate([large, small]).T.tolist()
    return [_judged(*row) for row in zip(steps, results, rows, strict=True)]


def _judged(step: StepProblem, result: StepResult, maxima: list[float]) -> Certificate:
    """The certificate, of the largest sizes in its definitions."""
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


def _maxima(step: StepProblem, *arrays: Array, signed: tuple[Array, ...] = ()) -> list[float]:
    """Largest sizes of the entries on all ranks, and of the negative ones of ``signed``, by one reduction; infinite for
    NaN, which no reduction keeps."""
    sizes = [*map(max_abs, arrays), *map(lowest, signed)]
    sizes = [size if size >= 0.0 else np.inf for size in sizes]
    comm = step.surface.comm
    return sizes if comm.size == 1 else comm.max(np.array(sizes)).tolist()


def _friction_residuals(step: StepProblem, result: StepResult, x_ref: float, r_ref: float) -> tuple[float, float]:
    """(cone, dissipation) of ``Certificate``; zero without friction."""
    if step.slip0 is None:
        return 0.0, 0.0
    surface = step.surface
    r_t = np.zeros_like(step.slip0) if result.r_t is None else result.r_t
    slip = surface.tangential_values(result.x) - step.slip0
    limit = step.friction_at(slip).limit(result.r_n, surface.weights, step.scale)
    size, way = np.linalg.norm(r_t, axis=1), np.linalg.norm(slip, axis=1)
    missing, beyond = limit * way - np.sum(r_t * slip, axis=1), np.maximum(size - limit, 0.0)
    limit_max, size_max, way_max, outside, lost = _maxima(step, limit, size, way, beyond, missing)
    t_ref = max(limit_max, size_max, ROUNDED**2 * r_ref)
    s_ref = max(way_max, ROUNDED * x_ref)
    return _over(outside, t_ref), _over(lost, t_ref * s_ref)


def _over(value: float, reference: float) -> float:
    """value/reference, with 0/0 = 0 (nothing happens, nothing is wrong); NaN for infinity over infinity."""
    if value == 0.0 and reference < np.inf:
        return 0.0
    return value / reference if reference else np.inf


@dataclass(frozen=True)
class StepEnergy:
    """Say where energy went [J]: change = input - damping - contact - friction - algorithmic + defect."""

    change: float
    input: float
    damping: float
    contact: float
    friction: float
    algorithmic: float

    @property
    def defect(self) -> float:
        """Return what the ledger cannot explain; round-off when the equation of motion was satisfied."""
        return self.change - (self.input - self.damping - self.contact - self.friction - self.algorithmic)


@dataclass(frozen=True)
class Energies:
    """Hold M v, K u and the energies of a state [J]; a ledger carries them on, so that none is made twice."""

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


def _dots(system: SemiDiscreteSystem, *pairs: tuple[Array, Array], sums: tuple[float, ...] = ()) -> list[float]:
    """Inner products, and sums over the ranks, with one reduction for all."""
    comm, found = system.algebra.comm, [*(float(x.dot(y)) for x, y in pairs), *sums]
    return found if comm.size == 1 else comm.sum(np.array(found)).tolist()


def energy_balance(
    problem: ContactProblem, old: State, new: State, balance: Balance, *, before: Energies | None = None,
    after: Energies | None = None,
) -> StepEnergy:
    """Return the ledger of a step before the impact law, for any scheme.

    The step satisfied M a + C v + K u = f - B_nᵀ r_n - B_tᵀ r_t with the averages of ``balance``. Times the increment
    du:
        input = f·du + work of a moving obstacle,  damping = du·C v,
        contact = r_n·B_n du (work lost to the support, stored or dissipated there),  friction = r_t·B_t du,
        algorithmic = du·M a - ½(v0 + v1)·M (v1 - v0) + du·K u - ½(u0 + u1)·K du   (0 for the midpoint rule)
    and change is the difference of the energies themselves, so the defect measures the equation of motion.
    ``before``, ``after``: the energies of both states, when known; one product (two with damping) is left then.
    """
    system, surface = problem.equations, problem.surface
    before = before or energies(system, old.u, old.v)
    after = after or energies(system, new.u, new.v)
    du = new.u - old.u
    pushed, dragged = _obstacle_work(problem, old.t, new.t, balance)
    rubbing = 0.0 if balance.r_t is None else float(np.sum(balance.r_t * surface.tangential_values(du)))
    work, inertia, kinetic, stiffness, lost, *local = _dots(
        system, (du, balance.f), (du, system.product("M", balance.a)),
        (0.5 * (old.v + new.v), after.momentum - before.momentum),
        (balance.u - 0.5 * (old.u + new.u), after.elastic - before.elastic), (balance.r_n, surface.normal_values(du)),
        sums=(rubbing, pushed, dragged, 0.0 if system.C is None else float(du.dot(system.product("C", balance.v)))),
    )
    rubbing, pushed, dragged, damping = local
    return StepEnergy(
        change=after.total - before.total, input=work + pushed + dragged, damping=damping, contact=lost + pushed,
        friction=rubbing + dragged, algorithmic=inertia - kinetic + stiffness,
    )


def _obstacle_work(problem: ContactProblem, start: float, end: float, balance: Balance) -> tuple[float, float]:
    """Work that a moving obstacle does on the body on this rank, (normal, tangential): r_n·advance and -r_t·sliding."""
    advance, sliding = problem.surface.advance(start, end), problem.surface.sliding(start, end)
    pushed = 0.0 if advance is None else float(balance.r_n @ advance)
    dragged = 0.0 if sliding is None or balance.r_t is None else -float(np.sum(balance.r_t * sliding))
    return pushed, dragged
