"""V7.3, two bodies: concrete in concrete. What holds for any pair of bodies, the welded interface,
the slow limit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from demo_runs import demo
from fem_problems import field, linear, run
from mpi4py import MPI
from two_bodies import relative

import vi_contact as vc
from demos.parts.problems.embedded import CONTACT, Embedded, EmbeddedModel, build
from demos.parts.problems.square import concrete
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Traction
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.extract import MeshArrays, add_arrays, arrays_of
from vi_contact.meshes.rows import cell_sides
from vi_contact.run.march import march
from vi_contact.run.simulate import Solution
from vi_contact.run.static import quasi_static
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial  # ranks change none of these numbers: cheaper tests show it

COMM = MPI.COMM_WORLD
EMBEDDED = Embedded(concrete(cells=8))
T_END = 0.02
LOAD = 4.0e6 * np.tanh((20.0 / 15.0) ** 2)  # at the end [N/m]
ROUGH = vc.Coulomb(0.75)
LAWS = {"smooth": vc.Frictionless(), "rough": ROUGH}
cases = pytest.mark.parametrize(
    "law, scheme", [("smooth", vc.Midpoint()), ("rough", None)], ids=["smooth", "rough"]
)
laws = pytest.mark.parametrize("law", LAWS)


@cache
def model() -> EmbeddedModel:
    return build(EMBEDDED, COMM)


@cache
def slowly(law: str, scheme: Any) -> Solution:
    """The load put on within 20 ms."""
    return vc.simulate(
        model().problem(friction=LAWS[law]),
        scheme=scheme,
        dt=2.5e-4,
        t_end=T_END,
        progress=False,
        record=(vc.Energy(), vc.Contact()),
    )


@cases
@pytest.mark.promise("guide/pressed_blocks.md", "The energy ledger closes to 1e-13", bound="1e-10")
def test_certificates_and_ledger(law, scheme):
    """V9.7: every step certified to 1e-9, the ledger closed to 1e-10; what is put in is more than
    what is stored by what friction takes."""
    solution = slowly(law, scheme)
    assert 0.0 < solution.facts["worst_certificate"] <= 1e-9
    assert 0.0 < solution.facts["energy_defect"] <= 1e-10
    history = solution.history
    took = history["loss_friction"][-1]
    stored = history["energy_kinetic"][-1] + history["energy_strain"][-1]
    assert history["work_input"][-1] == pytest.approx(stored + took, rel=1e-9)
    assert (took > 0.02 * stored) if law == "rough" else (took == 0.0)


def per_body(problem: ContactProblem, load: Array) -> Array:
    """(body, d) resultants of a load on the unknowns of the equations: box, free part of the
    block."""
    system, bodies = problem.system, problem.system.space.bodies
    columns = [
        relative(problem, column * (bodies == body))
        for body in (0, 1)
        for column in system.influence.T
    ]
    return np.asarray(system.algebra.comm.sum(np.column_stack(columns).T @ load)).reshape(2, -1)


@cases
@pytest.mark.promise("guide/pressed_blocks.md", "The impulse on the box is minus")
def test_action_is_reaction(law, scheme):
    """V7.3, V9.8: what the box gains in momentum beyond the impulse of the pressure, the block
    loses beyond the impulse of its base, to 1e-12; without friction it is the sum of the reactions
    along the normals."""
    problem = model().problem(friction=LAWS[law])
    dt, impulses, base = 2.5e-4, [], []
    for _, report in march(problem, scheme=scheme, dt=dt, steps=80):
        equations, balance = report.problem.equations, report.balance
        gained = per_body(report.problem, equations.M @ balance.a)
        inner = per_body(report.problem, equations.K @ balance.u)
        box, block = dt * (gained - per_body(report.problem, balance.f) + inner)
        impulses.append((box, block))
        base.append(dt * inner)
        if law == "smooth":
            size = 4.0e6 * dt
            assert box == pytest.approx(
                -dt * (balance.r_n @ problem.surface.normals), abs=1e-12 * size
            )
    on_box, on_block = np.array(impulses).transpose(1, 0, 2)
    size = np.abs(on_box).max()
    assert np.abs(on_box + on_block).max() < 1e-12 * size
    assert np.abs(np.array(base)[:, 0]).max() < 1e-12 * size  # nothing else holds the box
    assert size == pytest.approx(LOAD * dt, rel=0.02) and on_box[-1, 1] > 0.0
    assert np.abs(on_box[:, 0]).max() < 1e-9 * size  # mirror symmetry


@dataclass(frozen=True)
class Whole:
    """The mesh of an `Embedded` whose block is one grid without inner interfaces, cut out at the
    notch."""

    embedded: Embedded

    def build(self, gmsh: Any) -> None:
        n = self.embedded.box.cells
        box = arrays_of(BlockMesh(lengths=(1.0, 1.0), divisions=(n, n), corner=(-0.5, -0.5)))
        block = arrays_of(
            BlockMesh(lengths=(3.0, 2.0), divisions=(3 * n, 2 * n), corner=(-1.5, -2.0))
        )
        x, y = block.points[block.cells].mean(axis=1).T
        kept = block.cells[(np.abs(x) > 0.5) | (y < -0.5)]
        used, cells = np.unique(kept, return_inverse=True)
        cells = np.concatenate([box.cells, len(box.points) + cells.reshape(kept.shape)])
        points = np.concatenate([box.points, block.points[used]])
        add_arrays(
            gmsh,
            MeshArrays(
                "quadrilateral", points, cells, *self._groups(points, cells, len(box.cells))
            ),
        )

    def _groups(
        self, points: Array, cells: Any, count: int
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Cells and boundaries by where they are, the first `count` cells being those of the
        box."""
        inside = np.arange(len(cells)) < count
        sides, owner = cell_sides(cells, "quadrilateral")
        boundaries, bodies = {}, {}
        for name, mesh in self.embedded.blocks().blocks.items():
            own = inside == (name in ("foot", "head"))
            low, high = mesh.points()[0, 0] - 1e-9, mesh.points()[-1, -1] + 1e-9
            bodies[name] = own & np.all((points[cells] > low) & (points[cells] < high), axis=(1, 2))
            for axis, names in enumerate((("left", "right"), ("bottom", "top"))):
                for side, level in zip(names, (low, high), strict=True):
                    flat = np.all(np.abs(points[sides][:, :, axis] - level[axis]) < 1e-6, axis=1)
                    boundaries[f"{name}_{side}"] = sides[flat & bodies[name][owner]]
        return bodies, boundaries


def in_order(system: Any, n: int) -> Any:
    """Order of the nodes by place, those of the box, the first (n + 1)², before those of the
    block."""
    points = np.round(field(system, system.u0)[0], 9)
    return np.lexsort((*points.T, np.arange(len(points)) >= (n + 1) ** 2))


@laws
@pytest.mark.promise("guide/pressed_blocks.md", "Welded parts move like a block of one grid")
def test_a_welded_interface_is_none(law):
    """V7.3: on the block of five welded sub-meshes and on the block of one grid the motion and the
    reactions are the same, to 1e-10."""
    found = []
    for mesh in (None, lambda: Whole(EMBEDDED)):
        model = build(EMBEDDED, COMM, mesh=mesh)
        problem = model.problem(friction=LAWS[law])
        motion = run(problem, scheme=vc.Midpoint(), dt=2.5e-4, steps=30)
        order = in_order(model.system, EMBEDDED.box.cells)
        points = field(model.system, model.system.u0)[0][order]
        found.append(
            (points, motion.u[:, order], motion.r_n[:, np.lexsort(model.surface.points.T)])
        )
    for welded, whole in zip(*found, strict=True):
        assert welded.shape == whole.shape
        assert np.abs(welded - whole).max() < 1e-10 * np.abs(whole).max()


def test_much_friction_is_a_weld():
    """V7.3: with mu = 1e6 nothing slips, and as nothing opens under this load either the box moves
    as if cast in one piece with the block, to 1e-9."""
    model, box = build(EMBEDDED, COMM), EMBEDDED.box
    stuck = run(model.problem(friction=vc.Coulomb(1e6)), scheme=vc.Midpoint(), dt=2.5e-4, steps=60)
    assert stuck.active.all()
    mesh = EMBEDDED.mesh()
    for sides in CONTACT:
        mesh = Welded(mesh, *sides)
    built, tags = build_mesh(mesh, COMM)
    cast = assemble(
        built,
        box.material,
        loads=Traction(tags["head_top"], (0.0, -box.pressure), history=box.history),
        clamped=[tags[name] for name in ("left_bottom", "right_bottom", "under_bottom")],
        section=vc.PlaneStrain(),
    )
    whole = run(linear(cast), scheme=vc.Midpoint(), dt=2.5e-4, steps=60).u
    points = [np.round(field(system, system.u0)[0], 9) for system in (model.system, cast)]
    partner = np.array([np.argmin(np.abs(points[1] - point).max(axis=1)) for point in points[0]])
    assert len(points[0]) == len(points[1]) + 2 * EMBEDDED.box.cells + 1
    assert np.abs(stuck.u - whole[:, partner]).max() < 1e-9 * np.abs(whole).max()


def test_friction_takes_energy():
    """V7.3: less energy, and less work put in, with friction from 2 ms on; its work never
    decreases; none without it. Walls and floor carry the load: m a of the box apart, forces on it
    sum to 0."""
    histories = {law: slowly(law, vc.Midpoint()).history for law in LAWS}
    smooth, rough = histories["smooth"], histories["rough"]
    energy = {law: h["energy_kinetic"] + h["energy_strain"] for law, h in histories.items()}
    late = smooth["t"] > 2e-3
    assert np.all(energy["rough"][late] < energy["smooth"][late])
    assert np.all(rough["work_input"][late] < smooth["work_input"][late])
    assert np.diff(rough["loss_friction"]).min() >= 0.0 and not smooth["loss_friction"].any()
    assert rough["friction_force_y"][-1] == pytest.approx(0.11 * LOAD, rel=0.1)
    assert smooth["contact_force_y"][-1] == pytest.approx(LOAD, rel=0.01)
    assert rough["contact_force_y"][-1] + rough["friction_force_y"][-1] == pytest.approx(
        LOAD, rel=0.02
    )


@pytest.mark.parametrize(("law", "tolerance"), [("smooth", 5e-3), ("rough", 0.02)])
@pytest.mark.promise(
    "guide/pressed_blocks.md", "put on in four static steps, to 0.4 %", bound="0.5 %"
)
@pytest.mark.promise("guide/pressed_blocks.md", "With friction it is so to 2 %")
def test_slow_limit(law, tolerance):
    """The energy at 20 ms is that of the same load put on without inertia, and the load is in
    equilibrium there."""
    problem = model().problem(friction=LAWS[law])
    history = slowly(law, vc.Midpoint()).history
    *_, state = quasi_static(problem, T_END * np.arange(1, 5) / 4, solver=Condensed())
    energy = problem.equations.strain_energy(state.u)
    assert history["energy_kinetic"][-1] + history["energy_strain"][-1] == pytest.approx(
        energy, rel=tolerance
    )
    if law == "smooth":
        assert (state.r_n @ problem.surface.normals)[1] == pytest.approx(-LOAD, rel=1e-9)


def test_stiff_block_and_no_lateral_strain():
    """nu = 0 and a block 10⁴ times as stiff: the box is in uniaxial stress, E = f² a²/(2E), and the
    walls are bare."""
    box = replace(EMBEDDED.box, material=vc.LinearElastic(E=2.0e10, nu=0.0, rho=2400.0))
    model = build(Embedded(box, block=vc.LinearElastic(E=2.0e14, nu=0.0, rho=2400.0)), COMM)
    problem = model.problem()
    *_, state = quasi_static(problem, [T_END], solver=Condensed())
    assert problem.equations.strain_energy(state.u) == pytest.approx(
        LOAD**2 / (2.0 * 2.0e10), rel=3e-4
    )
    floor = model.surface.normals[:, 1] < -0.5
    pressure = state.r_n / model.surface.weights / LOAD
    assert pressure[floor] == pytest.approx(1.0, abs=1e-2)
    assert np.abs(pressure[~floor]).max() < 1e-2


def test_refusals():
    """One sentence each."""
    with pytest.raises(InputError, match="even number"):
        Embedded(concrete(cells=5))
    with pytest.raises(InputError, match="confined=False"):
        Embedded(replace(concrete(cells=4), confined=True))


def test_the_embedded_demo(comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V7.3 in the demo, small: certified, ledgers closed, less energy with friction, figures
    drawn."""
    numbers = demo("concrete_in_concrete").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    for name in LAWS:
        assert (
            0.0 < numbers[f"{name}: certificate"] <= 1e-9
            and 0.0 < numbers[f"{name}: ledger defect"] <= 1e-10
        )
        assert numbers[f"{name}: floor"] + numbers[f"{name}: walls"] == pytest.approx(1.0, abs=0.02)
    assert (
        numbers["rough: friction"] > 0.0
        and numbers["rough: E(20 ms)"] < numbers["smooth: E(20 ms)"]
    )
    for figure in ("snapshots", "energies"):
        assert (shared_tmp / f"{figure}.png").stat().st_size > 6_000
    assert comm.rank or "shares of load" in capsys.readouterr().out
