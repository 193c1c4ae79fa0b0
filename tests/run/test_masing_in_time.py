"""A column of Iwan's soil that is shaken in time: its loops are Masing's, and so is its damping."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import engineering, fem
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import Iwan
from vi_contact.meshes.block import BlockMesh

pytestmark = pytest.mark.serial
R, HEIGHT, PERIOD = 1e-3, 4.0, 4.0
STRAINS = R * np.geomspace(1e-2, 30.0, 30)
SOIL = Iwan(2.6e7, 0.3, 2000.0, list(zip(STRAINS, 1.0 / (1.0 + STRAINS / R), strict=True)))
GAMMA = np.concatenate([[0.0], STRAINS])
TAU = np.concatenate([[0.0], SOIL.shear_modulus * STRAINS / (1.0 + STRAINS / R)])


def find_damping(amplitude: float) -> float:
    """(2/pi) (2 ∫ tau dgamma/(tau_a a) - 1) of the polygon up to an amplitude."""
    inside = amplitude > GAMMA
    x = np.append(GAMMA[inside], amplitude)
    y = np.append(TAU[inside], np.interp(amplitude, GAMMA, TAU))
    area = np.sum(0.5 * np.diff(x) * (y[1:] + y[:-1]))
    return float(2.0 / np.pi * (2.0 * area / (y[-1] * amplitude) - 1.0))


def shake(comm: Any, steps: int) -> Any:
    """Four periods of a shear force on the top of a column whose sides move alike."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, HEIGHT), divisions=(1, 1)), comm)
    system = fem.assemble(
        mesh,
        SOIL,
        integration="bbar",
        clamped=tags["bottom"],
        tied=fem.Tied(tags["left"], tags["right"]),
        prescribed=fem.Prescribed(tags["top"], components=(1,)),
        loads=fem.Traction(
            tags["top"],
            (6e3, 0.0),
            history=lambda t: np.sin(2.0 * np.pi * t / PERIOD) * min(1.0, t / PERIOD),
        ),
    )
    problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    return vc.simulate(
        problem,
        dt=PERIOD / steps,
        steps=4 * steps,
        record=[vc.Energy(), vc.StressStrain({"middle": (0.5, 0.5 * HEIGHT)})],
        progress=False,
    )


def test_loops_of_a_column_in_time_are_masings(comm: Any) -> None:
    """First loading is on the polygon; a branch from a turn is the polygon of twice its size; the
    damping of a closed loop is the formula; the ledger has its area."""
    found = shake(comm, 50)
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-10
    history = found.history
    gamma, tau = history["strain_xy_middle"], history["stress_xy_middle"]
    loops = engineering.loop_damping(history, "strain_xy_middle", "stress_xy_middle")
    assert loops.amplitude.min() > 1.2 * R

    # The turns of the largest loop, and the branch between them.
    high = int(np.argmax(gamma))
    low = high + int(np.argmin(gamma[high : high + 50]))
    assert tau[:5] == pytest.approx(np.interp(gamma[:5], GAMMA, TAU), rel=1e-9, abs=1e-6)
    assert tau[high] == pytest.approx(np.interp(gamma[high], GAMMA, TAU), rel=1e-9)
    branch = slice(high, low + 1)
    way = 0.5 * (gamma[high] - gamma[branch])
    twice = tau[high] - 2.0 * np.interp(way, GAMMA, TAU)
    size = tau[high]
    beyond = -gamma[branch] > gamma[high]  # the polygon of first loading takes over there
    assert np.count_nonzero(~beyond) >= 15
    assert np.abs(tau[branch] - twice)[~beyond].max() <= 1e-9 * size

    masing = [find_damping(a) for a in loops.amplitude[1:]]
    assert min(masing) > 0.19
    assert loops.damping[1:] == pytest.approx(masing, rel=0.02)

    # The ledger has the area of the loop times the volume: the column is short beside a wave.
    period = slice(100, 151)
    x, y = gamma[period], tau[period]
    area = np.sum(0.5 * np.diff(x) * (y[1:] + y[:-1])) * HEIGHT
    lost = 0.0
    for name in ("loss_plastic", "loss_algorithmic", "energy_strain"):
        first, last = history[name][[100, 150]]
        lost += last - first
    assert lost == pytest.approx(area, rel=0.02)
