"""Contact of tetrahedra of second order: conditions at vertices with the mean bubbles of edges in
them.

Shares of bubbles on flat and curved facets, patch tests with one body, at a corner and between two,
sticking and sliding, turned bodies, moved supports, thrown bodies with friction, the same on any
number of ranks.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import dolfinx.mesh
from caps import Cap, CapMesh, Caps
from curved_cells import Curved, mesh_of, wavy
from fem_problems import max_over_ranks, nodal
from mpi4py import MPI
from own_meshes import at
from spheres import RADIUS, SLOPE, STEEL
from two_bodies import SOFT, blocks, momenta, per_body, thrown

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.fem.contact.bubbles import OTHERS, _integrate
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import arrays_from_script

COMM = MPI.COMM_WORLD
P, MU = 1.0e4, 0.3
COARSE: dict[str, Any] = {"lengths": (2.0, 1.5, 1.2), "divisions": (2, 2, 2), "simplices": True}
curved = pytest.mark.parametrize("curved", [False, True], ids=["straight", "curved"])


@pytest.mark.two_ranks
def test_the_shares_of_bubbles_on_flat_and_curved_facets() -> None:
    """A/5 for the edges at a vertex, -A/15 for the other; their sum over vertices is ∫ b_k on any
    facet."""
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.3, 0.1], [0.4, 1.0, -0.2]])
    flat = np.concatenate([corners, corners[OTHERS].mean(axis=1)])[None]
    area = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    sizes, shares = _integrate(flat)
    assert np.allclose(sizes, area / 3.0, rtol=1e-14)
    assert np.allclose(
        shares, area * (1.0 / 5.0 - np.eye(3) * 4.0 / 15.0), rtol=0.0, atol=1e-14 * area
    )
    bent = flat + np.concatenate(
        [np.zeros((3, 3)), [[0.0, 0.0, 0.3], [0.1, 0.0, 0.2], [0.0, -0.1, 0.1]]]
    )
    sizes, shares = _integrate(bent)
    s, t = (one.ravel() for one in np.meshgrid(*[(np.arange(400) + 0.5) / 400] * 2, indexing="ij"))
    # midpoints of a square, folded
    s, t = (np.where(s + t > 1.0, 1.0 - s, s), np.where(s + t > 1.0, 1.0 - t, t))
    hats = np.stack([1.0 - s - t, s, t])
    bubbles = 4.0 * hats[OTHERS].prod(axis=1)
    slopes = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    rates = 4.0 * np.einsum("kaq,kag->kgq", hats[OTHERS], slopes[OTHERS[:, ::-1]])
    e = bent[0, 3:] - bent[0, OTHERS].mean(axis=1)
    along = np.einsum("ix,ig->gx", bent[0, :3], slopes)[:, None] + np.einsum(
        "kx,kgq->gqx", e, rates
    )
    density = 0.5 * np.linalg.norm(np.cross(along[0], along[1]), axis=1) / len(s)
    assert np.allclose(sizes[0], hats @ density, rtol=1e-4)
    assert np.allclose(shares[0].sum(axis=0), bubbles @ density, rtol=1e-4)


def sheared(x: Array) -> Array:
    """Displacements under sigma_yy = -P and sigma_xy = MU P without Poisson's effect, zero at y =
    0."""
    return np.column_stack(
        [2.0 * MU * P / STIFF.E * x[:, 1], -P / STIFF.E * x[:, 1], np.zeros(len(x))]
    )


STIFF = vc.LinearElastic(E=1.0e6, nu=0.0, rho=1000.0)


def side_loads(tags: Any, names: tuple[str, ...]) -> list[Any]:
    """Shear on left and right sides that goes with sigma_xy = MU P."""
    return [
        fem.Traction(tags[f"{name}{side}"], (0.0, sign * MU * P, 0.0))
        for name in names
        for side, sign in (("left", -1.0), ("right", 1.0))
    ]


@curved
def test_a_uniform_pressure_is_exact(curved: bool) -> None:
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", curved), COMM)
    rollers = [
        fem.Prescribed(tags[side], components=(c,)) for c, side in ((0, "left"), (2, "back"))
    ]
    system = fem.assemble(
        mesh, SOFT, prescribed=rollers, loads=fem.Traction(tags["top"], (0.0, -P, 0.0)), degree=2
    )
    surface = fem.contact_surface(system, tags["bottom"])
    problem = vc.ContactProblem(system, surface)
    state = vc.static_equilibrium(problem)
    assert surface.total == 9
    assert np.all(surface.weights > 0.0)
    assert np.allclose(state.r_n, P * surface.weights, rtol=1e-10, atol=0.0)
    strain = P / SOFT.E * np.array([SOFT.nu, -1.0, SOFT.nu])
    exact = nodal(system, lambda x: x * strain)
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-10 * max_over_ranks(
        COMM, exact
    )


def at_rest(
    system: vc.SemiDiscreteSystem,
    surface: vc.ContactSurface,
    limit: float,
    slip: float,
    tolerance: float,
) -> tuple[vc.ContactProblem, vc.State]:
    """The equilibrium: its pressure and shear are uniform to 1e-10, its slip is this to the
    tolerance."""
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(limit))
    state = vc.static_equilibrium(problem, tolerance=1e-13)
    assert np.allclose(state.r_n, P * surface.weights, rtol=1e-10, atol=0.0)
    assert state.r_t is not None
    assert np.allclose(
        np.linalg.norm(state.r_t, axis=1), MU * P * surface.weights, rtol=1e-10, atol=0.0
    )
    assert np.allclose(
        np.linalg.norm(surface.slip(state.u, 0.0), axis=1), slip, rtol=0.0, atol=tolerance
    )
    return problem, state


@pytest.mark.two_ranks
@curved
@pytest.mark.parametrize("limit", [2.0 * MU, MU], ids=["sticks", "slides"])
def test_pressure_and_shear_are_exact_with_friction(curved: bool, limit: float) -> None:
    """A block under uniform pressure and shear, its top moved along: below Coulomb's limit and just
    at it."""
    slip = 0.0 if limit > MU else 0.01
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", curved), COMM)
    top = float(sheared(np.array([[0.0, 1.5, 0.0]]))[0, 0]) + slip
    held = [
        fem.Prescribed(tags["back"], components=(2,)),
        fem.Prescribed(tags["top"], displacement=(top, 0.0, 0.0), components=(0,)),
    ]
    loads = [fem.Traction(tags["top"], (0.0, -P, 0.0)), *side_loads(tags, ("",))]
    system = fem.assemble(mesh, STIFF, prescribed=held, loads=loads, degree=2)
    surface = fem.contact_surface(system, tags["bottom"])
    problem, state = at_rest(system, surface, limit, slip, 1e-9 * top)
    exact = nodal(system, lambda x: sheared(x) + np.array([slip, 0.0, 0.0]))
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-9 * max_over_ranks(
        COMM, exact
    )


def bent_bodies(x: Array) -> Array:
    """Bend two blocks of heights 1 on one another inside, the sides and the interface stay where
    they are."""
    bump = np.prod(np.sin(np.pi * x / np.array([1.5, 1.0, 1.2])), axis=1)
    return x + 0.06 * bump[:, None] * np.array([1.0, -0.7, 0.5])


@curved
@pytest.mark.parametrize("limit", [2.0 * MU, MU], ids=["sticks", "slides"])
def test_pressure_and_shear_go_through_two_bodies(curved: bool, limit: float) -> None:
    both = blocks(3, upper=(2, 1, 2), lower=(2, 2, 2), simplices=True)
    mesh, tags = fem.build_mesh(Curved(both, bent_bodies) if curved else both, COMM)
    slip = 0.0 if limit > MU else 0.01
    low = COMM.allreduce(np.min(mesh.geometry.x[:, 1]), op=MPI.MIN)
    high = COMM.allreduce(np.max(mesh.geometry.x[:, 1]), op=MPI.MAX)
    top = 2.0 * MU * P / STIFF.E * (high - low) + slip
    held = [
        fem.Prescribed(tags["lower_bottom"], components=(0, 1)),
        fem.Prescribed(tags["upper_top"], displacement=(top, 0.0, 0.0), components=(0,)),
    ]
    held += [fem.Prescribed(tags[f"{name}_back"], components=(2,)) for name in ("lower", "upper")]
    loads = [
        fem.Traction(tags["upper_top"], (0.0, -P, 0.0)),
        *side_loads(tags, ("lower_", "upper_")),
    ]
    system = fem.assemble(mesh, STIFF, prescribed=held, loads=loads, degree=2)
    surface = fem.contact_pair(system, *(tags[side] for side in both.interface))
    problem, state = at_rest(system, surface, limit, slip, 1e-9 * top)

    def moved(x: Array, way: float) -> Array:
        return sheared(x - np.array([0.0, low, 0.0])) + np.array([way, 0.0, 0.0])

    # the lower one is the first
    exact = per_body(system, lambda x: moved(x, 0.0), lambda x: moved(x, slip))
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-9 * top


@pytest.mark.two_ranks
def test_a_corner_carries_the_pressure_of_both_faces() -> None:
    """A parallelepiped pressed into a corner of oblique walls by a uniform pressure on all else."""
    lean = np.array([[1.0, 0.3, 0.0], [0.0, 1.0, 0.0], [0.2, 0.1, 1.0]])
    mesh, tags = fem.build_mesh(BlockMesh(**COARSE, deform=lambda x: wavy(x) @ lean), COMM)
    outward = np.linalg.inv(lean)  # columns are normals of the faces
    outward /= np.linalg.norm(outward, axis=0)
    loads = [
        fem.Traction(tags[name], tuple(-sign * P * outward[:, axis]))
        for name, axis, sign in (
            ("right", 0, 1.0),
            ("top", 1, 1.0),
            ("front", 2, 1.0),
            ("back", 2, -1.0),
        )
    ]
    both = fem.Facets("both", np.concatenate([tags["bottom"].indices, tags["left"].indices]), mesh)
    system = fem.assemble(mesh, SOFT, loads=loads, degree=2)
    surface = fem.contact_surface(system, both)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    assert surface.total == 18
    assert np.allclose(state.r_n, P * surface.weights, rtol=1e-8, atol=0.0)


@pytest.mark.serial
def test_turning_everything_changes_nothing() -> None:
    """A block pressed obliquely onto a half-space with friction, and the same turned in space:
    equal reactions."""
    turn = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    reactions = []
    for R in (np.eye(3), turn):
        mesh, tags = fem.build_mesh(BlockMesh(**COARSE, deform=lambda x, R=R: wavy(x) @ R.T), COMM)
        load = fem.Traction(tags["top"], tuple(R @ [0.2 * P, -P, 0.1 * P]))
        system = fem.assemble(mesh, SOFT, loads=load, degree=2)
        ground = vc.HalfSpace((0.0, 0.0, 0.0), tuple(R @ [0.0, 1.0, 0.0]))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
        state = vc.static_equilibrium(vc.ContactProblem(system, surface, friction=vc.Coulomb(0.5)))
        assert state.r_t is not None
        reactions.append(
            surface.everywhere(np.column_stack([state.r_n, np.linalg.norm(state.r_t, axis=1)]))
        )
    assert np.allclose(*reactions, rtol=0.0, atol=1e-9 * P)


@pytest.mark.two_ranks
def test_moved_supports_move_the_conditions_beside_them() -> None:
    """A side that is moved along the ground takes the free body with it: every condition slips by
    as much."""
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", False), COMM)
    way = np.array([0.02, 0.01])
    held = fem.Prescribed(tags["left"], displacement=(way[0], 0.0, way[1]), components=(0, 2))
    rigid = vc.LinearElastic(E=1.0e12, nu=0.0, rho=1000.0)
    system = fem.assemble(
        mesh, rigid, prescribed=held, loads=fem.BodyForce((0.0, -1.0, 0.0)), degree=2
    )
    surface = fem.contact_surface(system, tags["bottom"])
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    free = surface.tangents >= 0
    assert np.all(free.sum(axis=1) != 1)
    slips = np.abs(surface.slip(state.u, 0.0))[free].reshape(-1, 2)
    assert np.allclose(np.sort(slips), np.sort(way), rtol=0.0, atol=1e-7)


def thrown_block(comm: Any, lumping: float = 0.4) -> vc.ContactProblem:
    """A free block with spin, thrown obliquely onto a rough plane."""
    finer = COARSE | {"divisions": (3, 3, 3)}
    mesh, tags = fem.build_mesh(BlockMesh(**finer, deform=wavy), comm)
    system = fem.assemble(mesh, SOFT, degree=2)
    spin, speed = np.array([0.3, 0.2, -0.4]), np.array([0.5, -1.0, 0.2])
    system = thrown(system, lambda x: speed + np.cross(spin, x - np.array([1.0, 0.75, 0.6])))
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, -0.01, 0.0), (0.0, 1.0, 0.0))
    )
    return vc.ContactProblem(
        system, surface, friction=vc.Coulomb(0.3), mass=vc.Redistributed(lumping)
    )


@pytest.mark.long
def test_a_thrown_block_keeps_its_energy_on_any_number_of_ranks() -> None:
    found = []
    for comm in (COMM, MPI.COMM_SELF):
        problem = thrown_block(comm)
        solution = vc.simulate(problem, dt=2e-3, steps=25, progress=False)
        history = solution.history
        found.append(np.column_stack([history["contact_resultant"], history["contact_active"]]))
        energy = history["energy_kinetic"][0]
        assert np.max(history["certificate"]) < 1e-9
        assert np.max(np.abs(history["energy_defect"])) < 1e-9 * energy
        assert -0.2 * energy < history["loss_friction"][-1] < 0.2 * energy
        assert history["contact_resultant"].max() > 0.0
    assert np.allclose(*found, rtol=0.0, atol=1e-8 * found[1].max())


@pytest.mark.long
def test_a_tied_layer_carries_the_same_along_it_on_any_number_of_ranks() -> None:
    """A layer hung over a plane that it presses, tied and pulled along x: reactions that depend on
    y alone."""
    found = []
    for comm in (COMM, MPI.COMM_SELF):
        mesh = dolfinx.mesh.create_box(comm, [np.zeros(3), np.array([2.0, 1.0, 1.0])], [4, 3, 3])
        left, right, bottom, top = (
            fem.Facets.where(name, mesh, at(axis, x))
            for name, axis, x in (
                ("left", 0, 0.0),
                ("right", 0, 2.0),
                ("bottom", 2, 0.0),
                ("top", 2, 1.0),
            )
        )
        loads = fem.BodyForce((3.0e3, 0.0, -5.0e4))
        system = fem.assemble(
            mesh, SOFT, clamped=top, tied=fem.Tied(left, right), loads=loads, degree=2
        )
        surface = fem.contact_surface(
            system, bottom, obstacle=vc.HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        )
        state = vc.static_equilibrium(vc.ContactProblem(system, surface), tolerance=1e-10)
        points, r_n = surface.everywhere(surface.points), surface.everywhere(state.r_n)
        found.append(r_n[np.lexsort(points[:, :2].round(6).T)].reshape(4, 4))
    assert found[1].min() > 0.0
    for rows in found:
        assert np.allclose(rows, rows[:, :1], rtol=0.0, atol=1e-8 * rows.max())
    assert np.allclose(*found, rtol=0.0, atol=1e-8 * found[1].max())


@pytest.mark.long
@pytest.mark.serial
def test_mass_of_rigid_motions_is_kept() -> None:
    """Redistributed mass has the total mass, centre and inertia of the body and none at the contact
    nodes."""
    problem = thrown_block(COMM)
    system, equations = problem.system, problem.equations
    x = system.space.points - np.array([1.0, 0.75, 0.6])
    modes = [np.tile(axis, (len(x), 1)) for axis in np.eye(3)] + [
        np.cross(axis, x) for axis in np.eye(3)
    ]
    before, after = [], []
    for one in modes:
        u = system.space.restrict(one)
        w = problem.surface.in_frames(u)
        w = 2.0 * w - problem.surface.coupling @ w
        before.append(system.kinetic_energy(u))
        after.append(equations.kinetic_energy(w))
    assert np.allclose(before, after, rtol=1e-9, atol=0.0)
    assert not np.any(equations.M.diagonal()[problem.surface.owned])
    assert np.allclose(
        equations.M.diagonal(), thrown_block(COMM, 0.0).equations.M.diagonal(), rtol=1e-12
    )


@pytest.mark.long
def test_two_thrown_blocks_keep_momentum_and_energy() -> None:
    both = blocks(3, upper=(3, 3, 3), lower=(3, 3, 3), simplices=True, gap=0.01)
    mesh, tags = fem.build_mesh(both, COMM)
    speed = np.array([0.3, -1.0, 0.1])
    system = thrown(
        fem.assemble(mesh, SOFT, degree=2), lambda x: 0.0 * x, lambda x: np.tile(speed, (len(x), 1))
    )
    problem = vc.ContactProblem(
        system,
        fem.contact_pair(system, *(tags[side] for side in both.interface)),
        friction=vc.Coulomb(0.3),
    )
    solution = vc.simulate(problem, dt=2e-3, steps=25, progress=False)
    history, before = solution.history, SOFT.rho * 1.5 * 1.0 * 1.2 * speed
    assert np.max(history["certificate"]) < 1e-9
    assert np.max(np.abs(history["energy_defect"])) < 1e-9 * history["energy_kinetic"][0]
    assert history["contact_resultant"].max() > 0.0
    after = momenta(solution.problem, solution.state.v)
    assert np.allclose(after.sum(axis=0), before, rtol=0.0, atol=1e-9 * np.abs(before).max())
    assert abs(after[0, 1]) > 0.01 * np.abs(before).max()


@pytest.mark.slow
@pytest.mark.serial  # blocks and layers above are the same on any number of ranks
def test_a_sphere_of_curved_cells_on_a_plane() -> None:
    """Hertz: P2 tetrahedra with their mid-points on the sphere, 2 and 3 cells across the contact's
    half-width; in the mean over three approaches the force is 7 % and 4 % too small, the pressures
    are 21 % and 14 % off in L2."""
    errors = []
    for cells in (2.0, 3.0):
        caps = Caps(
            [Cap(RADIUS, STEEL, cells)],
            SLOPE * RADIUS,
            simplices=True,
            pressed=lambda t: 0.9 + 0.1 * t,
        )
        flat = arrays_from_script(
            CapMesh([replace(caps.caps[0], radius=np.inf)], caps.a, (), simplices=True)
        )
        curved = Curved(
            flat, lambda x, cap=caps.caps[0]: x + np.outer(cap.sagitta(x), [0.0, 1.0, 0.0])
        )
        mesh, tags = fem.build_mesh(curved, COMM)
        held = [fem.Prescribed(tags["upper_far"], displacement=caps._far(0))]
        held += [
            fem.Prescribed(tags[f"upper_{axis}"], components=(c,))
            for c, axis in ((0, "x"), (2, "z"))
        ]
        system = fem.assemble(mesh, STEEL, prescribed=held, degree=2)
        plane = vc.HalfSpace((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        surface = fem.contact_surface(system, tags["upper_foot"], obstacle=plane)
        weights, points = surface.everywhere(surface.weights), surface.everywhere(surface.points)
        rows = []
        for state in vc.quasi_static(
            vc.ContactProblem(system, surface), range(3), solver=vc.Condensed()
        ):
            exact, r_n = (
                caps.exact_at(caps.a * caps.pressed(state.t)),
                surface.everywhere(state.r_n),
            )
            p = exact.pressure(np.hypot(points[:, 0], points[:, 2]))
            off = np.sqrt(weights @ (r_n / weights - p) ** 2 / (weights @ p**2))
            rows.append((abs(r_n.sum() / caps.share / exact.force - 1.0), off))
        errors.append(np.mean(rows, axis=0))
    assert np.all(errors[1] < (0.06, 0.2))
    assert np.all(errors[1] < 0.8 * errors[0])


@pytest.mark.two_ranks
def test_wrong_uses_are_refused() -> None:
    both = blocks(3, upper=(2, 1, 2), lower=(2, 2, 2), simplices=True)
    mesh, tags = fem.build_mesh(both, COMM)
    system = fem.assemble(mesh, SOFT, degree=2)
    one, two = (tags[side] for side in both.interface)
    with pytest.raises(InputError, match="matched by matching=NodeToNode"):
        fem.contact_pair(system, one, two, matching=fem.DualMortar())
    wall = fem.contact_surface(system, tags["lower_right"])
    with pytest.raises(
        InputError, match="nodes of P2 tetrahedra have one contact condition for each unknown"
    ):
        fem.joined_surfaces(fem.contact_pair(system, one, two), wall)
    joined = fem.joined_surfaces(
        fem.contact_pair(system, one, two), fem.contact_surface(system, tags["lower_bottom"])
    )
    assert joined.total == 18


@pytest.mark.long
@pytest.mark.serial
def test_fields_have_the_pressure_at_all_nodes_of_the_contact(tmp_path: Any) -> None:
    """Vertices have that of their condition, mid-points the mean of two; the Function is the
    same."""
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", False), COMM)
    system = fem.assemble(mesh, SOFT, loads=fem.Traction(tags["top"], (0.0, -P, 0.0)), degree=2)
    problem = vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"]), friction=vc.Coulomb(0.3)
    )
    state, space = vc.static_equilibrium(problem), system.space
    solution = vc.simulate(
        problem,
        dt=1e-3,
        steps=1,
        state=state,
        out=tmp_path,
        fields=fem.XDMF(every=1),
        progress=False,
    )
    found, stored = (
        fem.as_function(problem, state, "contact_pressure"),
        solution.function("contact_pressure", frame=0),
    )
    assert np.allclose(found.x.array, stored.x.array, rtol=0.0, atol=1e-9 * P)
    values = np.tile(found.x.array[: len(space.nodes), None], 3)
    low = np.abs(space.points[:, 1]) < 1e-12
    assert np.all(values[low] > 0.5 * P)
    assert not values[~low].any()
    vertices = space.hierarchy.vertices[1]
    assert (
        np.max(
            np.abs(
                space.hierarchy.split_bubbles(values)[np.setdiff1d(np.flatnonzero(low), vertices)]
            )
        )
        < 1e-12 * P
    )
    assert np.allclose(
        np.sort(values[np.intersect1d(np.flatnonzero(low), vertices), 0]),
        np.sort(state.r_n / problem.surface.weights),
        rtol=1e-14,
    )
