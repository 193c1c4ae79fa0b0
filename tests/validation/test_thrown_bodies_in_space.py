"""V9.7 and V9.8 in space, over a whole collision: two free bodies, on meshes that do not match,
thrown at each other obliquely and with spin, press, rub and part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from thrown_blocks import OPEN, SLIPS, STICKS, rigid_motions, status, thrown_blocks
from two_bodies import momenta

import vi_contact as vc
from vi_contact.core.algebra import Array, largest, max_abs
from vi_contact.core.ledger import compute_energies, energy_balance

COMM = MPI.COMM_WORLD
BENT = 0.2  # [1/m]: curvature of the curved faces


@pytest.mark.serial  # fem/test_thrown_bodies_on_ranks.py has what may depend on ranks
@pytest.mark.parametrize(
    ("scheme", "bent", "gap", "friction", "simplices"),
    [
        (vc.Midpoint(), 0.0, 0.0, 0.0, False),
        (vc.MoreauJean(), 0.0, 0.0, 0.4, True),
        (vc.Trapezoidal(), BENT, 0.0, 0.0, True),
        (vc.Trapezoidal(), BENT, 0.0, 0.4, False),
        (vc.Midpoint(), BENT, 0.0, 0.4, False),
        (vc.MoreauJean(), BENT, 0.0, 0.4, False),
        (vc.MoreauJean(), BENT, 0.02, 0.0, False),
    ],
    ids=[
        "flat",
        "flat-rough",
        "curved",
        "curved-rough-trapezoidal",
        "curved-rough-midpoint",
        "curved-rough-impulses",
        "curved-apart",
    ],
)
@pytest.mark.promise("README.md", "that closes to rounding")
def test_a_whole_collision(scheme, bent, gap, friction, simplices):
    """Momentum, angular momentum and the ledger to 1e-11 of the largest. Rough curved faces are
    polygons that do not fit, and friction acts on both sides of the gaps between them: its moment
    is all that angular momentum changes by, to 1e-11 in every step; in the end 2e-4."""
    problem = thrown_blocks(COMM, friction=friction, bent=bent, gap=gap, simplices=simplices)
    problem = replace(problem, mass=scheme.mass)
    surface, equations, rigid = problem.surface, problem.equations, rigid_motions(problem)
    arms = surface.tangential_values(rigid.T)
    assert largest(surface.comm, max_abs(surface.normal_values(rigid.T))) < 1e-14

    def motion(v: Array) -> Array:
        return surface.comm.sum(rigid.T @ (equations.M @ v))

    dt, start, before = 2e-3, motion(equations.v0), momenta(problem, equations.v0)
    motions, moments, sets, defects, energy = [start], [], [], [], 0.0
    for state, report in vc.march(problem, scheme=scheme, solver=vc.Condensed(), dt=dt, steps=45):
        assert report.certificate.worst <= 1e-9
        balance = report.balance
        r_t = np.zeros(arms.shape[1:]) if balance.r_t is None else balance.r_t
        moments.append(dt * surface.comm.sum(np.einsum("kmc,mc->k", arms, r_t)))
        motions.append(motion(state.v))
        defects.append(energy_balance(problem, report.old, state, balance).defect)
        energy = max(energy, compute_energies(equations, state.u, state.v).total)
        sets.append(status(report))
    counts, scale, drift = (
        np.array(sets),
        np.abs(start).max(),
        np.abs(np.array(motions) - start).max(axis=0),
    )
    assert (
        np.abs(np.diff(motions, axis=0) + moments).max() < 1e-11 * scale
        and drift[:3].max() < 1e-11 * scale
    )
    assert drift[3:].max() < (2e-4 if bent and friction else 1e-11) * scale
    assert np.abs(np.cumsum(defects)).max() < 1e-11 * energy
    assert (
        np.all(counts[-3:] == OPEN)
        and np.any(counts == SLIPS)
        and np.any(counts == STICKS) == (friction > 0.0)
    )
    assert np.abs(momenta(problem, state.v) - before).max() > 0.3 * np.abs(before).max()
