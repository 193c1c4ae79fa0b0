"""Build the Poincaré-Steklov operator of convolution quadrature, for boundary value problems and
contact compliance.

At each frequency s the body is a matrix S(s), nodal displacements to nodal forces, in the symmetric
form (M/2 + K)ᵀ V⁻¹ (M/2 + K) - D or the unsymmetric Mᵀ V⁻¹ (M/2 + K). Every answer is a set of
small dense systems, one per frequency, and a Fourier transform; nothing is marched. Answers are
objects of the energetic route, so that contact does not see the difference: forces are means over
steps, displacements are at the ends of steps.
"""

from dataclasses import dataclass

import numpy as np
from convolution_quadrature import WIDTHS, Frequencies
from laplace_kernels import LaplaceKernels
from numpy.typing import NDArray
from radial_table import RadialTable

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.boundary_operators import check_body
from vi_contact.bem.energetic import NUMBERS, check_time_step
from vi_contact.bem.quadrature import Orders
from vi_contact.core.algebra import Array, Indices, Mask
from vi_contact.core.checks import check_count, flag
from vi_contact.laws.materials import LinearElastic

# |s| h/c_S reaches 100 with small steps; points cost nothing per frequency
ORDERS = Orders(far=6, near=8, touching=32, close=16)
# width of the panels of the radial table, in c_S dt: functions there are exp(-s r/c_S), |s| dt up
# to 4
PANEL = 1.5


@dataclass(frozen=True, eq=False)
class ConvolutionOperator:
    """Hold S of a body at the frequencies of a convolution quadrature, of the material's own
    density.

    steklov: (L, 2, 2n, 2n) S(s); to_traction: (L, 2, 4n, 2n) V⁻¹ (M/2 + K); L = steps/2 + 1:
    convolution_operator(...).
    """

    mesh: BoundaryMesh
    frequencies: Frequencies
    steklov: NDArray
    to_traction: NDArray

    @property
    def dt(self) -> float:
        """Return the time step [s]."""
        return self.frequencies.dt

    def load_shape(self, dimensions: int) -> tuple[int, ...]:
        """Return the shape of the nodal forces of a problem; in four dimensions the second is that
        of the stages."""
        stages = (2,) if dimensions == 4 else ()
        return self.frequencies.steps, *stages, 2, len(self.mesh)

    def motion(
        self, forces: Array, fixed: Mask, prescribed: Array | None
    ) -> tuple[Array, Array, Array]:
        """Return the motion by frequencies; forces: (steps, 2 or 1, 2n)."""
        table = self.frequencies
        u = self._displacement_modes(table.impulses(forces), ~fixed, prescribed)
        over_s = u[..., None] / table.s[..., None, None]
        traction = table.step_means((self.to_traction @ over_s)[..., 0])
        reaction = table.step_means((self.steklov @ over_s)[..., 0])
        widths = WIDTHS if forces.shape[1] > 1 else np.ones(1)
        return (
            table.at_ends(u),
            traction,
            np.where(fixed, reaction, forces.transpose(0, 2, 1) @ widths),
        )

    def condense(
        self, forces: Array, fixed: Mask, prescribed: Array | None, unknowns: Indices
    ) -> tuple[Array, Array]:
        """Return W, by frequencies, and u_free of CondensedCompliance for these unknowns."""
        table, free, moving = self.frequencies, ~fixed, ~fixed[unknowns]
        places = np.searchsorted(np.flatnonzero(free), unknowns[moving])
        units = np.eye(int(free.sum()))[:, places]
        transform = np.zeros((len(table.s), len(unknowns), len(unknowns)), complex)
        for at_z, matrices, factors in zip(
            transform, self.steklov, table.held_factors, strict=True
        ):
            inverse = np.linalg.solve(matrices[:, free][:, :, free], units[None])[:, places]
            at_z[np.ix_(moving, moving)] = np.einsum("i,icd->cd", factors, inverse)
        return table.backward(transform), self.motion(forces, fixed, prescribed)[0][:, unknowns]

    def _displacement_modes(
        self, impulses: NDArray, free: Mask, prescribed: Array | None
    ) -> NDArray:
        """Return (L, 2, 2n) displacements at the frequencies; prescribed ones move evenly during
        each step."""
        table, u = self.frequencies, np.zeros_like(impulses)
        load = impulses * table.s[..., None]
        if prescribed is not None:
            u = table.impulses(np.diff(prescribed * ~free, axis=0, prepend=0.0)[:, None] / table.dt)
            load = load - (self.steklov @ u[..., None])[..., 0]
        for at_z, matrices, right in zip(u, self.steklov, load, strict=True):
            at_z[:, free] = np.linalg.solve(matrices[:, free][:, :, free], right[:, free, None])[
                ..., 0
            ]
        return u


def convolution_operator(
    mesh: BoundaryMesh,
    material: LinearElastic,
    *,
    dt: float,
    steps: int,
    symmetric: bool = True,
    orders: Orders = ORDERS,
) -> ConvolutionOperator:
    """Assemble S for `steps` time steps of dt [s] by Radau IIA: 192 steps n² bytes.

    Raises InputError for a time step too small (c_P dt/h < 0.05) or too large (> 8) for the mesh,
    or for no step.
    """
    check_body(mesh, material, orders)
    flag("convolution_operator", "symmetric", symmetric)
    table = Frequencies(dt, steps)
    check_count(
        "convolution_operator",
        f"{table.s.size} frequencies of {len(mesh)} elements",
        24 * table.s.size * len(mesh) ** 2,
        "numbers",
        most=NUMBERS,
    )
    check_time_step(mesh, material.c_p, dt)
    n, rho, count = len(mesh), material.rho, table.s.size
    galerkin = RadialTable(mesh, material.c_s, PANEL * material.c_s * dt, orders)
    steklov, to_traction = (
        np.empty((count, 2 * n, 2 * n), complex),
        np.empty((count, 4 * n, 2 * n), complex),
    )
    for i, s in enumerate(table.s.ravel()):
        unit = galerkin.assemble(LaplaceKernels(complex(s), material.c_p, material.c_s))
        right = unit.double + 0.5 * mesh.mass
        to_traction[i] = rho * np.linalg.solve(unit.single, right)
        steklov[i] = (
            (right.T @ to_traction[i] - rho * unit.hyper)
            if symmetric
            else mesh.mass.T @ to_traction[i]
        )
    shape = (*table.s.shape, -1, 2 * n)
    return ConvolutionOperator(mesh, table, steklov.reshape(shape), to_traction.reshape(shape))
