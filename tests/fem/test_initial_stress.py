"""Geometric stiffness of gravity: the virial theorem, a state that stays at rest, Euler's column, a
tilted block."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest
import scipy.linalg
from chain import chain_problem
from fem_problems import CONCRETE, block, dense, held_by, linear, max_over_ranks, orders
from mpi4py import MPI
from standing import COLUMN, G, standing

from demos.parts.problems.geometric_stiffness import geometric_stiffness, initial_stress_matrix
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.initial_strains import InitialStrain
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

COMM = MPI.COMM_WORLD


def distorted(x: Array) -> Array:
    """Nodes pushed about inside and along the sides of a block of width 2 and height 1."""
    out = x.copy()
    out[:, 0] += 0.07 * np.sin(pi * x[:, 0]) * np.cos(pi * x[:, 1])
    out[:, 1] += 0.08 * np.sin(pi * x[:, 1]) * np.sin(pi * x[:, 0] / 2.0)
    return out


def resting(simplices: bool, d: int) -> tuple[ContactProblem, State]:
    """A distorted block, 2 wide and 1 high, at rest on the ground under its weight."""
    lengths, divisions = ((2.0, 1.0), (6, 4)) if d == 2 else ((2.0, 1.0, 1.5), (4, 2, 3))
    mesh, tags = block(
        COMM, lengths=lengths, divisions=divisions, simplices=simplices, deform=distorted
    )
    down = np.array([0.0, -1.0, 0.0])[:d]
    system = assemble(mesh, CONCRETE, loads=BodyForce(tuple(CONCRETE.rho * G * down)))
    ground = HalfSpace(point=(0.0,) * d, normal=tuple(-down))
    problem = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=ground))
    return problem, static_equilibrium(problem, solver=Condensed())


def added(problem: ContactProblem, state: State) -> PetscMatrix:
    """K_G alone, on the free unknowns (K + K_G minus K would lose its digits)."""
    space = problem.system.space
    full = initial_stress_matrix(space, space.expand(problem.cartesian(state.u), state.t))
    return PetscMatrix(space.reduce(full))


def rotation(problem: ContactProblem, about: Array, axis: Array) -> Array:
    """Unit rotation [1/rad] about an axis through a point."""
    points = problem.system.space.points
    arm = np.zeros((len(points), 3))
    arm[:, : points.shape[1]] = points - about[: points.shape[1]]
    return np.asarray(problem.system.space.restrict(np.cross(axis, arm)[:, : points.shape[1]]))


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])
def test_rigid_rotation_lowers_the_centre_of_mass(simplices, d):
    """½ uᵀ K_G u = -½ m g h_c for a unit rotation in a vertical plane, about any point, to 1e-10;
    translations and, in 3D, the spin about the vertical cost nothing. K_G is symmetric."""
    problem, state = resting(simplices, d)
    K_G, system = added(problem, state), problem.system
    fall = 0.5 * 2400.0 * G * (2.0 if d == 2 else 3.0) * 0.5
    tilts = [np.array([0.0, 0.0, 1.0])] + (
        [np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.0, 0.8])] if d == 3 else []
    )
    for about in (np.zeros(3), np.array([2.0, 0.0, 0.0]), np.array([1.0, 0.5, 0.7])):
        for axis in tilts:
            u = rotation(problem, about, axis)
            assert 0.5 * system.algebra.dot(u, K_G @ u) == pytest.approx(-fall, rel=1e-10)
        if d == 3:
            spin = rotation(problem, about, np.array([0.0, 1.0, 0.0]))
            assert abs(system.algebra.dot(spin, K_G @ spin)) < 1e-9 * fall
    for shift in system.influence.T:
        assert max_over_ranks(COMM, K_G @ shift) < 1e-9 * fall
    u, v = (
        rotation(problem, np.zeros(3), tilts[0]),
        system.space.restrict(np.sin(3.0 * system.space.points)),
    )
    assert system.algebra.dot(u, K_G @ v) == pytest.approx(system.algebra.dot(v, K_G @ u), rel=1e-9)


@pytest.mark.two_ranks
def test_tilted_block_restores_itself_less_and_less():
    """The moment that turns a block back about its corner is W (b - h_c theta); without K_G it
    stays W b."""
    problem = standing(material=COLUMN, lengths=(1.0, 4.0), divisions=(3, 8))
    state = static_equilibrium(problem, solver=Condensed())
    second = geometric_stiffness(problem, state)
    turn = -rotation(problem, np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    weight = 2400.0 * G * 4.0
    for theta in (0.0, 0.1, 0.25):
        u = problem.cartesian(state.u) + theta * turn
        moments = [s.algebra.dot(turn, s.K @ u - s.load(0.0)) for s in (problem.system, second)]
        assert moments == pytest.approx(
            [0.5 * weight, weight * (0.5 - 2.0 * theta)], abs=1e-5 * weight
        )


@pytest.mark.parametrize("d", [2, 3])
def test_the_state_stays_an_equilibrium(d):
    """Same displacements, same reactions, and the dynamic stage from there stays still."""
    problem, state = resting(False, d)
    second = replace(problem, system=geometric_stiffness(problem, state))
    again = static_equilibrium(second, solver=Condensed())
    sag = max_over_ranks(COMM, state.u)
    assert max_over_ranks(COMM, again.u - state.u) < 1e-7 * sag
    r_n = problem.surface.everywhere(state.r_n)
    assert problem.surface.everywhere(again.r_n) == pytest.approx(r_n, abs=1e-8 * r_n.max())
    for new, report in march(
        second, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=1e-3, steps=10, state=state
    ):
        assert max_over_ranks(COMM, new.u - state.u) < 1e-8 * sag
        assert report.certificate.worst < 1e-9


def buckling_load(divisions: tuple[int, int]) -> float:
    """The pressure [Pa] on the top of a clamped column (1 x 10) that makes K + K_G singular."""
    mesh, tags = block(COMM, lengths=(1.0, 10.0), divisions=divisions)
    system = assemble(
        mesh, COLUMN, clamped=tags["bottom"], loads=Traction(tags["top"], (0.0, -1.0))
    )
    problem = linear(system)
    state = static_equilibrium(problem, solver=Condensed())
    K, K_G = dense(COMM, system, system.K), dense(COMM, system, added(problem, state))
    return 1.0 / float(scipy.linalg.eigh(-K_G, K, eigvals_only=True)[-1])


@pytest.mark.two_ranks
def test_euler_column():
    """P = pi² E I / 4 L² of the cantilever, with Engesser's shear term P / (1 + P / kGA), k = 5/6
    (Timoshenko and Gere, Theory of Elastic Stability, sect. 2.17): plane Q1 elements (nu = 0) reach
    it from above with h², 3 % on 4 x 40."""
    euler = pi**2 * 2.0e10 / 12.0 / (4.0 * 100.0)
    exact = euler / (1.0 + euler / (5.0 / 6.0 * 1.0e10))
    errors = [buckling_load(divisions) / exact - 1.0 for divisions in ((2, 20), (4, 40))]
    assert 0.0 < errors[1] < 0.04
    assert 1.8 < orders(errors)[0] < 2.2


def test_prescribed_displacements_pull_on_the_new_part():
    """A side that moves by U(t): the load of K + K_G is -Pᵀ (K + K_G) (U(t) - U(0)) beside what
    holds the start."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    move = Prescribed(
        tags["left"], displacement=lambda x, t: np.column_stack([0.0 * x[:, 0], t * x[:, 1] + 1e-3])
    )
    system = assemble(mesh, CONCRETE, prescribed=move, loads=BodyForce((0.0, -CONCRETE.rho * G)))
    problem = linear(system)
    state = static_equilibrium(problem, solver=Condensed())
    second = geometric_stiffness(problem, state)
    assert max_over_ranks(COMM, second.K @ state.u - second.load(0.0)) < 1e-9 * max_over_ranks(
        COMM, system.load(0.0)
    )
    space = system.space
    full = PetscMatrix(initial_stress_matrix(space, space.expand(state.u, 0.0)))
    moved = np.zeros((len(space.nodes), 2))
    left = space.points[:, 0] == 0.0
    moved[left, 1] = 0.5 * space.points[left, 1]
    found = (second.load(0.5) - second.load(0.0)) - (system.load(0.5) - system.load(0.0))
    expected = -(full @ moved.ravel())[space.free]
    assert max_over_ranks(COMM, found - expected) < 1e-6 * max_over_ranks(COMM, expected)
    assert max_over_ranks(COMM, expected) > 0.0


def test_held_sides_keep_the_unknowns():
    """Prescribed components are eliminated from K_G as from K."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    press = held_by(tags, "top", lambda x: 0.0 * x - 1e-4, 1)
    system = assemble(mesh, CONCRETE, prescribed=[press, Prescribed(tags["bottom"])])
    second = geometric_stiffness(
        linear(system), static_equilibrium(linear(system), solver=Condensed())
    )
    assert second.rows == system.rows and second.K.rows == system.K.rows
    assert second.C is None and second.M is system.M


@pytest.mark.two_ranks
def test_warming_of_a_held_block_is_a_pressure():
    """Nothing moves, sigma = -E alpha dT s(t) along x: uᵀ K_G u of u = (0, x) is that times the
    area."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    warm = InitialStrain(np.diag([3e-4, 0.0]), history=lambda t: t)
    system = assemble(mesh, COLUMN, clamped=tags["left"], loads=warm)
    space = system.space
    full = PetscMatrix(initial_stress_matrix(space, np.zeros_like(space.points), 2.0))
    up = np.column_stack([0.0 * space.points[:, 0], space.points[:, 0]]).ravel()
    assert space.comm.sum(np.array([up @ (full @ up)])) == pytest.approx(
        [-2.0e10 * 6e-4 * 2.0], rel=1e-12
    )


@pytest.mark.serial
def test_other_systems_are_refused():
    problem = chain_problem(3)
    with pytest.raises(InputError, match="geometric_stiffness needs a system made by fem.assemble"):
        geometric_stiffness(problem, static_equilibrium(problem, solver=Condensed()))
