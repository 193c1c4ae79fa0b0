"""Describe contact of a body condensed by boundary elements.

This says what it may touch, how it rubs, and what its steps are.

The condensed body is u_c[k] = sum_(l<=k) W[k-l] lam[l] + u_free[k] (CondensedCompliance). In the
frames of its nodes, v = N u with the contact direction n and the tangent as rows of N, lam = -Nᵀ r,
it is a row of the project's contract (step.py): force scheme, gap at the end of the step, history
on the right-hand side,

    A v_k = b_k - r_k,   A = (N W[0] Nᵀ)⁻¹,   b_k = A N (u_free[k] + sum_(l<k) W[k-l] lam[l])
    0 <= r_n  ⊥  gap - v_n >= 0,    |r_t| <= limit(r_n), along the slip v_t[k] - v_t[k-1]

so that every method for the small problem and the certificate of a step serve here too. Reactions r
= (r_n, r_t) are those of the body on its support, nodal forces [N/m] held during a step; traction =
force / length.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import (
    Array,
    EffectiveMatrix,
    Indices,
    Mask,
    SerialAlgebra,
    SerialComm,
    SerialMatrix,
    max_abs,
)
from ..core.checks import (
    array,
    describe_point,
    flag,
    function,
    instance,
    integers,
    optional,
    provides,
)
from ..core.corners import FEATURE_ANGLE
from ..core.errors import InputError
from ..core.obstacles import Obstacle, Touching, check_gap, locate_obstacle
from ..core.protocols import FrictionLaw, Frictionless
from ..core.step import StepProblem
from ..core.surfaces import ContactSurface, make_nodal_frames
from ..solvers.normal.uniqueness import PMatrix, p_matrix
from .boundary_mesh import BoundaryMesh
from .energetic import sum_products
from .poincare_steklov import CondensedCompliance

ObstacleMotion = Callable[[float], float | Array]
ASYMMETRIC = 1e-8  # of W[0], beyond which it is that of the unsymmetric form
SUPPORTED = 1e-12  # of the largest flexibility: supported unknowns


@dataclass(frozen=True)
class Conditions:
    """Hold c contact conditions.

    A node may have two of them, such as the corner of a box in a notch.

    Attributes:
        nodes: (c,) contact node of each condition, as a row of CondensedCompliance.
        normals: (c, 2) outward unit normals.
        lengths: (c,) of contact boundary that belongs to a condition [m].
    """

    nodes: Indices
    normals: Array
    lengths: Array

    def __post_init__(self) -> None:
        nodes = integers("Conditions", "nodes", self.nodes, (None,))
        if len(nodes) and nodes.min() < 0:
            raise InputError(
                f"Conditions: nodes has {nodes.min()}; give numbers of contact nodes from 0 on"
            )
        normals = array("Conditions", "normals", self.normals, (len(nodes), 2))
        lengths = array("Conditions", "lengths", self.lengths, (len(nodes),), unit="m")
        if not len(nodes) or np.bincount(nodes).max() > 2 or lengths.min() <= 0.0:
            raise InputError(
                "Conditions: give one condition or more, at most two at a node, and positive "
                "lengths"
            )
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "normals", normals)
        object.__setattr__(self, "lengths", lengths)


def conditions_on(
    mesh: BoundaryMesh, compliance: CondensedCompliance, *sides: ArrayLike
) -> Conditions:
    """Return the conditions of several sides. A node of two sides gets one for each.

    Args:
        mesh: the boundary of the body, of n elements.
        compliance: what ``condensed`` returns for it.
        *sides: a mask of elements (n,) for each side.

    Raises:
        InputError: a side with nodes that were not condensed; more than two sides at a node.
    """
    owner = "conditions_on"
    instance(owner, "mesh", mesh, BoundaryMesh, "give the BoundaryMesh of the body")
    instance(owner, "compliance", compliance, CondensedCompliance, "give what condensed() returns")
    if not sides:
        raise InputError(f"{owner}: no side is given; give masks of elements, one for each side")
    place = np.full(len(mesh), -1)
    place[compliance.nodes] = np.arange(len(compliance.nodes))
    chosen = [np.flatnonzero(mesh.nodes_of(side)) for side in sides]
    nodes = place[np.concatenate(chosen)]
    if (nodes < 0).any() or np.bincount(nodes).max() > 2:
        raise InputError(
            "conditions_on: sides must belong to the contact boundary, and at most two may share a "
            "node"
        )
    normals = []
    lengths = []
    for side, nodes_of_side in zip(sides, chosen, strict=True):
        normals.append(mesh.node_normals(side)[nodes_of_side])
        lengths.append(mesh.node_lengths(side)[nodes_of_side])
    return Conditions(nodes, np.concatenate(normals), np.concatenate(lengths))


@dataclass(frozen=True, eq=False)
class BoundaryContact:
    """Describe a condensed body and its support.

    Nodes with two conditions do not rub.

    Attributes:
        compliance: the condensed body.
        obstacle: gives gaps and directions; by default it is a rigid support that fits the body.
        friction: the law of friction.
        towards: how far the obstacle has moved towards the body at time t [m]; None if it rests.
        along: how far the obstacle has moved along its tangents at time t [m]; None if it rests.
        bilateral: whether every point is held on the obstacle.
        conditions: None for one condition at every contact node.

    Raises:
        InputError: a contact boundary that turns by more than 30° where the obstacle follows it
            and no conditions are given; a symmetric compliance W[0] that is not positive definite,
            and any that is singular; supports that hold a contact direction; bodies that penetrate
            their obstacle.
    """

    compliance: CondensedCompliance
    obstacle: Obstacle = field(default_factory=Touching)
    friction: FrictionLaw = field(default_factory=Frictionless)
    towards: ObstacleMotion | None = None
    along: ObstacleMotion | None = None
    bilateral: bool = False
    conditions: Conditions | None = None

    def __post_init__(self) -> None:
        owner = "BoundaryContact"
        instance(
            owner,
            "compliance",
            self.compliance,
            CondensedCompliance,
            "give what condensed() returns",
        )
        provides(
            owner,
            "obstacle",
            self.obstacle,
            ("gap", "directions"),
            "give an obstacle, for example Touching()",
        )
        provides(
            owner,
            "friction",
            self.friction,
            ("limit", "slope"),
            "give a friction law, for example Coulomb(mu)",
        )
        remedy = "give a function of the time, or None"
        optional(function, owner, "towards", self.towards, remedy)
        optional(function, owner, "along", self.along, remedy)
        flag(owner, "bilateral", self.bilateral)
        if self.conditions is not None:
            instance(
                owner,
                "conditions",
                self.conditions,
                Conditions,
                "give those of conditions_on(...), or None",
            )
            if self.conditions.nodes.max(initial=0) >= self.count:
                raise InputError(
                    f"{owner}: conditions name node {self.conditions.nodes.max()} of {self.count} "
                    "contact nodes; make them with conditions_on for this compliance"
                )
        self._refuse_corners()

    def _refuse_corners(self) -> None:
        """Refuse one condition along the mean normal of a node where the contact boundary turns."""
        turns = self.compliance.turns
        if self.conditions is not None or turns is None:
            return
        if turns.max(initial=0.0) <= FEATURE_ANGLE * (1.0 + 1e-9):
            return
        corner = int(np.argmax(turns))
        points = self.compliance.points
        normals = self.compliance.normals
        directions = np.asarray(self.obstacle.directions(points, normals))
        # Refused where the obstacle follows the boundary; a plane has one direction.
        if np.max(np.abs(directions - normals)) <= 1e-9:
            raise InputError(
                f"BoundaryContact: the contact boundary turns by {np.degrees(turns[corner]):.3g} "
                f"degrees at {describe_point(points[corner])}: give conditions=conditions_on(mesh, "
                "compliance, one side, other side), a condition on each"
            )

    @property
    def count(self) -> int:
        """Return the number of contact nodes m."""
        return len(self.compliance.nodes)

    @property
    def frictional(self) -> bool:
        """Tell whether there can be tangential reactions."""
        return not isinstance(self.friction, Frictionless)

    @cached_property
    def _rows(self) -> Conditions:
        """Return the conditions: those given, or one at every contact node."""
        if self.conditions is not None:
            return self.conditions
        return Conditions(np.arange(self.count), self.compliance.normals, self.compliance.lengths)

    @cached_property
    def _facing(self) -> tuple[Array, Array]:
        """Return the contact directions (c, 2) and the gaps (c,) [m]."""
        rows = self._rows
        return locate_obstacle(self.obstacle, self.compliance.points[rows.nodes], rows.normals)

    @cached_property
    def _second(self) -> Mask:
        """Tell which of the c conditions belong to nodes that have one already."""
        second = np.ones(len(self._rows.nodes), bool)
        second[np.unique(self._rows.nodes, return_index=True)[1]] = False
        return second

    @cached_property
    def frames(self) -> Array:
        """Return N (2m, 2m) of v = N u.

        Its rows are the contact directions of all nodes, then their tangents or second directions.
        """
        m = self.count
        rows = self._rows
        second = self._second
        directions, _ = self._facing
        frames = np.tile(np.eye(2), (m, 1, 1))
        frames[rows.nodes[~second]] = make_nodal_frames(directions[~second]).swapaxes(1, 2)
        frames[rows.nodes[second], 1] = directions[second]
        N = np.zeros((2, m, 2, m))
        N[:, np.arange(m), :, np.arange(m)] = frames
        return N.reshape(2 * m, 2 * m)

    @cached_property
    def free(self) -> Mask:
        """Tell which of the 2m unknowns v are not supported."""
        flexibility = (self.frames @ self.compliance.W[0] @ self.frames.T).diagonal()
        return np.asarray(flexibility > SUPPORTED * flexibility.max(initial=0.0))

    @cached_property
    def W(self) -> Array:
        """Return the compliance (steps, f, f) of the f free unknowns v [m²/N]."""
        turned = np.matmul(np.matmul(self.frames, self.compliance.W), self.frames.T)
        return np.ascontiguousarray(turned[:, self.free][:, :, self.free])

    @cached_property
    def v_free(self) -> Array:
        """Return the motion (steps, f) of the free unknowns without contact [m]."""
        return np.ascontiguousarray((self.compliance.u_free @ self.frames.T)[:, self.free])

    @cached_property
    def surface(self) -> ContactSurface:
        """Return the conditions as the contract has them; its unknowns are the free ones."""
        rows = self._rows
        second = self._second
        count = len(rows.nodes)
        points = self.compliance.points[rows.nodes]

        # Numbers of the unknowns among the free ones; -1 for supported ones, and for tangents of
        # nodes that have a second direction instead.
        number = np.where(self.free, np.cumsum(self.free) - 1, -1)
        owned = number[rows.nodes + self.count * second]
        if (owned < 0).any():
            raise InputError(
                "BoundaryContact: a support holds a contact node in its contact direction; leave "
                "the node out of the contact boundary, or free that direction"
            )
        has_two = np.isin(rows.nodes, rows.nodes[second])
        tangents = np.where(has_two, -1, number[rows.nodes + self.count])
        size = float(np.ptp(self.compliance.points, axis=0).max())
        directions, gap = self._facing
        surface = ContactSurface(
            comm=SerialComm(),
            points=points,
            normals=directions,
            weights=rows.lengths,
            gap0=check_gap(gap, points, size),
            bilateral=np.full(count, self.bilateral),
            compliance=np.zeros(count),
            owned=owned,
            slots=np.arange(count),
            tangents=tangents[:, None],
        )
        return surface.moving(self.towards, self.along)

    @cached_property
    def symmetric(self) -> bool:
        """Tell whether W[0] is symmetric, as that of the symmetric Poincaré-Steklov operator is."""
        return max_abs(self.W[0] - self.W[0].T) <= ASYMMETRIC * max_abs(self.W[0])

    @cached_property
    def p_matrix(self) -> PMatrix:
        """Tell whether the step matrix, W[0] of contact, is a P-matrix.

        Steps then have one solution (``solvers.normal.uniqueness``).
        """
        rows = np.arange(self.free.sum()) if self.frictional else self.surface.owned
        answer = p_matrix(self.W[0][np.ix_(rows, rows)])
        if not (self.frictional and self.friction.slope(self.surface.weights).any()):
            return answer
        sentence = answer.sentence.replace(
            "the solution is",
            "for given limits of friction, which those of this law are not, the solution is",
        )
        return PMatrix(answer.holds, sentence)

    @cached_property
    def matrix(self) -> EffectiveMatrix:
        """Return the matrix A of the step, the inverse of W[0].

        Raises:
            InputError: a W[0] that has no inverse, or is not positive definite.
        """
        first = self.W[0]
        if not first.size:
            raise InputError(
                "BoundaryContact: supports hold all contact nodes; free some, or leave out contact"
            )
        if not self.symmetric:
            if np.linalg.cond(first) > 1.0 / ASYMMETRIC:
                raise InputError(
                    "BoundaryContact: the compliance of one step is singular; use the symmetric "
                    "Poincaré-Steklov operator"
                )
            return EffectiveMatrix(
                SerialMatrix(np.linalg.inv(first)), SerialAlgebra(symmetric=False)
            )
        first = 0.5 * (first + first.T)
        if np.linalg.eigvalsh(first)[0] <= SUPPORTED * first.max():
            raise InputError(
                "BoundaryContact: the compliance of one step is not positive definite; use the "
                "symmetric Poincaré-Steklov operator, and supports along contact directions or "
                "tangents only"
            )
        return EffectiveMatrix(SerialMatrix(np.linalg.inv(first)), SerialAlgebra())

    def step(self, k: int, loads: Array, before: Array, active: Mask) -> StepProblem:
        """Return the problem of a step.

        Args:
            k: number of the step, from 0.
            loads: (steps, f), -B_nᵀ r_n - B_tᵀ r_t of the steps before it [N/m].
            before: (f,), v at its start [m].
            active: (c,), the conditions to try as closed first.
        """
        dt = self.compliance.dt
        surface = self.surface
        past = self.v_free[k]
        if k:
            past = past + sum_products(self.W[k:0:-1], loads[:k, :, None])[:, 0]
        slip0 = surface.slip_origin(before, k * dt, (k + 1) * dt) if self.frictional else None
        return StepProblem(
            A=self.matrix,
            b=self.matrix @ past,
            bound=surface.gap((k + 1) * dt),
            surface=surface,
            scale=1.0,
            # the size that rounding is measured by, also where contact holds all points at zero
            guess=past,
            active=active,
            t=(k + 1) * dt,
            k=k + 1,
            friction=self.friction,
            slip0=slip0,
            rate_factor=1.0 / dt,
        )

    def load(self, r_n: Array, r_t: Array | None) -> Array:
        """Return the forces (f,) of the support on the free unknowns, -B_nᵀ r_n - B_tᵀ r_t."""
        return -self.surface.reaction_load(r_n, int(self.free.sum()), r_t)

    def cartesian(self, loads: Array) -> Array:
        """Return the nodal forces lam (steps, 2m) on the body of loads (steps, f).

        They are x of all contact nodes, then y.
        """
        return np.asarray(loads @ self.frames[self.free])
