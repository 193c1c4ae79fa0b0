"""Faces, edges and vertices in space: one to three conditions at a node at any angle, against rigid faces and between
bodies, beside symmetry planes, with friction along edges, with redistributed mass; refusals (V2.8)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from fem_problems import dense, field, max_over_ranks
from mpi4py import MPI
from reference_lcp import enumerate_lcp
from test_mortar_in_space import rotation
from two_bodies import SOFT

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import AnalyticGap
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.matching import NodeToNode
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.loads import Prescribed, Traction
from vi_contact.fem.mesh import Facets, build_mesh
from vi_contact.laws.materials import PlaneStress
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import Volume

COMM = MPI.COMM_WORLD
serial = pytest.mark.serial
SHAPES = {  # edges of the cell as rows: faces at 90°, at 60° and 120° beside 90°, at no right angle
    "square": np.eye(3),
    "prism": np.array([[1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]]),
    "leaning": np.array([[1.0, 0.2, 0.1], [0.35, 1.0, -0.25], [-0.5, 0.3, 1.0]]),
}
PLACED = {"as it is": np.eye(3), "turned": rotation(1), "mirrored": np.eye(3)[[2, 0, 1]] @ np.diag([1.0, 1.0, -1.0])}
PIT = {"under": ("bottom", "top", 1), "west": ("left", "right", 0), "rear": ("back", "front", 2)}


def group(tags: Any, names: list[str], name: str = "hull") -> Facets:
    """Several groups as one."""
    indices = np.unique(np.concatenate([tags[one].indices for one in names]))
    return Facets(name, indices.astype(np.int32), tags[names[0]].mesh)


@dataclass(frozen=True)
class Corner:
    """A box of one cell in the corner of three rigid faces, or of three blocks, all on springs in proportion to their
    mass, so that nothing floats; ``n``: divisions of the blocks, which need not be those of the box."""

    shape: str
    place: str
    n: int = 0

    @property
    def map(self) -> Array:
        return SHAPES[self.shape] @ PLACED[self.place].T

    def build(self) -> tuple[ContactProblem, Array]:
        """(problem, B (12, unknowns)): rows of B in the order of faces, then of nodes; unknowns by their ids."""
        boxes = {"box": ((0.0, 0.0, 0.0), 1)}
        if self.n:
            boxes |= {name: (tuple(-np.eye(3)[axis]), self.n) for name, (_, _, axis) in PIT.items()}
        mesh = Blocks({name: BlockMesh(lengths=(1.0,) * 3, divisions=(k, k, k), corner=corner,
                                       deform=lambda x: x @ self.map) for name, (corner, k) in boxes.items()})
        built, tags = build_mesh(mesh, COMM)
        push = {"top": (-3e3, -9e3, 2e3), "right": (-8e3, 5e3, 0.0), "front": (0.0, 3e3, -4e3)}
        loads = [Traction(tags[f"box_{face}"], tuple(PLACED[self.place] @ p)) for face, p in push.items()]
        system = assemble(built, SOFT, loads=loads)
        system = system.changed(K=system.algebra.combine([(1.0, system.K), (30.0**2, system.M)]))
        hull = group(tags, [f"box_{face}" for face, _, _ in PIT.values()])
        if self.n:
            walls = group(tags, [f"{name}_{face}" for name, (_, face, _) in PIT.items()], "pit")
            surface = contact_pair(system, hull, walls, matching=NodeToNode() if self.n == 1 else DualMortar())
        else:
            back = np.linalg.inv(self.map)
            surface = contact_surface(system, hull, obstacle=AnalyticGap(lambda x: gap_of(x @ back)))
        return ContactProblem(system, surface), self.rows(system)

    def rows(self, system: Any) -> Array:
        """n·u of the box, less that of the block that it faces there, by products of the mortar weights of lines."""
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
                    near = np.linalg.norm(x[first : first + (self.n + 1) ** 3] - place, axis=1).argmin()
                    share = line(self.n)[int(x[node, one]), i] * line(self.n)[int(x[node, other]), j]
                    row[first + near] -= share * normal
                rows.append(row.ravel())
        return np.array(rows)


def gap_of(x: Array) -> Array:
    """Gaps of the rigid corner [m], by place in the cell."""
    return 2e-3 * np.cos(3.0 * x[:, 0] + x[:, 1]) ** 2 * (1.0 + x[:, 2])


def line(n: int) -> Array:
    """P (2, n + 1) of one element of side 1 in front of n: D = ½, psi = 2 - 3 s and 3 s - 1, hats of length 1/n."""
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
    """The numbers of the rows of B in the order of the conditions: each selects the displacements of its node."""
    surface = seen(problem.surface)
    own = B[:, :24].reshape(-1, 8, 3)
    keys = [(int(np.abs(row).sum(axis=1).argmax()), row.sum(axis=0)) for row in own]
    found = [[k for k, (node, n) in enumerate(keys) if node == at and n @ normal > 1.0 - 1e-12]
             for at, normal in zip(surface.nodes, surface.normals, strict=True)]
    assert sorted(found) == [[k] for k in range(len(B))]
    return np.ravel(found)


@pytest.mark.parametrize(("shape", "n"), [
    pytest.param(shape, n, id=f"{shape}-{name}", marks=() if i == j else serial)
    for i, shape in enumerate(SHAPES) for j, (n, name) in enumerate({1: "nodes", 2: "mortar", 0: "rigid"}.items())
])
def test_a_box_in_a_corner_by_enumeration(shape, n):
    """A vertex of three, edges of two conditions: reactions of all sets of contacts tried, on dense matrices along the
    axes; turned and mirrored as a whole they are the same to 1e-9."""
    problem, B = built = Corner(shape, "as it is", n).build()
    system, surface = problem.system, seen(problem.surface)
    assert surface.count == 12 and sorted(len(corner) for corner in surface.corners) == [2, 2, 2, 3]
    order = numbered(problem, B)
    K, f = dense(COMM, system, system.K), field(system, system.load(0.0))[1].ravel()
    gap = gap_of(surface.points @ np.linalg.inv(SHAPES[shape])) if n == 0 else np.zeros(12)
    B = B[order]
    expected = enumerate_lcp(B @ np.linalg.solve(K, B.T), gap - B @ np.linalg.solve(K, f), surface.bilateral)
    assert 3 <= np.count_nonzero(expected) <= 11
    u = np.linalg.solve(K, f - B.T @ expected).reshape(-1, 3)
    for place in PLACED:
        placed, rows = built if place == "as it is" else Corner(shape, place, n).build()
        order_there = numbered(placed, rows)
        for solver in (Condensed(), Volume()) if place == "turned" else (Condensed(),):
            state = static_equilibrium(placed, solver=solver)
            r_n = np.zeros(12)
            r_n[order_there] = seen(placed.surface).all(state.r_n)
            assert np.abs(r_n[order] - expected).max() < 1e-9 * expected.max()
            found = field(placed.system, placed.cartesian(state.u))[1] @ PLACED[place]
            assert np.abs(found - u).max() < 1e-9 * np.abs(u).max()


# Beside welds and symmetry planes -------------------------------------------------------------------------------------

PRESSURE = 1e3


def pressed(x: Array) -> Array:
    """Displacements under a uniform pressure on top, between smooth planes x = 0, y = 0, z = 0."""
    return PRESSURE / SOFT.E * x * np.array([SOFT.nu, -1.0, SOFT.nu][: x.shape[1]])


def uniform(mesh: Any, rollers: list[str], tops: list[str], surface_of: Any) -> ContactProblem:
    """Blocks between smooth planes under pressure: that of the contact and the displacements are exact to 1e-10."""
    built, tags = build_mesh(mesh, COMM)
    d, along = built.geometry.dim, {"left": (0,), "bottom": (1,), "back": (2,)}
    held = [Prescribed(tags[name], components=along[name.split("_")[1]]) for name in rollers]
    loads = [Traction(tags[name], tuple(-PRESSURE * np.eye(3)[1, :d])) for name in tops]
    section = PlaneStress(1.0) if d == 2 else None
    system = assemble(built, SOFT, prescribed=held, loads=loads, section=section)
    problem = ContactProblem(system, surface_of(system, tags))
    state = static_equilibrium(problem, solver=Condensed())
    exact = system.space.restrict(pressed(system.space.points))
    assert max_over_ranks(COMM, problem.cartesian(state.u) - exact) < 1e-10 * max_over_ranks(COMM, exact)
    pressures = seen(problem.surface).all(state.r_n) / seen(problem.surface).weights
    assert np.abs(pressures / PRESSURE - 1.0).max() < 1e-10
    return problem


@pytest.mark.parametrize(("kind", "n"), [("hexahedra", 3), pytest.param("tetrahedra", 3, marks=serial),
                                         pytest.param("tetrahedra", 1, marks=serial), ("triangles", 3)])
def test_the_pressure_is_uniform_up_to_a_weld(kind, n):
    """Two bodies welded on one half of their interface, meshed unlike each other on the rest: nodes of the weld have no
    condition, and the pressure beside it is what it is elsewhere; also where every facet has nodes of the weld."""
    d = 2 if kind == "triangles" else 3
    places = {"lower0": (0.0, 0.0, 0.0), "lower": (1.0, 0.0, 0.0), "upper0": (0.0, 1.0, 0.0), "upper": (1.0, 1.0, 0.0)}
    mesh: Any = Blocks({
        name: BlockMesh(lengths=(1.0,) * d, divisions=(n if name == "lower" else 2, 2, 2)[:d], corner=corner[:d],
                        simplices=kind != "hexahedra") for name, corner in places.items()
    })  # fmt: skip
    for pair in (("lower0_right", "lower_left"), ("upper0_right", "upper_left"), ("lower0_top", "upper0_bottom")):
        mesh = Welded(mesh, *pair)
    found = []

    def pair(system: Any, tags: Any) -> Any:
        found.append(system.space.body_of_node.max(initial=0))
        sides = tags["upper_bottom"], tags["lower_top"]
        return contact_pair(system, *(sides[::-1] if n == 1 else sides), matching=DualMortar())

    rollers = ["lower0_left", "upper0_left", "lower0_bottom", "lower_bottom", *(f"{name}_back" for name in places)]
    problem = uniform(mesh, rollers[: 4 if d == 2 else 8], ["upper0_top", "upper_top"], pair)
    assert max(found) == 0 and seen(problem.surface).points[:, 0].min() > 1.0
    assert seen(problem.surface).count == (1 if n == 1 else 2) * 3 ** (d - 2)
