"""Join two bodies with matching boundary nodes.

One part of their interface is in contact, another is welded.

Each body has its own mesh, material and operator; only the condensed motion of interface nodes
meets. With the forces lam on body 1 and -lam on body 2 the relative displacement is

    w = u_1 - u_2 = (W_1 + W_2) * lam + (u_1,free - u_2,free)

the condensed motion of one body on a rigid support. Welded nodes have w = g in both directions at
the end of every step; their forces are eliminated, and what is left is a CondensedCompliance of the
contact nodes alone.

Jumps may be given on the whole interface, with n the normal of body 1: welded nodes have u_1 - u_2
= g, contact nodes (u_1 - u_2 - g).n <= 0 and slip u_t,1 - u_t,2 - g_t; p_1 + p_2 = f everywhere,
where lam is p_1 and f - p_1 acts on body 2: friction limits p_1. The source has u_perp = -u.n, so
that g_perp = -g.n.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lu_factor, lu_solve

from ..core.algebra import Array, Indices, Mask, max_abs
from ..core.checks import array, at, mask, optional, provides
from ..core.errors import InputError
from ..core.protocols import FrictionLaw, Frictionless
from ..core.surfaces import nodal_frames
from .contact import ASYMMETRIC, SUPPORTED, BoundaryContact, Conditions
from .energetic import summed
from .loads import traction_forces
from .poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance

MATCH = 1e-9  # of the extent of the interface: distance of matching nodes
OfPlace = Callable[[Array, float], Array]


@dataclass(frozen=True, eq=False)
class TwoBodies:
    """Describe two boundary value problems whose ``contact`` elements face each other.

    They do so node on node.

    welded: (n_1,) elements of body 1 on the transmission interface, part of its ``contact``; nodes
    that touch one of them are welded. jump: g [m], a function of (points (m, 2), t) that returns
    (m, 2), or (steps, 2, m) at the interface nodes of body 1, ascending, at the ends of steps;
    traction: f likewise, [Pa] from a function or nodal forces [N/m], means over steps; None: zero.

    Raises InputError for nodes without a partner, different steps, welds outside the interface, and
    histories of other shapes.
    """

    one: BoundaryProblem
    two: BoundaryProblem
    welded: Mask | None = None
    jump: OfPlace | Array | None = None
    traction: OfPlace | Array | None = None

    def __post_init__(self) -> None:
        for name in ("one", "two"):
            provides(
                "TwoBodies",
                name,
                getattr(self, name),
                ("operator", "contact", "condensed", "solve"),
                "give a BoundaryProblem",
            )
        optional(mask, "TwoBodies", "welded", self.welded, (len(self.one.operator.mesh),))
        steps = [len(body.forces) for body in (self.one, self.two)]
        if steps[0] != steps[1]:
            raise InputError(
                f"TwoBodies: one has forces of {steps[0]} steps and two of {steps[1]}; give both "
                "as many"
            )
        for name in ("jump", "traction"):
            if not callable(getattr(self, name)):
                shape = (len(self.one.forces), 2, len(self.one.contact_nodes))
                optional(array, "TwoBodies", name, getattr(self, name), shape)

    def jumps(self, t: float) -> Array:
        """Return g (2, m) at the interface nodes of body 1 at time t.

        Histories are linear in a step.
        """
        nodes = self.one.contact_nodes
        if self.jump is None:
            return np.zeros((2, len(nodes)))
        if callable(self.jump):
            points = self.one.operator.mesh.points[nodes]
            return array(
                "TwoBodies",
                f"the jump at t = {t:.6g} s",
                self.jump(points, t),
                points.shape,
                unit="m",
            ).T
        ends = np.concatenate([np.zeros((1, 2, len(nodes))), self.jump])
        place = min(max(t / self.one.operator.dt, 0.0), len(ends) - 1.0)
        k = min(int(place), len(ends) - 2)
        return np.asarray(ends[k] + (place - k) * (ends[k + 1] - ends[k]))

    @cached_property
    def _partner(self) -> Indices:
        """Return (m,) the node of body 2, among its interface nodes, at each of body 1."""
        one, two = (body.operator.mesh.points[body.contact_nodes] for body in (self.one, self.two))
        return matching(one, two)

    @cached_property
    def _two(self) -> BoundaryProblem:
        """Return body 2 with the given jump of tractions, all of it, among its loads."""
        if self.traction is None:
            return self.two
        mesh, nodes = self.one.operator.mesh, self.one.contact_nodes
        loads = self.traction
        if callable(loads):
            law: OfPlace = loads
            loads = traction_forces(
                mesh,
                lambda points, _, t: law(points, t),
                dt=self.one.operator.dt,
                steps=len(self.one.forces),
                elements=self.one.contact,
            )[:, :, nodes]
        forces = np.array(self.two.forces, float)
        pieces = (1,) * (forces.ndim - 3)  # of a step, where the operator has such
        forces[..., self.two.contact_nodes[self._partner]] += np.reshape(
            loads, (len(loads), *pieces, 2, len(nodes))
        )
        return replace(self.two, forces=forces)

    @cached_property
    def relative(self) -> CondensedCompliance:
        """Return W_1 + W_2 on all interface nodes, in the order and with the normals of body 1."""
        one, two = self.one.condensed(), self._two.condensed()
        if one.W.shape != two.W.shape or abs(one.dt - two.dt) > 1e-12 * one.dt:
            raise InputError(
                f"TwoBodies: {len(one.W)} steps of {one.dt:.6g} s and {len(one.nodes)} nodes face "
                f"{len(two.W)} of {two.dt:.6g} s and {len(two.nodes)}; give both the same"
            )
        partner = self._partner
        unknowns = np.concatenate([partner, partner + len(partner)])
        return replace(
            one,
            W=one.W + two.W[:, unknowns][:, :, unknowns],
            u_free=one.u_free - two.u_free[:, unknowns],
        )

    @cached_property
    def _weld(self) -> "Weld":
        relative, interface = self.relative, np.asarray(self.one.contact, bool)
        elements = (
            np.zeros(len(interface), bool) if self.welded is None else np.asarray(self.welded, bool)
        )
        if (elements & ~interface).any():
            raise InputError(
                "TwoBodies: `welded` has elements of body 1 that are not in its `contact`; add "
                "them there"
            )
        mesh = self.one.operator.mesh
        contact = interface & ~elements
        relative = replace(
            relative,
            lengths=mesh.node_lengths(contact)[relative.nodes],
            normals=mesh.node_normals(contact)[relative.nodes],
        )
        dt, steps = relative.dt, len(relative.W)
        jumps = np.array([self.jumps((k + 1) * dt).ravel() for k in range(steps)])
        return Weld(relative, mesh.nodes_of(elements)[relative.nodes], jumps)

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
        """
        compliance = self.condensed()
        chosen = np.arange(len(compliance.nodes)) if conditions is None else conditions.nodes
        frames = nodal_frames(compliance.normals if conditions is None else conditions.normals)
        places = np.flatnonzero(np.isin(self.relative.nodes, compliance.nodes))[chosen]

        def part(t: float, column: int) -> Array:
            return np.asarray(np.sum(self.jumps(t)[:, places].T * frames[:, :, column], axis=1))

        return BoundaryContact(
            compliance,
            friction=friction or Frictionless(),
            conditions=conditions,
            bilateral=bilateral,
            towards=None if self.jump is None else lambda t: -part(t, 0),
            along=None if self.jump is None else lambda t: part(t, 1)[:, None],
        )

    def solve(self, forces: Array | None = None) -> tuple[BoundaryMotion, BoundaryMotion]:
        """Return the motions of both bodies under loads.

        Contact forces (steps, 2m_c) act on body 1, and the forces of the welds on both.
        """
        relative = self.relative
        shape = (len(relative.W), self.condensed().W.shape[1])
        forces = (
            np.zeros(shape)
            if forces is None
            else array("TwoBodies.solve", "forces", forces, shape, unit="N/m")
        )
        on_one = self._weld.forces(forces)
        two_nodes = self.two.operator.mesh.points[self.two.contact_nodes]
        back = matching(two_nodes, relative.points)
        return self.one.solve(on_one), self._two.solve(
            -on_one[:, np.concatenate([back, back + len(back)])]
        )


def matching(points: Array, others: Array) -> Indices:
    """Return (m,) number of the point of ``others`` (m, 2).

    It is the one at each of ``points`` (m, 2); where there is none, InputError is raised.
    """
    distance = np.hypot(*(points[:, None] - others).transpose(2, 0, 1))
    nearest = distance.argmin(axis=1)
    away = distance.min(axis=1)
    worst = int(away.argmax())
    if len(points) != len(others) or away[worst] > MATCH * np.ptp(points, axis=0).max():
        raise InputError(
            f"TwoBodies: the node at {at(points[worst])} has no partner on the other body; give "
            "both interfaces the same nodes"
        )
    return nearest


def inverse(matrix: Array) -> Callable[[Array], Array]:
    """Return b -> matrix⁻¹ b.

    It uses Cholesky's factors or, for a matrix of the unsymmetric form, LU factors.
    """
    if max_abs(matrix - matrix.T) > ASYMMETRIC * max_abs(matrix):
        return partial(lu_solve, lu_factor(matrix))
    return partial(cho_solve, cho_factor(0.5 * (matrix + matrix.T)))


class Weld:
    """Hold the relative displacement of masked nodes (m,) at given jumps (steps, 2m).

    ``contact`` is what is left of a compliance when the weld forces are eliminated.
    """

    def __init__(self, compliance: CondensedCompliance, nodes: Mask, jumps: Array) -> None:
        W, steps = compliance.W, len(compliance.W)
        flexibility = W[0].diagonal()
        self._welded = welded = np.tile(nodes, 2) & (flexibility > SUPPORTED * flexibility.max())
        self._touching = touching = np.tile(~nodes, 2)
        inner, cross, across = (
            W[:, welded][:, :, welded],
            W[:, welded][:, :, touching],
            W[:, touching][:, :, welded],
        )
        known = np.concatenate([cross, (compliance.u_free - jumps)[:, welded, None]], axis=2)
        # (steps, |I|, 2m_c + 1) weld forces after unit contact forces in step 0, in the last column
        # without any
        self._responses = responses = np.zeros_like(known)
        left = np.concatenate(
            [W[:, touching][:, :, touching], compliance.u_free[:, touching, None]], axis=2
        )
        if welded.any():
            solve = inverse(inner[0])
            for k in range(steps):
                early = summed(inner[k:0:-1], responses[:k]) if k else 0.0
                responses[k] = -solve(known[k] + early)
            left += np.array([summed(across[k::-1], responses[: k + 1]) for k in range(steps)])
        kept = {
            name: getattr(compliance, name)[~nodes]
            for name in ("nodes", "points", "normals", "lengths")
        }
        W, u_free = np.ascontiguousarray(left[:, :, :-1]), np.ascontiguousarray(left[:, :, -1])
        self.contact = replace(compliance, W=W, u_free=u_free, **kept)

    def forces(self, contact_forces: Array) -> Array:
        """Return (steps, 2m): contact forces (steps, 2m_c).

        With them come the weld forces that go with them.
        """
        everything = np.zeros((len(contact_forces), len(self._welded)))
        everything[:, self._touching] = contact_forces
        if self._welded.any():
            for k in range(len(contact_forces)):
                follow = summed(self._responses[k::-1, :, :-1], contact_forces[: k + 1, :, None])[
                    :, 0
                ]
                everything[k, self._welded] = self._responses[k, :, -1] + follow
        return everything
