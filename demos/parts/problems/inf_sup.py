"""Measure inf-sup constants of the multiplier's own mesh.

They tell how well displacements see it, in space and in time.

    beta = min over lambda of  max over v of  <lambda, v> / (|lambda| |v|)

lambda on (H, DT), v on (h, dt). Norms in space are those of H^(-1/2) and H^(1/2) of the boundary:
|v|² = v.(M^½ (1 + M^-½ K M^-½)^½ M^½) v with the mass M and the stiffness K of the tangential
derivative, and |lambda| as the maximum over a much finer mesh. In time they are those of L2. The
spaces are products, and so is the constant.
"""

import numpy as np
from scipy.linalg import eigh

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.multiplier_mesh import MultiplierMesh
from vi_contact.bem.poincare_steklov import CondensedCompliance
from vi_contact.core.algebra import Array, Mask

FINER = 8  # elements of the finer mesh in one


def space_constant(mesh: BoundaryMesh, elements: Mask, patch: int, degree: int = 0) -> float:
    """Return beta in space for patches of so many contact elements (n,).

    The multiplier has degree 0 or 1.
    """
    fine = refined(mesh)
    coarse = _loads(mesh, elements, patch, degree)
    much = _loads(fine, np.repeat(elements, FINER), FINER * patch, degree)
    seen, there = (
        load.T @ np.linalg.solve(half_norm(on), load) for load, on in ((coarse, mesh), (much, fine))
    )
    return float(np.sqrt(max(eigh(seen, there, eigvals_only=True)[0], 0.0)))


def time_constant(steps: int, interval: int, testing: str) -> float:
    """Return beta in time of constants in intervals of so many steps.

    It is that with continuous displacements, zero at first, linear in each step, when their means
    are tested, with their rates, constant in each step, when ends are.
    """
    if testing == "end":
        return 1.0  # the rates have all constants of intervals among them
    hats = (2.0 * np.eye(steps) + 0.5 * (np.eye(steps, k=1) + np.eye(steps, k=-1))) / 3.0
    hats[-1, -1] = 1.0 / 3.0
    both = 0.5 * (np.eye(steps) + np.eye(steps, k=-1))  # of the step and its hats at end and start
    pairing = np.add.reduceat(both, np.arange(0, steps, interval), axis=0)
    return float(
        np.sqrt(np.linalg.eigvalsh(pairing @ np.linalg.solve(hats, pairing.T) / interval)[0])
    )


def refined(mesh: BoundaryMesh) -> BoundaryMesh:
    """Return the mesh of one loop with each element cut into FINER equal ones."""
    s = np.arange(FINER)[:, None] / FINER
    points = mesh.points[:, None] + s * (mesh.points[mesh.after] - mesh.points)[:, None]
    return BoundaryMesh(np.asarray(points).reshape(-1, 2), labels=np.repeat(mesh.labels, FINER))


def half_norm(mesh: BoundaryMesh) -> Array:
    """Return the matrix (n, n) of the norm of H^(1/2) by interpolation, for one component."""
    n = len(mesh)
    h = mesh.lengths
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for a in range(2):
        for b in range(2):
            np.add.at(
                M, (mesh.elements[:, a], mesh.elements[:, b]), h * (2.0 if a == b else 1.0) / 6.0
            )
            np.add.at(K, (mesh.elements[:, a], mesh.elements[:, b]), (1.0 if a == b else -1.0) / h)
    values, vectors = eigh(M + K, M)  # vectors.T M vectors = 1
    return np.asarray((M @ vectors) * np.sqrt(np.maximum(values, 1.0)) @ (M @ vectors).T)


def _loads(mesh: BoundaryMesh, elements: Mask, patch: int, degree: int) -> Array:
    """Return <phi_i, psi_p> of all nodes (n, p) for functions psi_p with the mean 1."""
    nodes = np.flatnonzero(mesh.nodes_of(elements))
    nothing = CondensedCompliance(
        np.zeros((1, 2 * len(nodes), 2 * len(nodes))),
        np.zeros((1, 2 * len(nodes))),
        nodes,
        mesh.points[nodes],
        mesh.normals[nodes],
        mesh.node_lengths(elements)[nodes],
        1.0,
    )
    patches = MultiplierMesh(mesh, elements, nothing, patch=patch, interval=1, degree=degree)
    loads = np.zeros((len(mesh), patches.pairing.shape[1]))
    loads[nodes] = patches.pairing
    return loads
