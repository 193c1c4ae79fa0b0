"""Nothing twice: the products with M, C and K that a step makes, counted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from marched_chain import chain

from vi_contact.core.algebra import SerialMatrix
from vi_contact.run.recorders import Energy
from vi_contact.run.simulate import simulate
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.schemes.newmark import Newmark
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
FEW, MANY = 20, 120


def per_step(
    monkeypatch: pytest.MonkeyPatch, scheme: Any, *, damping: float, ledger: bool, **more: Any
) -> float:
    """Products a step of a chain that hits its walls, with the ledger or without."""
    made = [0]

    def counted(matrix: SerialMatrix, x: np.ndarray) -> np.ndarray:
        made[0] += 1
        return np.asarray(matrix.csr @ x)

    monkeypatch.setattr(SerialMatrix, "__matmul__", counted)
    counts = []
    for steps in (FEW, MANY):
        made[0] = 0
        problem = chain(damping=damping, **more)
        found = simulate(
            problem,
            scheme=scheme,
            solver=Condensed(),
            dt=5e-3,
            steps=steps,
            record=[Energy()] if ledger else [],
            progress=False,
        )
        counts.append(made[0])
    assert found.facts["worst_certificate"] < 1e-11
    return (counts[1] - counts[0]) / (MANY - FEW)


@pytest.mark.parametrize("ledger", [False, True], ids=["march", "ledger"])
@pytest.mark.parametrize(
    "scheme",
    [
        ZienkiewiczWoodTaylor(),
        ZienkiewiczWoodTaylor(0.7),
        Trapezoidal(),
        MoreauJean(),
        ContactStabilisedNewmark(projected=False),
    ],
    ids=repr,
)
def test_a_step_makes_two_products(monkeypatch, scheme, ledger):
    """K u at the guess, and A d of its increment, serve the solver, the certificate and the ledger,
    which asks for M v and K u at the end; with damping C v at the guess, and that of the ledger's
    mean."""
    energies = 2.0 if ledger else 0.0
    assert per_step(monkeypatch, scheme, damping=0.0, ledger=ledger, impact=None) <= 2.0 + energies
    damped = per_step(monkeypatch, scheme, damping=1e-4, ledger=ledger, impact=None)
    assert damped <= 3.0 + energies + (1.0 if ledger else 0.0)


def test_an_impact_costs_one_more(monkeypatch):
    """M v of the velocity that the impact law made, in the steps that it changes only."""
    made = per_step(monkeypatch, ZienkiewiczWoodTaylor(), damping=0.0, ledger=True)
    assert 4.0 < made < 5.0


def test_a_ledger_of_both_ends_asks_for_both(monkeypatch):
    """Newmark's mean equation has the forces of the beginning too: M a and K u there."""
    assert per_step(monkeypatch, Newmark(), damping=0.0, ledger=True, impact=None) <= 6.0


def test_the_load_of_a_time_is_made_once():
    problem = chain()
    system = problem.equations
    assert system.load_at(0.3) is system.load_at(0.3) and np.array_equal(
        system.load_at(0.3), system.load(0.3)
    )
    assert system.load_at(0.4) is not system.load_at(0.3)
