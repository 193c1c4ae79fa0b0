"""Energetic boundary elements in time: plane pulses, a rod between rollers, positivity, stability,
saved blocks."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest
from bem_rod import rod, smooth_integral, smooth_load
from plane_waves import MATERIAL, SQUARE, pulse

from demos.parts.problems.loose_segments import from_segments
from demos.parts.problems.stored_blocks import stored_blocks
from vi_contact import LinearElastic
from vi_contact.bem import (
    BoundaryMesh,
    BoundaryProblem,
    EnergeticBlocks,
    PoincareSteklov,
    circle,
    energetic_blocks,
    polygon,
    traction_forces,
)
from vi_contact.bem.energetic import march_blocks
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial


@pytest.fixture(scope="module")
def blocks() -> dict[int, EnergeticBlocks]:
    """Squares of 5 and 10 elements a side, c_P dt = h, six crossings of the square."""
    return {
        k: energetic_blocks(polygon(SQUARE, 1.0 / k), MATERIAL, dt=1.0 / k, steps=6 * k)
        for k in (5, 10)
    }


@pytest.mark.long
@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize(("shear", "fine"), [(False, 1.4e-2), (True, 1.6e-2)])
def test_plane_pulses(blocks, symmetric, shear, fine):
    """B4: displacement of the whole boundary under the tractions of an oblique pulse, T = 4; order
    > 1.85."""
    wave, errors = pulse(shear=shear), []
    for k, b in blocks.items():
        forces = traction_forces(b.mesh, wave.traction, dt=b.dt, steps=4 * k)
        exact = np.array([wave.displacement(b.mesh.points, b.dt * (j + 1)).T for j in range(4 * k)])
        found = BoundaryProblem(PoincareSteklov(b, 1.0, symmetric), forces).solve().displacement
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[1] < fine and np.log2(errors[0] / errors[1]) > 1.85


def with_hole(k: int) -> BoundaryMesh:
    """The square less one of 0.4 a side in its middle."""
    outer, inner = (
        polygon(SQUARE, 1.0 / k),
        polygon(0.4 * np.array(SQUARE[::-1]), 1.0 / k, exterior=True),
    )
    return from_segments(
        np.concatenate([outer.points, inner.points]),
        np.concatenate([outer.elements, inner.elements + len(outer)]),
    )


def triangle(k: int) -> BoundaryMesh:
    return polygon([(-0.5, -0.4), (0.5, -0.3), (-0.3, 0.4)], 1.0 / k)


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "fine"), [(with_hole, 1.4e-2), (triangle, 2.8e-2)])
def test_plane_pulses_in_other_shapes(shape, fine):
    """B4: several loops, re-entrant and acute corners, elements at all angles to the fronts."""
    wave, errors = pulse(), []
    for k in (5, 10):
        mesh = shape(k)
        forces = traction_forces(mesh, wave.traction, dt=1.0 / k, steps=3 * k)
        exact = np.array([wave.displacement(mesh.points, (j + 1) / k).T for j in range(3 * k)])
        b = energetic_blocks(mesh, MATERIAL, dt=1.0 / k, steps=3 * k)
        found = BoundaryProblem(PoincareSteklov(b, 1.0), forces).solve().displacement
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[1] < fine and np.log2(errors[0] / errors[1]) > 1.8


def echoes(t: np.ndarray, integral) -> np.ndarray:
    """Displacement of the top: the load's integral and its echoes from the fixed base."""
    return integral(t) + 2.0 * sum(
        (-1) ** j * integral(t - 2.0 * j) for j in range(1, int(t.max() / 2) + 1)
    )


@pytest.mark.long
@pytest.mark.parametrize("symmetric", [True, False])
def test_rod_under_a_step(blocks, symmetric):
    """B5: top displacement to 1 %, the reaction of the base (exactly 0 or 2) never above 2.05; work
    2 at t = 2."""
    problem = rod(blocks[10], lambda t: 1.0, symmetric=symmetric)
    motion, mesh = problem.solve(), blocks[10].mesh
    exact = echoes(motion.times, lambda t: np.maximum(t, 0.0))
    top = motion.displacement[:, 1][:, mesh.nodes_of(mesh.labels == 2)]
    base = -motion.forces[:, 1][:, mesh.nodes_of(mesh.labels == 0)].sum(axis=1)
    assert np.linalg.norm(top - exact[:, None]) < 1e-2 * np.linalg.norm(
        np.repeat(exact[:, None], top.shape[1], 1)
    )
    assert 2.0 < base.max() < 2.05 and np.abs(base[:9]).max() < 0.01
    assert motion.work[19] == pytest.approx(2.0, abs=0.02) and abs(motion.work[39]) < 0.04


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.promise("theory/bem.md", "The order is 2 where the solution is smooth", bound="1.9")
def test_rod_under_a_smooth_load(blocks, symmetric):
    """B5: 0.7 % with 10 elements a side, order 1.9 from 5; supports do no work."""
    errors = []
    for b in blocks.values():
        motion = rod(b, smooth_load, symmetric=symmetric).solve()
        exact = echoes(motion.times, smooth_integral)[:, None]
        top = motion.displacement[:, 1][:, b.mesh.nodes_of(b.mesh.labels == 2)]
        errors.append(
            np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape))
        )
    assert errors[1] < 7e-3 and np.log2(errors[0] / errors[1]) > 1.9
    increments = np.diff(motion.displacement, axis=0, prepend=0.0)
    top_work = (
        (motion.forces * increments)[:, :, b.mesh.nodes_of(b.mesh.labels == 2)]
        .sum(axis=(1, 2))
        .cumsum()
    )
    assert motion.work == pytest.approx(top_work, abs=1e-12)


def test_both_forms_give_the_same_impulse(blocks):
    """B7: impulse on the base at t = 4 within 0.5 %; tractions of both agree with the nodal
    reactions."""
    impulses = {}
    for symmetric in (True, False):
        motion, mesh = rod(blocks[10], lambda t: 1.0, symmetric=symmetric).solve(), blocks[10].mesh
        base = mesh.labels == 0
        impulses[symmetric] = -blocks[10].dt * motion.forces[:40, 1][:, mesh.nodes_of(base)].sum()
        pressure = -(motion.traction[:40, 1, base].mean(axis=2) * mesh.lengths[base]).sum(axis=1)
        assert np.abs(-blocks[10].dt * pressure.sum()) == pytest.approx(
            impulses[symmetric], rel=0.01
        )
    assert (
        impulses[True] == pytest.approx(impulses[False], rel=5e-3) == pytest.approx(4.0, rel=1e-2)
    )


def test_compliance_is_the_inverse_seen_from_the_contact(blocks):
    """u_c = W * lam + u_free is what solve() gives; W_0 symmetric, eigenvalues 1.0 to 5.3 (free
    body); density."""
    free = replace(rod(blocks[5], smooth_load, rho=3.0), fixed=None)
    compliance = free.condensed()
    lam = np.random.default_rng(1).standard_normal(compliance.u_free.shape)
    motion = free.solve(lam)
    direct = motion.displacement[:, :, compliance.nodes].reshape(len(lam), -1)
    assert np.abs(compliance.displacement(lam) - direct).max() < 1e-11 * np.abs(direct).max()
    first = 3.0 * compliance.W[0]
    assert np.abs(first - first.T).max() < 1e-12
    assert np.linalg.eigvalsh(first)[[0, -1]] == pytest.approx([1.05, 5.30], 1e-2)
    assert np.allclose(compliance.normals, (0, -1)) and compliance.lengths.sum() == pytest.approx(
        1.0
    )


def test_motion_everywhere_gives_the_forces_back(blocks):
    """S of the displacements of the rod gives back its forces, reactions included."""
    for symmetric in (True, False):
        problem = rod(blocks[5], smooth_load, symmetric=symmetric, rho=2.0)
        motion, everywhere = problem.solve(), np.ones_like(problem.fixed)
        forces = replace(problem, fixed=everywhere, prescribed=motion.displacement).solve().forces
        assert np.abs(forces - motion.forces).max() < 1e-11 * np.abs(forces).max()


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_symmetric_form_is_positive_definite(ratio):
    """B6: smallest eigenvalue of the symmetric part of the space-time S (increments, 20 steps)
    above zero."""
    steps, mesh = 20, polygon(SQUARE, 0.2)
    small = energetic_blocks(mesh, MATERIAL, dt=0.2 * ratio, steps=steps)
    n = 2 * len(mesh)
    held = np.broadcast_to(np.eye(n), (steps, n, n))  # unit increments in step 0
    columns = march_blocks(small, np.ones(n, bool), np.zeros((steps, n, n)), held)[2]
    whole = np.zeros((steps, n, steps, n))
    for k in range(steps):
        for j in range(k + 1):
            whole[k, :, j] = columns[k - j]
    matrix = whole.reshape(steps * n, steps * n)
    eigenvalues = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    assert 0.0 < eigenvalues[0] < eigenvalues[-1]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.1, 0.73, 4.0])
def test_stable_for_small_and_large_time_steps(ratio):
    """B5: the rod stays bounded for c_P dt / h from 0.1 to 4 (to t = 60: benchmarks/bem.py)."""
    dt = 0.5 * ratio
    small = energetic_blocks(polygon(SQUARE, 0.5), MATERIAL, dt=dt, steps=round(8 / dt))
    motion = rod(small, smooth_load).solve()
    assert np.abs(motion.displacement).max() < 1.2 and motion.work.min() > -1e-12
    assert (motion.work[motion.times > 2.0] < 1.2 * motion.work.max()).all()


@pytest.mark.long
def test_slow_load_is_static():
    """The rod pulled slowly: u_y = p y / (lambda + 2 mu), lambda + 2 mu = 1, to 0.1 %."""
    mesh = polygon(SQUARE, 0.25)
    slow = energetic_blocks(mesh, MATERIAL, dt=1.0, steps=60)
    motion = rod(slow, lambda t: float(np.tanh((t / 20.0) ** 2))).solve()
    assert motion.displacement[-1, 1] == pytest.approx(mesh.points[:, 1] + 0.5, abs=1e-3)
    assert motion.work[-1] == pytest.approx(0.5, rel=2e-3)


@pytest.mark.long
def test_a_free_disk_keeps_its_momentum():
    """A push at the lowest point and no support: the mean velocity is impulse / mass."""
    mesh = circle(0.5, 24)
    flying = energetic_blocks(mesh, MATERIAL, dt=0.1, steps=50)
    forces = np.zeros((50, 2, 24))
    forces[:10, 1, 0] = 1.0
    u = BoundaryProblem(PoincareSteklov(flying, 1.0), forces).solve().displacement
    share = mesh.node_lengths(np.ones(len(mesh), bool)) / mesh.lengths.sum()
    mean = (u[:, 1] * share).sum(axis=1)
    velocity = np.polyfit(flying.dt * np.arange(20, 51), mean[19:], 1)[0]
    assert velocity == pytest.approx(1.0 / mesh.area, rel=0.01)


def test_prescribed_motion(blocks):
    """The top of the rod moved as it moved under its load: the reactions there are the load, all
    else the same."""
    loaded = rod(blocks[5], smooth_load, rho=2.0)
    motion = loaded.solve()
    fixed = loaded.fixed.copy()
    fixed[1] |= blocks[5].mesh.nodes_of(blocks[5].mesh.labels == 2)
    moved = replace(
        loaded, forces=np.zeros_like(loaded.forces), fixed=fixed, prescribed=motion.displacement
    ).solve()
    assert np.abs(moved.displacement - motion.displacement).max() < 1e-12
    assert np.abs(moved.forces - motion.forces).max() < 1e-11 * np.abs(motion.forces).max()


def test_saved_blocks(tmp_path):
    """Saved blocks come back to the last bit, for another density too; those of another problem are
    refused."""
    path, mesh = tmp_path / "square.h5", polygon(SQUARE, 0.2)
    b = stored_blocks(path, mesh, MATERIAL, dt=0.2, steps=4)
    whole = path.read_bytes()
    heavy = LinearElastic.from_wave_speeds(1.0, 0.5, 9.0)
    again = stored_blocks(path, polygon(SQUARE, 0.2), heavy, dt=0.2, steps=3)
    assert np.array_equal(again.single, b.single[:3]) and np.array_equal(again.hyper, b.hyper[:3])
    other = LinearElastic.from_wave_speeds(1.0, 0.6, 1.0)
    for body, material, options, message in (
        (polygon(SQUARE, 0.25), MATERIAL, {"dt": 0.2, "steps": 4}, "20 elements, here 16"),
        (circle(0.5, 20), MATERIAL, {"dt": 0.2, "steps": 4}, "other points"),
        (mesh, other, {"dt": 0.2, "steps": 4}, "c_s = 0.5, here 0.6"),
        (mesh, MATERIAL, {"dt": 0.1, "steps": 4}, "dt = 0.2, here 0.1"),
        (mesh, MATERIAL, {"dt": 0.2, "steps": 99}, "4 time steps, here 99"),
    ):
        with pytest.raises(InputError, match=f"another problem.*{message}"):
            stored_blocks(path, body, material, **options)
    for damage in (
        lambda f: f.__delitem__("single"),
        lambda f: f.attrs.__delitem__("c_p"),
        lambda f: changed(f, "hyper"),
        lambda f: f.attrs.__setitem__("dt", "fast"),
        lambda f: f.attrs.__setitem__("c_s", np.nan),
        lambda f: f["double"].write_direct(b.double * np.nan),
        lambda f: f["points"].write_direct(np.nan * mesh.points),
        lambda f: f.attrs.__setitem__("format", "1"),
        lambda f: f.attrs.__delitem__("format"),
    ):
        path.write_bytes(whole)
        with h5py.File(path, "r+") as file:
            damage(file)
        with pytest.raises(InputError, match=r"square\.h5"):
            stored_blocks(path, mesh, MATERIAL, dt=0.2, steps=4)
    for content, kind in (("nothing", "no HDF5 file"), (None, "no HDF5 file")):
        path.unlink()
        path.mkdir() if content is None else path.write_text(content)
        with pytest.raises(InputError, match=kind):
            stored_blocks(path, mesh, MATERIAL, dt=0.2, steps=4)
    assert [one.name for one in tmp_path.iterdir()] == ["square.h5"]
    with pytest.raises(InputError, match="cannot be written"):
        stored_blocks("/proc/blocks.h5", mesh, MATERIAL, dt=0.2, steps=1)


def changed(file: h5py.File, name: str) -> None:
    """A data set of another shape."""
    del file[name]
    file[name] = np.zeros((30, 3))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"dt": 3.0, "steps": 2}, "reduce the time step"),
        ({"dt": 0.004, "steps": 2}, "enlarge the time step"),
        ({"dt": -1.0, "steps": 2}, "above zero"),
        ({"dt": 0.2, "steps": 0}, "steps is 0; give a whole number of at least 1"),
        ({"dt": 0.2, "steps": 2.5}, "steps is 2.5"),
    ],
)
def test_time_steps_that_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        energetic_blocks(polygon(SQUARE, 0.2), MATERIAL, **options)


def test_other_errors(blocks):
    operator = PoincareSteklov(blocks[5], 1.0)
    with pytest.raises(InputError, match="assemble it with more steps"):
        BoundaryProblem(operator, np.zeros((99, 2, 20))).solve()
    with pytest.raises(InputError, match=r"fixed has shape \(20,\)"):
        BoundaryProblem(operator, np.zeros((3, 2, 20)), np.zeros(20, bool))
    with pytest.raises(InputError, match="contact is empty"):
        BoundaryProblem(operator, np.zeros((3, 2, 20))).condensed()
    with pytest.raises(InputError, match="mass density"):
        PoincareSteklov(blocks[5], 0.0)
    with pytest.raises(InputError, match="nu"):
        LinearElastic(E=1.0, nu=0.5, rho=1.0)
