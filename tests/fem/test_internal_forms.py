"""Bodies of finite elements whose internal force is a form of the user's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh

E, NU, RHO = 1.0e6, 0.3, 1000.0
MU = E / (2.0 * (1.0 + NU))
LAM = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))


def stored(u: Any) -> Any:
    """Compressible neo-Hookean energy in plane strain [J/m²]."""
    F = ufl.Identity(2) + ufl.grad(u)
    J = ufl.det(F)
    return 0.5 * MU * (ufl.inner(F, F) - 2.0 - 2.0 * ufl.ln(J)) + 0.5 * LAM * ufl.ln(J) ** 2


def energy(u: Any) -> Any:
    return stored(u) * ufl.dx


def internal(u: Any, v: Any) -> Any:
    return ufl.derivative(energy(u), u, v)


def mass(u: Any, v: Any) -> Any:
    return RHO * ufl.inner(u, v) * ufl.dx


def block(comm: Any, n: int = 6, **more: Any) -> tuple[Any, Any]:
    """A block 1 m wide and 2 m high, stated by forms."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(n, 2 * n)), comm)
    forms = fem.Forms(mass=mass, internal=internal, energy=energy)
    return fem.assemble(mesh, forms=forms, section=vc.PlaneStrain(), **more), tags


def thrown(comm: Any, friction: Any = None) -> vc.ContactProblem:
    """The block thrown obliquely on the ground at a quarter of the speed of shear waves."""
    speed = 0.25 * np.sqrt(MU / RHO)
    system, tags = block(comm, initial_velocity=(0.4 * speed, -speed))
    ground = vc.HalfSpace(point=(0.0, -0.02), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    law = {} if friction is None else {"friction": friction}
    return vc.ContactProblem(system, surface, mass=vc.ConsistentMass(), **law)


def test_the_forms_at_rest_are_those_of_the_linear_body(comm: Any) -> None:
    """K is the derivative at zero, which is that of Hooke's law; p is its product for small u."""
    system, _ = block(comm)
    mesh = system.space.mesh  # type: ignore[attr-defined]
    hooke = fem.assemble(mesh, vc.LinearElastic(E=E, nu=NU, rho=RHO), section=vc.PlaneStrain())
    x = system.space.coordinates
    u = 1e-7 * np.sin(3.0 * x[:, 0] + 2.0 * x[:, 1])
    assert system.internal is not None
    linear = hooke.K @ u
    size = vc.core.algebra.largest(system.algebra.comm, np.abs(linear).max(initial=0.0))
    for found in (system.K @ u, system.internal.force(u), system.internal.tangent(u) @ u):
        off = vc.core.algebra.largest(system.algebra.comm, np.abs(found - linear).max(initial=0.0))
        assert off <= 1e-5 * size


def test_a_block_is_thrown_with_friction(comm: Any) -> None:
    """Certificates of the nonlinear step, the ledger with W(u), and a loss of the scheme that is
    small beside the energy."""
    problem = thrown(comm, vc.Coulomb(0.3))
    found = vc.simulate(
        problem,
        scheme=vc.Midpoint(),
        dt=2e-3,
        steps=60,
        record=[vc.Energy(), vc.Contact()],
        progress=False,
    )
    history = found.history
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    if comm.rank == 0:
        most = history["energy_kinetic"][0]
        assert history["contact_active"].max() >= 5
        assert history["loss_friction"][-1] > 1e-3 * most
        assert abs(history["loss_algorithmic"][-1]) < 0.05 * most


def test_a_block_is_pressed_by_a_rising_ground(comm: Any) -> None:
    """Static stages: the ground rises by a quarter of the height of a flat block that hangs from
    its top, and the work of the contact forces is the stored energy, by Simpson's rule."""
    forms = fem.Forms(mass=mass, internal=internal, energy=energy)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4)), comm)
    system = fem.assemble(mesh, forms=forms, section=vc.PlaneStrain(), clamped=tags["top"])
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    times = [0.03 * k for k in range(1, 9)]
    forces = [0.0]
    for state in vc.quasi_static(problem, times):
        forces.append(float(surface.comm.sum(state.r_n.sum())))
        assert np.all(state.r_n >= 0.0)
    weights = np.array([1.0, 4.0, 2.0, 4.0, 2.0, 4.0, 2.0, 4.0, 1.0]) * 0.03 / 3.0
    work = weights @ np.array(forces)
    assert system.internal is not None
    u = problem.cartesian(state.u)
    assert system.internal.energy(u) == pytest.approx(work, rel=2e-3)


@pytest.mark.serial
def test_forms_that_are_none_are_refused() -> None:
    for given, sentence in (
        ({"mass": mass, "internal": internal}, "belong together"),
        ({"mass": mass}, "give stiffness=, the form of K, or internal="),
    ):
        with pytest.raises(InputError, match=sentence):
            fem.Forms(**given)
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(2, 4)), MPI.COMM_SELF)
    wrong = fem.Forms(mass=mass, internal=lambda u, v: energy(u), energy=energy)
    with pytest.raises(InputError, match="is not linear in v alone"):
        fem.assemble(mesh, forms=wrong, section=vc.PlaneStrain())
