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
from ...core.checks import array, quote
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.system import Load
from .companion import linear_problem


@dataclass(frozen=True)
class SoilColumn:
    """Describe a column of n elements.

    Attributes:
        heights: (n+1,) of the nodes, upwards [m].
        lame: (n,) Lamé's first constant of the elements [Pa].
        shear: (n,) their shear modulus [Pa].
        rho: (n,) their density [kg/m³].
        alpha: (n,) their damping proportional to mass [1/s].
        beta: (n,) their damping proportional to stiffness [s].
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
                f"SoilColumn: heights is {quote(self.heights)}; give two or more, upwards"
            )
        for name in ("lame", "shear", "rho", "alpha", "beta"):
            array("SoilColumn", name, getattr(self, name), (n,))

    def matrices(self) -> tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]:
        """Return (M, C, K) of all nodes; unknown 2 i + c is component c of node i."""
        length = np.diff(self.heights)[:, None, None]
        rho = self.rho[:, None, None]
        alpha = self.alpha[:, None, None]
        beta = self.beta[:, None, None]

        # Element matrices (n, 4, 4): the modulus of x is G, that of y lambda + 2 G.
        moduli_of_node = np.column_stack([self.shear, self.lame + 2.0 * self.shear])
        moduli = np.tile(moduli_of_node, 2)[:, None, :]
        m = rho * length / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(2))
        k = np.kron([[1.0, -1.0], [-1.0, 1.0]], np.eye(2)) * moduli / length
        return self._assemble(m), self._assemble(alpha * m + beta * k), self._assemble(k)

    def _assemble(self, blocks: Array) -> sp.csr_matrix:
        """Add up element matrices (n, 4, 4) in their places."""
        places = 2 * np.arange(len(blocks))[:, None] + np.arange(4)
        rows = np.repeat(places, 4, axis=1).ravel()
        columns = np.tile(places, (1, 4)).ravel()
        size = 2 * len(self.heights)
        return sp.csr_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))

    def on_rigid_base(
        self,
        acceleration: Callable[[float], Array],
        velocity: Callable[[float], Array] | None = None,
    ) -> ContactProblem:
        """Return the system of nodes 1 to n in the frame of its base, node 0 held.

        Args:
            acceleration: of the base, (2,) at time t [m/s²].
            velocity: of the base, (2,) at time t [m/s], where mass damping acts on absolute
                velocities; None where it acts on relative ones.
        """
        M, C, K = self.matrices()
        rigid = np.tile(np.eye(2), (len(self.heights), 1))
        inertia = -(M @ rigid)[2:]
        drag = -(C @ rigid)[2:]

        def force(t: float) -> Array:
            """Return the inertia of the moving frame, and the drag on absolute velocities."""
            of_drag = 0.0 if velocity is None else drag @ velocity(t)
            return np.asarray(inertia @ acceleration(t) + of_drag)

        load = Load(np.zeros(len(inertia)), general=(force,))
        return linear_problem(M[2:, 2:], C[2:, 2:], K[2:, 2:], load, 2)

    def on_dashpots(
        self, shear: float, normal: float, upgoing: Callable[[float], Array]
    ) -> ContactProblem:
        """Return the system of all nodes, node 0 on dashpots.

        Args:
            shear: impedance of the horizontal dashpot [Pa s/m].
            normal: impedance of the vertical dashpot [Pa s/m].
            upgoing: velocity of the upgoing wave, (2,) at time t [m/s].
        """
        M, C, K = self.matrices()
        impedance = np.array([shear, normal])
        foot = sp.csr_matrix((impedance, ([0, 1], [0, 1])), shape=C.shape)

        def force(t: float) -> Array:
            """Return twice the upgoing wave's stress on node 0, nothing on the others."""
            values = np.zeros(C.shape[0])
            values[:2] = 2.0 * impedance * upgoing(t)
            return values

        return linear_problem(M, C + foot, K, Load(np.zeros(C.shape[0]), general=(force,)), 2)

    def stress(self, u: Array) -> Array:
        """Return (sigma_xx, sigma_xy) of every element, (n, 2) [Pa].

        ``u`` are the displacements of the nodes, (n+1, 2) [m].
        """
        strain = np.diff(u, axis=0) / np.diff(self.heights)[:, None]
        return np.column_stack([self.lame * strain[:, 1], self.shear * strain[:, 0]])
