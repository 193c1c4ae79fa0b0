"""Join two bodies with matching boundary nodes: contact on one part of their interface, welds on another.

Each body has its own mesh, material and operator; only the condensed motion of interface nodes meets. With the forces
lam on body 1 and -lam on body 2 the relative displacement is

    w = u_1 - u_2 = (W_1 + W_2) * lam + (u_1,free - u_2,free)

the condensed motion of one body on a rigid support. Welded nodes have w = 0 in both directions at the end of every
step; their forces are eliminated, and what is left is a CondensedCompliance of the contact nodes alone.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vi_contact.bem.contact import SUPPORTED
from vi_contact.bem.energetic import summed
from vi_contact.bem.poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance
from vi_contact.core.algebra import Array, Indices, Mask
from vi_contact.core.checks import array, at, mask, optional, provides
from vi_contact.core.errors import InputError

MATCH = 1e-9  # of the extent of the interface: distance of matching nodes


@dataclass(frozen=True, eq=False)
class TwoBodies:
    """Describe two boundary value problems whose ``contact`` elements face each other, node on node.

    welded: (n_1,) elements of body 1 on the transmission interface, part of its ``contact``; nodes that touch one of
    them are welded. Raises InputError for nodes without a partner, different steps, and welds outside the interface.
    """

    one: BoundaryProblem
    two: BoundaryProblem
    welded: Mask | None = None

    def __post_init__(self) -> None:
        for name in ("one", "two"):
            provides("TwoBodies", name, getattr(self, name), ("operator", "contact", "condensed", "solve"),
                     "give a BoundaryProblem")
        optional(mask, "TwoBodies", "welded", self.welded, (len(self.one.operator.mesh),))

    @cached_property
    def relative(self) -> CondensedCompliance:
        """Return W_1 + W_2 on all interface nodes, in the order and with the normals of body 1."""
        one, two = self.one.condensed(), self.two.condensed()
        if one.W.shape != two.W.shape or abs(one.dt - two.dt) > 1e-12 * one.dt:
            raise InputError(f"TwoBodies: {len(one.W)} steps of {one.dt:.6g} s and {len(one.nodes)} nodes face "
                             f"{len(two.W)} of {two.dt:.6g} s and {len(two.nodes)}; give both the same")
        partner = matching(one.points, two.points)
        unknowns = np.concatenate([partner, partner + len(partner)])
        return replace(one, W=one.W + two.W[:, unknowns][:, :, unknowns], u_free=one.u_free - two.u_free[:, unknowns])

    @cached_property
    def _weld(self) -> "Weld":
        relative, interface = self.relative, np.asarray(self.one.contact, bool)
        elements = np.zeros(len(interface), bool) if self.welded is None else np.asarray(self.welded, bool)
        if (elements & ~interface).any():
            raise InputError("TwoBodies: `welded` has elements of body 1 that are not in its `contact`; add them there")
        mesh = self.one.operator.mesh
        contact = interface & ~elements
        relative = replace(relative, lengths=mesh.node_lengths(contact)[relative.nodes],
                           normals=mesh.node_normals(contact)[relative.nodes])
        return Weld(relative, mesh.nodes_of(elements)[relative.nodes])

    def condensed(self) -> CondensedCompliance:
        """Return the compliance of the contact nodes, for BoundaryContact; ``normals`` point from body 1 to body 2."""
        return self._weld.contact

    def solve(self, forces: Array | None = None) -> tuple[BoundaryMotion, BoundaryMotion]:
        """Return the motions of both bodies under loads, contact forces (steps, 2m_c) on body 1, and the welds."""
        relative = self.relative
        shape = (len(relative.W), self.condensed().W.shape[1])
        forces = np.zeros(shape) if forces is None else array("TwoBodies.solve", "forces", forces, shape, unit="N/m")
        on_one = self._weld.forces(forces)
        two_nodes = self.two.operator.mesh.points[self.two.contact_nodes]
        back = matching(two_nodes, relative.points)
        return self.one.solve(on_one), self.two.solve(-on_one[:, np.concatenate([back, back + len(back)])])


def matching(points: Array, others: Array) -> Indices:
    """Return (m,) number of the point of ``others`` (m, 2) at each of ``points`` (m, 2), or raise InputError."""
    distance = np.hypot(*(points[:, None] - others).transpose(2, 0, 1))
    nearest = distance.argmin(axis=1)
    away = distance.min(axis=1)
    worst = int(away.argmax())
    if len(points) != len(others) or away[worst] > MATCH * np.ptp(points, axis=0).max():
        raise InputError(f"TwoBodies: the node at {at(points[worst])} has no partner on the other body; give both "
                         "interfaces the same nodes")
    return nearest


class Weld:
    """Hold the relative displacement of masked nodes (m,) at zero from the first step on: ``contact`` is what is left
    of a compliance when the weld forces are eliminated."""

    def __init__(self, compliance: CondensedCompliance, nodes: Mask) -> None:
        W, steps = compliance.W, len(compliance.W)
        flexibility = W[0].diagonal()
        self._welded = welded = np.tile(nodes, 2) & (flexibility > SUPPORTED * flexibility.max())
        self._touching = touching = np.tile(~nodes, 2)
        inner, cross, across = W[:, welded][:, :, welded], W[:, welded][:, :, touching], W[:, touching][:, :, welded]
        known = np.concatenate([cross, compliance.u_free[:, welded, None]], axis=2)
        # (steps, |I|, 2m_c + 1) weld forces after unit contact forces in step 0, in the last column without any
        self._responses = responses = np.zeros_like(known)
        left = np.concatenate([W[:, touching][:, :, touching], compliance.u_free[:, touching, None]], axis=2)
        if welded.any():
            factor = cho_factor(0.5 * (inner[0] + inner[0].T))
            for k in range(steps):
                early = summed(inner[k:0:-1], responses[:k]) if k else 0.0
                responses[k] = -cho_solve(factor, known[k] + early)
            left += np.array([summed(across[k::-1], responses[: k + 1]) for k in range(steps)])
        kept = {name: getattr(compliance, name)[~nodes] for name in ("nodes", "points", "normals", "lengths")}
        W, u_free = np.ascontiguousarray(left[:, :, :-1]), np.ascontiguousarray(left[:, :, -1])
        self.contact = replace(compliance, W=W, u_free=u_free, **kept)

    def forces(self, contact_forces: Array) -> Array:
        """Return (steps, 2m): contact forces (steps, 2m_c) and the weld forces that go with them."""
        everything = np.zeros((len(contact_forces), len(self._welded)))
        everything[:, self._touching] = contact_forces
        if self._welded.any():
            for k in range(len(contact_forces)):
                follow = summed(self._responses[k::-1, :, :-1], contact_forces[: k + 1, :, None])[:, 0]
                everything[k, self._welded] = self._responses[k, :, -1] + follow
        return everything
