"""Contact unknowns last beside the route with two whole substitutions, on any number of ranks
(V4.0)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from contact_cases import PROBLEMS, WEAKENING, pressed
from fem_problems import BOX_DT, max_over_ranks, thrown_box
from mpi4py import MPI
from petsc_packages import needs
from posed import matrix_of

import vi_contact as vc
from vi_contact.core.algebra import EffectiveMatrix
from vi_contact.core.step import PreparedSolver
from vi_contact.fem.matrices import copied_factor, petsc_algebra
from vi_contact.kernels.contact_last import ContactLast
from vi_contact.laws.impact import ImpulseUpdate, Inelastic

COMM = MPI.COMM_WORLD
ROUND_OFF = 1e-11


class Whole:
    """An algebra that orders nothing last."""

    def __init__(self, algebra: Any) -> None:
        self._algebra = algebra

    def __getattr__(self, name: str) -> Any:
        return getattr(self._algebra, name)

    def contact_last(self, A: Any, last: Any) -> None:
        return None


@dataclass(frozen=True)
class Twice:
    """Condensed() by two whole substitutions a step."""

    condensed: vc.Condensed = vc.Condensed()

    def check(self, problem: vc.ContactProblem) -> None:
        self.condensed.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: Any, scale: float) -> PreparedSolver:
        assert not isinstance(A.algebra, Whole)
        return self.condensed.prepare(EffectiveMatrix(A.matrix, Whole(A.algebra)), surface, scale)


COULOMB, TRESCA = vc.Coulomb(0.3), vc.Tresca(2e4)
LAWS = {
    "box, C = 5": WEAKENING,
    "springs": None,
    "inclined": COULOMB,
    "bilateral": None,
    "rollers, 2D": TRESCA,
    "rollers, 3D": COULOMB,
    "pair, 2D": None,
    "pair, 3D": COULOMB,
    "corner": TRESCA,
    "moving": WEAKENING,
}


@pytest.mark.parametrize(("name", "law"), LAWS.items(), ids=list(LAWS))
def test_steps_agree(name: str, law: Any) -> None:
    """u, r_n and r_t of every step."""
    make, dt = PROBLEMS[name]
    problem = make()
    if law is not None:
        problem = replace(
            problem, friction=law, surface=problem.surface.with_frictionless_corners()
        )
    checked = vc.cross_check(problem, solvers=(vc.Condensed(), Twice()), dt=dt, steps=6)
    assert max_over_ranks(COMM, np.array([checked.found[0].size["r_n"]])) > 0.0
    assert checked.worst <= ROUND_OFF


@pytest.mark.parametrize(("d", "law"), [(2, None), (3, None), (2, vc.Coulomb(0.2))], ids=repr)
def test_statics_agree(d: int, law: Any) -> None:
    problem = pressed(d) if law is None else replace(pressed(d), friction=law)
    one, other = (
        vc.static_equilibrium(problem, solver=solver) for solver in (vc.Condensed(), Twice())
    )
    for name in ("u", "r_n"):
        size = max_over_ranks(COMM, getattr(one, name))
        assert (
            size > 0.0
            and max_over_ranks(COMM, getattr(one, name) - getattr(other, name)) <= ROUND_OFF * size
        )


@needs("cholmod")
def test_halved_steps_agree_and_each_dt_has_its_factor() -> None:
    problem = replace(thrown_box(COMM), friction=vc.Coulomb(0.3))
    dt = vc.HalvedAtImpact(BOX_DT, halvings=2)
    lengths = set()
    for (one, report), (other, _) in zip(
        vc.march(problem, solver=vc.Condensed(), dt=dt, steps=10),
        vc.march(problem, solver=Twice(), dt=dt, steps=10),
        strict=True,
    ):
        assert isinstance(report.step.A.factor, ContactLast)
        lengths.add(round((report.new.t - report.old.t) / BOX_DT, 6))
        assert max_over_ranks(COMM, one.u - other.u) <= ROUND_OFF * max_over_ranks(COMM, other.u)
    assert len(lengths) > 1


def test_impulses_agree() -> None:
    """M condensed in both ways; the impulse is on the closed points alone."""
    problem = replace(thrown_box(COMM, simplices=True), impact=Inelastic(ImpulseUpdate()))
    system, surface = problem.equations, problem.surface
    v = np.cos(np.arange(system.rows) + 1.0)
    target = np.where(np.arange(surface.count) % 2 == 0, 0.25, np.nan)
    found = ImpulseUpdate()(system, surface, v, target)
    other = ImpulseUpdate()(system.changed(algebra=Whole(system.algebra)), surface, v, target)
    assert max_over_ranks(COMM, found - other) <= ROUND_OFF * max_over_ranks(COMM, other)
    assert max_over_ranks(COMM, found - v) > 1e-3


@needs("cholmod")
def test_what_else_factorises(monkeypatch: Any) -> None:
    """What CHOLMOD cannot do, what users order otherwise, and machines without it: PETSc
    factorises."""
    problem = thrown_box(COMM)
    A = matrix_of(vc.ZienkiewiczWoodTaylor(), problem, BOX_DT)
    last = np.arange(3)
    assert A.algebra.contact_last(A.matrix, last) is not None
    indefinite = A.algebra.combine([(-1.0, A.matrix)])
    assert A.algebra.contact_last(indefinite, last) is None
    options = petsc_algebra.PETSc.Options(petsc_algebra.PREFIX)
    options["pc_factor_mat_ordering_type"] = "amd"
    try:
        assert A.algebra.contact_last(A.matrix, last) is None
    finally:
        options.delValue("pc_factor_mat_ordering_type")
    monkeypatch.setattr(copied_factor, "load_cholmod", lambda comm: None)
    assert A.algebra.contact_last(A.matrix, last) is None
    states = vc.march(problem, solver=vc.Condensed(), dt=BOX_DT, steps=3)
    assert all(not isinstance(report.step.A.factor, ContactLast) for _, report in states)
