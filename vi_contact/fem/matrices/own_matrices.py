"""Make a system of matrices from elsewhere: own elements, another program, beams and frames.

    M u'' + C u' + K u = f(t),   M symmetric and positive (semi)definite

Rows that stand still are eliminated here, and not by the user, so that weight and ground motion
count the mass that they share with others. ``petsc_system`` takes matrices of several ranks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import (
    Algebra,
    Array,
    Indices,
    Mask,
    Matrix,
    SerialAlgebra,
    SerialMatrix,
    largest,
    total,
)
from ...core.checks import array, integers, on_all, provides, quote, refuse
from ...core.errors import InputError
from ...core.internal import InternalForce
from ...core.matrix_checks import SYMMETRIC, find_matrix_defects, measure_asymmetry
from ...core.system import Load, SemiDiscreteSystem
from ...laws.free_motions import Unheld, floats
from ..mesh.nodal_space import NodalSpace, bounding_box, parts_of

OWNER = "system_from_arrays"


def system_from_arrays(
    M: Any,
    C: Any,
    K: Any,
    *,
    coordinates: Any,
    unknowns: Any = None,
    clamped: Any = (),
    load: Load | Sequence[float] | Array | None = None,
    u0: Any = None,
    v0: Any = None,
    internal: InternalForce | None = None,
) -> SemiDiscreteSystem:
    """Make the system M u'' + C u' + K u = f of scipy or dense matrices.

    It is made on one process, by numpy and scipy alone.

    ``contact_points`` makes contact for it. All that asks for no material works: every scheme and
    impact law, friction, solvers, static stages, ``Energy``, ``Contact``, ``Probe``, checkpoints,
    ``fem.XDMF``. Bodies are what K joins.

    Args:
        M: (n, n), symmetric: mass [kg], also (n,) where lumped.
        C: (n, n), symmetric: damping [N s/m] or None. C and K that are not symmetric are for
            Volume() and Condensed(Lemke()).
        K: (n, n), symmetric: stiffness [N/m].
        coordinates: (nodes, d) [m], d = 1, 2 or 3.
        unknowns: (n, 2) node and component 0, …, d - 1 of each row, component -1 for what is no
            displacement of a point (a rotation); None: row node * d + c is component c of the node.
            Components without a row stand still.
        clamped: numbers of rows that stand still. They are left out: later vectors have
            ``system.rows`` entries.
        load: f, a Load or (n,) constant forces [N]; histories also by ``system.with_load``. Ground
            motion acts on the unit translation of all displacements.
        u0: (n,) initial displacement [m], zero when None.
        v0: (n,) initial velocity [m/s], zero when None.
        internal: in the place of K u an internal force that is not linear: an object with
            ``force(u)`` (n,) [N], ``energy(u)`` [J] and ``tangent(u)``, a matrix (n, n) [N/m], for
            all n unknowns. K is then the reference stiffness: steps are solved with its factor
            between tangents, and C is not changed. For march, simulate, Stepper and static stages.

    Raises:
        InputError: matrices that are not real, finite, square and of one size, M that is not
            symmetric or has masses below zero; coordinates, unknowns or vectors that do not fit
            them.
    """
    named = {"M": M, "C": C, "K": K}
    if C is None:
        del named["C"]
    matrices = {name: _copy_matrix(name, A) for name, A in named.items()}
    n = matrices["K"].csr.shape[0]
    for name, matrix in matrices.items():
        if matrix.csr.shape != (n, n):
            raise InputError(
                f"{OWNER}: {name} has shape {matrix.csr.shape} and K has {n} rows; give square "
                "matrices of one size"
            )
    arguments = {
        "coordinates": coordinates,
        "unknowns": unknowns,
        "clamped": clamped,
        "load": load,
        "u0": u0,
        "v0": v0,
    }
    algebra = SerialAlgebra()
    system = own_system(OWNER, algebra, SerialAlgebra(symmetric=False), matrices, arguments)
    if internal is None:
        return system
    remedy = "give an object with force(u), energy(u) and tangent(u)"
    provides(OWNER, "internal", internal, ("force", "energy", "tangent"), remedy)
    rows = np.setdiff1d(np.arange(n), np.asarray(clamped, dtype=np.int64))
    return system.changed(internal=FreeRows(internal, rows, n))


@dataclass(frozen=True)
class FreeRows:
    """Hold an internal force of the user's on the rows that do not stand still.

    Attributes:
        internal: of all n unknowns.
        rows: those that are free.
        size: n.
    """

    internal: InternalForce
    rows: Indices
    size: int

    def _fill(self, u: Array) -> Array:
        """Return all unknowns (n,), zero where they stand still."""
        whole = np.zeros(self.size)
        whole[self.rows] = u
        return whole

    def force(self, u: Array) -> Array:
        """Return p(u) [N] of the free rows; it need not be finite where a body is inside out."""
        p = np.asarray(self.internal.force(self._fill(u)))
        if p.shape != (self.size,) or p.dtype.kind not in "iuf":
            raise InputError(
                f"{OWNER}: internal.force(u) returned {quote(p)}; return {self.size} real numbers"
            )
        return np.asarray(p[self.rows], dtype=float)

    def energy(self, u: Array) -> float:
        """Return W(u) [J]."""
        return float(self.internal.energy(self._fill(u)))

    def tangent(self, u: Array) -> Matrix:
        """Return p'(u) [N/m] of the free rows."""
        tangent: Any = self.internal.tangent(self._fill(u))
        csr = tangent.csr if isinstance(tangent, SerialMatrix) else sp.csr_matrix(tangent)
        if csr.shape != (self.size, self.size):
            raise InputError(
                f"{OWNER}: internal.tangent(u) has shape {csr.shape}; return the derivative of "
                f"internal.force, of shape {(self.size, self.size)}"
            )
        return SerialMatrix(csr[self.rows][:, self.rows].tocsr())


def _copy_matrix(name: str, value: Any) -> SerialMatrix:
    """Return a copy of a sparse or dense matrix, or for M of a vector that is its diagonal."""
    if not sp.issparse(value):
        if name == "M" and np.ndim(value) == 1:
            return SerialMatrix(sp.diags([array(OWNER, name, value, (None,))], [0]))
        return SerialMatrix(array(OWNER, name, value, (None, None)))
    if value.dtype.kind not in "iuf":
        raise InputError(f"{OWNER}: {name} has entries of type {value.dtype}; give real numbers")
    return SerialMatrix(sp.csr_matrix(value, dtype=float, copy=True))


def own_system(
    owner: str,
    algebra: Algebra,
    unsymmetric: Algebra,
    matrices: Mapping[str, Matrix],
    arguments: Mapping[str, Any],
) -> SemiDiscreteSystem:
    """Return the system of matrices M, K and perhaps C of one size. Collective.

    With the free rows F of the matrices the system is M_FF u'' + C_FF u' + K_FF u = f_F.

    Args:
        owner: who asks.
        algebra: that of symmetric matrices.
        unsymmetric: that for C or K that are not symmetric.
        matrices: M, K and perhaps C, of n owned rows.
        arguments: the other arguments of ``system_from_arrays`` by name, for the rows and nodes of
            this rank; they are checked here.

    Raises:
        InputError: on all ranks, what ``system_from_arrays`` refuses.
    """
    comm = algebra.comm
    n = matrices["K"].rows

    # what the rows mean, and what acts on them
    points, block, component, free = on_all(comm, owner, lambda: _read_rows(owner, n, arguments))
    load, u0, v0 = on_all(comm, owner, lambda: _read_vectors(owner, n, arguments))
    d = points.shape[1]
    refuse(
        [
            f"{owner}: nodes of one rank have {d} coordinates, others more"
            if d < largest(comm, d)
            else ""
        ],
        comm,
    )

    # matrices that no system may have are refused; those that are not symmetric need an algebra
    # of their own
    numbers = algebra.first(n) + np.arange(n)
    refuse(list(find_matrix_defects(owner, comm, numbers, **matrices)), comm)
    skew = [name for name, A in matrices.items() if measure_asymmetry(A, comm, numbers) > SYMMETRIC]
    if skew:
        algebra = unsymmetric

    # eliminate the rows that stand still
    whole_mass = matrices["M"]
    influence = (component[:, None] == np.arange(d)).astype(float)
    if largest(comm, not free.all()):
        matrices = {name: algebra.block(A, free) for name, A in matrices.items()}
        load = load.in_basis(SerialMatrix(sp.identity(n, format="csc")[:, free]))
    M = matrices["M"]
    K = matrices["K"]

    # M_FH r_H: what the mass that free rows F share with held ones H adds to the momenta of F when
    # everything moves by the unit translation r
    momenta = [(whole_mass @ r)[free] - M @ r[free] for r in influence.T]
    massless = M.diagonal() == 0.0
    space = MatrixSpace(algebra, points, block[free], component[free], K)
    rigid = influence[free]
    return SemiDiscreteSystem(
        algebra=algebra,
        M=M,
        C=matrices.get("C"),
        K=K,
        load=load,
        influence=rigid,
        u0=u0[free],
        v0=v0[free],
        space=space,
        floating=floats(Unheld(algebra, M, K, rigid, space.bodies, space.coordinates)),
        base_mass=np.column_stack(momenta),
        massless=massless if largest(comm, massless.any()) else None,
        notes=tuple(
            f"{name} not symmetric: for Volume() and Condensed(Lemke()); no energy ½ uᵀKu"
            for name in skew
        ),
    )


def _read_rows(
    owner: str, n: int, arguments: Mapping[str, Any]
) -> tuple[Array, Indices, Indices, Mask]:
    """Return what the rows mean: points (k, d), node (n,), component (n,), free (n,).

    Args:
        owner: who asks.
        n: how many rows this rank owns.
        arguments: by name, ``coordinates``, ``unknowns`` and ``clamped``.

    Raises:
        InputError: they do not fit the rows.
    """
    points = array(owner, "coordinates", arguments["coordinates"], (None, None), unit="metres")
    k, d = points.shape
    if d not in (1, 2, 3):
        raise InputError(
            f"{owner}: coordinates has shape {points.shape}; give 1, 2 or 3 coordinates of every "
            "node"
        )
    # each row is a component of a node, by default all components node by node; no two rows are
    # the same one
    if arguments["unknowns"] is None and n != k * d:
        raise InputError(
            f"{owner}: K has {n} rows, and {k} nodes have {k * d} components; give unknowns=, the "
            "node and the component of every row"
        )
    table = np.column_stack(np.divmod(np.arange(n), d))
    if arguments["unknowns"] is not None:
        table = integers(owner, "unknowns", arguments["unknowns"], (n, 2))
    block, component = table.T
    wrong = (block < 0) | (block >= k) | (component < -1) | (component >= d)
    if wrong.any():
        raise InputError(
            f"{owner}: row {np.argmax(wrong)} of unknowns is {table[wrong][0].tolist()}; give a "
            f"node from 0 to {k - 1} and a component from -1 to {d - 1}"
        )
    places, counts = np.unique((block * d + component)[component >= 0], return_counts=True)
    if (counts > 1).any():
        node, c = divmod(int(places[counts > 1][0]), d)
        raise InputError(
            f"{owner}: component {c} of node {node} has several rows in unknowns; give it one"
        )

    # rows that are not clamped are free
    rows = integers(owner, "clamped", arguments["clamped"], (None,))
    free = np.ones(n, dtype=bool)
    if len(rows) and not 0 <= rows.min() <= rows.max() < n:
        raise InputError(
            f"{owner}: clamped goes from {rows.min()} to {rows.max()}; give numbers of rows below "
            f"{n}"
        )
    free[rows] = False
    return points, block, component, free


def _read_vectors(owner: str, n: int, arguments: Mapping[str, Any]) -> tuple[Load, Array, Array]:
    """Return the load and initial values of all rows, zero where there are none.

    Args:
        owner: who asks.
        n: how many rows this rank owns.
        arguments: by name, ``load``, ``u0`` and ``v0``.

    Raises:
        InputError: vectors that do not fit the rows.
    """
    load = arguments["load"]
    if not isinstance(load, Load):
        load = Load(_read_vector(owner, "load", load, n, "N"))
    for vector in (load.constant, *(part for part, _ in load.separable)):
        _read_vector(owner, "a vector of load", vector, n, "N")
    u0 = _read_vector(owner, "u0", arguments["u0"], n, "m")
    return load, u0, _read_vector(owner, "v0", arguments["v0"], n, "m/s")


def _read_vector(owner: str, name: str, value: Any, n: int, unit: str) -> Array:
    """Return n numbers, zeros for None; ``owner``, ``name`` and ``unit`` are for messages."""
    return np.zeros(n) if value is None else array(owner, name, value, (n,), unit=unit)


class MatrixSpace(NodalSpace):
    """Say what the unknowns of a user's matrices mean.

    Each is a component of a node, or no displacement of a point.

    Attributes:
        coordinates: (n, d) position of the node of each unknown [m].
        component: (n,), -1 for what is no displacement.
        bodies: (n,) body of each.
    """

    def __init__(
        self, algebra: Algebra, points: Array, block: Indices, component: Indices, K: Matrix
    ) -> None:
        """Give numbers to the nodes, over the ranks, and find bodies. Collective.

        Args:
            algebra: that of K.
            points: (k, d) owned nodes [m].
            block: (n,) the owned node of each unknown.
            component: (n,) its component, -1 for what is no displacement.
            K: stiffness.
        """
        self.algebra = algebra
        self.comm = algebra.comm
        self.points = points
        k, d = points.shape
        n = len(block)

        # nodes and unknowns have numbers over the ranks, those of a rank in a row
        first = algebra.first(len(block))
        self.dimension = d
        self.unknowns = round(total(self.comm, n))
        self.nodes = algebra.first(k) + np.arange(k)
        self.size = bounding_box(self.comm, points)
        self.component = component

        # tables from the component of a node to its unknown, -1 where there is none
        moves = component >= 0
        every = np.arange(n)
        self.free_index = np.full(k * d, -1)
        self.free_index[(block * d + component)[moves]] = every[moves]
        self.numbers = np.where(self.free_index >= 0, first + self.free_index, -1).reshape(k, d)
        self.held = self.numbers < 0

        # numbers on any ranks: what is no displacement counts as a node by itself, after the nodes
        others = d * (round(total(self.comm, k)) + first + every)
        self.ids = np.where(moves, self.nodes[block] * d + component, others)
        self.coordinates = points[block]
        self.bodies = bodies_of(algebra, K, block)


def bodies_of(algebra: Algebra, K: Matrix, block: Indices) -> Indices:
    """Return the body (0, 1, ..., by least numbers) of each owned unknown. Collective.

    Unknowns are of one body where an entry of K or a node joins them. Bodies are in the order of
    their least unknowns.

    Args:
        algebra: that of K.
        K: stiffness, of n owned rows.
        block: (n,) the node of each row, all rows of a node on one rank.
    """
    n = K.rows
    first = algebra.first(K.rows)
    entries = algebra.entries(K, np.arange(n))
    own = first + np.arange(n)
    entries.eliminate_zeros()
    # links: each row to the first row of its node, and to the columns of its entries
    _, leader, node = np.unique(block, return_index=True, return_inverse=True)
    row = np.concatenate([own, np.repeat(own, np.diff(entries.indptr))])
    column = np.concatenate([first + leader[node.ravel()], entries.indices])
    # the same by places among all unknowns that this rank knows, some of which others own; what
    # an entry between two ranks joins, both ranks share
    numbers = np.union1d(own, column)
    away = (column < first) | (column >= first + n)
    start = np.searchsorted(numbers, row)
    end = np.searchsorted(numbers, column)
    shared = np.union1d(start[away], end[away])
    return parts_of(algebra.comm, start, end, numbers, shared)[np.searchsorted(numbers, own)]
