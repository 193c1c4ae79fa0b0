"""Systems of a user's own PETSc matrices on any number of ranks: those that fem.assemble made,
marched once more, and matrices of frames, marched by scipy on every rank."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from bar import bar_matrices
from mpi4py import MPI
from petsc4py import PETSc

import vi_contact as vc
from demos.parts.problems.frame_elements import frame, line
from vi_contact import fem, meshes
from vi_contact.core.errors import InputError
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.fem.matrices.petsc_rows import aij_of, rows_of
from vi_contact.solvers import Lemke

COMM = MPI.COMM_WORLD
SOFT = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)


def block(d: int) -> tuple[Any, Any]:
    """A block that slides as it falls on an oblique plane, damped."""
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(6, 4, 2)[:d]), COMM
    )
    system = fem.assemble(
        mesh, SOFT, damping=vc.Rayleigh(1.0, 1e-4), initial_velocity=(1.0, -1.0, 0.2)[:d]
    )
    plane = vc.HalfSpace((0.0, -1e-3, 0.0)[:d], (0.2, 1.0, 0.1)[:d])
    return system, fem.contact_surface(system, tags["bottom"], obstacle=plane)


def history(problem: vc.ContactProblem, every: Any, **options: Any) -> tuple[Any, Any]:
    """Displacements of these nodes and reactions of all points in every step, the same on all
    ranks."""
    u, r = [], []
    for state, report in vc.march(problem, steps=30, dt=4e-4, **options):
        assert report.certificate.worst <= 1e-9
        u.append(problem.system.space.sample(problem.cartesian(state.u), every, state.t))
        r.append(problem.surface.everywhere(state.r_n))
    assert np.max(r) > 0.0
    return np.array(u), np.array(r)


def same(one: Any, two: Any, rel: float) -> bool:
    return all(np.abs(a - b).max() <= rel * np.abs(a).max() for a, b in zip(one, two, strict=True))


@pytest.mark.two_ranks
@pytest.mark.parametrize("scheme", [vc.Trapezoidal(), vc.MoreauJean()])
@pytest.mark.parametrize("d", [2, 3])
def test_exported_matrices_march_as_the_system_they_are_of(d, scheme):
    """M, C and K of fem.assemble, with both kinds of mass and with friction, as PETSc and as scipy
    matrices."""
    system, surface = block(d)
    space, whole = system.space, surface.whole()
    every = np.arange(round(COMM.allreduce(len(space.nodes))))
    points = space.at_nodes(every, space.points)
    mats = [getattr(system, name).mat for name in "MCK"]
    own = fem.system_from_matrices(*mats, coordinates=space.points, v0=system.v0)
    assert own.floating and np.array_equal(own.space.bodies, space.bodies)
    cases = [own]
    if COMM.size == 1:
        table = np.column_stack(np.divmod(space.ids, d))
        cases += [
            vc.system_from_arrays(
                *map(rows_of, mats), coordinates=points, unknowns=table, v0=system.v0
            )
        ]
    wanted = history(
        vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3)), every, scheme=scheme
    )
    for body in cases:
        node = body.space.find_nodes(whole.points)
        contact = vc.contact_points(
            body, node, whole.normals, weights=whole.weights, gap0=whole.gap0
        )
        problem = vc.ContactProblem(body, contact, friction=vc.Coulomb(0.3))
        assert same(wanted, history(problem, body.space.find_nodes(points), scheme=scheme), 1e-12)


@pytest.mark.two_ranks
def test_other_matrices_on_the_unknowns_of_a_body():
    """A matrix of all components, reduced to the free ones, takes the place of K: surfaces fit, no
    factor is old."""
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), COMM)
    system = fem.assemble(mesh, SOFT, clamped=tags["left"], loads=fem.BodyForce((0.0, -1e3)))
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, -1.0), (0.0, 1.0))
    )
    u = vc.static_equilibrium(vc.ContactProblem(system, surface)).u
    stiff = PetscMatrix(system.space.reduce(system.space.forms.matrix("K")))
    stiff.mat.scale(2.0)
    other = system.changed(K=stiff)
    assert vc.static_equilibrium(vc.ContactProblem(other, surface)).u == pytest.approx(
        0.5 * u, rel=1e-10
    )


def shared(csr: Any, per_node: int) -> tuple[Any, slice]:
    """A scipy matrix as a PETSc matrix, whole nodes on every rank, and which rows are here."""
    nodes = csr.shape[0] // per_node
    ends = per_node * (np.arange(COMM.size + 1) * nodes // COMM.size)
    here = slice(ends[COMM.rank], ends[COMM.rank + 1])
    return aij_of(sp.csr_matrix(csr)[here], COMM), here


def test_frame_on_ranks():
    """A portal with rotations, clamped feet, an oblique stop with friction: the serial run, on any
    number of ranks."""
    nodes = np.concatenate(
        [
            line([0.0, 0.0], [0.0, 3.0], 4),
            line([0.0, 3.0], [4.0, 3.0], 4)[1:],
            line([4.0, 3.0], [4.0, 0.0], 4)[1:],
        ]
    )
    parts = frame(nodes, [(i, i + 1) for i in range(12)], EA=5e5, EI=2e3, rho_A=3.0)
    v0, contact = np.tile([1.0, -0.5, 0.0], 13), ([8, 6], [[1.0, 0.2], [0.1, -1.0]])
    alone = vc.system_from_arrays(**parts, clamped=[0, 1, 2, 36, 37, 38], v0=v0)
    (M, here), (K, _) = (shared(parts[name], 3) for name in "MK")
    own = slice(here.start // 3, here.stop // 3)
    clamped = [row - here.start for row in (0, 1, 2, 36, 37, 38) if here.start <= row < here.stop]
    meaning = parts["unknowns"][here] - [own.start, 0]
    given = {"unknowns": meaning, "clamped": clamped, "v0": v0[here]}
    system = fem.system_from_matrices(M, None, K, coordinates=nodes[own], **given)
    assert not system.floating and not alone.floating
    runs = []
    for one in (alone, system):
        surface = vc.contact_points(one, *contact, gap0=1e-3, weights=0.01)
        problem = vc.ContactProblem(
            one, surface, friction=vc.Coulomb(0.3), mass=vc.ConsistentMass()
        )
        runs.append(history(problem, np.arange(13), scheme=vc.ContactStabilisedNewmark()))
    assert same(*runs, 1e-11)
    heavy = vc.with_weight(system)
    weight = COMM.allreduce(heavy.load.constant @ heavy.influence[:, 1])
    assert weight == pytest.approx(
        vc.with_weight(alone).load.constant @ alone.influence[:, 1], rel=1e-13
    )


def test_restart_on_ranks(shared_tmp):
    """The straight run, with a ledger that closes and frames whose nodes are all there."""
    M, K = bar_matrices(12, length=1.0, E=1e6, rho=1000.0)
    (mass, here), (stiffness, _) = shared(M, 1), shared(K, 1)
    points = line([0.0], [1.0], 12)[here]
    system = fem.system_from_matrices(
        mass, None, stiffness, coordinates=points, v0=np.ones(len(points))
    )
    problem = vc.ContactProblem(system, vc.contact_points(system, [12], [1.0], gap0=1e-3))
    given = {
        "dt": 2e-4,
        "progress": False,
        "record": [vc.Energy(), vc.Contact(), vc.Probe({"end": (0.0,)})],
    }
    straight = vc.simulate(problem, steps=40, **given)
    vc.simulate(problem, steps=20, out=shared_tmp, fields=fem.XDMF(every=20), **given)
    again = vc.simulate(
        problem, steps=40, out=shared_tmp, fields=fem.XDMF(every=20), restart=True, **given
    )
    assert (
        straight.facts["energy_defect"] <= 1e-10
        and np.max(straight.history["contact_resultant"]) > 0.0
    )
    for name in ("u_x_end", "contact_resultant", "energy_strain"):
        size = np.max(np.abs(straight.history[name]))
        assert again.history[name] == pytest.approx(
            straight.history[name], rel=1e-9, abs=1e-9 * size
        )
    assert (shared_tmp / "fields.xdmf").read_text().count('NumberOfElements="13"') == 3


def test_bodies_and_node_against_node_on_ranks():
    """Two bars in a row, lumped: two bodies wherever the ranks part them, and the serial run."""
    M, K = bar_matrices(12, length=1.0, E=1e6, rho=1000.0, lumped=True)
    points = np.concatenate([line([0.0], [1.0], 12), line([1.001], [2.001], 12)])
    mass, stiffness = np.tile(M.diagonal(), 2), sp.block_diag([K, K], format="csr")
    v0 = np.repeat([1.0, 0.0], 13)
    alone = vc.system_from_arrays(mass, None, stiffness, coordinates=points, v0=v0)
    mat, here = shared(stiffness, 1)
    vector = PETSc.Vec().createWithArray(mass[here].copy(), comm=COMM)
    system = fem.system_from_matrices(vector, None, mat, coordinates=points[here], v0=v0[here])
    assert np.array_equal(system.space.bodies, alone.space.bodies[here])
    runs = []
    for one in (alone, system):
        surface = vc.contact_points(one, [12], [1.0], opposite=[13])
        problem = vc.ContactProblem(one, surface, mass=vc.ConsistentMass())
        runs.append(history(problem, np.arange(26), scheme=vc.MoreauJean()))
    assert same(*runs, 1e-11)


def test_stiffness_that_is_not_symmetric_on_ranks():
    """By Volume() and Lemke's method on any number of ranks the serial run; other solvers refuse
    it."""
    M, K = bar_matrices(12, length=1.0, E=1e6, rho=1000.0)
    K = sp.csr_matrix(K + sp.diags([np.full(12, 1e6)], [1]))
    points, v0 = line([0.0], [1.0], 12), np.full(13, 1.0)
    alone = vc.system_from_arrays(M, None, K, coordinates=points, v0=v0)
    (mass, here), (stiffness, _) = shared(M, 1), shared(K, 1)
    system = fem.system_from_matrices(mass, None, stiffness, coordinates=points[here], v0=v0[here])
    runs = []
    for one in (alone, system):
        problem = vc.ContactProblem(
            one, vc.contact_points(one, [12], [1.0]), mass=vc.ConsistentMass()
        )
        for solver in (vc.Volume(), vc.Condensed(Lemke())):
            runs.append(history(problem, np.arange(13), scheme=vc.MoreauJean(), solver=solver))
        with pytest.raises(InputError, match="needs symmetric matrices"):
            history(problem, np.arange(13), scheme=vc.MoreauJean())
    assert all(same(runs[0], other, 1e-9) for other in runs[1:])


@pytest.mark.two_ranks
def test_function_space_in_place_of_coordinates():
    """Nodes of any degree: the block of a space is a node. Numbers are found by points."""
    system, _ = block(2)
    V = system.space.V
    own = fem.system_from_matrices(system.M.mat, None, system.K.mat, coordinates=V)
    node = own.space.find_nodes(np.array([[2.0, 0.0]]))
    surface = vc.contact_points(own, node, [0.0, -1.0])
    assert surface.everywhere(surface.points) == pytest.approx(np.array([[2.0, 0.0]]))


@pytest.mark.two_ranks
def test_bad_matrices():
    """One sentence, on all ranks, before any work."""
    system, _ = block(2)
    M, C, K = (getattr(system, name).mat for name in "MCK")
    few = aij_of(sp.identity(3, format="csr"), COMM)
    skew = aij_of(
        sp.csr_matrix(
            rows_of(K)
            + (COMM.rank == COMM.size - 1)
            * 1e4
            * sp.eye(K.getLocalSize()[0], K.getSize()[0], k=K.getOwnershipRange()[0] - 1)
        ),
        COMM,
    )
    points = system.space.points
    loose = PETSc.Mat().createAIJ(K.getSizes(), comm=COMM)
    dense = PETSc.Mat().createDense(K.getSizes(), comm=COMM)
    dense.setUp()
    dense.assemble()
    for matrices, given, said in (
        ((M, C, "K"), {}, "K is 'K'; give a PETSc.Mat, or scipy matrices to vc.system_from_arrays"),
        ((M, 1.0, K), {}, "C is 1.0; give a PETSc.Mat"),
        ((skew, C, K), {}, "M is not symmetric"),
        ((few, C, K), {}, "M has .* rows and columns on this rank"),
        ((np.ones(3), C, K), {}, r"M has shape \(3,\)"),
        ((M, dense, K), {}, "C is of type .*dense; give AIJ"),
        ((loose, C, K), {}, "M is not assembled"),
        ((M, C, K), {"coordinates": points[1:]}, "K has .* rows, and .* nodes have .* components"),
        ((M, C, K), {"coordinates": np.zeros((len(points), 4))}, "give 1, 2 or 3 coordinates"),
    ):
        with pytest.raises(InputError, match=said):
            fem.system_from_matrices(*matrices, **({"coordinates": points} | given))
    # of one rank, told on all
    with pytest.raises(InputError, match="clamped goes from 1000000 to 1000000"):
        fem.system_from_matrices(
            M, C, K, coordinates=points, clamped=[10**6] if COMM.rank == COMM.size - 1 else ()
        )
    if COMM.size > 1:
        alone = aij_of(sp.identity(K.getLocalSize()[0], format="csr"), MPI.COMM_SELF)
        with pytest.raises(InputError, match="C and K are on different communicators"):
            fem.system_from_matrices(M, alone, K, coordinates=points)
