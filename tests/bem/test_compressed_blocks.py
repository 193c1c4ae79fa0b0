"""Blocks compressed in time and a circle of frequencies, against dense blocks and a march."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from plane_waves import MATERIAL, SQUARE

from demos.parts.problems.loose_segments import from_segments
from vi_contact.bem import (
    BoundaryContact,
    BoundaryMesh,
    BoundaryProblem,
    CompressedBlocks,
    EnergeticBlocks,
    PoincareSteklov,
    circle,
    energetic_blocks,
    march_contact,
    polygon,
    traction_forces,
)
from vi_contact.core.errors import InputError, StepFailure

pytestmark = pytest.mark.serial
RHO = 2.5


def with_hole() -> BoundaryMesh:
    """A square with a smaller one cut out: two loops, elements of two lengths."""
    outer, inner = polygon(SQUARE, 0.25), polygon(0.4 * np.array(SQUARE[::-1]), 0.2, exterior=True)
    return from_segments(
        np.concatenate([outer.points, inner.points]),
        np.concatenate([outer.elements, inner.elements + len(outer)]),
    )


SHAPES = {
    "square": (lambda: polygon(SQUARE, 0.2), 0.2, 32),
    "thin slab": (
        lambda: polygon([(0.0, 0.0), (1.0, 0.0), (1.0, 0.02), (0.0, 0.02)], [5, 1, 5, 1]),
        0.1,
        44,
    ),
    "disk": (lambda: circle(0.5, 25), 0.15, 30),
    "hole": (with_hole, 0.25, 28),
    "outside": (lambda: circle(0.5, 14, exterior=True), 0.2, 30),
}


@cache
def both(shape: str, threads: int = 1) -> tuple[EnergeticBlocks, CompressedBlocks]:
    """Dense and compressed blocks of a shape."""
    make, dt, steps = SHAPES[shape]
    mesh = make()
    dense, short = (
        energetic_blocks(mesh, MATERIAL, dt=dt, steps=steps, compressed=compressed, threads=threads)
        for compressed in (False, True)
    )
    assert isinstance(dense, EnergeticBlocks) and isinstance(short, CompressedBlocks)
    return dense, short


def expanded(short: CompressedBlocks) -> EnergeticBlocks:
    """Dense blocks from compressed ones."""
    matrices = (
        np.array(kind).real for kind in zip(*short.combine(np.eye(short.steps)), strict=True)
    )
    return EnergeticBlocks(short.mesh, short.c_p, short.c_s, short.dt, *matrices)


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.promise("theory/bem.md", "it bounds every entry of V, K and D")
def test_blocks(shape):
    """Entries differ from exact ones by less than their bounds, which are small; before tails by
    rounding only."""
    dense, short = both(shape)
    again, numbers = expanded(short), sum(part.values.size for part in short.stretches)
    assert numbers < 0.7 * sum(part.size for part in (dense.single, dense.double, dense.hyper))
    before = min(part.smooth for part in short.stretches)
    for name, bound in zip(("single", "double", "hyper"), short.errors, strict=True):
        ours, exact = getattr(again, name), getattr(dense, name)
        scale = np.abs(exact).max()
        difference = np.abs(ours - exact).max()
        assert 1e-17 * scale < difference < bound < 1e-6 * scale, name
        assert np.abs(ours - exact)[:before].max() < 1e-13 * scale, name
        assert difference < 2e-9 * scale, name


@pytest.mark.long
def test_tails_are_short():
    """Fifteen steps or so hold any tail; their number hardly grows with the length of the tail."""
    counts = [
        {len(part.tail) for part in both(shape)[1].stretches if len(part.tail)} for shape in SHAPES
    ]
    assert max(map(max, counts)) <= 16
    assert all(len(part.weights) >= len(part.tail) for part in both("square")[1].stretches)


def problem(blocks, *, symmetric: bool, held: bool) -> BoundaryProblem:
    """A pull on the right half of a body, part of it held or moved; contact at the left."""
    mesh, steps, rng = blocks.mesh, blocks.steps - 3, np.random.default_rng(3)
    forces = traction_forces(
        mesh,
        lambda x, n, t: np.sin(t) * n + [0.1, 0.2],
        dt=blocks.dt,
        steps=steps,
        elements=mesh.midpoints[:, 0] > 0.3,
    )
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[1] = held & (mesh.points[:, 1] < mesh.points[:, 1].min() + 0.01)
    moved = 0.01 * np.cumsum(rng.standard_normal((steps, 2, len(mesh))), axis=0) if held else None
    contact = mesh.midpoints[:, 0] < mesh.points[:, 0].min() + 0.2
    return BoundaryProblem(PoincareSteklov(blocks, RHO, symmetric), forces, fixed, moved, contact)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize(
    ("shape", "held"), [("square", True), ("disk", False), ("hole", True), ("thin slab", False)]
)
def test_circle_of_frequencies(shape, held, symmetric):
    """Compliances and motions are those of the march with the same blocks; supports, given motions,
    both forms."""
    short = both(shape)[1]
    ours, march = (
        problem(blocks, symmetric=symmetric, held=held) for blocks in (short, expanded(short))
    )
    one, other = ours.condensed(), march.condensed()
    lost = (1e-8 if symmetric else 1e-5) if shape == "thin slab" else 1e-9
    assert np.abs(one.W - other.W).max() < lost * np.abs(other.W).max()
    assert np.abs(one.u_free - other.u_free).max() < lost * np.abs(other.u_free).max()
    one, other = ours.solve(), march.solve()
    for name in ("displacement", "traction", "forces"):
        found, exact = getattr(one, name), getattr(other, name)
        assert np.abs(found - exact).max() < 10.0 * lost * np.abs(exact).max(), name
    free = ~np.asarray(ours.fixed)
    if held:
        assert np.array_equal(one.displacement[:, ~free], ours.prescribed[:, ~free])
    assert np.allclose(one.forces[:, free], ours.forces[:, free], rtol=1e-15, atol=0.0)
    if symmetric:
        assert one.work.min() > -1e-9 * one.work.max()


def test_everything_held():
    """All displacements given: the forces are those of the march."""
    short = both("disk")[1]
    mesh, steps = short.mesh, short.steps
    moved = np.cumsum(np.random.default_rng(1).standard_normal((steps, 2, len(mesh))), axis=0)
    forces = [
        BoundaryProblem(
            PoincareSteklov(blocks, RHO), np.zeros_like(moved), np.ones((2, len(mesh)), bool), moved
        )
        .solve()
        .forces
        for blocks in (short, expanded(short))
    ]
    assert np.abs(forces[0] - forces[1]).max() < 1e-8 * np.abs(forces[1]).max()


def test_contact():
    """A pressed square moves as with dense blocks: contact forces differ by what interpolation and
    the circle lose."""
    runs = []
    for blocks in both("square"):
        mesh = blocks.mesh
        push = -traction_forces(
            mesh, lambda x, n, t: n, dt=blocks.dt, steps=blocks.steps, elements=mesh.labels == 2
        )
        pressed = BoundaryProblem(PoincareSteklov(blocks, 1.0), push, contact=mesh.labels == 0)
        runs.append(march_contact(BoundaryContact(pressed.condensed())).forces)
    assert np.abs(runs[0] - runs[1]).max() < 1e-7 * np.abs(runs[0]).max()


@pytest.mark.long
def test_threads():
    """Answers do not depend on the number of threads, to the last digit."""
    one, two = both("disk"), both("disk", threads=2)
    for name in ("single", "double", "hyper"):
        assert np.array_equal(getattr(one[0], name), getattr(two[0], name))
    for ours, theirs in zip(one[1].stretches, two[1].stretches, strict=True):
        assert np.array_equal(ours.values, theirs.values)


@pytest.mark.long
def test_long_tails_of_a_small_body():
    """Many steps behind the last wave: at most of them nothing new is integrated."""
    mesh = polygon(SQUARE, 0.5)
    dense, short = (
        energetic_blocks(mesh, MATERIAL, dt=0.4, steps=100, compressed=compressed)
        for compressed in (False, True)
    )
    again = expanded(short)
    for name, bound in zip(("single", "double", "hyper"), short.errors, strict=True):
        assert np.abs(getattr(again, name) - getattr(dense, name)).max() < bound, name
    assert sum(part.values.size for part in short.stretches) < 0.3 * 28 * 100 * len(mesh) ** 2


@pytest.mark.long
@pytest.mark.parametrize("symmetric", [True, False])
def test_long_runs(symmetric, monkeypatch):
    """Motions of many steps are those of the march; blocks cut off at the last step are wrong and
    are refused. Large steps are for the symmetric form: the other is wrong there, and says so."""
    mesh, steps, dt = polygon(SQUARE, 0.5), 200, 2.0 if symmetric else 0.5
    short = energetic_blocks(mesh, MATERIAL, dt=dt, steps=steps, compressed=True)
    pull = traction_forces(
        mesh,
        lambda x, n, t: np.sin(t) * n + [0.1, 0.2],
        dt=dt,
        steps=steps,
        elements=mesh.labels == 1,
    )
    ours, march = (
        BoundaryProblem(PoincareSteklov(blocks, RHO, symmetric), pull, contact=mesh.labels == 0)
        for blocks in (short, expanded(short))
    )
    one, other = ours.solve().displacement, march.solve().displacement
    assert np.abs(one - other).max() < 1e-8 * np.abs(other).max()
    one, other = ours.condensed().W, march.condensed().W
    assert np.abs(one - other).max() < 1e-7 * np.abs(other).max()
    if not symmetric:
        monkeypatch.setattr("vi_contact.bem.compressed.AHEAD", 1)
        monkeypatch.setattr("vi_contact.bem.energetic.AHEAD", 1)
        cut = energetic_blocks(mesh, MATERIAL, dt=dt, steps=steps, compressed=True)
        with pytest.raises(
            StepFailure, match="of the motion, which grows behind step 200.* compressed=False"
        ):
            BoundaryProblem(PoincareSteklov(cut, RHO, False), pull).solve()


@pytest.mark.long
def test_rounding_moves_a_free_body(monkeypatch):
    """Where rounding of second differences outgrows the momentum of a free body, a sentence; held
    bodies go on."""
    mesh, steps = polygon(SQUARE, 1.0), 300
    short = energetic_blocks(mesh, MATERIAL, dt=4.0, steps=steps, compressed=True)
    free, held = (
        BoundaryProblem(PoincareSteklov(short, 1.0), np.ones((steps, 2, len(mesh))), fixed)
        for fixed in (None, np.eye(2, len(mesh), dtype=bool))
    )
    assert np.isfinite(free.solve().displacement).all()
    monkeypatch.setattr("vi_contact.bem.frequency_circle.DRIFT", 1e-12)
    with pytest.raises(
        InputError, match="300 steps rounding errors move a free body; take fewer steps"
    ):
        free.solve()
    assert np.isfinite(held.solve().displacement).all()


def test_missed_equations(monkeypatch):
    """An answer that misses the equations of the march is refused."""
    free = problem(both("disk")[1], symmetric=True, held=False)
    monkeypatch.setattr(
        "vi_contact.bem.frequency_circle.CompressedBlocks.apply",
        lambda self, p, u, jumps: [0.0 * p[0], p[0], u[0], u[0]],
    )
    with pytest.raises(
        StepFailure, match="misses the equations of step 14 of 27 .* take fewer steps"
    ):
        free.solve()


def test_choice_by_size(monkeypatch):
    """Small problems keep dense blocks; beyond a number of numbers they are compressed; both can be
    asked for."""
    mesh = polygon(SQUARE, 0.5)
    assert isinstance(energetic_blocks(mesh, MATERIAL, dt=0.5, steps=9), EnergeticBlocks)
    monkeypatch.setattr("vi_contact.bem.energetic.DENSE", 28 * 9 * len(mesh) ** 2 - 1)
    assert isinstance(energetic_blocks(mesh, MATERIAL, dt=0.5, steps=9), CompressedBlocks)
    assert isinstance(energetic_blocks(mesh, MATERIAL, dt=0.5, steps=8), EnergeticBlocks)


def test_refusals():
    """Sentences for what cannot be done, before any work."""
    mesh = polygon(SQUARE, 0.5)
    for options, message in (
        ({"compressed": "yes"}, "compressed is 'yes'"),
        ({"threads": 0}, "threads is 0"),
        ({"steps": 10**9, "compressed": True}, "1000000000 steps of 8 elements asks for"),
        ({"steps": 200_000, "compressed": True}, "circle of 200000 steps asks for"),
    ):
        with pytest.raises(InputError, match=message):
            energetic_blocks(mesh, MATERIAL, **({"dt": 0.5, "steps": 9} | options))
    short = both("disk")[1]
    with pytest.raises(InputError, match="assemble it with more steps"):
        BoundaryProblem(PoincareSteklov(short, 1.0), np.zeros((31, 2, 25))).solve()
    with pytest.raises(InputError, match="forces is empty"):
        BoundaryProblem(PoincareSteklov(short, 1.0), np.zeros((0, 2, 25)))
