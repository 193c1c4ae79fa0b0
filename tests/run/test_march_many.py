"""Runs that step together take the steps that they take alone. On several ranks they go one by
one."""

from __future__ import annotations

import dataclasses
import itertools
from collections import defaultdict
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.wall import Wall, build
from vi_contact import fem
from vi_contact.core import packages
from vi_contact.kernels import contact_last
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.together import Group

MODEL = build(Wall(divisions=(4, 6)), MPI.COMM_WORLD)
DT = MODEL.time_step()
BASE = MODEL.problem("face")
SHAKEN = [
    replace(BASE, excitation=replace(BASE.excitation, amplitude=amplitude))
    for amplitude in (1.0, 0.3, 2.5)
]
STEPS = 50


def run(problems, **settings):
    """Return the reports of every run, and the errors."""
    reports, errors = defaultdict(list), {}
    settings = {"dt": DT, "steps": STEPS} | settings
    for number, found in vc.march_many(problems, **settings):
        if isinstance(found, vc.Report):
            reports[number].append(found)
        else:
            errors[number] = found
    return reports, errors


def apart(ours: vc.State, theirs: vc.State) -> float:
    """Return how far two states are apart, over the largest entries of one."""

    def over(one, other):
        return np.abs(one - other).max(initial=0.0) / (np.abs(other).max(initial=0.0) or 1.0)

    assert np.array_equal(ours.active, theirs.active) and (ours.t, ours.k) == (theirs.t, theirs.k)
    return max(over(ours.u, theirs.u), over(ours.v, theirs.v), over(ours.r_n, theirs.r_n))


@pytest.fixture
def steps_together(monkeypatch):
    """Count the runs of each step that was made together, which CHOLMOD makes possible."""
    if not packages.petsc_has("cholmod"):
        pytest.skip("this PETSc was built without cholmod")
    counts, finish = [], Group._finish
    monkeypatch.setattr(
        Group, "_finish", lambda self, *args: (counts.append(len(self._runs)), finish(self, *args))
    )
    return counts


RUBBING = [
    replace(one, friction=vc.Coulomb(mu)) for one, mu in zip(SHAKEN, (0.2, 0.5, 0.0), strict=True)
]
LIGHT = [replace(one, impact=None, mass=vc.Redistributed()) for one in SHAKEN]


def alone(problems, scheme):
    """Return parameters for one rank: one by one, on several, all schemes go alike."""
    return pytest.param(problems, scheme, marks=pytest.mark.serial)


@pytest.mark.parametrize(
    ("problems", "scheme"),
    [
        (SHAKEN, None),
        alone(SHAKEN, vc.Newmark()),
        alone(SHAKEN, vc.HHT()),
        alone(SHAKEN, vc.SS22()),
        alone(SHAKEN, vc.Houbolt()),
        (RUBBING, None),
        alone(LIGHT, None),
        alone([replace(one, friction=vc.Coulomb(0.3)) for one in LIGHT], None),
    ],
)
@pytest.mark.promise(
    "guide/solvers.md", "1e-13 of the largest in 300 steps", bound="1e-12 in each step"
)
def test_each_step_is_the_step_alone_from_the_same_state(problems, scheme, steps_together):
    reports, errors = run(problems, scheme=scheme)
    closed = 0.0
    for number, problem in enumerate(problems):
        assert len(reports[number]) == STEPS
        for report in reports[number][::7]:
            alone, other = next(vc.march(problem, scheme=scheme, dt=DT, steps=1, state=report.old))
            assert apart(report.new, alone) < 1e-12
            assert report.certificate.worst < 1e-9 and report.result.method == other.result.method
            assert np.allclose(report.balance.f, other.balance.f, rtol=1e-12, atol=0.0)
        closed += sum(report.new.active.any() for report in reports[number])
    assert not errors and MPI.COMM_WORLD.allreduce(closed) > 10
    if MPI.COMM_WORLD.size == 1:
        assert steps_together == [3] * STEPS


@pytest.mark.two_ranks
@pytest.mark.parametrize("friction", [None, vc.Coulomb(0.3)])
@pytest.mark.parametrize("by_supernodes", [True, False])
def test_bodies_in_space(monkeypatch, steps_together, by_supernodes, friction):
    """A cube over the ground that it touches: substitutions by supernodes, as where bodies in space
    are large."""
    monkeypatch.setattr(contact_last, "SHORT_COLUMNS", 1.0 if by_supernodes else 1e3)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(1.0, 1.0, 1.0), divisions=(3, 3, 3)), MPI.COMM_WORLD
    )
    system = fem.assemble(mesh, vc.LinearElastic(E=3e10, nu=0.2, rho=2400.0), clamped=tags["top"])
    ground = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    surface, dt = fem.contact_surface(system, tags["bottom"], obstacle=ground), 6e-5
    laws = {} if friction is None else {"friction": friction}
    problems = [
        vc.ContactProblem(
            system,
            surface,
            mass=vc.ConsistentMass(),
            impact=vc.Inelastic(),
            **laws,
            excitation=vc.Harmonic(amplitude, 400.0, direction=(0.3, 1.0, 0.1)),
        )
        for amplitude in (1.0, -0.4, 2.0)
    ]
    settings = {"scheme": vc.ZienkiewiczWoodTaylor(), "dt": dt, "solver": vc.Condensed()}
    reports, errors = run(problems, steps=24, **settings)
    closed = 0.0
    for number, problem in enumerate(problems):
        for report in reports[number][5::6]:
            alone, _ = next(vc.march(problem, steps=1, state=report.old, **settings))
            assert apart(report.new, alone) < 1e-12 and report.certificate.worst < 1e-9
        closed += sum(report.new.active.any() for report in reports[number])
    assert not errors and MPI.COMM_WORLD.allreduce(closed) > 10
    assert steps_together == ([3] * 24 if MPI.COMM_WORLD.size == 1 else [])


@pytest.mark.two_ranks
def test_reports_hold_what_reports_of_march_hold(steps_together):
    """Read late, in any order; and a changed copy."""
    reports, _ = run(SHAKEN, steps=12)
    fields = [one.name for one in dataclasses.fields(vc.Report)]
    for report in reports[1]:
        changed = replace(report, escalated=True)
        assert changed.escalated and not report.escalated and changed.new is report.new
        alone, other = next(vc.march(SHAKEN[1], dt=DT, steps=1, state=report.old))
        for name in reversed(fields):
            assert type(getattr(report, name)) is type(getattr(other, name))
        assert np.abs(report.step.b - other.step.b).max(initial=0.0) <= 1e-12 * np.abs(
            other.step.b
        ).max(initial=0.0)
        assert (report.step.t, report.result.iterations) == (alone.t, other.result.iterations)
        assert not hasattr(report, "another")
        system = report.problem.equations
        for found, expected in (
            (report.momentum, system.M @ report.v_minus),
            (report.elastic, system.K @ report.new.u),
        ):
            assert np.abs(found - expected).max(initial=0.0) <= 1e-13 * np.abs(expected).max(
                initial=0.0
            )
    for before, after in itertools.pairwise(reports[1]):
        assert after.old is before.new


@pytest.mark.long
@pytest.mark.two_ranks
def test_the_order_of_the_runs_does_not_matter():
    forwards, _ = run(SHAKEN)
    backwards, _ = run(SHAKEN[::-1])
    for number in range(3):
        for one, other in zip(forwards[number], backwards[2 - number], strict=True):
            assert apart(one.new, other.new) < 1e-9


@pytest.mark.two_ranks
def test_a_run_that_ends_earlier_leaves_and_so_do_other_bodies(steps_together):
    other = build(Wall(divisions=(3, 4)), MPI.COMM_WORLD).problem("face")
    ends = [10, 30, 20, 5]
    reports, errors = run([*SHAKEN, other], steps=ends)
    assert [len(reports[number]) for number in range(4)] == ends and not errors
    for number in range(3):
        *_, (alone, _) = vc.march(SHAKEN[number], dt=DT, steps=ends[number])
        assert apart(reports[number][-1].new, alone) < 1e-9
    if MPI.COMM_WORLD.size == 1:
        assert steps_together == [3] * 10 + [2] * 10


def test_a_run_that_fails_leaves_the_others_alone():
    broken = replace(BASE, excitation=Broken())
    reports, errors = run([SHAKEN[0], broken, SHAKEN[2]])
    expected, _ = run([SHAKEN[0], SHAKEN[2]])
    assert (
        isinstance(errors[1], vc.StepFailure)
        and "NaN" in str(errors[1])
        and len(reports[1]) < STEPS
    )
    for number, other in ((0, 0), (2, 1)):
        assert apart(reports[number][-1].new, expected[other][-1].new) < 1e-9


@dataclass(frozen=True)
class Broken:
    """Shake until 20 steps are done, and have no value then."""

    direction: tuple[float, float] = (1.0, 0.0)
    duration: float = np.inf

    def acceleration(self, t: float) -> float:
        return np.sin(t) if t < 20.0 * DT else float("nan")


@dataclass(frozen=True)
class Fails:
    """Condense, but fail in step 12 of a run with larger loads than the others."""

    condensed: vc.Condensed = field(default_factory=vc.Condensed)

    def check(self, problem):
        self.condensed.check(problem)

    def prepare(self, A, surface, scale):
        made = self.condensed.prepare(A, surface, scale)
        solve, solve_many = made.solve, made.solve_many

        def refused(step):
            return step.k == 12 and step.friction == vc.Coulomb(0.5)

        def failing(step):
            if refused(step):
                raise vc.StepFailure("refused")
            return solve(step)

        def failing_many(many, own):
            found = solve_many(many, own)
            if found is not None:
                rows = [row for row in range(len(many.b)) if refused(own(row))]
                found.failed.update(dict.fromkeys(rows, vc.StepFailure("refused")))
            return found

        made.solve, made.solve_many = failing, failing_many
        return made


@pytest.mark.two_ranks
def test_a_run_that_escalates_goes_on_alone(steps_together):
    reports, errors = run(
        RUBBING, solver=Fails(), escalation=[vc.Condensed(friction_method=vc.solvers.NSGS())]
    )
    escalated = [[one.new.k for one in reports[number] if one.escalated] for number in range(3)]
    assert not errors and escalated == [[], [12], []]
    expected, _ = run(RUBBING)
    for number in range(3):
        assert apart(reports[number][-1].new, expected[number][-1].new) < 1e-7
    if MPI.COMM_WORLD.size == 1:
        assert steps_together == [3] * 11 + [2] * (STEPS - 11) + [3] * STEPS


def test_runs_that_do_not_step_together_are_the_runs_alone(steps_together):
    for settings in (
        {"scheme": vc.ContactStabilisedNewmark()},
        {"dt": vc.HalvedAtImpact(DT, halvings=1)},
    ):
        reports, errors = run(SHAKEN, **settings)
        for number, problem in enumerate(SHAKEN):
            *_, (alone, _) = vc.march(problem, **({"dt": DT, "steps": STEPS} | settings))
            assert apart(reports[number][-1].new, alone) == 0.0
    assert not steps_together and not errors


@pytest.mark.two_ranks
def test_a_schedule_changes_the_step_of_all(steps_together):
    plan = vc.Schedule(((DT, 10.5 * DT), (0.5 * DT, np.inf)))
    reports, _ = run(SHAKEN, dt=plan, scheme=vc.Newmark())
    *_, (alone, _) = vc.march(SHAKEN[2], dt=plan, steps=STEPS, scheme=vc.Newmark())
    assert apart(reports[2][-1].new, alone) < 1e-9
    if MPI.COMM_WORLD.size == 1:
        assert steps_together == [3] * STEPS


@pytest.mark.two_ranks
def test_refusals():
    with pytest.raises(vc.InputError, match="2 steps for 3 problems"):
        vc.march_many(SHAKEN, dt=DT, steps=[1, 2])
    with pytest.raises(vc.InputError, match="march_many"):
        vc.march_many(BASE, dt=DT, steps=3)
