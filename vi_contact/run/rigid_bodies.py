"""Treat the bodies of a system as rigid.

This tells what of their motion contact alone holds, and whether forces balance it.

Every body is asked by itself, in its own unknowns (``problem.turned``): with w a rigid motion of it
and K w = 0, a static stage asks for w·(f - B_nᵀ r_n - B_tᵀ r_t) = 0, the sums of forces and
moments. No stiffness enters it.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, Matrix, total
from ..core.problem import ContactProblem
from ..laws.free_motions import count_bodies, free_motions

WEAK = 4e-6  # of a stiffness: see make_body_springs
STRONG = 1e-4  # the same


class RigidBodies:
    """Hold the bodies of a problem, and how forces balance on them. Collective."""

    def __init__(self, problem: ContactProblem) -> None:
        self._coupling = problem.surface.coupling
        self._comm = problem.surface.comm
        self._free = list(free_motions(problem.turned))

    def imbalance(self, load: Array, reaction: Array) -> float:
        """Return how far the forces on a body are from balance.

        It is the largest |w·(load - reaction)| over max |w| times the sum of |load| and |reaction|
        on the body, forces [N] on the unknowns of ``problem.static_load``. It is 0 when prescribed
        displacements hold every body.
        """
        f = self._on_bodies(load)
        r = self._on_bodies(reaction)
        worst = 0.0
        for body in self._free:
            own_f = f[body.rows]
            own_r = r[body.rows]
            total = np.abs(own_f).sum() + np.abs(own_r).sum()
            *missing, size = self._comm.sum(np.append(body.unit.T @ (own_f - own_r), total))
            worst = float(np.max(np.abs(missing) / (size or 1.0), initial=worst))  # NaN stays NaN
        return worst

    def resultants(self, force: Array) -> Array:
        """Return m w (w·force), m = diag M.

        It is the part of a force on ``static_load``'s unknowns with its resultants.
        """
        on_bodies = self._on_bodies(force)
        part = np.zeros_like(force)
        for body in self._free:
            sums = self._comm.sum(body.motions.T @ on_bodies[body.rows])
            part[body.rows] += body.momenta @ sums
        return part if self._coupling is None else self._coupling.transpose_apply(part)

    def _on_bodies(self, force: Array) -> Array:
        """Return forces (n,) [N] on the bodies themselves: û = R ǔ, R⁻¹ = 2 - R."""
        if self._coupling is None:
            return force
        return 2.0 * force - self._coupling.transpose_apply(force)


@dataclass(frozen=True, eq=False)
class SprungMotions:
    """Hold the k rigid motions R of bodies that K does not resist, with springs P that do.

    Attributes:
        R: (n, k) rows of this rank.
        pull: P R (n, k), the same.
        S: RᵀP R (k, k), the same on every rank.
    """

    R: sp.csr_matrix
    pull: sp.csr_matrix
    S: sp.csr_matrix


def find_sprung_motions(problem: ContactProblem, springs: Matrix) -> SprungMotions:
    """Return the rigid motions of bodies with their springs. Collective.

    Args:
        problem: whose bodies have unknowns of their own (no ``coupling``).
        springs: P, which no two bodies share.
    """
    comm = problem.surface.comm
    bodies = list(free_motions(problem.turned))

    # P is asked for the first motions of all bodies at once, then for the second ones.
    width = max(body.motions.shape[1] for body in bodies)
    together = np.zeros((springs.rows, width))
    for body in bodies:
        together[body.rows, : body.motions.shape[1]] = body.motions
    pulls = np.column_stack([springs @ motions for motions in together.T])

    rows, columns, motions, pulled, energies = [], [], [], [], []
    k = 0
    for body in bodies:
        count = body.motions.shape[1]
        own = pulls[body.rows, :count]
        rows.append(np.repeat(body.rows, count))
        columns.append(np.tile(np.arange(k, k + count), len(body.rows)))
        motions.append(body.motions.ravel())
        pulled.append(own.ravel())
        energies.append(comm.sum(body.motions.T @ own))
        k += count
    places = (np.concatenate(rows), np.concatenate(columns))
    shape = (springs.rows, k)
    return SprungMotions(
        R=sp.csr_matrix((np.concatenate(motions), places), shape=shape),
        pull=sp.csr_matrix((np.concatenate(pulled), places), shape=shape),
        S=sp.csr_matrix(sp.block_diag(energies)),
    )


def make_body_springs(problem: ContactProblem) -> Matrix:
    """Return P, the springs of bodies. Collective.

    P is the mass matrix of every body, times a number [1/s²] that makes the sum of its entries
    along a direction STRONG of the stiffness of what is softest here, a body or the springs it
    stands on, and at least WEAK of the body's own largest K_ii if it has a stiffness; in the
    unknowns of ``problem.static_load``.

    It does not grow as meshes are refined, as it would with the largest K_ii / M_ii. Weaker springs
    take fewer steps to push a stiff body into a soft one, and cost digits: round-off of the first
    step is 1e-16 / WEAK² at worst.
    """
    system = problem.turned
    surface = problem.surface
    algebra = system.algebra
    numbers = np.asarray(system.space.bodies)
    count = count_bodies(algebra.comm, numbers)

    # The mass of every body, rᵀMr along each axis, and its largest K_ii.
    d = system.influence.shape[1]
    inertia = np.column_stack([system.M @ r for r in system.influence.T])
    row_sums = np.sum(system.influence * inertia, axis=1)
    mass = algebra.comm.sum(np.bincount(numbers, row_sums, minlength=count).astype(float)) / d
    stiffness = np.zeros(count)
    np.maximum.at(stiffness, numbers, np.abs(system.K.diagonal()))
    stiffness = algebra.comm.max(stiffness)

    # The stiffness of each body's springs: STRONG of what is softest, at least WEAK of its own.
    soft = surface.compliance > 0.0
    bed = total(surface.comm, np.sum(1.0 / surface.compliance[soft])) or np.inf
    softest = min(bed, float(np.min(stiffness, where=stiffness > 0.0, initial=np.inf)))
    strength = np.clip(STRONG * softest, WEAK * stiffness, STRONG * stiffness)
    # a mass alone: any strength will do
    strength[stiffness == 0.0] = STRONG * softest if np.isfinite(softest) else 1.0

    # P = S M S with S the root of strength over mass of the body of each unknown.
    root = np.sqrt(np.divide(strength, mass, out=np.zeros(count), where=mass > 0.0))
    rows = np.arange(system.rows)
    springs = algebra.congruence(algebra.local(rows, rows, root[numbers], system.rows), system.M)
    return springs if surface.coupling is None else algebra.congruence(surface.coupling, springs)
