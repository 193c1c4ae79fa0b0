"""Two caps of spheres in contact, or one on a plane, cut out of the bodies where the closed form of
the half-space says how they move: boxes that reach 4 a from the contact, whose far sides move as
they would in whole spheres.

So nothing is left of the shape of the bodies far away but the closed form, and force against
approach can be measured: both bodies are moved, and the force is what the contact answers. The
sides in contact are spheres: nodes lie on them, their gap comes from the mesh. a/R is small, as the
half-space asks. Meshes are finest in the contact, cells of a/n; a finer n divides every cell, near
and far, so that errors have an order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from gathered import gathered
from half_space import under_hertz
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.core.surfaces import (
    ContactSurface,
    arrange_frames,
    list_tangential_columns,
    make_nodal_frames,
)
from vi_contact.exact.hertz import HertzPoint, contact_modulus, contact_radius
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import MeshArrays, add_arrays, arrays_from_script
from vi_contact.meshes.two_blocks import Blocks

# in a: cells of 1/n up to EVEN along the surface and to DEEP below it,
EVEN, DEEP, REACH, GROWTH = (1.25, 0.6, 4.0, 1.2)
# where stress changes as fast; (1 + GROWTH y)/n at a distance y from there; the box ends at REACH
LOWEST = (0, "x", "left"), (2, "z", "back")  # the sides of a block where x and z are lowest
Motion = Callable[[Array, float], Array]


@dataclass(frozen=True)
class Cap:
    """One body: radius [m], a plane when infinite; cells across a; ``turn`` [rad] of its mesh about
    the axis."""

    radius: float
    material: LinearElastic
    cells: float
    turn: float = 0.0

    @property
    def compliance(self) -> float:
        """(1 - nu²)/E."""
        return (1.0 - self.material.nu**2) / self.material.E

    def sagitta(self, points: Array) -> Array:
        """How far its surface lies behind the tangent plane [m]."""
        square = points[:, 0] ** 2 + points[:, 2] ** 2
        return (
            square / (self.radius + np.sqrt(self.radius**2 - square))
            if np.isfinite(self.radius)
            else 0.0 * square
        )


def stretched(cells: float, even: float) -> Array:
    """Nodes on [0, REACH]: cells of about 1/cells as far as ``even``, then growing. Their places
    are those of one smooth function, so that twice the cells halve each."""
    length = even + np.log1p(GROWTH * (REACH - even)) / GROWTH
    xi = np.linspace(0.0, length, 1 + round(cells * length))
    return np.asarray(np.minimum(xi, even) + np.expm1(GROWTH * np.maximum(xi - even, 0.0)) / GROWTH)


@dataclass(frozen=True)
class CapMesh:
    """One or two caps, "upper" at y > 0 and "lower", with groups "upper_foot", "upper_far",
    "upper_x", "upper_z", …

    ``whole``: axes, of x and z, that run to both sides; the others are planes of symmetry.
    """

    caps: Sequence[Cap]
    a: float
    whole: tuple[int, ...]
    simplices: bool = False

    def build(self, gmsh: Any) -> None:
        both = dict(zip(("upper", "lower"), self.caps, strict=False))
        one = arrays_from_script(
            Blocks({name: self._block(cap, name == "lower") for name, cap in both.items()})
        )
        facets: dict[str, Array] = {}
        for name, reach in zip(both, (1.3, 1.7), strict=False):
            near, far = ("bottom", "top") if name == "upper" else ("top", "bottom")
            rows = one.facet_groups[f"{name}_{near}"]
            middle = one.points[rows].mean(axis=1)
            facets[f"{name}_foot"] = rows[np.hypot(middle[:, 0], middle[:, 2]) < reach * self.a]
            away = [
                far,
                "right",
                "front",
                *(side for axis, _, side in LOWEST if axis in self.whole),
            ]
            facets[f"{name}_far"] = np.concatenate(
                [one.facet_groups[f"{name}_{side}"] for side in away]
            )
            facets |= {
                f"{name}_{axis}": one.facet_groups[f"{name}_{side}"]
                for number, axis, side in LOWEST
                if number not in self.whole
            }
        gmsh.clear()
        add_arrays(gmsh, MeshArrays(one.cell, one.points, one.cells, one.cell_groups, facets))

    def _block(self, cap: Cap, below: bool) -> BlockMesh:
        half, depth = stretched(cap.cells, EVEN), stretched(cap.cells, DEEP)
        axes = [np.append(-half[:0:-1], half) if axis in self.whole else half for axis in (0, 2)]
        axes.insert(1, -depth[::-1] if below else depth)

        def placed(points: Array) -> Array:
            x = np.column_stack(
                [
                    self.a * np.interp(points[:, i], np.linspace(0.0, 1.0, len(nodes)), nodes)
                    for i, nodes in enumerate(axes)
                ]
            )
            c, s = np.cos(cap.turn), np.sin(cap.turn)
            x[:, 0], x[:, 2] = c * x[:, 0] + s * x[:, 2], c * x[:, 2] - s * x[:, 0]
            x[:, 1] += (-1.0 if below else 1.0) * cap.sagitta(x)
            return x

        return BlockMesh(
            lengths=(1.0, 1.0, 1.0),
            divisions=tuple(len(nodes) - 1 for nodes in axes),
            simplices=self.simplices,
            deform=placed,
        )


@dataclass(frozen=True)
class Contact:
    """All conditions: places (m, 3), areas, nodal forces r_n (m,) and friction along the axes (m,
    3) [N], of the whole contact: planes of symmetry are paid for in ``share``, the part of it that
    was modelled."""

    points: Array
    weights: Array
    r_n: Array
    friction: Array
    share: float

    @property
    def force(self) -> float:
        """P [N]."""
        return float(self.r_n.sum()) / self.share

    @cached_property
    def r(self) -> Array:
        """Distances from the axis [m]."""
        return np.hypot(self.points[:, 0], self.points[:, 2])

    @property
    def radius(self) -> float:
        """a [m] from the second moment of the forces, Σ r² r_n = 2/5 a² Σ r_n."""
        return float(np.sqrt(2.5 * (self.r_n @ self.r**2) / self.r_n.sum()))

    def shear(self, along: Array) -> Array:
        """Tractions [Pa] of friction along directions (m, 3)."""
        return np.sum(self.friction * along, axis=1) / self.weights

    def status(self, mu: float) -> Array:
        """(m,) 0 where it is open, 1 where it sticks, 2 where it slips."""
        slips = np.linalg.norm(self.friction, axis=1) > (1.0 - 1e-9) * mu * self.r_n
        return np.asarray(np.where(self.r_n > 0.0, 1 + slips, 0))

    def stick(self, mu: float) -> float:
        """c [m], the radius of a disk of the area that sticks."""
        return float(np.sqrt(self.weights[self.status(mu) == 1].sum() / (np.pi * self.share)))

    def norm(self, values: Array) -> float:
        """√∫ values², by the nodal weights."""
        return float(np.sqrt(self.weights @ values**2))


@dataclass(frozen=True)
class Caps:
    """The problem. ``a``: radius of contact [m], at t ``pressed``(t) times that; ``whole``: see
    CapMesh; ``motions``: of the far sides of each body beside those of the pressure, (points (k,
    3), t) -> (k, 3), both with the depth in the body in the place of y."""

    caps: Sequence[Cap]
    a: float
    whole: tuple[int, ...] = ()
    motions: Sequence[Motion] = ()
    pressed: Callable[[float], float] = lambda t: 1.0
    simplices: bool = False
    comm: Any = field(default_factory=lambda: MPI.COMM_WORLD)

    @cached_property
    def exact(self) -> HertzPoint:
        """The contact in closed form."""
        return self.exact_at(self.a)

    def exact_at(self, radius: float) -> HertzPoint:
        """The contact of this radius [m]."""
        bodies = [(cap.material.E, cap.material.nu) for cap in self.caps]
        R = contact_radius(*(cap.radius for cap in self.caps))
        return HertzPoint.from_approach(radius**2 / R, modulus=contact_modulus(*bodies), radius=R)

    @property
    def share(self) -> float:
        """What is modelled of the contact."""
        return 0.5 ** (2 - len(self.whole))

    def _far(self, number: int) -> Motion:
        cap, sign = self.caps[number], 1.0 - 2.0 * number
        G, nu = 0.5 * cap.material.E / (1.0 + cap.material.nu), cap.material.nu
        kept: dict[tuple[int, float], Array] = {}

        def motion(x: Array, t: float) -> Array:
            own = x.copy()
            own[:, 1] = sign * x[:, 1] - cap.sagitta(x)
            key = len(x), self.a * self.pressed(t)
            if key not in kept:
                exact = self.exact_at(key[1])
                kept[key] = under_hertz(own, key[1], np.array([0.0, exact.force, 0.0]), G=G, nu=nu)
                kept[key][:, 1] -= exact.approach * cap.compliance * exact.modulus
            return (kept[key] + (self.motions[number](own, t) if self.motions else 0.0)) * [
                1.0,
                sign,
                1.0,
            ]

        return motion

    @cached_property
    def problem(self) -> ContactProblem:
        """Without friction."""
        mesh, tags = build_mesh(CapMesh(self.caps, self.a, self.whole, self.simplices), self.comm)
        names = ("upper", "lower")[: len(self.caps)]
        hold = [
            Prescribed(tags[f"{name}_far"], displacement=self._far(i))
            for i, name in enumerate(names)
        ]
        hold += [
            Prescribed(tags[f"{name}_{axis}"], components=(c,))
            for name in names
            for c, axis in ((0, "x"), (2, "z"))
            if c not in self.whole
        ]
        system = assemble(
            mesh,
            [(tags[name], cap.material) for name, cap in zip(names, self.caps, strict=True)],
            prescribed=hold,
        )
        return ContactProblem(system, self._surface(system, tags))

    def _surface(self, system: Any, tags: Any) -> ContactSurface:
        if len(self.caps) == 1:
            plane = HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
            return contact_surface(system, tags["upper_foot"], obstacle=plane)
        return contact_pair(system, tags["upper_foot"], tags["lower_foot"], matching=DualMortar())

    def found(self, state: State) -> Contact:
        """What the contact answers, of all ranks."""
        surface = self.problem.surface
        normal, blocks = arrange_frames(make_nodal_frames(surface.normals))
        columns = list_tangential_columns(normal, 3)
        friction = np.zeros_like(surface.points)
        if state.r_t is not None:
            for i in (0, 1):
                friction += (
                    state.r_t[:, i, None] * blocks[np.arange(surface.count), :, columns[:, i]]
                )
        whole, state = surface.whole(), gathered(surface, state)
        return Contact(
            whole.points, whole.weights, state.r_n, surface.everywhere(friction), self.share
        )
