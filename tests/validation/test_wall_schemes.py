"""The wall of seed 000 with every scheme: certified steps, a closed ledger, agreement where dt is
fine (V4.1)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.wall import Wall, WallModel, build
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.simulate import Solution, simulate
from vi_contact.schemes.trapezoidal import Trapezoidal

COMM = MPI.COMM_WORLD
MASSLESS: dict[str, Any] = {  # on their own mass, without impact law
    "trapezoidal": Trapezoidal(),
    "newmark": vc.Newmark(),
    "hht": vc.HHT(-0.1),
    "houbolt": vc.Houbolt(),
    "generalised-alpha": vc.GeneralisedAlpha.spectral_radius(0.8),
    "moreau-jean": vc.MoreauJean(),
    "contact-stabilised": vc.ContactStabilisedNewmark(),
    "kane": vc.ContactStabilisedNewmark(projected=False),
    "midpoint": vc.Midpoint(),
}
IMPULSIVE: dict[str, Any] = {  # on consistent mass with the source's inelastic rule
    "zwt": vc.ZienkiewiczWoodTaylor(phi=0.5),
    "ss22": vc.SS22(),
    "newmark-consistent": vc.Newmark(),
}
SCHEMES = MASSLESS | IMPULSIVE


def wall() -> WallModel:
    return build(Wall(), COMM, base_inertia="catalogue")


def run(
    model: WallModel, case: str, name: str, *, refined: int = 1, steps: int = 400, record: Any = ()
) -> Solution:
    """All recorders unless told which."""
    scheme = SCHEMES[name]
    law: dict[str, Any] = (
        {"impact": None, "mass": scheme.mass}
        if name in MASSLESS
        else {"impact": Inelastic(), "mass": ConsistentMass()}
    )
    return simulate(
        model.problem(case, **law),
        scheme=scheme,
        dt=model.time_step() / refined,
        steps=steps * refined,
        record=record or (Energy(), Contact(), Probe(model.probes())),
        progress=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "case"),
    [  # on two ranks one: test_on_finite_elements.py has others there
        pytest.param(name, case, marks=() if name == "zwt" else pytest.mark.serial)
        for name, case in zip(SCHEMES, "ab" * 6, strict=True)
    ],
)
def test_every_scheme_is_certified_and_closes_its_ledger(name: str, case: str) -> None:
    """V9.7 over the seed's 400 steps, in either case by turns; position-level schemes never
    penetrate."""
    solution = run(wall(), case, name)
    assert solution.facts["worst_certificate"] <= 1e-9
    assert solution.facts["energy_defect"] <= 1e-10
    assert solution.facts["steps_in_contact"] > 40
    deepest, size = -solution.facts["smallest_gap"], float(np.abs(solution.history["u_x_12"]).max())
    assert deepest <= (0.5 * size if name == "moreau-jean" else 1e-12 * size)


@pytest.mark.serial
def test_creation_of_energy_is_told() -> None:
    """A wave crosses seven elements in a step of the seed's: the default scheme gains there and
    says so; with a quarter of the step it does not."""
    coarse, fine = (run(wall(), "b", "trapezoidal", refined=refined) for refined in (1, 4))
    assert coarse.facts["energy_created"] > 0.5
    assert "WARNING: contact and time scheme created" in coarse.summary()
    assert fine.facts["energy_created"] < 0.01 and "WARNING" not in fine.summary()


@pytest.mark.serial
def test_schemes_agree_when_dt_is_fine() -> None:
    """Case b, 1¼ periods with an eighth of the seed's dt.

    The extreme displacement of the top within 3 % (0.5 found).
    """
    model = wall()
    found = {
        name: run(model, "b", name, refined=8, steps=50, record=[Probe(model.probes())])
        .history["u_x_12"]
        .min()
        for name in ("zwt", "trapezoidal", "hht", "contact-stabilised", "generalised-alpha")
    }
    assert max(found.values()) == pytest.approx(min(found.values()), rel=0.03), found


def test_the_default_needs_no_names() -> None:
    """A problem without impact law and mass gets the default scheme, on redistributed mass."""
    model = wall()
    problem: Any = model.problem("b", impact=None)
    chosen = simulate(problem, dt=model.time_step(), steps=30, progress=False)
    named = simulate(problem, scheme=Trapezoidal(), dt=model.time_step(), steps=30, progress=False)
    assert np.array_equal(chosen.state.u, named.state.u)
    assert chosen.facts["scheme"].startswith("Trapezoidal") and chosen.facts["mass"].startswith(
        "Redistributed"
    )
    seed = simulate(model.problem("b"), dt=model.time_step(), steps=3, progress=False)
    assert (
        seed.facts["scheme"].startswith("Zienkiewicz") and seed.facts["mass"] == "ConsistentMass()"
    )
