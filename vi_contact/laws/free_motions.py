"""Find the rigid motions of the bodies of a system that its stiffness does not resist."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array, Comm, Factor, Indices, Mask, Matrix, largest
from ..core.system import SemiDiscreteSystem
from .mass_transfer import rigid_motions

FREE = 1e-10  # wᵀKw over the body's largest K_ii, for motions w of size one, that is round-off
SOFT = 1e-12  # of a diagonal entry: lets unknowns be solved for that nothing holds


@dataclass(frozen=True)
class FreeMotions:
    """Hold a body's owned unknowns, its free motions w (rows, k) of size one, and orthonormal in its mass, with M w."""

    rows: Indices
    unit: Array
    motions: Array
    momenta: Array


def floating(system: SemiDiscreteSystem) -> SemiDiscreteSystem:
    """Return the system, told whether some rigid motion of a body of it meets no stiffness. Collective."""
    return system.changed(floating=any(body.motions.shape[1] for body in free_motions(system)))


def free_motions(system: SemiDiscreteSystem) -> Iterator[FreeMotions]:
    """Yield every body with a stiffness: its rigid motions w with K w = 0. Unknowns that are no displacements, such as
    rotations, which no ``influence`` moves, take the values that cost the least energy. Collective."""
    comm, points = system.algebra.comm, system.space.coordinates
    numbers = np.asarray(system.space.bodies)
    stiffness, other = np.abs(system.K.diagonal()), ~system.influence.any(axis=1)
    factor = _factor(system, stiffness, other) if largest(comm, other.any()) else None
    for number in range(bodies_in(comm, numbers)):
        rows = np.flatnonzero(numbers == number)
        stiffest = largest(comm, np.max(stiffness[rows[~other[rows]]], initial=0.0))
        if stiffest == 0.0:
            continue  # every node of it is held
        high = comm.max(np.max(points[rows], axis=0, initial=-np.inf))
        low = -comm.max(np.max(-points[rows], axis=0, initial=-np.inf))
        place = (points[rows] - 0.5 * (low + high)) / max(float(np.max(high - low)), 1e-300)
        w = rigid_motions(system.influence[rows], place)
        if factor is not None:
            w = np.column_stack([_followed(system, factor, other, rows, column) for column in w.T])
        bending = _form(system, system.K, rows, w)[1]
        w = w @ _kernel(bending, FREE * stiffest)
        momenta, inertia = _form(system, system.M, rows, w)
        basis = _orthonormal(inertia)
        size = comm.max(np.max(np.abs(w @ basis), axis=0, initial=0.0))
        yield FreeMotions(rows, w @ basis / size, w @ basis, momenta @ basis)


def _factor(system: SemiDiscreteSystem, stiffness: Array, other: Mask) -> Factor:
    """Solve for unknowns that are no displacements, also where nothing resists them."""
    algebra, soft, every = system.algebra, stiffness[other], np.arange(np.count_nonzero(other))
    shift = algebra.local(every, every, np.where(soft > 0.0, SOFT * soft, 1.0), len(every))
    return algebra.factor(algebra.combine([(1.0, algebra.block(system.K, other)), (1.0, shift)]))


def _followed(system: SemiDiscreteSystem, factor: Factor, other: Mask, rows: Indices, w: Array) -> Array:
    """The motion w of a body with the other unknowns as they follow it."""
    x = np.zeros(system.rows)
    x[rows] = w
    x[other] = -factor.solve((system.K @ x)[other])
    return x[rows]


def _kernel(form: Array, zero: float) -> Array:
    """Columns whose form is zero: axes of that kind, so that sums of forces stay apart, and others between the rest."""
    free = np.abs(form.diagonal()) <= zero
    values, vectors = np.linalg.eigh(form[np.ix_(~free, ~free)])
    others = np.zeros((len(form), len(values)))
    others[~free] = vectors
    return np.column_stack([np.eye(len(form))[:, free], others[:, np.abs(values) <= zero]])


def _orthonormal(form: Array) -> Array:
    """Columns c with cᵀ form c = 1, by Gram and Schmidt; none of motions along a component that is held everywhere."""
    columns: list[Array] = []
    for column in np.eye(len(form)):
        for c in columns:
            column = column - c * (c @ form @ column)
        size = float(column @ form @ column)
        if size > 1e-10 * np.max(form):
            columns.append(column / np.sqrt(size))
    return np.column_stack(columns) if columns else np.zeros((len(form), 0))


def _form(system: SemiDiscreteSystem, A: Matrix, rows: Indices, w: Array) -> tuple[Array, Array]:
    """(A w, wᵀA w) of motions of a body, on the body."""
    columns = []
    for values in w.T:
        x = np.zeros(system.rows)
        x[rows] = values
        columns.append((A @ x)[rows])
    moved = np.column_stack(columns) if columns else np.zeros_like(w)
    form = system.algebra.comm.sum(w.T @ moved)
    return moved, 0.5 * (form + form.T)


def bodies_in(comm: Comm, numbers: Indices) -> int:
    """Return how many bodies are numbered on all ranks. Collective."""
    return 1 + int(largest(comm, np.max(numbers, initial=0)))
