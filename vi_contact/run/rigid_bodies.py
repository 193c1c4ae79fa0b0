"""Treat the bodies of a system as rigid.

This tells what of their motion contact alone holds, and whether forces balance it.

Every body is asked by itself, in its own unknowns (``problem.turned``): with w a rigid motion of it
and K w = 0, a static stage asks for w·(f - B_nᵀ r_n - B_tᵀ r_t) = 0, the sums of forces and
moments. No stiffness enters it.
"""

import numpy as np

from ..core.algebra import Array, Matrix, total
from ..core.problem import ContactProblem
from ..laws.free_motions import count_bodies, free_motions

WEAK, STRONG = 4e-6, 1e-4  # of a stiffness: see body_springs


class RigidBodies:
    """Hold the bodies of a problem, and how forces balance on them. Collective."""

    def __init__(self, problem: ContactProblem) -> None:
        self._coupling, self._comm = problem.surface.coupling, problem.surface.comm
        self._free = list(free_motions(problem.turned))

    def imbalance(self, load: Array, reaction: Array) -> float:
        """Return how far the forces on a body are from balance.

        It is the largest |w·(load - reaction)| over max |w| times the sum of |load| and |reaction|
        on the body, forces [N] on the unknowns of ``problem.static_load``. It is 0 when prescribed
        displacements hold every body.
        """
        f, r = self._own(load), self._own(reaction)
        worst = 0.0
        for body in self._free:
            own_f, own_r = f[body.rows], r[body.rows]
            total = np.abs(own_f).sum() + np.abs(own_r).sum()
            *missing, size = self._comm.sum(np.append(body.unit.T @ (own_f - own_r), total))
            worst = float(np.max(np.abs(missing) / (size or 1.0), initial=worst))  # NaN stays NaN
        return worst

    def resultants(self, force: Array) -> Array:
        """Return m w (w·force), m = diag M.

        It is the part of a force on ``static_load``'s unknowns with its resultants.
        """
        own, part = self._own(force), np.zeros_like(force)
        for body in self._free:
            part[body.rows] += body.momenta @ self._comm.sum(body.motions.T @ own[body.rows])
        return part if self._coupling is None else self._coupling.transpose_apply(part)

    def _own(self, force: Array) -> Array:
        """Return forces on the bodies themselves: û = R ǔ, R⁻¹ = 2 - R."""
        return (
            force if self._coupling is None else 2.0 * force - self._coupling.transpose_apply(force)
        )


def body_springs(problem: ContactProblem) -> Matrix:
    """Return P, the springs of bodies. Collective.

    P is the mass matrix of every body, times a number [1/s²] that makes the sum of its entries
    along a direction STRONG of the stiffness of what is softest here, a body or the springs it
    stands on, and at least WEAK of the body's own largest K_ii if it has a stiffness; in the
    unknowns of ``problem.static_load``.

    It does not grow as meshes are refined, as it would with the largest K_ii / M_ii. Weaker springs
    take fewer steps to push a stiff body into a soft one, and cost digits: round-off of the first
    step is 1e-16 / WEAK² at worst.
    """
    system, surface = problem.turned, problem.surface
    algebra, numbers = system.algebra, np.asarray(system.space.bodies)
    count, d = count_bodies(algebra.comm, numbers), system.influence.shape[1]
    row_sums = np.sum(
        system.influence * np.column_stack([system.M @ r for r in system.influence.T]), axis=1
    )
    mass = algebra.comm.sum(np.bincount(numbers, row_sums, minlength=count).astype(float)) / d
    stiffness = np.zeros(count)
    np.maximum.at(stiffness, numbers, np.abs(system.K.diagonal()))
    stiffness = algebra.comm.max(stiffness)
    soft = surface.compliance > 0.0
    bed = total(surface.comm, np.sum(1.0 / surface.compliance[soft])) or np.inf
    softest = min(bed, float(np.min(stiffness, where=stiffness > 0.0, initial=np.inf)))
    wanted = np.clip(STRONG * softest, WEAK * stiffness, STRONG * stiffness)
    # a mass alone: any strength will do
    wanted[stiffness == 0.0] = STRONG * softest if np.isfinite(softest) else 1.0
    root = np.sqrt(np.divide(wanted, mass, out=np.zeros(count), where=mass > 0.0))
    every = np.arange(system.rows)
    springs = algebra.congruence(algebra.local(every, every, root[numbers], system.rows), system.M)
    return springs if surface.coupling is None else algebra.congruence(surface.coupling, springs)
