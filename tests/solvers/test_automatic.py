"""The default solver takes the condensed route for small problems and the iterative one for large
ones."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Any

import numpy as np
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
from vi_contact.kernels.compiler import load_cholmod
from vi_contact.run.march import march
from vi_contact.solvers import automatic

COMM = MPI.COMM_WORLD


def box() -> ContactProblem:
    return replace(thrown_box(COMM, angle=0.3, divisions=(3, 3, 2)), mass=None)


@pytest.mark.promise("guide/schemes.md", "as here, digit by digit")
def test_small_problems_are_condensed(caplog: pytest.LogCaptureFixture) -> None:
    """In the plane, in space, and without contact; the log says so."""
    with caplog.at_level(logging.INFO):
        for problem in (replace(shaken_wall(COMM), impact=None, mass=None), box()):
            *_, (found, report) = march(problem, dt=BOX_DT, steps=2)
            assert report.result.method == "condensed ActiveSet"
            *_, (expected, _) = march(problem, solver=vc.Condensed(), dt=BOX_DT, steps=2)
            assert COMM.size > 1 or np.array_equal(found.u, expected.u)
    assert COMM.rank > 0 or "Automatic: Condensed for" in caplog.text
    problem = box()
    assert (
        vc.Automatic().route(problem.system.K, empty_surface(problem.surface.comm, 3), False)
        == vc.Condensed()
    )


@pytest.mark.parametrize("limits", [{"IN_SPACE": 100, "ALONE_IN_SPACE": 100}, {"DENSE": {3: 10}}])
def test_large_ones_are_not(monkeypatch: pytest.MonkeyPatch, limits: dict[str, Any]) -> None:
    """By unknowns or by contact points: the same motion as the condensed route's, to 1e-9, without
    its factor."""
    problem = box()
    *_, (expected, _) = march(problem, dt=BOX_DT, steps=8)
    for name, limit in limits.items():
        monkeypatch.setattr(automatic, name, limit)
    assert vc.Automatic().route(problem.system.K, problem.surface, False) == vc.Iterative()
    strict = vc.Automatic(iterative=vc.Iterative(tolerance=1e-12))
    *_, (found, report) = march(problem, solver=strict, dt=BOX_DT, steps=8)
    assert report.result.method.startswith("Iterative") and not report.step.A.factorised
    assert max_over_ranks(COMM, found.u - expected.u) < 1e-9 * max_over_ranks(COMM, expected.u)
    r_n = seen(problem.surface).all(expected.r_n)
    assert abs(seen(problem.surface).all(found.r_n) - r_n).max() < 1e-8 * r_n.max() > 0.0
    own = vc.Automatic(iterative=vc.Volume())
    assert own.route(problem.system.K, problem.surface, False) == vc.Volume()


def test_friction_and_ranks_make_it_iterative_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    """With friction the small problem has rows for the tangents too; several ranks factorise what
    is large in space by MUMPS, as does one without CHOLMOD."""
    problem, rule = box(), vc.Automatic()
    K, surface = problem.system.K, problem.surface
    monkeypatch.setattr(automatic, "DENSE", {3: surface.total})
    assert [rule.route(K, surface, rubs) for rubs in (False, True)] == [
        vc.Condensed(),
        vc.Iterative(),
    ]
    monkeypatch.setattr(automatic, "IN_SPACE", 100)
    alone = COMM.size == 1 and load_cholmod(surface.comm) is not None
    assert rule.route(K, surface, False) == (vc.Condensed() if alone else vc.Iterative())
    monkeypatch.setattr(automatic, "load_cholmod", lambda comm: None)
    assert rule.route(K, surface, False) == vc.Iterative()
    *_, (_, report) = march(replace(problem, friction=vc.Coulomb(0.3)), dt=BOX_DT, steps=2)
    assert report.result.method.startswith("Iterative")


@pytest.mark.serial
def test_without_finite_elements_it_condenses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(automatic, "DENSE", {1: 0})
    problem = chain_problem(3)
    assert vc.Automatic().route(problem.system.K, problem.surface, False) == vc.Condensed()


@pytest.mark.serial
@pytest.mark.parametrize("wrong", [{"condensed": 3}, {"iterative": "gamg"}])
def test_what_is_no_solver_is_refused(wrong: Any) -> None:
    with pytest.raises(InputError, match="give a solver, or leave it out"):
        vc.Automatic(**wrong)
