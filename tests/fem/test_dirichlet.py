"""Dirichlet data as dirichletbc objects: equal to clamped and Prescribed in everything, and what is
refused."""

from __future__ import annotations

from typing import Any

import dolfinx.fem as dfem
import dolfinx.mesh
import numpy as np
import pytest
import ufl
from fem_problems import CONCRETE, field, max_over_ranks
from mesh_tools import refusal
from mpi4py import MPI
from own_meshes import OWN, at, own_mesh

from demos.parts.problems.geometric_stiffness import geometric_stiffness
from vi_contact import fem
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem import compat
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.materials import Rayleigh
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

COMM = MPI.COMM_WORLD
cells = pytest.mark.parametrize("cell", OWN)


def on(V: Any, marker: Any) -> Any:
    """The unknowns of V, or V.sub(i), on facets of the boundary."""
    facets = fem.Facets.where("there", V.mesh, marker)
    return dfem.locate_dofs_topological(V, V.mesh.topology.dim - 1, facets.indices)


def constant(mesh: Any, value: Any) -> Any:
    return dfem.Constant(mesh, value)


def on_all_components(values: Any) -> Any:
    """Values as dirichletbc takes them on V: since DOLFINx 0.11 a number where V has one
    component."""
    return (
        float(values[0]) if len(values) == 1 and compat.VERSION >= (0, 11) else np.asarray(values)
    )


def same(one: Any, other: Any) -> None:
    """Two systems: unknowns, matrices on a vector, loads, influence, initial state, and whether
    they float."""
    assert one.space.unknowns == other.space.unknowns and one.floating == other.floating
    assert np.array_equal(one.space.ids, other.space.ids)
    x = np.cos(np.asarray(one.space.ids, dtype=float))
    pairs = [
        (getattr(one, name) @ x, getattr(other, name) @ x)
        for name in "MK" + "C" * (one.C is not None)
    ]
    pairs += [
        (one.load(0.3), other.load(0.3)),
        (one.influence, other.influence),
        (one.base_mass, other.base_mass),
    ]
    pairs.append((one.space.expand(x, 0.2), other.space.expand(x, 0.2)))
    for mine, theirs in pairs:
        assert max_over_ranks(COMM, mine - theirs) <= 1e-13 * max_over_ranks(COMM, theirs)


@cells
@pytest.mark.parametrize("degree", [1, 2])
def test_conditions_are_those_of_prescribed(cell, degree):
    """On V and on each V.sub(i): arrays, Constants, Functions; with the user's space, without, with
    another alike."""
    mesh = own_mesh(COMM, cell)
    d = mesh.geometry.dim
    V, alike = compat.vector_space(mesh, degree), compat.vector_space(mesh, degree)
    base, face = (
        fem.Facets.where(name, mesh, at(0, x)) for name, x in (("base", 0.0), ("face", 2.0))
    )
    shift, stretched = 1e-4 * np.arange(1.0, d + 1.0), dfem.Function(V)
    stretched.interpolate(lambda x: 1e-4 * x[:d])
    clamped = dfem.dirichletbc(on_all_components(np.zeros(d)), on(V, at(0, 0.0)), V)
    shifted = dfem.dirichletbc(constant(mesh, on_all_components(shift)), on(V, at(0, 2.0)), V)
    part = V.sub(d - 1) if d > 1 else V
    last = shift[-1] if d > 1 else on_all_components(shift)
    rolled = dfem.dirichletbc(constant(mesh, last), on(part, at(0, 2.0)), part)
    by_hand = {
        "clamped": ({"clamped": base}, [clamped]),
        "shifted": (
            {"clamped": base, "prescribed": fem.Prescribed(face, lambda x, t: 0.0 * x + shift)},
            [clamped, shifted],
        ),
        "stretched": (
            {"prescribed": fem.Prescribed(face, lambda x, t: 1e-4 * x)},
            [dfem.dirichletbc(stretched, on(V, at(0, 2.0)))],
        ),
        "rolled": (
            {"prescribed": fem.Prescribed(face, lambda x, t: 0.0 * x + shift, components=(d - 1,))},
            [rolled],
        ),
    }
    loads = fem.BodyForce(tuple(1e4 * np.arange(1.0, d + 1.0)))
    spaces: list[dict[str, Any]] = [{"space": V}, {}, {"space": alike}, {"space": V}]
    for (name, (data, bcs)), given in zip(by_hand.items(), spaces, strict=True):
        expected = fem.assemble(
            mesh, CONCRETE, degree=degree, loads=loads, damping=Rayleigh(1.0, 1e-5), **data
        )
        system = fem.assemble(
            mesh, CONCRETE, loads=loads, damping=Rayleigh(1.0, 1e-5), bcs=bcs, **given
        )
        assert system.space.degree == degree and (
            system.space.V is given["space"] if given else True
        ), name
        same(system, expected)


@cells
def test_contact_beside_them(cell):
    """Impacts, ledger, reactions and a static stage of a body that is held and rolled by
    dirichletbc or by hand."""
    mesh = own_mesh(COMM, cell)
    d = mesh.geometry.dim
    V = compat.vector_space(mesh)
    base, face = (
        fem.Facets.where(name, mesh, at(0, x)) for name, x in (("base", 0.0), ("face", 2.0))
    )
    push = 2e-5 * np.eye(d)[0]

    def histories(**data: Any) -> tuple[Any, Any]:
        system = fem.assemble(mesh, CONCRETE, **data)
        wall = HalfSpace(point=tuple(2.00001 * np.eye(d)[0]), normal=tuple(-np.eye(d)[0]))
        shake = Harmonic(300.0, 300.0, direction=tuple(np.eye(d)[0]))
        problem = ContactProblem(
            system, fem.contact_surface(system, face, obstacle=wall), excitation=shake
        )
        state = static_equilibrium(ContactProblem(system, problem.surface), tolerance=1e-9)
        feet = fem.Reactions("base", base, centre=(0.0,) * d)
        run = simulate(
            problem,
            scheme=ZienkiewiczWoodTaylor(),
            dt=2e-4,
            steps=20,
            record=[Energy(), Contact(), feet],
            progress=False,
        )
        return run.history, problem.surface.everywhere(state.r_n)

    moved = fem.Prescribed(base, lambda x, t: 0.0 * x + push)
    sides = (
        [fem.Prescribed(fem.Facets.where("side", mesh, at(d - 1, 0.0)), components=(d - 1,))]
        if d > 1
        else []
    )
    bcs = [dfem.dirichletbc(on_all_components(push), on(V, at(0, 0.0)), V)]
    if d > 1:
        part = V.sub(d - 1)
        bcs.insert(
            0, dfem.dirichletbc(compat.PETSc.ScalarType(0.0), on(part, at(d - 1, 0.0)), part)
        )
    expected, pressure = histories(prescribed=[*sides, moved])
    found, same_pressure = histories(bcs=bcs, space=V)
    assert np.ptp(expected["contact_active"]) > 0
    assert pressure.max() > 0.0 and np.abs(same_pressure - pressure).max() < 1e-9 * pressure.max()
    for name in ("contact_resultant", "energy_kinetic", "energy_strain", "reaction_x_base"):
        assert np.abs(found[name] - expected[name]).max() < 1e-9 * np.abs(expected[name]).max(), (
            name
        )


def test_where_conditions_meet_the_last_one_counts():
    """Beside clamped and Prescribed, among themselves, and on tied boundaries; values are those at
    assembly."""
    mesh = own_mesh(COMM, "quadrilateral")
    V, value = compat.vector_space(mesh), constant(mesh, (1e-4, 2e-4))
    left = fem.Facets.where("left", mesh, at(0, 0.0))
    bottom = dfem.dirichletbc(value, on(V, at(1, 0.0)), V)
    top = dfem.dirichletbc(np.zeros(2), on(V, at(1, 0.0)), V)
    system = fem.assemble(mesh, CONCRETE, clamped=left, bcs=bottom)
    value.value = (5.0, 5.0)
    points, u = field(system, system.u0)
    assert np.array_equal(u[points[:, 1] == 0.0], np.tile([1e-4, 2e-4], (6, 1)))
    assert not u[(points[:, 0] == 0.0) & (points[:, 1] > 0.0)].any()
    value.value = (1e-4, 2e-4)
    system = fem.assemble(mesh, CONCRETE, bcs=[bottom, top])
    assert not field(system, system.u0)[1].any()
    right = fem.Facets.where("right", mesh, at(0, 2.0))
    said = refusal(
        COMM,
        lambda: fem.assemble(
            mesh,
            CONCRETE,
            tied=fem.Tied(left, right),
            bcs=[dfem.dirichletbc(np.zeros(2), on(V, at(0, 0.0)), V)],
        ),
    )
    assert "of a tied node is prescribed on one side only" in said
    held = [
        dfem.dirichletbc(
            np.zeros(2), on(V, lambda x: np.isclose(x[0], 0.0) | np.isclose(x[0], 2.0)), V
        )
    ]
    assert (
        fem.assemble(mesh, CONCRETE, tied=fem.Tied(left, right), bcs=held).space.unknowns
        == 2 * 5 * 4
    )


@pytest.mark.two_ranks
def test_floating_bodies_and_contact_nodes():
    """One roller leaves a body floating, as Prescribed does; clamped contact nodes are left out."""
    mesh = own_mesh(COMM, "triangle")
    V = compat.vector_space(mesh)
    part = V.sub(0)
    roller = dfem.dirichletbc(compat.PETSc.ScalarType(0.0), on(part, at(0, 0.0)), part)
    assert fem.assemble(mesh, CONCRETE, bcs=roller).floating
    other = dfem.dirichletbc(compat.PETSc.ScalarType(0.0), on(V.sub(1), at(1, 0.0)), V.sub(1))
    assert not fem.assemble(mesh, CONCRETE, bcs=[roller, other]).floating
    base = dfem.dirichletbc(np.zeros(2), on(V, at(0, 0.0)), V)
    system = fem.assemble(mesh, CONCRETE, bcs=[base])
    surface = fem.contact_surface(system, fem.Facets.where("bottom", mesh, at(1, 0.0)))
    assert surface.total == 5 and surface.everywhere(surface.points)[:, 0].min() > 0.0


@pytest.mark.two_ranks
def test_what_is_refused():
    """One sentence on all ranks for each."""
    mesh, other = own_mesh(COMM, "triangle"), own_mesh(COMM, "triangle")
    V, W = compat.vector_space(mesh), compat.vector_space(other)
    make = compat.fem.functionspace if compat.VERSION >= (0, 7) else compat.fem.FunctionSpace
    scalar, second = make(mesh, ("Lagrange", 1)), compat.vector_space(mesh, 2)

    def said(*bcs: Any, **more: Any) -> str:
        return refusal(COMM, lambda: fem.assemble(mesh, CONCRETE, bcs=list(bcs), **more))

    def clamped(space: Any, marker: Any = at(0, 0.0)) -> Any:
        return dfem.dirichletbc(dfem.Function(space), on(space, marker))

    remedy = (
        "give dirichletbc(value, dofs, V) on the vector-valued Lagrange space V of this mesh, "
        "or on V.sub(i)"
    )
    assert said(clamped(W)) == f"assemble: a dirichletbc of bcs is on another mesh; {remedy}"
    assert (
        said(clamped(scalar))
        == f"assemble: a dirichletbc of bcs is on a space of another kind; {remedy}"
    )
    assert (
        said(clamped(second), space=V)
        == f"assemble: bcs[0] is on another space than the displacement's; {remedy}"
    )
    assert "bcs[1] is on another space" in said(clamped(V), clamped(scalar))
    assert remedy in said((0, 1)) and remedy in said("clamped")
    nothing = dfem.dirichletbc(np.zeros(2), np.zeros(0, dtype=np.int32), V)
    assert "bcs[0] prescribes no unknown on any rank; check how its dofs were located" in said(
        nothing
    )
    missing = dfem.dirichletbc(np.array([0.0, np.nan]), on(V, at(0, 0.0)), V)
    assert "bcs[0] has NaN or infinite values" in said(missing)
    assert "space is on another mesh; give a space on this one" in said(space=W)
    assert "give a DOLFINx function space, or None" in said(space="P1")
    for wrong in (scalar, make(mesh, ("DG", 0)), V.sub(0)):
        assert "give the Lagrange space of degree 1 or 2 with 2 components" in said(space=wrong)
    base = fem.Facets.where("base", mesh, at(0, 0.0))
    shifted = dfem.dirichletbc(np.array([1e-4, 0.0]), on(V, at(0, 0.0)), V)
    assert "bcs[0] and what is prescribed on 'base' differ at an unknown of both" in said(
        shifted, clamped=base
    )
    fem.assemble(mesh, CONCRETE, bcs=[clamped(V)], clamped=base)
    rates = (np.sin, np.cos, lambda t: -np.sin(t))
    swing = fem.Prescribed(base, *(lambda x, t, f=f: 0.0 * x + 1e-3 * f(t) for f in rates))
    assert "bcs[0] and what is prescribed on 'base' differ at an unknown" in said(
        clamped(V), prescribed=swing
    )
    fem.assemble(mesh, CONCRETE, bcs=[clamped(V, at(1, 0.0))], prescribed=swing)
    still = fem.Prescribed(base, (1e-4, 0.0))
    fem.assemble(mesh, CONCRETE, bcs=[shifted], prescribed=still)
    damped = said(clamped(V), dashpots=fem.Dashpots(base))
    assert "boundary 'base' has dashpots in a direction that is prescribed on 'bcs[0]'" in damped
    fem.assemble(mesh, CONCRETE, bcs=[clamped(V, at(1, 0.0))], dashpots=fem.Dashpots(base))


@pytest.mark.skipif(COMM.size == 1, reason="one rank has one list")
def test_lists_that_differ_between_ranks_are_refused():
    """A condition that the last rank leaves out would keep the others waiting."""
    mesh = own_mesh(COMM, "triangle")
    V = compat.vector_space(mesh)
    bcs = [dfem.dirichletbc(dfem.Function(V), on(V, at(0, x))) for x in (0.0, 2.0)]
    given = bcs[: 1 if COMM.rank == COMM.size - 1 else 2]
    assert refusal(COMM, lambda: fem.assemble(mesh, CONCRETE, bcs=given)) == (
        "assemble: bcs has 2 items on one rank and 1 on another; give all ranks the same list, "
        "also where a rank has none of its unknowns"
    )


@pytest.mark.two_ranks
def test_own_forms_beside_own_conditions():
    """The whole problem in the user's own words: V, forms, load and conditions; equal to the usual
    route."""
    mesh = own_mesh(COMM, "triangle")
    V = compat.vector_space(mesh)
    lame, shear = CONCRETE.lame_lambda, CONCRETE.E / (2.0 * (1.0 + CONCRETE.nu))

    def stress(u: Any) -> Any:
        return lame * ufl.div(u) * ufl.Identity(2) + 2.0 * shear * ufl.sym(ufl.grad(u))

    forms = fem.Forms(
        mass=lambda u, v: CONCRETE.rho * ufl.inner(u, v) * ufl.dx,
        stiffness=lambda u, v: ufl.inner(stress(u), ufl.sym(ufl.grad(v))) * ufl.dx,
    )
    f = constant(mesh, (0.0, -2e4))
    system = fem.assemble(
        mesh,
        forms=forms,
        space=V,
        bcs=[dfem.dirichletbc(np.zeros(2), on(V, at(0, 0.0)), V)],
        loads=fem.LinearForm(lambda v: ufl.inner(f, v) * ufl.dx),
    )
    base = fem.Facets.where("base", mesh, at(0, 0.0))
    same(system, fem.assemble(mesh, CONCRETE, clamped=base, loads=fem.BodyForce((0.0, -2e4))))


@pytest.mark.two_ranks
def test_stages_and_functions_beside_them():
    """Supports released after a static stage, stiffness of its stresses, u on the user's own space;
    a unit square."""
    mesh = dolfinx.mesh.create_unit_square(COMM, 4, 3)
    V, push = compat.vector_space(mesh), np.array([1e-5, 0.0])
    side = fem.Facets.where("left", mesh, at(0, 0.0))
    part = V.sub(0)
    both = dfem.dirichletbc(push, on(V, at(0, 0.0)), V)
    one = dfem.dirichletbc(compat.PETSc.ScalarType(push[0]), on(part, at(0, 0.0)), part)

    def stages(held: dict[str, Any], free: dict[str, Any]) -> tuple[Any, Any, Any]:
        problems = []
        for data in (held, free):
            system = fem.assemble(mesh, CONCRETE, loads=fem.BodyForce((1e4, -1e4)), **data)
            wall = HalfSpace(point=(1.000005, 0.0), normal=(-1.0, 0.0))
            surface = fem.contact_surface(
                system, fem.Facets.where("right", mesh, at(0, 1.0)), obstacle=wall
            )
            problems.append(ContactProblem(system, surface))
        state = static_equilibrium(problems[0], tolerance=1e-9)
        assert problems[0].surface.everywhere(state.r_n).max() > 0.0
        u = fem.as_function(problems[0], state, "u")
        stiffer = geometric_stiffness(problems[0], state)
        return (
            fem.release(problems[0], state, problems[1])[0].system.load(0.0),
            stiffer.load(0.0),
            u,
        )

    def moved(*components: int) -> fem.Prescribed:
        return fem.Prescribed(side, lambda x, t: 0.0 * x + push, components=components or None)

    expected = stages({"prescribed": moved()}, {"prescribed": moved(0)})
    found = stages({"bcs": both, "space": V}, {"bcs": one, "space": V})
    for mine, theirs in zip(found[:2], expected[:2], strict=True):
        assert max_over_ranks(COMM, mine - theirs) < 1e-11 * max_over_ranks(COMM, theirs)
    assert found[2].function_space == V
    assert max_over_ranks(COMM, found[2].x.array - expected[2].x.array) < 1e-12 * max_over_ranks(
        COMM, found[2].x.array
    )
