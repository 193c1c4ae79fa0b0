"""The default solver takes the condensed route for small problems and the iterative one for large ones."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from chain import chain_problem
from fem_problems import BOX_DT, max_over_ranks, shaken_wall, thrown_box
from mpi4py import MPI

import vi_contact as vc
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import empty_surface
from vi_contact.run.march import march
from vi_contact.solvers import automatic

COMM = MPI.COMM_WORLD


def box() -> ContactProblem:
    return replace(thrown_box(COMM, angle=0.3, divisions=(3, 3, 2)), mass=None)


def test_small_problems_are_condensed(caplog: pytest.LogCaptureFixture) -> None:
    """In the plane, in space, and without contact; the log says so."""
    with caplog.at_level(logging.INFO):
        for problem in (replace(shaken_wall(COMM), impact=None, mass=None), box()):
            *_, (_, report) = march(problem, dt=BOX_DT, steps=2)
            assert report.result.method == "condensed ActiveSet"
    assert COMM.rank > 0 or "Automatic: Condensed for" in caplog.text
    problem = box()
    assert vc.Automatic().route(problem.system.K, empty_surface(problem.surface.comm, 3)) == vc.Condensed()


@pytest.mark.parametrize(("name", "limit"), [("IN_SPACE", 100), ("CONDITIONS", 10)])
def test_large_ones_are_not(monkeypatch: pytest.MonkeyPatch, name: str, limit: int) -> None:
    """By unknowns or by contact points: the same motion as the condensed route's, to 1e-9, without its factor."""
    problem = box()
    *_, (expected, _) = march(problem, dt=BOX_DT, steps=8)
    monkeypatch.setattr(automatic, name, limit)
    assert vc.Automatic().route(problem.system.K, problem.surface) == vc.Iterative()
    strict = vc.Automatic(iterative=vc.Iterative(tolerance=1e-12))
    *_, (found, report) = march(problem, solver=strict, dt=BOX_DT, steps=8)
    assert report.result.method.startswith("Iterative") and not report.step.A.factorised
    assert max_over_ranks(COMM, found.u - expected.u) < 1e-9 * max_over_ranks(COMM, expected.u)
    r_n = seen(problem.surface).all(expected.r_n)
    assert abs(seen(problem.surface).all(found.r_n) - r_n).max() < 1e-8 * r_n.max() > 0.0
    own = vc.Automatic(iterative=vc.Volume())
    assert own.route(problem.system.K, problem.surface) == vc.Volume()


@pytest.mark.serial
def test_without_finite_elements_it_condenses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "CONDITIONS", 0)
    problem = chain_problem(3)
    assert vc.Automatic().route(problem.system.K, problem.surface) == vc.Condensed()


@pytest.mark.serial
@pytest.mark.parametrize("wrong", [{"condensed": 3}, {"iterative": "gamg"}])
def test_what_is_no_solver_is_refused(wrong: Any) -> None:
    with pytest.raises(InputError, match="give a solver, or leave it out"):
        vc.Automatic(**wrong)
