"""Damping by ratios from cell to cell (V8.8)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fem_problems import linear
from soil import SOIL, strip

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.run.march import march


def damped(xi):
    return fem.Heterogeneous(SOIL.E, SOIL.nu, SOIL.rho, xi)


def assembled(mesh, tags, material, damping=vc.DampingRatio(2.0)):
    return fem.assemble(mesh, material, damping=damping, clamped=tags["bottom"])


def products(system):
    """vᵀ C v of three vectors that no rank numbers otherwise."""
    x, y = system.space.coordinates[:, :2].T
    found = []
    for k in (1.0, 2.0, 3.0):
        v = np.sin(k * x + 0.3 * k**2 * y)
        found.append(system.algebra.dot(v, system.C @ v))
    return np.array(found)


@pytest.mark.parametrize("second", [0.0, 10.0])
def test_one_ratio_everywhere_is_rayleigh(comm, second):
    """Of the stiffness alone, and of both by two frequencies."""
    mesh, tags = strip(comm, 2.0, 4.0, (2, 4))
    rayleigh = (
        vc.Rayleigh(0.0, 0.05 / (math.pi * 2.0))
        if second == 0.0
        else (vc.Rayleigh.from_frequencies(2.0, second, xi1=0.05, xi2=0.05))
    )
    ours = products(assembled(mesh, tags, damped(0.05), vc.DampingRatio(2.0, second)))
    theirs = products(assembled(mesh, tags, SOIL, rayleigh))
    assert np.allclose(ours, theirs, rtol=1e-12)


def test_from_cell_to_cell(comm):
    """A Function of DG0; one material with a ratio and one without; stiffness in the upper cells
    only: C is the same. It is zero in the lower ones, all cells of some ranks."""
    mesh, tags = strip(comm, 2.0, 4.0, (2, 4))
    upper = fem.Cells.where("upper", mesh, lambda x: x[1] > 2.0 - 1e-9)
    ratio = fem.compat.function(fem.compat.cell_space(mesh))
    ratio.x.array[fem.compat.cell_blocks(ratio.function_space)[upper.indices, 0]] = 0.05
    by_cells = products(assembled(mesh, tags, damped(ratio)))
    lower = fem.Cells.where("lower", mesh, lambda x: x[1] < 2.0 + 1e-9)
    by_materials = products(assembled(mesh, tags, [(upper, damped(0.05)), (lower, SOIL)]))
    soft = vc.LinearElastic(1e-9 * SOIL.E, SOIL.nu, SOIL.rho)  # its share of C beside the other's
    rayleigh = vc.Rayleigh(0.0, 0.05 / (math.pi * 2.0))
    by_groups = products(assembled(mesh, tags, [(upper, SOIL), (lower, soft)], rayleigh))
    assert np.allclose(by_cells, by_materials, rtol=1e-12) and np.allclose(
        by_cells, by_groups, rtol=1e-7
    )


@pytest.mark.serial
def test_a_mode_is_damped_by_its_ratio(comm):
    """The first mode of a column, at its frequency: the logarithmic decrement is 2 pi xi / sqrt(1 -
    xi²)."""
    mesh, tags = strip(comm, 1.0, 10.0, (1, 10))
    f, xi = SOIL.c_s / 40.0, 0.05
    system = fem.assemble(
        mesh,
        damped(xi),
        damping=vc.DampingRatio(f),
        clamped=tags["bottom"],
        tied=fem.Tied(tags["left"], tags["right"]),
        initial_velocity=lambda x: np.column_stack(
            [np.sin(math.pi * x[:, 1] / 20.0), 0.0 * x[:, 0]]
        ),
    )
    top = system.space.find_nodes(np.array([[0.0, 10.0]]))
    problem, moved = linear(system), []
    for state, _ in march(problem, dt=1e-3, t_end=0.5):
        moved.append(system.space.sample(problem.cartesian(state.u), top, state.t, 0)[0, 0])
    peaks = [
        one
        for before, one, after in zip(moved, moved[1:], moved[2:], strict=False)
        if before < one > after
    ]
    decrement = math.log(peaks[0] / peaks[1])
    assert decrement == pytest.approx(2.0 * math.pi * xi / math.sqrt(1.0 - xi**2), rel=5e-3)


def test_wrong_ratios_are_refused(comm):
    mesh, tags = strip(comm, 2.0, 4.0, (2, 4))
    for ratio in (5.0, -0.01):
        with pytest.raises(
            InputError, match=f"the damping ratio xi is {ratio}; give ratios from 0 to less"
        ):
            damped(ratio)
    with pytest.raises(InputError, match="xi is 1.5 at .*; give ratios"):
        assembled(mesh, tags, damped(lambda x: np.where(x[1] > 3.0, 1.5, 0.05)))
    for wrong in ({"frequency": 0.0}, {"frequency": 2.0, "second": -1.0}):
        with pytest.raises(InputError, match=r"\[Hz\] is"):
            vc.DampingRatio(**wrong)
    other = fem.compat.function(fem.compat.cell_space(strip(comm, 1.0, 1.0, (1, 1))[0]))
    with pytest.raises(InputError, match="the damping ratio xi is of another mesh"):
        assembled(mesh, tags, damped(other))
