"""S4.3 to S4.6: finite element runs beside the formulas that an engineer would put there."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import sliding_block as sliding
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems import rocking_block as rocking
from vi_contact import Resultants, fem, ground_motion
from vi_contact.core.algebra import Array
from vi_contact.exact.housner import HousnerBlock
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.engineering.checks import (
    AtRest,
    Housner,
    MononobeOkabe,
    NewmarkBlock,
    Rankine,
    VeletsosYounan,
    Wood,
)

pytestmark = pytest.mark.serial
HEIGHT, C_S, LOAD = 10.0, 150.0, 5e4  # m, m/s, Pa on the ground
WALL = {"height": HEIGHT, "rho": 1900.0, "surcharge": LOAD}
LAYER = WALL | {"nu": 0.3, "c_s": C_S}


def shaken(
    length: float, cells: int, f: float, periods: float, amplitude: float, *, held: bool = False
) -> Mapping[str, Array]:
    """A layer on rock between a smooth wall, on its left, and a side that holds u; rest, then a
    harmonic; 5 % at f."""
    soil = vc.LinearElastic.from_wave_speeds(C_S * math.sqrt(3.5), C_S, 1900.0)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(length, HEIGHT), divisions=(round(length / HEIGHT) * cells, cells)),
        MPI.COMM_SELF,
    )
    system = fem.assemble(
        mesh,
        soil,
        clamped=tags["bottom"],
        prescribed=fem.Prescribed(tags["right"], components=(0,)),
        damping=vc.Rayleigh(alpha=0.0, beta=0.05 / (math.pi * f)),
        loads=fem.Traction(tags["top"], (0.0, -LOAD)),
    )
    system = vc.with_weight(system)
    surface = fem.contact_surface(
        system, tags["left"], obstacle=vc.HalfSpace(point=(0.0, 0.0), normal=(1.0, 0.0))
    )
    surface = surface.bilateral_everywhere() if held else surface
    problem = vc.ContactProblem(system, surface, excitation=vc.Harmonic(amplitude, f))
    return vc.simulate(
        problem,
        dt=1.0 / (40.0 * f),
        t_end=periods / f,
        state=vc.static_equilibrium(problem),
        record=[Resultants("wall", (0.0, 0.0))],
        progress=False,
    ).history


def test_wall_at_rest_and_under_slow_shaking():
    """32 cells over H: 2.58 % of the rest thrust is that of the lowest half cell, which the clamped
    rock has (0.1 %); added thrust within 0.7 % of the exact one (measured 0.2 %), its height 1.5 %
    (0.5 %). The formulas of yielding soil stand beside them: the elastic thrust is 1.4 times
    Rankine's active one, and grows more than Okabe's wedge."""
    history = shaken(2.0 * HEIGHT, 32, 0.5, 1.5, 1.0)
    rest = AtRest(**WALL, nu=0.3).compare(history)
    weight = 1900.0 * 9.80665 * HEIGHT
    lost = 0.5 / 32.0 * HEIGHT * (weight + LOAD) / (0.5 * weight * HEIGHT + LOAD * HEIGHT)
    assert rest.ratio == pytest.approx(1.0 - lost, abs=1e-3)
    added, height = (
        Wood(**LAYER, length=2.0 * HEIGHT, of=one).compare(history) for one in ("thrust", "height")
    )
    assert not added.applies and added.ratio == pytest.approx(1.0, abs=0.007)
    assert height.ratio == pytest.approx(1.0, abs=0.015)
    active = Rankine(**WALL, phi=0.6).compare(history)
    okabe = MononobeOkabe(**WALL, phi=0.6, kh=1.0 / 9.80665).compare(history)
    assert active.ratio == pytest.approx(
        3.0 / 7.0 / math.tan(math.pi / 4 - 0.3) ** 2 * rest.ratio, rel=1e-9
    )
    assert okabe.found - active.found > 1.2 * (okabe.expected - active.expected) > 0.0


def test_pressed_walls_are_held_ones_and_open_walls_are_told():
    """While all is pressed a unilateral wall is a bilateral one; beyond, the check says how much
    leaves the soil."""
    free, held = (shaken(2.0 * HEIGHT, 8, 0.5, 1.5, 1.0, held=one) for one in (False, True))
    assert free["uplift_wall"].max() == 0.0
    assert np.abs(free["N_wall"] - held["N_wall"]).max() <= 1e-9 * held["N_wall"].max()
    opened = shaken(2.0 * HEIGHT, 8, 0.5, 1.5, 9.0)
    told = Wood(**LAYER).compare(opened).applies
    assert (
        told == f"up to {opened['uplift_wall'].max():.0%} of the wall leaves the soil"
        and math.isnan(Wood(**LAYER).compare(opened).expected)
    )


@pytest.mark.parametrize(("f", "ratio"), [(0.5, 0.943), (2.0, 0.926), (5.0, 1.145)])
@pytest.mark.promise(
    "guide/checks.md", "Veletsos and Younan is up to 7 % too high", bound="ratios to 2 %"
)
def test_veletsos_and_younan_beside_finite_elements(f: float, ratio: float):
    """A long layer, 12 cells over H, steady harmonics at 0.13, 0.53 and 1.33 of its lowest
    frequency: what leaving vertical stresses out costs. At 0.5 Hz Wood's is met within 2 % (0.9 %),
    and refused above 1.125 Hz."""
    history = shaken(10.0 * HEIGHT, 12, f, 1.5 if f < 1.0 else 3.0 * f, 0.5)
    assert VeletsosYounan(**LAYER).compare(history).ratio == pytest.approx(ratio, abs=0.02)
    slow = Wood(**LAYER).compare(history)
    assert slow.ratio == pytest.approx(1.0, abs=0.02) if f < 1.0 else "above 0.3 of" in slow.applies


def test_sliding_under_a_record():
    """A stiff block under four seconds of a synthetic motion (0.3 g, mu = 0.1): Newmark's residual
    slip within 3 %."""
    record = ground_motion.synthetic(
        ground_motion.KanaiTajimi(s0=0.02),
        duration=4.0,
        dt=0.01,
        seed=3,
        envelope=ground_motion.Envelope(rise=0.5, end=2.5, decay=2.0),
    )
    body = sliding.SlidingBody(sliding.SlidingBlock(0.1))
    model = sliding.build(body, MPI.COMM_SELF, excitation=vc.GroundMotion(record))
    history = vc.simulate(
        model.problem,
        scheme=vc.MoreauJean(),
        solver=vc.Condensed(),
        dt=4e-3,
        t_end=4.4,
        state=model.rest,
        record=[vc.Probe({"centre": model.centre})],
        progress=False,
    ).history
    found = NewmarkBlock(mu=0.1, gravity=9.81, slip="u_x_centre").compare(history)
    assert not found.applies and found.ratio == pytest.approx(1.0, abs=0.03)


def test_rocking_released_and_shaken():
    """A stiff block on two corners: the first landing after a release within 1 % of Housner's
    (measured 0.3 %), the largest angle under a pulse of 1.5 times the onset for 0.35 s within 3.5 %
    (1.2 %)."""
    shape = HousnerBlock(width=0.4, height=2.0)
    material = vc.LinearElastic(E=3e10, nu=0.0, rho=2400.0)
    block = rocking.RockingBlock(shape, material, damping=vc.Rayleigh(alpha=0.0, beta=3e-4))
    model = rocking.build(block, MPI.COMM_SELF)

    def run(problem: vc.ContactProblem, state: vc.State, t_end: float) -> Mapping[str, Array]:
        return vc.simulate(
            problem,
            scheme=vc.MoreauJean(),
            solver=vc.Condensed(),
            dt=model.time_steps(),
            t_end=t_end,
            state=state,
            record=[rocking.Rocking(model)],
            progress=False,
        ).history

    check = {"width": 0.4, "height": 2.0, "gravity": 9.81, "theta": "theta"}
    released = run(model.problem, model.tilted(0.5 * shape.alpha), 0.6)
    assert Housner(**check, of="impact").compare(released).ratio == pytest.approx(1.0, abs=0.01)
    pulse = vc.Rectangular(1.5 * shape.onset_acceleration, 0.35)
    pushed = Housner(**check).compare(run(model.shaken(pulse), model.rest, 1.2))
    assert not pushed.applies and pushed.expected > 0.4 * shape.alpha
    assert pushed.ratio == pytest.approx(1.0, abs=0.035)
