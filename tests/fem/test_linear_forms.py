"""Loads as linear forms: equal to tractions and body forces, thermal strain in closed form, and
what is refused."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx.fem import Constant, Function
from fem_problems import CONCRETE, block, field, linear, max_over_ranks
from mesh_tools import refusal
from mpi4py import MPI
from own_meshes import OWN, at, own_mesh, tags_where

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem import compat
from vi_contact.laws.materials import LinearElastic, PlaneStress, Rayleigh
from vi_contact.run.recorders import Contact
from vi_contact.run.simulate import simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

COMM = MPI.COMM_WORLD
STEEL = LinearElastic(E=2.1e11, nu=0.3, rho=7850.0)
EXPANSION = 1.2e-5  # 1/K


def same(one: Any, other: Any, t: float = 0.0) -> None:
    """The loads of two systems at a time, to round-off."""
    force, forces = one.load(t), other.load(t)
    size = max_over_ranks(COMM, forces)
    assert size > 0.0 and max_over_ranks(COMM, force - forces) < 1e-13 * size


@pytest.mark.parametrize("cell", OWN)
def test_forms_are_the_loads_they_say(cell):
    """Traction by a user's Measure with tags, a body force by dx, both; constant, with history,
    with an update."""
    mesh = own_mesh(COMM, cell)
    d = mesh.geometry.dim
    tags = tags_where(mesh, d - 1, base=at(0, 0.0), face=at(0, 2.0))
    face = fem.Facets.tagged("face", tags, 8, mesh)
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=tags)
    value, weight = np.array([3.0, -2.0, 5.0])[:d], np.array([1.0, 4.0, -7.0])[:d]
    g, f = Constant(mesh, tuple(value)), Constant(mesh, tuple(weight))
    factor = Constant(mesh, 1.0)

    def system(*loads: Any) -> Any:
        return fem.assemble(
            mesh, CONCRETE, loads=list(loads), clamped=fem.Facets.tagged("base", tags, 7, mesh)
        )

    def set_factor(t: float) -> None:
        factor.value = sin(t)

    traction = fem.LinearForm(lambda v: ufl.inner(g, v) * ds(8))
    body = fem.LinearForm(lambda v: ufl.inner(f, v) * ufl.dx)
    same(system(traction), system(fem.Traction(face, tuple(value))))
    same(
        system(fem.LinearForm(lambda v: ufl.inner(g, v) * ds(8) + ufl.inner(f, v) * ufl.dx)),
        system(fem.Traction(face, tuple(value)), fem.BodyForce(tuple(weight))),
    )
    expected = system(fem.Traction(face, tuple(value), history=sin), fem.BodyForce(tuple(weight)))
    by_history = system(fem.LinearForm(lambda v: ufl.inner(g, v) * ds(8), history=sin), body)
    updated = system(
        fem.LinearForm(lambda v: factor * ufl.inner(g, v) * ds(8), update=set_factor), body
    )
    for t in (0.3, 1.1, 0.3):
        same(by_history, expected, t)
        same(updated, expected, t)


def test_a_function_that_an_update_changes():
    """A pressure interpolated at every time on the user's own scalar space; sections multiply by
    their thickness."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    make = compat.fem.functionspace if compat.VERSION >= (0, 7) else compat.fem.FunctionSpace
    pressure, n = Function(make(mesh, ("Lagrange", 1))), ufl.FacetNormal(mesh)

    def set_pressure(t: float) -> None:
        pressure.interpolate(lambda x: (1.0 + t) * x[1])

    section = PlaneStress(0.3)
    top = compat.measure(mesh, 1, tags["right"].indices)
    load = fem.LinearForm(lambda v: -pressure * ufl.dot(n, v) * top, update=set_pressure)
    system = fem.assemble(mesh, CONCRETE, loads=load, section=section)
    by_hand = fem.Traction(
        tags["right"], lambda x, t: np.column_stack([-(1.0 + t) * x[:, 1], 0.0 * x[:, 1]])
    )
    for t in (0.0, 0.5):
        same(system, fem.assemble(mesh, CONCRETE, loads=by_hand, section=section), t)
        total = COMM.allreduce(system.load(t).reshape(-1, 2).sum(axis=0))
        assert total == pytest.approx([-0.3 * (1.0 + t) * 0.5, 0.0], abs=1e-14)


@pytest.mark.two_ranks
def test_runs_with_forms_are_runs_with_tractions(comm):
    """Impacts beside tied sides, a roller that moves and damping; reactions know the loads too,
    updates as well."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 4), simplices=True)
    push, factor = Constant(mesh, (0.0, -3e5)), Constant(mesh, 0.0)
    ds = compat.measure(mesh, 1, tags["top"].indices)

    def set_factor(t: float) -> None:
        factor.value = 1.0 - cos(400.0 * t)

    def go(load: Any) -> Any:
        roller = fem.Prescribed(
            tags["left"],
            displacement=lambda x, t: 1e-5 * t * np.ones_like(x),
            velocity=lambda x, t: 1e-5 * np.ones_like(x),
            components=(0,),
        )
        foot = fem.Prescribed(tags["bottom"], components=(0,))
        system = fem.assemble(
            mesh,
            CONCRETE,
            loads=[load, fem.BodyForce((0.0, -2e4))],
            prescribed=[roller, foot],
            damping=Rayleigh(1.0, 1e-6),
            tied=fem.Tied(tags["left"], tags["right"], (1,)),
        )
        ground = HalfSpace(point=(0.0, -2e-6), normal=(0.0, 1.0))
        feet = [(0.5, 0.0), (1.0, 0.0), (1.5, 0.0)]
        problem = ContactProblem(
            system, fem.contact_surface(system, tags["bottom"], obstacle=ground, points=feet)
        )
        side = vc.Reactions(
            "left", tags["left"], centre=(0.0, 0.0), loads=[load, fem.BodyForce((0.0, -2e4))]
        )
        return simulate(
            problem,
            scheme=ZienkiewiczWoodTaylor(),
            dt=1e-4,
            steps=30,
            record=[Contact(), side],
            progress=False,
        ).history

    expected = go(fem.Traction(tags["top"], (0.0, -3e5), history=lambda t: 1.0 - cos(400.0 * t)))
    assert np.ptp(expected["contact_active"]) > 0
    for load in (
        fem.LinearForm(lambda v: ufl.inner(push, v) * ds, history=lambda t: 1.0 - cos(400.0 * t)),
        fem.LinearForm(lambda v: factor * ufl.inner(push, v) * ds, update=set_factor),
    ):
        found = go(load)
        for name in ("contact_resultant", "reaction_x_left", "reaction_M_left"):
            assert (
                np.abs(found[name] - expected[name]).max() < 1e-9 * np.abs(expected[name]).max()
            ), name


def test_reactions_know_the_form_as_it_was_assembled():
    """A Constant changes between bodies, of one form or of several: each is held against its own
    load, to round-off."""
    mesh = own_mesh(COMM, "quadrilateral")
    push, base = Constant(mesh, (0.0, 0.0)), fem.Facets.where("base", mesh, at(0, 0.0))
    often = fem.LinearForm(lambda v: ufl.inner(push, v) * ufl.dx)
    for loads in (
        [often, often],
        [fem.LinearForm(lambda v: ufl.inner(push, v) * ufl.dx, h) for h in (None, cos)],
    ):
        problems, found = [], []
        for load, size in zip(loads, (1e3, 7e3), strict=True):
            push.value = (-2.0 * size, size)
            problems.append(linear(fem.assemble(mesh, CONCRETE, clamped=base, loads=load)))
        for problem, load in zip(problems, loads, strict=True):
            state = static_equilibrium(problem)
            row = vc.Reactions("base", base, centre=(0.0, 0.0), loads=load).start(problem, state)
            found.append([row["reaction_x_base"], row["reaction_y_base"]])
        assert np.array(found) == pytest.approx(np.array([[6e3, -3e3], [42e3, -21e3]]), rel=1e-10)


@pytest.mark.two_ranks
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_a_free_body_that_is_heated_grows_without_stress(cell):
    """u = alpha dT x with supports that do not resist: K u = ∫ (3 lambda + 2 mu) alpha dT div v."""
    mesh, warmer = own_mesh(COMM, cell), 40.0
    d = mesh.geometry.dim
    modulus = STEEL.E / (1.0 - (d - 1) * STEEL.nu)
    heat = Constant(mesh, modulus * EXPANSION * warmer)
    planes = [
        fem.Prescribed(fem.Facets.where("plane", mesh, at(axis, 0.0)), components=(axis,))
        for axis in range(d)
    ]
    system = fem.assemble(
        mesh,
        STEEL,
        section=PlaneStress(0.1) if d == 2 else None,
        prescribed=planes,
        loads=fem.LinearForm(lambda v: heat * ufl.div(v) * ufl.dx),
    )
    points, u = field(system, static_equilibrium(linear(system)).u)
    assert np.abs(u - EXPANSION * warmer * points).max() < 1e-11 * EXPANSION * warmer * 2.0


@pytest.mark.two_ranks
def test_a_heated_bar_between_walls():
    """A gap g closes, then p = E (alpha dT - g/L), uniform over the face; sides are free to
    grow."""
    mesh, warmer, gap = own_mesh(COMM, "quadrilateral"), 60.0, 4e-4
    heat = Constant(mesh, STEEL.E / (1.0 - STEEL.nu) * EXPANSION * warmer)
    held = [
        fem.Prescribed(fem.Facets.where("wall", mesh, at(axis, 0.0)), components=(axis,))
        for axis in (0, 1)
    ]
    system = fem.assemble(
        mesh,
        STEEL,
        section=PlaneStress(0.1),
        prescribed=held,
        loads=fem.LinearForm(lambda v: heat * ufl.div(v) * ufl.dx),
    )
    wall = HalfSpace(point=(2.0 + gap, 0.0), normal=(-1.0, 0.0))
    surface = fem.contact_surface(system, fem.Facets.where("end", mesh, at(0, 2.0)), obstacle=wall)
    problem = ContactProblem(system, surface)
    pressure = problem.surface.everywhere(static_equilibrium(problem).r_n / problem.surface.weights)
    assert pressure == pytest.approx(STEEL.E * (EXPANSION * warmer - gap / 2.0), rel=1e-9)


@pytest.mark.two_ranks
def test_what_is_refused():
    """One sentence on all ranks for each."""
    mesh, other = own_mesh(COMM, "triangle"), own_mesh(COMM, "triangle")
    one, f = Constant(mesh, 1.0), Constant(mesh, (1.0, 2.0))

    def said(form: Any, **more: Any) -> str:
        return refusal(
            COMM, lambda: fem.assemble(mesh, CONCRETE, loads=fem.LinearForm(form, **more))
        )

    assert "form is 3; give a function of the test function v" in said(3)
    both = said(lambda v: one * v[0] * ufl.dx, history=sin, update=sin)
    assert "has a history and an update; give one of the two" in both
    assert "history is 2.0; give a function of the time" in said(
        lambda v: one * v[0] * ufl.dx, history=2.0
    )
    for form in (lambda v: ufl.inner(f, v), lambda v: 0):
        assert "LinearForm: form: what it returns is " in said(
            form
        ) and "return an integral, such as" in said(form)
    trial, foreign = (
        ufl.TrialFunction(compat.vector_space(mesh)),
        Function(compat.vector_space(other)),
    )
    wrong = (
        lambda v: 0 * v[0] * ufl.dx(domain=mesh),
        lambda v: one * ufl.dx,
        lambda v: ufl.inner(trial, v) * ufl.dx,
    )
    for form in wrong:
        assert (
            "LinearForm: form is not a form in the given trial and test functions; return one that"
            in said(form)
        )
    assert "form is not linear in u or in v" in said(lambda v: one * v[0] * v[1] * ufl.dx)
    for form in (
        lambda v: ufl.inner(f, v) * ufl.dx(domain=other),
        lambda v: ufl.inner(foreign, v) * ufl.dx(mesh),
    ):
        assert (
            "LinearForm: form is of another mesh; give measures and Functions of the mesh"
            in said(form)
        )
    assert "ZeroDivisionError" in said(lambda v: 1 / 0)
    missing = Constant(mesh, float("nan"))
    assert "LinearForm gives NaN or infinite forces at t = 0 s" in said(
        lambda v: missing * v[0] * ufl.dx
    )
    form = fem.LinearForm(lambda v: one * v[0] * ufl.dx)
    system = fem.assemble(mesh, CONCRETE, loads=form)
    cut = vc.SectionForces({"middle": ((1.0, 0.0), (1.0, 1.5))}, loads=form)
    record = {"scheme": ZienkiewiczWoodTaylor(), "dt": 1e-4, "steps": 1, "progress": False}
    assert "LinearForm on the cells of a cut" in refusal(
        COMM, lambda: simulate(linear(system), record=[cut], **record)
    )


def test_an_update_that_fails_is_told_on_all_ranks():
    """Where it raises on one rank only, and where it makes NaN there; at the time it does, not
    before."""
    mesh = own_mesh(COMM, "triangle")
    value = Constant(mesh, 1.0)

    def raises(t: float) -> None:
        if t > 0.2 and COMM.rank == COMM.size - 1:
            raise ValueError("only here")

    def spoils(t: float) -> None:
        value.value = float("nan") if t > 0.2 and COMM.rank == 0 else 1.0

    for update, words in (
        (raises, r"LinearForm: update\(0.3\) ended in ValueError: only here"),
        (spoils, "t = 0.3 s"),
    ):
        load = fem.assemble(
            mesh, CONCRETE, loads=fem.LinearForm(lambda v: value * v[0] * ufl.dx, update=update)
        ).load
        load(0.1)
        with pytest.raises(InputError, match=words):
            load(0.3)
