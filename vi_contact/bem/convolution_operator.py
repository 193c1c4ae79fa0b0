"""Build the Poincaré-Steklov operator of convolution quadrature, its boundary value problems and contact compliance.

At each frequency s the body is a matrix S(s), nodal displacements to nodal forces, in the symmetric form
(M/2 + K)ᵀ V⁻¹ (M/2 + K) - D or the unsymmetric Mᵀ V⁻¹ (M/2 + K). Every answer is a set of small dense systems, one per
frequency, and a Fourier transform; nothing is marched. Answers are objects of the energetic route, so that contact does
not see the difference: forces are means over steps, displacements are at the ends of steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.algebra import Array
from ..core.checks import array, counted, flag, instance, shape_of
from ..core.errors import InputError
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .boundary_operators import check_body
from .convolution_quadrature import Frequencies, RadauIIA, TimeMethod
from .energetic import NUMBERS, check_time_step
from .fundamental_solution import LaplaceKernels
from .poincare_steklov import BodyProblem, BoundaryMotion, CondensedCompliance
from .quadrature import Orders
from .radial_table import RadialTable

Mask = NDArray[np.bool_]
# |s| h/c_S reaches 100 with small steps; points cost nothing per frequency
ORDERS = Orders(far=6, near=8, touching=32, close=16)
PANEL = 1.5  # width of the panels of the radial table, in c_S dt: functions there are exp(-s r/c_S), |s| dt up to 4


@dataclass(frozen=True, eq=False)
class ConvolutionOperator:
    """Hold S of a body at the frequencies of a convolution quadrature, of the material's own density.

    steklov: (L, stages, 2n, 2n) S(s); to_traction: (L, stages, 4n, 2n) V⁻¹ (M/2 + K); L = steps/2 + 1.
    """

    mesh: BoundaryMesh
    frequencies: Frequencies
    steklov: NDArray
    to_traction: NDArray

    def __post_init__(self) -> None:
        instance("ConvolutionOperator", "mesh", self.mesh, BoundaryMesh, "give a BoundaryMesh")
        instance("ConvolutionOperator", "frequencies", self.frequencies, Frequencies, "give Frequencies(...)")
        n, table = len(self.mesh), self.frequencies.s.shape
        for name, rows in (("steklov", 2 * n), ("to_traction", 4 * n)):
            if shape_of(getattr(self, name)) != (*table, rows, 2 * n):
                raise InputError(f"ConvolutionOperator: {name} has shape {np.shape(getattr(self, name))}; this mesh "
                                 f"and these frequencies need {(*table, rows, 2 * n)}: use convolution_operator(...)")

    @property
    def steps(self) -> int:
        """Return the number of time steps, that of every history."""
        return self.frequencies.steps

    @property
    def dt(self) -> float:
        """Return the time step [s]."""
        return self.frequencies.dt

    def apply(self, displacement: ArrayLike) -> Array:
        """Return (steps, 2, n) mean nodal forces [N/m] of displacements (steps, 2, n) at t_1, t_2, ...; 0 at t_0."""
        shape = (self.steps, 2, len(self.mesh))
        u = array("ConvolutionOperator.apply", "displacement", displacement, shape, unit="m")
        everywhere = np.ones((2, len(self.mesh)), bool)
        return ConvolutionProblem(self, np.zeros_like(u), everywhere, u).solve().forces

    def solve(self, forces: ArrayLike) -> Array:
        """Return (steps, 2, n) displacements under nodal forces (steps, 2, n): the inverse, no support anywhere."""
        given = array("ConvolutionOperator.solve", "forces", forces, (None, 2, len(self.mesh)), unit="N/m")
        return ConvolutionProblem(self, given).solve().displacement


def convolution_operator(
    mesh: BoundaryMesh,
    material: LinearElastic,
    *,
    dt: float,
    steps: int,
    method: TimeMethod = RadauIIA(),
    symmetric: bool = True,
    orders: Orders = ORDERS,
) -> ConvolutionOperator:
    """Assemble S for `steps` time steps of dt [s]; method: BDF2(), Trapezoid() or RadauIIA(); 96 steps stages n² bytes.

    Raises InputError for a time step too small (c_P dt/h < 0.05, for the trapezoidal rule 0.5) or too large (> 8) for
    the mesh, or for less than one step.
    """
    check_body(mesh, material, orders)
    flag("convolution_operator", "symmetric", symmetric)
    table = Frequencies(method, dt, steps)
    counted("convolution_operator", f"{table.s.size} frequencies of {len(mesh)} elements",
            24 * table.s.size * len(mesh) ** 2, "numbers", most=NUMBERS)
    check_time_step(mesh, material.c_p, dt)
    ratio = material.c_p * dt / float(mesh.lengths.max())
    if ratio < method.smallest_ratio * (1.0 - 1e-9):
        raise InputError(f"convolution_operator: c_P dt / h is {ratio:.3g}, too small for {method}, which "
                         f"needs {method.smallest_ratio:g}; enlarge the time step or refine the mesh")
    n, rho, count = len(mesh), material.rho, table.s.size
    galerkin = RadialTable(mesh, material.c_s, PANEL * material.c_s * dt, orders)
    steklov, to_traction = np.empty((count, 2 * n, 2 * n), complex), np.empty((count, 4 * n, 2 * n), complex)
    for i, s in enumerate(table.s.ravel()):
        unit = galerkin.assemble(LaplaceKernels(complex(s), material.c_p, material.c_s))
        assert unit.hyper is not None
        right = unit.double + 0.5 * mesh.mass
        to_traction[i] = rho * np.linalg.solve(unit.single, right)
        steklov[i] = (right.T @ to_traction[i] - rho * unit.hyper) if symmetric else mesh.mass.T @ to_traction[i]
    shape = (*table.s.shape, -1, 2 * n)
    return ConvolutionOperator(mesh, table, steklov.reshape(shape), to_traction.reshape(shape))


@dataclass(frozen=True, eq=False)
class ConvolutionProblem(BodyProblem):
    """Describe what BoundaryProblem is for the energetic method: a body with supports, loads and perhaps contact.

    forces: nodal forces of the loads [N/m], (steps, 2, n) means over the steps, or (steps, stages, 2, n) means between
    the stages (Frequencies.substep_means); fixed: (2, n) mask of supported unknowns; prescribed: their
    displacement (steps, 2, n) [m] at the ends of the steps, zero if None; contact: (n,) mask of the elements of the
    contact boundary. Everything else is free of traction. Raises InputError for wrong shapes and what is no mask.
    """

    operator: ConvolutionOperator

    def __post_init__(self) -> None:
        operator = self.operator
        instance("ConvolutionProblem", "operator", operator, ConvolutionOperator,
                 "give one of convolution_operator(...)")
        n, steps, stages = len(operator.mesh), operator.steps, operator.frequencies.s.shape[1]
        self._check((steps, stages, 2, n) if len(shape_of(self.forces)) == 4 else (steps, 2, n))

    def solve(self, contact_forces: ArrayLike | None = None) -> BoundaryMotion:
        """Return the motion under loads and nodal contact forces (steps, 2m), ordered as CondensedCompliance."""
        table, n = self.operator.frequencies, len(self.operator.mesh)
        forces = self._loads(contact_forces).reshape(self.operator.steps, -1, 2 * n)
        u = self._displacement_modes(table.impulses(forces))
        over_s = u[..., None] / table.s[..., None, None]
        traction = table.step_means((self.operator.to_traction @ over_s)[..., 0])
        reaction = table.step_means((self.operator.steklov @ over_s)[..., 0])
        widths = np.diff(table.method.abscissae, prepend=0.0) if forces.shape[1] > 1 else np.ones(1)
        total = np.where(self._fixed, reaction, forces.transpose(0, 2, 1) @ widths)
        return BoundaryMotion(self.times, table.at_ends(u).reshape(-1, 2, n), traction.reshape(-1, 2, n, 2),
                              total.reshape(-1, 2, n))

    def condensed(self) -> CondensedCompliance:
        """Return the compliance of the contact unknowns, by frequencies, and their motion without contact."""
        table, free, unknowns = self.operator.frequencies, ~self._fixed, self._unknowns
        moving = free[unknowns]
        places = np.searchsorted(np.flatnonzero(free), unknowns[moving])
        units = np.eye(int(free.sum()))[:, places]
        transform = np.zeros((len(table.s), len(unknowns), len(unknowns)), complex)
        for at_z, matrices, factors in zip(transform, self.operator.steklov, table.held_factors, strict=True):
            inverse = np.linalg.solve(matrices[:, free][:, :, free], units[None])[:, places]
            at_z[np.ix_(moving, moving)] = np.einsum("i,icd->cd", factors, inverse)
        u_free = self.solve().displacement.reshape(len(self.times), -1)[:, unknowns]
        return self._compliance(table.backward(transform), u_free)

    def _displacement_modes(self, impulses: NDArray) -> NDArray:
        """Return (L, stages, 2n) displacements at the frequencies; prescribed ones move evenly during each step."""
        table, free = self.operator.frequencies, ~self._fixed
        u = np.zeros_like(impulses)
        load = impulses * table.s[..., None]
        if self.prescribed is not None:
            ends = np.asarray(self.prescribed, float).reshape(self.operator.steps, -1) * ~free
            u = table.impulses(np.diff(ends, axis=0, prepend=0.0)[:, None] / table.dt)
            load = load - (self.operator.steklov @ u[..., None])[..., 0]
        for at_z, matrices, right in zip(u, self.operator.steklov, load, strict=True):
            at_z[:, free] = np.linalg.solve(matrices[:, free][:, :, free], right[:, free, None])[..., 0]
        return u
