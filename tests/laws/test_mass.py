"""Redistributed mass: no inertia at the contact nodes, the inertia of the body untouched (V9.4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import bar, thrown
from chain import chain_problem
from fem_problems import CONCRETE, block, dense, spread, turned
from inertia import FINER, inertia, problem
from mpi4py import MPI

from vi_contact.core.algebra import largest, total
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import Touching
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import Rayleigh
from vi_contact.run.march import march
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.solvers.condensed import Condensed


@pytest.mark.parametrize("friction", [None, pytest.param(Coulomb(0.3), marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FINER)
@pytest.mark.promise("guide/schemes.md", "stay as they are, to round-off")
def test_mass_centre_and_inertia_are_kept(name: str, friction: Any) -> None:
    """Total mass, centre of mass and every moment of inertia to round-off, in 1D, 2D, 3D, straight
    and turned."""
    more = {} if friction is None else {"friction": friction}
    before, after = (
        inertia(problem(name, **more)),
        inertia(problem(name, mass=Redistributed(), **more)),
    )
    assert np.abs(after - before).max() <= 1e-12 * np.abs(before).max()
    moved = replace(problem(name, **more), mass=Redistributed(lumping=1.0))
    assert np.abs(inertia(moved) - before).max() <= 1e-12 * np.abs(before).max()


@pytest.mark.parametrize("friction", [None, pytest.param(Coulomb(0.3), marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["bar", "quadrilaterals", "triangles", "tetrahedra"])
def test_only_the_contact_nodes_lose_their_mass(name: str, friction: Any) -> None:
    """Rows and columns of the normal unknowns (with friction of the tangential ones too) are zero;
    the rest of M* is positive definite, so that every velocity that carries momentum costs
    energy."""
    more = {} if friction is None else {"friction": friction}
    given = problem(name, mass=Redistributed(), **more)
    system = given.equations
    ids = np.asarray(system.space.ids)
    M = dense(MPI.COMM_WORLD, system, system.M)
    wanted = np.zeros(system.rows, dtype=bool)
    wanted[given.surface.owned] = True
    if friction is not None:
        wanted[given.surface.tangents.ravel()] = True
    assert np.array_equal(system.massless, wanted)
    massless = spread(MPI.COMM_WORLD, ids, wanted.astype(float))[
        np.sort(np.concatenate(MPI.COMM_WORLD.allgather(ids)))
    ]
    none = massless.astype(bool)
    assert none.sum() == given.surface.total * (
        1 if friction is None else given.system.influence.shape[1]
    )
    assert not M[none].any() and not M[:, none].any()
    assert np.allclose(M, M.T, rtol=0.0, atol=1e-14 * np.abs(M).max())
    assert np.linalg.eigvalsh(M[np.ix_(~none, ~none)])[0] > 0.0


@pytest.mark.two_ranks
@pytest.mark.parametrize("friction", [None, pytest.param(Coulomb(0.3), marks=pytest.mark.slow)])
@pytest.mark.parametrize("simplices", [False, True])
def test_the_axes_do_not_matter(simplices: bool, friction: Any) -> None:
    """A body and its velocities turned by 0.4 rad have the same kinetic energy, for velocities that
    deform it too."""
    more, found = {} if friction is None else {"friction": friction}, []
    for angle in (0.0, 0.4):
        mesh, tags = block(
            MPI.COMM_WORLD, lengths=(2.0, 1.5), divisions=(7, 6), simplices=simplices, angle=angle
        )
        system = assemble(mesh, CONCRETE)
        surface = contact_surface(system, tags["left"], obstacle=Touching())
        given = ContactProblem(system, surface, mass=Redistributed(), **more)
        x = turned(system.space.points, -angle)
        fields = [
            np.column_stack([np.sin(3.0 * x[:, 0] + x[:, 1]), x[:, 0] * x[:, 1]]),
            np.cos(4.0 * x),
        ]
        energies = []
        for field in fields:
            v = system.space.restrict(turned(field, angle))
            v = v if surface.basis is None else surface.basis.transpose_apply(v)
            energies.append(given.equations.kinetic_energy(v))
        found.append(energies)
    assert found[0] == pytest.approx(found[1], rel=1e-11)


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", [name for name in FINER if name != "bar"])
def test_rigid_motions_are_not_damped(name: str) -> None:
    """Stiffness-proportional damping on redistributed mass leaves every rigid motion alone, as on
    consistent mass."""
    mesh, tags = block(MPI.COMM_WORLD, **FINER[name])
    system = assemble(mesh, CONCRETE, damping=Rayleigh(alpha=0.0, beta=1e-3))
    given = ContactProblem(
        system, contact_surface(system, tags["left"], obstacle=Touching()), mass=Redistributed()
    )
    C, x = given.equations.C, given.equations.space.coordinates
    assert C is not None
    influence = given.system.influence
    turn = influence[:, 1] * x[:, 0] - influence[:, 0] * x[:, 1]
    turn = turn if given.surface.basis is None else given.surface.basis.transpose_apply(turn)
    size = largest(given.surface.comm, np.abs(C.diagonal()).max() * np.abs(turn).max())
    assert largest(given.surface.comm, np.abs(C @ turn).max()) <= 1e-12 * size


def test_the_matrix_is_the_same_on_all_ranks() -> None:
    """Entry by entry, turned triangles."""
    parallel = problem("triangles", mass=Redistributed())
    alone = problem("triangles", MPI.COMM_SELF, mass=Redistributed())
    M = dense(MPI.COMM_WORLD, parallel.equations, parallel.equations.M)
    reference = dense(MPI.COMM_SELF, alone.equations, alone.equations.M)
    assert np.abs(M - reference).max() <= 1e-13 * np.abs(reference).max()


def test_two_sides_that_meet_in_a_corner() -> None:
    """A triangle whose nodes all touch has no neighbour behind: its mass goes on through the next
    contact node."""
    mesh, tags = block(
        MPI.COMM_WORLD, lengths=(2.0, 1.5), divisions=(5, 4), simplices=True, angle=0.4
    )
    system = assemble(mesh, CONCRETE)
    both = replace(tags["left"], indices=np.union1d(tags["left"].indices, tags["top"].indices))
    plain = ContactProblem(system, contact_surface(system, both, obstacle=Touching()))
    moved = replace(plain, mass=Redistributed())
    assert (
        total(moved.equations.algebra.comm, moved.equations.massless.sum()) == plain.surface.total
    )
    assert np.abs(inertia(moved) - inertia(plain)).max() <= 1e-12 * np.abs(inertia(plain)).max()


@pytest.mark.two_ranks
def test_the_default_leaves_the_mass_alone() -> None:
    """ConsistentMass is M as assembled; a problem without contact has nothing to redistribute."""
    given = thrown(10)
    same = replace(given, mass=ConsistentMass()).equations
    assert same.massless is None
    assert np.array_equal(same.M.csr.toarray(), given.equations.M.csr.toarray())


@pytest.mark.two_ranks
def test_translation_of_the_whole_body_feels_the_whole_mass() -> None:
    """The inertia load -M* r a_g has the resultant of -M r a_g: shaken and free, every body moves
    with the ground."""
    given = problem("tetrahedra", mass=Redistributed(), impact=None)
    turn = turned([1.0, 0.0], 0.4)
    direction = np.array([*turn, 0.0])
    system = given.equations
    force = system.M @ (system.influence @ direction)
    total = system.algebra.comm.sum(system.influence.T @ force)
    assert total == pytest.approx(2400.0 * 2.0 * 1.5 * 1.2 * direction, rel=1e-12, abs=1e-9)


@pytest.mark.two_ranks
def test_refusals() -> None:
    """One sentence each: lumping out of range, a mass with nowhere to go, a mesh too coarse, an
    impact law."""
    with pytest.raises(InputError, match="lumping is 1.5; give a share"):
        Redistributed(1.5)
    with pytest.raises(InputError, match="cannot be moved.*ConsistentMass"):
        # lumped masses know no neighbours
        _ = replace(chain_problem(4), mass=Redistributed()).equations
    with pytest.raises(InputError, match="too coarse for redistributed mass.*refine"):
        _ = bar(2, mass=Redistributed()).equations
    given = thrown(10, mass=Redistributed(), impact=Inelastic())
    with pytest.raises(InputError, match="acts on the mass of contact nodes.*leave the law out"):
        next(march(given, scheme=Trapezoidal(), solver=Condensed(), dt=0.01, steps=1))
