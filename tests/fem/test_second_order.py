"""Displacements of second order: numbers of mid-points on any ranks, patch tests of contact, rates,
refusals."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from curved_cells import SHAPES, Curved, mesh_of
from fem_problems import BODIES, block, nodal
from mpi4py import MPI
from two_bodies import SOFT, blocks

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed, Traction
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import Facets, build_mesh
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import arrays_from_script
from vi_contact.run.static import static_equilibrium

COMM = MPI.COMM_WORLD
bodies = pytest.mark.parametrize("name", BODIES)


def everywhere(system: Any) -> tuple[Array, Array]:
    """(numbers, points) of all nodes."""
    found = COMM.allgather((system.space.nodes, system.space.points))
    return tuple(np.concatenate([part[i] for part in found]) for i in (0, 1))


@bodies
def test_mid_points_are_numbered_after_the_vertices_by_those_of_their_edges(name: str) -> None:
    arrays = arrays_from_script(BlockMesh(**BODIES[name]))
    mesh, _ = block(COMM, **BODIES[name])
    numbers, points = everywhere(assemble(mesh, SOFT, degree=2))
    assert np.array_equal(np.sort(numbers), np.arange(len(numbers)))
    points = points[np.argsort(numbers)]
    vertices, corner = len(arrays.points), arrays.cells.shape[1]
    assert np.allclose(points[:vertices], arrays.points, rtol=0.0, atol=1e-14)
    sides = {  # pairs of Gmsh's vertices of a cell that are edges
        "quadrilateral": [(0, 1), (1, 2), (2, 3), (3, 0)],
        "hexahedron": [
            (0, 1),
            (1, 2),
            (2, 3),
            (3, 0),
            (4, 5),
            (5, 6),
            (6, 7),
            (7, 4),
            (0, 4),
            (1, 5),
            (2, 6),
            (3, 7),
        ],
    }.get(arrays.cell, list(combinations(range(corner), 2)))
    edges = np.unique(np.sort(arrays.cells[:, np.array(sides)].reshape(-1, 2), axis=1), axis=0)
    middles = arrays.points[edges].mean(axis=1)
    assert np.allclose(points[vertices:][: len(edges)], middles, rtol=0.0, atol=1e-14)
    if arrays.cell in ("quadrilateral", "hexahedron"):
        found, centres = (
            points[len(points) - len(arrays.cells) :],
            arrays.points[arrays.cells].mean(axis=1),
        )
        order = [np.lexsort(np.round(one, 9).T) for one in (found, centres)]
        assert np.allclose(found[order[0]], centres[order[1]], rtol=0.0, atol=1e-14)
    else:
        assert len(points) == vertices + len(edges)


shapes = pytest.mark.parametrize("name", [name for name in SHAPES if name != "tetrahedra"])
curved = pytest.mark.parametrize("curved", [False, True], ids=["straight", "curved"])
PRESSURE = 1.0e4


def pressed_down(x: Array) -> Array:
    """The displacement of a free block under a uniform pressure on its top, plane strain in the
    plane."""
    E, nu, d = SOFT.E, SOFT.nu, x.shape[1]
    strain = np.full(d, nu * (1.0 + nu if d == 2 else 1.0) * PRESSURE / E)
    strain[1] = -(1.0 - nu**2 if d == 2 else 1.0) * PRESSURE / E
    return x * strain


@pytest.mark.two_ranks
@shapes
@curved
@pytest.mark.promise("guide/second_order.md", "passed on exactly, on curved cells too")
def test_a_uniform_pressure_is_exact_at_every_node_of_a_rigid_support(
    name: str, curved: bool
) -> None:
    mesh, tags = build_mesh(mesh_of(name, curved), COMM)
    rollers = [
        Prescribed(tags[side], components=(c,))
        for c, side in ((0, "left"), (2, "back"))
        if side in tags
    ]
    load = Traction(tags["top"], (0.0, -PRESSURE, 0.0)[: mesh.geometry.dim])
    system = assemble(mesh, SOFT, prescribed=rollers, loads=load, degree=2)
    surface = contact_surface(system, tags["bottom"])
    state = static_equilibrium(ContactProblem(system, surface))
    assert surface.total == (5**2 if name == "hexahedra" else 7)
    assert np.allclose(state.r_n, PRESSURE * surface.weights, rtol=1e-10, atol=0.0)
    exact = nodal(system, pressed_down)
    assert np.allclose(
        state.u, exact, rtol=0.0, atol=1e-10 * np.abs(exact).max(initial=1e-300) + 1e-16
    )


PAIRS: dict[str, dict[str, Any]] = {
    "triangles": {"d": 2, "simplices": True},
    "quadrilaterals": {"d": 2},
    "hexahedra": {"d": 3, "upper": (2, 2, 2), "lower": (2, 1, 2)},
}


def bent_bodies(x: Array) -> Array:
    """Bend two blocks of heights 1 on one another inside, the sides and the interface stay where
    they are."""
    lengths = np.array([1.5, 1.0, 1.2])[: x.shape[1]]
    bump = np.prod(np.sin(np.pi * x / lengths), axis=1)
    return x + 0.06 * bump[:, None] * np.array([1.0, -0.7, 0.5])[: x.shape[1]]


@pytest.mark.parametrize("name", PAIRS)
@curved
def test_a_uniform_pressure_goes_through_the_nodes_between_two_bodies(
    name: str, curved: bool
) -> None:
    both = blocks(**PAIRS[name])
    mesh, tags = build_mesh(Curved(both, bent_bodies) if curved else both, COMM)
    held = [Prescribed(tags["lower_bottom"], components=(1,))]
    for c, side in ((0, "left"), (2, "back")):
        held += [
            Prescribed(tags[name], components=(c,))
            for name in (f"lower_{side}", f"upper_{side}")
            if name in tags
        ]
    load = Traction(tags["upper_top"], (0.0, -PRESSURE, 0.0)[: mesh.geometry.dim])
    system = assemble(mesh, SOFT, prescribed=held, loads=load, degree=2)
    surface = contact_pair(system, *(tags[side] for side in both.interface))
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem)
    assert surface.total == (5**2 if name == "hexahedra" else 9)
    assert np.allclose(state.r_n, PRESSURE * surface.weights, rtol=1e-10, atol=0.0)
    exact = nodal(system, pressed_down)
    assert np.allclose(
        problem.cartesian(state.u), exact, rtol=0.0, atol=1e-10 * 2.0 * PRESSURE / SOFT.E
    )


@pytest.mark.two_ranks
def test_conditions_that_do_not_serve_are_refused() -> None:
    both = blocks(2)
    mesh, tags = build_mesh(both, COMM)
    with pytest.raises(
        InputError, match=r"DualMortar joins facets of first order .* have mid-points"
    ):
        contact_pair(
            assemble(mesh, SOFT, degree=2),
            *(tags[side] for side in both.interface),
            matching=DualMortar(),
        )
    for degree in (0, 3, 2.5, True, "2"):
        with pytest.raises(
            InputError, match="assemble: degree is .*; give 1 for P1 and Q1, 2 for P2 and Q2"
        ):
            assemble(mesh, SOFT, degree=degree)
    mesh, _ = build_mesh(mesh_of("triangles", curved=True), COMM)
    with pytest.raises(InputError, match="the mesh has cells of second order; give degree=2"):
        assemble(mesh, SOFT)


def bent_interface(x: Array) -> Array:
    """Move the interface at the height of 1 to a wave, level at both ends; bottom and top stay
    where they are."""
    wave = 0.05 * (1.0 - np.cos(2.0 * np.pi * x[:, 0] / 1.5))
    return np.column_stack([x[:, 0], x[:, 1] + wave * (1.0 - np.abs(x[:, 1] - 1.0)), x[:, 2:]])


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", PAIRS)
def test_an_even_pressure_from_all_sides_goes_through_a_curved_interface(name: str) -> None:
    """Reactions are p times the length of ∫ n phi_i, the strain is the same all over both bodies;
    r_n over the weight is p but for the change of direction within a side, 3 % (measured 0.9)."""
    both = blocks(**PAIRS[name])
    mesh, tags = build_mesh(Curved(both, bent_interface), COMM)
    d = mesh.geometry.dim
    held = [Prescribed(tags["lower_bottom"], components=(1,))]
    loads = [Traction(tags["upper_top"], tuple(-PRESSURE * np.eye(d)[1]))]
    for c, low, high in ((0, "left", "right"), (2, "back", "front"))[: d - 1]:
        for body in ("lower", "upper"):
            held.append(Prescribed(tags[f"{body}_{low}"], components=(c,)))
            loads.append(Traction(tags[f"{body}_{high}"], tuple(-PRESSURE * np.eye(d)[c])))
    system = assemble(mesh, SOFT, prescribed=held, loads=loads, degree=2)
    surface = contact_pair(system, *(tags[side] for side in both.interface))
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem)
    bulk = (1.0 + SOFT.nu if d == 2 else 1.0) * (1.0 - 2.0 * SOFT.nu) / SOFT.E
    exact = nodal(system, lambda x: -PRESSURE * bulk * x)
    assert np.allclose(
        problem.cartesian(state.u), exact, rtol=0.0, atol=1e-10 * 2.0 * PRESSURE / SOFT.E
    )
    assert np.abs(state.r_n / surface.weights / PRESSURE - 1.0).max(initial=0.0) < 0.03
    assert surface.total == (25 if name == "hexahedra" else 9)


def rounded(x: Array) -> Array:
    """Map a square of side 2 (a cube) onto a disk of radius 1 (a ball), at even angles."""
    y = np.tan(0.25 * np.pi * (x - 1.0))
    reach, length = np.abs(y).max(axis=1), np.maximum(np.linalg.norm(y, axis=1), 1e-9)
    return y * (reach / length)[:, None]


@pytest.mark.parametrize("name", ["triangles", "quadrilaterals", "hexahedra"])
def test_few_curved_sides_are_a_smooth_face(name: str) -> None:
    """A disk and a ball of 8 curved sides round, whose planes turn by 45°: all nodes have one
    condition, along the radius. Those of a box keep two at its corners."""
    d = 3 if name == "hexahedra" else 2
    spec = {"lengths": (2.0,) * d, "divisions": (2,) * d, "simplices": name == "triangles"}
    mesh, tags = build_mesh(Curved(BlockMesh(**spec), rounded), COMM)
    sides = [group for group in tags.values() if isinstance(group, Facets)]
    outside = Facets("outside", np.concatenate([side.indices for side in sides]), mesh)
    surface = contact_surface(assemble(mesh, SOFT, degree=2), outside).whole()
    assert len(surface.nodes) == len(np.unique(surface.nodes)) == (98 if d == 3 else 16)
    assert np.linalg.norm(surface.normals - surface.points, axis=1).max() < 0.06
    mesh, tags = build_mesh(Curved(BlockMesh(**spec), lambda x: x), COMM)
    both = Facets("both", np.union1d(tags["bottom"].indices, tags["right"].indices), mesh)
    surface = contact_surface(assemble(mesh, SOFT, degree=2), both).whole()
    assert len(surface.nodes) - len(np.unique(surface.nodes)) == (5 if d == 3 else 1)
