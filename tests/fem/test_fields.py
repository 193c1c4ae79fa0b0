"""Field output: stresses against closed forms, frames in the input's order on any number of ranks,
always readable."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from math import cos, pi, sin, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import h5py
from all_ranks import seen
from fem_problems import BOX_DT, CONCRETE, block, field, shaken_wall, thrown_box, turned
from tipped import ROUGH_ON_ONE_SIDE, tipped

from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.core.surfaces import empty_surface
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.output.fields import XDMF, VonMises
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic, PlaneStrain, PlaneStress, Section
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.run.march import march
from vi_contact.run.recorders import Contact
from vi_contact.run.simulate import Solution, simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

DT = 1.0 / 560.0
RUBBER = LinearElastic(E=3.0e6, nu=0.3, rho=1000.0)


def run(
    problem: ContactProblem, out: Path | None, steps: int = 12, every: int = 5, **more: Any
) -> Solution:
    """A run with fields."""
    fields = None if out is None else XDMF(every=every)
    return simulate(
        problem,
        scheme=ZienkiewiczWoodTaylor(),
        solver=Condensed(),
        dt=DT,
        steps=steps,
        out=out,
        fields=fields,
        **more,
    )


def frames(folder: Path) -> list[dict[str, Any]]:
    """What a reader of XDMF finds: for every grid its time and the arrays that its data items point
    to."""
    found = []
    for grid in ET.parse(folder / "fields.xdmf").getroot().iter("Grid"):
        if grid.get("GridType") != "Uniform":
            continue
        arrays = {
            "t": float(grid.find("Time").get("Value")),
            "type": grid.find("Topology").get("TopologyType"),
        }
        arrays["cells"] = read(folder, grid.find("Topology/DataItem"))
        arrays["points"] = read(folder, grid.find("Geometry/DataItem"))
        for attribute in grid.findall("Attribute"):
            arrays[attribute.get("Name")] = read(folder, attribute.find("DataItem"))
            rows = len(arrays["cells" if attribute.get("Center") == "Cell" else "points"])
            assert len(arrays[attribute.get("Name")]) == rows
        found.append(arrays)
    return found


def read(folder: Path, item: Any) -> Any:
    """The array of a data item, whose description must be that of the dataset."""
    file, path = item.text.split(":")
    with h5py.File(folder / file, "r") as opened:
        dataset = opened[path]
        assert " ".join(map(str, dataset.shape)) == item.get("Dimensions")
        assert dataset.dtype.itemsize == int(item.get("Precision"))
        assert {"f": "Float", "i": "Int"}[dataset.dtype.kind] == item.get("NumberType")
        return dataset[()]


def measure(points: Any, cells: Any) -> Any:
    """Area or volume of cells in VTK's order, by the divergence theorem over its faces; a wrong
    order gives another."""
    x = points[cells]
    if np.ptp(points[:, 2]) == 0.0:
        after = np.roll(x, -1, axis=1)
        return 0.5 * np.sum(x[..., 0] * after[..., 1] - x[..., 1] * after[..., 0], axis=1)
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    if cells.shape[1] == 8:
        squares = [
            (0, 3, 2, 1),
            (4, 5, 6, 7),
            (0, 1, 5, 4),
            (1, 2, 6, 5),
            (2, 3, 7, 6),
            (3, 0, 4, 7),
        ]
        faces = [triangle for a, b, c, d in squares for triangle in ((a, b, c), (a, c, d))]
    return sum(
        np.einsum("ij,ij->i", np.cross(x[:, a], x[:, b]), x[:, c]) / 6.0 for a, b, c in faces
    )


# Stresses
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "section", [PlaneStrain(), PlaneStrain(0.25), PlaneStress(0.2), PlaneStress()], ids=repr
)
@pytest.mark.parametrize("simplices", [False, True])
def test_von_mises_of_uniform_plane_stress_and_strain(
    comm: Any, section: Section, simplices: bool
) -> None:
    """sigma_v² = s_x² + s_y² + s_z² - s_x s_y - s_y s_z - s_z s_x + 3 s_xy², with Hooke's law
    written out."""
    mesh, _ = block(comm, lengths=(2.0, 1.0), divisions=(3, 2), simplices=simplices, angle=0.4)
    system = assemble(mesh, RUBBER, section=section)
    gradient = np.array([[1e-3, 4e-4], [-2e-4, 2.5e-3]])
    stress = VonMises(system.space.forms)(system.space.points @ gradient.T)
    e_x, e_y, e_xy = gradient[0, 0], gradient[1, 1], 0.5 * (gradient[0, 1] + gradient[1, 0])
    E, nu = RUBBER.E, RUBBER.nu
    if isinstance(section, PlaneStress):
        s_x, s_y, s_z = E / (1 - nu**2) * (e_x + nu * e_y), E / (1 - nu**2) * (e_y + nu * e_x), 0.0
    else:
        factor = E / ((1 + nu) * (1 - 2 * nu))
        s_x, s_y = factor * ((1 - nu) * e_x + nu * e_y), factor * ((1 - nu) * e_y + nu * e_x)
        s_z = nu * (s_x + s_y)
    s_xy = E / (1 + nu) * e_xy
    exact = sqrt(s_x**2 + s_y**2 + s_z**2 - s_x * s_y - s_y * s_z - s_z * s_x + 3 * s_xy**2)
    assert len(stress) == mesh.topology.index_map(2).size_local
    assert stress == pytest.approx(exact, rel=1e-12)


@pytest.mark.two_ranks
@pytest.mark.parametrize("simplices", [False, True])
def test_von_mises_in_three_dimensions(comm: Any, simplices: bool) -> None:
    """Pure shear gamma in x, y: √3 G gamma. A pressure has none."""
    mesh, _ = block(comm, lengths=(1.0, 1.0, 2.0), divisions=(2, 2, 2), simplices=simplices)
    system = assemble(mesh, RUBBER)
    von_mises, x = VonMises(system.space.forms), system.space.points
    shear = np.column_stack([1e-3 * x[:, 1], 0.0 * x[:, 0], 0.0 * x[:, 0]])
    assert von_mises(shear) == pytest.approx(sqrt(3.0) * RUBBER.shear_modulus * 1e-3, rel=1e-12)
    assert np.all(von_mises(1e-3 * x) < 1e-9 * RUBBER.E * 1e-3)


@pytest.mark.two_ranks
def test_von_mises_of_bending_is_a_cell_mean(comm: Any) -> None:
    """u = (x y, 0), nu = 0, E = 1, plane stress: sigma_x = y, sigma_xy = x/2, so the mean of √(y² +
    3 x²/4)."""
    mesh, _ = block(comm, lengths=(1.0, 1.0), divisions=(1, 2), corner=(0.0, 1.0))
    system = assemble(mesh, LinearElastic(E=1.0, nu=0.0, rho=1.0), section=PlaneStress())
    x, y = system.space.points.T
    stress = VonMises(system.space.forms)(np.column_stack([x * y, 0.0 * x]))
    numbers = np.asarray(mesh.topology.original_cell_index)[: len(stress)]
    values = [
        value
        for _, value in sorted(sum(comm.allgather(list(zip(numbers, stress, strict=True))), []))
    ]
    points, weights = np.polynomial.legendre.leggauss(20)
    s, w = 0.5 * (points + 1.0), 0.5 * weights
    for value, low in zip(values, (1.0, 1.5), strict=True):
        mean = sum(
            a * b * sqrt((low + 0.5 * t) ** 2 + 3.0 * (0.5 * r) ** 2)
            for r, a in zip(s, w, strict=True)
            for t, b in zip(s, w, strict=True)
        )
        assert value == pytest.approx(mean, rel=2e-3)  # two Gauss points per axis


# Frames
# --------------------------------------------------------------------------------------------------


def test_frames_hold_the_run(comm: Any, shared_tmp: Path) -> None:
    """Frames at steps 0, 18, 36 with the displacement, velocity and contact of a march, turned back
    to the axes."""
    problem = shaken_wall(comm, angle=0.3, gap=1e-7)
    run(problem, shared_tmp, 40, 18)
    found = frames(shared_tmp)
    assert [round(frame["t"] / DT) for frame in found] == [0, 18, 36]
    for frame, steps in zip(found, (0, 18, 36), strict=True):
        solution = run(problem, None, steps)
        state = solution.state
        points, u = field(problem.system, problem.cartesian(state.u))
        _, v = field(problem.system, problem.cartesian(state.v))
        assert frame["t"] == state.t
        for name, exact in (("points", points), ("u", u), ("v", v)):
            assert np.allclose(
                frame[name][:, :2],
                exact,
                rtol=0.0,
                atol=1e-10 * np.max(np.abs(exact), initial=1e-300),
            )
            assert frame[name].shape[1] == 3 and not frame[name][:, 2].any()
        near = [
            int(np.argmin(np.linalg.norm(points - x, axis=1))) for x in seen(problem.surface).points
        ]
        status, pressure = np.zeros(len(points), int), np.zeros(len(points))
        contact = seen(problem.surface)
        status[near] = np.where(contact.all(state.active), 2, 1)
        pressure[near] = contact.all(state.r_n) / contact.weights
        assert frame["contact_status"].tolist() == status.tolist()
        assert np.allclose(
            frame["contact_pressure"], pressure, rtol=1e-9, atol=1e-9 * pressure.max()
        )
    assert not found[0]["a"].any() and found[1]["a"].any()
    assert (found[2]["contact_status"] == 2).any()


@pytest.mark.slow
def test_friction_in_the_frames(comm: Any, shared_tmp: Path) -> None:
    """Status 2 where a point sticks and 3 where it slipped; traction and slip as vectors along the
    turned tangents."""
    problem = tipped(comm, ROUGH_ON_ONE_SIDE[0], simplices=True, angle=0.3)
    surface = seen(problem.surface)
    simulate(
        problem,
        scheme=ZienkiewiczWoodTaylor(),
        solver=Condensed(),
        dt=BOX_DT,
        steps=24,
        out=shared_tmp,
        fields=XDMF(every=1),
    )
    found = frames(shared_tmp)
    nodes = [
        int(np.argmin(np.linalg.norm(found[0]["points"][:, :2] - x, axis=1)))
        for x in surface.points
    ]
    others = np.setdiff1d(np.arange(len(found[0]["points"])), nodes)
    tangents = np.column_stack(
        [-surface.normals[:, 1], surface.normals[:, 0], np.zeros(surface.count)]
    )
    found_status = set()
    for frame, (state, report) in zip(
        found[1:],
        march(problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=BOX_DT, steps=24),
        strict=True,
    ):
        slips = (surface.tangential_values(report.result.x) != surface.all(report.step.slip0))[:, 0]
        status = np.where(surface.all(state.active), np.where(slips, 3, 2), 1)
        assert frame["contact_status"][nodes].tolist() == status.tolist()
        traction, slip = (
            surface.all(state.r_t) / surface.weights[:, None],
            surface.tangential_values(state.u),
        )
        for name, exact in (("contact_traction_t", traction * tangents), ("slip", slip * tangents)):
            assert np.allclose(
                frame[name][nodes], exact, rtol=0.0, atol=1e-10 * np.abs(exact).max()
            )
            assert not frame[name][others].any()
        found_status |= set(frame["contact_status"].tolist())
        assert np.abs(frame["slip"]).max() > 0.0
    assert found_status == {0, 1, 2, 3} and not found[0]["contact_traction_t"].any()


class Counting:
    """A communicator that notes how many numbers are reduced at a time."""

    def __init__(self, comm: Any) -> None:
        self._comm, self.rank, self.size, self.most = comm, comm.rank, comm.size, 0

    def sum(self, x: Any) -> Any:
        self.most = max(self.most, np.size(x))
        return self._comm.sum(x)

    def max(self, x: Any) -> Any:
        self.most = max(self.most, np.size(x))
        return self._comm.max(x)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._comm, name)


def test_contact_beside_the_frames(comm: Any) -> None:
    """Where frames hold the arrays, Contact(arrays=False) finds the same numbers and reduces a
    dozen at a time."""
    problem = tipped(comm, ROUGH_ON_ONE_SIDE[0], simplices=True, angle=0.3)
    counting = Counting(problem.surface.comm)
    thin, whole = Contact(arrays=False), Contact()
    watched = replace(problem, surface=replace(problem.surface, comm=counting))
    thin.start(watched, initial_state(problem))
    whole.start(problem, initial_state(problem))
    for _, report in march(problem, scheme=ZienkiewiczWoodTaylor(), dt=BOX_DT, steps=12):
        row, exact = thin.row(report), whole.row(report)
        assert set(exact) - set(row) == {"pressure", "gap", "active", "traction_t", "slip"}
        assert all(
            row[name] == pytest.approx(exact[name], rel=1e-10, abs=1e-300, nan_ok=True)
            for name in row
        )
    assert row["contact_active"] > 0 and row["contact_max_slip"] > 0.0
    assert 1 <= counting.most <= 12 < problem.surface.total


def test_friction_in_space(comm: Any, shared_tmp: Path) -> None:
    """Vectors lie in the plane of the obstacle and are as long as r_t / weight; without friction
    the frames are as before."""
    problem = replace(thrown_box(comm, angle=0.3, divisions=(2, 2, 2)), friction=Coulomb(0.3))
    solution = simulate(
        problem,
        scheme=ZienkiewiczWoodTaylor(),
        solver=Condensed(),
        dt=BOX_DT,
        steps=8,
        out=shared_tmp / "box",
        fields=XDMF(every=8),
    )
    last, surface = frames(shared_tmp / "box")[-1], seen(problem.surface)
    size = np.linalg.norm(surface.all(solution.state.r_t), axis=1) / surface.weights
    nodes = [int(np.argmin(np.linalg.norm(last["points"] - x, axis=1))) for x in surface.points]
    traction = last["contact_traction_t"][nodes]
    assert size.max() > 0.0
    assert np.allclose(np.linalg.norm(traction, axis=1), size, rtol=1e-9, atol=1e-9 * size.max())
    assert np.abs(np.sum(traction * surface.normals, axis=1)).max() <= 1e-12 * size.max()
    run(shaken_wall(comm), shared_tmp / "wall", 1, 1)
    assert not {"slip", "contact_traction_t"} & set(frames(shared_tmp / "wall")[0])


@pytest.mark.two_ranks
def test_acceleration_is_that_of_the_step(comm: Any, shared_tmp: Path) -> None:
    """a = (v_new - v_old)/dt where no impact law changes the velocity."""
    mesh, tags = block(comm, lengths=(1.0, 2.0), divisions=(2, 3))
    system = assemble(mesh, RUBBER, clamped=tags["bottom"], initial_velocity=(0.1, 0.0))
    problem = ContactProblem(system, empty_surface(system.space.comm, 2))
    run(problem, shared_tmp, 2, 1)
    _, before, after = frames(shared_tmp)
    assert np.allclose(
        after["a"], (after["v"] - before["v"]) / DT, rtol=0.0, atol=1e-9 * np.abs(after["a"]).max()
    )


@pytest.mark.two_ranks
def test_prescribed_motion_is_in_the_fields(comm: Any, shared_tmp: Path) -> None:
    """Nodes that are moved by hand have their displacement, velocity and acceleration in every
    frame."""
    mesh, tags = block(comm, lengths=(1.0, 2.0), divisions=(2, 3))
    w = 2.0 * pi * 5.0
    motion = Prescribed(
        tags["bottom"],
        displacement=lambda x, t: np.tile([1e-3 * sin(w * t), 0.0], (len(x), 1)),
        velocity=lambda x, t: np.tile([1e-3 * w * cos(w * t), 0.0], (len(x), 1)),
        acceleration=lambda x, t: np.tile([-1e-3 * w**2 * sin(w * t), 0.0], (len(x), 1)),
    )
    system = assemble(mesh, RUBBER, prescribed=motion, initial_velocity=(1e-3 * w, 0.0))
    run(ContactProblem(system, empty_surface(system.space.comm, 2)), shared_tmp, 6, 3)
    last = frames(shared_tmp)[-1]
    bottom, t = last["points"][:, 1] == 0.0, 6 * DT
    assert bottom.sum() == 3
    for name, exact in (("u", sin(w * t)), ("v", w * cos(w * t)), ("a", -(w**2) * sin(w * t))):
        assert last[name][bottom, 0] == pytest.approx(1e-3 * exact, rel=1e-12)


@pytest.mark.parametrize(
    ("lengths", "divisions", "simplices", "kind"),
    [
        ((2.0, 3.0), (2, 3), False, "Quadrilateral"),
        ((2.0, 3.0), (2, 3), True, "Triangle"),
        ((2.0, 1.0, 3.0), (2, 1, 3), False, "Hexahedron"),
        ((2.0, 1.0, 3.0), (2, 1, 3), True, "Tetrahedron"),
    ],
)
def test_cells_in_the_order_of_vtk(
    comm: Any, shared_tmp: Path, lengths: Any, divisions: Any, simplices: bool, kind: str
) -> None:
    """Every cell has its positive area or volume in VTK's vertex order, and they fill the body."""
    mesh, tags = block(comm, lengths=lengths, divisions=divisions, simplices=simplices)
    system = assemble(mesh, CONCRETE, clamped=tags["bottom"])
    problem = ContactProblem(system, contact_surface(system, tags["right"]))
    run(problem, shared_tmp, 1, 1)
    frame = frames(shared_tmp)[-1]
    sizes = (
        np.abs(measure(frame["points"], frame["cells"]))
        if simplices
        else measure(frame["points"], frame["cells"])
    )
    assert frame["type"] == kind
    assert sizes.min() > 0.0 and sizes.sum() == pytest.approx(np.prod(lengths), rel=1e-12)
    if not simplices:
        assert np.allclose(sizes, np.prod(lengths) / len(sizes), rtol=1e-12)


@pytest.mark.long
def test_files_do_not_depend_on_the_ranks(comm: Any, shared_tmp: Path) -> None:
    """The frames of all ranks together and of one rank alone: same mesh, same order, fields to
    1e-10."""
    from mpi4py import MPI

    def wall(ranks: Any) -> ContactProblem:
        return replace(shaken_wall(ranks, angle=0.3, gap=1e-7), friction=Coulomb(0.3))

    run(wall(comm), shared_tmp / "all", 36, 12)
    if comm.rank == 0:
        run(wall(MPI.COMM_SELF), shared_tmp / "one", 36, 12)
    comm.Barrier()
    for together, alone in zip(frames(shared_tmp / "all"), frames(shared_tmp / "one"), strict=True):
        assert np.array_equal(together["cells"], alone["cells"]) and np.array_equal(
            together["points"], alone["points"]
        )
        for name in (
            "u",
            "v",
            "a",
            "von_mises",
            "contact_pressure",
            "contact_status",
            "contact_traction_t",
            "slip",
        ):
            size = np.max(np.abs(alone[name]), initial=0.0)
            assert np.allclose(together[name], alone[name], rtol=0.0, atol=1e-10 * size), name


@pytest.mark.slow
def test_restart_goes_on_after_the_frames_it_keeps(comm: Any, shared_tmp: Path) -> None:
    """Frames behind the checkpoint are removed, and the index never names a frame that is not
    there."""
    problem = shaken_wall(comm)
    run(problem, shared_tmp, 12, 2, checkpoint_every=100)
    late = shared_tmp / "fields" / "frame_000014.h5"
    if comm.rank == 0:
        late.write_bytes(b"of a step after the checkpoint")
    comm.Barrier()
    run(problem, shared_tmp, 12, 2, restart=True)
    assert not late.exists() and [round(frame["t"] / DT) for frame in frames(shared_tmp)] == [
        0,
        2,
        4,
        6,
        8,
        10,
        12,
    ]
    run(problem, shared_tmp, 16, 2, restart=True)
    assert [round(frame["t"] / DT) for frame in frames(shared_tmp)] == list(range(0, 17, 2))
    run(problem, shared_tmp, 2, 2)
    assert [round(frame["t"] / DT) for frame in frames(shared_tmp)] == [0, 2]
    assert len(list((shared_tmp / "fields").glob("frame_*.h5"))) == 2


@pytest.mark.slow
def test_several_frames_in_a_file(comm: Any, shared_tmp: Path) -> None:
    """What a reader finds is the same as with a file for each, also after a restart that drops some
    of a file."""
    problem, folders = (
        shaken_wall(comm, angle=0.3, gap=1e-7),
        (shared_tmp / "each", shared_tmp / "packed"),
    )
    for folder, many in zip(folders, (1, 3), strict=True):
        for steps, restart in ((10, False), (19, True)):
            simulate(
                problem,
                scheme=ZienkiewiczWoodTaylor(),
                dt=DT,
                steps=steps,
                out=folder,
                restart=restart,
                fields=XDMF(every=2, frames_per_file=many),
                checkpoint_every=10,
            )
        assert [round(frame["t"] / DT) for frame in frames(folder)] == list(range(0, 20, 2))
    for one, packed in zip(*(frames(folder) for folder in folders), strict=True):
        assert one.keys() == packed.keys() and all(
            np.array_equal(one[name], packed[name]) for name in one
        )
    kept = sorted(path.name for path in (folders[1] / "fields").iterdir())
    assert kept == ["frame_000018.h5", *(f"frames_{k:06d}.h5" for k in (0, 6, 12)), "mesh.h5"]
    stored = read_frames(folders[1])
    assert stored.t.tolist() == [frame["t"] for frame in frames(folders[1])]
    assert np.array_equal(stored.at(12 * DT)[1], frames(folders[0])[6]["u"][:, :2])


@pytest.mark.slow
def test_restart_drops_late_frames_of_a_file(comm: Any, shared_tmp: Path) -> None:
    """A run killed behind its checkpoint has later frames in a file with earlier ones: only those
    are kept."""
    problem, checkpoint, kept = shaken_wall(comm), shared_tmp / "checkpoint.npz", b""
    for steps in (8, 12, 9):
        simulate(
            problem,
            scheme=ZienkiewiczWoodTaylor(),
            dt=DT,
            steps=steps,
            out=shared_tmp,
            restart=steps != 8,
            fields=XDMF(every=2, frames_per_file=6),
        )
        comm.Barrier()
        if comm.rank == 0:
            kept = kept or checkpoint.read_bytes()
            checkpoint.write_bytes(kept)
        comm.Barrier()
        assert [round(frame["t"] / DT) for frame in frames(shared_tmp)] == list(
            range(0, steps + 1, 2)
        )
        comm.Barrier()
    with h5py.File(shared_tmp / "fields" / "frames_000000.h5") as file:
        assert list(file) == [f"{k:06d}" for k in (0, 2, 4, 6, 8)]


@pytest.mark.parametrize("many", [1, 2])
def test_index_is_readable_after_every_frame(comm: Any, shared_tmp: Path, many: int) -> None:
    """Whatever moment the run is killed at, the index on disk names complete frames only."""
    seen: list[int] = []

    class Looks:
        def columns(self) -> dict[str, tuple[str, str]]:
            return {"looks": ("-", "frames on disk")}

        def start(self, problem: Any, state: Any, resumed: Any = None) -> dict[str, float]:
            return {"looks": 0.0}

        def row(self, report: Any) -> dict[str, float]:
            seen.append(len(frames(shared_tmp)))
            comm.Barrier()
            return {"looks": 1.0}

    simulate(
        shaken_wall(comm), dt=DT, steps=6, out=shared_tmp, fields=XDMF(2, many), record=[Looks()]
    )
    assert seen == [1, 1, 2, 2, 3, 3]


@pytest.mark.two_ranks
def test_bad_settings_are_told(comm: Any, shared_tmp: Path) -> None:
    """every < 1, and a system whose unknowns are nowhere."""
    from chain import chain_problem

    for name in ("every", "frames_per_file"):
        with pytest.raises(InputError, match=f"XDMF: {name} is 0"):
            XDMF(**{name: 0})
    problem = chain_problem(3)
    nowhere = SimpleNamespace(dimension=1, ids=np.arange(3))
    problem = replace(problem, system=problem.system.changed(space=nowhere))
    with pytest.raises(InputError, match="XDMF needs a system made by fem.assemble"):
        XDMF().open(problem, shared_tmp, {})


@pytest.mark.two_ranks
def test_turned_is_the_rotation_of_the_mesh(comm: Any) -> None:
    """The angle of the walls above is not zero: their contact frames are turned."""
    assert shaken_wall(comm, angle=0.3).surface.basis is not None
    assert np.allclose(shaken_wall(comm, angle=0.3).surface.normals, turned((1.0, 0.0), 0.3))
