"""Describe orthotropic elasticity along three material axes by nine engineering constants."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import array, number
from ..core.errors import InputError
from ..core.quantities import RATIO, Finite, Positive, Unit
from .materials import DampedBy, PlaneStress, Section

DEFINITE = 1e-12  # the least eigenvalue of the scaled compliance, whose diagonal is one
ORTHOGONAL = 1e-9  # entries of QᵀQ - 1 of a rotation Q
OUT_OF_PLANE = 1e-12  # of the largest stiffness: shear across the plane that is round-off
VOIGT = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}
"""Components of a symmetric tensor as a vector, by dimension; of strains 2 eps_ij where i != j."""

Modulus = Annotated[float, Positive, Unit("Pa")]
Contraction = Annotated[float, Finite, RATIO]


@dataclass(frozen=True, kw_only=True)
class Orthotropic:
    """Describe orthotropic elasticity along material axes 1, 2, 3 at right angles.

        eps_ii = sigma_ii / E_i - sum_j (nu_ij / E_i) sigma_jj
        nu_ji / E_j = nu_ij / E_i,   sigma_ij = 2 G_ij eps_ij

    with i != j: nu_ij is the contraction along j under a stress along i alone.

    Args:
        E1, E2, E3: Young's moduli.
        G12, G13, G23: shear moduli.
        rho: mass density.
        nu12, nu13, nu23: Poisson's ratios.
        axes: the angle [rad] from x to axis 1, anticlockwise about z, which is axis 3; or a
            rotation matrix (3, 3) whose columns are the axes 1, 2, 3. A body in the plane needs z
            among the axes.
        xi: damping ratio at the frequency of ``DampingRatio``, the one law that reads it.

    Raises:
        InputError: ratios with which some strain would have negative energy, axes that are no
            rotation.
    """

    E1: Modulus
    E2: Modulus
    E3: Modulus
    nu12: Contraction
    nu13: Contraction
    nu23: Contraction
    G12: Modulus
    G13: Modulus
    G23: Modulus
    rho: Annotated[float, Positive, Unit("kg/m³")]
    axes: Annotated[float | Sequence[Sequence[float]], Unit("rad")] = 0.0
    xi: DampedBy = 0.0

    def __post_init__(self) -> None:
        _ = self._rotation  # checks the axes
        check_fields(self)

        # Every strain has positive energy when the compliance, scaled to a diagonal of one, has
        # positive eigenvalues.
        root = np.sqrt([self.E1, self.E2, self.E3])
        if np.linalg.eigvalsh(root[:, None] * self._compliance * root)[0] < DEFINITE:
            raise InputError(
                f"Orthotropic: with nu12 = {self.nu12:g}, nu13 = {self.nu13:g} and nu23 = "
                f"{self.nu23:g} some strain has no positive energy at these moduli; give ratios "
                "nu_ij well below sqrt(E_i / E_j)"
            )
        Q = self._rotation
        if not np.allclose(Q.T @ Q, np.eye(3), atol=ORTHOGONAL) or np.linalg.det(Q) < 0.0:
            raise InputError(
                "Orthotropic: axes is not a rotation; give an angle [rad], or a matrix whose "
                "columns are right-handed unit vectors at right angles"
            )

    @property
    def _compliance(self) -> Array:
        """Return (3, 3) strains along the axes under unit stresses along them [1/Pa]."""
        s12 = -self.nu12 / self.E1
        s13 = -self.nu13 / self.E1
        s23 = -self.nu23 / self.E2
        return np.array(
            [[1.0 / self.E1, s12, s13], [s12, 1.0 / self.E2, s23], [s13, s23, 1.0 / self.E3]]
        )

    @property
    def _rotation(self) -> Array:
        """Return Q (3, 3), whose columns are the material axes."""
        if np.ndim(self.axes):
            return array("Orthotropic", "axes", self.axes, (3, 3))
        angle = number("Orthotropic", "the angle [rad] of the axes", self.axes)
        c = np.cos(angle)
        s = np.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @property
    def stiffness(self) -> Array:
        """Return C (3, 3, 3, 3) [Pa] of sigma_ij = C_ijkl eps_kl along x, y, z."""
        # Along the material axes: C_iijj from the moduli and ratios, C_ijij = G_ij.
        C = np.zeros((3, 3, 3, 3))
        for (i, j), value in np.ndenumerate(np.linalg.inv(self._compliance)):
            C[i, i, j, j] = value
        shear_moduli = {(0, 1): self.G12, (0, 2): self.G13, (1, 2): self.G23}
        for (i, j), G in shear_moduli.items():
            for first, second in product(((i, j), (j, i)), repeat=2):
                C[first + second] = G

        # Turned to x, y, z.
        Q = self._rotation
        return np.einsum("ip,jq,kr,ls,pqrs->ijkl", Q, Q, Q, Q, C, optimize=True)

    def matrix(self, section: Section, dimension: int) -> Array:
        """Return the stresses of unit strains [Pa], in the order of ``VOIGT``.

        Args:
            section: how the body is cut out of space.
            dimension: 2 or 3.

        Returns:
            (4, 3) in the plane, where the last row is sigma_zz, (6, 6) in space.

        Raises:
            InputError: material axes that leave the plane, and a body on a line.
        """
        if dimension not in VOIGT:
            raise InputError(
                "Orthotropic is for bodies in the plane or in space: give a LinearElastic here"
            )
        C = self.stiffness
        if dimension == 2:
            # Stresses in the plane and sigma_zz, under shear strains across the plane.
            across = np.abs(C[:, :, :2, 2])[[0, 1, 0, 2], [0, 1, 1, 2]]
            if across.max() > OUT_OF_PLANE * C.max():
                raise InputError(
                    "Orthotropic: z is not one of the material axes, so the body would leave its "
                    "plane; give the angle of axis 1 in the plane"
                )
            if isinstance(section, PlaneStress):
                # Strain across the plane is eliminated, where the stress is zero.
                C = C - np.einsum("ij,kl->ijkl", C[:, :, 2, 2], C[2, 2]) / C[2, 2, 2, 2]
        columns = VOIGT[dimension]
        rows = columns if dimension == 3 else (*columns, (2, 2))
        matrix = np.empty((len(rows), len(columns)))
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                matrix[i, j] = C[row + column]
        return matrix
