"""Pose bodies whose internal force is not linear, for tests and ``benchmarks/nonlinear.py``.

- ``make_chain``: masses with cubic springs between them, thrown along their line against a stop.
- ``throw_block``: a neo-Hookean block thrown obliquely on the ground.
- ``hang_block``: a neo-Hookean block that hangs from its top, and the ground below it rises.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

import vi_contact as vc

SPRING = 400.0  # N/m, of each spring
CUBIC = 4e4  # N/m³: at strains of the run tangents are up to eight times the reference
MASS = 0.05  # kg, of each node
DEGREE = (
    3  # of integrals; UFL estimates more than twice that for a logarithm, at four times the cost
)
GAP = 0.01  # m, between the end of the chain and the stop


@dataclass(frozen=True)
class CubicSprings:
    """Hold the forces k e + c e³ of springs with the elongations e = B u.

    Attributes:
        B: elongations of the displacements of the nodes, sparse.
        k: N/m.
        c: N/m³.
    """

    B: Any
    k: float
    c: float

    def force(self, u: np.ndarray) -> np.ndarray:
        """Return Bᵀ(k e + c e³) [N]."""
        e = self.B @ u
        return np.asarray(self.B.T @ (self.k * e + self.c * e**3))

    def energy(self, u: np.ndarray) -> float:
        """Return the sum of ½ k e² + ¼ c e⁴ [J]."""
        e = self.B @ u
        return float(0.5 * self.k * e @ e + 0.25 * self.c * (e**2) @ (e**2))

    def tangent(self, u: np.ndarray) -> Any:
        """Return Bᵀ diag(k + 3 c e²) B [N/m]."""
        e = self.B @ u
        return self.B.T @ sp.diags(self.k + 3.0 * self.c * e**2) @ self.B


def make_chain(
    *, elements: int = 40, cubic: float = CUBIC, speed: float = 3.0, **more: Any
) -> vc.ContactProblem:
    """Return a chain of masses that is thrown along its line against a stop 1 cm before its end.

    Args:
        elements: number of springs.
        cubic: their c [N/m³].
        speed: of the chain [m/s].
        more: laws of the ``ContactProblem``.
    """
    n = elements + 1
    rows = np.arange(elements)
    ones = np.ones(elements)
    entries = np.r_[-ones, ones]
    places = (np.r_[rows, rows], np.r_[rows, rows + 1])
    internal = CubicSprings(sp.csr_matrix((entries, places), (elements, n)), SPRING, cubic)
    system = vc.system_from_arrays(
        np.full(n, MASS),
        None,
        internal.tangent(np.zeros(n)),
        coordinates=np.linspace(0.0, 1.0, n)[:, None],
        v0=np.full(n, speed),
        internal=internal,
    )
    surface = vc.contact_points(system, [n - 1], [1.0], gap0=GAP)
    return vc.ContactProblem(system, surface, **more)


@dataclass(frozen=True)
class Rubber:
    """Describe compressible neo-Hookean material in plane strain.

    W = mu/2 (F:F - 2) - mu ln J + lambda/2 (ln J)², with F = 1 + grad u and J = det F.

    Attributes:
        E: Young's modulus at small strain [Pa].
        nu: Poisson's ratio at small strain.
        rho: density [kg/m³].
    """

    E: float = 1e6
    nu: float = 0.3
    rho: float = 1000.0

    @property
    def mu(self) -> float:
        """Return the shear modulus [Pa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def lame(self) -> float:
        """Return Lamé's lambda [Pa]."""
        return self.E * self.nu / ((1.0 + self.nu) * (1.0 - 2.0 * self.nu))

    @property
    def shear_speed(self) -> float:
        """Return the speed of shear waves [m/s]."""
        return float(np.sqrt(self.mu / self.rho))

    def energy(self, u: Any) -> Any:
        """Return the form of the stored energy [J]."""
        import ufl

        F = ufl.Identity(2) + ufl.grad(u)
        J = ufl.det(F)
        stored = 0.5 * self.mu * (ufl.inner(F, F) - 2.0 - 2.0 * ufl.ln(J))
        return (stored + 0.5 * self.lame * ufl.ln(J) ** 2) * ufl.dx

    def internal(self, u: Any, v: Any) -> Any:
        """Return the form of the internal force, the derivative of the energy."""
        import ufl

        return ufl.derivative(self.energy(u), u, v)

    def inertia(self, u: Any, v: Any) -> Any:
        """Return the form of the mass."""
        import ufl

        return self.rho * ufl.inner(u, v) * ufl.dx

    def stress(self, u: Any) -> Any:
        """Return Cauchy's stress (3, 3) [Pa]."""
        import ufl

        F = ufl.Identity(2) + ufl.grad(u)
        J = ufl.det(F)
        across = self.lame * ufl.ln(J) / J
        plane = self.mu / J * (F * F.T - ufl.Identity(2)) + across * ufl.Identity(2)
        return ufl.as_tensor(
            [[plane[0, 0], plane[0, 1], 0.0], [plane[1, 0], plane[1, 1], 0.0], [0.0, 0.0, across]]
        )

    def make_forms(self) -> Any:
        """Return the forms of a body, for ``fem.assemble``."""
        from vi_contact import fem

        return fem.Forms(
            mass=self.inertia, internal=self.internal, energy=self.energy, stress=self.stress
        )


def throw_block(
    comm: Any, n: int = 6, rubber: Rubber | None = None, **more: Any
) -> vc.ContactProblem:
    """Return a block, 1 m wide and 2 m high, thrown on the ground 2 cm below it.

    Its speed downwards is a quarter of that of shear waves, and 0.4 of it sideways.

    Args:
        comm: the ranks.
        n: quadrilaterals across; twice as many upwards.
        rubber: its material.
        more: laws of the ``ContactProblem``.
    """
    from vi_contact import fem
    from vi_contact.meshes.block import BlockMesh

    rubber = rubber or Rubber()
    speed = 0.25 * rubber.shear_speed
    on, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(n, 2 * n)), comm)
    system = fem.assemble(
        on,
        forms=rubber.make_forms(),
        initial_velocity=(0.4 * speed, -speed),
        quadrature_degree=DEGREE,
    )
    ground = vc.HalfSpace(point=(0.0, -0.02), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    return vc.ContactProblem(system, surface, **more)


def hang_block(
    comm: Any,
    *,
    lengths: tuple[float, float] = (1.0, 2.0),
    divisions: tuple[int, int] = (16, 32),
    sides: bool = True,
    rubber: Rubber | None = None,
) -> vc.ContactProblem:
    """Return a block that hangs from its top, above ground that rises by t metres at time t.

    Args:
        comm: the ranks.
        lengths: width and height [m].
        divisions: squares along both; each is two triangles.
        sides: whether its sides may touch the ground too, beside its bottom.
        rubber: its material.
    """
    import dolfinx

    from vi_contact import fem

    width, height = lengths
    on = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [width, height]], divisions)
    top = fem.Facets.where("top", on, lambda x: np.isclose(x[1], height))
    system = fem.assemble(
        on, forms=(rubber or Rubber()).make_forms(), clamped=top, quadrature_degree=DEGREE
    )

    def may_touch(x: np.ndarray) -> np.ndarray:
        """Mark points of the bottom, and of the sides."""
        beside = np.isclose(x[0], 0.0) | np.isclose(x[0], width)
        return np.isclose(x[1], 0.0) | (beside & sides)

    touching = fem.Facets.where("boundary", on, may_touch)
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, touching, obstacle=ground)
    return vc.ContactProblem(system, surface.moving(towards=lambda t: t))
