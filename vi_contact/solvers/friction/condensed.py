"""Condense with friction: the Delassus operator of normal and tangential contact unknowns together.

With the unit vectors E of the normal and F of the tangential unknowns, x_free = A⁻¹b and D = [E F]:

    G = DᵀA⁻¹D (+ compliance/scale on the normal diagonal)
        node by node: r_n, then r_t: ``kernels.condensation``
    q_n = bound - Eᵀx_free,   q_t = slip0 - Fᵀx_free
        gap, and minus the slip, without reactions
    the small problem of ``problem`` gives r;   x = A⁻¹(b - E r_n - F r_t)

A law that depends on the slip rate makes this a sequence of such problems: ``slip_rate``.

Tangential unknowns that are prescribed carry no reaction: their rows are replaced by those of a
free spring.
"""

from collections.abc import Callable

import numpy as np

from ...core.algebra import Array, Mask
from ...core.collective import limit_of, slope_of
from ...core.errors import ViContactError
from ...core.products import freeze
from ...core.step import Answers, StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ...kernels.condensation import Condensation
from .problem import FrictionMethod, FrictionResult
from .slip_rate import RateIteration


class CondensedFriction:
    """Solve the small problem with friction of one A.

    It is condensed onto normal and tangential unknowns.
    """

    def __init__(
        self,
        method: FrictionMethod,
        condensed: Condensation,
        surface: ContactSurface,
        *,
        rates: RateIteration,
    ) -> None:
        self._surface, self._rates, self.condensed = surface, rates, condensed
        self._name = f"condensed {type(method).__name__}"
        self.delassus, d = condensed.flexibility, 1 + surface.tangents.shape[1]
        fixed = np.flatnonzero(~condensed.there)
        self.delassus[fixed, fixed] = self.delassus.diagonal()[fixed // d * d]
        self._small = method.prepare(self.delassus, surface.everywhere(surface.bilateral))

    def solve(self, step: StepProblem, rigid: Mask) -> StepResult:
        """Return the answer to a step."""
        found, held, places = self.reactions(step, self.condensed.free(step.b), rigid)
        x, mine = self.condensed.answer(found.r.ravel(), held, places), self._surface.slots
        r_n, r_t = found.r[mine][:, 0].copy(), found.r[mine][:, 1:].copy()
        return StepResult(
            x, r_n, found.active[mine], found.iterations, self._name, r_t=r_t, history=found.history
        )

    def reactions(
        self, step: StepProblem, free: Array, rigid: Mask
    ) -> tuple[FrictionResult, Mask, Array]:
        """Return the reactions for contact unknowns that would be ``free``, and where they are put.

        Closed points on a rigid support are put on their bound, those that stick where they were,
        which removes round-off only.
        """
        surface = self._surface
        assert step.slip0 is not None
        none = np.zeros(surface.count)
        rest = step.friction_at(np.zeros_like(step.slip0))
        cohesion, slope = (
            limit_of(rest, none, surface.weights, step.scale),
            slope_of(rest, surface.weights),
        )
        given = surface.everywhere(
            np.column_stack([step.bound, step.slip0, cohesion, slope, step.active])
        )
        places, (cohesion, slope, closed) = given[:, :-3], given[:, -3:].T
        q = places - free.reshape(places.shape)
        active = closed > 0.0

        def solved(mu: Array, before: FrictionResult | None) -> FrictionResult:
            return self._small.solve(q, cohesion, mu, active if before is None else before.r)

        found = self._rates.solve(
            step, rest, slope, solved, lambda found: self._slip(q, found)[surface.slots]
        )
        held = np.repeat(found.stick[:, None], places.shape[1], axis=1)
        held[:, 0] = (found.r[:, 0] != 0.0) & rigid
        held &= found.r.any()
        return found, held.ravel(), places.ravel()

    def solve_many(
        self, many: StepProblem, own: Callable[[int], StepProblem], rigid: Mask
    ) -> Answers:
        """Return the answers to several steps.

        ``many`` holds their rows, ``own`` makes one of them.
        """
        free, (m, d) = (
            self.condensed.free(many.b),
            (len(many.bound), 1 + self._surface.tangents.shape[1]),
        )
        r, places, held = (
            np.zeros((len(free), m, d)),
            np.zeros(free.shape),
            np.zeros(free.shape, dtype=bool),
        )
        active, counts, failed = held[:, :m].copy(), [0] * len(free), dict[int, ViContactError]()
        histories: list[tuple[float, ...]] = [()] * len(free)
        for row in range(len(free)):
            try:
                found, held[row], places[row] = self.reactions(own(row), free[row], rigid)
                r[row], active[row] = found.r, found.active
                counts[row], histories[row] = found.iterations, found.history
            except ViContactError as error:
                failed[row] = error
        x = freeze(self.condensed.answer(r.reshape(free.shape), held, places))
        rows = StepResult(x, r[..., 0].copy(), active, 0, self._name, r_t=r[..., 1:].copy())
        return Answers(rows, counts, failed, histories)

    def _slip(self, q: Array, found: FrictionResult) -> Array:
        """B_t x - slip0 (m, d - 1) of points that rub, exactly zero where they stick."""
        w = q[:, 1:] + (self.delassus @ found.r.ravel()).reshape(q.shape)[:, 1:]
        return np.where(((found.r[:, 0] > 0.0) & ~found.stick)[:, None], -w, 0.0)
