"""V8.7: displacements of second order (P2, Q2) against exact solutions: rates, Hertz contact,
Cook's membrane, impacts.

With contact: V2.3 on a cylinder whose foot is a curve of second-order cells, V1.1, V1.2 and V1.3 on
bars and strips of 50 elements. Without: a manufactured solution on distorted cells, and the
membrane of Cook, whose tip is 23.96 deep in every text book (plane stress, E = 1, nu = 1/3, unit
load).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ufl
from curved_cells import Curved, wavy
from fem_problems import linear
from graded import even_then_growing, growing
from hertz_line import HertzLine
from mesh_tools import integral
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.bar import Bar, build
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.exact.bar import PeriodicBar, ThrownBar
from vi_contact.exact.bouncing_bar import BouncingBar
from vi_contact.meshes.block import BlockMesh

COMM = MPI.COMM_WORLD
MATERIAL = vc.LinearElastic(E=2.5, nu=0.25, rho=1.0)
CELLS = {
    "triangles": (True, 2),
    "quadrilaterals": (False, 2),
    "tetrahedra": (True, 3),
    "hexahedra": (False, 3),
}


def smooth(x: Array, t: float = 0.0) -> Array:
    """u_i = sin(2 x_i + 0.3 i) cos(1.5 x_(i+1))."""
    d = x.shape[1]
    return np.stack(
        [np.sin(2.0 * x[:, i] + 0.3 * i) * np.cos(1.5 * x[:, (i + 1) % d]) for i in range(d)],
        axis=1,
    )


def body_force(x: Array, t: float) -> Array:
    """-div sigma(u) = -(mu Δu + (lambda + mu) grad div u)."""
    lame, shear, d = MATERIAL.lame_lambda, MATERIAL.shear_modulus, x.shape[1]
    rows = []
    for i in range(d):
        own = np.sin(2.0 * x[:, i] + 0.3 * i) * np.cos(1.5 * x[:, (i + 1) % d])
        before = np.cos(2.0 * x[:, i - 1] + 0.3 * ((i - 1) % d)) * np.sin(1.5 * x[:, i])
        rows.append(shear * (2.0**2 + 1.5**2) * own + (lame + shear) * (4.0 * own + 3.0 * before))
    return np.stack(rows, axis=1)


def errors(name: str, n: int, curved: bool) -> tuple[float, float]:
    """(L2, H1) on n distorted cells a side."""
    simplices, d = CELLS[name]
    spec: dict[str, Any] = {
        "lengths": (2.0, 1.5, 1.2)[:d],
        "divisions": (n,) * d,
        "simplices": simplices,
    }
    given = Curved(BlockMesh(**spec)) if curved else BlockMesh(**spec, deform=wavy)
    mesh, tags = fem.build_mesh(given, COMM)
    held = [
        fem.Prescribed(group, smooth) for group in tags.values() if isinstance(group, fem.Facets)
    ]
    system = fem.assemble(
        mesh, MATERIAL, degree=2, prescribed=held, loads=fem.BodyForce(body_force)
    )
    problem, x = linear(system), ufl.SpatialCoordinate(mesh)
    u = fem.as_function(problem, vc.static_equilibrium(problem), "u")
    exact = ufl.as_vector(
        [ufl.sin(2.0 * x[i] + 0.3 * i) * ufl.cos(1.5 * x[(i + 1) % d]) for i in range(d)]
    )
    dx = ufl.dx(metadata={"quadrature_degree": 6})
    l2, h1 = (integral(mesh, ufl.inner(e, e), dx) for e in (u - exact, ufl.grad(u - exact)))
    return float(np.sqrt(l2)), float(np.sqrt(h1))


@pytest.mark.parametrize(
    "name, curved",
    [
        *(
            # ranks do not change an order: one kind of cells shows it
            pytest.param(name, curved, marks=pytest.mark.serial)
            for name, curved in (
                ("quadrilaterals", False),
                ("quadrilaterals", True),
                ("tetrahedra", True),
                ("hexahedra", True),
            )
        ),
        ("triangles", True),
    ],
)
def test_orders_three_and_two(name: str, curved: bool) -> None:
    """Measured: 3.02 to 3.06 in L2, 1.93 to 2.02 in H1 between the two meshes, with straight sides
    too."""
    counts = (4, 8) if CELLS[name][1] == 2 else (3, 6)
    coarse, fine = (np.array(errors(name, n, curved)) for n in counts)
    assert np.log2(coarse / fine) == pytest.approx([3.0, 2.0], abs=0.1)
    assert fine[0] < 0.005  # 0.3 to 0.08 % of the field


RADIUS, HALF_WIDTH, SPAN = 1.0, 0.02, 30.0
HERTZ = HertzLine(force=np.pi * HALF_WIDTH**2 / (4.0 * RADIUS), modulus=1.0, radius=RADIUS)


def cylinder(per_a: float, degree: int, simplices: bool) -> dict[str, float]:
    """Relative errors of the pressure and its resultant: half a cylinder, its foot a parabola, on a
    rigid plane.

    Cells of a / ``per_a`` below; those of degree 2 have curved sides, which are the parabola.
    """
    h = HALF_WIDTH / per_a
    x, y = even_then_growing(h, 1.5 * HALF_WIDTH, SPAN * HALF_WIDTH), growing(h, SPAN * HALF_WIDTH)
    far = 4.0 * HALF_WIDTH  # beyond it goes on straight, so that the body keeps a top

    def placed(points: Array) -> Array:
        axes = [
            np.interp(points[:, i], np.linspace(0.0, 1.0, len(nodes)), nodes)
            for i, nodes in enumerate((x, y))
        ]
        near = np.minimum(axes[0], far)
        rise = (0.5 * near**2 + far * (axes[0] - near)) / RADIUS
        return np.column_stack([axes[0], axes[1] + rise * (1.0 - axes[1] / y[-1])])

    spec: dict[str, Any] = {"divisions": (len(x) - 1, len(y) - 1), "simplices": simplices}
    given = Curved(BlockMesh(**spec), placed) if degree == 2 else BlockMesh(**spec, deform=placed)
    mesh, tags = fem.build_mesh(given, COMM)
    material = vc.LinearElastic(E=1.0 - 0.3**2, nu=0.3, rho=1.0)
    system = fem.assemble(
        mesh,
        material,
        degree=degree,
        prescribed=fem.Prescribed(tags["left"], components=(0,)),
        loads=fem.Traction(tags["top"], (0.0, -0.5 * HERTZ.force / x[-1])),
    )
    plane = vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    every, r_n = surface.whole(), surface.everywhere(state.r_n)
    at, pressure, exact = (
        every.points[:, 0],
        r_n / every.weights,
        HERTZ.pressure(every.points[:, 0]),
    )
    core = at < 0.5 * HALF_WIDTH
    return {
        "force": 2.0 * r_n.sum() / HERTZ.force - 1.0,
        "profile": np.sqrt(every.weights @ (pressure - exact) ** 2 / (every.weights @ exact**2)),
        "peak": r_n[core].sum() / (every.weights[core] @ exact[core]) - 1.0,
        "edge": at[r_n > 0.0].max() / HALF_WIDTH - 1.0,
    }


@pytest.mark.serial
@pytest.mark.parametrize("simplices", [True, False], ids=["P2", "Q2"])
def test_v2_3_cylinder_of_curved_cells(simplices: bool) -> None:
    """Pressure in L2 1.2 and 0.6 % off (P2), 0.9 and 0.5 % (Q2) with 5.65 and 11.3 cells, twice as
    many nodes, in the half-width; its sum over the inner half 0.1 %; the force exact, the edge
    within a node."""
    coarse, fine = (cylinder(per_a, 2, simplices) for per_a in (5.65, 11.3))
    for found, per_a in ((coarse, 5.65), (fine, 11.3)):
        assert abs(found["force"]) < 1e-9 and abs(found["edge"]) < 0.5 / per_a
    assert (
        coarse["profile"] < 0.02
        and fine["profile"] < 0.01
        and fine["profile"] < 0.7 * coarse["profile"]
    )
    assert abs(coarse["peak"]) < 3e-3 and abs(fine["peak"]) < 2e-3


def cooks_body(n: int, degree: int, simplices: bool) -> tuple[Any, Any]:
    """The body and its named groups."""

    def placed(x: Array) -> Array:
        return np.column_stack([48.0 * x[:, 0], 44.0 * x[:, 0] + x[:, 1] * (44.0 - 28.0 * x[:, 0])])

    mesh, tags = fem.build_mesh(
        BlockMesh(divisions=(n, n), simplices=simplices, deform=placed), COMM
    )
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=1.0, nu=1.0 / 3.0, rho=1.0),
        degree=degree,
        section=vc.PlaneStress(1.0),
        clamped=tags["left"],
        loads=fem.Traction(tags["right"], (0.0, 1.0 / 16.0)),
    )
    return system, tags


def cook(n: int, degree: int, simplices: bool) -> float:
    """How deep the middle of the loaded side is, upwards."""
    system, _ = cooks_body(n, degree, simplices)
    state = vc.static_equilibrium(linear(system))
    middle = system.space.find_nodes(np.array([[48.0, 52.0]]))
    return float(system.space.sample(state.u, middle, 0.0)[0, 1])


@pytest.mark.serial
def test_cooks_membrane() -> None:
    """544 unknowns each: P2 0.4 %, Q2 0.15 %, Q1 2.2 % and P1 8 % short of 23.96 (P1 with 2112
    still 2.9 %)."""
    p2, q2, q1 = cook(8, 2, True), cook(8, 2, False), cook(16, 1, False)
    assert 23.96 * 0.993 < p2 < 23.97 and 23.96 * 0.997 < q2 < 23.97 and q1 < 23.96 * 0.985


@pytest.mark.serial
@pytest.mark.promise("guide/second_order.md", "(free deflection - gap) / (deflection under a unit")
@pytest.mark.parametrize("degree, simplices", [(1, False), (2, True), (2, False)])
def test_a_stop_at_the_corner_of_cooks_membrane(degree: int, simplices: bool) -> None:
    """The force is (free deflection - gap) / (deflection under a unit force), by the matrix K."""
    system, tags = cooks_body(8, degree, simplices)
    gap = 5.0
    stop = vc.HalfSpace(point=(0.0, 60.0 + gap), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, tags["top"], obstacle=stop, points=[(48.0, 60.0)])
    problem = vc.ContactProblem(system, surface)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    equations = problem.equations
    (corner,) = surface.owned
    units = np.eye(len(state.u))
    K = np.column_stack([equations.K @ one for one in units])
    free, unit = np.linalg.solve(K, np.column_stack([equations.load(0.0), units[corner]]))[corner]
    assert free > gap and state.r_n == pytest.approx([(free - gap) / unit], rel=1e-9)


BARS = {
    "P2 bar": {"dimension": 1},
    "P2": {"dimension": 2, "triangles": True},
    "Q2": {"dimension": 2},
}


def followed(case: Any, name: str, t_end: float) -> tuple[Array, Array, Array, Array, float]:
    """(times, forces, energies, means of the forces in a step, dt) of the default scheme, a quarter
    of a cell a step."""
    model = build(Bar(case, elements=50, across=2, degree=2, **BARS[name]), COMM)  # type: ignore
    bar, dt, rows = model.bar, model.bar.time_step(0.25), []
    for state, report in vc.march(model.problem(), dt=dt, steps=round(t_end / dt)):
        system, load = report.problem.equations, report.problem.equations.load
        assert report.certificate.worst <= 1e-9
        total = system.kinetic_energy(state.v) + system.strain_energy(state.u)
        total -= system.algebra.dot(load.constant, state.u)
        forces = COMM.allreduce(np.array([state.r_n.sum(), report.balance.r_n.sum()]))
        rows.append((state.t, forces[0], total, forces[1]))
    t, *values = np.array(rows).T
    return t, *(value / bar.section for value in values), dt


@pytest.mark.parametrize(
    "name", ["P2", *(pytest.param(name, marks=pytest.mark.serial) for name in ("P2 bar", "Q2"))]
)
def test_v1_1_thrown_bar(name: str) -> None:
    """The force in the window within 5 % of 300 (measured 1.6; P1 0.02), contact 2/3 s ± 4 dt,
    impulse 200 within 1 %, energy within 0.1 %."""
    t, force, energy, mean, dt = followed(ThrownBar(), name, 1.6)
    window, touching = (t > 0.6) & (t < 1.067), t[force > 0.0]
    assert np.abs(force[window] / 300.0 - 1.0).max() <= 0.05
    assert force[window].mean() == pytest.approx(300.0, rel=2e-3)
    assert touching[0] == pytest.approx(0.5, abs=2.001 * dt)
    assert touching[-1] == pytest.approx(7.0 / 6.0, abs=4.001 * dt)
    assert dt * mean.sum() == pytest.approx(200.0, rel=0.01)
    assert np.abs(energy / 500.0 - 1.0).max() <= 1e-3


@pytest.mark.serial  # on two ranks the thrown one strikes
@pytest.mark.parametrize("name", ["P2 bar", "P2"])
def test_v1_2_and_v1_3_bouncing_bars(name: str) -> None:
    """V1.2: impulse 800/3 of the first contact within 0.5 %, energy from 99.5 to 100.1 %. V1.3:
    energy from 98 to 100 % of the start, impulse ½ of the first contact within 3 %."""
    case = BouncingBar()
    t, _, energy, mean, dt = followed(case, name, 2.5)
    assert dt * mean.sum() == pytest.approx(800.0 / 3.0, rel=5e-3)
    assert (energy.min() + case.energy) / 500.0 >= 0.995 and (
        energy.max() + case.energy
    ) / 500.0 <= 1.001
    t, _, energy, mean, dt = followed(PeriodicBar(), name, 3.0)
    assert dt * mean.sum() == pytest.approx(0.5, rel=0.03)
    assert energy.min() >= 0.98 * 0.125 and energy.max() <= (1.0 + 1e-9) * 0.125
