"""Materials of bodies that turn, at rest and in equilibrium."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl

import vi_contact as vc
from demos.parts.problems import turning
from vi_contact import fem
from vi_contact.core.algebra import largest, max_abs
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.meshes.block import BlockMesh

SOFT = vc.SaintVenantKirchhoff(E=1e6, nu=0.3, rho=1000.0)
RUBBER = vc.NeoHookean(E=1e6, nu=0.3, rho=1000.0)
# L. Mattiasson, Int. J. Numer. Methods Eng. 17 (1981) 145-153: deflection and shortening over the
# length of a cantilever under the dead load P at its end, P L²/EI = 2
ELASTICA = (0.49346, 0.16064)


def own_rubber(C: Any) -> Any:
    """The energy of RUBBER, written as a user would."""
    lame = RUBBER.lame_lambda
    mu = RUBBER.shear_modulus
    log_J = 0.5 * ufl.ln(ufl.det(C))
    return 0.5 * mu * (ufl.tr(C) - 3.0 - 2.0 * log_J) + 0.5 * lame * log_J**2


def bar(comm: Any, *lengths: float, divisions: tuple[int, ...] = (4, 1)) -> Any:
    return fem.build_mesh(BlockMesh(lengths=lengths, divisions=divisions), comm)


@pytest.mark.parametrize("lengths", [(1.0, 0.5), (1.0, 0.5, 0.5)])
@pytest.mark.parametrize("law", [vc.SaintVenantKirchhoff, vc.NeoHookean])
def test_small_strains_are_those_of_hooke(comm: Any, lengths: Any, law: Any) -> None:
    """p(u) and p̄(0, u) of small u are K u, and p'(0) is K, plane strain and space."""
    divisions = (4, 2, 2)[: len(lengths)]
    mesh, tags = bar(comm, *lengths, divisions=divisions)
    system = fem.assemble(mesh, law(E=1e6, nu=0.3, rho=1.0), clamped=tags["left"])
    hooke = fem.assemble(mesh, vc.LinearElastic(1e6, 0.3, 1.0), clamped=tags["left"])
    internal: Any = system.internal
    u = 1e-7 * np.sin(3.0 * np.arange(system.rows) + 1.0)
    force = hooke.K @ u
    size = largest(system.algebra.comm, max_abs(force))
    rest = np.zeros(system.rows)
    for found, share in (
        (system.K @ u, 1.0),
        (internal.force(u), 1.0),
        (internal.between(rest, u), 0.5),
        (internal.tangent(rest) @ u, 1.0),
        (internal.between_tangent(rest, rest) @ u, 1.0),
    ):
        assert largest(system.algebra.comm, max_abs(found - share * force)) < 1e-5 * size


@pytest.mark.parametrize("law", [SOFT, RUBBER], ids=["Saint-Venant", "neo-Hooke"])
def test_the_work_of_both_ends_is_that_of_the_energy(comm: Any, law: Any) -> None:
    """du·p̄ = W(u1) - W(u0) over strains of 0.1 and a turn of 0.6 rad at once."""
    mesh, _ = bar(comm, 1.0, 0.5, divisions=(3, 2))
    system = fem.assemble(mesh, law)
    internal: Any = system.internal
    x = system.space.coordinates
    ends = []
    for turn, strain in ((0.2, 0.05), (0.8, 0.1)):
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        y = (x + strain * np.sin(3.0 * x)) @ R.T
        ends.append((y - x)[np.arange(len(x)), np.asarray(system.space.ids) % 2])
    u0, u1 = ends
    work = system.algebra.dot(u1 - u0, internal.between(u0, u1))
    change = internal.energy(u1) - internal.energy(u0)
    assert work == pytest.approx(change, rel=1e-9)


def test_an_energy_of_ones_own_is_taken(comm: Any) -> None:
    """Neo-Hooke's energy as a user writes it gives the forces of the material."""
    mesh, tags = bar(comm, 1.0, 0.5)
    forces = []
    for material in (
        RUBBER,
        fem.Hyperelastic(energy=own_rubber, E=RUBBER.E, nu=RUBBER.nu, rho=RUBBER.rho),
    ):
        system = fem.assemble(mesh, material, clamped=tags["left"])
        u = 0.05 * np.sin(3.0 * np.arange(system.rows) + 1.0)
        forces.append(system.internal.between(0.5 * u, u))  # type: ignore[union-attr]
    assert np.allclose(forces[0], forces[1], rtol=1e-12, atol=1e-9 * np.abs(forces[0]).max())


@pytest.mark.serial
def test_an_energy_with_other_constants_is_refused() -> None:
    from mpi4py import MPI

    mesh, _ = bar(MPI.COMM_SELF, 1.0, 0.5)
    wrong = fem.Hyperelastic(energy=own_rubber, E=2e6, nu=0.3, rho=1.0)
    with pytest.raises(InputError, match="not the E and nu that are given beside it"):
        fem.assemble(mesh, wrong)
    stressed = fem.Hyperelastic(
        energy=lambda C: own_rubber(C) + 1e5 * ufl.tr(C), E=1e6, nu=0.3, rho=1.0
    )
    with pytest.raises(InputError, match="its stress by"):
        fem.assemble(mesh, stressed)


@pytest.mark.parametrize("pull", [3e5, -1e5])
def test_a_bar_is_pulled(comm: Any, pull: float) -> None:
    """Without lateral strain (nu = 0) the dead load is P = E/2 (s³ - s) at the stretch s."""
    mesh, tags = bar(comm, 1.0, 0.5)
    law = vc.SaintVenantKirchhoff(E=1e6, nu=0.0, rho=1.0)
    system = fem.assemble(
        mesh, law, clamped=tags["left"], loads=fem.Traction(tags["right"], (pull, 0.0))
    )
    floor = vc.HalfSpace((0.0, -10.0), (0.0, 1.0))
    problem = vc.ContactProblem(system, fem.contact_surface(system, obstacle=floor))
    *_, state = vc.quasi_static(problem, [1.0])
    roots = np.roots([0.5, 0.0, -0.5, -pull / law.E])
    stretch = max(root.real for root in roots if abs(root.imag) < 1e-12)
    most = problem.cartesian(state.u)[np.asarray(system.space.ids) % 2 == 0].max(initial=-1.0)
    least = problem.cartesian(state.u)[np.asarray(system.space.ids) % 2 == 0].min(initial=1.0)
    end = comm.allreduce(most, op=max) if pull > 0.0 else comm.allreduce(least, op=min)
    assert end == pytest.approx(stretch - 1.0, rel=1e-8)


@pytest.mark.long
def test_a_cantilever_bends_far(comm: Any) -> None:
    """The elastica: half the length down. Shear and stretch of a beam 1:50 are 1e-3 of it."""
    h = 0.02
    mesh, tags = bar(comm, 1.0, h, divisions=(16, 1))
    law = vc.SaintVenantKirchhoff(E=1e9, nu=0.0, rho=1.0)
    load = 2.0 * law.E * h**3 / 12.0
    system = fem.assemble(
        mesh,
        law,
        clamped=tags["left"],
        loads=fem.Traction(tags["right"], (0.0, -load / h)),
        degree=2,
    )
    floor = vc.HalfSpace((0.0, -10.0), (0.0, 1.0))
    part = tags["right"]
    problem = vc.ContactProblem(system, fem.contact_surface(system, part, obstacle=floor))
    *_, state = vc.quasi_static(problem, [1.0])
    space: Any = system.space
    tip = space.sample(
        problem.cartesian(state.u), space.find_nodes(np.array([[1.0, 0.5 * h]])), state.t
    )[0]
    assert -tip[1] == pytest.approx(ELASTICA[0], rel=3e-3)
    assert -tip[0] == pytest.approx(ELASTICA[1], rel=5e-3)


@pytest.mark.serial
def test_what_resists_rotation_is_refused() -> None:
    from mpi4py import MPI

    mesh, tags = bar(MPI.COMM_SELF, 1.0, 0.5)
    hooke = vc.LinearElastic(1e6, 0.3, 1000.0)
    half = fem.Cells.where("half", mesh, lambda x: x[0] < 0.51)
    rest = fem.Cells.where("rest", mesh, lambda x: x[0] > 0.49)
    refused: list[tuple[str, dict[str, Any]]] = [
        ("resists the rotation", {"damping": vc.Rayleigh(0.0, 1e-3)}),
        ("resists the rotation", {"damping": vc.Rayleigh(0.1, 0.0)}),
        ("resists the rotation", {"damping": vc.KelvinVoigt(shear=1.0)}),
        ("PlaneStress does not go", {"section": vc.PlaneStress()}),
        ("absorbs waves", {"dashpots": fem.Dashpots(tags["right"], hooke)}),
        ("does not turn with the body", {"loads": fem.InitialStrain(1e-3)}),
        ("knows small rotations only", {"material": [(half, SOFT), (rest, hooke)]}),
    ]
    for sentence, given in refused:
        with pytest.raises(InputError, match=sentence):
            fem.assemble(mesh, **({"material": SOFT} | given))
    system = fem.assemble(mesh, SOFT)
    with pytest.raises(InputError, match="Touching says gaps along the normals"):
        fem.contact_surface(system, tags["bottom"])
    with pytest.raises(InputError, match="have contact with flat rigid supports alone"):
        fem.contact_pair(system, tags["bottom"], tags["top"])
    linear = fem.assemble(mesh, hooke)
    with pytest.raises(InputError, match="facets are not given"):
        fem.contact_surface(linear, obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0)))


@pytest.mark.long
def test_two_materials_share_a_body(comm: Any) -> None:
    """One law in two groups of cells is one law."""
    mesh, tags = bar(comm, 1.0, 0.5)
    half = fem.Cells.where("half", mesh, lambda x: x[0] < 0.51)
    rest = fem.Cells.where("rest", mesh, lambda x: x[0] > 0.49)
    whole = fem.assemble(mesh, SOFT, clamped=tags["left"])
    parts = fem.assemble(mesh, [(half, SOFT), (rest, SOFT)], clamped=tags["left"])
    u = 0.05 * np.sin(3.0 * np.arange(whole.rows) + 1.0)
    forces = [system.internal.force(u) for system in (whole, parts)]  # type: ignore[union-attr]
    assert np.allclose(forces[0], forces[1], rtol=1e-12, atol=1e-9 * max_abs(forces[0]))


@pytest.mark.serial
def test_a_body_inside_out_has_no_forces() -> None:
    """A mirrored body has the strain of one at rest; its step is refused, not stepped on."""
    from mpi4py import MPI

    problem = turning.spin_block(
        MPI.COMM_SELF,
        SOFT,
        divisions=(1, 2),
        initial_displacement=lambda x: x * [-2.0, 0.0],
    )
    with pytest.raises(StepFailure):
        next(vc.march(problem, dt=1e-3, steps=1))
