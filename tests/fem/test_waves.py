"""Waves on meshes: speed of bulk waves (V8.4) and of Rayleigh waves (V8.3). Tied sides make one
period of them."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import linear, nodal
from rayleigh_waves import rayleigh_motion, rayleigh_speed
from soil import strip

import vi_contact as vc
from vi_contact import fem

UNIT = vc.LinearElastic(E=1.0, nu=0.0, rho=1.0)


@pytest.mark.parametrize(
    "cells, consistent, lumped", [(10, 1.01652, 0.98363), (20, 1.004117, 0.995893)]
)
def test_speed_of_waves_on_linear_elements(comm, cells, consistent, lumped):
    """V8.4: c_h/c of a harmonic wave, which is an eigenvector of a periodic mesh: the root of uᵀKu
    / uᵀMu."""
    mesh, tags = strip(comm, 1.0, 1.0 / cells, (cells, 1))
    system = fem.assemble(mesh, UNIT, tied=fem.Tied(tags["left"], tags["right"]))
    wave = nodal(system, lambda x: np.column_stack([np.cos(2 * np.pi * x[:, 0]), 0.0 * x[:, 0]]))
    mass = sum(r * (system.M @ r) for r in system.influence.T)
    dot, elastic = system.algebra.dot, system.K @ wave
    for heavy, ratio in ((system.M @ wave, consistent), (mass * wave, lumped)):
        speed = np.sqrt(dot(wave, elastic) / dot(wave, heavy)) / (2 * np.pi)
        assert speed / UNIT.c_p == pytest.approx(ratio, abs=6e-6)


def test_speed_of_rayleigh_waves(comm):
    """V8.3: one wavelength of 20 cells, three deep, dashpots below: phase speed at the surface
    within 1 %."""
    soil = vc.LinearElastic(E=2.5, nu=0.25, rho=1.0)
    mesh, tags = strip(comm, 1.0, 3.0, (20, 60))
    k, speed = 2.0 * np.pi, rayleigh_speed(soil)

    def motion(points, derivative):
        U, V = rayleigh_motion(soil, 3.0 - points[:, 1], 1.0)
        if derivative == 0:
            return np.column_stack([U * np.cos(k * points[:, 0]), V * np.sin(k * points[:, 0])])
        return (
            speed
            * k
            * np.column_stack([U * np.sin(k * points[:, 0]), -V * np.cos(k * points[:, 0])])
        )

    system = fem.assemble(
        mesh,
        soil,
        tied=fem.Tied(tags["left"], tags["right"]),
        dashpots=fem.Dashpots(tags["bottom"]),
        initial_displacement=lambda x: motion(x, 0),
        initial_velocity=lambda x: motion(x, 1),
    )
    x = np.arange(20) / 20.0
    nodes = system.space.find_nodes(np.column_stack([x, np.full(20, 3.0)]))
    t, phase = [], []
    for state, _ in vc.march(linear(system), dt=0.02 / speed, steps=150):  # three periods
        u_y = system.space.sample(state.u, nodes, state.t)[:, 1]
        t.append(state.t)
        phase.append(np.angle(np.sum(u_y * np.exp(1j * k * x))))
    slope = np.polyfit(t, np.unwrap(phase), 1)[0]
    assert slope / k == pytest.approx(speed, rel=0.01)
    assert soil.c_s * 0.9 < slope / k < soil.c_s * 0.94
