"""Find the rigid motions of the bodies of a system that its stiffness does not resist."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Algebra, Array, Comm, Factor, Indices, Mask, Matrix, largest
from ..core.system import SemiDiscreteSystem
from .mass_transfer import rigid_motions

# wᵀKw over Σ K_ii w_i² that is round-off: 1.1 eps at most on meshes
NO_STIFFNESS = 16.0 * float(np.finfo(float).eps)
NOWHERE = 1e300  # [m], where bodies are that are held everywhere
NO_LENGTH = 1e-300  # in place of the size of a body of one point
SOFT = 1e-12  # of a diagonal entry: lets unknowns be solved for that nothing holds
DEPENDENT = 1e-10  # relative, squared; motions that others leave nothing of


@dataclass(frozen=True)
class FreeMotions:
    """Hold the k free motions w of a body.

    Attributes:
        rows: (r,) the unknowns of the body that this rank owns.
        unit: (r, k) the motions, of which the largest entry on all ranks is one.
        motions: (r, k) the same, orthonormal in m = diag M.
        momenta: (r, k) m times these.
    """

    rows: Indices
    unit: Array
    motions: Array
    momenta: Array


@dataclass(frozen=True, eq=False)
class Unheld:
    """Hold what tells which bodies nothing holds: their matrices, and where their unknowns are.

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
    return any(body.motions.shape[1] for body in _find_motions(equations))


def free_motions(system: SemiDiscreteSystem) -> Iterator[FreeMotions]:
    """Yield the free motions of every body: its rigid motions w with K w = 0. Collective.

    Those of a mass without a stiffness are among them. Unknowns that are no displacements, such as
    rotations, which no ``influence`` moves, take the values that cost the least energy.
    """
    space = system.space
    bodies = np.asarray(space.bodies)
    return _find_motions(
        Unheld(system.algebra, system.M, system.K, system.influence, bodies, space.coordinates)
    )


def _find_motions(system: Unheld) -> Iterator[FreeMotions]:
    """Yield the free motions of every body, from its matrices. Collective."""
    comm = system.algebra.comm
    bodies = _group_rows(comm, system.bodies)
    motions = _make_rigid_motions(system, bodies)
    stiffness = np.abs(system.K.diagonal())[:, None]
    mass = system.M.diagonal()[:, None]
    forces = np.column_stack([system.K @ w for w in motions.T])
    for rows in bodies:
        # wᵀKw says which motions are free, wᵀmw makes them orthonormal.
        w = motions[rows]
        local = [w.T @ forces[rows], w.T @ (stiffness[rows] * w), w.T @ (mass[rows] * w)]
        form, size, inertia = comm.sum(np.stack(local))
        kernel = _find_kernel(0.5 * (form + form.T), size.diagonal())
        basis = kernel @ _orthonormalise(kernel.T @ inertia @ kernel)
        free = w @ basis
        most = comm.max(np.max(np.abs(free), axis=0, initial=0.0))
        yield FreeMotions(rows, unit=free / most, motions=free, momenta=mass[rows] * free)


def rows_of_bodies(system: SemiDiscreteSystem) -> list[Indices]:
    """Return the owned unknowns of every body of all ranks. Collective."""
    return _group_rows(system.algebra.comm, np.asarray(system.space.bodies))


def _group_rows(comm: Comm, numbers: Indices) -> list[Indices]:
    """Return the owned unknowns of every body, given the body of each. Collective."""
    counts = np.bincount(numbers, minlength=count_bodies(comm, numbers))
    return np.split(np.argsort(numbers, kind="stable"), np.cumsum(counts)[:-1])


def _make_rigid_motions(system: Unheld, bodies: list[Indices]) -> Array:
    """Return rigid motions (n, modes) of all bodies at once, each about its middle. Collective.

    Bodies share no unknown, so that one vector holds a motion of all of them. Each body moves by
    another amount, so that what K ties to another body does not go with it.
    """
    comm = system.algebra.comm
    points = system.points
    place = np.zeros_like(points)
    amount = np.zeros((len(points), 1))
    factors = np.random.default_rng(0).uniform(1.0, 2.0, len(bodies))
    for rows, factor in zip(bodies, factors, strict=True):
        high = comm.max(np.max(points[rows], axis=0, initial=-NOWHERE))
        low = -comm.max(np.max(-points[rows], axis=0, initial=-NOWHERE))
        length = max(float(np.max(high - low)), NO_LENGTH)
        place[rows] = (points[rows] - 0.5 * (low + high)) / length
        amount[rows] = factor
    motions = amount * rigid_motions(system.influence, place)

    # Rotations and other unknowns that no translation moves follow without force.
    turning = ~system.influence.any(axis=1)
    if largest(comm, turning.any()):
        factor_of_rotations = _factorise_rotations(system, turning)
        for w in motions.T:
            w[turning] = -factor_of_rotations.solve((system.K @ w)[turning])
    return motions


def _factorise_rotations(system: Unheld, turning: Mask) -> Factor:
    """Return a factor of K for unknowns that are no displacements, also where nothing holds them.

    ``turning`` (n,) marks these, which are rotations as a rule. What holds them is made a little
    stiffer; what nothing holds gets a stiffness of one.
    """
    algebra = system.algebra
    stiffness = np.abs(system.K.diagonal())[turning]
    places = np.arange(len(stiffness))
    soft = np.where(stiffness > 0.0, SOFT * stiffness, 1.0)
    shift = algebra.local(places, places, soft, len(places))
    return algebra.factor(algebra.combine([(1.0, algebra.block(system.K, turning)), (1.0, shift)]))


def _find_kernel(form: Array, size: Array) -> Array:
    """Return the combinations of motions (modes, k) whose stiffness is round-off.

    Motions of that kind are columns by themselves, so that sums of forces stay apart; others are
    combined of the rest.

    Args:
        form: (modes, modes) wᵀKw.
        size: (modes,) Σ K_ii w_i² of each motion, which round-off is measured by.
    """
    scale = np.sqrt(np.where(size > 0.0, size, 1.0))
    form = form / np.outer(scale, scale)
    free = np.abs(form.diagonal()) <= NO_STIFFNESS
    values, vectors = np.linalg.eigh(form[np.ix_(~free, ~free)])
    combined = np.zeros((len(form), len(values)))
    combined[~free] = vectors / scale[~free, None]
    is_free = np.abs(values) <= NO_STIFFNESS
    return np.column_stack([np.eye(len(form))[:, free], combined[:, is_free]])


def _orthonormalise(form: Array) -> Array:
    """Return columns c with cᵀ form c = 1, by Gram and Schmidt.

    There are none of motions along a component that is held everywhere.
    """
    columns: list[Array] = []
    for column in np.eye(len(form)):
        for c in columns:
            column = column - c * (c @ form @ column)
        size = float(column @ form @ column)
        if size > DEPENDENT * np.max(form):
            columns.append(column / np.sqrt(size))
    return np.column_stack(columns) if columns else np.zeros((len(form), 0))


def count_bodies(comm: Comm, numbers: Indices) -> int:
    """Return how many bodies there are on all ranks, given the body of each unknown. Collective."""
    return 1 + int(largest(comm, np.max(numbers, initial=0)))
