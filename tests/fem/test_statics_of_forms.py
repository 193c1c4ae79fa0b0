"""Forms without a mass: their static stages are those of any density, and all else is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl
from fem_problems import CONCRETE, block

import vi_contact as vc
from vi_contact import engineering, fem
from vi_contact.core.errors import InputError

E, NU = CONCRETE.E, CONCRETE.nu


def forms(mesh: Any) -> fem.Forms:
    """Hooke's law in plane strain, and nothing else."""
    lame, shear = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))

    def sigma(u: Any) -> Any:
        eps = ufl.sym(ufl.grad(u))
        return lame * ufl.tr(eps) * ufl.Identity(2) + 2 * shear * eps

    return fem.Forms(
        stiffness=lambda u, v: ufl.inner(sigma(u), ufl.sym(ufl.grad(v))) * ufl.dx, stress=sigma
    )


def problem_of(comm: Any, *, held: bool, material: Any = None, own: bool = True) -> Any:
    """A block that is pressed on a plane, held at its left side or by contact alone."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(6, 3))
    rollers = [fem.Prescribed(tags["left"], components=(0,))]
    system = fem.assemble(
        mesh,
        material,
        forms=forms(mesh) if own else None,
        prescribed=rollers if held else (),
        loads=fem.Traction(tags["top"], (0.0, -1.0e6)),
    )
    plane = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(0.5))


@pytest.mark.parametrize("held", [True, False])
def test_statics_need_no_mass(comm: Any, held: bool) -> None:
    """A pressed block: -sigma_yy = 1 MPa at every contact point, and the displacements of the
    material whose law the forms state, also where contact alone holds the body."""
    problem = problem_of(comm, held=held)
    assert problem.system.statics_only
    state = vc.static_equilibrium(problem)
    twin = problem_of(comm, held=held, material=CONCRETE, own=False)
    other = vc.static_equilibrium(twin)
    size = np.abs(other.u).max(initial=0.0)
    assert np.abs(state.u - other.u).max(initial=0.0) <= 1e-9 * max(size, 1e-12)
    (last,) = vc.quasi_static(problem, [1.0])
    assert np.allclose(last.r_n, state.r_n, rtol=1e-6, atol=1e-6)
    assert np.isclose(comm.allreduce(state.r_n.sum()), 2.0e6, rtol=1e-9)
    row = vc.Contact(arrays=False).start(problem, state)
    assert row["contact_resultant"] == pytest.approx(2.0e6, rel=1e-9)
    assert fem.as_function(problem, state, "stress") is not None


def test_all_that_needs_a_mass_is_refused(comm: Any) -> None:
    problem = problem_of(comm, held=True)
    system = problem.system
    still = vc.static_equilibrium(problem)
    for act in (
        lambda: vc.simulate(problem, dt=1e-4, steps=1, progress=False),
        lambda: next(iter(vc.march(problem, dt=1e-4, steps=1))),
        lambda: vc.with_weight(system),
        lambda: engineering.lowest_frequency(system),
        lambda: vc.BodyMotion("b").start(problem, still),
    ):
        with pytest.raises(InputError, match=r"have no mass, which static stages alone do without"):
            act()
