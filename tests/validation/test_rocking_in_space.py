"""V3.4: a stiff finite element block rocks in space, on edges and corners of its base, as the rigid
block does.

The ground is a rigid plane, or a stiff slab whose mesh does not match that of the block (dual
mortar); block and ground are turned about the vertical, so that nothing but the vertical lies along
an axis. Rotations are small: the rigid block is that of ``tests/support/rigid_block.py``, see
docs/guide/rocking_block.md for what it leaves out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from rigid_block import Phase, RigidBlock
from scipy.linalg import expm
from two_bodies import per_body, relative

import vi_contact as vc
from demos.parts.problems import rocking_block
from demos.parts.problems.geometric_stiffness import geometric_stiffness
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.step import State
from vi_contact.exact import HousnerBlock
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks

pytestmark = pytest.mark.serial  # ranks change none of these numbers: cheaper tests show it

COMM = MPI.COMM_WORLD
G = 9.81
OBLONG, SQUARE = RigidBlock((0.5, 2.0, 0.4)), RigidBlock((0.4, 2.0, 0.4))
STIFF, STIFFER = (vc.LinearElastic(E=E, nu=0.0, rho=2400.0) for E in (3.0e11, 3.0e12))
# half of critical in the lowest bending: an impact is over in some ms
DAMPING = vc.Rayleigh(alpha=0.0, beta=1.0e-3)
TURN = np.array(
    [[np.cos(0.4), 0.0, np.sin(0.4)], [0.0, 1.0, 0.0], [-np.sin(0.4), 0.0, np.cos(0.4)]]
)
grounds = pytest.mark.parametrize("slab", [False, True], ids=["plane", "slab"])


@dataclass(frozen=True)
class Model:
    """The block, with geometric stiffness, and at rest under its weight. Vectors below are along
    the block's axes."""

    shape: RigidBlock
    problem: vc.ContactProblem
    rest: State

    @cached_property
    def fit(self) -> tuple[Array, Array]:
        """(nodes of the block, what gives the translation and rotation (6,) of their
        displacements)."""
        points = self.problem.system.space.points @ TURN
        rows = np.flatnonzero(points[:, 1] > 0.1 * self.shape.half[1])
        x = points[rows]
        modes = [np.tile(e, (len(x), 1)) for e in np.eye(3)] + [np.cross(e, x) for e in np.eye(3)]
        return rows, np.linalg.pinv(np.column_stack([mode.ravel() for mode in modes]))

    def rigid(self, x: Array) -> Array:
        """Translation of the middle of the base and rotation (6,) of a displacement or velocity."""
        rows, fit = self.fit
        values = self.problem.system.space.expand(self.problem.cartesian(x), 0.0).reshape(-1, 3)[
            rows
        ]
        return np.asarray(fit @ (values @ TURN).ravel())

    def tilted(self, q: Array) -> State:
        """The block at rest at q = (w, theta_x, theta_z), the ground undisturbed."""

        def turned(x: Array) -> Array:
            return (np.cross([q[1], 0.0, q[2]], x @ TURN) + [0.0, q[0], 0.0]) @ TURN.T

        system, rest = self.problem.system, self.rest
        bodies = [turned, np.zeros_like][: 1 + system.space.bodies.max()]
        r_t = None if rest.r_t is None else 0.0 * rest.r_t
        return replace(
            rest,
            u=rest.u + relative(self.problem, per_body(system, *bodies)),
            r_n=0.0 * rest.r_n,
            r_t=r_t,
            active=np.zeros_like(rest.active),
        )


@cache
def built(shape: RigidBlock, slab: bool, friction: bool = False) -> Model:
    """A block on four corners. Its base is held sideways, or rubs with mu = 1, and is then free to
    spin on a corner."""
    a, h, c = shape.half
    meshes = {
        "block": BlockMesh(
            lengths=shape.lengths, divisions=(1, 6, 1), corner=(-a, 0.0, -c), deform=turned
        )
    }
    if slab:
        meshes["ground"] = BlockMesh(
            lengths=(3.0 * a, 0.2, 3.0 * c),
            divisions=(4, 1, 5),
            corner=(-1.4 * a, -0.2, -1.6 * c),
            deform=turned,
        )
    mesh, tags = fem.build_mesh(Blocks(meshes), COMM)
    sides = [tags[name] for name in ("block_bottom", "ground_top")[: len(meshes)]]
    system = fem.assemble(
        mesh,
        [(tags[name], material) for name, material in zip(meshes, (STIFF, STIFFER), strict=False)],
        damping=DAMPING,
        loads=fem.BodyForce((0.0, -STIFF.rho * G, 0.0)),
        clamped=tags["ground_bottom"] if slab else (),
        prescribed=() if friction else [fem.Prescribed(side, components=(0, 2)) for side in sides],
    )
    plane = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))

    def problem(system: Any, points: Any = None, **data: Any) -> vc.ContactProblem:
        surface = (
            fem.contact_pair(system, *sides, matching=fem.DualMortar(), points=points)
            if slab
            else fem.contact_surface(system, sides[0], obstacle=plane, points=points)
        )
        return vc.ContactProblem(system, surface, **data)

    whole = problem(system)  # without friction: thrust of the base would be counted as weight
    heavy = geometric_stiffness(whole, vc.static_equilibrium(whole, solver=vc.Condensed()))
    rough = {"friction": vc.Coulomb(1.0)} if friction else {}
    corners = problem(heavy, [turned(corner) for corner in shape.corners], **rough)
    return Model(shape, corners, vc.static_equilibrium(corners, solver=vc.Condensed()))


def turned(x: Array) -> Array:
    return np.asarray(x @ TURN.T)


@dataclass(frozen=True)
class Rocked:
    """Times (k,), q and rates (k, 3), heights of the corners (k, 4) of a run."""

    t: Array
    q: Array
    rates: Array
    heights: Array


def rocked(model: Model, state: State, t_end: float) -> Rocked:
    rows = []
    for new, report in vc.march(
        model.problem,
        scheme=vc.MoreauJean(),
        solver=vc.Condensed(),
        dt=vc.HalvedAtImpact(1e-3, 5),
        t_end=t_end,
        state=state,
    ):
        assert report.certificate.worst <= 1e-9
        motion, rates = (model.rigid(x)[[1, 3, 5]] for x in (new.u - model.rest.u, new.v))
        rows.append(
            (new.t, motion, rates, model.problem.surface.normal_values(model.rest.u - new.u))
        )
    return Rocked(*(np.array(column) for column in zip(*rows, strict=True)))


def differences(found: Rocked, shape: RigidBlock, phases: list[Phase]) -> tuple[Array, Array]:
    """Angles and rates less those of the rigid block, over the largest of these; rates 2 ms before
    landings to 30 ms after them count as zero: there the block shakes."""
    q, v = shape.motion(phases, found.t)
    starts = np.array([one.start for one in phases[1:]])
    shaken = np.any((found.t[:, None] > starts - 2e-3) & (found.t[:, None] < starts + 0.03), axis=1)
    angles, rates = (
        np.abs(a - b)[:, 1:].max(axis=1) / np.abs(b[:, 1:]).max()
        for a, b in ((found.q, q), (found.rates, v))
    )
    return angles, np.where(shaken, 0.0, rates)


# The rigid block
# --------------------------------------------------------------------------------------------------


def test_the_rigid_block_on_an_edge_is_housners():
    """Times of impacts and amplitudes are those of the slender block with e = 1 - 1.5 sin²(alpha)
    (V3.1), to 1e-9."""
    plane = rocking_block.RockingBlock(HousnerBlock(width=0.5, height=2.0, gravity=G))
    phases = list(OBLONG.phases(OBLONG.tilted(0, 0.0, 0.05), 1.5))
    assert [one.pivots.tolist() for one in phases[:2]] == [
        [True, False, True, False],
        [False, True, False, True],
    ]
    assert [one.start for one in phases[1:]] == pytest.approx(plane.impact_times(0.05, 3), rel=1e-9)
    t = np.linspace(0.0, 1.4, 50)
    assert OBLONG.motion(phases, t)[0][:, 2] == pytest.approx(
        plane.motion(0.05, t), abs=1e-9 * 0.05
    )


def test_the_rigid_block_keeps_its_angular_momentum_about_the_corner_it_lands_on():
    """In all landings of the run below: of the full inertia in space, about both horizontal axes,
    to 1e-12."""
    a, h, c = OBLONG.half
    central = np.diag([h**2 + c**2, a**2 + c**2, a**2 + h**2]) / 3.0

    def about(corner: Array, q: Array) -> Array:
        turn = np.array([q[1], 0.0, q[2]])
        middle = np.array([0.0, h, 0.0])
        momentum = np.cross(turn, middle) + [0.0, q[0], 0.0]
        return np.asarray(central @ turn + np.cross(middle - corner, momentum))[[0, 2]]

    phases = list(OBLONG.phases(OBLONG.tilted(0, -0.06, 0.08), 1.5))
    assert [np.flatnonzero(one.pivots).tolist() for one in phases] == [[0], [2], [3], [1], [0], [2]]
    for before, after in zip(phases[:-1], phases[1:], strict=True):
        (landed,) = OBLONG.corners[after.pivots]
        v = OBLONG.moved(before.q, before.v, before.pivots, before.end - before.start)[1]
        assert about(landed, after.v) == pytest.approx(about(landed, v), rel=1e-12)
        assert np.abs(after.v - v).max() > 0.02


# Finite elements
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("slab", "tilt", "landings"),
    [(True, (0.0, 0.05), 2), (False, (-0.06, 0.08), 3)],
    ids=["edge, slab", "corner, plane"],
)
def test_rocking(slab, tilt, landings):
    """V3.4: released on an edge or a corner: angles to 2.5e-5 until the first landing (what is left
    is elasticity), to 2 % of the largest over two landings on edges or three on corners; angular
    velocities after each landing to 2 %, its time to 0.4 %."""
    model, start = built(OBLONG, slab), OBLONG.tilted(0, *tilt)
    phases = list(OBLONG.phases(start, 1.5))[: landings + 1]
    found = rocked(model, model.tilted(start), 0.5 * (phases[-1].start + phases[-1].end) + 0.02)
    angles, rates = differences(found, OBLONG, phases)
    assert angles[found.t < phases[1].start].max() < 2.5e-5
    assert angles.max() < 0.02 and rates.max() < 0.02
    for before, one in zip(phases[:-1], phases[1:], strict=True):
        late = found.t > 0.5 * (before.start + one.start)
        down = np.all(found.heights[:, one.pivots & ~before.pivots] < 1e-5, axis=1)
        assert found.t[late & down][0] == pytest.approx(one.start, rel=4e-3)
    for one in phases:  # each has its corners on the ground, and no other, when it is half over
        row = np.searchsorted(found.t, 0.5 * (one.start + one.end))
        assert np.array_equal(found.heights[row] < 1e-5, one.pivots)


@grounds
def test_a_square_block_on_its_diagonal(slab):
    """V3.4: theta'' = p² (theta - sqrt(2) a/h), p² = g h/((a² + h²)/3 + 2 a² + h²), to 2.5e-5. Then
    three corners land at once, and a rigid block has no one answer: e by the angular momentum about
    the far corner if it lands first, or after the two beside the diagonal. The block of finite
    elements is in between."""
    a, h, _ = SQUARE.half
    about, limit, theta = (
        (a**2 + h**2) / 3.0 + 2.0 * a**2 + h**2,
        np.sqrt(2.0) * a / h,
        0.05 * np.sqrt(2.0),
    )
    p = np.sqrt(G * h / about)
    landing = np.arccosh(1.0 / (1.0 - theta / limit)) / p
    model, start = built(SQUARE, slab), SQUARE.tilted(0, -0.05, 0.05)
    found = rocked(model, model.tilted(start), 2.5 * landing)
    early = found.t < landing
    angle = (found.q[:, 2] - found.q[:, 1]) / np.sqrt(2.0)
    expected = limit - (limit - theta) * np.cosh(p * found.t)
    assert np.abs(angle - expected)[early].max() < 2.5e-5 * theta
    assert np.abs(found.q[:, 2] + found.q[:, 1])[early].max() < 2.5e-5 * theta
    phi = np.array([theta, np.max(-angle)]) / limit
    e = np.sqrt(phi[1] * (2.0 - phi[1]) / (phi[0] * (2.0 - phi[0])))
    at_once, one_by_one = 1.0 - 4.0 * a**2 / about, 1.0 - 2.0 * a**2 / about
    assert at_once < e < one_by_one


@grounds
def test_spinning_on_a_corner(slab):
    """V3.4: a rough block on one corner spins about the vertical too: I theta'' = m g (c + h
    theta_x, 0, h theta_z - a) with the inertia I in space about the corner, to 1.5e-5 of the
    largest angle, until another corner lands."""
    a, h, c = OBLONG.half
    arm, tilt = np.array([a, h, c]), np.array([-0.06, 0.0, 0.08])
    inertia = (
        np.diag([h**2 + c**2, a**2 + c**2, a**2 + h**2]) / 3.0
        + arm @ arm * np.eye(3)
        - np.outer(arm, arm)
    )
    A = np.zeros((7, 7))
    A[:3, 3:6] = np.eye(3)
    A[3:6, :3] = np.linalg.solve(inertia, G * h * np.diag([1.0, 0.0, 1.0]))
    A[3:6, 6] = np.linalg.solve(inertia, G * np.array([c, 0.0, -a]))
    model, rows = built(OBLONG, slab, friction=True), []
    for state, report in vc.march(
        model.problem,
        scheme=vc.MoreauJean(),
        solver=vc.Condensed(),
        dt=1e-3,
        t_end=0.33,
        state=model.tilted(OBLONG.tilted(0, tilt[0], tilt[2])),
    ):
        assert report.certificate.worst <= 1e-9 and np.array_equal(
            state.active, [True, False, False, False]
        )
        expected = (expm(A * state.t) @ [*tilt, 0.0, 0.0, 0.0, 1.0])[:3]
        rows.append([model.rigid(state.u - model.rest.u)[3:], expected])
    found, expected = np.array(rows).swapaxes(0, 1)
    assert expected[-1, 1] > 0.1 * 0.08
    assert np.abs(found - expected).max() < 1.5e-5 * 0.08


@pytest.mark.parametrize(
    ("slab", "friction"), [(False, True), (True, False)], ids=["plane, rough", "slab, held"]
)
def test_onset(slab, friction):
    """V3.4: on ground that accelerates along both axes of the base at once, slowly more and more,
    an edge lifts at g b/h of its own direction whatever the other one is, and three corners lift
    when both are passed: 1 % below nothing but elasticity (1 um), 1 % above more than 0.2 mm in 0.3
    s."""
    a, h, c = OBLONG.half
    model = built(OBLONG, slab, friction)
    for shares, up in (
        ((0.99, 0.99), []),
        ((1.01, 0.99), [1, 3]),
        ((0.99, -1.01), [0, 1]),
        ((1.01, 1.01), [1, 2, 3]),
    ):
        x, z = G * shares[0] * a / h, G * shares[1] * c / h
        motion = vc.Tabulated(
            (0.0, 0.2, 1.0), (0.0, 1.0, 1.0), direction=tuple(turned(np.array([x, 0.0, z])))
        )
        steps = list(
            vc.march(
                replace(model.problem, excitation=motion),
                scheme=vc.MoreauJean(),
                solver=vc.Condensed(),
                dt=8e-3,
                t_end=0.5,
                state=model.rest,
            )
        )
        assert max(report.certificate.worst for _, report in steps) <= 1e-9
        heights = model.problem.surface.normal_values(model.rest.u - steps[-1][0].u)
        assert np.flatnonzero(heights > 2e-4).tolist() == up
        assert np.delete(heights, up).max() < 2.5e-6
