"""Join two bodies with matching boundary nodes.

One part of their interface is in contact, another is welded.

Each body has its own mesh, material and operator; the bodies know each other only by the condensed
motion of interface nodes. With the forces lam on body 1 and -lam on body 2 the relative
displacement is

    w = u_1 - u_2 = (W_1 + W_2) * lam + (u_1,free - u_2,free)

the condensed motion of one body on a rigid support. Welded nodes have w = g in both directions at
the end of every step; their forces are eliminated, and what is left is a CondensedCompliance of the
contact nodes alone.

Jumps may be given on the whole interface, with n the normal of body 1:

    u_1 - u_2 = g                                              at welded nodes
    (u_1 - u_2 - g).n <= 0,    slip = u_t,1 - u_t,2 - g_t      at contact nodes
    p_1 + p_2 = f                                              everywhere

Here lam is p_1, which friction limits, and f - p_1 acts on body 2. The source has u_perp = -u.n, so
that g_perp = -g.n.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lu_factor, lu_solve

from ..core.algebra import Array, Indices, Mask, max_abs
from ..core.checks import array, describe_point, mask, optional, provides
from ..core.errors import InputError
from ..core.protocols import FrictionLaw, Frictionless
from ..core.surfaces import make_nodal_frames
from .contact import ASYMMETRIC, SUPPORTED, BoundaryContact, Conditions
from .energetic import sum_products
from .loads import traction_forces
from .poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance

MATCH = 1e-9  # of the extent of the interface: distance of matching nodes
OfPlace = Callable[[Array, float], Array]


@dataclass(frozen=True, eq=False)
class TwoBodies:
    """Describe two boundary value problems whose ``contact`` elements face each other.

    Every node of one interface has a partner at its place on the other.

    Attributes:
        one: body 1.
        two: body 2.
        welded: (n_1,) whether an element of body 1, part of its ``contact``, is welded to body 2.
            Nodes that touch such an element are welded.
        jump: g [m], a function of (points (m, 2), t) that returns (m, 2); or (steps, 2, m) at the
            interface nodes of body 1, ascending, at the ends of steps. None is zero.
        traction: f likewise: a function [Pa], or nodal forces [N/m], means over the steps. None is
            zero.

    Raises:
        InputError: nodes without a partner; different steps; welds outside the interface;
            histories of other shapes.
    """

    one: BoundaryProblem
    two: BoundaryProblem
    welded: Mask | None = None
    jump: OfPlace | Array | None = None
    traction: OfPlace | Array | None = None

    def __post_init__(self) -> None:
        owner = "TwoBodies"
        needed = ("operator", "contact", "condensed", "solve")
        provides(owner, "one", self.one, needed, "give a BoundaryProblem")
        provides(owner, "two", self.two, needed, "give a BoundaryProblem")
        optional(mask, owner, "welded", self.welded, (len(self.one.operator.mesh),))
        steps_of_one = len(self.one.forces)
        steps_of_two = len(self.two.forces)
        if steps_of_one != steps_of_two:
            raise InputError(
                f"TwoBodies: one has forces of {steps_of_one} steps and two of {steps_of_two}; "
                "give both as many"
            )
        for name in ("jump", "traction"):
            if not callable(getattr(self, name)):
                shape = (steps_of_one, 2, len(self.one.contact_nodes))
                optional(array, owner, name, getattr(self, name), shape)

    def jumps(self, t: float) -> Array:
        """Return g (2, m) [m] at the interface nodes of body 1 at time t [s].

        Given histories start at zero and are linear in a step.
        """
        nodes = self.one.contact_nodes
        if self.jump is None:
            return np.zeros((2, len(nodes)))
        if callable(self.jump):
            points = self.one.operator.mesh.points[nodes]
            name = f"the jump at t = {t:.6g} s"
            return array("TwoBodies", name, self.jump(points, t), points.shape, unit="m").T
        ends = np.concatenate([np.zeros((1, 2, len(nodes))), self.jump])
        place = min(max(t / self.one.operator.dt, 0.0), len(ends) - 1.0)
        k = min(int(place), len(ends) - 2)
        return np.asarray(ends[k] + (place - k) * (ends[k + 1] - ends[k]))

    @cached_property
    def _partner(self) -> Indices:
        """Return the node of body 2, among its interface nodes, at each of body 1 (m,)."""
        points_of_one = self.one.operator.mesh.points[self.one.contact_nodes]
        points_of_two = self.two.operator.mesh.points[self.two.contact_nodes]
        return match_points(points_of_one, points_of_two)

    @cached_property
    def _two(self) -> BoundaryProblem:
        """Return body 2 with the whole of the given jump of tractions among its loads."""
        if self.traction is None:
            return self.two
        nodes = self.one.contact_nodes
        loads = self.traction
        if callable(loads):
            law: OfPlace = loads
            all_nodes = traction_forces(
                self.one.operator.mesh,
                lambda points, _, t: law(points, t),
                dt=self.one.operator.dt,
                steps=len(self.one.forces),
                elements=self.one.contact,
            )
            loads = all_nodes[:, :, nodes]
        forces = np.array(self.two.forces, float)
        pieces = (1,) * (forces.ndim - 3)  # an axis for the pieces of a step, where there are some
        partners = self.two.contact_nodes[self._partner]
        forces[..., partners] += np.reshape(loads, (len(loads), *pieces, 2, len(nodes)))
        return replace(self.two, forces=forces)

    @cached_property
    def relative(self) -> CondensedCompliance:
        """Return W_1 + W_2 on all interface nodes, in the order and with the normals of body 1."""
        first = self.one.condensed()
        second = self._two.condensed()
        if first.W.shape != second.W.shape or abs(first.dt - second.dt) > 1e-12 * first.dt:
            raise InputError(
                f"TwoBodies: {len(first.W)} steps of {first.dt:.6g} s and {len(first.nodes)} nodes "
                f"face {len(second.W)} of {second.dt:.6g} s and {len(second.nodes)}; give both the "
                "same"
            )
        partner = self._partner
        unknowns = np.concatenate([partner, partner + len(partner)])
        return replace(
            first,
            W=first.W + second.W[:, unknowns][:, :, unknowns],
            u_free=first.u_free - second.u_free[:, unknowns],
        )

    @cached_property
    def _weld(self) -> "Weld":
        """Return what welds the bodies; with no welded element, it leaves all nodes to contact."""
        interface = np.asarray(self.one.contact, bool)
        welded = np.zeros(len(interface), bool)
        if self.welded is not None:
            welded = np.asarray(self.welded, bool)
        if (welded & ~interface).any():
            raise InputError(
                "TwoBodies: `welded` has elements of body 1 that are not in its `contact`; add "
                "them there"
            )
        # Lengths and normals of contact nodes are those of the elements in contact alone.
        mesh = self.one.operator.mesh
        nodes = self.relative.nodes
        contact = interface & ~welded
        relative = replace(
            self.relative,
            lengths=mesh.node_lengths(contact)[nodes],
            normals=mesh.node_normals(contact)[nodes],
        )
        dt = relative.dt
        jumps = np.array([self.jumps((k + 1) * dt).ravel() for k in range(len(relative.W))])
        return Weld(relative, mesh.nodes_of(welded)[nodes], jumps)

    def condensed(self) -> CondensedCompliance:
        """Return the compliance of the contact nodes, for BoundaryContact.

        ``normals`` point from body 1 to body 2.
        """
        return self._weld.contact

    def contact(
        self,
        friction: FrictionLaw | None = None,
        *,
        conditions: Conditions | None = None,
        bilateral: bool = False,
    ) -> BoundaryContact:
        """Set up contact of the nodes that are not welded.

        The normal part of the given jump is how far body 2 has moved towards body 1 beforehand, its
        tangential part how far it has slid.

        Args:
            friction: the law of friction; None for none.
            conditions: None for one condition at every contact node.
            bilateral: whether every point is held on the other body.
        """
        compliance = self.condensed()
        friction = friction or Frictionless()
        if self.jump is None:
            return BoundaryContact(
                compliance, friction=friction, conditions=conditions, bilateral=bilateral
            )
        touching = np.flatnonzero(np.isin(self.relative.nodes, compliance.nodes))
        if conditions is None:
            places = touching
            frames = make_nodal_frames(compliance.normals)
        else:
            places = touching[conditions.nodes]
            frames = make_nodal_frames(conditions.normals)

        def part(t: float, column: int) -> Array:
            """Return the part (c,) of the jump along the normals (0) or the tangents (1)."""
            return np.asarray(np.sum(self.jumps(t)[:, places].T * frames[:, :, column], axis=1))

        return BoundaryContact(
            compliance,
            friction=friction,
            conditions=conditions,
            bilateral=bilateral,
            towards=lambda t: -part(t, 0),
            along=lambda t: part(t, 1)[:, None],
        )

    def solve(self, forces: Array | None = None) -> tuple[BoundaryMotion, BoundaryMotion]:
        """Return the motions of both bodies under loads, contact forces and forces of the welds.

        The contact forces (steps, 2m_c) [N/m] are those on body 1; None is for no contact.
        """
        relative = self.relative
        shape = (len(relative.W), self.condensed().W.shape[1])
        if forces is None:
            forces = np.zeros(shape)
        else:
            forces = array("TwoBodies.solve", "forces", forces, shape, unit="N/m")
        on_one = self._weld.forces(forces)
        points_of_two = self.two.operator.mesh.points[self.two.contact_nodes]
        back = match_points(points_of_two, relative.points)
        on_two = -on_one[:, np.concatenate([back, back + len(back)])]
        return self.one.solve(on_one), self._two.solve(on_two)


def match_points(points: Array, partners: Array) -> Indices:
    """Return the number of that point of ``partners`` (m, 2) which is at each point (m, 2).

    Raises InputError where there is none.
    """
    distance = np.hypot(*(points[:, None] - partners).transpose(2, 0, 1))
    nearest = distance.argmin(axis=1)
    away = distance.min(axis=1)
    worst = int(away.argmax())
    if len(points) != len(partners) or away[worst] > MATCH * np.ptp(points, axis=0).max():
        raise InputError(
            f"TwoBodies: the node at {describe_point(points[worst])} has no partner on the other "
            "body; give both interfaces the same nodes"
        )
    return nearest


def factorise(matrix: Array) -> Callable[[Array], Array]:
    """Return the function b -> matrix⁻¹ b.

    It has Cholesky's factors or, for a matrix of the unsymmetric form, LU factors.
    """
    if max_abs(matrix - matrix.T) > ASYMMETRIC * max_abs(matrix):
        return partial(lu_solve, lu_factor(matrix))
    return partial(cho_solve, cho_factor(0.5 * (matrix + matrix.T)))


class Weld:
    """Hold the relative displacement of some nodes at given jumps.

    Attributes:
        contact: what is left of a compliance when the weld forces are eliminated.
    """

    def __init__(self, compliance: CondensedCompliance, nodes: Mask, jumps: Array) -> None:
        """Eliminate the weld forces.

        Args:
            compliance: the relative motion of all m interface nodes.
            nodes: (m,), which of them are welded.
            jumps: (steps, 2m), their relative displacements at the ends of the steps [m].
        """
        W = compliance.W
        steps = len(W)
        flexibility = W[0].diagonal()
        welded = np.tile(nodes, 2) & (flexibility > SUPPORTED * flexibility.max())
        touching = np.tile(~nodes, 2)
        self._welded = welded
        self._touching = touching

        # Relative displacement of welded unknowns after unit contact forces in step 0, and in the
        # last column without any; and after unit weld forces.
        from_contact = W[:, welded][:, :, touching]
        without = (compliance.u_free - jumps)[:, welded, None]
        known = np.concatenate([from_contact, without], axis=2)
        from_welds = W[:, welded][:, :, welded]

        # The same of contact unknowns, as if nothing were welded.
        contact_W = W[:, touching][:, :, touching]
        motion = np.concatenate([contact_W, compliance.u_free[:, touching, None]], axis=2)

        # Weld forces that bring the welded unknowns to their jumps, step by step, and what they
        # move the contact unknowns by.
        self._responses = np.zeros_like(known)
        if welded.any():
            solve = factorise(from_welds[0])
            for k in range(steps):
                early = sum_products(from_welds[k:0:-1], self._responses[:k]) if k else 0.0
                self._responses[k] = -solve(known[k] + early)
            to_contact = W[:, touching][:, :, welded]
            moved = [
                sum_products(to_contact[k::-1], self._responses[: k + 1]) for k in range(steps)
            ]
            motion += np.array(moved)
        self.contact = replace(
            compliance,
            W=np.ascontiguousarray(motion[:, :, :-1]),
            u_free=np.ascontiguousarray(motion[:, :, -1]),
            nodes=compliance.nodes[~nodes],
            points=compliance.points[~nodes],
            normals=compliance.normals[~nodes],
            lengths=compliance.lengths[~nodes],
        )

    def forces(self, contact_forces: Array) -> Array:
        """Return the forces (steps, 2m) of contact (steps, 2m_c) and of the welds [N/m]."""
        forces = np.zeros((len(contact_forces), len(self._welded)))
        forces[:, self._touching] = contact_forces
        if self._welded.any():
            columns = contact_forces[:, :, None]
            for k in range(len(contact_forces)):
                follow = sum_products(self._responses[k::-1, :, :-1], columns[: k + 1])
                forces[k, self._welded] = self._responses[k, :, -1] + follow[:, 0]
        return forces
