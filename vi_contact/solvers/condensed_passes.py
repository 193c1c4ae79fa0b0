"""Make the passes of a step with a joint on its contact unknowns alone.

A pass changes forces at contact unknowns only. With G and the free motion of the base step (a
forward substitution, made once), the free motion under further forces p there is

    x_c = (A⁻¹b)_c + G p

so a pass costs the small problem, and the last one a backward substitution more. Where Newton's
method has found the end of a step already (``Expected``), its reactions are G⁻¹ times what the
contact unknowns have moved by them, and no small problem is solved. ``JointSolver`` uses it where
the solver is ``Condensed``. All arrays here are those of all ranks, on every rank.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import lapack

from ..core.algebra import Array, Mask, max_abs
from ..core.step import StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..kernels.condensation import Condensation


@dataclass(frozen=True)
class PassEnd:
    """Hold where a pass has led, a row for each of the M conditions of all ranks.

    Attributes:
        gap: what is left of the gap (M,) [m].
        slip: of the step (M, d - 1) [m], zero where a point sticks.
        r: reactions (M, d) of r', ``scale`` times newtons.
        closed: (M,).
        sticks: (M,) closed points that do not slip.
        held: (M d,) which contact unknowns are held.
        values: (M d,) where.
        iterations: of the small problem.
    """

    gap: Array
    slip: Array
    r: Array
    closed: Mask
    sticks: Mask
    held: Mask
    values: Array
    iterations: int


@dataclass(frozen=True)
class Expected:
    """Hold where a step is expected to end, a row for each of the M conditions of all ranks.

    Attributes:
        gap: what is left of the gap (M,) [m], zero where a point is closed.
        slip: of the step (M, d - 1) [m], zero where a point sticks.
        closed: (M,).
        sticks: (M,) points that do not slip.
    """

    gap: Array
    slip: Array
    closed: Mask
    sticks: Mask


class CondensedPasses:
    """Solve steps that differ in their forces at contact unknowns from a base step.

    Attributes:
        surface: the contact conditions.
        flexibility: G, with the compliance of the support.
        width: d, or 1 without friction: contact unknowns of a condition.
    """

    def __init__(
        self,
        condensed: Condensation,
        small: Callable[[StepProblem, Array, Array | None], Any],
        flexibility: Array,
        compliance: Array,
        surface: ContactSurface,
        rigid: Mask,
        name: str,
        *,
        prepare: Callable[[Array], Callable[[StepProblem, Array, Array | None], Any]],
    ) -> None:
        """Hold A condensed.

        Args:
            condensed: A, condensed onto the contact unknowns.
            small: (step, free motion, reactions to begin with) -> (r, gap and minus slip, closed,
                sticks, held, values, iterations) of all ranks.
            flexibility: G, with the compliance.
            compliance: of the contact unknowns, over the scale.
            surface: the contact conditions.
            rigid: (M,) which supports are.
            name: of the method.
            prepare: makes what ``small`` is for another flexibility.
        """
        self._condensed = condensed
        self._prepare = prepare
        self._small = small
        self.flexibility = flexibility
        self._compliance = compliance
        self.surface = surface
        self._rigid = rigid
        self._name = name
        self.width = len(compliance) // max(surface.total, 1)
        self._free = self._b = np.zeros(0)
        self._is_spent = False

    @cached_property
    def stiffness(self) -> Array | None:
        """Return G⁻¹; None where it is not positive definite to rounding."""
        factor, info = lapack.dpotrf(self.flexibility, lower=1)
        if info:
            return None
        inverse, info = lapack.dpotri(factor, lower=1)
        return None if info else np.tril(inverse) + np.tril(inverse, -1).T

    def begin(self, base: StepProblem) -> None:
        """Find the free motion of a step. Collective."""
        self._b = base.b
        self._free = self._condensed.find_free_motion(base.b)
        self._is_spent = False

    def make(self, step: StepProblem, push: Array, before: PassEnd | None = None) -> PassEnd:
        """Return where a step leads whose loads are those of the base and a push. Collective.

        Args:
            step: with its own bound and friction.
            push: the further forces (M d,) at contact unknowns, ``scale`` times newtons.
            before: the pass before in this step, from which the search begins; None: the first.
        """
        near = None if before is None else before.r
        free = self._move(push)
        r, moved, closed, sticks, held, values, iterations = self._small(step, free, near)
        slip = np.where(sticks[:, None], 0.0, -moved[:, 1:])
        return PassEnd(moved[:, 0], slip, r, closed, sticks, held, values, iterations)

    def make_sprung(
        self, step: StepProblem, push: Array, opened: Array, springs: Array
    ) -> Expected | None:
        """Return where a step leads whose tension follows the opening on springs. Collective.

        The push has the tension at some openings g, which is F + S (gap - g) at others. With
        H = G⁻¹ and the free gaps q of the push

            (H + S) moved = H q + S g + r,

        which is a small problem with the flexibility (H + S)⁻¹. None where H + S is not positive.

        Args:
            step: with its own bound and friction.
            push: the further forces (M d,) at contact unknowns, ``scale`` times newtons.
            opened: g (M,) [m].
            springs: S (M,), ``scale`` times N/m.
        """
        assert self.stiffness is not None  # whoever asks has looked
        matrix = self.stiffness.copy()
        normal = np.arange(len(opened)) * self.width
        matrix[normal, normal] += springs
        factor, info = lapack.dpotrf(matrix, lower=1)
        if info:
            return None
        inverse, _ = lapack.dpotri(factor, lower=1)
        flexibility = np.tril(inverse) + np.tril(inverse, -1).T

        # The springs pull from where they are without reactions.
        values = self._read_values(step).ravel()
        q = values - self._move(push)
        q = q + flexibility[:, normal] @ (springs * (opened - q[normal]))
        _, moved, closed, sticks, *_ = self._prepare(flexibility)(step, values - q, None)
        gap = np.where(closed, 0.0, np.maximum(moved[:, 0], 0.0))
        return Expected(gap, np.where(sticks[:, None], 0.0, -moved[:, 1:]), closed, sticks)

    def _move(self, push: Array) -> Array:
        """Return the contact unknowns (M d,) [m] without reactions, under a further push."""
        return self._free + self.flexibility @ push - self._compliance * push

    def balance(self, step: StepProblem, push: Array, expected: Expected) -> PassEnd:
        """Return an expected end with the reactions that hold it there. Collective.

        They may miss the conditions of contact and friction: ``settle`` looks.

        Args:
            step: with its own bound and friction.
            push: the further forces (M d,) at contact unknowns, ``scale`` times newtons.
            expected: where the step ends.
        """
        assert self.stiffness is not None  # whoever asks has looked
        values = self._read_values(step)

        # The reactions move the contact unknowns from where they would be without any.
        moved = np.column_stack([expected.gap, -expected.slip])
        q = values - self._move(push).reshape(values.shape)
        r = (self.stiffness @ (moved - q).ravel()).reshape(values.shape)
        held = np.zeros(values.size, dtype=bool)
        places = (expected.gap, expected.slip, r, expected.closed, expected.sticks)
        return PassEnd(*places, held, (values - moved).ravel(), 0)

    def _read_values(self, step: StepProblem) -> Array:
        """Return bounds and slips before (M, d) [m] of all conditions. Collective."""
        columns = [step.bound[:, None]]
        if step.slip0 is not None:
            columns.append(step.slip0)
        return np.asarray(self.surface.everywhere(np.hstack(columns)))

    def settle(
        self, step: StepProblem, end: PassEnd, *, force: float = 0.0
    ) -> tuple[PassEnd, float]:
        """Return an end with its reactions put onto their conditions, and by how much. Collective.

        Args:
            step: with its own bound and friction.
            end: what ``balance`` has returned.
            force: of a joint whose tension is on springs, ``scale`` times newtons. Reactions may be
                rounding beside it, and open points are held where they are expected.

        Returns:
            The end, and the largest change of a reaction over the largest reaction.
        """
        r = end.r.copy()
        r[:, 0] = np.where(end.closed, np.maximum(r[:, 0], 0.0), 0.0)
        beyond = np.zeros(1)

        # Points that slip are on their limit, along the slip; those that stick stay within it.
        if self.width > 1:
            limit = self._find_limit(step, r[:, 0])
            way = np.linalg.norm(end.slip, axis=1)
            goes = ~end.sticks & (way > 0.0)
            e = np.divide(end.slip, way[:, None], out=np.zeros(end.slip.shape), where=goes[:, None])
            beyond = np.where(goes, 0.0, np.linalg.norm(r[:, 1:], axis=1) - limit)
            r[:, 1:] = np.where(goes[:, None], limit[:, None] * e, r[:, 1:])
        size = max(max_abs(end.r), force)
        missing = max(max_abs(r - end.r), beyond.max(initial=0.0)) / (size or 1.0)
        held = np.repeat(end.sticks[:, None], self.width, axis=1)
        held[:, 0] = (r[:, 0] != 0.0) & self._rigid
        held &= bool(r.any())
        if force > 0.0:
            # A tension on a steep line feels the rounding of an opening: it stays as expected.
            held[:, 0] |= ~end.closed & self._rigid
        return replace(end, r=r, held=held.ravel()), float(missing)

    def _find_limit(self, step: StepProblem, r_n: Array) -> Array:
        """Return the largest tangential reactions (M,) at normal ones (M,). Collective."""
        law: Any = step.friction
        both = np.column_stack([step.scale * law.cohesion, law.mu])
        cohesion, mu = np.asarray(self.surface.everywhere(both)).T
        return np.asarray(cohesion + mu * r_n)

    def finish(self, push: Array, end: PassEnd) -> StepResult:
        """Return the answer of the last pass, by a backward substitution. Collective.

        Args:
            push: its further forces (M d,).
            end: where it has led.
        """
        x = self._condensed.answer(end.r.ravel() - push, end.held, end.values)
        r = self.surface.mine(end.r)
        return StepResult(
            x,
            r_n=r[:, 0].copy(),
            active=self.surface.mine(end.closed),
            iterations=end.iterations,
            method=self._name,
            r_t=r[:, 1:].copy() if self.width > 1 else None,
        )
