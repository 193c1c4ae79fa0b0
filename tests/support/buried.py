"""Linings in a sheared full space, a quarter of each: meshes and static equilibria."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.optimize import brentq

from vi_contact import Condensed, ContactProblem, LinearElastic, State, fem, static_equilibrium
from vi_contact.core.surfaces import ContactSurface, empty_surface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.meshes.extract import MeshArrays, add_arrays
from vi_contact.meshes.grid import Grid, add_grids
from vi_contact.practice.engineering.checks.racking_ratio import flexibility as flexible

GAMMA = 1e-3


@dataclass(frozen=True)
class Rings:
    """A quarter of a lining, inner to outer radius, in soil up to the radius far; divisions along
    and across."""

    inner: float
    outer: float
    far: float
    divisions: tuple[int, int, int]

    def build(self, gmsh: Any) -> None:
        along, across, soil = self.divisions
        angle = np.linspace(0.0, 0.5 * np.pi, along + 1)
        radii = {
            "lining": np.linspace(self.inner, self.outer, across + 1),
            "soil": np.geomspace(self.outer, self.far, soil + 1),
        }
        grids = []
        for name, radius in radii.items():
            r, a = np.meshgrid(radius, angle, indexing="ij")
            nodes = np.stack([r * np.cos(a), r * np.sin(a)], axis=-1)
            nodes[:, -1, 0] = 0.0
            sides = [(f"{name}_in", f"{name}_out"), (f"{name}_x", f"{name}_y")]
            grids.append(Grid(nodes, False, name, sides))
        add_grids(gmsh, grids)


def graded(start: float, end: float, first: float, divisions: int) -> np.ndarray:
    """Coordinates from start to end whose intervals grow by a constant factor from the length
    ``first``."""
    powers = np.arange(divisions)
    factor = brentq(lambda q: first * np.sum(q**powers) - (end - start), 1.0, 3.0)
    return np.concatenate([[start], start + first * np.cumsum(factor**powers)[:-1], [end]])


@dataclass(frozen=True)
class LinedBox:
    """A quarter of a box, width x height between centre lines, in a square of soil; ``slip``: two
    bodies."""

    width: float
    height: float
    thickness: float
    size: float
    slip: bool
    far: float = 100.0

    @property
    def inside(self) -> tuple[float, float]:
        return 0.5 * (self.width - self.thickness), 0.5 * (self.height - self.thickness)

    @property
    def outside(self) -> tuple[float, float]:
        return 0.5 * (self.width + self.thickness), 0.5 * (self.height + self.thickness)

    def lines(self, axis: int) -> np.ndarray:
        inside, outside = self.inside[axis], self.outside[axis]
        across = max(round(self.thickness / self.size), 4)
        void = np.linspace(0.0, inside, round(inside / self.size) + 1)
        lining = np.linspace(inside, outside, across + 1)
        return np.concatenate([void, lining[1:], graded(outside, self.far, self.size, 40)[1:]])

    def arrays(self) -> MeshArrays:
        axes = self.lines(0), self.lines(1)
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        number = np.arange(len(points)).reshape([len(axis) for axis in axes])
        corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
        cells = np.stack(corners, axis=-1).reshape(-1, 4)
        middle = points[cells].mean(axis=1)
        void = np.all(middle < self.inside, axis=1)
        lining = (np.all(middle < self.outside, axis=1) & ~void)[~void]
        cells = cells[~void]
        if self.slip:
            cells = np.where(lining[:, None], cells, cells + len(points))
            points = np.concatenate([points, points])
        used, cells = np.unique(cells, return_inverse=True)
        cells, points = cells.reshape(-1, 4), points[used]
        return MeshArrays(
            "quadrilateral",
            points,
            cells,
            {"lining": lining, "soil": ~lining},
            self.sides(points, cells, lining),
        )

    def sides(
        self, points: np.ndarray, cells: np.ndarray, lining: np.ndarray
    ) -> dict[str, np.ndarray]:
        edges = np.concatenate([cells[:, [k, (k + 1) % 4]] for k in range(4)])
        _, first, count = np.unique(
            np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True
        )
        outer = first[count == 1]
        edges, own = edges[outer], np.tile(lining, 4)[outer]
        middle = points[edges].mean(axis=1)

        def on(axis: int, value: float) -> np.ndarray:
            return np.abs(middle[:, axis] - value) < 1e-9

        sides = {
            "axis_x": on(1, 0.0),
            "axis_y": on(0, 0.0),
            "far": on(0, self.far) | on(1, self.far),
        }
        if self.slip:
            for axis, name in enumerate(("right", "top")):
                face = on(axis, self.outside[axis])
                sides |= {f"lining_{name}": own & face, f"soil_{name}": ~own & face}
        return {name: edges[mask] for name, mask in sides.items()}

    def build(self, gmsh: Any) -> None:
        add_arrays(gmsh, self.arrays())

    def contact_points(self, name: str) -> list[tuple[float, float]]:
        """Nodes of the interface but the one on the axis, which antisymmetry holds along the
        normal."""
        x, y = self.outside
        if name == "right":
            return [(x, float(v)) for v in self.lines(1) if 0.0 < v < y + 1e-9]
        return [(float(v), y) for v in self.lines(0) if 0.0 < v < x + 1e-9]


def racking(box: LinedBox, flexibility: float, *, nu: float = 0.3) -> float:
    """gamma_frame/gamma_soil of a box of this flexibility ratio, tied to the soil or bilateral
    without friction."""
    soil = LinearElastic(E=1e8, nu=nu, rho=1900.0)
    bending = box.thickness**3 / 12.0
    unit = flexible(soil.shear_modulus, box.width, box.height, bending, bending, bending)
    lining = LinearElastic(E=unit / flexibility, nu=0.0, rho=2400.0)
    mesh, tags = fem.build_mesh(box, MPI.COMM_SELF)
    held = [
        fem.Prescribed(tags["far"], lambda x, t: 0.5 * GAMMA * x[:, ::-1]),
        fem.Prescribed(tags["axis_x"], components=(0,)),
        fem.Prescribed(tags["axis_y"], components=(1,)),
    ]
    system = fem.assemble(mesh, [(tags["lining"], lining), (tags["soil"], soil)], prescribed=held)
    surface: ContactSurface = empty_surface(system.algebra.comm, 2)
    if box.slip:
        pairs = [
            fem.contact_pair(
                system,
                tags[f"lining_{name}"],
                tags[f"soil_{name}"],
                points=box.contact_points(name),
            )
            for name in ("right", "top")
        ]
        surface = fem.joined_surfaces(*pairs).bilateral_everywhere()
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=Condensed())
    x = np.array([0.5 * box.width, 0.5 * box.height])
    u = displacement(problem, state, x)
    return float(u[0] / x[1] + u[1] / x[0]) / GAMMA


def displacement(problem: ContactProblem, state: State, point: Any) -> np.ndarray:
    """u [m] at a node."""
    system: SemiDiscreteSystem = problem.system
    nodes = system.space.find_nodes(np.atleast_2d(point))
    return np.asarray(system.space.sample(problem.cartesian(state.u), nodes, 0.0)[0])
