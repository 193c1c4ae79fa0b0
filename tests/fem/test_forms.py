"""Forms of the user's own: those of materials, prestress, springs, K that is not symmetric, outputs
and misuse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from fem_problems import BODIES, CONCRETE, block, dense, field, linear, max_over_ranks
from mesh_tools import refusal
from own_meshes import own_mesh
from petsc4py import PETSc

import vi_contact as vc
from demos.parts.problems.geometric_stiffness import geometric_stiffness
from vi_contact import fem, soil
from vi_contact.core.errors import InputError
from vi_contact.core.ledger import energy_balance
from vi_contact.fem import Forms, compat
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.fem.output.fields import XDMF, VonMises
from vi_contact.laws import (
    KelvinVoigt,
    LinearElastic,
    MassProportional,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
    with_weight,
)
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.run.files.identity import find_differences, identify
from vi_contact.run.modal import lowest_frequency
from vi_contact.solvers import Lemke
from vi_contact.solvers.volume import ReducedNewton, SemismoothNewton, TaoTron, Volume

SECTIONS = {"strain": PlaneStrain(0.7), "stress": PlaneStress(0.2), "solid": None}


def eps(u: Any) -> Any:
    return ufl.sym(ufl.grad(u))


def isotropic(
    mesh: Any, material: LinearElastic = CONCRETE, section: Any = None, **more: Any
) -> Forms:
    """Hooke's law written out by a user, times the thickness."""
    d, t = mesh.geometry.dim, 1.0 if section is None else section.thickness
    lame, mu = (section or vc.Solid()).elastic_constants(material)
    lame, mu, rho, t = (compat.constant(mesh, one) for one in (lame, mu, material.rho, t))

    def sigma(u: Any) -> Any:
        return lame * ufl.tr(eps(u)) * ufl.Identity(d) + 2 * mu * eps(u)

    def whole(u: Any) -> Any:
        if d == 3 or isinstance(section, PlaneStress):
            return sigma(u)
        s = sigma(u)
        return ufl.as_tensor(
            [[s[0, 0], s[0, 1], 0], [s[1, 0], s[1, 1], 0], [0, 0, lame * ufl.tr(eps(u))]]
        )

    return Forms(
        **{
            "stiffness": lambda u, v: t * ufl.inner(sigma(u), eps(v)) * ufl.dx,
            "mass": lambda u, v: t * rho * ufl.inner(u, v) * ufl.dx,
            "stress": whole,
            **more,
        }
    )


def same(comm: Any, one: Any, other: Any) -> None:
    for matrix in "MKC":
        assert (getattr(one, matrix) is None) == (getattr(other, matrix) is None)
        if getattr(one, matrix) is not None:
            a, b = (dense(comm, system, getattr(system, matrix)) for system in (one, other))
            assert np.abs(a - b).max() <= 1e-13 * np.abs(b).max(), matrix


def both(comm: Any, name: str, section: str) -> tuple[Any, Forms, Any, Any, dict[str, Any]]:
    """(mesh, forms, the body stated by them and by its material, what else is given), damped,
    pushed and moved."""
    name, _, degree = name.partition(", degree ")
    mesh, tags = block(comm, **BODIES[name])
    pushed = fem.Prescribed(tags["top"], lambda x, t: (1 + t) * 1e-3 * x, components=(1,))
    data: dict[str, Any] = {
        "section": SECTIONS[section],
        "clamped": tags["bottom"],
        "prescribed": pushed,
        "damping": Rayleigh(0.3, 1e-3),
        "loads": fem.Traction(tags["right"], (1e6, 0.0, 0.0)[: mesh.geometry.dim]),
        "degree": int(degree or 1),
    }
    given = isotropic(mesh, section=SECTIONS[section])
    return (
        mesh,
        given,
        fem.assemble(mesh, forms=given, **data),
        fem.assemble(mesh, CONCRETE, **data),
        data,
    )


@pytest.mark.parametrize(
    "name, section",
    [
        ("quadrilaterals", "strain"),
        ("triangles", "stress"),
        ("hexahedra", "solid"),
        ("tetrahedra", "solid"),
        ("triangles, degree 2", "strain"),
    ],
)
def test_own_isotropic_forms_are_those_of_the_material(comm: Any, name: str, section: str) -> None:
    """M, K, C, what held nodes pull, weight: to round-off."""
    _, _, ours, theirs, _ = both(comm, name, section)
    same(comm, ours, theirs)
    for vector in (
        lambda s: s.base_mass,
        lambda s: s.load(0.5),
        lambda s: vc.with_weight(s).load(0.0),
    ):
        assert max_over_ranks(comm, vector(ours) - vector(theirs)) < 1e-12 * max_over_ranks(
            comm, vector(theirs)
        )


@pytest.mark.two_ranks
def test_mass_of_a_material_and_damping_of_ones_own(comm: Any) -> None:
    mesh, given, _, theirs, data = both(comm, "quadrilaterals", "strain")
    same(comm, fem.assemble(mesh, CONCRETE, forms=replace(given, mass=None), **data), theirs)
    own = replace(
        given,
        damping=lambda u, v: 0.3 * given.mass(u, v) + 1e-3 * given.stiffness(u, v),  # type: ignore
    )
    same(comm, fem.assemble(mesh, forms=own, **{**data, "damping": None}), theirs)


def test_outputs_of_own_isotropic_forms_are_those_of_the_material(comm: Any) -> None:
    """Stresses, with sigma_zz of plane strain, reactions, section forces, geometric stiffness: to
    round-off."""
    _, _, ours, theirs, data = both(comm, "quadrilaterals", "strain")
    stresses, numbers = [], []
    for system in (ours, theirs):
        problem = linear(system)
        state = vc.static_equilibrium(problem)
        stresses.append(VonMises(system.space.forms)(system.space.expand(state.u, 0.0)))
        shaped = (
            vc.Reactions("base", data["clamped"], (0.0, 0.0), loads=data["loads"]),
            vc.SectionForces({"middle": ((0.0, 0.75), (2.0, 0.75))}, loads=data["loads"]),
        )
        row = [value for one in shaped for value in one.start(problem, state).values()]
        stiffer = geometric_stiffness(problem, state)
        numbers.append([*row, stiffer.strain_energy(state.u)])
    assert stresses[0] == pytest.approx(stresses[1], rel=1e-10)
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-10, abs=1e-12 * np.abs(numbers[1]).max())


@pytest.mark.two_ranks
def test_viscous_damping_beside_own_forms(comm: Any) -> None:
    mesh, _ = block(comm, **BODIES["triangles"])
    damping, section = KelvinVoigt(3e5, 1e5), PlaneStrain(0.7)
    ours = fem.assemble(
        mesh, forms=isotropic(mesh, section=section), section=section, damping=damping
    )
    same(comm, ours, fem.assemble(mesh, CONCRETE, section=section, damping=damping))


# Prestress, springs and layers
# ----------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_a_prestressed_string(comm: Any) -> None:
    """A line with one transverse displacement, T u'v' and rho A u v: f1 = sqrt(T / rho A) / 2L, on
    16 elements as the lattice has it, w² = 6 c²/h² (1 - cos kh)/(2 + cos kh)."""
    n, length, tension, line = 16, 3.0, 400.0, 0.1
    mesh, tags = block(comm, lengths=(length,), divisions=(n,))
    T = compat.constant(mesh, tension)
    string = Forms(
        stiffness=lambda u, v: T * ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx,
        mass=lambda u, v: line * ufl.inner(u, v) * ufl.dx,
    )
    system = fem.assemble(mesh, forms=string, clamped=[tags["left"], tags["right"]])
    h, k, c2 = length / n, np.pi / length, tension / line
    lattice = np.sqrt(6.0 * c2 / h**2 * (1.0 - np.cos(k * h)) / (2.0 + np.cos(k * h))) / (
        2.0 * np.pi
    )
    found = lowest_frequency(system)
    assert found == pytest.approx(lattice, rel=1e-10)
    assert found == pytest.approx(np.sqrt(c2) / (2.0 * length), rel=5e-3)


@pytest.mark.serial
def test_a_prestressed_beam_in_shear(comm: Any) -> None:
    """nu = 0, sigma_xx = s0 for a start: w² = k² (G + s0)/rho of u_y = sin(pi x/L), on the lattice;
    sides tied.

    And K + K_G of the package, its s0 from a static stage, has the same frequency."""
    n, length, G, s0, rho = 12, 4.0, 2.0e6, 1.5e6, 1000.0
    material = LinearElastic(E=2.0 * G, nu=0.0, rho=rho)
    mesh, tags = block(comm, lengths=(length, 0.5), divisions=(n, 2))
    forms = isotropic(mesh, material, PlaneStrain())
    along = ufl.as_vector([1.0, 0.0])

    def stiffness(u: Any, v: Any) -> Any:
        initial = ufl.outer(compat.constant(mesh, s0) * along, along)
        return (
            forms.stiffness(u, v) + ufl.inner(ufl.dot(ufl.grad(u), initial), ufl.grad(v)) * ufl.dx
        )

    tied = fem.Tied(tags["bottom"], tags["top"])
    ends = [tags["left"], tags["right"]]
    system = fem.assemble(mesh, forms=replace(forms, stiffness=stiffness), clamped=ends, tied=tied)
    h, k = length / n, np.pi / length
    lattice = np.sqrt(
        6.0 * (G + s0) / rho / h**2 * (1.0 - np.cos(k * h)) / (2.0 + np.cos(k * h))
    ) / (2.0 * np.pi)
    assert lowest_frequency(system) == pytest.approx(lattice, rel=1e-10)
    strain = s0 / (2.0 * G)
    pulled = fem.Prescribed(
        tags["right"], lambda x, t: np.column_stack([strain * x[:, 0], 0.0 * x[:, 0]])
    )
    plain = fem.assemble(mesh, forms=forms, clamped=tags["left"], prescribed=pulled, tied=tied)
    problem = linear(plain)
    stiffer = geometric_stiffness(problem, vc.static_equilibrium(problem))
    assert lowest_frequency(stiffer) == pytest.approx(lattice, rel=1e-9)


@pytest.mark.two_ranks
def test_springs_on_a_side_and_a_measure_of_ones_own(comm: Any) -> None:
    """A Winkler bed k on the base of a rigid-like block: u = -p/k there, and K holds the body."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    bed = compat.measure(mesh, 1, tags["bottom"].indices)
    k = compat.constant(mesh, 3.0e7)
    forms = isotropic(mesh, replace(CONCRETE, nu=0.0), PlaneStrain())
    springs = replace(
        forms, stiffness=lambda u, v: forms.stiffness(u, v) + k * ufl.inner(u, v) * bed
    )
    system = fem.assemble(mesh, forms=springs, loads=fem.Traction(tags["top"], (0.0, -6.0e5)))
    points, u = field(system, vc.static_equilibrium(linear(system)).u)
    exact = -6.0e5 / 3.0e7 - 6.0e5 / CONCRETE.E * points[:, 1]
    assert np.abs(u[:, 1] - exact).max() < 1e-11 * np.abs(exact).max()


# Contact
# --------------------------------------------------------------------------------------------------

WOOD = {
    "E1": 2.0e6,
    "E2": 0.8e6,
    "E3": 1.0e6,
    "nu12": 0.3,
    "nu13": 0.2,
    "nu23": 0.25,
    "G12": 0.3e6,
    "G13": 0.3e6,
    "G23": 0.3e6,
    "rho": 1000.0,
    "axes": 0.5,
}


def orthotropic(mesh: Any, **more: Any) -> Forms:
    """The stiffness of plane strain written out with the matrix of the law."""
    C = vc.Orthotropic(**WOOD).matrix(PlaneStrain(), 2)[:3]

    def flat(u: Any) -> Any:
        return ufl.as_vector([eps(u)[0, 0], eps(u)[1, 1], 2 * eps(u)[0, 1]])

    return Forms(
        **{
            "stiffness": lambda u, v: (
                ufl.inner(ufl.dot(ufl.as_matrix(C.tolist()), flat(u)), flat(v)) * ufl.dx
            ),
            "mass": lambda u, v: 1000.0 * ufl.inner(u, v) * ufl.dx,
            **more,
        }
    )


def thrown(comm: Any, *material: Any, **body: Any) -> vc.ContactProblem:
    """A rectangle thrown obliquely onto the ground, with friction."""
    mesh, tags = block(comm, lengths=(1.5, 1.0), divisions=(5, 4), simplices=True)
    given = {name: one(mesh) if name == "forms" else one for name, one in body.items()}
    system = fem.assemble(mesh, *material, **given, initial_velocity=(0.5, -2.0))
    ground = vc.HalfSpace(point=(0.0, -2e-3), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    return vc.ContactProblem(with_weight(system), surface, friction=vc.Coulomb(0.4))


@pytest.mark.long
def test_a_thrown_body_stated_by_forms(comm: Any, shared_tmp: Path) -> None:
    """Step by step that of the material; certified to 1e-9, the energy ledger closed; no von Mises
    stress in its fields where no stress is told, and pictures know of it."""
    rows: dict[str, list[Any]] = {}
    for name, problem in (
        ("law", thrown(comm, vc.Orthotropic(**WOOD))),
        ("forms", thrown(comm, forms=orthotropic)),
    ):
        rows[name], scheme, total = [], vc.ZienkiewiczWoodTaylor(), 0.0
        for state, report in vc.march(
            problem, scheme=scheme, solver=vc.Condensed(), dt=1e-3, steps=60
        ):
            ledger = energy_balance(problem, report.old, report.new, report.balance)
            total += abs(ledger.defect)
            assert report.certificate.worst <= 1e-9
            rows[name].append(np.append(problem.surface.everywhere(state.r_n), total))
        kinetic = problem.system.kinetic_energy(problem.system.v0)
        assert total < 1e-11 * kinetic
        assert np.max(rows[name]) > 0.0
    law, forms = (np.array(rows[name])[:, :-1] for name in ("law", "forms"))
    assert np.abs(law - forms).max() < 1e-9 * law.max()
    problem = thrown(comm, forms=orthotropic)
    vc.simulate(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(),
        dt=1e-3,
        steps=2,
        out=shared_tmp / "run",
        fields=XDMF(every=1),
    )
    stress = read_frames(shared_tmp / "run").at(1.0)[2]
    assert len(stress) == 40 and np.all(np.isnan(stress))
    assert (
        "the body is stated by forms: its mass by a form, its stress by no form"
        in problem.system.notes[0]
    )


def leaning(comm: Any) -> tuple[Any, Any]:
    """A block pressed and pushed on its foundation, K with a skew part: (problem, what pushes
    it)."""
    mesh, tags = block(comm, lengths=(1.5, 1.0), divisions=(6, 4))
    forms = isotropic(mesh, LinearElastic(1e6, 0.3, 1000.0), PlaneStrain())

    def stiffness(u: Any, v: Any) -> Any:
        return forms.stiffness(u, v) + 2e5 * (u[0].dx(1) * v[1] - u[1] * v[0].dx(1)) * ufl.dx

    push = fem.Traction(tags["top"], (3e4, 1e4))
    system = fem.assemble(
        mesh, forms=replace(forms, stiffness=stiffness), clamped=tags["right"], loads=push
    )
    ground = vc.HalfSpace(point=(0.0, -5e-3), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    return vc.ContactProblem(system, surface, mass=ConsistentMass()), push


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.promise("guide/solvers.md", "Both agree to 1e-8 on a block whose stiffness")
def test_stiffness_that_is_not_symmetric(comm: Any) -> None:
    """Both methods of the volume route and Lemke's agree, statically, certified and partly open,
    and in dynamics; reactions are rows of K u - f; routes that need symmetry say so, as does the
    log of a run."""
    problem, push = leaning(comm)
    assert problem.system.algebra.symmetric is False and "not symmetric" in problem.system.notes[1]
    solvers = (Volume(ReducedNewton()), Volume(SemismoothNewton()), vc.Condensed(Lemke()))
    states = [vc.static_equilibrium(problem, solver=solver) for solver in solvers]
    r_n = problem.surface.everywhere(states[0].r_n)
    assert 0 < np.count_nonzero(r_n) < len(r_n)
    for other in states[1:]:
        assert max_over_ranks(comm, states[0].u - other.u) < 1e-9 * max_over_ranks(
            comm, states[0].u
        )
    K = dense(comm, problem.system, problem.system.K)
    assert np.abs(K - K.T).max() > 0.01 * np.abs(K).max()
    left = problem.turned.K @ states[0].u - problem.turned.load.at_rest(0.0)
    left += problem.surface.reaction_load(states[0].r_n, len(left))
    assert max_over_ranks(comm, left) < 1e-9 * max_over_ranks(
        comm, problem.turned.load.at_rest(0.0)
    )
    space = problem.system.space
    held = space.prescribed[0].facets
    reactions = vc.Reactions("right", held, (0.0, 0.0), loads=push).start(problem, states[0])
    whole = PetscMatrix(compat.assemble_matrix(compat.compile_form(space.forms.bilinear("K"))))
    force = whole @ space.expand(problem.cartesian(states[0].u), 0.0).ravel()
    force -= fem.assemble(space.mesh, CONCRETE, loads=push).load(0.0)
    sums = space.comm.sum(np.where(space.held, force.reshape(-1, 2), 0.0).sum(axis=0))
    assert [reactions["reaction_x_right"], reactions["reaction_y_right"]] == pytest.approx(
        sums, rel=1e-10
    )
    for solver in (None, vc.Condensed(), vc.Iterative(), Volume(TaoTron())):
        with pytest.raises(
            InputError, match="needs symmetric matrices and those of the system are not"
        ):
            vc.static_equilibrium(problem, solver=solver)
    for mass, scheme in ((ConsistentMass(), vc.Midpoint()), (Redistributed(), vc.Trapezoidal())):
        shaken = replace(problem, mass=mass)
        for one in (shaken, replace(shaken, friction=vc.Coulomb(0.3))):
            runs = []
            for solver in (Volume(), vc.Condensed(Lemke())):
                found = [
                    report
                    for _, report in vc.march(one, scheme=scheme, solver=solver, dt=8e-3, steps=9)
                ]
                assert len(found) == 9 and max(report.certificate.worst for report in found) <= 1e-9
                runs.append(
                    [
                        np.array([(report.new.u, report.new.r_n)[k] for report in found])
                        for k in range(2)
                    ]
                )
            for volume, condensed in zip(*runs, strict=True):
                assert (
                    0.0
                    <= max_over_ranks(comm, volume - condensed)
                    < 1e-8 * max_over_ranks(comm, volume)
                )


@pytest.mark.two_ranks
def test_a_restart_sees_the_sense_of_a_skew_damping(comm: Any) -> None:
    """wᵀCw of a skew C is zero: C, 2 C and -C are three runs, and C is C."""
    mesh, _ = block(comm, **BODIES["triangles"])

    def facts(spin: float) -> Any:
        own = replace(
            isotropic(mesh), damping=lambda u, v: spin * (u[0] * v[1] - u[1] * v[0]) * ufl.dx
        )
        return identify(
            linear(fem.assemble(mesh, forms=own)), vc.Midpoint(), 1e-3, start=0.0, end=1e-2
        )

    first = facts(3e3)
    assert find_differences(first, facts(3e3)) == {}
    for other in (-3e3, 6e3):
        assert find_differences(first, facts(other)) == {"damping": "another damping"}


@pytest.mark.serial
def test_gyroscopic_damping_takes_no_energy(comm: Any) -> None:
    """A block on springs k per volume in a frame that turns with W, C skew: z'' + 2iW z' + (k/rho)
    z = 0 of z = x + iy, so that z = v0 (exp(iat) - exp(ibt)) / (i (a - b)), a, b = -W ± sqrt(W² +
    k/rho); the midpoint rule has the phases 2 arctan(a dt/2). In contact the energy ledger is
    closed, for such a C does no work."""
    mesh, tags = block(comm, lengths=(1.5, 1.0), divisions=(3, 2), simplices=True)
    forms, rho, W, k, dt = (
        isotropic(mesh, LinearElastic(1e6, 0.3, 1000.0), PlaneStrain()),
        1000.0,
        3.0,
        4.0e4,
        5e-3,
    )

    def bedded(u: Any, v: Any) -> Any:
        return forms.stiffness(u, v) + k * ufl.inner(u, v) * ufl.dx

    def turning(u: Any, v: Any) -> Any:
        return 2.0 * W * rho * (u[0] * v[1] - u[1] * v[0]) * ufl.dx

    given = replace(forms, stiffness=bedded, damping=turning)
    system = fem.assemble(mesh, forms=given, initial_velocity=(0.3, -2.0))
    assert not system.algebra.symmetric and not system.floating
    steps = 40
    for state, _ in vc.march(
        linear(system), scheme=vc.Midpoint(), solver=Volume(), dt=dt, steps=steps
    ):
        last = state
    a, b = -W + np.sqrt(W**2 + k / rho), -W - np.sqrt(W**2 + k / rho)
    z = np.exp([2j * steps * np.arctan(0.5 * dt * one) for one in (a, b)]) @ [1.0, -1.0]
    z *= complex(0.3, -2.0) / (1j * (a - b))
    assert max_over_ranks(comm, last.u - system.influence @ [z.real, z.imag]) < 1e-10 * abs(z)
    ground = vc.HalfSpace(point=(0.0, -2e-3), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    problem, defect, struck = vc.ContactProblem(system, surface, mass=ConsistentMass()), 0.0, 0.0
    for state, report in vc.march(
        problem, scheme=vc.ZienkiewiczWoodTaylor(), solver=Volume(), dt=1e-3, steps=20
    ):
        defect += abs(energy_balance(problem, report.old, report.new, report.balance).defect)
        struck = max(struck, max_over_ranks(comm, state.r_n))
        assert report.certificate.worst <= 1e-9
    assert struck > 0.0 and defect < 1e-11 * system.kinetic_energy(system.v0)


# Misuse and outputs that need a material
# ------------------------------------------------------------------------------


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "wrong, words",
    [
        (
            {"stiffness": lambda u: u},
            "Forms: stiffness cannot be called with .u, v., too many positional arguments",
        ),
        ({"mass": 2400.0}, "Forms: mass is 2400.0; give a function of u and v"),
        (
            {"stress": lambda u, v: u},
            "Forms: stress cannot be called with .u., missing a required argument",
        ),
    ],
)
def test_what_is_no_form_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Forms(**{"stiffness": lambda u, v: u, **wrong})


@pytest.mark.two_ranks
def test_forms_that_cannot_be_a_body(comm: Any) -> None:
    mesh, _ = block(comm, **BODIES["quadrilaterals"])
    other, _ = block(comm, **BODIES["triangles"])
    good, away = isotropic(mesh), compat.function(compat.cell_space(other))
    nan = compat.constant(mesh, float("nan"))
    for wrong, words in (
        (
            {"stiffness": lambda u, v: ufl.inner(eps(u), eps(v))},
            "stiffness: what it returns .*; return an integral",
        ),
        (
            {"stiffness": lambda u, v: ufl.inner(u, u) * ufl.inner(u, v) * ufl.dx},
            "is not linear in u or in v",
        ),
        (
            {"stiffness": lambda u, v: v[0] * ufl.dx},
            "stiffness is not a form in the given trial and test functions",
        ),
        ({"stiffness": lambda u, v: u[5] * v[0] * ufl.dx}, "Forms: stiffness ended in"),
        (
            {"stiffness": lambda u, v: away * ufl.inner(u, v) * ufl.dx(domain=mesh)},
            "stiffness is of another mesh",
        ),
        (
            {"stiffness": lambda u, v: nan * good.stiffness(u, v)},
            "stiffness has NaN or infinite entries",
        ),
        ({"mass": lambda u, v: -good.mass(u, v)}, "mass is not positive"),  # type: ignore[misc]
        ({"mass": lambda u, v: u[0] * v[0] * ufl.dx}, "mass is not positive"),
        (
            {"mass": lambda u, v: ufl.inner(u, v) * ufl.dx + u[0] * v[1] * ufl.dx},
            "mass is not symmetric",
        ),
        (
            {"stress": lambda u: ufl.tr(eps(u))},
            r"stress has shape \(\); return a tensor of shape \(2, 2\)",
        ),
    ):
        with pytest.raises(InputError, match=words):
            fem.assemble(mesh, forms=replace(good, **wrong))
    for data, words in (
        ({}, "neither a material nor forms"),
        ({"forms": "mine"}, "forms is 'mine'; give fem.Forms"),
        ({"forms": good, "damping": MassProportional(1.0)}, "needs the density of a material"),
    ):
        with pytest.raises(InputError, match=words):
            fem.assemble(mesh, **data)


def test_facets_between_ranks_need_ghosts(comm: Any) -> None:
    """u = (|x - 1|, 0) has a kink of 2 on a line of length 1.5: ∫ jump·jump dS = 6; without ghosts
    one sentence."""

    def jumps(u: Any, v: Any) -> Any:
        return ufl.inner(ufl.jump(ufl.grad(u)), ufl.jump(ufl.grad(v))) * ufl.dS

    for ghosts in ("shared_facet", "none"):
        mesh = own_mesh(comm, "triangle", ghosts, times=2)
        given = Forms(mass=lambda u, v: ufl.inner(u, v) * ufl.dx, stiffness=jumps)
        if ghosts == "none" and comm.size > 1:
            said = refusal(comm, lambda: fem.assemble(mesh, forms=given))  # noqa: B023
            assert (
                "stiffness integrates over interior facets (dS), which on several ranks needs a "
                "mesh with" in said
            )
            continue
        system = fem.assemble(mesh, forms=given)
        u = np.column_stack(
            [np.abs(system.space.points[:, 0] - 1.0), 0.0 * system.space.points[:, 0]]
        )
        assert 2.0 * system.strain_energy(u.ravel()) == pytest.approx(6.0, rel=1e-10)


@pytest.mark.two_ranks
def test_von_mises_without_sigma_zz_is_noted(comm: Any) -> None:
    mesh, _ = block(comm, **BODIES["triangles"])
    for section, shape, noted in (
        (PlaneStrain(), 2, True),
        (PlaneStrain(), 3, False),
        (PlaneStress(), 2, False),
    ):
        given = replace(
            isotropic(mesh), stress=lambda u, k=shape: ufl.grad(u)[0, 0] * ufl.Identity(k)
        )
        notes = fem.assemble(mesh, forms=given, section=section).notes
        assert (
            any("take sigma_zz as zero: give a stress of shape (3, 3)" in one for one in notes)
            is noted
        )


@pytest.mark.two_ranks
def test_complex_numbers_are_refused(comm: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, _ = block(comm, **BODIES["bar"])
    monkeypatch.setattr(PETSc, "ScalarType", np.complex128)
    with pytest.raises(InputError, match="this PETSc computes with complex numbers"):
        fem.assemble(mesh, CONCRETE)


@pytest.mark.two_ranks
def test_outputs_that_need_a_material(comm: Any) -> None:
    """Stresses ask for the form of stress; dashpots and free fields for a material, and take it
    from beside the forms; a cut through elements for their density."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    forms, low = isotropic(mesh, section=PlaneStrain()), {"clamped": tags["bottom"]}
    mute = fem.assemble(mesh, forms=replace(forms, stress=None), **low)
    state = vc.static_equilibrium(linear(mute))
    with pytest.raises(InputError, match="have no stress: give fem.Forms"):
        geometric_stiffness(linear(mute), state)
    with pytest.raises(InputError, match="have no stress: give fem.Forms"):
        fem.as_function(linear(mute), state, "stress")
    side = tags["left"]
    for boundary in (fem.Dashpots(side), soil.FreeField(side, base=())):
        with pytest.raises(InputError, match="on 'left' need a density and wave speeds"):
            fem.assemble(mesh, forms=forms, dashpots=boundary, **low)
        ours = fem.assemble(mesh, CONCRETE, forms=forms, dashpots=boundary, **low)
        same(comm, ours, fem.assemble(mesh, CONCRETE, dashpots=boundary, **low))
    with pytest.raises(InputError, match="its column is of materials, and forms=… have none"):
        fem.assemble(
            mesh, forms=forms, dashpots=soil.FreeField(side, base=(), material=CONCRETE), **low
        )
    oblique = vc.SectionForces({"cut": ((0.0, 0.8), (2.0, 0.9))}, gravity=(0.0, -9.80665))
    for data in ({"forms": forms}, {"forms": replace(forms, mass=None)}, {}):
        problem = linear(
            with_weight(
                fem.assemble(
                    mesh,
                    *(
                        [CONCRETE]
                        if len(data) == 0 or "mass" and data["forms"].mass is None
                        else []
                    ),
                    **data,
                    **low,
                )
            )
        )
        start = vc.static_equilibrium(problem)
        if data and data["forms"].mass is not None:
            with pytest.raises(InputError, match="with forms=… the mass of their parts is unknown"):
                oblique.start(problem, start)
            continue
        weight = CONCRETE.rho * 9.80665 * 2.0 * (1.5 - 0.85)
        row = oblique.start(problem, start)
        n = np.array([-0.05, 1.0]) / np.hypot(0.05, 1.0)
        assert row["N_cut"] * n[1] + row["V_cut"] * n[1] * 0.05 == pytest.approx(-weight, rel=1e-10)


def test_release_and_weight_of_a_body_stated_by_forms(comm: Any) -> None:
    """A gravity stage on rollers, released onto dashpots of a material: nothing moves."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    forms, soft = isotropic(mesh, section=PlaneStrain()), LinearElastic(1e8, 0.2, 1800.0)
    rollers = fem.Prescribed(tags["left"], components=(0,))
    static = linear(
        with_weight(fem.assemble(mesh, forms=forms, clamped=tags["bottom"], prescribed=rollers))
    )
    after = fem.assemble(
        mesh, forms=forms, clamped=tags["bottom"], dashpots=fem.Dashpots(tags["left"], soft)
    )
    problem, start = fem.release(static, vc.static_equilibrium(static), linear(with_weight(after)))
    for state, _ in vc.march(
        problem, scheme=vc.Midpoint(), solver=vc.Condensed(), dt=1e-3, steps=5, state=start
    ):
        assert max_over_ranks(comm, state.u - start.u) < 1e-12 * max_over_ranks(comm, start.u)
