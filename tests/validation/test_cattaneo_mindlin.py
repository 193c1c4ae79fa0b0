"""V2.4: partial slip of a Hertz contact under a tangential load (Cattaneo 1938, Mindlin 1949), in
the plane.

    q = mu p0 [√(1 - x²/a²) - (c/a) √(1 - x²/c²)],   c = a √(1 - Q/(mu P)),   no slip on |x| < c

The normal load comes first, without friction; then Q grows. Taken back from Q* to Q, slip the other
way comes in from the edges as far as c' = a √(1 - (Q* - Q)/(2 mu P)), and q = q(Q*) - 2 q((Q* -
Q)/2) (Mindlin and Deresiewicz 1953).

That is exact for two equal bodies, on which shear does not change the pressure: the mirrored pair.
One body (nu = 0.3) on a rigid parabola is close to it: shear moves its surface up on one side and
down on the other, which changes the pressure by up to 3 % of p0 away from the edge and q by up to 4
% of mu p0, as measured: no error of the method. nu near 1/2 would decouple the two, but Q1 locks:
on this mesh p0 is 2 % wrong at nu = 0.49, 16 % at 0.499.

The block is 20 a wide on either side and as deep. Uniform shear on its top and sides carries Q
without moment; contact alone holds it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
import pytest
from gathered import gathered
from graded import even_then_growing, growing
from hertz_line import HertzLine
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import AnalyticGap
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Traction
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.run.static import quasi_static, static_equilibrium
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.slow

COMM = MPI.COMM_WORLD
MU, NU = 0.5, 0.3
HERTZ = HertzLine(force=0.02, modulus=1.0, radius=1.0)
A = HERTZ.half_width
CERTIFIED = 1e-9 * HERTZ.force  # on nodal forces [N/m]: the package's tolerance
H = 1.5 * A / round(1.5 * 11.3)  # the edge of the contact is no node


History = Callable[[float], float]


def graded(h: float, *, side: float = 1.0) -> BlockMesh:
    """The block above y = 0, or its mirror image below."""
    half = even_then_growing(h, 1.5 * A, 20.0 * A, growth=1.3)
    x, y = np.concatenate([-half[:0:-1], half]), growing(h, 20.0 * A, growth=1.3)
    y = y if side > 0.0 else -y[::-1]

    def placed(points: Array) -> Array:
        axes = [
            np.interp(points[:, i], np.linspace(0.0, 1.0, len(nodes)), nodes)
            for i, nodes in enumerate((x, y))
        ]
        return np.column_stack(axes)

    return BlockMesh(lengths=(1.0, 1.0), divisions=(len(x) - 1, len(y) - 1), deform=placed)


def tractions(tags: Any, history: History, *, body: str = "", side: float = 1.0) -> list[Traction]:
    """P on the block, or its mirror image, and history(t) mu P; the image is pulled the other
    way."""
    far, p = "top" if side > 0.0 else "bottom", HERTZ.force / (40.0 * A)
    shear = [(far, (side * MU * p, 0.0)), ("right", (0.0, MU * p)), ("left", (0.0, -MU * p))]
    return [Traction(tags[body + far], (0.0, -side * p))] + [
        Traction(tags[body + name], q, history=history) for name, q in shear
    ]


def parabola(points: Array) -> Array:
    return points[:, 0] ** 2 / (2.0 * HERTZ.radius)


def material(bodies: int) -> LinearElastic:
    """One of so many equal bodies that give the modulus of the contact."""
    return LinearElastic(E=bodies * HERTZ.modulus * (1.0 - NU**2), nu=NU, rho=1.0)


def sheared(history: History, *, comm: Any = COMM) -> ContactProblem:
    """The block under P, without friction, on a rigid parabola; its tangential load is history(t)
    mu P."""
    mesh, tags = build_mesh(graded(H), comm)
    system = assemble(mesh, material(1), loads=tractions(tags, history))
    return ContactProblem(
        system, contact_surface(system, tags["bottom"], obstacle=AnalyticGap(parabola))
    )


def mirrored_pair(history: History, *, h: float = H, comm: Any = COMM) -> ContactProblem:
    """The block on its mirror image; their gap stands for the curved sides."""
    bodies = {"upper": 1.0, "lower": -1.0}
    mesh, tags = build_mesh(
        Blocks({name: graded(h, side=side) for name, side in bodies.items()}), comm
    )
    loads = [
        one
        for name, side in bodies.items()
        for one in tractions(tags, history, body=f"{name}_", side=side)
    ]
    system = assemble(mesh, material(2), loads=loads)
    flat = contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    return ContactProblem(system, replace(flat, gap0=parabola(flat.points)))


@dataclass(frozen=True)
class Contact:
    """Left to right: x, weights [m], reactions [N/m]."""

    x: Array
    weights: Array
    r_n: Array
    r_t: Array

    @cached_property
    def shear(self) -> Array:
        """q [Pa]."""
        return self.r_t / self.weights

    @cached_property
    def ratio(self) -> Array:
        """r_t over its limit, 0 where nothing touches."""
        limit = MU * self.r_n
        return np.divide(self.r_t, limit, out=np.zeros_like(limit), where=limit > 0.0)

    def slips(self, sign: float) -> Array:
        """x of the points that slip along sign · e_x."""
        return self.x[sign * self.ratio > 1.0 - 1e-9]

    def sticking(self) -> Array:
        """x of the points that stick."""
        return self.x[(self.r_n > 0.0) & (np.abs(self.ratio) < 1.0 - 1e-9)]


def stages(pressed: ContactProblem, times: Sequence[float]) -> list[Contact]:
    """First pressed, then rubbed through the history."""
    state = static_equilibrium(pressed)
    surface, every = pressed.surface, pressed.surface.whole()
    order = np.argsort(every.points[:, 0])
    contacts = []
    rough = replace(pressed, friction=Coulomb(MU))
    for stage in quasi_static(rough, times, solver=Condensed(), state=state):
        assert stage.r_t is not None
        stage = gathered(surface, stage)
        columns = (every.points[:, 0], every.weights, stage.r_n, stage.r_t[:, 0])
        contacts.append(Contact(*(column[order] for column in columns)))
    return contacts


def exact_shear(x: Array, share: float) -> Array:
    """q [Pa] at the first loading, Q = share mu P."""
    c = A * np.sqrt(1.0 - share)
    core = np.sqrt(np.maximum(1.0 - (x / c) ** 2, 0.0))
    return np.asarray(MU * (HERTZ.pressure(x) - HERTZ.peak * c / A * core))


def shear_error(found: Contact, share: float) -> float:
    """‖q - q_exact‖ / ‖q_exact‖ in L2, by the nodal weights."""
    exact = exact_shear(found.x, share)
    return float(np.sqrt(found.weights @ (found.shear - exact) ** 2 / (found.weights @ exact**2)))


def check_first_loading(found: Contact, share: float, h: float = H) -> None:
    """c to h on both sides, slip along Q on both rings, Σ r_t = Q and Σ r_n = P to 1e-9 (asked:
    1e-6)."""
    stick, slip, c = found.sticking(), found.slips(1.0), A * np.sqrt(1.0 - share)
    assert abs(stick[0] + c) < h and abs(stick[-1] - c) < h
    assert (
        len(stick) + len(slip) == np.sum(found.r_n > 0.0)
        and slip[0] < stick[0]
        and slip[-1] > stick[-1]
    )
    assert found.r_t.sum() == pytest.approx(share * MU * HERTZ.force, rel=1e-9)
    assert found.r_n.sum() == pytest.approx(HERTZ.force, rel=1e-9)


SHARES = (0.25, 0.5, 0.75, 0.9)
CYCLE = (0.0, 0.75, 0.25, -0.25, -0.75, 0.0, 0.75)  # Q / mu P at t = 0, 1, ...


def growing_load(t: float) -> float:
    return t


def cyclic_load(t: float) -> float:
    return float(np.interp(t, range(len(CYCLE)), CYCLE))


@pytest.mark.serial
def test_v2_4_the_exact_solution():
    """c / a = 0.866025, 0.707107, 0.5, 0.316228 (printed digits); q carries Q; p is what it was
    where all slips."""
    x = np.linspace(-A, A, 200001)
    for share, ratio in zip(SHARES, (0.866025, 0.707107, 0.5, 0.316228), strict=True):
        assert np.sqrt(1.0 - share) == pytest.approx(ratio, abs=5e-7)
        q = exact_shear(x, share)
        assert q.mean() * 2.0 * A == pytest.approx(share * MU * HERTZ.force, rel=1e-5)
        outside = np.abs(x) >= A * ratio * 1.00001
        assert np.array_equal(q[outside], MU * HERTZ.pressure(x)[outside])


@pytest.mark.serial
def test_v2_4_mirrored_pair():
    """Equal bodies: shear does not change the pressure and q is even (to 1e-9 P at every node); q
    to 5 % in L2 on 11.3 cells across a, and on meshes twice as fine less than half of that in the
    mean over Q."""
    errors = []
    for h in (H, 0.5 * H):
        found = stages(mirrored_pair(growing_load, h=h), SHARES)
        for share, contact in zip(SHARES, found, strict=True):
            check_first_loading(contact, share, h)
            assert np.abs(contact.r_n - found[0].r_n).max() < CERTIFIED
            assert np.abs(contact.r_t - contact.r_t[::-1]).max() < CERTIFIED
        errors.append(
            [shear_error(contact, share) for share, contact in zip(SHARES, found, strict=True)]
        )
    assert max(errors[0]) < 0.05 and max(errors[1]) < 0.02
    assert np.mean(errors[1]) < 0.5 * np.mean(errors[0])


@pytest.mark.serial
def test_v2_4_unloading_and_reloading():
    """A cycle of the pair: after each turn q is that of the turn less, or more, 2 q(|Q* - Q|/2) of
    a first loading (nodal forces to 1e-9 P), slip the other way reaches to c' (h), the loop is
    closed after one round, and increments change nothing."""
    top = CYCLE[1]

    @cache
    def first(share: float) -> Array:
        return stages(mirrored_pair(lambda t: share * t), [1.0])[0].shear

    there = first(top)
    exact = [there, *(there - 2.0 * first(0.5 * (top - share)) for share in CYCLE[2:5])]
    exact += [-there + 2.0 * first(0.5 * (top + share)) for share in CYCLE[5:]]
    for increments in (1, 2):
        times = np.linspace(0.0, 6.0, 6 * increments + 1)[increments:]
        found = stages(mirrored_pair(cyclic_load), times)[::increments]
        for contact, q in zip(found, exact, strict=True):
            assert np.abs(contact.r_t - q * contact.weights).max() < CERTIFIED
    for i, back in ((1, -1.0), (2, -1.0), (4, 1.0)):
        stick = found[i].sticking()
        reach = A * np.sqrt(1.0 - 0.5 * abs(CYCLE[i + 1] + back * top))
        assert abs(stick[0] + reach) < H and abs(stick[-1] - reach) < H
        assert len(found[i].slips(back)) > 0 and len(found[i].slips(-back)) == 0


@pytest.mark.serial
def test_v2_4_one_body():
    """On a rigid parabola, any number of ranks: c to h, Q and P to 1e-9; q within 4 % of mu p0 and
    p within 3 % of p0 at |x| < a - 1.5 h. In one step or four: nodal forces to 1e-9 P, the
    tolerance of the certificate."""
    found = stages(sheared(growing_load), SHARES)
    inner = np.abs(found[0].x) < A - 1.5 * H
    for share, contact in zip(SHARES, found, strict=True):
        check_first_loading(contact, share)
        assert (
            np.abs(contact.shear - exact_shear(contact.x, share))[inner].max()
            < 0.04 * MU * HERTZ.peak
        )
        assert (
            np.abs(contact.r_n / contact.weights - HERTZ.pressure(contact.x))[inner].max()
            < 0.03 * HERTZ.peak
        )
    once = stages(sheared(growing_load), [SHARES[-1]])[0]
    assert np.abs(once.r_t - found[-1].r_t).max() < CERTIFIED


@pytest.mark.serial
def test_v2_4_one_body_reversed():
    """Turned from Q* to -Q* nothing is left of the first way: the mirror image, to 1e-9 P. Back at
    Q* the loop closes."""
    found = stages(sheared(cyclic_load), range(1, 7))
    there, turned_round, again = found[0], found[3], found[5]
    for contact, sign in ((turned_round, -1.0), (again, 1.0)):
        r_n, r_t = (
            (contact.r_n[::-1], contact.r_t[::-1]) if sign < 0.0 else (contact.r_n, contact.r_t)
        )
        assert np.abs(sign * r_t - there.r_t).max() < CERTIFIED
        assert np.abs(r_n - there.r_n).max() < CERTIFIED
    assert len(found[1].slips(-1.0)) > 0 and len(found[1].slips(1.0)) == 0


@pytest.mark.parametrize("problem", [sheared, mirrored_pair])
def test_v2_4_ranks_agree(problem):
    """All ranks together and each alone: nodal forces to 1e-9 P."""
    together, alone = (
        stages(problem(growing_load, comm=comm), SHARES[1:2]) for comm in (COMM, MPI.COMM_SELF)
    )
    for one, other in zip(together, alone, strict=True):
        assert np.abs(one.r_n - other.r_n).max() < CERTIFIED
        assert np.abs(one.r_t - other.r_t).max() < CERTIFIED
