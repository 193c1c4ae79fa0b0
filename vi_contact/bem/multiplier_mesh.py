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

SWING = 1e6  # times: growth of the swing of means over all intervals that is accepted


@dataclass(frozen=True, eq=False)
class MultiplierMesh:
    """Describe patches and intervals of the contact multiplier.

    The normal of a patch is its mean normal; patches end at corners.

    Attributes:
        mesh: the boundary, of n elements.
        elements: (n,) whether an element may come into contact.
        compliance: condensed on the nodes of these elements.
        patch: least number of elements in a patch, H/h.
        interval: number of steps in an interval, DT/dt.
        degree: of lambda on a patch, 0 or 1.
        testing: "end" takes displacements at the ends of intervals, "mean" the source's means.
        sigma: of the weight exp(-2 sigma t) of the means [1/s].

    Raises:
        InputError: elements that are not condensed; sides shorter than a patch; patches that turn
            by more than 30°; steps left over; a weight without means, or one that leaves nothing
            of them.
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
        remedy = "give what condensed() returns"
        instance(owner, "compliance", self.compliance, CondensedCompliance, remedy)
        elements = mask(owner, "elements", self.elements, (len(self.mesh),))
        object.__setattr__(self, "elements", elements)
        check_word("testing", self.testing, ("end", "mean"))
        check_fields(self)
        if self.sigma and self.testing == "end":
            raise InputError(
                f"{owner}: sigma is for means and testing is 'end'; give testing='mean' or sigma=0"
            )
        # The weight at the end of a step is 1/(2 sigma dt).
        if 2.0 * self.sigma * self.compliance.dt * EPS > 1.0:
            raise InputError(
                f"{owner}: sigma = {self.sigma:g} 1/s gives ends of steps no weight; reduce sigma"
            )
        self._refuse_other_mesh(owner)
        self._refuse_patches(owner)
        steps = len(self.compliance.W)
        if steps % self.interval:
            raise InputError(
                f"{owner}: interval {self.interval} does not divide {steps} steps; give a divisor"
            )

    def _refuse_other_mesh(self, owner: str) -> None:
        """Raise InputError unless the elements are condensed on this mesh."""
        nodes = self.compliance.nodes
        points = self.mesh.points
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

    def _refuse_patches(self, owner: str) -> None:
        """Raise InputError where patches do not fit a side, or turn too far for one normal."""
        shortest = min(map(len, self._runs()), default=0)
        if shortest < self.patch:
            raise InputError(
                f"{owner}: patch is {self.patch}, and a side has {shortest} elements; give fewer"
            )
        cosines = []  # the least one between normals, of each patch
        for patch in self.patches:
            normals = self.mesh.normals[patch]
            cosines.append((normals @ normals.T).min())
        least = max(-1.0, min(cosines))
        if least < np.cos(FEATURE_ANGLE * (1.0 + 1e-9)):
            raise InputError(
                f"{owner}: patch is {self.patch}, and one turns by "
                f"{np.degrees(np.arccos(least)):.3g} degrees, more than 30, under one mean normal; "
                "give fewer elements, or a finer mesh"
            )

    def _runs(self) -> list[Indices]:
        """Return the elements of each part of the contact boundary without corners.

        They are in the order of the loop.
        """
        chosen = self.elements
        before = np.argsort(self.mesh.after)
        turned = self.mesh.node_turns(chosen) > FEATURE_ANGLE * (1.0 + 1e-9)
        starts = chosen & (turned | ~chosen[before])
        runs: list[Indices] = []
        for loop in np.split(np.arange(len(chosen)), np.cumsum(self.mesh.loop_sizes)[:-1]):
            # Begin where a part starts, so that none is cut at the first node of the loop.
            order = np.roll(loop, -int(np.argmax(starts[loop])))
            for part in np.split(order, np.flatnonzero(starts[order])[1:]):
                run = part[chosen[part]]
                if len(run):
                    runs.append(run)
        return runs

    @cached_property
    def patches(self) -> list[Indices]:
        """Return the elements of each patch, in the order of the loop."""
        patches: list[Indices] = []
        for run in self._runs():
            patches += np.array_split(run, len(run) // self.patch)
        return patches

    @cached_property
    def _functions(self) -> Array:
        """Return psi (p, n, 2) at both ends of each element.

        Along a patch it is 1 (degree 0), or 1 - s and s (degree 1); elsewhere it is zero.
        """
        psi = np.zeros((len(self.patches), self.degree + 1, len(self.mesh), 2))
        for number, patch in enumerate(self.patches):
            lengths = self.mesh.lengths[patch]
            ends = np.cumsum(lengths) / lengths.sum()
            starts = np.concatenate([[0.0], ends[:-1]])
            s = np.stack([starts, ends], axis=1)
            psi[number][:, patch] = [1.0 - s, s] if self.degree else [np.ones_like(s)]
        return psi.reshape(-1, len(self.mesh), 2)

    @cached_property
    def pairing(self) -> Array:
        """Return B (m, p).

        It gives nodal forces B R of the multiplier's forces R [N/m], and means Bᵀ u of
        displacements.
        """
        loads = self._functions @ P1_MASS * self.mesh.lengths[:, None]
        before = np.argsort(self.mesh.after)
        nodal = (loads[:, :, 0] + loads[:, before, 1]).T
        return np.asarray((nodal / nodal.sum(axis=0))[self.compliance.nodes])

    @cached_property
    def weights(self) -> tuple[Array, Array]:
        """Return how an interval of q steps is tested: shares (q + 1,) and shares (q,).

        The first are those of the displacements at the start and at the ends of the steps in the
        mean of the interval; their sum is 1. The others are those of the increments in the steps in
        the increment of the interval; their sum is q.
        """
        q = self.interval
        z = 2.0 * self.sigma * self.compliance.dt
        if self.testing == "end":
            return np.eye(q + 1)[q], np.ones(q)

        # Displacements are linear in a step: (1 - x) u_start + x u_end, times the weight.
        decay = np.exp(-z * np.arange(q))
        shares = np.zeros(q + 1)
        shares[:-1] += 0.5 * hyp1f1(1.0, 3.0, -z) * decay  # ∫ (1 - x) exp(-z x), x from 0 to 1
        shares[1:] += 0.5 * hyp1f1(2.0, 3.0, -z) * decay  # ∫ x exp(-z x)
        return shares / shares.sum(), q * decay / decay.sum()

    def _take_tested(self, history: Array, normal: Array) -> Array:
        """Return the displacements (intervals, 2p, …) that are tested.

        Args:
            history: (steps, 2p, …), displacements at the ends of the steps [m].
            normal: (2p, 2p), the projection onto the normals of the patches.
        """
        q = self.interval
        mean, rate = self.weights
        from_start = np.concatenate([np.zeros_like(history[:1]), history])
        ends = np.stack([from_start[s : len(from_start) - q + s : q] for s in range(q + 1)])
        if self.testing == "end":
            return np.asarray(ends[-1])

        # Along the tangents the sum of the increments of the intervals; along the normals the mean.
        slips = np.cumsum(np.tensordot(rate, np.diff(ends, axis=0), 1), axis=0)
        difference = np.tensordot(mean, ends, 1) - slips
        return np.asarray(slips + np.einsum("ij,kj...->ki...", normal, difference))

    def condensed(self) -> CondensedCompliance:
        """Return the compliance that BoundaryContact takes.

        Its nodes are the functions psi, its steps the intervals. ``points`` are centres, so that
        the gaps of planes are met in the mean. The displacements of a run are those tested, so that
        its works are not those of the body. For obstacles that move see ``averaged``.

        Raises:
            InputError: a weight with which the swing of the means grows SWING times.
        """
        fine = self.compliance
        B = self.pairing
        q = self.interval
        intervals = len(fine.W) // q

        # A mean that is held at the gap leaves the displacement at the end of the interval free to
        # swing about it, by this factor more in every interval.
        mean_place = self.weights[0] @ np.arange(q + 1.0)
        growth = q / mean_place - 1.0
        if growth > SWING ** (1.0 / intervals):
            raise InputError(
                f"MultiplierMesh: with sigma = {self.sigma:g} 1/s the means swing {growth:.3g} "
                f"times as far in each of {intervals} intervals; reduce sigma, or take "
                "testing='end'"
            )

        # Displacements after a force that is held during the whole first interval.
        B_of_components = np.kron(np.eye(2), B)
        W = np.cumsum(B_of_components.T @ fine.W @ B_of_components, axis=0)
        W[q:] = W[q:] - W[:-q]

        # The mean normal n of each function, and the projection n nᵀ onto it.
        sizes = 0.5 * self._functions.sum(axis=2) * self.mesh.lengths
        n = sizes @ self.mesh.normals
        n /= np.hypot(*n.T)[:, None]
        n_x, n_y = n.T
        onto = np.block(
            [[np.diag(n_x * n_x), np.diag(n_x * n_y)], [np.diag(n_y * n_x), np.diag(n_y * n_y)]]
        )
        return CondensedCompliance(
            W=self._take_tested(W, onto),
            u_free=self._take_tested(fine.u_free @ B_of_components, onto),
            nodes=np.arange(len(n)),
            points=B.T @ fine.points,
            normals=n,
            lengths=sizes.sum(axis=1),
            dt=fine.dt * q,
        )

    def forces(self, forces: Array) -> Array:
        """Return the nodal forces (steps, 2m) of the forces of a run (intervals, 2p) [N/m].

        They are what BoundaryProblem.solve takes.
        """
        to_nodes = np.kron(np.eye(2), self.pairing.T)
        shape = (len(self.compliance.W) // self.interval, len(to_nodes))
        checked_forces = array("MultiplierMesh.forces", "forces", forces, shape, unit="N/m")
        return np.repeat(checked_forces @ to_nodes, self.interval, axis=0)

    def averaged(self, motion: Callable[[float], float | Array]) -> Callable[[float], Array]:
        """Return the mean of an obstacle's ``motion`` over the interval that ends at t.

        It is what ``towards`` of BoundaryContact takes.
        """
        function("MultiplierMesh.averaged", "motion", motion, "give a function of the time in m")
        weights, _ = self.weights
        times = self.compliance.dt * np.arange(-self.interval, 1)  # before the end

        def mean(t: float) -> Array:
            """Return the mean of the motion over the interval that ends at t."""
            values = [w * np.asarray(motion(t + s)) for w, s in zip(weights, times, strict=True)]
            return np.asarray(sum(values))

        return mean
