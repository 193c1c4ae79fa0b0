"""Choose the mass matrix of the equations of motion.

It is consistent, or without inertia at the contact nodes.

With mass at the contact nodes every closure is an impact of that mass: forces ring and, with
contact in the acceleration balance, energy grows. Without it the contact unknowns follow the body
statically (Khenous, Laborde and Renard 2008; Hager, Hüeber and Wohlmuth 2008), the semi-discrete
problem has a unique energy-conserving solution, and contact forces are those of the waves alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array, Comm, Indices, Mask, Matrix, largest, max_abs, total
from ..core.arguments import check_fields
from ..core.corners import lumped_entries
from ..core.errors import InputError
from ..core.quantities import Between
from ..core.surfaces import ContactSurface
from ..core.system import SemiDiscreteSystem
from .mass_transfer import from_neighbours, named, rigid_motions

LIGHT = 1e-9  # of the diagonal entry of M: a row sum that is none
LARGEST_CORRECTION = (
    0.35  # of a node's lumped mass: beyond, the mesh is too coarse to move mass about
)


@dataclass(frozen=True)
class ConsistentMass:
    """Keep M as assembled; impact laws need it, for without mass there is nothing to rebound."""

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem:
        """Return the system as it is."""
        return system


@dataclass(frozen=True)
class Redistributed:
    """Take the mass from the normal unknowns of all contact nodes.

    With friction it is also taken from ``tangential`` ones.

    M* = Pᵀ M_l P + D with M_l = (1 - lumping) M + lumping diag(row sums of M). P gives every
    contact node the velocity of the rigid motion that fits its neighbours behind the surface best:
    it hands the node's mass to them, keeps every rigid motion as it is, and makes M* positive
    semidefinite. The nodal masses D, polynomials of degree 2 in the coordinates times those of M
    and of the order of (mesh size / body size)², restore what the lumping changed: the mass matrix
    of rigid motions (total mass, centre of mass, all moments and products of inertia) of every
    body; in 1D also what the shift by one element changed, centre and second moment. Damping sees
    the same velocities, C* = PᵀCP: a force on massless unknowns that depends on their rate would
    ring. Bodies with tied sides cannot turn: of them the total mass is kept.

    ``lumping`` 0.4 balances the dispersion of mesh and time step: consistent mass sends high
    frequencies ahead of the wave, lumped mass leaves them behind (table in docs/guide/schemes.md).
    Row sums of P2 are zero at the vertices of plane triangles, which does no harm, and may be
    negative on curved ones: those want lumping 0. P2 tetrahedra are not lumped: their vertices
    would bear it all, and frequencies fall by per cents. InputError for lumping outside [0, 1] or
    above 0 with negative row sums, a contact node with no material behind it, or a mesh too coarse
    to hold the inertia.
    """

    lumping: Annotated[
        float, Between(0.0, 1.0, remedy="give a share from 0 (consistent) to 1 (lumped)")
    ] = 0.4

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem:
        """Return the system without mass at the contact unknowns."""
        if surface.total == 0:
            return system
        massless, contact = _contact_unknowns(system, surface, tangential)
        algebra, own = system.algebra, system.M.diagonal()
        # row sums, in any nodal frames
        nodal = np.asarray(sum(r * (system.M @ r) for r in system.influence.T))
        still = (own > 0.0) & ~system.influence.any(axis=1)  # no translation moves them
        lumping = self.lumping
        if system.space.hierarchy is not None:
            lumping = 0.0
        elif largest(algebra.comm, still.any()):
            raise InputError(
                "redistributed mass is for displacements only, and M has the inertia of rotations "
                "or of other unknowns: give the problem mass=ConsistentMass()"
            )
        # as of elements of higher order
        wrong = int(total(algebra.comm, np.sum(nodal < -LIGHT * own)))
        if wrong and lumping:
            raise InputError(
                f"redistributed mass cannot lump negative row sums of M and {wrong} unknowns have "
                "them: give the problem mass=Redistributed(lumping=0.0) or ConsistentMass()"
            )
        nodal = own if wrong else np.maximum(nodal, 0.0)
        inner = ~(contact | still)
        lumped = algebra.local(*lumped_entries(surface, nodal), system.rows)
        bulk = algebra.combine([(1.0 - lumping, system.M), (lumping, lumped)])
        levels = from_neighbours(system, massless, contact, nodal)
        moved, C, load = bulk, system.C, system.load
        for P in levels:  # the last one is applied to velocities first
            moved, load = algebra.congruence(P, moved), load.handed_over(P)
            C = None if C is None else algebra.congruence(P, C)
        corrections = [
            _inertia_correction(system, moved, body & inner, body, nodal)
            for body in _bodies(system, inner)
        ]
        M = algebra.combine([(1.0, moved), *((1.0, correction) for correction in corrections)])
        massless = massless if system.massless is None else massless | system.massless
        return system.changed(M=M, C=C, load=load, massless=massless)


def _bodies(system: SemiDiscreteSystem, inner: Mask) -> Iterator[Mask]:
    """Return the unknowns of every body that has inner ones. Collective."""
    comm, numbers = system.algebra.comm, np.asarray(system.space.bodies)
    last = int(largest(comm, np.max(numbers, initial=0)))
    for number in range(last + 1):
        body = numbers == number
        if largest(comm, (body & inner).any()):
            yield body


def _contact_unknowns(
    system: SemiDiscreteSystem, surface: ContactSurface, tangential: bool
) -> tuple[Mask, Mask]:
    """(massless unknowns, all unknowns of contact nodes)."""
    contact = np.zeros(system.rows, dtype=bool)
    contact[surface.owned] = True
    massless = contact.copy()
    contact[surface.tangents[surface.tangents >= 0]] = True
    # relative unknowns: nodes of both sides lose their inertia as a whole
    if surface.coupling is not None:
        # side 2, which would ring with mass
        faced = system.algebra.entries(surface.coupling, np.flatnonzero(contact))
        contact[named(system, faced.indices)] = True
    return (contact.copy() if tangential or surface.coupling is not None else massless), contact


def _inertia_correction(
    system: SemiDiscreteSystem, moved: Matrix, inner: Mask, body: Mask, nodal: Array
) -> Matrix:
    """Return D of one body.

    D holds the smallest nodal masses m_i p(x_i) on its inner nodes, p a symmetric (d, d) matrix of
    polynomials of degree 2, such that Rᵀ(M* + D)R = RᵀMR for its rigid motions R.
    """
    comm, d = system.algebra.comm, system.influence.shape[1]
    points = system.space.coordinates
    high = comm.max(np.max(points[body], axis=0, initial=-np.inf))
    low = -comm.max(np.max(-points[body], axis=0, initial=-np.inf))
    x = (points - 0.5 * (low + high)) / max(float(np.max(high - low)), 1e-300)
    R = rigid_motions(system.influence, x)
    if d == 1:  # the uniform stretch too
        R = np.column_stack([R, system.influence[:, 0] * x[:, 0]])
    R = R * body[:, None]
    if system.tied is not None and largest(comm, (body & system.tied).any()):
        R = R[:, :d]
    upper = np.triu_indices(R.shape[1])
    wanted = R.T @ np.column_stack([system.M @ mode - moved @ mode for mode in R.T])
    powers = np.column_stack(
        [np.ones(len(x)), *x.T] + [x[:, i] * x[:, j] for i in range(d) for j in range(i, d)]
    )
    pairs = list(_pairs_of_components(system, inner))
    shapes = [powers[i] @ _orthonormal(comm, powers[i], nodal[i]) for i, _ in pairs]
    # an off-diagonal mass stands in two places: with this factor "smallest" does not depend on the
    # axes
    shapes = [
        shape * (1.0 if i is j else np.sqrt(2.0))
        for shape, (i, j) in zip(shapes, pairs, strict=True)
    ]
    effects = []
    for (i, j), shape in zip(pairs, shapes, strict=True):
        for p in shape.T:
            block = R[i].T @ ((nodal[i] * p)[:, None] * R[j])
            effects.append((0.5 * (block + block.T))[upper])
    packed = comm.sum(np.column_stack([wanted[upper], *effects]))
    coefficients = np.linalg.lstsq(packed[:, 1:], packed[:, 0], rcond=1e-10)[0]
    ends = np.cumsum([shape.shape[1] for shape in shapes])[:-1]
    shares = [shape @ c for shape, c in zip(shapes, np.split(coefficients, ends), strict=True)]
    entries = [
        share if i is j else 0.5 * share for share, (i, j) in zip(shares, pairs, strict=True)
    ]
    moved_most = largest(comm, max_abs(np.concatenate(entries)))
    if moved_most > LARGEST_CORRECTION:
        raise InputError(
            "the mesh is too coarse for redistributed mass, which would change nodal "
            f"masses by {100 * moved_most:.0f} %: refine it, or give the problem "
            "mass=ConsistentMass()"
        )
    i, j = (np.concatenate([pair[side] for pair in pairs]) for side in (0, 1))
    value = 0.5 * np.concatenate(shares) * nodal[i]
    both = np.concatenate([i, j]), np.concatenate([j, i])
    return system.algebra.local(*both, np.tile(value, 2), system.rows)


def _orthonormal(comm: Comm, powers: Array, nodal: Array) -> Array:
    """Return columns c such that the polynomials powers @ c are orthonormal.

    The weights are the nodal masses. With these columns the smallest coefficients are the smallest
    changes of nodal masses. Dependent polynomials are left out.
    """
    values, vectors = np.linalg.eigh(comm.sum(powers.T @ (nodal[:, None] * powers)))
    kept = values > 1e-10 * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]))


def _pairs_of_components(
    system: SemiDiscreteSystem, inner: Mask
) -> Iterator[tuple[Indices, Indices]]:
    """Return (unknowns of direction c, of direction e) of the inner nodes that have both.

    There is one pair for each c <= e.
    """
    d = system.influence.shape[1]
    mine = np.flatnonzero(inner)
    numbers, component = np.divmod(np.asarray(system.space.ids)[mine], d)
    nodes, place = np.unique(numbers, return_inverse=True)
    table = np.full((len(nodes), d), -1, dtype=np.int64)
    table[place, component] = mine
    for c in range(d):
        for e in range(c, d):
            full = (table[:, c] >= 0) & (table[:, e] >= 0)
            own = table[full, c]
            yield own, own if c == e else table[full, e]
