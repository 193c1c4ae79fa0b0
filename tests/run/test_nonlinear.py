"""Bodies whose internal force is not linear, through the certified loop."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

import vi_contact as vc
from demos.parts.problems.nonlinear import CUBIC, SPRING, CubicSprings, make_chain
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.step import Report
from vi_contact.layer.contact_law import contact_layer
from vi_contact.layer.scheme import BoundaryLayer
from vi_contact.run.stepper import Stepper

ELEMENTS = 40


@pytest.mark.long
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
    problem = make_chain(mass=vc.ConsistentMass())
    found = vc.simulate(
        problem,
        scheme=scheme,
        solver=vc.Condensed(),
        dt=2e-3,
        steps=100,
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
    curved = make_chain(cubic=0.0)
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


@pytest.mark.long
@pytest.mark.serial
def test_passes_and_tangents_are_few() -> None:
    stepper = Stepper(make_chain(), scheme=vc.Midpoint(), solver=vc.Condensed())
    for _ in range(150):
        stepper.accept(stepper.attempt(2e-3))
    solver = stepper.prepared[2e-3]
    assert sum(solver.counts) / 150 <= 12.0 and solver.tangents / 150 <= 3.0


@pytest.mark.long
@pytest.mark.serial
def test_a_restart_is_the_straight_run(tmp_path: Any) -> None:
    """To the last bit: nothing of a step is carried to the next but its state."""
    problem = make_chain()
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


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize("law", [vc.Inelastic(), vc.Newton(0.5)], ids=repr)
def test_impact_laws_act_on_a_chain_of_cubic_springs(law: Any) -> None:
    """The law takes what it says of the end's velocity, and the ledger closes beside it. Springs
    are up to eight times as stiff as at rest."""
    problem = make_chain(speed=12.0, impact=law)
    stepper = Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed())
    ledger = vc.Energy()
    ledger.start(stepper.method.problem, stepper.state)
    internal = problem.system.internal
    stiffest = 0.0
    struck = 0
    for _ in range(250):
        trial = stepper.attempt(2e-3)
        report = trial.report
        row = ledger.row(report)
        stepper.accept(trial)
        assert report.certificate.worst <= 1e-9
        if report.new.active[0] and not report.old.active[0]:
            struck += 1
            e = 0.0 if isinstance(law, vc.Inelastic) else law.e
            assert report.new.v[-1] == pytest.approx(-e * report.old.v[-1], abs=1e-9)
        stretch = np.abs(np.diff(report.new.u)).max()
        stiffest = max(stiffest, 1.0 + 3.0 * CUBIC * stretch**2 / SPRING)
    assert struck > 0 and stiffest > 7.0 and internal is not None
    assert row["loss_impact"] > 0.0
    most = 0.5 * 0.05 * (ELEMENTS + 1) * 12.0**2
    assert abs(row["energy_defect"]) <= 1e-9 * most
    assert abs(row["loss_algorithmic"]) <= 0.1 * most


@pytest.mark.serial
def test_bodies_that_are_not_linear_have_defaults_of_their_own() -> None:
    """Contact nodes keep their mass, as nothing solves for the equilibrium of those without."""
    problem = make_chain()
    stepper = Stepper(problem)
    assert stepper.method.scheme == vc.ZienkiewiczWoodTaylor()
    assert stepper.method.problem.mass == vc.ConsistentMass()
    assert Stepper(problem, scheme=vc.Newmark()).method.problem.mass == vc.ConsistentMass()
    massless = replace(problem, mass=vc.Redistributed())
    with pytest.raises(InputError, match="give the problem mass=ConsistentMass"):
        Stepper(massless, scheme=vc.Trapezoidal()).attempt(1e-3)


@dataclass(frozen=True)
class BrittleSprings(CubicSprings):
    """The cubic springs, whose force is no number beyond a stretch."""

    most: float = 0.02

    def force(self, u: np.ndarray) -> np.ndarray:
        whole = np.abs(self.B @ u).max() <= self.most
        return super().force(u) if whole else np.full(len(u), np.nan)


def make_brittle(most: float) -> vc.ContactProblem:
    """The chain, with springs that have no force beyond this stretch [m]."""
    problem = make_chain()
    springs = problem.system.internal.internal  # type: ignore[union-attr]
    brittle = BrittleSprings(springs.B, springs.k, springs.c, most)
    internal = replace(problem.system.internal, internal=brittle)  # type: ignore[type-var]
    system = problem.system.changed(internal=internal)
    surface = vc.contact_points(system, [ELEMENTS], [1.0], gap0=0.01)
    return vc.ContactProblem(system, surface)


@pytest.mark.serial
def test_a_step_that_begins_without_forces_is_refused() -> None:
    """As one of a body that is inside out."""
    problem = make_brittle(1e-3)
    u0 = np.linspace(0.0, -1.0, ELEMENTS + 1)
    beyond = replace(problem, system=problem.system.changed(u0=u0))
    with pytest.raises(StepFailure, match="begins where its internal force is NaN"):
        Stepper(beyond, scheme=vc.Midpoint()).attempt(2e-3)


@pytest.mark.serial
@pytest.mark.parametrize("most", [np.inf, 0.5])
def test_a_pass_that_goes_too_far_is_shortened(most: float) -> None:
    """A spring of 1 N/m and 100 N/m³ under 1 N: the reference leads to five times the answer, where
    the force is a hundred times the load, or is none. The answer is the root of the cubic."""
    B = sp.csr_matrix([[-1.0, 1.0]])
    springs = BrittleSprings(B, 1.0, 100.0, most)
    system = vc.system_from_arrays(
        np.ones(2),
        None,
        springs.tangent(np.zeros(2)),
        coordinates=[[0.0], [1.0]],
        load=[0.0, 1.0],
        clamped=[0],
        internal=springs,
    )
    surface = vc.contact_points(system, [1], [1.0], gap0=10.0)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    roots = np.roots([100.0, 0.0, 1.0, -1.0])
    assert state.u[-1] == pytest.approx(roots[np.isreal(roots)].real[0], rel=1e-9)


@pytest.mark.long
@pytest.mark.serial
def test_bodies_of_many_runs_that_are_not_linear_go_alone() -> None:
    """Each run is what it is by itself, to the last bit."""
    problems = [make_chain(speed=speed) for speed in (2.0, 3.0)]
    given: dict[str, Any] = {"scheme": vc.Midpoint(), "dt": 2e-3, "steps": 40}
    ends = {}
    for number, report in vc.march_many(problems, **given):
        assert isinstance(report, Report)
        ends[number] = report.new.u
    for number, problem in enumerate(problems):
        states = [state for state, _ in vc.march(problem, **given)]
        assert np.array_equal(states[-1].u, ends[number])


@pytest.mark.serial
def test_another_internal_force_is_another_run(tmp_path: Any) -> None:
    """With the same reference stiffness."""
    given: dict[str, Any] = {"scheme": vc.Midpoint(), "dt": 2e-3, "progress": False}
    vc.simulate(make_chain(), steps=5, out=tmp_path, **given)
    with pytest.raises(InputError, match="another internal force"):
        vc.simulate(make_chain(cubic=2e4), steps=10, out=tmp_path, restart=True, **given)


@pytest.mark.serial
def test_a_tangent_of_another_shape_is_refused() -> None:
    problem = make_chain()
    springs = problem.system.internal.internal  # type: ignore[union-attr]

    class Wrong(CubicSprings):
        def tangent(self, u: np.ndarray) -> Any:
            return super().tangent(u)[1:]

    wrong: Any = replace(problem.system.internal, internal=Wrong(springs.B, 1.0, 1.0))
    with pytest.raises(InputError, match="internal.tangent"):
        wrong.tangent(np.zeros(ELEMENTS + 1))


@pytest.mark.long
@pytest.mark.serial
def test_the_boundary_layer_is_for_linear_bodies() -> None:
    law = contact_layer(0.5, mass=2.0, speed=3.0, width=0.005)
    with pytest.raises(InputError, match="BoundaryLayer knows linear bodies only"):
        Stepper(make_chain(), scheme=BoundaryLayer(law=law))
