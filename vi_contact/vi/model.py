"""Minimise the quadratic model of an energy between bounds and within a trust region.

    q(s) = F·s + ½ s·J s,    lower <= x + s <= upper,    |s| = (sum J_ii s_i²)^½ <= radius

First comes the Cauchy step, along the projected direction of steepest descent in the norm above.
From there conjugate gradients run on the unknowns that are off their bounds, some rounds, as each
round may bring others onto them.
"""

from typing import Any, NamedTuple

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
CAUCHY_HALVINGS = 60  # of a Cauchy step
SEARCH_HALVINGS = 30  # of a projected search
FLAT = 1e-12  # of the curvature of the diagonal: a curvature that rounding may bring about


class Model:
    """Hold the quadratic model about a judged point; ``close`` frees its preconditioners.

    Attributes:
        point, equations: the judged point, and its equations.
        x, F, J, diagonal: those of the point, of free unknowns.
        low, high: bounds of steps s.
    """

    def __init__(self, point: Judged, layers: OptionLayers) -> None:
        """Make the model of a point; ``layers`` are options of the preconditioner."""
        self.point = point
        self.layers = layers
        self.equations = point.equations
        self.x = point.x
        self.F = point.F
        self.J = point.A
        self.diagonal = point.diagonal
        # Where x lies outside the bounds, a step of zero length does too, and the first one leads
        # between them.
        self.low = point.lower - self.x
        self.high = point.upper - self.x
        self._block: Block | None = None

    def close(self) -> None:
        """Free what the model made. Collective."""
        if self._block is not None:
            self._block.matrix.mat.destroy()
            self._block.precondition.close()
        self._block = None

    def evaluate(self, s: Array) -> float:
        """Return q(s). Collective."""
        return self.equations.dot(s, self.F + 0.5 * (self.J @ s))

    def measure_length(self, s: Array) -> float:
        """Return |s|. Collective."""
        return float(np.sqrt(self.equations.dot(s, self.diagonal * s)))

    def measure_jacobi_step(self) -> float:
        """Return |s| of one step of Jacobi's method between the bounds: a first measure of lengths.

        Collective.
        """
        return self.measure_length(self._clip(-self.F / self.diagonal))

    def minimise(self, radius: float) -> tuple[Array, int]:
        """Return a step s, and the iterations of conjugate gradients that it took. Collective.

        q(s) is well below that of the Cauchy step, and |s| is not above the radius.
        """
        s = self._cauchy(radius)
        residual = self.F + self.J @ s
        first = self._free_size(residual, self._off_bounds(self._clip(0.0 * s)))
        count = 0
        for _ in range(ROUNDS):
            free = self._off_bounds(s)
            size = self._free_size(residual, free)
            if size <= SMALLEST * first or not self.equations.count(free):
                break
            # Superlinear convergence: the closer to the minimum, the more exact the step.
            aim = FORCING
            if not self.point.left:
                aim = min(FORCING, max(SMALLEST, self.point.certificate.worst))
            w, iterations, early = self._conjugate_gradients(free, s, residual, radius, aim)
            count += iterations
            next_s = self._search(s, w, residual)
            if next_s is None:
                break
            s = next_s
            residual = self.F + self.J @ s
            is_same = np.array_equal(self._off_bounds(s), free)
            if early or self.equations.all(is_same):
                break  # the edge of the region is reached, or no further bound
        return s, count

    def find_step_downhill(self, share: float) -> tuple[Array | None, int]:
        """Find a step along a direction of negative curvature. Collective.

        The direction is on the unknowns that no bound holds, and the step on the side where the
        energy is lower.

        Args:
            share: of the length by which, as the curvature says, the energy changes by a part of
                its size.

        Returns:
            The step s, None where conjugate gradients find no such direction, and their iterations.
        """
        direction, iterations = self._negative_direction()
        if direction is None:
            return None, iterations

        # The length.
        self.equations.put(self.x)
        energy = abs(self.equations.evaluate_energy())
        curvature = -self.equations.dot(direction, self.J @ direction)
        length = np.sqrt(2.0 * PART * energy / curvature) * self.measure_length(direction)
        # an energy of zero tells nothing: the size of the field, or of one where there is none
        if length == 0.0:
            length = self.measure_length(np.full_like(self.x, self.equations.size or 1.0))
        s = direction * (share * length / self.measure_length(direction))

        # The side. Of two that differ by rounding the first is taken, whatever the number of ranks.
        sides = [self._clip(s), self._clip(-s)]
        energies = []
        for side in sides:
            self.equations.put(self.x + side)
            energies.append(self.equations.evaluate_energy())
        is_second_lower = energies[0] > energies[1] + EVEN * abs(energies[1])
        return sides[1] if is_second_lower else sides[0], iterations

    def curves_down(self) -> bool:
        """Say whether a direction of negative curvature is found. Collective.

        It is sought on the unknowns that no bound holds.
        """
        direction, _ = self._negative_direction()
        return direction is not None

    def _clip(self, s: Array) -> Array:
        """Return the nearest step that ends between the bounds."""
        return np.clip(s, self.low, self.high)

    def _off_bounds(self, s: Array) -> Mask:
        """Return where x + s is between its bounds and not on one."""
        return np.asarray((s > self.low) & (s < self.high))

    def _free_size(self, residual: Array, free: Mask) -> float:
        """Return the size of the residual at free unknowns, in the norm dual to |s|."""
        r = residual[free]
        return float(np.sqrt(self.equations.dot(r, r / self.diagonal[free])))

    def _cauchy(self, radius: float) -> Array:
        """Return a step along the projected direction of steepest descent, within the radius.

        It is so short, by halvings, that it brings a part of what the slope promises.
        """
        start = self._clip(np.zeros_like(self.x))  # zero, unless x lies outside the bounds
        direction = -(self.F + self.J @ start) / self.diagonal
        base = self.evaluate(start)
        alpha = 1.0
        for _ in range(CAUCHY_HALVINGS):
            s = self._clip(start + alpha * direction)
            slope = -self.equations.dot(s - start, self.diagonal * direction)
            is_near = self.measure_length(s) <= max(radius, self.measure_length(start))
            if is_near and self.evaluate(s) - base <= DESCENT * slope:
                return s
            alpha *= 0.5
        return start

    def _search(self, s: Array, w: Array, residual: Array) -> Array | None:
        """Return the longest step s + beta w, brought between the bounds, that makes q smaller.

        Args:
            s: a step.
            w: the direction.
            residual: F + J s.

        Returns:
            The step, None where no beta = 1, 1/2, 1/4, … makes q smaller.
        """
        base = self.evaluate(s)
        beta = 1.0
        for _ in range(SEARCH_HALVINGS):
            trial = self._clip(s + beta * w)
            slope = self.equations.dot(residual, trial - s)
            if slope < 0.0 and self.evaluate(trial) - base <= DESCENT * slope:
                return trial
            beta *= 0.5
        return None

    def _block_on(self, free: Mask) -> "Block":
        """Return J on the free unknowns with its preconditioner, the last one if it is the same.

        Collective.
        """
        is_same = self._block is not None and np.array_equal(self._block.free, free)
        if self._block is None or not self.equations.all(is_same):
            self.close()
            matrix = as_petsc(PetscAlgebra(self.equations.comm.mpi).block(self.J, free))
            self._block = Block(free, matrix, Preconditioner(matrix, self.layers))
        return self._block

    def _conjugate_gradients(
        self, free: Mask, s: Array, residual: Array, radius: float, aim: float
    ) -> tuple[Array, int, bool]:
        """Solve J w = -residual on the free unknowns, as far as the radius allows. Collective.

        Directions of negative curvature are followed to the edge of the region (T. Steihaug, 1983).

        Args:
            free: unknowns that may move.
            s: the step so far.
            residual: F + J s.
            radius: of the region about x.
            aim: reduction of the residual at which it ends.

        Returns:
            w, zero but for the free unknowns; the iterations; and whether it ended early, at the
            edge or by negative curvature.
        """
        _, block, precondition = self._block_on(free)
        dot = self.equations.dot
        D = self.diagonal[free]
        s_free = s[free]
        held_square = dot(s[~free], self.diagonal[~free] * s[~free])
        w = np.zeros_like(s_free)

        # r is the residual -residual - J w, z = P⁻¹ r with the preconditioner P, d the direction
        # of search, and rz = r·z the square of the residual that is to fall.
        r = -residual[free]
        z = precondition(r)
        d = z.copy()
        rz = dot(r, z)
        first = rz
        count = 0
        early = False
        while count < MOST and rz > aim**2 * first:
            Jd = block @ d
            curvature = dot(d, Jd)

            # How far along d the edge of the region is: |s + w + tau d| = radius, that is
            # a tau² + 2 b tau + c = 0.
            reached = s_free + w
            a = dot(d, D * d)
            b = dot(d, D * reached)
            c = held_square + dot(reached, D * reached) - radius**2
            edge = np.inf
            if np.isfinite(radius):
                edge = (-b + np.sqrt(max(b * b - a * c, 0.0))) / a

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
            before = rz
            rz = dot(r, z)
            d = z + rz / before * d
        full = np.zeros_like(s)
        full[free] = w
        return full, count, early

    def _negative_direction(self) -> tuple[Array | None, int]:
        """Find a direction of negative curvature of J by conjugate gradients. Collective.

        They solve for a load without symmetry, so that each negative eigenvalue has a part in it,
        and meet a direction of negative curvature if there is one, but for rounding.

        Returns:
            A direction on the unknowns that no bound holds, None where none is met, and the number
            of iterations.
        """
        push_up, push_down = self.point.push
        free = self._off_bounds(np.zeros_like(self.x)) & (push_up == 0.0) & (push_down == 0.0)
        if not self.equations.count(free):
            return None, 0

        # Conjugate gradients for J w = load, of which only the directions d are wanted: they end at
        # the first one along which the curvature is below zero by more than rounding.
        load = self.diagonal * _uneven(self.equations.locate_unknowns())
        _, block, precondition = self._block_on(free)
        dot = self.equations.dot
        r = load[free]
        z = precondition(r)
        d = z.copy()
        rz = dot(r, z)
        first = rz
        count = 0
        while count < MOST and rz > PROBED**2 * first:
            Jd = block @ d
            count += 1
            curvature = dot(d, Jd)
            if curvature < -FLAT * dot(d, self.diagonal[free] * d):
                full = np.zeros_like(self.x)
                full[free] = d
                return full, count
            if curvature <= 0.0:
                break
            r = r - rz / curvature * Jd
            z = precondition(r)
            before = rz
            rz = dot(r, z)
            d = z + rz / before * d
        return None, count


class Block(NamedTuple):
    """Hold J on some unknowns."""

    free: Mask
    matrix: PetscMatrix
    precondition: "Preconditioner"


class Preconditioner:
    """Apply an approximate inverse of a symmetric matrix, PETSc's incomplete Cholesky factor.

    It is positive definite also where the matrix is not, as PETSc shifts pivots that would not be.
    """

    def __init__(self, block: PetscMatrix, layers: OptionLayers) -> None:
        """Make it of a matrix, as the options say. Collective."""
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
        for item in (self._pc, self._x, self._y):
            item.destroy()


def _set_up(pc: Any, _layers: OptionLayers) -> None:
    """Set a preconditioner up while its options are in force. Collective."""
    pc.setUp()


def _uneven(places: Array) -> Array:
    """Return values between 1/2 and 3/2 at points (n, 4) of the unit box.

    The last coordinate is that of the component. The values are smooth, and of no symmetry: a load
    with a symmetry of the body would miss directions of negative curvature that lack it.
    """
    return np.asarray(1.0 + 0.5 * np.sin(1.0 + places @ (GOLDEN * np.array([4.0, 3.0, 2.0, 1.0]))))
