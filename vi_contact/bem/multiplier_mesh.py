"""Put the contact multiplier on a mesh (H, DT) of its own.

It is coarser than that of the displacements (h, dt).

The mixed form of Aimi, Di Credico, Gimperlein (Comput. Methods Appl. Mech. Engrg. 427 (2024)
117066): lambda is a polynomial on patches of whole elements, discontinuous between them, and
constant in intervals of whole steps. With its functions psi_p and hats phi_i of the displacement,

    <lambda, v> = sum_p R_p sum_i B_ip v_i,
    B_ip = ∫ phi_i psi_p / ∫ psi_p,   R_p = lambda_p ∫ psi_p

with forces R [N/m] of patches and means Bᵀ u over them. The second line is tested by patch and
interval: the mean of u_n - g, the increment of u_t (the dot of the source stands on the tangential
part only), with the weight exp(-2 sigma t), the same in all intervals but for a factor that divides
out. All this is a CondensedCompliance again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from scipy.special import hyp1f1

from ..core.algebra import Array, Indices, Mask, max_abs
from ..core.arguments import check_fields
from ..core.checks import array, check_word, function, instance, mask
from ..core.corners import FEATURE_ANGLE
from ..core.errors import InputError
from ..core.quantities import Between, NotNegative, Positive, Unit
from ..solvers.normal.lcp import EPS
from .boundary_mesh import P1_MASS, BoundaryMesh
from .poincare_steklov import CondensedCompliance

SWING = 1e6  # times: growth of the swing of means over all intervals that is taken


@dataclass(frozen=True, eq=False)
class MultiplierMesh:
    """Describe patches and intervals of the contact multiplier.

    mesh, elements: the boundary and the mask (n,) of its contact elements; compliance: condensed on
    their nodes; patch, interval: least number of elements in a patch, H/h, and number of steps in
    an interval, DT/dt; degree: 0 or 1, of lambda on a patch; testing: "end" takes displacements at
    the ends of intervals, "mean" the source's means; sigma: of the weight of these. The
    normal of a patch is its mean normal; patches end at corners.

    Raises InputError for elements not condensed, sides shorter than a patch, patches that turn by
    more than 30°, steps left over, a weight without means or one that leaves nothing of them.
    """

    mesh: BoundaryMesh
    elements: Mask
    compliance: CondensedCompliance
    patch: Annotated[int, Positive] = 2
    interval: Annotated[int, Positive] = 2
    degree: Annotated[int, Between(0, 1)] = 0
    testing: str = "end"
    sigma: Annotated[float, NotNegative, Unit("1/s")] = 0.0

    def __post_init__(self) -> None:
        owner = "MultiplierMesh"
        instance(owner, "mesh", self.mesh, BoundaryMesh, "give the BoundaryMesh of the body")
        instance(
            owner,
            "compliance",
            self.compliance,
            CondensedCompliance,
            "give what condensed() returns",
        )
        object.__setattr__(
            self, "elements", mask(owner, "elements", self.elements, (len(self.mesh),))
        )
        check_word("testing", self.testing, ("end", "mean"))
        check_fields(self)
        if self.sigma and self.testing == "end":
            raise InputError(
                f"{owner}: sigma is for means and testing is 'end'; give testing='mean' or sigma=0"
            )
        # the weight at the end of a step, 1/(2 sigma dt)
        if 2.0 * self.sigma * self.compliance.dt * EPS > 1.0:
            raise InputError(
                f"{owner}: sigma = {self.sigma:g} 1/s gives ends of steps no weight; reduce sigma"
            )
        nodes, points = self.compliance.nodes, self.mesh.points
        if (
            max(nodes) >= len(points)
            or max_abs(points[nodes] - self.compliance.points) > 1e-9 * self.mesh.size
        ):
            raise InputError(
                f"{owner}: compliance has other nodes than mesh; give the mesh it was condensed on"
            )
        if not np.isin(np.flatnonzero(self.mesh.nodes_of(self.elements)), nodes).all():
            raise InputError(
                f"{owner}: elements must have all their nodes in the compliance; put them in "
                "`contact`"
            )
        shortest = min(map(len, self._runs()), default=0)
        if shortest < self.patch:
            raise InputError(
                f"{owner}: patch is {self.patch}, and a side has {shortest} elements; give fewer"
            )
        least = max(
            -1.0, min((n @ n.T).min() for n in (self.mesh.normals[patch] for patch in self.patches))
        )
        if least < np.cos(FEATURE_ANGLE * (1.0 + 1e-9)):
            raise InputError(
                f"{owner}: patch is {self.patch}, and one turns by "
                f"{np.degrees(np.arccos(least)):.3g} degrees, more than 30, under one mean normal; "
                "give fewer elements, or a finer mesh"
            )
        if (steps := len(self.compliance.W)) % self.interval:
            raise InputError(
                f"{owner}: interval {self.interval} does not divide {steps} steps; give a divisor"
            )

    def _runs(self) -> list[Indices]:
        """Return the elements of each part of the contact boundary without corners.

        They are in the order of the loop.
        """
        chosen, after = self.elements, self.mesh.after
        turned = self.mesh.node_turns(chosen) > FEATURE_ANGLE * (1.0 + 1e-9)
        starts, runs = chosen & (turned | ~chosen[np.argsort(after)]), list[Indices]()
        for order in np.split(np.arange(len(chosen)), np.cumsum(self.mesh.loop_sizes)[:-1]):
            turn = np.roll(order, -int(np.argmax(starts[order])))
            runs += [run[chosen[run]] for run in np.split(turn, np.flatnonzero(starts[turn])[1:])]
        return [run for run in runs if len(run)]

    @cached_property
    def patches(self) -> list[Indices]:
        """Return the elements of each patch, in the order of the loop."""
        return [
            patch for run in self._runs() for patch in np.array_split(run, len(run) // self.patch)
        ]

    @cached_property
    def _functions(self) -> Array:
        """Return (p, n, 2) psi at both ends of each element.

        It is 1, or 1 - s and s along a patch, and zero elsewhere.
        """
        psi = np.zeros((len(self.patches), self.degree + 1, len(self.mesh), 2))
        for number, patch in enumerate(self.patches):
            ends = np.cumsum(self.mesh.lengths[patch]) / self.mesh.lengths[patch].sum()
            s = np.stack([np.concatenate([[0.0], ends[:-1]]), ends], axis=1)
            psi[number][:, patch] = [1.0 - s, s] if self.degree else [np.ones_like(s)]
        return psi.reshape(-1, len(self.mesh), 2)

    @cached_property
    def pairing(self) -> Array:
        """Return B (m, p).

        It gives nodal forces B R of the multiplier's forces R [N/m], and means Bᵀ u of
        displacements.
        """
        loads = self._functions @ P1_MASS * self.mesh.lengths[:, None]
        nodal = (loads[:, :, 0] + loads[:, np.argsort(self.mesh.after), 1]).T
        return np.asarray((nodal / nodal.sum(axis=0))[self.compliance.nodes])

    @cached_property
    def weights(self) -> tuple[Array, Array]:
        """Return the shares (q + 1,) of the displacements in the mean of an interval.

        They are those of the displacements at the start and at the ends of the q steps Their sum is
        1. With them come the shares (q,) of the increments in these steps in that of an interval,
        whose sum is q.
        """
        q, z = self.interval, 2.0 * self.sigma * self.compliance.dt
        if self.testing == "end":
            return np.eye(q + 1)[q], np.ones(q)
        decay, shares = np.exp(-z * np.arange(q)), np.zeros(q + 1)
        shares[:-1] += 0.5 * hyp1f1(1.0, 3.0, -z) * decay  # ∫ (1 - x) exp(-z x), x from 0 to 1
        shares[1:] += 0.5 * hyp1f1(2.0, 3.0, -z) * decay  # ∫ x exp(-z x)
        return shares / shares.sum(), q * decay / decay.sum()

    def _tested(self, history: Array, normal: Array) -> Array:
        """Return the displacements (intervals, 2p, …) that are tested.

        They come from those (steps, 2p, …) at ends of steps.
        """
        q, (mean, rate) = self.interval, self.weights
        there = np.concatenate([np.zeros_like(history[:1]), history])
        ends = np.stack([there[s : len(there) - q + s : q] for s in range(q + 1)])
        if self.testing == "end":
            return np.asarray(ends[-1])
        slid = np.cumsum(np.tensordot(rate, np.diff(ends, axis=0), 1), axis=0)
        return np.asarray(
            slid + np.einsum("ij,kj...->ki...", normal, np.tensordot(mean, ends, 1) - slid)
        )

    def condensed(self) -> CondensedCompliance:
        """Return the compliance that BoundaryContact takes.

        Its nodes are the functions psi, its steps the intervals.

        ``points`` are centres, so that the gaps of planes are met in the mean. The displacements of
        a run are those tested, so that its works are not those of the body. For obstacles that move
        see ``averaged``. Raises InputError for a weight with which the swing of the means grows
        SWING times.
        """
        fine, B, q = self.compliance, self.pairing, self.interval
        growth, intervals = q / (self.weights[0] @ np.arange(q + 1.0)) - 1.0, len(fine.W) // q
        if growth > SWING ** (1.0 / intervals):
            raise InputError(
                f"MultiplierMesh: with sigma = {self.sigma:g} 1/s the means swing {growth:.3g} "
                f"times as far in each of {intervals} intervals; reduce sigma, or take "
                "testing='end'"
            )
        both = np.kron(np.eye(2), B)
        held = np.cumsum(both.T @ fine.W @ both, axis=0)
        held[q:] = held[q:] - held[:-q]  # by a force during the first interval
        sizes = 0.5 * self._functions.sum(axis=2) * self.mesh.lengths
        n = sizes @ self.mesh.normals
        n /= np.hypot(*n.T)[:, None]
        onto = np.block([[np.diag(a * b) for b in n.T] for a in n.T])
        return CondensedCompliance(
            self._tested(held, onto),
            self._tested(fine.u_free @ both, onto),
            np.arange(len(n)),
            B.T @ fine.points,
            n,
            sizes.sum(axis=1),
            fine.dt * q,
        )

    def forces(self, forces: Array) -> Array:
        """Return nodal forces (steps, 2m) [N/m] for BoundaryProblem.solve.

        They come from those of a run (intervals, 2p).
        """
        onto, count = np.kron(np.eye(2), self.pairing.T), len(self.compliance.W) // self.interval
        given = array("MultiplierMesh.forces", "forces", forces, (count, len(onto)), unit="N/m")
        return np.repeat(given @ onto, self.interval, axis=0)

    def averaged(self, motion: Callable[[float], float | Array]) -> Callable[[float], Array]:
        """Return the mean over the interval of an obstacle's ``motion``.

        The interval ends at t; the mean is for ``towards``.
        """
        function("MultiplierMesh.averaged", "motion", motion, "give a function of the time in m")
        shares = list(
            zip(self.weights[0], self.compliance.dt * np.arange(-self.interval, 1), strict=True)
        )
        return lambda t: np.asarray(sum(w * np.asarray(motion(t + s)) for w, s in shares))
