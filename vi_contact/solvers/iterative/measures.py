"""Measure an iterate as the certificate of the step will (``core.verify``), with reductions of a few numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Comm, max_abs
from ...core.step import StepProblem
from ...core.verify import ROUNDED
from .contact import Contact


@dataclass(frozen=True)
class Measures:
    """Hold what residuals are relative to: forces of the equilibrium, reactions, displacements; maxima over ranks."""

    force: float
    reaction: float
    displacement: float


class Measured:
    """Measure the iterates of one step. ``load``: b, padded."""

    def __init__(self, step: StepProblem, load: Array) -> None:
        self._comm: Comm = step.surface.comm
        self._largest = step.A.largest
        self._b, self._guess = max_abs(load), max_abs(step.guess)

    def __call__(self, contact: Contact, x: Array, residual: Array, load: Array) -> Measures:
        """Return the references at x, where ``residual`` is ``load`` - (A + K_s) x. Collective."""
        local = np.array([self._b, contact.body_forces(x, residual, load), max_abs(x), self._guess,
                          max_abs(contact.reactions(x, residual))])
        b, Ax, size, guess, reaction = self._comm.max(np.where(np.isnan(local), np.inf, local))
        return Measures(max(b, Ax, ROUNDED * self._largest * size), max(b, reaction), max(size, guess))


def largest_free(comm: Comm, residual: Array, weights: Array) -> float:
    """Return the largest residual of the unknowns that are not held, infinite where it is not a number. Collective."""
    value = max_abs(np.where(weights > 0.0, residual, 0.0))
    return float(comm.max(np.array([np.inf if np.isnan(value) else value]))[0])
