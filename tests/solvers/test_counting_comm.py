"""What a run with ``Iterative()`` sends over the ranks and multiplies: no factor, no array of the
contact points, at most a dozen numbers at a time, and the products of its ledger and
certificate."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import BOX_DT, thrown_box
from mpi4py import MPI
from posed import first_step
from standing import standing

import vi_contact as vc
from vi_contact.core import sizes
from vi_contact.core.state_checks import initial_state
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.verify import kkt_residual
from vi_contact.fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix
from vi_contact.fem.mesh.communicators import MpiComm
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import Redistributed
from vi_contact.run.march import march
from vi_contact.run.method import with_defaults
from vi_contact.run.recorders import Energy
from vi_contact.run.recorders.steps import Steps
from vi_contact.solvers.iterative.preconditioners import KINDS
from vi_contact.solvers.iterative.route import PreparedIterative

COMM = MPI.COMM_WORLD
DOZEN = 12


@dataclass
class Traffic:
    """Sizes of what was reduced, gathered or sent to all since it began, how often outside the
    solver, and how often a matrix of the equations was applied."""

    begin: Callable[[], None] = lambda: None
    sizes: list[int] = field(default_factory=list)
    products: int = 0
    outside: int = 0
    solving: bool = False

    @property
    def small(self) -> bool:
        """Whether something was sent, and nothing of more than a dozen numbers."""
        return 1 <= max(self.sizes) <= DOZEN

    def count_sizes(self, operation: Any) -> Any:
        """Return the operation of a communicator, which notes what it sends."""

        def count(comm: Any, value: Any) -> Any:
            self.outside += not self.solving
            self.sizes.append(
                value.size if isinstance(value, np.ndarray) else len(pickle.dumps(value)) // 8
            )
            return operation(comm, value)

        return count

    def count_products(self, operation: Any) -> Any:
        """Return the product of a matrix and a vector, which is counted."""

        def multiply(matrix: Any, x: Any) -> Any:
            self.products += 1
            return operation(matrix, x)

        return multiply

    def mark_solving(self, operation: Any) -> Any:
        """Return the solver, which tells when it begins and ends."""

        def solve(prepared: Any, step: Any) -> Any:
            self.solving = True
            result = operation(prepared, step)
            self.solving = False
            return result

        return solve


def refuse(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> None:
    """Let a call of this method fail."""

    def refused(*_: Any) -> None:
        raise AssertionError(f"{owner.__name__}.{name} was called")

    monkeypatch.setattr(owner, name, refused)


@pytest.fixture
def traffic(monkeypatch: pytest.MonkeyPatch) -> Traffic:
    """From ``begin`` on all problems are large, and factors and gathered contact arrays are
    refused, on one rank too."""
    found = Traffic()

    def begin() -> None:
        for name in ("sum", "max", "bcast", "gather"):
            monkeypatch.setattr(MpiComm, name, found.count_sizes(getattr(MpiComm, name)))
        product = found.count_products(PetscMatrix.__matmul__)
        monkeypatch.setattr(PetscMatrix, "__matmul__", product)
        monkeypatch.setattr(PreparedIterative, "solve", found.mark_solving(PreparedIterative.solve))
        refuse(monkeypatch, PetscAlgebra, "factor")
        refuse(monkeypatch, ContactSurface, "everywhere")
        monkeypatch.setattr(sizes, "OWN_UNKNOWNS", 0)

    found.begin = begin
    return found


def box(**data: Any) -> vc.ContactProblem:
    """Thirty contact points in space, on an inclined plane."""
    return replace(thrown_box(COMM, divisions=(5, 4, 4), simplices=True, angle=0.4), **data)


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_and_its_certificate(kind: str, traffic: Traffic) -> None:
    """From a prediction that is all wrong. The solver's products are its own; the certificate has
    one, A d, and one reduction where there are several ranks."""
    problem, scheme = box(), vc.Midpoint()
    assert problem.surface.total > 2 * DOZEN
    state = initial_state(problem)
    traffic.begin()
    step = first_step(scheme, problem, BOX_DT, state)
    A = step.A
    step, made = replace(step, active=~step.active), traffic.products
    result = vc.Iterative(kind).prepare(A, problem.surface, step.scale).solve(step)
    assert traffic.small and traffic.products == made
    _ = A @ result.x  # the first product chooses its format, by counts over all ranks
    sent = len(traffic.sizes)
    made = traffic.products
    assert kkt_residual(step, result).worst <= 1e-9
    assert (
        traffic.small
        and traffic.products == made + 1
        and len(traffic.sizes) == sent + (COMM.size > 1)
    )


# name -> problem, scheme, products a step outside the solver, certificate (1) and ledger (3)
# included
STEPPED: dict[str, tuple[dict[str, Any], Any, float]] = {
    "midpoint": ({}, vc.Midpoint(), 6),
    "default": ({"mass": Redistributed()}, None, 6),
    "friction": ({"friction": vc.Coulomb(0.3)}, vc.Midpoint(), 6),
    "HHT": ({"mass": Redistributed()}, vc.HHT(), 6),
    "predictor": ({}, vc.ContactStabilisedNewmark(), 7),
    "impacts": ({"impact": Inelastic(ImpulseUpdate())}, vc.Midpoint(), 45),
}


@pytest.mark.parametrize("name", STEPPED)
def test_steps_with_their_ledger(name: str, traffic: Traffic) -> None:
    """From the start of a run on, after mass was moved and the system turned."""
    data, scheme, most = STEPPED[name]
    problem, scheme = with_defaults(box(**data), scheme)
    assert problem.equations.rows >= 0
    recorders: list[Any] = [Steps(), Energy()]
    traffic.begin()
    closed = False
    for state, report in march(problem, scheme=scheme, solver=vc.Iterative(), dt=BOX_DT, steps=6):
        if state.k == 1:
            for recorder in recorders:
                recorder.start(report.problem, report.old)
        for recorder in recorders:
            recorder.row(report)
        if state.k == 1:
            first = traffic.products, traffic.outside
        closed |= problem.surface.some(state.active)
    assert closed and traffic.small
    assert traffic.products - first[0] <= 5 * most and traffic.outside - first[1] <= 5 * DOZEN


def test_a_gravity_stage(traffic: Traffic) -> None:
    """Of a body that contact alone holds: at most three forms of its six rigid motions, 6 x 6, at
    once."""
    problem = standing(lengths=(1.0, 3.0, 1.0), divisions=(4, 6, 4), simplices=True)
    assert problem.surface.total > 2 * DOZEN and problem.static_load.rows >= 0
    solver = vc.Iterative()
    traffic.begin()
    assert problem.surface.some(vc.static_equilibrium(problem, solver=solver).active)
    assert sorted(set(traffic.sizes))[-2] <= DOZEN and max(traffic.sizes) <= 3 * 36


def test_a_whole_run(traffic: Traffic) -> None:
    """To its summary, without arrays of the contact points in its histories; a linear step is not
    timed."""
    problem, _ = with_defaults(box(), None)
    assert problem.equations.rows >= 0
    traffic.begin()
    record = [Energy()]
    solution = vc.simulate(
        problem, solver=vc.Iterative(), dt=BOX_DT, steps=3, record=record, progress=False
    )
    assert traffic.small and solution.facts["steps"] == 3
    assert np.isnan(solution.facts["seconds_per_linear_step"])
