"""Minimise the quadratic model of an energy between bounds and within a trust region.

    q(s) = F·s + ½ s·J s,    lower <= x + s <= upper,    |s| = (sum J_ii s_i²)^½ <= radius

First comes the Cauchy step, along the projected direction of steepest descent in the norm above.
From there conjugate gradients run on the unknowns that are off their bounds, some rounds, as each
round may bring others onto them.
"""

from typing import Any

import numpy as np
from petsc4py import PETSc

from ..core.algebra import Array, Mask
from ..core.matrix_checks import GOLDEN
from ..fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..solvers.volume.options import OptionLayers
from .judged import Judged

DESCENT = 1e-2  # part of the slope's promise that a Cauchy step or a projected search must bring
ROUNDS = 20  # of conjugate gradients, each on the unknowns that are then off their bounds
FORCING = 1e-2  # how far a round of conjugate gradients reduces the residual of the model, at most
SMALLEST = 1e-10  # and at least
PROBED = 1e-8  # reduction of the residual of the search for negative curvature
PART = 0.02  # of the energy, by which the first step along negative curvature changes it
EVEN = 1e-9  # of the energy: two sides of a hill that differ by less are equal
MOST = 2000  # conjugate gradient iterations of a round


class Model:
    """Hold the quadratic model about a judged point; ``close`` frees its preconditioners."""

    def __init__(self, point: Judged, layers: OptionLayers) -> None:
        self.point, self.layers, self.problem = point, layers, point.problem
        self.x, self.F, self.J, self.diagonal = point.x, point.F, point.A, point.diagonal
        # Where x lies outside the bounds, a step of zero length does too, and the first one leads
        # between them.
        self.low, self.high = point.lower - self.x, point.upper - self.x
        self._kept: tuple[Mask, PetscMatrix, Preconditioner] | None = None

    def close(self) -> None:
        """Free what the model made. Collective."""
        if self._kept is not None:
            self._kept[1].mat.destroy()
            self._kept[2].close()
        self._kept = None

    def value(self, s: Array) -> float:
        """Return q(s). Collective."""
        return self.problem.dot(s, self.F + 0.5 * (self.J @ s))

    def length(self, s: Array) -> float:
        """Return |s|. Collective."""
        return float(np.sqrt(self.problem.dot(s, self.diagonal * s)))

    def jacobi_step(self) -> float:
        """Return |s| of one step of Jacobi's method between the bounds: a first measure of lengths.

        Collective.
        """
        return self.length(self._projected(-self.F / self.diagonal))

    def minimise(self, radius: float) -> tuple[Array, int]:
        """Return (s, iterations of conjugate gradients).

        q(s) is well below that of the Cauchy step. Collective.
        """
        s = self._cauchy(radius)
        residual = self.F + self.J @ s
        first = self._free_size(residual, self._off_bounds(self._projected(0.0 * s)))
        count = 0
        for _ in range(ROUNDS):
            free = self._off_bounds(s)
            size = self._free_size(residual, free)
            if size <= SMALLEST * first or not self.problem.count(free):
                break
            # Superlinear convergence: the closer to the minimum, the more exact the step.
            aim = min(
                FORCING,
                max(SMALLEST, self.point.certificate.worst if not self.point.left else FORCING),
            )
            w, its, ended = self._conjugate_gradients(free, s, residual, radius, aim)
            count += its
            s_next = self._search(s, w, residual)
            if s_next is None:
                break
            s = s_next
            residual = self.F + self.J @ s
            same = np.array_equal(self._off_bounds(s), free)
            if ended or self.problem.all(same):
                break  # the edge of the region is reached, or no further bound
        return s, count

    def downward(self, share: float) -> tuple[Array | None, int]:
        """Return (s, iterations), a step along a direction of negative curvature.

        The direction is on the unknowns that no bound holds, and the step on the side where the
        energy is lower. s is None where conjugate gradients find no such direction. Its length is
        this share of one that, by the curvature, changes the energy by a part of its size.
        Collective.
        """
        direction, its = self._negative()
        if direction is None:
            return None, its
        self.problem.put(self.x)
        energy = abs(self.problem.energy())
        curvature = -self.problem.dot(direction, self.J @ direction)
        length = np.sqrt(2.0 * PART * energy / curvature) * self.length(direction)
        # an energy of zero tells nothing: the size of the field, or of one where there is none
        if length == 0.0:
            length = self.length(np.full_like(self.x, self.problem.size or 1.0))
        s = direction * (share * length / self.length(direction))
        sides = [self._projected(one) for one in (s, -s)]
        energies = []
        for one in sides:
            self.problem.put(self.x + one)
            energies.append(self.problem.energy())
        # Of two sides that differ by rounding the first is taken, whatever the number of ranks.
        second = energies[0] > energies[1] + EVEN * abs(energies[1])
        return sides[1] if second else sides[0], its

    def curves_down(self) -> bool:
        """Say whether a direction of negative curvature is found. Collective.

        It is sought on the unknowns that no bound holds.
        """
        return self._negative()[0] is not None

    def _projected(self, s: Array) -> Array:
        """Return the nearest step that ends between the bounds."""
        return np.clip(s, self.low, self.high)

    def _off_bounds(self, s: Array) -> Mask:
        """Where x + s is between its bounds and not on one."""
        return np.asarray((s > self.low) & (s < self.high))

    def _free_size(self, residual: Array, free: Mask) -> float:
        """Return the size of the residual at free unknowns, in the norm dual to |s|."""
        r = residual[free]
        return float(np.sqrt(self.problem.dot(r, r / self.diagonal[free])))

    def _cauchy(self, radius: float) -> Array:
        """Return a step along the projected direction of steepest descent.

        It brings a part of what the slope promises.
        """
        start = self._projected(np.zeros_like(self.x))  # zero, unless x lies outside the bounds
        direction = -(self.F + self.J @ start) / self.diagonal
        base = self.value(start)
        alpha = 1.0
        for _ in range(60):
            s = self._projected(start + alpha * direction)
            slope = -self.problem.dot(s - start, self.diagonal * direction)
            if (
                self.length(s) <= max(radius, self.length(start))
                and self.value(s) - base <= DESCENT * slope
            ):
                return s
            alpha *= 0.5
        return start

    def _search(self, s: Array, w: Array, residual: Array) -> Array | None:
        """Return the longest step s + beta w, brought between the bounds, that makes q smaller.

        It is None where none does.
        """
        base, beta = self.value(s), 1.0
        for _ in range(30):
            trial = self._projected(s + beta * w)
            slope = self.problem.dot(residual, trial - s)
            if slope < 0.0 and self.value(trial) - base <= DESCENT * slope:
                return trial
            beta *= 0.5
        return None

    def _block(self, free: Mask) -> tuple[PetscMatrix, "Preconditioner"]:
        """J on the free unknowns and its preconditioner; the last one is kept."""
        if self._kept is None or not self.problem.all(np.array_equal(self._kept[0], free)):
            self.close()
            block = as_petsc(PetscAlgebra(self.problem.comm.mpi).block(self.J, free))
            self._kept = free, block, Preconditioner(block, self.layers)
        return self._kept[1], self._kept[2]

    def _conjugate_gradients(
        self, free: Mask, s: Array, residual: Array, radius: float, aim: float
    ) -> tuple[Array, int, bool]:
        """Return (w, iterations, whether it ended early), w on the free unknowns.

        J w = -residual or as far towards it as the radius allows, counted from x. Directions of
        negative curvature are followed to the edge (T. Steihaug, 1983).
        """
        block, precondition = self._block(free)
        dot, D, s0 = self.problem.dot, self.diagonal[free], s[free]
        outside = self.problem.dot(s[~free], self.diagonal[~free] * s[~free])
        w, r = np.zeros_like(s0), -residual[free]
        z = precondition(r)
        d, rz, first = z.copy(), dot(r, z), 0.0
        first, count, early = rz, 0, False
        while count < MOST and rz > aim**2 * first:
            Jd = block @ d
            curvature = dot(d, Jd)
            # How far along d the edge of the region is: |s + w + tau d| = radius.
            a, b, c = (
                dot(d, D * d),
                dot(d, D * (s0 + w)),
                outside + dot(s0 + w, D * (s0 + w)) - radius**2,
            )
            edge = (-b + np.sqrt(max(b * b - a * c, 0.0))) / a if np.isfinite(radius) else np.inf
            count += 1
            if curvature <= 0.0 or rz / curvature >= edge:
                early = True
                if np.isfinite(edge):
                    w = w + max(edge, 0.0) * d
                elif count == 1:
                    w = d.copy()  # no edge: as long as a step of the preconditioner
                break
            w = w + rz / curvature * d
            r = r - rz / curvature * Jd
            z = precondition(r)
            rz, before = dot(r, z), rz
            d = z + rz / before * d
        full = np.zeros_like(s)
        full[free] = w
        return full, count, early

    def _negative(self) -> tuple[Array | None, int]:
        """Return (a direction of negative curvature of J or None, iterations).

        The direction is on the unknowns that no bound holds; the iterations are those of conjugate
        gradients.
        """
        free = (
            self._off_bounds(np.zeros_like(self.x))
            & (self.point.push[0] == 0.0)
            & (self.point.push[1] == 0.0)
        )
        if not self.problem.count(free):
            return None, 0
        load = self.diagonal * _uneven(self.problem.places())
        block, precondition = self._block(free)
        dot, r = self.problem.dot, load[free]
        z = precondition(r)
        d, rz = z.copy(), dot(r, z)
        first, count = rz, 0
        while count < MOST and rz > PROBED**2 * first:
            Jd, count = block @ d, count + 1
            curvature = dot(d, Jd)
            if curvature < -1e-12 * dot(d, self.diagonal[free] * d):
                full = np.zeros_like(self.x)
                full[free] = d
                return full, count
            if curvature <= 0.0:
                break
            r = r - rz / curvature * Jd
            z = precondition(r)
            rz, before = dot(r, z), rz
            d = z + rz / before * d
        return None, count


class Preconditioner:
    """Apply an approximate inverse of a symmetric matrix.

    It is positive definite also where the matrix is not: PETSc's incomplete Cholesky factor, which
    shifts what would not be.
    """

    def __init__(self, block: PetscMatrix, layers: OptionLayers) -> None:
        self._x, self._y = block.mat.createVecs()
        self._pc = PETSc.PC().create(block.mat.comm)
        self._pc.setOptionsPrefix(layers.prefix)
        block.mat.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._pc.setOperators(block.mat)
        layers.apply(self._pc, _set_up)

    def __call__(self, r: Array) -> Array:
        """Return the preconditioned r."""
        self._x.array[:] = r
        self._pc.apply(self._x, self._y)
        return np.array(self._y.array_r)

    def close(self) -> None:
        """Free the PETSc objects. Collective."""
        for one in (self._pc, self._x, self._y):
            one.destroy()


def _set_up(pc: Any, _layers: OptionLayers) -> None:
    """Set a preconditioner up while its options are in force. Collective."""
    pc.setUp()


def _uneven(places: Array) -> Array:
    """Return values between 1/2 and 3/2 at points (n, 4) of the unit box.

    The last coordinate is that of the component. The values are smooth, and of no symmetry.
    """
    return np.asarray(1.0 + 0.5 * np.sin(1.0 + places @ (GOLDEN * np.array([4.0, 3.0, 2.0, 1.0]))))
