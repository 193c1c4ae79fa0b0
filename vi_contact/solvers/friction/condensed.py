"""Condense with friction: one Delassus operator of normal and tangential contact unknowns.

With the unit vectors E of the normal and F of the tangential unknowns, x_free = A⁻¹b and D = [E F]:

    G = DᵀA⁻¹D (+ compliance/scale on the normal diagonal)
        node by node: r_n, then r_t: ``kernels.condensation``
    q_n = bound - Eᵀx_free,   q_t = slip0 - Fᵀx_free
        gap, and minus the slip, without reactions
    the small problem of ``problem`` gives r;   x = A⁻¹(b - E r_n - F r_t)

A law that depends on the slip rate makes this a sequence of such problems: ``slip_rate``.

Tangential unknowns that are prescribed carry no reaction: their rows are replaced by those of a
free spring. Conditions that are traces may depend on one another: ``hyperstatic``.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Mask, freeze
from ...core.collective import ask_limit, ask_slope
from ...core.errors import ViContactError
from ...core.step import Answers, StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ...kernels.bodies import CondensedBodies
from ...kernels.condensation import Condensation
from .floating import Border, FloatingNewton
from .hyperstatic import Hyperstatic
from .problem import FrictionMethod, FrictionResult
from .rings import find_rings
from .slip_rate import RateIteration


class CondensedFriction:
    """Solve the small problem with friction of one A.

    A is condensed onto its normal and tangential contact unknowns.

    Attributes:
        condensed: A, condensed.
        small: what solves the small problem.
        delassus: G (m d, m d), an array, or sparse (``kernels.bodies``).
    """

    def __init__(
        self,
        method: FrictionMethod,
        condensed: Condensation,
        surface: ContactSurface,
        *,
        rates: RateIteration,
        border: Border | None = None,
    ) -> None:
        """Prepare the method for the flexibility of the contact unknowns.

        Args:
            method: for the small problem.
            condensed: A, condensed; its flexibility is changed.
            surface: the contact surface.
            rates: iteration for laws that depend on the slip rate.
            border: of bodies that contact alone holds, with traces and a sparse flexibility; None
                where rigid motions are no unknowns.
        """
        self._surface = surface
        self._rates = rates
        self._name = f"condensed {type(method).__name__}"
        self.condensed = condensed
        self.delassus = condensed.flexibility

        # The row of a prescribed tangent is that of a spring as soft as the normal of its node.
        d = 1 + surface.tangents.shape[1]
        prescribed = np.flatnonzero(~condensed.movable)
        normal = prescribed // d * d
        soft = self.delassus.diagonal()[normal]
        if sp.issparse(self.delassus):
            entries = (soft, (prescribed, prescribed))
            self.delassus = sp.csr_matrix(
                self.delassus + sp.coo_matrix(entries, shape=self.delassus.shape)
            )
        else:
            self.delassus[prescribed, prescribed] = soft
        bilateral = surface.everywhere(surface.bilateral)
        if surface.traces is None:
            self.small: Any = method.prepare(self.delassus, bilateral)
        else:
            # What a spring carries shows in its length, as if it were an unknown of its own.
            soft = surface.everywhere(surface.compliance) > 0.0
            rows = d * np.flatnonzero(soft)
            lengths = sp.csr_matrix(
                (np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(d * len(soft), len(rows))
            )
            B = sp.csr_matrix(sp.hstack([surface.traces.every, lengths]))
            given: dict[str, Any] = {
                "rings": find_rings(B, condensed.movable, d),
                "weights": surface.everywhere(surface.weights),
                "movable": condensed.movable,
            }
            if border is not None:
                self.small = FloatingNewton(
                    method, self.delassus, bilateral, border=border, **given
                )
                return
            self.small = Hyperstatic(
                method,
                self.delassus,
                bilateral,
                touched=self._find_touched(),
                points=surface.everywhere(surface.points),
                **given,
            )

    def _find_touched(self) -> sp.csr_matrix | None:
        """Return which bodies conditions read, (m, bodies), where they are condensed by bodies."""
        if isinstance(self.condensed, CondensedBodies):
            return self.condensed.find_touched()
        return None

    def solve(self, step: StepProblem, rigid: Mask) -> StepResult:
        """Return the answer to a step; ``rigid`` (m,) says which supports are. Collective."""
        answer, held, values = self.reactions(step, self.condensed.find_free_motion(step.b), rigid)
        x = self.condensed.answer(answer.r.ravel(), held, values)
        mine = self._surface.slots
        r = answer.r[mine]
        return StepResult(
            x,
            r_n=r[:, 0].copy(),
            active=answer.active[mine],
            iterations=answer.iterations,
            method=self._name,
            r_t=r[:, 1:].copy(),
            history=answer.history,
            corrects_slowly=sp.issparse(self.delassus),
        )

    def reactions(
        self,
        step: StepProblem,
        free: Array,
        rigid: Mask,
        near: Array | None = None,
        small: Any = None,
    ) -> tuple[FrictionResult, Mask, Array]:
        """Return the reactions of a step, and where contact unknowns are put. Collective.

        Closed points on a rigid support are put on their bound, those that stick where they were,
        which removes round-off only.

        Args:
            step: the step.
            free: (m d,) contact unknowns without reactions.
            rigid: (m,) which supports are.
            near: reactions (m, d) of a step like it, to begin with; None: the contact set.
            small: what solves the small problem of another flexibility; None: ``self.small``.

        Returns:
            The answer to the small problem; which contact unknowns (m d,) are held, and on what
            values (m d,).
        """
        surface = self._surface
        assert step.slip0 is not None

        # All ranks get the problem of all conditions: bounds, and the law with the coefficients of
        # rest.
        rest = step.friction_at(np.zeros_like(step.slip0))
        cohesion = ask_limit(rest, np.zeros(surface.count), surface.weights, step.scale)
        slope = ask_slope(rest, surface.weights)
        columns = np.column_stack([step.bound, step.slip0, cohesion, slope, step.active])
        of_all = surface.everywhere(columns)
        values = of_all[:, :-3]
        cohesion, slope, closed = of_all[:, -3:].T
        q = values - free.reshape(values.shape)
        active = closed > 0.0

        def solve(mu: Array, before: FrictionResult | None) -> FrictionResult:
            """Solve the small problem of all conditions with coefficients mu."""
            guess = (active if near is None else near) if before is None else before.r
            return (small or self.small).solve(q, cohesion, mu, guess)

        def slip_of(answer: FrictionResult) -> Array:
            """Return the slip of the conditions of this rank."""
            return self._compute_slip(q, answer)[surface.slots]

        answer = self._rates.solve(step, rest, slope, solve, slip_of)

        # Where no point carries anything, nothing is held.
        held = np.repeat(answer.stick[:, None], values.shape[1], axis=1)
        held[:, 0] = (answer.r[:, 0] != 0.0) & rigid
        held &= answer.r.any()
        return answer, held.ravel(), values.ravel()

    def solve_many(
        self, many: StepProblem, own: Callable[[int], StepProblem], rigid: Mask
    ) -> Answers:
        """Return the answers to several steps of this A, on one rank.

        Args:
            many: the steps; its arrays have a row for each.
            own: makes the step of one row.
            rigid: (m,) which supports are.
        """
        free = self.condensed.find_free_motion(many.b)
        k = len(free)
        m = many.bound.shape[-1]
        d = 1 + self._surface.tangents.shape[1]
        r = np.zeros((k, m, d))
        values = np.zeros(free.shape)
        held = np.zeros(free.shape, dtype=bool)
        active = np.zeros((k, m), dtype=bool)
        counts = [0] * k
        histories: list[tuple[float, ...]] = [()] * k
        failed: dict[int, ViContactError] = {}
        for row in range(k):
            try:
                answer, held[row], values[row] = self.reactions(own(row), free[row], rigid)
            except ViContactError as error:
                failed[row] = error
                continue
            r[row] = answer.r
            active[row] = answer.active
            counts[row] = answer.iterations
            histories[row] = answer.history
        x = freeze(self.condensed.answer(r.reshape(free.shape), held, values))
        rows = StepResult(x, r[..., 0].copy(), active, 0, self._name, r_t=r[..., 1:].copy())
        return Answers(rows, counts, failed, histories)

    def _compute_slip(self, q: Array, answer: FrictionResult) -> Array:
        """Return B_t x - slip0 (m, d - 1) of points under pressure, zero where they stick."""
        moved = (self.delassus @ answer.r.ravel()).reshape(q.shape)
        w_t = q[:, 1:] + moved[:, 1:]
        slips = (answer.r[:, 0] > 0.0) & ~answer.stick
        return np.where(slips[:, None], -w_t, 0.0)
