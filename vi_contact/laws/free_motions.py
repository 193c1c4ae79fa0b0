"""Find the rigid motions of the bodies of a system that its stiffness does not resist."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Algebra, Array, Comm, Factor, Indices, Mask, Matrix, largest
from ..core.system import SemiDiscreteSystem
from .mass_transfer import rigid_motions

# wᵀKw over Σ K_ii w_i² that is round-off: 1.1 eps at most on meshes
ROUNDED = 16.0 * float(np.finfo(float).eps)
NOWHERE = 1e300  # [m], where bodies are that are held everywhere
SOFT = 1e-12  # of a diagonal entry: lets unknowns be solved for that nothing holds


@dataclass(frozen=True)
class FreeMotions:
    """Hold a body's owned unknowns and its free motions w (rows, k).

    The motions are of size one, and also held orthonormal in m = diag M; m w is held too.
    """

    rows: Indices
    unit: Array
    motions: Array
    momenta: Array


@dataclass(frozen=True, eq=False)
class Unheld:
    """Hold what says which bodies nothing holds: their matrices, and where their unknowns are.

    Attributes:
        algebra: that of the matrices.
        M, K: mass [kg] and stiffness [N/m].
        influence: (n, d) rigid unit translation in each direction.
        bodies: (n,) the body of each unknown.
        points: (n, d) the place of each unknown [m].
    """

    algebra: Algebra
    M: Matrix
    K: Matrix
    influence: Array
    bodies: Indices
    points: Array


def floats(equations: Unheld) -> bool:
    """Say whether some rigid motion of a body meets no stiffness. Collective."""
    return any(body.motions.shape[1] for body in _motions_of(equations))


def free_motions(system: SemiDiscreteSystem) -> Iterator[FreeMotions]:
    """Yield every body: its rigid motions w with K w = 0, those of a mass without a stiffness too.

    Unknowns that are no displacements, such as rotations, which no ``influence`` moves, take the
    values that cost the least energy. Collective.
    """
    space = system.space
    bodies = np.asarray(space.bodies)
    return _motions_of(
        Unheld(system.algebra, system.M, system.K, system.influence, bodies, space.coordinates)
    )


def _motions_of(system: Unheld) -> Iterator[FreeMotions]:
    """Yield the free motions of every body, from its matrices. Collective."""
    comm = system.algebra.comm
    bodies = _rows_by_body(comm, system.bodies)
    motions = _rigid(system, bodies)
    stiffness = np.abs(system.K.diagonal())[:, None]
    mass = system.M.diagonal()[:, None]
    pulls = np.column_stack([system.K @ w for w in motions.T])
    # of each body: wᵀKw says which motions are free, wᵀMw makes them orthonormal
    for rows in bodies:
        w = motions[rows]
        form, size, inertia = comm.sum(
            np.stack([w.T @ x for x in (pulls[rows], stiffness[rows] * w, mass[rows] * w)])
        )
        kernel = _kernel(0.5 * (form + form.T), size.diagonal())
        basis = kernel @ _orthonormal(kernel.T @ inertia @ kernel)
        most = comm.max(np.max(np.abs(w @ basis), axis=0, initial=0.0))
        yield FreeMotions(rows, w @ basis / most, w @ basis, mass[rows] * (w @ basis))


def rows_of_bodies(system: SemiDiscreteSystem) -> list[Indices]:
    """Return the owned unknowns of every body of all ranks. Collective."""
    return _rows_by_body(system.algebra.comm, np.asarray(system.space.bodies))


def _rows_by_body(comm: Comm, numbers: Indices) -> list[Indices]:
    """Return the owned unknowns of every body, given the body of each. Collective."""
    counts = np.bincount(numbers, minlength=bodies_in(comm, numbers))
    return np.split(np.argsort(numbers, kind="stable"), np.cumsum(counts)[:-1])


def _rigid(system: Unheld, bodies: list[Indices]) -> Array:
    """Rigid motions of all bodies about their middles, in one vector each: bodies share no unknown.

    Each moves by another amount, so that what K ties to another body does not go with it.
    """
    comm = system.algebra.comm
    points = system.points
    place = np.zeros_like(points)
    amount = np.zeros((len(points), 1))
    for rows, factor in zip(
        bodies, np.random.default_rng(0).uniform(1.0, 2.0, len(bodies)), strict=True
    ):
        high = comm.max(np.max(points[rows], axis=0, initial=-NOWHERE))
        low = -comm.max(np.max(-points[rows], axis=0, initial=-NOWHERE))
        place[rows] = (points[rows] - 0.5 * (low + high)) / max(float(np.max(high - low)), 1e-300)
        amount[rows] = factor
    motions, other = amount * rigid_motions(system.influence, place), ~system.influence.any(axis=1)
    if largest(comm, other.any()):
        solver = _factor(system, np.abs(system.K.diagonal()), other)
        for w in motions.T:
            w[other] = -solver.solve((system.K @ w)[other])
    return motions


def _factor(system: Unheld, stiffness: Array, other: Mask) -> Factor:
    """Solve for unknowns that are no displacements, also where nothing resists them."""
    algebra, soft, every = system.algebra, stiffness[other], np.arange(np.count_nonzero(other))
    shift = algebra.local(every, every, np.where(soft > 0.0, SOFT * soft, 1.0), len(every))
    return algebra.factor(algebra.combine([(1.0, algebra.block(system.K, other)), (1.0, shift)]))


def _kernel(form: Array, size: Array) -> Array:
    """Return the columns whose form is round-off.

    They are axes of that kind, so that sums of forces stay apart, and others between the rest.
    ``size`` is the sum of each axis without its signs.
    """
    scale = np.sqrt(np.where(size > 0.0, size, 1.0))
    form = form / np.outer(scale, scale)
    free = np.abs(form.diagonal()) <= ROUNDED
    values, vectors = np.linalg.eigh(form[np.ix_(~free, ~free)])
    others = np.zeros((len(form), len(values)))
    others[~free] = vectors / scale[~free, None]
    return np.column_stack([np.eye(len(form))[:, free], others[:, np.abs(values) <= ROUNDED]])


def _orthonormal(form: Array) -> Array:
    """Return columns c with cᵀ form c = 1, by Gram and Schmidt.

    There are none of motions along a component that is held everywhere.
    """
    columns: list[Array] = []
    for column in np.eye(len(form)):
        for c in columns:
            column = column - c * (c @ form @ column)
        size = float(column @ form @ column)
        if size > 1e-10 * np.max(form):
            columns.append(column / np.sqrt(size))
    return np.column_stack(columns) if columns else np.zeros((len(form), 0))


def bodies_in(comm: Comm, numbers: Indices) -> int:
    """Return how many bodies are numbered on all ranks. Collective."""
    return 1 + int(largest(comm, np.max(numbers, initial=0)))
