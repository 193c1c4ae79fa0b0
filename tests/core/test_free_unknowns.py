"""Conjugate gradients to round-off on the unknowns that are not held; what large problems do beside
their steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import BOX_DT, max_over_ranks, shaken_wall, thrown_box
from mpi4py import MPI

import vi_contact as vc
from vi_contact.core import sizes
from vi_contact.core.algebra import EffectiveMatrix, total
from vi_contact.core.errors import StepFailure
from vi_contact.core.free_unknowns import solve_free
from vi_contact.core.state_checks import initial_state
from vi_contact.kernels.condensation import condense
from vi_contact.laws import impact
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import Redistributed
from vi_contact.schemes.consistent_data import consistent_acceleration

COMM = MPI.COMM_WORLD


@pytest.fixture
def large(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """From its call on every problem is large, and nothing may be factorised."""

    def begin() -> None:
        def refuse(*_: Any, **__: Any) -> None:
            raise AssertionError("factorised")

        monkeypatch.setattr(sizes, "OWN_UNKNOWNS", 0)
        monkeypatch.setattr("vi_contact.fem.matrices.petsc_algebra.PetscFactor.__init__", refuse)
        monkeypatch.setattr("vi_contact.fem.matrices.copied_factor.ContactLast", refuse)

    yield begin


@pytest.mark.parametrize("held", [False, True])
def test_mass_matrix_to_round_off(held: bool) -> None:
    """As the factor, to 1e-13; held unknowns keep what they have."""
    problem = thrown_box(COMM, simplices=True, angle=0.4)
    system, surface = problem.equations, problem.surface
    x = np.cos(1.0 + 3.0 * system.space.coordinates.sum(axis=1) + np.arange(system.rows) % 3)
    fixed = np.zeros(system.rows, dtype=bool)
    fixed[surface.owned] = held
    found = solve_free(system.algebra, system.M, system.M @ x, fixed, np.where(fixed, x, 0.0))
    assert max_over_ranks(COMM, found - x) <= 1e-13 * max_over_ranks(COMM, x)
    assert np.array_equal(found[fixed], x[fixed])
    with pytest.raises(StepFailure, match="for NaN"):
        solve_free(system.algebra, system.M, np.full_like(x, np.nan), fixed, x)


STARTS: dict[str, dict[str, Any]] = {
    "massless": {"mass": Redistributed()},
    "resting": {"mass": vc.ConsistentMass()},
    "rubbing": {"mass": vc.ConsistentMass(), "friction": vc.Coulomb(0.02)},
}


@pytest.mark.parametrize("name", STARTS)
def test_first_acceleration_of_a_large_body(name: str, large: Any) -> None:
    """With and without mass at contact points that rest and push: as with the factor of M, to
    1e-11."""
    box = thrown_box(COMM, simplices=True, divisions=(4, 4, 4))
    flat = replace(box.surface, gap0=np.zeros(box.surface.count))
    problem = replace(box, surface=flat, **STARTS[name])
    state = initial_state(problem)
    state = replace(state, v=0.1 * problem.equations.influence[:, 0])  # along the ground
    exact = consistent_acceleration(problem, state, BOX_DT)
    large()
    found = consistent_acceleration(replace(problem), state, BOX_DT)
    for one, other in zip(found, exact, strict=True):
        assert max_over_ranks(COMM, other) > 0.0
        assert max_over_ranks(COMM, one - other) <= 1e-11 * max_over_ranks(COMM, other)


@pytest.mark.parametrize("name", ["predictor", "impulses"])
def test_projections_of_a_large_body(name: str, large: Any) -> None:
    """Steps with contact, each with a projection in M: as with the factor of M, to 1e-9 of the
    largest values."""
    scheme: Any = vc.ContactStabilisedNewmark() if name == "predictor" else vc.Midpoint()
    impact = None if name == "predictor" else Inelastic(ImpulseUpdate())
    problem = replace(thrown_box(COMM, simplices=True), impact=impact)
    solver = vc.Iterative(tolerance=1e-12)
    small, other = [], []
    for states, begin in ((small, None), (other, large)):
        if begin:
            begin()
        states += [
            s
            for s, _ in vc.march(replace(problem), scheme=scheme, solver=solver, dt=BOX_DT, steps=6)
        ]
    assert problem.surface.some(small[-1].active)
    for one, two in zip(small, other, strict=True):
        assert np.array_equal(one.active, two.active)
        assert max_over_ranks(COMM, one.v - two.v) <= 1e-9 * max_over_ranks(COMM, one.v)
        assert max_over_ranks(COMM, one.r_n - two.r_n) <= 1e-9 * (
            max_over_ranks(COMM, one.r_n) or 1.0
        )


@pytest.mark.parametrize(
    ("build", "factors"), [(shaken_wall, 1), (thrown_box, 0)], ids=["plane", "space"]
)
def test_impacts_in_the_plane_are_condensed_longer(
    build: Any, factors: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They come in every step: M is factorised up to six times the unknowns. Conjugate gradients
    agree to 1e-12."""
    after, made = [], []
    monkeypatch.setattr(impact, "condense", lambda *given: made.append(given) or condense(*given))
    for worth in (6, 1e9):
        problem = build(COMM)
        system, surface = problem.equations, problem.surface
        v = np.cos(np.arange(system.rows))
        monkeypatch.setattr(sizes, "OWN_UNKNOWNS", total(surface.comm, system.rows) / worth)
        after.append(ImpulseUpdate()(system, surface, v, np.zeros(surface.count)))
    assert len(made) == factors
    assert (
        max_over_ranks(COMM, after[0] - after[1])
        <= 1e-12 * max_over_ranks(COMM, after[0] - v)
        > 0.0
    )


def test_a_condensed_solver_would_be_caught(large: Any) -> None:
    """The watch of the tests above works."""
    problem = thrown_box(COMM)
    A = EffectiveMatrix(problem.equations.M, problem.equations.algebra)
    large()
    with pytest.raises(AssertionError, match="factorised"):
        vc.Condensed().prepare(A, problem.surface, 1.0).delassus  # noqa: B018
