"""Model a column of soil layers: the motion of level ground under vertical waves, per metre width.

Linear elements between given heights, two displacement components at every node: shear waves move
x, pressure waves y,

    rho u_x'' = (G u_x,y),y    rho u_y'' = ((lambda + 2 G) u_y,y),y
    sigma_xy = G u_x,y    sigma_xx = lambda u_y,y

and with damping C = alpha M + beta K the stresses get beta times those of the velocity. It is what
a strip of finite elements does whose sides move together, to the last digit: linear elements of
such a strip have no other motion.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array
from ...core.checks import array, shown
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.system import Load
from .companion import linear_problem


@dataclass(frozen=True)
class SoilColumn:
    """Describe elements between ``heights`` (n+1,) [m].

    Of each element there are lame, shear [Pa], rho [kg/m³], alpha [1/s] and beta [s], (n,).
    """

    heights: Array
    lame: Array
    shear: Array
    rho: Array
    alpha: Array
    beta: Array

    def __post_init__(self) -> None:
        n = len(array("SoilColumn", "heights", self.heights, (None,), unit="m")) - 1
        if n < 1 or np.any(np.diff(self.heights) <= 0.0):
            raise InputError(
                f"SoilColumn: heights is {shown(self.heights)}; give two or more, upwards"
            )
        for name in ("lame", "shear", "rho", "alpha", "beta"):
            array("SoilColumn", name, getattr(self, name), (n,))

    def matrices(self) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        """Return (M, C, K) of all nodes; unknown 2 i + c is component c of node i."""
        rho, length, alpha, beta = (
            x[:, None, None] for x in (self.rho, np.diff(self.heights), self.alpha, self.beta)
        )
        moduli = np.tile(np.column_stack([self.shear, self.lame + 2.0 * self.shear]), 2)[:, None, :]
        m = rho * length / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(2))
        k = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(2)) * moduli / length
        return self._sum(m), self._sum(alpha * m + beta * k), self._sum(k)

    def _sum(self, blocks: Array) -> sp.csr_matrix:
        """Element matrices (n, 4, 4) in their places."""
        places = 2 * np.arange(len(blocks))[:, None] + np.arange(4)
        rows, columns = np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel()
        size = 2 * len(self.heights)
        return sp.csr_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))

    def on_rigid_base(
        self,
        acceleration: Callable[[float], Array],
        velocity: Callable[[float], Array] | None = None,
    ) -> ContactProblem:
        """Return the system of nodes 1 to n, node 0 held.

        It is in the frame of a base with this acceleration (2,).

        velocity: of the base, where mass damping acts on absolute velocities; None where it acts on
        relative ones.
        """
        M, C, K = self.matrices()
        rigid = np.tile(np.eye(2), (len(self.heights), 1))
        inertia, drag = -(M @ rigid)[2:], -(C @ rigid)[2:]

        def load(t: float) -> Array:
            return np.asarray(
                inertia @ acceleration(t) + (0.0 if velocity is None else drag @ velocity(t))
            )

        return linear_problem(
            M[2:, 2:], C[2:, 2:], K[2:, 2:], Load(np.zeros(len(inertia)), general=(load,)), 2
        )

    def on_dashpots(
        self, shear: float, normal: float, upgoing: Callable[[float], Array]
    ) -> ContactProblem:
        """Return the system of all nodes, node 0 on dashpots of these impedances [Pa s/m].

        ``upgoing`` is (2,) [m/s].
        """
        M, C, K = self.matrices()
        impedance = np.array([shear, normal])
        foot = sp.csr_matrix((impedance, ([0, 1], [0, 1])), shape=C.shape)

        def load(t: float) -> Array:
            force = np.zeros(C.shape[0])
            force[:2] = 2.0 * impedance * upgoing(t)
            return force

        return linear_problem(M, C + foot, K, Load(np.zeros(C.shape[0]), general=(load,)), 2)

    def stress(self, u: Array) -> Array:
        """Return (sigma_xx, sigma_xy) [Pa] of every element.

        It is (n, 2), of nodal displacements (n+1, 2).
        """
        strain = np.diff(u, axis=0) / np.diff(self.heights)[:, None]
        return np.column_stack([self.lame * strain[:, 1], self.shear * strain[:, 0]])
