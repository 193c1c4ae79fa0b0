"""Bodies whose internal force is not linear, through the certified loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import vi_contact as vc
from vi_contact.core.errors import InputError
from vi_contact.run.stepper import Stepper

ELEMENTS = 40
SPRING = 400.0  # N/m, of each element
CUBIC = 4e4  # N/m³: at strains of the run tangents are up to eight times the reference


@dataclass(frozen=True)
class CubicSprings:
    """A chain with forces k e + c e³ in its springs of elongation e."""

    B: Any  # elongations of the nodes' displacements, sparse
    k: float
    c: float

    def force(self, u: np.ndarray) -> np.ndarray:
        e = self.B @ u
        return np.asarray(self.B.T @ (self.k * e + self.c * e**3))

    def energy(self, u: np.ndarray) -> float:
        e = self.B @ u
        return float(0.5 * self.k * e @ e + 0.25 * self.c * (e**2) @ (e**2))

    def tangent(self, u: np.ndarray) -> Any:
        e = self.B @ u
        return self.B.T @ sp.diags(self.k + 3.0 * self.c * e**2) @ self.B


def chain(*, cubic: float = CUBIC, speed: float = 3.0, **more: Any) -> vc.ContactProblem:
    """A chain of masses thrown along its axis against a stop 1 cm before its end."""
    n = ELEMENTS + 1
    rows = np.arange(ELEMENTS)
    ones = np.ones(ELEMENTS)
    B = sp.csr_matrix(
        (np.r_[-ones, ones], (np.r_[rows, rows], np.r_[rows, rows + 1])), (ELEMENTS, n)
    )
    internal = CubicSprings(B, SPRING, cubic)
    system = vc.system_from_arrays(
        np.full(n, 0.05),
        None,
        internal.tangent(np.zeros(n)),
        coordinates=np.linspace(0.0, 1.0, n)[:, None],
        v0=np.full(n, speed),
        internal=internal,
    )
    surface = vc.contact_points(system, [n - 1], [1.0], gap0=0.01)
    return vc.ContactProblem(system, surface, **more)


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme",
    [
        vc.Midpoint(),
        vc.ZienkiewiczWoodTaylor(0.7),
        vc.SS22(0.6, 0.7),
        vc.MoreauJean(),
        vc.ContactStabilisedNewmark(),
        vc.GeneralisedAlpha.spectral_radius(0.8),
        vc.Newmark(),
        vc.Houbolt(),
    ],
    ids=repr,
)
def test_every_scheme_steps_a_chain_of_cubic_springs(scheme: Any) -> None:
    """Certificates are those of the nonlinear step, and the ledger closes with W(u)."""
    problem = chain(mass=vc.ConsistentMass())
    found = vc.simulate(
        problem,
        scheme=scheme,
        solver=vc.Condensed(),
        dt=2e-3,
        steps=200,
        record=[vc.Energy(), vc.Contact()],
        progress=False,
    )
    history = found.history
    most = (history["energy_kinetic"] + history["energy_strain"]).max()
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    assert history["contact_active"].sum() > 10.0
    if isinstance(scheme, vc.ZienkiewiczWoodTaylor | vc.SS22):
        # these dissipate, and the midpoint rule is within its order of keeping the energy
        assert history["loss_algorithmic"][-1] > -0.02 * most


@pytest.mark.serial
def test_a_linear_force_is_the_linear_body() -> None:
    """With p(u) = K u every step takes one pass, and the run is that of K."""
    curved = chain(cubic=0.0)
    system = curved.system.changed(internal=None)
    surface = vc.contact_points(system, [ELEMENTS], [1.0], gap0=0.01)
    straight = vc.ContactProblem(system, surface)
    runs = [
        [
            report
            for _, report in vc.march(
                p, scheme=vc.Midpoint(), solver=vc.Condensed(), dt=2e-3, steps=150
            )
        ]
        for p in (curved, straight)
    ]
    for one, other in zip(*runs, strict=True):
        assert np.abs(one.new.u - other.new.u).max() <= 1e-12
        assert one.result.iterations <= 2
    assert any(report.new.active.any() for report in runs[0])


@pytest.mark.serial
def test_passes_and_tangents_are_few() -> None:
    stepper = Stepper(chain(), scheme=vc.Midpoint(), solver=vc.Condensed())
    for _ in range(150):
        stepper.accept(stepper.attempt(2e-3))
    solver = stepper.passes[2e-3]
    assert sum(solver.counts) / 150 <= 12.0 and solver.tangents / 150 <= 3.0


@pytest.mark.serial
def test_a_restart_is_the_straight_run(tmp_path: Any) -> None:
    """To the last bit: nothing of a step is carried to the next but its state."""
    problem = chain()
    given: dict[str, Any] = {"scheme": vc.Midpoint(), "dt": 2e-3, "progress": False}
    straight = vc.simulate(problem, steps=120, **given)
    vc.simulate(problem, steps=60, out=tmp_path, **given)
    again = vc.simulate(problem, steps=120, out=tmp_path, restart=True, **given)
    assert np.array_equal(straight.state.u, again.state.u)


@pytest.mark.serial
def test_an_internal_force_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="give an object with force"):
        vc.system_from_arrays(
            np.ones(2),
            None,
            np.eye(2),
            coordinates=[[0.0], [1.0]],
            internal=lambda u: u,  # type: ignore[arg-type]
        )
