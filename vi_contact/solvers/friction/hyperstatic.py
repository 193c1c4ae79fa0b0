"""Solve contact with friction where conditions share unknowns, and G = B A⁻¹ Bᵀ may be singular.

Displacements and total forces are unique for given limits all the same (``rings``). The steps are

1. a moving shift: any method solves with  G + σ Z Zᵀ,  q - σ Z Zᵀ r_before,  Z the forces without
   effect, and again with the new r. Where r does not change any more the shift has no effect, and
   the answer is that of G itself. This is the proximal point method (Rockafellar, SIAM J. Control
   Optim. 14, 1976), in the directions alone in which G says nothing;
2. Gauss-Seidel sweeps by conditions where a method fails, ever more, and the shift from there;
3. in the plane, with few conditions, all their states one after another (``enumeration``);
4. the least of all splits over each ring (``least_forces``).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Mask, max_abs
from ...core.errors import StepFailure
from .enumeration import MOST_CONDITIONS, find_by_states
from .kept_factor import KeptFactor
from .least_forces import States, split_least
from .nsgs import make_sweep
from .problem import STILL, FrictionMethod, FrictionResult, ScaledDelassus, ScaledProblem
from .rings import Ring
from .sparse import SparseDelassus, SparseNewton

SHIFT = 1e-3  # σ over what conditions give way alone: larger takes more passes, smaller more digits
PASSES = 30
SLOW = 0.5  # a pass that leaves more of the residual has reached rounding
TOLERANCE = 1e-8  # of the residual of r = 0, above which an answer is refused; passes go on below
SWEEPS = (10, 100, 1000)  # before another attempt
FEW_SWEEPS = (1, 3, 10, 30)  # the same with a sparse G, where a sweep takes as long as a step

Walked = tuple[Array, int, list[float]]  # reactions, iterations, residuals on the way


class Hyperstatic:
    """Solve the small problems of one G, whose conditions share unknowns."""

    def __init__(
        self,
        method: FrictionMethod,
        G: Any,
        bilateral: Mask,
        *,
        rings: list[Ring],
        weights: Array,
        movable: Mask,
        touched: sp.csr_matrix | None = None,
        points: Array | None = None,
    ) -> None:
        """Prepare the method for G, shifted where traces depend on one another.

        Args:
            method: for the small problems.
            G: (m d, m d) Delassus operator, an array, or sparse with FrictionNewton.
            bilateral: (m,) which conditions may pull.
            rings: groups whose traces depend on one another.
            weights: (m,) lengths or areas.
            movable: (m d,) which tangents are not prescribed, True for normals.
            touched: (m, bodies) which bodies conditions read, with a sparse G.
            points: (m, dimension) where conditions are, with a sparse G [m].
        """
        self._method = method
        self._rings = rings
        self._weights = weights
        self._movable = movable.reshape(len(bilateral), -1)
        self._last: Array | None = None
        self._is_sparse = sp.issparse(G)
        if self._is_sparse:
            self._delassus: ScaledDelassus = SparseDelassus(G, bilateral)
            assert touched is not None and points is not None
            shift = self._make_sparse_shift(G)
            self._small: Any = SparseNewton(
                method, G, shift, bilateral, touched=touched, points=points
            )
            return
        self._delassus = ScaledDelassus(G, bilateral, unsymmetric=True)
        self._strength = 0.0
        if rings:
            # What conditions give way while all others are held, as springs in series with them.
            largest = self._add_shift(G, max_abs(G))
            alone = 1.0 / np.diag(np.linalg.inv(largest))
            self._strength = SHIFT * float(np.median(alone[movable]))
        self._small = method.prepare(self._add_shift(G, self._strength), bilateral)

    @property
    def kept(self) -> KeptFactor:
        """Return the factor of linear problems, of a sparse G."""
        kept: KeptFactor = self._small.kept
        return kept

    def _find_alone_in_rings(self, G: sp.csr_matrix) -> float:
        """Return what conditions of rings give way while all others of their ring are held."""
        largest = max_abs(G.data)
        alone = []
        for ring in self._rings:
            places = ring.places(self._movable.shape[1])
            block = G[places][:, places].toarray() + largest * ring.null @ ring.null.T
            moves = self._movable[ring.conditions].ravel()
            alone.append((1.0 / np.diag(np.linalg.inv(block)))[moves])
        return float(np.median(np.concatenate(alone)))

    def _add_shift(self, G: Array, strength: float) -> Array:
        """Return G + strength Z Zᵀ, a copy."""
        shifted = G.copy()
        for ring in self._rings:
            places = ring.places(self._movable.shape[1])
            shifted[np.ix_(places, places)] += strength * ring.null @ ring.null.T
        return shifted

    def _make_sparse_shift(self, G: sp.csr_matrix) -> sp.csr_matrix:
        """Return σ Z Zᵀ, sparse."""
        rows, columns, values = [], [], []
        strength = SHIFT * self._find_alone_in_rings(G) if self._rings else 0.0
        for ring in self._rings:
            places = ring.places(self._movable.shape[1])
            rows.append(np.repeat(places, len(places)))
            columns.append(np.tile(places, len(places)))
            values.append(strength * (ring.null @ ring.null.T).ravel())
        if not rows:
            return sp.csr_matrix(G.shape)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csr_matrix(sp.coo_matrix(entries, shape=G.shape))

    def _shift(self, r: Array) -> Array:
        """Return σ Z Zᵀ r (m, d) of reactions (m, d)."""
        shift = np.zeros(r.size)
        flat = r.ravel()
        for ring in self._rings:
            places = ring.places(r.shape[1])
            shift[places] = self._strength * (ring.null @ (ring.null.T @ flat[places]))
        return shift.reshape(r.shape)

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Solve problem (1) of ``problem``.

        Args:
            q: (m, d) gap, and minus the slip, without reactions.
            cohesion: (m,) [as r].
            slope: (m,).
            guess: (m,) predicted contact set, or reactions (m, d).

        Raises:
            StepFailure: no method has an answer.
        """
        step = self._delassus.problem(q, cohesion, slope)

        def walk(before: Array, start: Array | Mask | None, count: int) -> Walked:
            """Go from reactions before, and a guess, to where the shift has no effect."""
            if self._is_sparse:
                last = self._small.solve(step, start)
                return last.r, count + last.iterations, list(last.history)

            def solve_shifted(before: Array, start: Array | Mask | None) -> FrictionResult:
                moved = q - self._shift(before)
                found: FrictionResult = self._small.solve(moved, cohesion, slope, start)
                return found

            return self._walk(step, solve_shifted, before, start, count)

        if self._is_sparse:
            guess = self._scale_last(step, guess)
        r, count, history = self._search(step, walk, guess)
        found = self._finish(step, r, count, history)
        self._last = found.r
        return found

    def _scale_last(self, step: ScaledProblem, guess: Array | Mask | None) -> Array | Mask | None:
        """Return the last reactions [N], or the guess where they do not suit.

        Hundreds of states must be found in a wall, and those of the last reactions are nearly
        right. The factor of the least energy ½ rᵀG r + qᵀr makes them fit corrections too, which
        ask for a small share of all reactions.
        """
        if self._last is None:
            return guess
        r = step.admissible(self._last / self._delassus.scale)
        carried = r != 0.0
        energy = float(np.vdot(step.product(r), r))
        work = -float(step.q[carried] @ r[carried])
        if not (0.0 < energy < np.inf and 0.0 < work < np.inf):
            return guess
        return np.asarray(self._last * (work / energy))

    def _search(
        self,
        step: ScaledProblem,
        walk: Callable[[Array, Array | Mask | None, int], Walked],
        guess: Array | Mask | None,
    ) -> Walked:
        """Return reactions (m, d), scaled, the number of iterations and their residuals.

        Args:
            step: the problem.
            walk: solves from reactions before, a guess, and the number of iterations so far.
            guess: contact set or reactions to start from.
        """
        count = 0
        history: list[float] = []
        start = guess
        before = np.zeros_like(step.q)
        failure = None
        for sweeps in (*(FEW_SWEEPS if self._is_sparse else SWEEPS), 0):
            try:
                return walk(before, start, count)
            except StepFailure as error:
                failure = error
            if not sweeps:
                break
            # Sweeps with G itself, from where the last ones led.
            sweep = make_sweep(step)
            r = step.admissible(before / self._delassus.scale)
            for _ in range(sweeps):
                r = sweep(r)
                count += 1
                rounding = step.rounding(r)
                if step.residual(r, step.w(r)) <= rounding:
                    return r, count, history
                if not rounding <= step.unit:  # of a G that is not positive sweeps may grow
                    raise failure
            before = r * self._delassus.scale
            start = before
        assert failure is not None
        if step.delassus.dimension == 2 and step.count <= MOST_CONDITIONS:
            found = find_by_states(step)
            if found is not None:
                return found, count + 1, history
        raise failure

    def _walk(
        self,
        step: ScaledProblem,
        solve_shifted: Callable[[Array, Array | Mask | None], FrictionResult],
        before: Array,
        start: Array | Mask | None,
        count: int,
    ) -> Walked:
        """Return reactions (m, d), scaled, where the shift has no effect any more.

        Args:
            step: the problem.
            solve_shifted: solves that with a shift from reactions before, and a guess.
            before: (m, d) reactions [N] to shift from.
            start: the first guess.
            count: iterations so far.

        Raises:
            StepFailure: the residual stays too large.
        """
        best = np.zeros_like(before)
        least = np.inf
        history: list[float] = []
        for _ in range(PASSES):
            found = solve_shifted(before, start)
            count += found.iterations
            before = start = found.r
            r = step.admissible(found.r / self._delassus.scale)
            residual = step.residual(r, step.w(r))
            history.append(residual / (step.unit or 1.0))
            is_slow = residual > SLOW * least
            if residual < least:
                best, least = r, residual
            if residual <= step.rounding(r) or is_slow:
                break
        if not least <= max(TOLERANCE * step.unit, step.rounding(best)):
            raise StepFailure(
                f"{self._method} with a moving shift stopped after {count} iterations with "
                f"residual {least / (step.unit or 1.0):.1e}: try a smaller step of time or load"
            )
        return best, count, history

    def _finish(
        self, step: ScaledProblem, r: Array, count: int, history: list[float]
    ) -> FrictionResult:
        """Return the result in newtons, with the least split over each ring.

        Args:
            step: the problem.
            r: (m, d) reactions, scaled.
            count: iterations.
            history: residuals on the way.
        """
        w = step.w(r)
        residual = step.residual(r, w)
        few = STILL * max(residual, step.rounding(r))
        still = np.linalg.norm(w[:, 1:], axis=1) <= few
        bilateral = self._delassus.bilateral
        limit = step.limit(r[:, 0])
        newtons = r * self._delassus.scale
        if self._rings:
            ratio = self._delassus.scale[:, -1]
            reach = np.linalg.norm(r[:, 1:], axis=1)
            states = States(
                closed=(r[:, 0] > 0.0) | bilateral | (w[:, 0] <= few),
                stick=still,
                bilateral=bilateral,
                slip=r[:, 1:] / np.where(reach > 0.0, reach, 1.0)[:, None],
                cohesion=step.cohesion * ratio,
                slope=step.slope * ratio / self._delassus.scale[:, 0],
            )
            newtons = self._split(newtons, states)
        return FrictionResult(
            r=newtons,
            active=(newtons[:, 0] > 0.0) | bilateral,
            stick=still & (limit > 0.0),
            iterations=count,
            residual=residual / (step.unit or 1.0),
            method=self._method,
            history=tuple(history),
        )

    def _split(self, r: Array, states: States) -> Array:
        """Return reactions (m, d) [N] with the least split over each ring."""
        r = r.copy()
        for ring in self._rings:
            rows = ring.conditions
            if not r[rows].any():
                continue
            split = split_least(
                r[rows], ring, states.pick(rows), self._weights[rows], self._movable[rows]
            )
            # Rounding of the split must not press an open condition, which would count as closed.
            split = np.where(states.closed[rows][:, None], split, r[rows])
            split[:, 0] = np.where(
                states.bilateral[rows], split[:, 0], np.maximum(split[:, 0], 0.0)
            )
            r[rows] = split
        return r
