"""What is too large for dense matrices is refused with its size and what to take instead; what is
small is counted over all ranks."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from chain import chain_problem

from vi_contact.core.algebra import SerialAlgebra, SerialComm
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.sizes import DENSE_ROWS, OWN_CONDITIONS, OWN_UNKNOWNS, is_small_problem
from vi_contact.laws.friction import Coulomb
from vi_contact.run.march import march
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial


def touching(m: int) -> ContactProblem:
    """A chain of which every mass may touch."""
    problem = chain_problem(m)
    surface = replace(
        problem.surface,
        points=np.zeros((m, 1)),
        normals=np.ones((m, 1)),
        weights=np.ones(m),
        gap0=np.ones(m),
        bilateral=np.zeros(m, dtype=bool),
        compliance=np.zeros(m),
        owned=np.arange(m),
        slots=np.arange(m),
        tangents=np.zeros((m, 0), dtype=np.int64),
    )
    return replace(problem, surface=surface)


def rubbing(m: int) -> Any:
    """Points in space, as far as a count of their unknowns goes."""
    surface = replace(touching(m).surface, tangents=np.full((m, 2), -1))
    system = SimpleNamespace(algebra=SerialAlgebra())
    return SimpleNamespace(frictional=True, friction=Coulomb(0.3), surface=surface, system=system)


def told(owner: str, rows: int) -> str:
    return re.escape(
        f"{owner} stores a dense matrix of its {rows} contact unknowns on every rank, 0.8 GB: take "
        f"Iterative(), which stores none, or at most {DENSE_ROWS}"
    )


def test_condensed_refuses_what_its_dense_matrix_would_not_fit() -> None:
    """Before anything is made of it: in ``check``, and in ``prepare`` for those who do not ask."""
    fits, large = touching(DENSE_ROWS), touching(DENSE_ROWS + 1)
    Condensed().check(fits)
    for refused in (
        lambda: Condensed().check(large),
        lambda: march(large, solver=Condensed(), dt=0.1, steps=1),
        lambda: Condensed().prepare(
            large.system.effective(m=1.0, c=0.0, k=1.0), large.surface, 1.0
        ),
    ):
        with pytest.raises(InputError, match=told("Condensed()", DENSE_ROWS + 1)):
            refused()


def test_tangents_count_with_friction() -> None:
    """Friction forms the matrix of normal and tangential unknowns."""
    with pytest.raises(InputError, match=told("Condensed() with Coulomb(mu=0.3)", 10_002)):
        Condensed().check(rubbing(3334))
    Condensed().check(rubbing(3333))


def test_small_is_counted_over_all_ranks() -> None:
    class Two(SerialComm):
        size = 2

        def sum(self, x: np.ndarray) -> np.ndarray:
            return 2.0 * x

    assert is_small_problem(SerialComm(), OWN_UNKNOWNS, OWN_CONDITIONS)
    assert is_small_problem(Two(), OWN_UNKNOWNS // 2, OWN_CONDITIONS // 2)
    assert not is_small_problem(Two(), OWN_UNKNOWNS // 2 + 1, 1) and not is_small_problem(
        Two(), 1, OWN_CONDITIONS // 2 + 1
    )
