"""Make the system of matrices that come from anywhere.

This is a user's own elements, another program, beams and frames.

    M u'' + C u' + K u = f(t),   M symmetric and positive (semi)definite

Rows that stand still are eliminated here, so that weight and ground motion count the mass that they
share with others.
"""

from collections.abc import Mapping, Sequence
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
from ...core.checks import array, integers, on_all, refuse
from ...core.errors import InputError
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

    Raises:
        InputError: matrices that are not real, finite, square and of one size, M that is not
            symmetric or has masses below zero; coordinates, unknowns or vectors that do not fit
            them.
    """
    matrices = {
        name: _serial(name, A)
        for name, A in (("M", M), ("C", C), ("K", K))
        if name != "C" or A is not None
    }
    n = matrices["K"].csr.shape[0]
    for name, one in matrices.items():
        if one.csr.shape != (n, n):
            raise InputError(
                f"{OWNER}: {name} has shape {one.csr.shape} and K has {n} rows; give square "
                "matrices of one size"
            )
    given = {
        "coordinates": coordinates,
        "unknowns": unknowns,
        "clamped": clamped,
        "load": load,
        "u0": u0,
        "v0": v0,
    }
    return own_system(OWNER, SerialAlgebra(), SerialAlgebra(symmetric=False), matrices, given)


def _serial(name: str, value: Any) -> SerialMatrix:
    """Return a copy of a matrix, of a vector as its diagonal."""
    if not sp.issparse(value):
        lumped = name == "M" and np.ndim(value) == 1
        found = array(OWNER, name, value, (None,) if lumped else (None, None))
        return SerialMatrix(sp.diags([found], [0]) if lumped else found)
    if value.dtype.kind not in "iuf":
        raise InputError(f"{OWNER}: {name} has entries of type {value.dtype}; give real numbers")
    return SerialMatrix(sp.csr_matrix(value, dtype=float, copy=True))


def own_system(
    owner: str,
    algebra: Algebra,
    unsymmetric: Algebra,
    matrices: Mapping[str, Matrix],
    given: Mapping[str, Any],
) -> SemiDiscreteSystem:
    """Return the system of matrices M, K and perhaps C of one size. Collective.

    What is given of this rank's rows and nodes is checked here.

    Args:
        owner: who asks.
        algebra: that of symmetric matrices.
        unsymmetric: that for C or K that are not symmetric.
        matrices: M, K and perhaps C, of n owned rows.
        given: the other arguments by name.
    """
    comm = algebra.comm
    n = matrices["K"].rows
    points, block, component, free = on_all(comm, owner, lambda: _meaning(owner, n, given))
    load, u0, v0 = on_all(comm, owner, lambda: _vectors(owner, n, given))
    d = points.shape[1]
    refuse(
        [
            f"{owner}: nodes of one rank have {d} coordinates, others more"
            if d < largest(comm, d)
            else ""
        ],
        comm,
    )
    numbers = algebra.first(n) + np.arange(n)
    refuse(list(find_matrix_defects(owner, comm, numbers, **matrices)), comm)
    skew = [name for name, A in matrices.items() if measure_asymmetry(A, comm, numbers) > SYMMETRIC]
    algebra = unsymmetric if skew else algebra
    every = matrices["M"]
    influence = (component[:, None] == np.arange(d)).astype(float)
    if largest(comm, not free.all()):
        matrices = {name: algebra.block(A, free) for name, A in matrices.items()}
        load = load.in_basis(SerialMatrix(sp.identity(n, format="csc")[:, free]))
    M = matrices["M"]
    K = matrices["K"]
    # of rows that stand still, when all move
    momenta = [(every @ r)[free] - M @ r[free] for r in influence.T]
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


def _meaning(owner: str, n: int, given: Mapping[str, Any]) -> tuple[Array, Indices, Indices, Mask]:
    """Return (points, node of each row, component of each row, rows that are free).

    Args:
        owner: who asks.
        n: how many rows this rank owns.
        given: arguments by name.
    """
    points = array(owner, "coordinates", given["coordinates"], (None, None), unit="metres")
    k, d = points.shape
    if d not in (1, 2, 3):
        raise InputError(
            f"{owner}: coordinates has shape {points.shape}; give 1, 2 or 3 coordinates of every "
            "node"
        )
    if given["unknowns"] is None and n != k * d:
        raise InputError(
            f"{owner}: K has {n} rows, and {k} nodes have {k * d} components; give unknowns=, the "
            "node and the component of every row"
        )
    table = np.column_stack(np.divmod(np.arange(n), d))
    if given["unknowns"] is not None:
        table = integers(owner, "unknowns", given["unknowns"], (n, 2))
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
    rows = integers(owner, "clamped", given["clamped"], (None,))
    free = np.ones(n, dtype=bool)
    if len(rows) and not 0 <= rows.min() <= rows.max() < n:
        raise InputError(
            f"{owner}: clamped goes from {rows.min()} to {rows.max()}; give numbers of rows below "
            f"{n}"
        )
    free[rows] = False
    return points, block, component, free


def _vectors(owner: str, n: int, given: Mapping[str, Any]) -> tuple[Load, Array, Array]:
    """Return the load and initial values of all rows, zero where there are none.

    Args:
        owner: who asks.
        n: how many rows this rank owns.
        given: arguments by name.
    """

    def vector(name: str, value: Any, unit: str) -> Array:
        return np.zeros(n) if value is None else array(owner, name, value, (n,), unit=unit)

    load = (
        given["load"]
        if isinstance(given["load"], Load)
        else Load(vector("load", given["load"], "N"))
    )
    for one in (load.constant, *(part for part, _ in load.separable)):
        vector("a vector of load", one, "N")
    return load, vector("u0", given["u0"], "m"), vector("v0", given["v0"], "m/s")


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
        first = algebra.first(len(block))
        self.dimension = d
        self.unknowns = round(total(self.comm, n))
        self.nodes = algebra.first(k) + np.arange(k)
        self.size = bounding_box(self.comm, points)
        self.component = component
        moves = component >= 0
        every = np.arange(n)
        self.free_index = np.full(k * d, -1)
        self.free_index[(block * d + component)[moves]] = every[moves]
        self.numbers = np.where(self.free_index >= 0, first + self.free_index, -1).reshape(k, d)
        self.held = self.numbers < 0
        others = d * (round(total(self.comm, k)) + first + every)  # each is a node by itself
        self.ids = np.where(moves, self.nodes[block] * d + component, others)
        self.coordinates = points[block]
        self.bodies = bodies_of(algebra, K, block)


def bodies_of(algebra: Algebra, K: Matrix, block: Indices) -> Indices:
    """Return the body (0, 1, ..., by least numbers) of each owned unknown. Collective.

    Bodies are in the order of least numbers; K or a node joins those of one body.

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
    _, leader, node = np.unique(block, return_index=True, return_inverse=True)
    row = np.concatenate([own, np.repeat(own, np.diff(entries.indptr))])
    column = np.concatenate([first + leader[node.ravel()], entries.indices])
    numbers = np.union1d(own, column)  # those of other ranks too
    away = (column < first) | (column >= first + n)
    one = np.searchsorted(numbers, row)
    two = np.searchsorted(numbers, column)
    shared = np.union1d(one[away], two[away])
    return parts_of(algebra.comm, one, two, numbers, shared)[np.searchsorted(numbers, own)]
