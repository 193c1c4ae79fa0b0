"""Dual mortar coupling of plane sides that are not meshed alike: linear fields, forces, partial
overlap, curves, the patch test (V2.1), dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import field, held_by, run, turned
from mpi4py import MPI
from two_bodies import forces, momenta, per_body, relative, thrown, two_blocks

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair, side_of
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

COMM = MPI.COMM_WORLD
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])


def uneven(x: Array) -> Array:
    """Nodes pushed along x."""
    out = x.copy()
    out[:, 0] += 0.05 * np.sin(2.0 * np.pi * x[:, 0] / 1.5)
    return out


def unlike(
    *,
    upper: int = 7,
    lower: int = 5,
    lengths: tuple[float, float] = (1.5, 1.5),
    simplices: bool = False,
    **data: Any,
) -> TwoBlocks:
    """Blocks of height 1 with so many cells along the interface."""
    one, two = (
        BlockMesh(lengths=(length, 1.0), divisions=(n, 3), simplices=simplices, deform=deform)
        for n, length, deform in ((upper, lengths[0], None), (lower, lengths[1], uneven))
    )
    return TwoBlocks(upper=one, lower=two, **data)


def sides(
    mesh: TwoBlocks, comm: Any = COMM, swapped: bool = False, **data: Any
) -> tuple[Any, Any, Any]:
    """(system, sides of the pair)"""
    system, tags = two_blocks(comm, mesh, **data)
    one, two = (tags[side] for side in mesh.interface)
    return (system, two, one) if swapped else (system, one, two)


def matched(system: Any, one: Any, two: Any) -> Any:
    return DualMortar().match(
        side_of(system.space, one), side_of(system.space, two), system.space.size
    )


# The matrix P
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@shapes
@pytest.mark.parametrize("swapped", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_linear_fields_and_uniform_pressure(angle, swapped, simplices):
    """Rows of P sum to 1 and reproduce positions: P x_2 = x_1; the nodal forces of a uniform
    pressure on side 1 arrive as those of the same pressure on side 2: Pᵀ weights = ∫ phi_j. All to
    1e-13."""
    system, one, two = sides(unlike(simplices=simplices, angle=angle), swapped=swapped)
    found = matched(system, one, two)
    nodes1, nodes2 = side_of(system.space, one).nodes, side_of(system.space, two).nodes
    assert np.array_equal(found.rows, np.arange(len(nodes1.numbers)))
    assert np.asarray(found.P.sum(axis=1)).ravel() == pytest.approx(
        np.ones(len(found.rows)), rel=1e-13
    )
    assert found.P @ nodes2.points == pytest.approx(nodes1.points, abs=1e-13)
    assert found.weights == pytest.approx(nodes1.weights, rel=1e-13)
    assert found.P.T @ found.weights == pytest.approx(nodes2.weights, rel=1e-12)


@pytest.mark.two_ranks
def test_matching_sides_are_the_special_case():
    """On sides that are meshed alike P is the identity: node to node."""
    block = BlockMesh(lengths=(1.5, 1.0), divisions=(4, 3), deform=uneven)
    system, one, two = sides(TwoBlocks(upper=block, lower=block))
    mortar = contact_pair(system, one, two, matching=DualMortar())
    nodal = contact_pair(system, one, two)
    x = relative(ContactProblem(system, nodal), system.space.restrict(np.cos(system.space.points)))
    assert seen(mortar).normal_values(x) == pytest.approx(seen(nodal).normal_values(x), abs=1e-14)
    assert seen(mortar).weights == pytest.approx(seen(nodal).weights, rel=1e-13)


@pytest.mark.parametrize("offset", [0.0, 0.33, 0.5, -0.41])
@pytest.mark.parametrize("swapped", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_partly_covered_sides(offset, swapped):
    """A short block on a long one, at any place, over either end, from either side: weights sum to
    what they share, linear fields are exact, the pressure on it arrives as the same force and
    moment."""
    lengths = (0.6, 1.5)
    system, one, two = sides(unlike(lengths=lengths, offset=(offset,)), swapped=swapped)
    found = matched(system, one, two)
    nodes1, nodes2 = side_of(system.space, one).nodes, side_of(system.space, two).nodes
    low, high = max(offset, 0.0), min(offset + lengths[0], lengths[1])
    assert found.weights.sum() == pytest.approx(high - low, rel=1e-12)
    assert found.P @ nodes2.points == pytest.approx(nodes1.points[found.rows], abs=1e-10)
    force = found.P.T @ found.weights
    assert force.sum() == pytest.approx(high - low, rel=1e-12)
    assert force @ nodes2.points[:, 0] == pytest.approx(0.5 * (high**2 - low**2), rel=1e-11)
    surface = contact_pair(system, one, two, matching=DualMortar())
    assert seen(surface).gap0 == pytest.approx(np.zeros(seen(surface).count), abs=1e-9)


def rings(gap: float) -> Blocks:
    """Half a ring inside another one, with meshes of their own."""

    def bend(x: Array) -> Array:
        return np.column_stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])])

    def ring(radius: float, n: int) -> BlockMesh:
        return BlockMesh(lengths=(1.0, np.pi), divisions=(2, n), corner=(radius, 0.0), deform=bend)

    return Blocks({"inner": ring(1.0, 16), "outer": ring(2.0 + gap, 23)})


@pytest.mark.two_ranks
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_curved_sides(gap):
    """Polygons of one curve: gaps within the height of the arcs above their chords, radius (1 - cos
    of half the angle), zero where they overlap; rows of P sum to 1."""
    system, tags = two_blocks(COMM, rings(gap))
    one, two = tags["inner_right"], tags["outer_left"]
    surface = contact_pair(system, one, two, matching=DualMortar())
    height = 2.0 * (1.0 - np.cos(0.5 * np.pi / 16)) + (2.0 + gap) * (1.0 - np.cos(0.5 * np.pi / 23))
    inner = np.abs(seen(surface).points[:, 0]) < 1.99
    assert seen(surface).count == 17 and seen(surface).gap0.min() >= 0.0
    assert np.abs(seen(surface).gap0[inner] - gap).max() < 1.5 * height
    found = matched(system, one, two)
    assert np.asarray(found.P.sum(axis=1)).ravel() == pytest.approx(np.ones(17), rel=1e-12)


# V2.1
# --------------------------------------------------------------------------------------------------

P = 1.0e8
STEEL, BRASS = (
    LinearElastic(E=2.1e11, nu=0.3, rho=7850.0),
    LinearElastic(E=1.0e11, nu=0.2, rho=8400.0),
)


@pytest.mark.parametrize(
    "solver", [Condensed(), Volume(method=ReducedNewton())], ids=["condensed", "volume"]
)
@pytest.mark.parametrize("swapped", [False, pytest.param(True, marks=pytest.mark.slow)])
@shapes
def test_v2_1_pressure_through_meshes_that_do_not_match(simplices, swapped, solver):
    """Steel on brass, turned by 0.4 rad: one uniform strain e_xx in both, as if glued, pressure p
    across the interface; displacements 1e-10, pressures 1e-10 at every node."""
    angle = 0.4
    mesh = unlike(simplices=simplices, angle=angle)

    def strain(material: LinearElastic) -> Array:
        E, nu = material.E, material.nu
        return np.array([nu * (1.0 + nu) * P / E, -P * (1.0 - nu**2) / E])

    def uniform(material: LinearElastic, height: float = 0.0) -> Any:
        def u(x: Array) -> Array:
            local = turned(x, -angle) * strain(material)
            local[:, 1] += height
            return turned(local, angle)

        return u

    lower, upper = uniform(BRASS), uniform(STEEL, strain(BRASS)[1] - strain(STEEL)[1])
    built, tags = build_mesh(mesh, COMM)
    hold = [held_by(tags, "lower_bottom", lower), held_by(tags, "upper_top", upper)]
    system = assemble(built, [(tags["lower"], BRASS), (tags["upper"], STEEL)], prescribed=hold)
    pair = [tags[side] for side in mesh.interface]
    surface = contact_pair(system, *(pair[::-1] if swapped else pair), matching=DualMortar())
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=solver)
    exact, found = per_body(system, lower, upper), problem.cartesian(state.u)
    error, size = (
        float(COMM.allreduce(float(np.abs(x).max(initial=0.0)), op=MPI.MAX))
        for x in (found - exact, exact)
    )
    assert error < 1e-10 * size and seen(surface).all(state.active).all()
    assert np.abs(seen(surface).all(state.r_n) / seen(surface).weights / P - 1.0).max() < 1e-10


# Dynamics
# --------------------------------------------------------------------------------------------------


def meeting(comm: Any, *, friction: Any = None, mass: Any = None) -> ContactProblem:
    """A small block thrown on a larger one."""
    angle = 0.3
    mesh = TwoBlocks(
        upper=BlockMesh(lengths=(0.8, 0.6), divisions=(9, 7), simplices=True),
        lower=BlockMesh(lengths=(1.5, 1.0), divisions=(10, 7), simplices=True, deform=uneven),
        offset=(0.4,),
        gap=1e-3,
        angle=angle,
    )
    system, tags = two_blocks(comm, mesh)
    down = turned((1.5, -2.0), angle)
    system = thrown(system, np.zeros_like, lambda x: np.outer(1.0 + 0.2 * x[:, 0], down))
    surface = contact_pair(system, *(tags[side] for side in mesh.interface), matching=DualMortar())
    return ContactProblem(system, surface, friction=friction or Frictionless(), mass=mass)


ROUTES = [(Midpoint(), ConsistentMass()), (Trapezoidal(), Redistributed())]
routes = pytest.mark.parametrize(("scheme", "mass"), ROUTES, ids=["midpoint", "trapezoidal"])
frictions = pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["smooth", "rough"])


@pytest.mark.two_ranks
@frictions
@routes
def test_what_one_body_gains_the_other_loses(scheme, mass, friction):
    """V9.8: total momentum kept to 1e-12 in every step, every step certified to 1e-9; on all ranks
    together as on each alone, to 1e-9."""
    problem = meeting(COMM, friction=friction, mass=mass)
    start = momenta(problem, problem.equations.v0)
    for state, report in march(problem, scheme=scheme, dt=1e-3, steps=30):
        assert report.certificate.worst <= 1e-9
        total = momenta(problem, state.v).sum(axis=0)
        assert total == pytest.approx(start.sum(axis=0), abs=1e-12 * np.abs(start).max())
    assert np.abs(momenta(problem, state.v)[0]).max() > 0.1 * np.abs(start).max()
    together, alone = (
        run(meeting(comm, friction=friction, mass=mass), scheme=scheme, dt=1e-3, steps=30)
        for comm in (COMM, MPI.COMM_SELF)
    )
    assert np.abs(together.u - alone.u).max() < 1e-9 * np.abs(alone.u).max()


def test_action_is_reaction():
    """Force and, on touching sides, moment of the pair vanish for any reactions, tangential ones
    included."""
    system, one, two = sides(unlike(angle=0.4))
    surface = contact_pair(system, one, two, matching=DualMortar())
    random = np.random.default_rng(3)
    r_n, r_t = random.random(seen(surface).count), random.standard_normal((seen(surface).count, 1))
    push = forces(
        ContactProblem(system, surface), seen(surface).reaction_load(r_n, system.rows, r_t)
    )
    points = field(system, system.u0)[0]
    moment = np.einsum("ki,kj->ij", points, push)
    assert np.abs(push.sum(axis=0)).max() < 1e-12 and np.abs(moment - moment.T).max() < 1e-12


@routes
def test_condensed_and_volume_agree(scheme, mass):
    """Every step from the same state, to 1e-9."""
    solvers = (Condensed(), Volume(method=ReducedNewton()))
    assert (
        cross_check(
            meeting(COMM, mass=mass), scheme=scheme, solvers=solvers, dt=1e-3, steps=20
        ).worst
        <= 1e-9
    )


# Refusals
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_refusals():
    system, tags = two_blocks(COMM, unlike())
    for one, two, sentence in (
        ("upper_bottom", "lower_bottom", "'lower_bottom' does not face 'upper_bottom' at"),
        (
            "upper_bottom",
            "lower_left",
            "no part of 'lower_left' lies opposite 'upper_bottom', along the normals",
        ),
        ("upper_top", "lower_bottom", "'lower_bottom' lies 2 m behind 'upper_top' at"),
    ):
        with pytest.raises(InputError, match=sentence):
            contact_pair(system, tags[one], tags[two], matching=DualMortar())
    bar = BlockMesh(lengths=(1.0,), divisions=(2,))
    system, one, two = sides(TwoBlocks(lower=bar, upper=bar))
    with pytest.raises(
        InputError,
        match=r"DualMortar joins sides of plane and solid bodies: use matching=NodeToNode",
    ):
        contact_pair(system, one, two, matching=DualMortar())
    with pytest.raises(InputError, match="'lower_top' lies 0.1 m behind 'upper_bottom'"):
        system, one, two = sides(unlike(gap=-0.1))
        contact_pair(system, one, two, matching=DualMortar())
