"""Absorbing boundaries: dashpots at right angles and oblique (V8.1), compliant base (V8.2), and what is refused."""

from __future__ import annotations

import logging
import math

import numpy as np
import pytest
from fem_problems import linear
from soil import SOIL, burst, energies, history, strip
from wave_packet import energy_sent_back

import vi_contact as vc
from vi_contact import exact, fem, soil
from vi_contact.core.errors import InputError

HEIGHT, CELLS = 20.0, 80  # of 0.25 m
WAVES = {"S": (SOIL.c_s, (1.0, 0.0)), "P": (SOIL.c_p, (0.0, 1.0))}


def hit_column(comm, wave, factor=1.0, **data):
    """A column with dashpots below; its top is hit by a hump of one wavelength, 20 cells long."""
    speed, direction = WAVES[wave]
    mesh, tags = strip(comm, 0.25, HEIGHT, (1, CELLS))
    hump = burst(20 * HEIGHT / CELLS / speed)
    system = fem.assemble(
        mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"]),
        dashpots=fem.Dashpots(tags["bottom"], normal=factor, tangential=factor),
        loads=fem.Traction(tags["top"], tuple(1e4 * np.array(direction)), history=hump), **data,
    )
    return linear(system), HEIGHT / CELLS / speed


@pytest.mark.parametrize("wave", WAVES)
def test_waves_at_right_angles_leave(comm, wave):
    """V8.1: what is left of the energy after the passage is below 1e-4 at 20 points per wavelength."""
    problem, dt = hit_column(comm, wave)
    energy = energies(problem, dt=0.5 * dt, steps=2 * (CELLS + 60))
    assert energy[-1] < 1e-4 * energy.max()


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_mistuned_dashpots_reflect(comm, factor):
    """V8.1: R = (1 - a)/(1 + a), 1/3 and -1/3: size and sign of the velocity that comes back, energy R²."""
    problem, dt = hit_column(comm, "S", factor)
    steps = CELLS + 50
    v = history(problem, [(0.0, 0.5 * HEIGHT)], derivative=1, dt=dt, steps=steps)[:, 0, 0]
    first, later = v[: CELLS // 2 + 35], v[CELLS + 20:]
    back = later[np.argmax(np.abs(later))] / first[np.argmax(np.abs(first))]
    assert math.isclose(back, (1.0 - factor) / (1.0 + factor), rel_tol=0.02)
    energy = energies(problem, dt=dt, steps=steps)
    assert math.isclose(energy[-1] / energy[CELLS // 2], 1.0 / 9.0, rel_tol=0.01)


@pytest.mark.serial
def test_other_material_and_thickness(comm):
    """A half-space four times as heavy below is like dashpots with a = 4; the section's thickness changes nothing."""
    mesh, tags = strip(comm, 0.25, HEIGHT, (1, CELLS))
    heavy = vc.LinearElastic(E=4.0 * SOIL.E, nu=SOIL.nu, rho=4.0 * SOIL.rho)
    found = []
    for section in (vc.PlaneStrain(), vc.PlaneStrain(0.3)):
        for dashpots in (fem.Dashpots(tags["bottom"], heavy), fem.Dashpots(tags["bottom"], normal=4.0, tangential=4.0)):
            system = fem.assemble(mesh, SOIL, section=section, dashpots=dashpots)
            resistance = [r @ (system.C @ r) for r in system.influence.T]
            found.append(system.space.comm.sum(np.array(resistance)) / section.thickness)
    for total in found:  # rho c times the width
        np.testing.assert_allclose(total, 0.25 * 4.0 * SOIL.rho * np.array([SOIL.c_s, SOIL.c_p]), rtol=1e-12)


@pytest.mark.parametrize("scheme", [vc.Trapezoidal(), vc.ZienkiewiczWoodTaylor()])
def test_the_loss_is_in_the_ledger(comm, scheme):
    """V9.7 with dashpots: what left is damping loss, the defect is round-off."""
    problem, dt = hit_column(comm, "P", 2.0)
    run = vc.simulate(problem, scheme=scheme, dt=dt, steps=CELLS + 50, record=[vc.Energy()], progress=False)
    loss, given = run.history["loss_damping"][-1], run.history["work_input"][-1]
    assert 0.85 * given < loss < given
    assert abs(run.history["energy_defect"][-1]) < 1e-10 * given


CASES = [("P", 60, 2.2), ("S", 60, 1.5)]


@pytest.mark.slow
@pytest.mark.serial  # ranks change nothing of it: the columns above show that
@pytest.mark.parametrize("wave, angle, length", CASES)
def test_oblique_waves(comm, wave, angle, length):
    """V8.1: a packet on a periodic strip, 10 cells per wavelength: within 20 % of the table, and of its own mean."""
    material = vc.LinearElastic(E=1.0, nu=0.25, rho=1.0)
    slope = math.radians(angle)
    share, theory = energy_sent_back(comm, material, wave, slope, length=length, cells=10)
    assert share == pytest.approx(exact.dashpot_energy(material, slope, wave=wave), rel=0.2)
    assert share == pytest.approx(theory, rel=0.15)


def soil_on_compliant_base(comm, motion, **data):
    """30 m of soil on the same soil, tied sides."""
    mesh, tags = strip(comm, 0.5, 30.0, (1, 60))
    base = fem.CompliantBase(tags["bottom"], motion=motion)
    return fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"]), dashpots=base, **data)


@pytest.mark.parametrize("wave", WAVES)
def test_compliant_base(comm, wave):
    """V8.2: the surface moves with 2 v_up(t - H/c), the base with v_up(t) + v_up(t - 2H/c); then silence. 1 %."""
    speed, direction = WAVES[wave]
    shake = vc.Ricker(1.0, speed / 15.0, direction=direction)  # 30 cells in the wavelength of the peak
    up = soil.upgoing(shake, dt=1e-4)
    problem, crossing = linear(soil_on_compliant_base(comm, up)), 30.0 / speed
    dt = 0.7 * 0.5 / speed  # where the lead of consistent mass and the lag of the trapezoidal rule are equal
    steps = math.ceil((shake.duration + 2.2 * crossing) / dt)
    top, foot = history(problem, [(0.0, 30.0), (0.0, 0.0)], derivative=1, dt=dt, steps=steps).transpose(1, 0, 2)
    t = dt * np.arange(1, steps + 1)
    wanted = np.array([2.0 * up(s - crossing) for s in t])
    peak = np.abs(wanted).max()
    assert np.abs(top - wanted).max() < 0.01 * peak
    assert np.abs(foot - np.array([up(s) + up(s - 2.0 * crossing) for s in t])).max() < 0.01 * peak
    assert np.abs(top[t > shake.duration + 1.2 * crossing]).max() < 2e-3 * peak  # the echo, 1e-6 of the energy


def test_the_base_says_what_it_expects(comm, caplog):
    """In the log, and in the summary of a run; a second shaking is refused."""
    with caplog.at_level(logging.INFO, logger="vi_contact.fem.dashpots"):
        system = soil_on_compliant_base(comm, soil.upgoing(vc.Ricker(1.0, 10.0), dt=1e-3))
    assert comm.rank or "expects the upgoing motion, half the velocity of an outcrop" in caplog.text
    run = vc.simulate(linear(system), dt=1e-3, steps=2, progress=False)
    assert "CompliantBase on 'bottom' expects the upgoing motion" in run.facts["boundaries"][0]
    with pytest.raises(InputError, match="leave the excitation of the problem out"):
        linear(system, excitation=vc.Ricker(1.0, 10.0))
    with pytest.raises(InputError, match="return 2 finite velocities"):
        soil_on_compliant_base(comm, lambda t: np.array([np.nan, 0.0])).load(0.0)


def test_held_and_dashed_is_refused(comm):
    """One component of one boundary is held or damped, never both; corners of rollers may touch dashpots."""
    mesh, tags = strip(comm, 2.0, 2.0, (2, 2))
    rollers = [fem.Prescribed(tags[side], components=(1,)) for side in ("left", "right")]
    system = fem.assemble(mesh, SOIL, prescribed=rollers, dashpots=fem.Dashpots(tags["bottom"]))
    assert system.C is not None
    floor = fem.Prescribed(tags["bottom"], components=(1,))
    with pytest.raises(InputError, match="never hold and damp one component"):
        fem.assemble(mesh, SOIL, prescribed=floor, dashpots=fem.Dashpots(tags["bottom"]))
    fem.assemble(mesh, SOIL, prescribed=floor, dashpots=fem.Dashpots(tags["bottom"], normal=0.0))
    with pytest.raises(InputError, match="never hold and damp one component"):
        fem.assemble(mesh, SOIL, clamped=tags["bottom"], dashpots=fem.Dashpots(tags["bottom"], normal=0.0))
    with pytest.raises(InputError, match="resist nothing"):
        fem.assemble(mesh, SOIL, dashpots=fem.Dashpots(tags["bottom"], normal=0.0, tangential=0.0))
    with pytest.raises(InputError, match="Dashpots: normal is -1"):
        fem.Dashpots(tags["bottom"], normal=-1.0)
