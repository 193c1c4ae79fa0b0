"""Choose the mass matrix of the equations: consistent, or without inertia at the contact nodes.

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
from ..core.corners import lump_masses
from ..core.errors import InputError
from ..core.quantities import Between
from ..core.surfaces import ContactSurface
from ..core.system import SemiDiscreteSystem
from .mass_transfer import rigid_motions, select_named, transfer_to_neighbours

LIGHT = 1e-9  # of the diagonal entry of M: a row sum that is zero, but for round-off
# Of a node's lumped mass: beyond it the mesh is too coarse to move mass about.
LARGEST_CORRECTION = 0.35
DEPENDENT = 1e-10  # relative; singular values of dependent polynomials and rigid motions
NO_LENGTH = 1e-300  # in place of the size of a body of one point


@dataclass(frozen=True)
class ConsistentMass:
    """Keep M as assembled; impact laws need it, for without mass there is nothing to rebound."""

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem:
        """Return the system as it is, for any arguments of ``core.protocols.MassLaw``.

        Args:
            system: the equations.
            surface: the contact conditions.
            tangential: whether tangential unknowns lose their mass too.
        """
        return system


@dataclass(frozen=True)
class Redistributed:
    """Take the mass from the normal unknowns of all contact nodes, with friction from all of them.

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
    would bear it all, and frequencies fall by per cents.

    InputError is raised for lumping outside [0, 1] or above 0 with negative row sums, for bodies
    without mass, for a contact node with no material behind it, and for a mesh too coarse to hold
    the inertia.

    Attributes:
        lumping: share of the lumped mass, from 0 (consistent) to 1.
    """

    lumping: Annotated[
        float, Between(0.0, 1.0, remedy="give a share from 0 (consistent) to 1 (lumped)")
    ] = 0.4

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, *, tangential: bool
    ) -> SemiDiscreteSystem:
        """Return the system without mass at the contact unknowns.

        Args:
            system: the equations.
            surface: the contact conditions.
            tangential: whether tangential unknowns lose their mass too.

        Raises:
            InputError: what the class lists.
        """
        if surface.total == 0:
            return system
        if system.has_massless_bodies:
            raise InputError(
                "a material has rho = 0, and redistributed mass needs mass in all bodies: take "
                "ZienkiewiczWoodTaylor() or Midpoint() with mass=ConsistentMass(), or give a "
                "density above zero"
            )
        massless, contact = _mark_contact_unknowns(system, surface, tangential)
        algebra = system.algebra
        diagonal = system.M.diagonal()

        # Row sums of M, whatever the nodal frames; no translation moves rotations and the like.
        nodal = np.asarray(sum(r * (system.M @ r) for r in system.influence.T))
        still = (diagonal > 0.0) & ~system.influence.any(axis=1)
        lumping = self.lumping
        if system.space.hierarchy is not None:
            lumping = 0.0
        elif largest(algebra.comm, still.any()):
            raise InputError(
                "redistributed mass is for displacements only, and M has the inertia of rotations "
                "or of other unknowns: give the problem mass=ConsistentMass()"
            )
        negative = int(total(algebra.comm, np.sum(nodal < -LIGHT * diagonal)))
        if negative and lumping:
            raise InputError(
                f"redistributed mass cannot lump negative row sums of M and {negative} unknowns "
                "have them: give the problem mass=Redistributed(lumping=0.0) or ConsistentMass()"
            )
        nodal = diagonal if negative else np.maximum(nodal, 0.0)

        # M_l, and Pᵀ M_l P, Pᵀ C P and the load beside it, level by level: the last level is
        # applied to velocities first.
        lumped = algebra.local(*lump_masses(surface, nodal), system.rows)
        moved = algebra.combine([(1.0 - lumping, system.M), (lumping, lumped)])
        C = system.C
        load = system.load
        for P in transfer_to_neighbours(system, massless, contact, nodal):
            moved = algebra.congruence(P, moved)
            C = None if C is None else algebra.congruence(P, C)
            load = load.transform_viscous(P)

        # D of every body, on its nodes off the contact.
        inner = ~(contact | still)
        terms = [(1.0, moved)]
        for body in _find_bodies(system, inner):
            terms.append((1.0, _correct_inertia(system, moved, body & inner, body, nodal)))
        M = algebra.combine(terms)
        massless = massless if system.massless is None else massless | system.massless
        return system.changed(M=M, C=C, load=load, massless=massless)


def _find_bodies(system: SemiDiscreteSystem, inner: Mask) -> Iterator[Mask]:
    """Yield the unknowns (n,) of every body that has inner ones. Collective."""
    comm = system.algebra.comm
    numbers = np.asarray(system.space.bodies)
    last = int(largest(comm, np.max(numbers, initial=0)))
    for number in range(last + 1):
        body = numbers == number
        if largest(comm, (body & inner).any()):
            yield body


def _mark_contact_unknowns(
    system: SemiDiscreteSystem, surface: ContactSurface, tangential: bool
) -> tuple[Mask, Mask]:
    """Return which unknowns (n,) lose their mass, and which are of contact nodes. Collective.

    Args:
        system: the equations.
        surface: the contact conditions.
        tangential: whether tangential unknowns lose their mass too.
    """
    contact = np.zeros(system.rows, dtype=bool)
    if surface.traces is not None:
        # Where conditions share unknowns the nodes of all sides lose their inertia as a whole.
        contact[select_named(system, surface.traces.unknowns)] = True
        return contact.copy(), contact
    contact[surface.owned] = True
    normal = contact.copy()
    contact[surface.tangents[surface.tangents >= 0]] = True
    if surface.coupling is None:
        return (contact.copy() if tangential else normal), contact

    # Between two bodies the unknowns are relative. The nodes of both sides lose their inertia as a
    # whole, for side 2 would ring with mass.
    faced = system.algebra.entries(surface.coupling, np.flatnonzero(contact))
    contact[select_named(system, faced.indices)] = True
    return contact.copy(), contact


def _correct_inertia(
    system: SemiDiscreteSystem, moved: Matrix, inner: Mask, body: Mask, nodal: Array
) -> Matrix:
    """Return D of one body. Collective.

    D holds the smallest nodal masses m_i p(x_i) on its inner nodes, p a symmetric (d, d) matrix of
    polynomials of degree 2, such that Rᵀ(M* + D)R = RᵀMR for its rigid motions R.

    Args:
        system: the equations, with the mass M.
        moved: Pᵀ M_l P.
        inner: (n,) the inner unknowns of the body.
        body: (n,) its unknowns.
        nodal: (n,) the nodal masses m.
    """
    comm = system.algebra.comm
    d = system.influence.shape[1]

    # Rigid motions R about the middle of the body, in units of its size. On a line the uniform
    # stretch counts too; a body with tied sides cannot turn.
    points = system.space.coordinates
    high = comm.max(np.max(points[body], axis=0, initial=-np.inf))
    low = -comm.max(np.max(-points[body], axis=0, initial=-np.inf))
    x = (points - 0.5 * (low + high)) / max(float(np.max(high - low)), NO_LENGTH)
    R = rigid_motions(system.influence, x)
    if d == 1:
        R = np.column_stack([R, system.influence[:, 0] * x[:, 0]])
    R = R * body[:, None]
    if system.tied is not None and largest(comm, (body & system.tied).any()):
        R = R[:, :d]
    upper = np.triu_indices(R.shape[1])
    missing = R.T @ np.column_stack([system.M @ mode - moved @ mode for mode in R.T])

    # Polynomials p for every pair of components. An off-diagonal mass stands in two places: with
    # the factor sqrt(2) "smallest" does not depend on the axes.
    squares = [x[:, i] * x[:, j] for i in range(d) for j in range(i, d)]
    powers = np.column_stack([np.ones(len(x)), *x.T, *squares])
    pairs = list(_pair_components(system, inner))
    shapes = []
    for i, j in pairs:
        shape = powers[i] @ _orthonormalise(comm, powers[i], nodal[i])
        shapes.append(shape * (1.0 if i is j else np.sqrt(2.0)))

    # The smallest coefficients whose effect on the inertia RᵀMR is what is missing.
    effects = []
    for (i, j), shape in zip(pairs, shapes, strict=True):
        for p in shape.T:
            block = R[i].T @ ((nodal[i] * p)[:, None] * R[j])
            effects.append((0.5 * (block + block.T))[upper])
    packed = comm.sum(np.column_stack([missing[upper], *effects]))
    coefficients = np.linalg.lstsq(packed[:, 1:], packed[:, 0], rcond=DEPENDENT)[0]

    # Masses of the pairs, relative to the nodal ones.
    ends = np.cumsum([shape.shape[1] for shape in shapes])[:-1]
    parts = np.split(coefficients, ends)
    shares = [shape @ part for shape, part in zip(shapes, parts, strict=True)]
    entries = [
        share if i is j else 0.5 * share for share, (i, j) in zip(shares, pairs, strict=True)
    ]
    change = largest(comm, max_abs(np.concatenate(entries)))
    if change > LARGEST_CORRECTION:
        raise InputError(
            "the mesh is too coarse for redistributed mass, which would change nodal "
            f"masses by {100 * change:.0f} %: refine it, or give the problem "
            "mass=ConsistentMass()"
        )
    i = np.concatenate([pair[0] for pair in pairs])
    j = np.concatenate([pair[1] for pair in pairs])
    value = 0.5 * np.concatenate(shares) * nodal[i]
    rows = np.concatenate([i, j])
    columns = np.concatenate([j, i])
    return system.algebra.local(rows, columns, np.tile(value, 2), system.rows)


def _orthonormalise(comm: Comm, powers: Array, nodal: Array) -> Array:
    """Return columns c such that the polynomials powers @ c are orthonormal. Collective.

    With these columns the smallest coefficients are the smallest changes of nodal masses. Dependent
    polynomials are left out.

    Args:
        comm: the ranks.
        powers: (k, p) monomials at the nodes of this rank.
        nodal: (k,) their masses, the weights of the scalar product.
    """
    values, vectors = np.linalg.eigh(comm.sum(powers.T @ (nodal[:, None] * powers)))
    independent = values > DEPENDENT * values[-1]
    return np.asarray(vectors[:, independent] / np.sqrt(values[independent]))


def _pair_components(system: SemiDiscreteSystem, inner: Mask) -> Iterator[tuple[Indices, Indices]]:
    """Yield, for each c <= e, the unknowns c and the unknowns e of inner nodes that have both.

    The two are one array where c is e.
    """
    d = system.influence.shape[1]
    unknowns = np.flatnonzero(inner)
    numbers, component = np.divmod(np.asarray(system.space.ids)[unknowns], d)
    nodes, place = np.unique(numbers, return_inverse=True)
    table = np.full((len(nodes), d), -1, dtype=np.int64)
    table[place, component] = unknowns
    for c in range(d):
        for e in range(c, d):
            has_both = (table[:, c] >= 0) & (table[:, e] >= 0)
            first = table[has_both, c]
            second = first if c == e else table[has_both, e]
            yield first, second
