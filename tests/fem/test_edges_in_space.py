"""Faces, edges and vertices in space: one to three conditions at a node at any angle, against rigid
faces and between bodies, beside symmetry planes, with friction along edges, with redistributed
mass; refusals (V2.8)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import dense, field, max_over_ranks
from mpi4py import MPI
from reference_lcp import enumerate_lcp
from turned_blocks import rotation, unlike
from two_bodies import SOFT, forces, momenta, per_body, relative, thrown

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import AnalyticGap
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.body.ties import Tied
from vi_contact.fem.compat import entities_to_geometry
from vi_contact.fem.contact.joined import joined_surfaces
from vi_contact.fem.contact.matching import NodeToNode
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import Facets, build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import PlaneStress
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks
from vi_contact.run.march import march
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import Volume

COMM = MPI.COMM_WORLD
serial = pytest.mark.serial
SHAPES = {  # edges of the cell as rows: faces at 90°, at 60° and 120° beside 90°, at no right angle
    "square": np.eye(3),
    "prism": np.array([[1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]]),
    "leaning": np.array([[1.0, 0.2, 0.1], [0.35, 1.0, -0.25], [-0.5, 0.3, 1.0]]),
}
PLACED = {
    "as it is": np.eye(3),
    "turned": rotation(1),
    "mirrored": np.eye(3)[[2, 0, 1]] @ np.diag([1.0, 1.0, -1.0]),
}
PIT = {"under": ("bottom", "top", 1), "west": ("left", "right", 0), "rear": ("back", "front", 2)}


def group(tags: Any, names: list[str], name: str = "hull") -> Facets:
    """Several groups as one."""
    indices = np.unique(np.concatenate([tags[one].indices for one in names]))
    return Facets(name, indices.astype(np.int32), tags[names[0]].mesh)


@dataclass(frozen=True)
class Corner:
    """A box of one cell in the corner of three rigid faces, or of three blocks, all on springs in
    proportion to their mass, so that nothing floats; ``n``: divisions of the blocks, which need not
    be those of the box."""

    shape: str
    place: str
    n: int = 0

    @property
    def map(self) -> Array:
        return SHAPES[self.shape] @ PLACED[self.place].T

    def build(self) -> tuple[ContactProblem, Array]:
        """(problem, B (12, unknowns)): rows of B in the order of faces, then of nodes; unknowns by
        their ids."""
        boxes = {"box": ((0.0, 0.0, 0.0), 1)}
        if self.n:
            boxes |= {name: (tuple(-np.eye(3)[axis]), self.n) for name, (_, _, axis) in PIT.items()}
        mesh = Blocks(
            {
                name: BlockMesh(
                    lengths=(1.0,) * 3,
                    divisions=(k, k, k),
                    corner=corner,
                    deform=lambda x: x @ self.map,
                )
                for name, (corner, k) in boxes.items()
            }
        )
        built, tags = build_mesh(mesh, COMM)
        push = {"top": (-3e3, -9e3, 2e3), "right": (-8e3, 5e3, 0.0), "front": (0.0, 3e3, -4e3)}
        loads = [
            Traction(tags[f"box_{face}"], tuple(PLACED[self.place] @ p)) for face, p in push.items()
        ]
        system = assemble(built, SOFT, loads=loads)
        system = system.changed(K=system.algebra.combine([(1.0, system.K), (30.0**2, system.M)]))
        hull = group(tags, [f"box_{face}" for face, _, _ in PIT.values()])
        if self.n:
            walls = group(tags, [f"{name}_{face}" for name, (_, face, _) in PIT.items()], "pit")
            surface = contact_pair(
                system, hull, walls, matching=NodeToNode() if self.n == 1 else DualMortar()
            )
        else:
            back = np.linalg.inv(self.map)
            surface = contact_surface(
                system, hull, obstacle=AnalyticGap(lambda x: gap_of(x @ back))
            )
        return ContactProblem(system, surface), self.rows(system)

    def rows(self, system: Any) -> Array:
        """n·u of the box, less that of the block that it faces there, by products of the mortar
        weights of lines."""
        x = np.round(field(system, system.u0)[0] @ np.linalg.inv(self.map), 9)
        rows, ways = [], range(self.n + 1 if self.n else 0)
        for block, (_, _, axis) in enumerate(PIT.values()):
            normal = -np.linalg.inv(self.map)[:, axis]
            normal /= np.linalg.norm(normal)
            first = 8 + block * (self.n + 1) ** 3
            one, other = (c for c in range(3) if c != axis)
            for node in np.flatnonzero(x[:8, axis] == 0.0):
                row = np.zeros(x.shape)
                row[node] = normal
                for i, j in product(ways, ways):
                    place = np.zeros(3)
                    place[[one, other]] = i / self.n, j / self.n
                    near = np.linalg.norm(
                        x[first : first + (self.n + 1) ** 3] - place, axis=1
                    ).argmin()
                    share = (
                        line(self.n)[int(x[node, one]), i] * line(self.n)[int(x[node, other]), j]
                    )
                    row[first + near] -= share * normal
                rows.append(row.ravel())
        return np.array(rows)


def gap_of(x: Array) -> Array:
    """Gaps of the rigid corner [m], by place in the cell."""
    return 2e-3 * np.cos(3.0 * x[:, 0] + x[:, 1]) ** 2 * (1.0 + x[:, 2])


def line(n: int) -> Array:
    """P (2, n + 1) of one element of side 1 in front of n: D = ½, psi = 2 - 3 s and 3 s - 1, hats
    of length 1/n."""
    s, w = np.polynomial.legendre.leggauss(3)
    P = np.zeros((2, n + 1))
    for k in range(n):
        for t, weight in zip(0.5 + 0.5 * s, 0.5 * w / n, strict=True):
            at = (k + t) / n
            psi = np.array([2.0 - 3.0 * at, 3.0 * at - 1.0])
            P[:, k] += 2.0 * weight * psi * (1.0 - t)
            P[:, k + 1] += 2.0 * weight * psi * t
    return P


def numbered(problem: ContactProblem, B: Array) -> Array:
    """The numbers of the rows of B in the order of the conditions: each selects the displacements
    of its node."""
    surface = seen(problem.surface)
    own = B[:, :24].reshape(-1, 8, 3)
    keys = [(int(np.abs(row).sum(axis=1).argmax()), row.sum(axis=0)) for row in own]
    found = [
        [k for k, (node, n) in enumerate(keys) if node == at and n @ normal > 1.0 - 1e-12]
        for at, normal in zip(surface.nodes, surface.normals, strict=True)
    ]
    assert sorted(found) == [[k] for k in range(len(B))]
    return np.ravel(found)


@pytest.mark.long
@pytest.mark.parametrize(
    ("shape", "n"),
    [
        pytest.param(shape, n, id=f"{shape}-{name}", marks=() if i == j else serial)
        for i, shape in enumerate(SHAPES)
        for j, (n, name) in enumerate({1: "nodes", 2: "mortar", 0: "rigid"}.items())
    ],
)
def test_a_box_in_a_corner_by_enumeration(shape, n):
    """A vertex of three, edges of two conditions: reactions of all sets of contacts tried, on dense
    matrices along the axes; turned and mirrored as a whole they are the same to 1e-9."""
    problem, B = built = Corner(shape, "as it is", n).build()
    system, surface = problem.system, seen(problem.surface)
    assert surface.count == 12 and sorted(len(corner) for corner in surface.corners) == [2, 2, 2, 3]
    order = numbered(problem, B)
    K, f = dense(COMM, system, system.K), field(system, system.load(0.0))[1].ravel()
    gap = gap_of(surface.points @ np.linalg.inv(SHAPES[shape])) if n == 0 else np.zeros(12)
    B = B[order]
    expected = enumerate_lcp(
        B @ np.linalg.solve(K, B.T), gap - B @ np.linalg.solve(K, f), surface.bilateral
    )
    assert 3 <= np.count_nonzero(expected) <= 11
    u = np.linalg.solve(K, f - B.T @ expected).reshape(-1, 3)
    # the other pairs of shape and n where they stand, and turned
    every = list(SHAPES).index(shape) == (1, 2, 0).index(n)
    for place in PLACED if every else ("as it is", "turned"):
        placed, rows = built if place == "as it is" else Corner(shape, place, n).build()
        order_there = numbered(placed, rows)
        for solver in (Condensed(), Volume()) if place == "turned" else (Condensed(),):
            state = static_equilibrium(placed, solver=solver)
            r_n = np.zeros(12)
            r_n[order_there] = seen(placed.surface).all(state.r_n)
            assert np.abs(r_n[order] - expected).max() < 1e-9 * expected.max()
            found = field(placed.system, placed.cartesian(state.u))[1] @ PLACED[place]
            assert np.abs(found - u).max() < 1e-9 * np.abs(u).max()


@pytest.mark.two_ranks
@pytest.mark.parametrize(("shape", "n"), [("prism", 2), pytest.param("leaning", 3, marks=serial)])
def test_a_pit_of_one_body(shape, n):
    """Floor and wall of one body, whose nodes in the bend belong to both: every condition is the
    relative displacement along the normal of its face, exactly where both bodies deform
    linearly."""
    places = {
        "box": (0.0, 0.0, 0.0),
        "below": (-1.0, -1.0, 0.0),
        "under": (0.0, -1.0, 0.0),
        "west": (-1.0, 0.0, 0.0),
    }
    mesh: Any = Blocks(
        {
            name: BlockMesh(
                lengths=(1.0,) * 3,
                divisions=(2 if name == "box" else n,) * 3,
                corner=corner,
                deform=lambda x: x @ SHAPES[shape] @ PLACED["turned"].T,
            )
            for name, corner in places.items()
        }
    )
    mesh = Welded(Welded(mesh, "below_right", "under_left"), "below_top", "west_bottom")
    built, tags = build_mesh(mesh, COMM)
    system = assemble(built, SOFT)
    sides = group(tags, ["box_bottom", "box_left"]), group(tags, ["under_top", "west_right"], "pit")
    surface = contact_pair(system, *sides, matching=NodeToNode() if n == 2 else DualMortar())
    found, A = seen(surface), np.arange(9.0).reshape(3, 3)
    u = relative(
        ContactProblem(system, surface),
        per_body(system, lambda x: x @ A + 1.0, lambda x: 2.0 * x @ A.T),
    )
    jump = found.points @ A + 1.0 - 2.0 * found.points @ A.T
    assert found.count == 18 and [len(corner) for corner in found.corners] == [2, 2, 2]
    assert found.normal_values(u) == pytest.approx(np.sum(jump * found.normals, axis=1), abs=1e-12)


# Beside welds and symmetry planes
# -------------------------------------------------------------------------------------

PRESSURE = 1e3


def pressed(x: Array) -> Array:
    """Displacements under a uniform pressure on top, between smooth planes x = 0, y = 0, z = 0."""
    return PRESSURE / SOFT.E * x * np.array([SOFT.nu, -1.0, SOFT.nu][: x.shape[1]])


def uniform(mesh: Any, rollers: list[str], tops: list[str], surface_of: Any) -> ContactProblem:
    """Blocks between smooth planes under pressure: that of the contact and the displacements are
    exact to 1e-10."""
    built, tags = build_mesh(mesh, COMM)
    d, along = built.geometry.dim, {"left": (0,), "bottom": (1,), "back": (2,)}
    held = [Prescribed(tags[name], components=along[name.split("_")[1]]) for name in rollers]
    loads = [Traction(tags[name], tuple(-PRESSURE * np.eye(3)[1, :d])) for name in tops]
    section = PlaneStress(1.0) if d == 2 else None
    system = assemble(built, SOFT, prescribed=held, loads=loads, section=section)
    problem = ContactProblem(system, surface_of(system, tags))
    state = static_equilibrium(problem, solver=Condensed())
    exact = system.space.restrict(pressed(system.space.points))
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-10 * max_over_ranks(
        COMM, exact
    )
    pressures = seen(problem.surface).all(state.r_n) / seen(problem.surface).weights
    assert np.abs(pressures / PRESSURE - 1.0).max() < 1e-10
    return problem


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("kind", "n"),
    [
        ("hexahedra", 3),
        pytest.param("tetrahedra", 3, marks=serial),
        pytest.param("tetrahedra", 1, marks=serial),
        ("triangles", 3),
    ],
)
def test_the_pressure_is_uniform_up_to_a_weld(kind, n):
    """Two bodies welded on one half of their interface, meshed unlike each other on the rest: nodes
    of the weld have no condition, and the pressure beside it is what it is elsewhere; also where
    every facet has nodes of the weld."""
    d = 2 if kind == "triangles" else 3
    places = {
        "lower0": (0.0, 0.0, 0.0),
        "lower": (1.0, 0.0, 0.0),
        "upper0": (0.0, 1.0, 0.0),
        "upper": (1.0, 1.0, 0.0),
    }
    mesh: Any = Blocks(
        {
            name: BlockMesh(
                lengths=(1.0,) * d,
                divisions=(n if name == "lower" else 2, 2, 2)[:d],
                corner=corner[:d],
                simplices=kind != "hexahedra",
            )
            for name, corner in places.items()
        }
    )
    for pair in (
        ("lower0_right", "lower_left"),
        ("upper0_right", "upper_left"),
        ("lower0_top", "upper0_bottom"),
    ):
        mesh = Welded(mesh, *pair)
    found = []

    def pair(system: Any, tags: Any) -> Any:
        found.append(system.space.body_of_node.max(initial=0))
        sides = tags["upper_bottom"], tags["lower_top"]
        return contact_pair(system, *(sides[::-1] if n == 1 else sides), matching=DualMortar())

    rollers = [
        "lower0_left",
        "upper0_left",
        "lower0_bottom",
        "lower_bottom",
        *(f"{name}_back" for name in places),
    ]
    problem = uniform(mesh, rollers[: 4 if d == 2 else 8], ["upper0_top", "upper_top"], pair)
    assert max(found) == 0 and seen(problem.surface).points[:, 0].min() > 1.0
    assert seen(problem.surface).count == (1 if n == 1 else 2) * 3 ** (d - 2)


@pytest.mark.parametrize("simplices", [False, pytest.param(True, marks=serial)])
@pytest.mark.parametrize(
    "upper, lower",
    [
        ((3, 2, 2), (2, 2, 3)),
        pytest.param((1, 1, 1), (10, 1, 10), marks=serial),
        pytest.param((10, 1, 10), (1, 1, 1), marks=serial),
    ],
)
def test_the_pressure_is_uniform_up_to_symmetry_planes(simplices, upper, lower):
    """A quarter of a block on a quarter of another on rigid ground, facets of up to ten times the
    size of those opposite, one a side; distorted where there are several."""

    def moved(x: Array) -> Array:
        a, b = np.pi * x[:, 0] / 1.5, np.pi * x[:, 2] / 1.2
        return x + 0.08 * np.column_stack(
            [np.sin(2 * a) * np.cos(b), 0.0 * a, np.cos(a) * np.sin(2 * b)]
        )

    one, two = (
        BlockMesh(lengths=(1.5, 1.0, 1.2), divisions=n, simplices=simplices, deform=deform)
        for n, deform in ((upper, moved if upper[0] == 3 else None), (lower, None))
    )
    mesh = TwoBlocks(upper=one, lower=two)
    rollers = [f"{body}_{side}" for side in ("left", "back") for body in ("upper", "lower")]

    def surfaces(system: Any, tags: Any) -> Any:
        pair = contact_pair(system, tags["upper_bottom"], tags["lower_top"], matching=DualMortar())
        return joined_surfaces(pair, contact_surface(system, tags["lower_bottom"]))

    problem = uniform(mesh, rollers, ["upper_top"], surfaces)
    assert seen(problem.surface).count == (upper[0] + 1) * (upper[2] + 1) + (lower[0] + 1) * (
        lower[2] + 1
    )


def bent(x: Array, along: float) -> Array:
    """A floor that hangs and a wall that bulges, symmetric about z = 0; not ``along`` z where
    facets of two bodies look past one another at the plane: nothing is behind it in half the
    model."""
    a, b, c = x.T
    return x + 0.04 * np.column_stack([along * c**2 + b**2, along * c**2 + a**2, 0.0 * c])


def half(way: float, two: bool) -> tuple[ContactProblem, Array]:
    """(problem, r_n by place and face, displacements of the box) of a box on a floor beside a wall,
    rigid or two other blocks; of the half z > 0 with way 0, of the whole with way 1."""
    n = round(1.0 + way)
    places = {
        "box": ((0.0, 0.0), (2, 2, 2)),
        "under": ((0.0, -1.0), (3, 1, 3)),
        "west": ((-1.0, 0.0), (1, 3, 1)),
    }
    mesh = Blocks(
        {
            name: BlockMesh(
                lengths=(1.0, 1.0, 1.0 * n),
                divisions=(*k[:2], k[2] * n),
                corner=(*xy, -way),
                deform=lambda x: bent(x, 0.0 if two else 1.0),
            )
            for name, (xy, k) in places.items()
            if two or name == "box"
        }
    )
    built, tags = build_mesh(mesh, COMM)
    held = (
        () if way else [Prescribed(tags[f"{name}_back"], components=(2,)) for name in mesh.blocks]
    )
    push = [
        Traction(tags[f"box_{side}"], p)
        for side, p in (("top", (-2e3, -6e3, 0.0)), ("right", (-5e3, 3e3, 0.0)))
    ]
    system = assemble(built, SOFT, prescribed=held, loads=push)
    system = system.changed(K=system.algebra.combine([(1.0, system.K), (30.0**2, system.M)]))
    hull = group(tags, ["box_bottom", "box_left"])
    if two:
        surface = contact_pair(
            system, hull, group(tags, ["under_top", "west_right"]), matching=DualMortar()
        )
    else:
        surface = contact_surface(
            system, hull, obstacle=AnalyticGap(lambda x: 1e-3 * (x[:, 0] + x[:, 2] ** 2))
        )
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=Condensed())
    found = seen(surface)
    rows = np.column_stack(
        [found.points, found.normals, found.weights, found.gap0, found.all(state.r_n)]
    )
    x, u = field(system, problem.cartesian(state.u))
    order = np.lexsort(np.round(rows[:, :6], 6).T)
    points = np.lexsort(np.round(x, 6).T)
    keep = x[points, 2] > -1e-9
    return problem, rows[order][rows[order, 2] > -1e-9], np.column_stack([x, u])[points][keep]


@pytest.mark.two_ranks
@pytest.mark.parametrize("two", [True, pytest.param(False, marks=serial)], ids=["mortar", "rigid"])
def test_an_edge_that_ends_in_a_symmetry_plane(two):
    """Curved faces that meet in a curved edge, and half of them: the same conditions and
    displacements, at nodes of the plane half of the weights and reactions; some open."""
    (_, whole, u), (problem, rows, u_half) = half(1.0, two), half(0.0, two)
    assert sorted(len(corner) for corner in seen(problem.surface).corners) == [2, 2, 2]
    share = np.where(np.abs(rows[:, 2]) < 1e-9, 0.5, 1.0)
    assert rows[:, :6] == pytest.approx(whole[:, :6], abs=1e-12)
    assert np.abs(rows[:, 7] - whole[:, 7]).max() < 1e-12
    assert rows[:, 6] == pytest.approx(share * whole[:, 6], rel=1e-11)
    assert rows[:, 8] == pytest.approx(share * whole[:, 8], abs=1e-9 * whole[:, 8].max())
    assert np.abs(u - u_half).max() < 1e-9 * np.abs(u[:, 3:]).max()
    assert 4 < np.count_nonzero(rows[:, 8]) < len(rows)


@pytest.mark.two_ranks
@pytest.mark.parametrize("two", [True, pytest.param(False, marks=serial)], ids=["mortar", "rigid"])
def test_an_edge_between_tied_ends(two):
    """A box on a floor beside a wall, of which both ends move alike: one condition for each face of
    the nodes that are one, with the weight of both; loads that do not depend on z leave every
    plane, of uneven ones, with the same pressures, and a uniform pressure arrives at the blocks as
    the same forces in every plane."""
    places = {
        "box": ((0.0, 0.0), (2, 2, 3)),
        "under": ((0.0, -1.0), (3, 1, 4)),
        "west": ((-1.0, 0.0), (1, 3, 4)),
    }
    uneven = {"box": 0.4, "under": 0.0, "west": 0.0}

    def placed(x: Array, share: float) -> Array:
        x = np.column_stack([x[:, :2], x[:, 2] + share * x[:, 2] * (1.0 - x[:, 2])])
        return x @ SHAPES["prism"] @ PLACED["turned"].T

    mesh = Blocks(
        {
            name: BlockMesh(
                lengths=(1.0,) * 3,
                divisions=k,
                corner=(*xy, 0.0),
                deform=partial(placed, share=uneven[name]),
            )
            for name, (xy, k) in places.items()
            if two or name == "box"
        }
    )
    built, tags = build_mesh(mesh, COMM)
    ends = [Tied(tags[f"{name}_back"], tags[f"{name}_front"]) for name in mesh.blocks]
    push = [
        Traction(tags[f"box_{side}"], tuple(PLACED["turned"] @ p))
        for side, p in (("top", (-2e3, -6e3, 1e3)), ("right", (-5e3, 3e3, 0.0)))
    ]
    system = assemble(built, SOFT, tied=ends, loads=push)
    system = system.changed(K=system.algebra.combine([(1.0, system.K), (30.0**2, system.M)]))
    hull = group(tags, ["box_bottom", "box_left"])
    if two:
        surface = contact_pair(
            system, hull, group(tags, ["under_top", "west_right"]), matching=DualMortar()
        )
    else:
        surface = contact_surface(system, hull)
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=Condensed())
    found = seen(surface)
    x = found.points @ PLACED["turned"] @ np.linalg.inv(SHAPES["prism"])
    rows = np.column_stack(
        [x, found.normals, found.weights, found.all(state.r_n / surface.weights)]
    )
    rows = rows[np.lexsort(np.round(rows[:, [0, 1, 3, 4, 2]], 6).T)].reshape(3, 6, 8)
    assert np.abs(rows - rows[0]).max(axis=(0, 1))[[0, 1, 3, 4, 5]].max() < 1e-12
    # cells along z are 38, 30 and 22 ninetieths long
    shares = np.array([1.0, 17.0 / 15.0, 13.0 / 15.0])
    assert rows[:, :, 6] == pytest.approx(shares[:, None] * rows[0, :, 6], rel=1e-12)
    if two:
        push = forces(problem, found.reaction_load(found.weights, system.rows))
        places = field(system, system.u0)[0] @ PLACED["turned"] @ np.linalg.inv(SHAPES["prism"])
        pit = np.arange(len(push)) >= 3 * 3 * 4
        planes = [push[pit & (np.abs(places[:, 2] - z) < 1e-9)] for z in (0.0, 0.25, 0.5, 0.75)]
        assert np.abs(planes[0]).max() > 0.01
        assert max(np.abs(plane - planes[0]).max() for plane in planes) < 1e-12
    assert np.abs(rows[:, :, 7] - rows[0, :, 7]).max() < 1e-9 * rows[:, :, 7].max()
    assert rows[0, :, 6].sum() == pytest.approx(2.0 / 3.0, rel=1e-12)
    assert np.count_nonzero(rows[0, :, 7]) >= 2


# Friction along edges
# -------------------------------------------------------------------------------------------------


def trough(shape: str, kind: str) -> ContactProblem:
    """A block that slides along z in a trough of floor and wall, pressed on both: rigid ones, one
    group or two joined, or blocks with meshes of their own, held all over."""
    way = SHAPES[shape] @ PLACED["turned"].T
    places = {"box": ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 2)}
    if kind == "mortar":
        places |= {
            "under": ((0.0, -1.0, -0.5), (1.0, 1.0, 2.0), 3),
            "west": ((-1.0, 0.0, -0.5), (1.0, 1.0, 2.0), 3),
        }
    mesh = Blocks(
        {
            name: BlockMesh(
                lengths=size, divisions=(n, n, n), corner=corner, deform=lambda x: x @ way
            )
            for name, (corner, size, n) in places.items()
        }
    )
    built, tags = build_mesh(mesh, COMM)
    along = way.T[:, 2]
    down = -np.linalg.inv(way)
    pull = 3e4 * down[:, 1] / np.linalg.norm(down[:, 1]) + 2e4 * down[:, 0] / np.linalg.norm(
        down[:, 0]
    )
    held = [
        tags[f"{name}_{side}"]
        for name in list(places)[1:]
        for side in ("bottom", "top", "left", "right")
    ]
    system = assemble(built, SOFT, clamped=held, loads=BodyForce(tuple(pull)))
    system = thrown(
        system,
        *[lambda x: np.tile(along, (len(x), 1)), np.zeros_like, np.zeros_like][: len(places)],
    )
    sides = ("box_left", "box_bottom") if kind == "wall first" else ("box_bottom", "box_left")
    if kind == "mortar":
        pairs = zip(sides, ("under_top", "west_right"), strict=True)
        parts = [contact_pair(system, tags[a], tags[b], matching=DualMortar()) for a, b in pairs]
    else:
        parts = [contact_surface(system, tags[side]) for side in sides]
    surface = (
        contact_surface(system, group(tags, list(sides)))
        if kind == "one group"
        else joined_surfaces(*parts)
    )
    return ContactProblem(
        system, surface.with_frictionless_corners(), friction=Coulomb(0.3), mass=ConsistentMass()
    )


@pytest.mark.parametrize(
    ("shape", "kind"),
    [
        ("prism", "mortar"),
        *(
            pytest.param(*one, marks=serial)
            for one in (
                ("square", "one group"),
                ("prism", "one group"),
                ("prism", "wall first"),
                ("square", "mortar"),
            )
        ),
    ],
)
def test_edges_rub_along_themselves_by_one_face(shape, kind):
    """The first condition of a node on an edge rubs, along the edge, with its own r_n; the others
    do not. What the body loses of its momentum along the trough is the sum, step by step."""
    problem, along = trough(shape, kind), PLACED["turned"] @ SHAPES[shape][2]
    surface = seen(problem.surface)
    first, other = np.transpose(surface.corners)
    assert len(first) == 3
    floor = (
        surface.normals[np.argmax(surface.weights)] if kind == "one group" else surface.normals[0]
    )
    if kind != "one group":
        assert np.allclose(surface.normals[first], floor, atol=1e-9)
    plain = np.setdiff1d(np.arange(surface.count), [*first, *other])
    rigid = relative(problem, problem.system.influence @ along * (problem.system.space.bodies == 0))
    equations = problem.equations
    before = start = equations.algebra.dot(rigid, equations.M @ equations.v0)
    for state, report in march(problem, scheme=Midpoint(), dt=1e-3, steps=4):
        assert report.certificate.worst <= 1e-9
        r_n, r_t = surface.all(state.r_n), np.linalg.norm(surface.all(state.r_t), axis=1)
        assert r_n[first].max() > 0.0 and r_n[other].max() > 0.0
        assert not r_t[other].any()
        assert r_t[first] == pytest.approx(0.3 * r_n[first], abs=1e-9 * r_n.max())
        assert r_t[plain] == pytest.approx(0.3 * r_n[plain], abs=1e-9 * r_n.max())
        now = equations.algebra.dot(rigid, equations.M @ state.v)
        rubbed = forces(
            problem, problem.surface.reaction_load(0.0 * state.r_n, problem.system.rows, state.r_t)
        )[:27]
        assert now - before == pytest.approx(-1e-3 * np.sum(rubbed @ along), abs=1e-11 * start)
        assert np.sum(rubbed @ along) == pytest.approx(
            0.3 * (r_n.sum() - r_n[other].sum()), rel=1e-2
        )
        assert (
            np.abs(rubbed[surface.nodes[first]] @ np.delete(PLACED["turned"], 2, axis=1)).max()
            < 1e-9 * r_n.max()
        )
        before = now


# Redistributed mass across meshes that do not match
# -------------------------------------------------------------------


def inertia_of(problem: ContactProblem) -> Array:
    """RᵀMR (6, 6) of the rigid motions of each of two bodies: masses, centres, moments and products
    of inertia."""
    space, found = problem.system.space, []
    for body in (0, 1):
        x = space.points
        motions = [np.tile(e, (len(x), 1)) for e in np.eye(3)] + [np.cross(e, x) for e in np.eye(3)]
        R = np.column_stack(
            [relative(problem, space.restrict(one) * (space.bodies == body)) for one in motions]
        )
        found.append(
            space.comm.sum(R.T @ np.column_stack([problem.equations.M @ one for one in R.T]))
        )
    return np.array(found)


@pytest.mark.parametrize(("simplices", "mu"), [(False, 0.3), pytest.param(True, 0.0, marks=serial)])
def test_massless_nodes_between_meshes_that_do_not_match(simplices, mu):
    """Two bodies that touch and approach each other, curved sides of warped facets, partly covered:
    inertia of each to 1e-12, no mass at the nodes of either side that meet, momenta to 1e-12; the
    impact starts without a jump, no energy is gained or unaccounted for (1e-10)."""
    mesh = unlike(
        turn=2,
        upper=(0.8, 0.6, 0.7),
        offset=(0.5, 0.4),
        distorted=(0.05, 0.0),
        bent=0.2,
        divisions=((4, 4, 4), (5, 5, 4)),
        simplices=simplices,
    )
    built, tags = build_mesh(mesh, COMM)
    down = rotation(2) @ [0.1, -2.0, 0.2]
    system = thrown(
        assemble(built, SOFT), np.zeros_like, lambda x: np.outer(1.0 + 0.2 * x[:, 0], down)
    )
    surface = contact_pair(system, tags["upper_bottom"], tags["lower_top"], matching=DualMortar())
    friction = {"friction": Coulomb(mu)} if mu else {}
    problem, consistent = (
        ContactProblem(system, surface, mass=mass, **friction)
        for mass in (Redistributed(), ConsistentMass())
    )
    own, expected = inertia_of(problem), inertia_of(consistent)
    assert np.abs(own - expected).max() < 1e-12 * np.abs(expected).max()
    massless = problem.equations.massless
    assert (
        massless[surface.owned].all()
        and massless[surface.tangents].all()
        and seen(surface).gap0.min() == 0.0
    )
    assert 3 * surface.total < COMM.allreduce(int(massless.sum())) < 3 * (surface.total + 30)
    assert np.abs(problem.equations.M @ np.where(massless, 1.0, 0.0)).max() == 0.0
    recorded = simulate(problem, dt=1e-3, steps=30, record=[Energy(), Contact()], progress=False)
    history = recorded.history
    start = history["energy_kinetic"][0]
    assert np.abs(history["energy_defect"]).max() < 1e-10 * start
    assert (history["energy_kinetic"] + history["energy_strain"]).max() < (1.0 + 1e-10) * start
    before, after = (
        momenta(problem, v).sum(axis=0) for v in (problem.equations.v0, recorded.state.v)
    )
    assert after == pytest.approx(before, abs=1e-12 * np.abs(before).max())
    force = np.linalg.norm(np.array([history[f"contact_force_{axis}"] for axis in "xyz"]), axis=0)
    assert force[0] == 0.0 and 0.0 < force[1] < 0.2 * force.max()


# Refusals, each with its sentence, on all ranks
# -----------------------------------------------------------------------


def part(side: Facets, name: str, low: float, high: float) -> Facets:
    """Those facets of a side whose middles have x between these values."""
    x = side.mesh.geometry.x[entities_to_geometry(side.mesh, 2, side.indices)].mean(axis=1)[:, 0]
    return Facets(name, side.indices[(x > low) & (x < high)], side.mesh)


@pytest.mark.two_ranks
def test_refused_pairs():
    """Groups of another kind and without facets, sides of one body, facets and pairs that are given
    twice, sides before which there is nothing."""
    built, tags = build_mesh(unlike(), COMM)
    system = assemble(built, SOFT)
    lower, upper = tags["lower_top"], tags["upper_bottom"]

    def pair(one: Any, two: Any) -> Any:
        return contact_pair(system, one, two, matching=DualMortar())

    cases: dict[str, Any] = {
        "facets1 is the cell group 'upper'; give a boundary group": lambda: pair(
            tags["upper"], lower
        ),
        "facets2 is 'lower_top'; give a boundary group, such as tags": lambda: pair(
            upper, "lower_top"
        ),
        "boundary group 'none' is empty: choose a group": lambda: pair(
            upper, part(lower, "none", 9, 9)
        ),
        "no part of 'upper_left' lies opposite 'upper_bottom', along": lambda: pair(
            upper, tags["upper_left"]
        ),
        r"'upper_top' lies 1 m behind 'upper_bottom' at \(.*\): the bod": lambda: pair(
            upper, tags["upper_top"]
        ),
        r"a facet of both 'hull' and 'lower_top' at \(.*\): a facet cannot": lambda: pair(
            group(tags, ["upper_bottom", "lower_top"]), lower
        ),
        "on several contact surfaces with one contact direction: list every boundary and every "
        "pair once, and join boundaries that continue one another": lambda: joined_surfaces(
            pair(part(upper, "left", 0.0, 0.9), lower), pair(part(upper, "right", 0.9, 1.5), lower)
        ),
        "faces a node of another contact pair that faces it: give each pair once": lambda: (
            joined_surfaces(pair(upper, lower), pair(lower, upper))
        ),
    }
    for sentence, ask in cases.items():
        with pytest.raises(InputError, match=sentence):
            ask()
    twice = Facets("twice", np.repeat(upper.indices, 2), built)
    assert seen(pair(twice, lower)).weights.sum() == pytest.approx(1.5 * 1.2, rel=1e-12)


def spoilt(corner: tuple[float, float, float], to: tuple[float, float, float]) -> Any:
    """Move the nodes of one place in the upper block."""
    return lambda x: np.where(np.abs(x - corner).max(axis=1)[:, None] < 1e-9, to, x)


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("simplices", "to", "sentence"),
    [
        (False, (0.5, 1.0, np.nan), "TwoBlocks has nodes whose coordinates are not numbers"),
        (False, (0.95, 1.0, 1.15), "1 cell of TwoBlocks has crossing sides, first at"),
        (
            False,
            (0.75, 1.0, 0.9 - 1e-9),
            "a facet of 'upper_bottom' at .* is a sliver or not convex: its normal cannot",
        ),
        (
            True,
            (1e-9, 1.0, 0.6),
            "a facet of 'upper_bottom' at .* is a sliver or not convex: its normal cannot be "
            "trusted",
        ),
        (
            True,
            (0.5, 0.8, 0.6),
            r"'lower_top' lies 0\..* m behind 'upper_bottom' at \(.*\): the bodies overlap there, "
            r"or",
        ),
    ],
)
def test_refused_facets_of_a_mesh(simplices, to, sentence):
    """Nodes without a place, cells turned inside out, quadrilaterals with a straight corner,
    slivers, overlap."""
    upper = BlockMesh(
        lengths=(1.5, 1.0, 1.2),
        divisions=(3, 2, 2),
        simplices=simplices,
        deform=spoilt((0.5, 1.0, 0.6), to),
    )
    lower = BlockMesh(lengths=(1.5, 1.0, 1.2), divisions=(2, 2, 3), simplices=simplices)
    with pytest.raises(InputError, match=sentence):
        built, tags = build_mesh(TwoBlocks(upper=upper, lower=lower), COMM)
        contact_pair(
            assemble(built, SOFT), tags["upper_bottom"], tags["lower_top"], matching=DualMortar()
        )
