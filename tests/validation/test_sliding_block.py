"""V3.2: a stiff finite element block with Coulomb friction on a shaken ground slides as Newmark's
rigid block does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
import sliding_block as sliding
from energy_checks import rounded
from mpi4py import MPI

import vi_contact as vc
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.protocols import Excitation

pytestmark = pytest.mark.serial  # ranks change none of these numbers: cheaper tests show it

G = 9.81


def shaken(
    mu: float, excitation: Excitation, t_end: float, dt: float
) -> tuple[Mapping[str, Array], Array]:
    """(history, displacement of the centre relative to the ground since the gravity stage)."""
    model = sliding.build(
        sliding.SlidingBody(sliding.SlidingBlock(mu)), MPI.COMM_WORLD, excitation=excitation
    )
    solution = vc.simulate(
        model.problem,
        scheme=vc.MoreauJean(),
        solver=vc.Condensed(),
        dt=dt,
        t_end=t_end,
        state=model.rest,
        record=(vc.Energy(), vc.Contact(), vc.Probe({"centre": model.centre})),
        progress=False,
    )
    assert 0.0 < solution.facts["worst_certificate"] <= 1e-9
    u, defect = solution.history["u_x_centre"], np.abs(solution.history["energy_defect"]).max()
    # round-off: on five kinds of processor, with steps of 0.5 to 2 ms, at most 0.11 of this;
    # 1.35e-10 of the energy
    assert (
        0.0
        < defect
        <= 1e-12 * solution.facts["energy"]["energy_max"] + rounded(model.problem, np.abs(u).max())
    )
    return solution.history, u - u[0]


def test_rectangular_pulse():
    """V3.2: A = 0.5 g for 0.2 s, mu = 0.2: slips 0.147150 m to 1 % (the mean load of a step takes
    half a step off the pulse: 0.25 %), stops at 0.5 s; friction takes mu m g times the slip; the
    base stays down."""
    history, u = shaken(0.2, vc.Rectangular(0.5 * G, 0.2), 0.6, 5e-4)
    assert u[-1] == pytest.approx(-0.147150, rel=0.01)
    t = history["t"]
    assert np.ptp(u[t > 0.502]) < 1e-6 and u[np.searchsorted(t, 0.48)] > u[-1] + 1e-4
    assert history["loss_friction"][-1] == pytest.approx(
        0.2 * 2400.0 * 0.5 * G * 0.147150, rel=0.01
    )
    assert history["contact_resultant"][-1] == pytest.approx(2400.0 * 0.5 * G, rel=1e-3)


def test_harmonic_base():
    """V3.2: a_g = 3 sin(2 pi t), mu g = 1.5: displacements at t = 0.5, 1, 1.5, 2 s to 1 %."""
    history, u = shaken(1.5 / G, vc.Harmonic(3.0, 1.0), 2.0, 2e-3)
    found = u[np.searchsorted(history["t"], np.array([0.5, 1.0, 1.5, 2.0]) - 1e-6)]
    assert found == pytest.approx([-0.080077, -0.017956, -0.080767, -0.018030], rel=0.01)


def test_weak_shaking_moves_nothing():
    """V3.2: below mu g the block sticks: it moves with the ground but for its own elastic shear, in
    which its edges slip. Friction takes less than a millionth of what the pulse above loses."""
    history, u = shaken(0.2, vc.Harmonic(0.19 * G, 1.0), 0.5, 2e-3)
    assert np.max(np.abs(u)) < 1e-5
    assert np.max(np.abs(history["loss_friction"])) < 1e-6 * 0.2 * 2400.0 * 0.5 * G * 0.147150


def test_slender_blocks_are_refused():
    with pytest.raises(InputError, match="rocks before it slides"):
        sliding.SlidingBody(sliding.SlidingBlock(0.6), lengths=(0.5, 1.0))
