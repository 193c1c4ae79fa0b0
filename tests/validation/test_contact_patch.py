"""V2.1: the contact patch test. A uniform stress state is reproduced to round-off through the
contact conditions.

What is exact, and why. Displacements u = F x are in every P1 and Q1 space, whatever the mesh, and
with a constant stress sigma the internal force of node i is sigma ∫ n phi_i over its boundary
facets. Frictionless contact passes on forces along the nodal contact direction only, so the patch
test holds on a side exactly when sigma ∫ n phi_i has that direction:

* flat sides: ∫ n phi_i = n weight_i. Uniaxial compression across the side, pressure r_n / weight =
  p at every node;
* curved sides: the nodal normal is by definition the direction of ∫ n phi_i, and sigma = -p I makes
  every traction normal: r_n = p |∫ n phi_i| at every node. That is the consistent force of the
  pressure p on the polygonal side. It is smaller than p weight_i by the cosine of half the angle
  between neighbouring facets, so that r_n / weight is p only up to O(h²) there.

Rigid motions are held by exact displacements of some other side (whose nodes are then no contact
nodes). Bodies that contact alone holds: test_static.py.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from fem_problems import block, field, held_by, turned
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.core.surfaces import ContactSurface
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

pytestmark = pytest.mark.slow

COMM = MPI.COMM_WORLD
STEEL = LinearElastic(E=2.1e11, nu=0.3, rho=7850.0)
P = 1.0e8
PLANE = ((2.0, 1.0), (6, 4))
SPACE = ((2.0, 1.0, 1.5), (3, 2, 3))
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])
dimensions = pytest.mark.parametrize("d", [2, 3])
solvers = pytest.mark.parametrize(
    "solver", [Condensed(), Volume(method=ReducedNewton())], ids=["condensed", "volume"]
)


def distorted(x: Array) -> Array:
    """Interior nodes pushed about; sides stay where they are, but their nodes slide along them."""
    bump = np.prod(
        [np.sin(pi * x[:, i] / length) for i, length in enumerate((2.0, 1.0, 1.5)[: x.shape[1]])],
        axis=0,
    )
    along = np.zeros_like(x)
    along[:, 0] = 0.05 * np.sin(pi * x[:, 0]) * np.cos(pi * x[:, 1])
    return x + along + 0.06 * bump[:, None]


def pressures(surface: ContactSurface, state: State) -> Array:
    """Of all conditions [Pa]."""
    return np.asarray(surface.everywhere(state.r_n / surface.weights))


def relative(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def solved(problem: ContactProblem, solver: Any) -> tuple[State, Array, Array]:
    """(state, points, displacements)"""
    state = static_equilibrium(problem, solver=solver)
    points, values = field(problem.system, problem.cartesian(state.u))
    return state, points, values


@solvers
@dimensions
@shapes
def test_v2_1_flat_side(simplices, d, solver):
    """Distorted mesh on a level plane, pressed down at its top, rollers on one side per lateral
    direction, else free.

    sigma_yy = -p, u_y = -p y / E', u_x = nu p (1 + nu) x / E in plane strain (E' = E/(1 - nu²)), -p
    y/E and nu p x/E in 3D; pressure p at every node, all to 1e-12.
    """
    lengths, divisions = PLANE if d == 2 else SPACE
    mesh, tags = block(
        COMM, lengths=lengths, divisions=divisions, simplices=simplices, deform=distorted
    )
    E, nu = STEEL.E, STEEL.nu
    down, aside = (
        (P * (1.0 - nu**2) / E, nu * (1.0 + nu) * P / E) if d == 2 else (P / E, nu * P / E)
    )
    strain = np.array([aside, -down, aside])[:d]
    hold = [
        Prescribed(tags[side], components=(i,)) for side, i in (("left", 0), ("back", 2))[: d - 1]
    ]
    hold.append(held_by(tags, "top", lambda x: x * strain, 1))
    system = assemble(mesh, STEEL, prescribed=hold)
    plane = HalfSpace(point=(0.0,) * d, normal=(0.0, 1.0, 0.0)[:d])
    surface = contact_surface(system, tags["bottom"], obstacle=plane)
    state, points, values = solved(ContactProblem(system, surface), solver)
    assert relative(values, points * strain) < 1e-12
    assert relative(pressures(surface, state), np.full(surface.total, P)) < 1e-12
    assert (
        surface.total == np.prod([n + 1 for i, n in enumerate(divisions) if i != 1])
        and state.active.all()
    )


@pytest.mark.serial
@solvers
@dimensions
@shapes
@pytest.mark.parametrize("angle", [pi / 6.0, -2.0])
def test_v2_1_turned_side(angle, simplices, d, solver):
    """The same state turned by 30 degrees (and by -2 rad), pressed by a traction on its top, exact
    displacements on the left, every other side free: displacements and pressures to 1e-12."""
    lengths, divisions = PLANE if d == 2 else SPACE
    mesh, tags = block(
        COMM,
        lengths=lengths,
        divisions=divisions,
        simplices=simplices,
        deform=distorted,
        angle=angle,
    )
    E, nu = STEEL.E, STEEL.nu
    down, aside = (
        (P * (1.0 - nu**2) / E, nu * (1.0 + nu) * P / E) if d == 2 else (P / E, nu * P / E)
    )

    def turn(x: Array, angle: float) -> Array:
        return np.column_stack([turned(x[:, :2], angle), x[:, 2:]])

    def exact(x: Array) -> Array:
        return turn(turn(x, -angle) * np.array([aside, -down, aside])[:d], angle)

    up = turn(np.eye(d)[1:2], angle)[0]
    system = assemble(
        mesh,
        STEEL,
        prescribed=held_by(tags, "left", exact),
        loads=Traction(tags["top"], tuple(-P * up)),
    )
    surface = contact_surface(
        system, tags["bottom"], obstacle=HalfSpace(point=(0.0,) * d, normal=tuple(up))
    )
    state, points, values = solved(ContactProblem(system, surface), solver)
    assert relative(values, exact(points)) < 1e-12
    assert relative(pressures(surface, state), np.full(surface.total, P)) < 1e-12
    assert surface.basis is not None and state.active.all()


def shrunk(x: Array) -> Array:
    """u of sigma = -p I (in plane strain in the plane only), about a point below the body: the
    bottom moves down."""
    nu = STEEL.nu
    bulk = (1.0 + nu) * (1.0 - 2.0 * nu) if x.shape[1] == 2 else 1.0 - 2.0 * nu
    return -P * bulk / STEEL.E * (x - np.array([1.0, -4.0, 0.75])[: x.shape[1]])


def pressed_sides(tags: Any, d: int, names: tuple[str, ...]) -> list[Traction]:
    """The pressure p on plane sides."""
    axes = {
        "left": (0, -1.0),
        "right": (0, 1.0),
        "top": (1, 1.0),
        "back": (2, -1.0),
        "front": (2, 1.0),
    }
    sides = [(tags[name], *axes[name]) for name in names if axes[name][0] < d]
    return [Traction(side, tuple(-P * sign * np.eye(d)[axis])) for side, axis, sign in sides]


class Fitted:
    """An obstacle that the boundary reaches exactly when it shrinks: gap0 = u(x)·n along the body's
    own normals."""

    def directions(self, points: Array, normals: Array) -> Array:
        return normals

    def gap(self, points: Array, normals: Array) -> Array:
        return np.sum(shrunk(points) * normals, axis=1)


def bulged(x: Array) -> Array:
    """The bottom bent downwards to a smooth curve (in 3D a doubly curved, asymmetric bulge), the
    other sides plane."""
    depth = 0.2 * np.sin(pi * x[:, 0] / 2.0)
    if x.shape[1] == 3:
        depth = depth * (1.0 + 0.5 * np.cos(2.0 * x[:, 2]))
    out = x.copy()
    out[:, 1] -= depth * (1.0 - x[:, 1])
    return out


@solvers
@dimensions
@shapes
def test_v2_1_curved_side(simplices, d, solver):
    """sigma = -p I on a body with a curved side: displacements exact, r_n = p |∫ n phi_i|, no force
    along the side.

    All to 1e-12. The normals of the polygon are found here from its nodes (2D: half the chord
    between the neighbours); r_n / weight is below p by the cosine of half the angle between facets,
    2 % on this mesh.
    """
    lengths, divisions = PLANE if d == 2 else SPACE
    mesh, tags = block(
        COMM, lengths=lengths, divisions=divisions, simplices=simplices, deform=bulged
    )
    loads = pressed_sides(tags, d, ("right", "top", "back", "front"))
    system = assemble(mesh, STEEL, prescribed=held_by(tags, "left", shrunk), loads=loads)
    surface = contact_surface(system, tags["bottom"], obstacle=Fitted())
    state, points, values = solved(ContactProblem(system, surface), solver)
    assert relative(values, shrunk(points)) < 1e-12
    assert state.active.all() and np.all(surface.gap0 > 0.0)
    share = pressures(surface, state) / P
    assert 0.97 < share.min() < 0.9999 and share.max() < 1.0 + 1e-12
    if d == 2:
        side = points[np.isclose(points[:, 1], -0.2 * np.sin(pi * points[:, 0] / 2.0), atol=1e-9)]
        side = side[np.argsort(side[:, 0])]
        chord = np.diff(side, axis=0)[1:] + np.diff(side, axis=0)[:-1]
        areas = 0.5 * np.linalg.norm(np.vstack([chord, np.diff(side, axis=0)[-1:]]), axis=1)
        found = surface.everywhere(state.r_n)[np.argsort(surface.whole().points[:, 0])]
        assert relative(found, P * areas) < 1e-12


@pytest.mark.serial
@dimensions
@shapes
def test_v2_1_forces_of_the_curved_side(simplices, d):
    """The same state on the body without any support: K u - f vanishes inside and on the pressed
    sides; at every node of the curved side, its ends included, it is a push along the nodal normal.
    The pushes sum to p times the projected area; sideways they balance the plane sides (in 3D front
    and back differ in area)."""
    lengths, divisions = PLANE if d == 2 else SPACE
    mesh, tags = block(
        COMM, lengths=lengths, divisions=divisions, simplices=simplices, deform=bulged
    )
    loads = pressed_sides(tags, d, ("left", "right", "top", "back", "front"))
    system = assemble(mesh, STEEL, loads=loads)
    u = system.space.restrict(shrunk(system.space.points))
    _, force = field(system, system.K @ u - system.load(0.0))
    surface = contact_surface(system, tags["bottom"]).whole()
    nodes = system.space.find_nodes(surface.points)
    push = force[nodes]
    size = np.abs(push).max()
    assert np.abs(np.delete(force, nodes, axis=0)).max() < 1e-11 * size
    normal = -np.sum(push * surface.normals, axis=1)
    assert np.abs(push + normal[:, None] * surface.normals).max() < 1e-12 * size
    assert normal.min() > 0.0
    total = push.sum(axis=0)
    assert total[1] == pytest.approx(P * np.prod(np.delete(lengths, 1)), rel=1e-12)
    assert total == pytest.approx(-field(system, system.load(0.0))[1].sum(axis=0), abs=1e-11 * size)
