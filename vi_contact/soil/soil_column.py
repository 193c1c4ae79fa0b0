"""Model a column of soil layers: the motion of level ground under vertical waves, per metre width.

Linear elements between given heights, two displacement components at every node: shear waves move x, pressure waves y,

    rho u_x'' = (G u_x,y),y    rho u_y'' = ((lambda + 2 G) u_y,y),y    sigma_xy = G u_x,y    sigma_xx = lambda u_y,y

and with damping C = alpha M + beta K the stresses get beta times those of the velocity. It is what a strip of finite
elements does whose sides move together, to the last digit: linear elements of such a strip have no other motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, SerialAlgebra, SerialComm, SerialMatrix
from ..core.checks import array, shown
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.surfaces import empty_surface
from ..core.system import Load, SemiDiscreteSystem
from .moving_base import PointSpace


@dataclass(frozen=True)
class SoilColumn:
    """Describe elements between ``heights`` (n+1,) [m]; lame, shear [Pa], rho [kg/m³], alpha [1/s], beta [s]: (n,)."""

    heights: Array
    lame: Array
    shear: Array
    rho: Array
    alpha: Array
    beta: Array

    def __post_init__(self) -> None:
        n = len(array("SoilColumn", "heights", self.heights, (None,), unit="m")) - 1
        if n < 1 or np.any(np.diff(self.heights) <= 0.0):
            raise InputError(f"SoilColumn: heights is {shown(self.heights)}; give two or more, upwards")
        for name in ("lame", "shear", "rho", "alpha", "beta"):
            array("SoilColumn", name, getattr(self, name), (n,))

    def matrices(self) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        """Return (M, C, K) of all nodes; unknown 2 i + c is component c of node i."""
        mass, damping, stiffness = [], [], []
        for e, length in enumerate(np.diff(self.heights)):
            m = self.rho[e] * length / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(2))
            moduli = np.diag([self.shear[e], self.lame[e] + 2.0 * self.shear[e]])
            k = np.kron([[1.0, -1.0], [-1.0, 1.0]], moduli) / length
            mass.append(m)
            stiffness.append(k)
            damping.append(self.alpha[e] * m + self.beta[e] * k)
        return self._sum(mass), self._sum(damping), self._sum(stiffness)

    def _sum(self, blocks: list[Array]) -> sp.csr_matrix:
        """Element matrices (4, 4) in their places."""
        places = 2 * np.arange(len(blocks))[:, None] + np.arange(4)
        rows, columns = np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel()
        size = 2 * len(self.heights)
        return sp.csr_matrix((np.array(blocks).ravel(), (rows, columns)), shape=(size, size))

    def on_rigid_base(
        self, acceleration: Callable[[float], Array], velocity: Callable[[float], Array] | None = None
    ) -> ContactProblem:
        """Return the system of nodes 1 to n, node 0 held, in the frame of a base with this acceleration (2,).

        velocity: of the base, where mass damping acts on absolute velocities; None where it acts on relative ones.
        """
        M, C, K = self.matrices()
        rigid = np.tile(np.eye(2), (len(self.heights), 1))
        inertia, drag = -(M @ rigid)[2:], -(C @ rigid)[2:]

        def load(t: float) -> Array:
            return np.asarray(inertia @ acceleration(t) + (0.0 if velocity is None else drag @ velocity(t)))

        return _linear(M[2:, 2:], C[2:, 2:], K[2:, 2:], load)

    def on_dashpots(self, shear: float, normal: float, upgoing: Callable[[float], Array]) -> ContactProblem:
        """Return the system of all nodes, node 0 on dashpots of these impedances [Pa s/m], with the upgoing wave (2,)
        [m/s]."""
        M, C, K = self.matrices()
        impedance = np.array([shear, normal])
        foot = sp.csr_matrix((impedance, ([0, 1], [0, 1])), shape=C.shape)

        def load(t: float) -> Array:
            force = np.zeros(C.shape[0])
            force[:2] = 2.0 * impedance * upgoing(t)
            return force

        return _linear(M, C + foot, K, load)

    def stress(self, u: Array) -> Array:
        """Return (sigma_xx, sigma_xy) [Pa] of every element, (n, 2), of nodal displacements (n+1, 2)."""
        strain = np.diff(u, axis=0) / np.diff(self.heights)[:, None]
        return np.column_stack([self.lame * strain[:, 1], self.shear * strain[:, 0]])


class ColumnSpace(PointSpace):
    """Give the column two unknowns per node; there are no contact points to ask for."""

    def __init__(self, unknowns: int) -> None:
        super().__init__(2)
        self.unknowns = unknowns


def _linear(M: sp.csr_matrix, C: sp.csr_matrix, K: sp.csr_matrix, load: Callable[[float], Array]) -> ContactProblem:
    """The system at rest, without contact."""
    n = M.shape[0]
    system = SemiDiscreteSystem(
        algebra=SerialAlgebra(), M=SerialMatrix(M), C=SerialMatrix(C), K=SerialMatrix(K),
        load=Load(np.zeros(n), general=(load,)), influence=np.tile(np.eye(2), (n // 2, 1)),
        u0=np.zeros(n), v0=np.zeros(n), space=ColumnSpace(n), floating=True,
    )
    return ContactProblem(system, empty_surface(SerialComm(), 2))
