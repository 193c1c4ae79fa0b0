"""Contact on condensed boundaries: the contract, Uzawa on the whole history, two bodies, welds,
limits, bad input."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from convolution_operator import convolution_operator

import vi_contact as vc
from demos.parts.problems.boundary_elements import pressed, square_problem, steklov, unloaded
from demos.parts.problems.contact_ledger import ledger
from demos.parts.problems.whole_runs import Reference, compare_runs
from vi_contact import solvers
from vi_contact.bem import (
    BoundaryProblem,
    PoincareSteklov,
    TwoBodies,
    polygon,
)
from vi_contact.bem.contact import BoundaryContact, Conditions, conditions_on
from vi_contact.bem.contact_run import ContactRun, march_contact
from vi_contact.bem.uzawa_space_time import SpaceTimeUzawa
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.solvers.friction.slip_rate import RateIteration

pytestmark = pytest.mark.serial
MATERIAL = vc.LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
LAWS = {
    "none": vc.Frictionless(),
    "Tresca": vc.Tresca(0.05),
    "Coulomb": vc.Coulomb(0.5),
    "weak Coulomb": vc.Coulomb(0.1),
}
METHODS = (
    vc.Condensed(solvers.Hildreth()),
    vc.Condensed(friction_method=solvers.NSGS()),
    vc.Condensed(friction_method=solvers.FixedPoint()),
)


@cache
def square() -> BoundaryProblem:
    """V7.1 with 5 elements per side, 30 steps of 0.2 s."""
    return square_problem(5, MATERIAL, dt=0.2, steps=30)


@cache
def condensed():
    return square().condensed()


@cache
def run(law: str) -> ContactRun:
    return march_contact(BoundaryContact(condensed(), friction=LAWS[law]))


def away(one: ContactRun, other: ContactRun) -> float:
    """Largest difference of the contact forces over the largest force."""
    return float(np.abs(one.forces - other.forces).max() / np.abs(other.forces).max())


@pytest.mark.parametrize("law", LAWS)
def test_every_step_is_certified(law):
    """B9: residuals of the contract, no penetration, no tension, cone, complementarity, by hand
    too."""
    found = run(law)
    assert len(found.certificates) == 30 and found.worst < 1e-12
    assert found.gap.min() >= 0.0 and found.r_n.min() >= 0.0 and found.r_n.max() > 0.1
    assert np.abs(found.gap * found.r_n).max() < 1e-14
    limit = (
        LAWS[law]
        .limit(found.r_n.ravel(), np.tile(found.contact.surface.weights, 30), 1.0)
        .reshape(30, -1)
    )
    assert (np.abs(found.r_t) <= limit * (1.0 + 1e-12) + 1e-15).all()
    assert (np.diff(found.friction_loss, prepend=0.0) >= -1e-14).all()
    assert (found.friction_loss[-1] > 0.05) == (law in ("Tresca", "weak Coulomb"))


@pytest.mark.parametrize("law", LAWS)
def test_energy_from_boundary_data_alone(law):
    """B9: energy = work of load and contact forces to round-off, never negative; pressure on a
    support at rest never gives energy, and takes some where points close; the whole boundary moves
    as the condensed one does."""
    found = run(law)
    motion = square().solve(found.forces)
    books = ledger(found, motion, square().forces)
    assert books.defect < 1e-12 and books.energy.min() > 0.0 and books.energy.max() > 2.0
    pressure = books.contact + books.friction
    assert np.diff(pressure, prepend=0.0).max() < 1e-14 and -0.03 < pressure[-1] < -0.01
    u = motion.displacement[:, :, condensed().nodes].reshape(30, -1)
    assert np.abs(u - found.displacement).max() < 1e-12 * np.abs(u).max()


@pytest.mark.parametrize("method", METHODS)
def test_all_methods_for_the_small_problem_agree(method):
    """The contract: Condensed with any of its methods solves a boundary element step."""
    law = "none" if not isinstance(method.method, solvers.ActiveSet) else "weak Coulomb"
    found = march_contact(BoundaryContact(condensed(), friction=LAWS[law]), solver=method)
    assert away(found, run(law)) < 1e-7


@pytest.mark.parametrize("law", LAWS)
def test_uzawa_on_the_whole_history_is_the_march(law):
    """B10: 1e-6 at rho = 1/lambda_max(W[0]), changes grow first; a fifth of rho does it, slowly."""
    contact = BoundaryContact(condensed(), friction=LAWS[law])
    found = SpaceTimeUzawa(tolerance=1e-9).solve(contact)
    assert away(found, run(law)) < 1e-6
    assert 80 < found.iterations[0] == len(found.history) < 400 and found.history[-1] <= 1e-9
    assert max(found.history) > 2.0
    values = np.linalg.eigvalsh(contact.W[0])
    slow = SpaceTimeUzawa(tolerance=1e-9, rho=0.2 / values[-1]).solve(contact)
    assert away(slow, run(law)) < 1e-5 and slow.iterations[0] > 2 * found.iterations[0]


@pytest.mark.parametrize("window", [1, 7])
def test_uzawa_in_windows(window):
    """B10: windows of the history one after the other, the past known, give the same run."""
    contact = BoundaryContact(condensed(), friction=LAWS["weak Coulomb"])
    found = SpaceTimeUzawa(tolerance=1e-10, window=window).solve(contact)
    assert away(found, run("weak Coulomb")) < 1e-6
    assert len(found.iterations) == -(-30 // window) and found.iterations.sum() == len(
        found.history
    )


@pytest.mark.parametrize("rho", [1e-6, 1e-300])
def test_uzawa_does_not_stop_because_its_steps_are_small(rho):
    """B10: the change to stop at is that of the default rho: with a small one nothing moved, and
    all was wrong."""
    with pytest.raises(StepFailure, match="stopped after 50 iterations"):
        SpaceTimeUzawa(tolerance=1e-3, rho=rho, max_iterations=50).solve(
            BoundaryContact(condensed())
        )


@pytest.mark.parametrize("law", LAWS)
def test_uzawa_is_certified_in_any_unit(law):
    """B10: every step within the tolerance, of the largest numbers of the run; loads of 1e-170 N/m
    too, whose squares are zero."""
    given = condensed()
    laws = (LAWS[law], vc.Tresca(0.05e-170) if law == "Tresca" else LAWS[law])
    contacts = [
        BoundaryContact(replace(given, u_free=size * given.u_free), friction=one)
        for size, one in zip((1.0, 1e-170), laws, strict=True)
    ]
    runs = [SpaceTimeUzawa(tolerance=1e-8).solve(contact) for contact in contacts]
    assert 0.0 < runs[0].worst < 1e-6 and runs[1].worst < 1e-6 and len(runs[0].certificates) == 30
    assert runs[1].r_n == pytest.approx(1e-170 * runs[0].r_n, rel=1e-6, abs=1e-178)


def test_conditions_and_supports_that_leave_no_contact_are_refused():
    """Three conditions at a node were answered by two; lengths of zero gave a pressure of NaN;
    nothing free, an index error."""
    for nodes, lengths in (([0, 0, 0], [1.0, 1.0, 1.0]), ([0, 1, 2], [1.0, 0.0, 1.0]), ([], [])):
        with pytest.raises(
            InputError, match="one condition or more, at most two at a node, and positive lengths"
        ):
            Conditions(nodes, np.tile([0.0, -1.0], (len(nodes), 1)), lengths)
    held = replace(condensed(), W=0.0 * condensed().W)
    with pytest.raises(
        InputError, match="supports hold all contact nodes|a support holds a contact node"
    ):
        march_contact(BoundaryContact(held))
    with pytest.raises(InputError, match="W has no step"):
        replace(held, W=held.W[:0], u_free=held.u_free[:0])


def test_uzawa_fails_in_words():
    """B10: rho above 2/lambda_max(W[0]) does not converge; slip rates and rho = 0 are refused."""
    contact = BoundaryContact(condensed(), friction=LAWS["Tresca"])
    rho = 2.2 / float(np.linalg.eigvalsh(contact.W[0])[-1])
    with pytest.raises(StepFailure, match="take a fifth of this rho"):
        SpaceTimeUzawa(rho=rho, max_iterations=300).solve(contact)
    for wrong, words in (({"rho": 0.0}, "rho is 0"), ({"window": 0}, "window is 0")):
        with pytest.raises(InputError, match=words):
            SpaceTimeUzawa(**wrong)
    rates = BoundaryContact(condensed(), friction=vc.SlipRateCoulomb(lambda v: 0.1 + 0.0 * v))
    with pytest.raises(InputError, match="slip rate"):
        SpaceTimeUzawa().solve(rates)
    assert away(march_contact(rates), run("weak Coulomb")) < 1e-10  # the march takes them


def test_the_law_is_certified_at_the_rates_of_the_answer():
    """Friction that falls with the slip rate: in every step the limit is that of its own rates. A
    march that took the law at rest would be refused."""
    law = vc.SlipRateCoulomb(vc.ExponentialDecay(mu_s=0.5, mu_k=0.05, v_c=0.02))
    contact = BoundaryContact(condensed(), friction=law)
    found = march_contact(contact)
    rate = np.abs(found.slip) / condensed().dt
    limit = (0.05 + 0.45 * np.exp(-rate / 0.02)) * found.r_n
    force = np.abs(found.r_t).max()
    slides = rate > 1e-6 * rate.max()
    assert np.abs(np.abs(found.r_t) - limit)[slides].max() <= 1e-9 * force
    assert found.worst <= 1e-9 and slides.any()

    class Blind(RateIteration):
        def solve(self, step, rest, mu, solve_given, slip_of):
            return solve_given(mu, None)

    with pytest.raises(StepFailure, match="stayed above the certificate tolerance"):
        march_contact(contact, solver=vc.Condensed(rates=Blind()))


def test_limits_of_the_friction_laws():
    """B10: no threshold is no friction; a large one holds every point; so do bilateral points."""
    for law in (vc.Tresca(0.0), vc.Coulomb(0.0)):
        assert away(march_contact(BoundaryContact(condensed(), friction=law)), run("none")) < 1e-12
    stuck = march_contact(BoundaryContact(condensed(), friction=vc.Tresca(1e6)))
    assert np.abs(stuck.slip).max() < 1e-13 and stuck.gap.max() > 1e-3
    held = march_contact(BoundaryContact(condensed(), friction=vc.Tresca(1e6), bilateral=True))
    assert np.abs(held.displacement).max() < 1e-12 and held.r_n.min() < -0.05


def rod(elements: int, steps: int, *, load: float = 1.0, pulse: float = 99.0) -> BoundaryProblem:
    """A unit square on rollers at its sides, c_P dt = h: plane waves up and down, exact by
    characteristics."""
    mesh = polygon([(0, 0), (1, 0), (1, 1), (0, 1)], 1.0 / elements)
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[0] = mesh.nodes_of(mesh.labels % 2 == 1)
    operator = steklov(mesh, MATERIAL, dt=1.0 / elements, steps=steps)
    return pressed(
        operator,
        pressure=lambda t: load * (t < pulse),
        top=2,
        contact=mesh.labels == 0,
        fixed=fixed,
    )


@pytest.mark.long
def test_impact_with_a_gap():
    """A rod driven by a unit pulse of length 1 crosses a gap of 0.27, rebounds with its speed:
    impulse 2, order 1."""
    error = []
    for elements in (5, 10):
        contact = BoundaryContact(
            rod(elements, 5 * elements, pulse=1.0).condensed(),
            obstacle=vc.AnalyticGap(lambda points: np.full(len(points), 0.27)),
        )
        found = march_contact(contact)
        assert found.gap[0] == pytest.approx(0.27, abs=1e-5) and found.resultant[:, 1].max() < 2.05
        error.append(2.0 - found.impulse[-1, 1])
    assert 0.05 < error[1] < 0.09 and error[1] < 0.6 * error[0]


@pytest.mark.long
def test_two_bodies_that_are_mirror_images():
    """B8: a square pressed on its mirror image feels what it feels on a smooth rigid support,
    whatever the friction."""
    mesh = polygon([(-0.5, -1.5), (0.5, -1.5), (0.5, -0.5), (-0.5, -0.5)], 0.2)
    below = pressed(
        steklov(mesh, MATERIAL, dt=0.2, steps=30),
        pressure=lambda t: 1.0,
        top=0,
        contact=mesh.labels == 2,
    )
    bodies = TwoBodies(square(), below)
    for law in ("none", "Coulomb"):
        found = march_contact(BoundaryContact(bodies.condensed(), friction=LAWS[law]))
        assert away(found, run("none")) < 1e-4  # quadrature knows left from right
    one, two = bodies.solve(found.forces)
    assert one.work == pytest.approx(two.work, rel=1e-4)
    assert (one.forces - square().forces).sum() == pytest.approx(
        -(two.forces - below.forces).sum(), rel=1e-12
    )


@pytest.mark.long
@pytest.mark.promise("theory/bem.md", "Two welded halves move like one square to 1 %")
def test_a_weld_is_no_cut():
    """B8: two halves welded move together at the weld, to round-off, and like one body of their
    height, to O(h²)."""
    corners = [(0, 0), (1, 0), (1, 0.5), (0, 0.5)]
    lower, upper = polygon(corners, 0.1), polygon([(x, y + 0.5) for x, y in corners], 0.1)
    whole = polygon([(0, 0), (1, 0), (1, 1), (0, 1)], 0.1)
    top = pressed(
        steklov(upper, MATERIAL, dt=0.1, steps=20),
        pressure=lambda t: 1.0,
        top=2,
        contact=upper.labels == 0,
    )
    clamped = np.tile(lower.nodes_of(lower.labels == 0), (2, 1))
    base = unloaded(
        steklov(lower, MATERIAL, dt=0.1, steps=20), contact=lower.labels == 2, fixed=clamped
    )
    bodies = TwoBodies(top, base, welded=upper.labels == 0)
    one, two = bodies.solve()
    joint = (
        one.displacement[:, :, top.contact_nodes] - two.displacement[:, :, base.contact_nodes[::-1]]
    )
    assert np.abs(joint).max() < 1e-12 * np.abs(one.displacement).max()
    held = np.tile(whole.nodes_of(whole.labels == 0), (2, 1))
    mono = pressed(
        steklov(whole, MATERIAL, dt=0.1, steps=20),
        pressure=lambda t: 1.0,
        top=2,
        contact=whole.labels == 2,
        fixed=held,
    ).solve()
    here, there = (
        one.displacement[:, :, upper.labels == 2],
        mono.displacement[:, :, whole.labels == 2],
    )
    assert np.abs(here - there).max() < 0.01 * np.abs(there).max()


@pytest.mark.long
def test_part_of_an_interface_is_welded():
    """B8: the right half of the interface welded, the left half in contact: both conditions hold in
    every step."""
    mesh = polygon([(-0.5, -1.5), (0.5, -1.5), (0.5, -0.5), (-0.5, -0.5)], [4, 4, 4, 4])
    above = square_problem(4, MATERIAL, dt=0.25, steps=20)
    below = unloaded(
        steklov(mesh, MATERIAL, dt=0.25, steps=20),
        contact=mesh.labels == 2,
        fixed=np.tile(mesh.nodes_of(mesh.labels == 0), (2, 1)),
    )
    welded = above.contact & (above.operator.mesh.midpoints[:, 0] > 0.0)
    bodies = TwoBodies(above, below, welded=welded)
    found = march_contact(BoundaryContact(bodies.condensed(), friction=vc.Coulomb(0.3)))
    assert found.r_n.shape[1] == 2 and found.worst < 1e-12
    one, two = bodies.solve(found.forces)
    apart = (
        one.displacement[:, :, above.contact_nodes]
        - two.displacement[:, :, below.contact_nodes[::-1]]
    )
    scale = np.abs(one.displacement).max()
    assert np.abs(apart[:, :, 2:]).max() < 1e-12 * scale and apart[:, 1].min() > -1e-12 * scale
    assert apart.transpose(0, 1, 2)[:, :, :2].reshape(20, -1) == pytest.approx(
        found.displacement, abs=1e-12 * scale
    )


def test_bad_input():
    """One sentence that names the thing and the remedy."""
    problem = square()
    for first, words in (
        (np.ones((12, 12)), "not positive definite"),
        (np.tril(np.ones((12, 1)) * np.ones(12)), None),
        (np.ones((12, 1)) * np.arange(1.0, 13.0), "one step is singular"),
    ):
        wrong = BoundaryContact(
            replace(condensed(), W=np.concatenate([first[None], condensed().W[1:]]))
        )
        if words is None:
            assert wrong.matrix.algebra.symmetric is wrong.symmetric is False
            continue
        with pytest.raises(InputError, match=words):
            march_contact(wrong)
    nodes = problem.operator.mesh.nodes_of(problem.contact)
    for fixed, words in (
        (np.stack([0 * nodes, nodes]), "in its contact direction"),
        (None, "penetrates"),
    ):
        held = replace(problem, fixed=None if fixed is None else fixed.astype(bool)).condensed()
        obstacle = vc.HalfSpace(point=(0.0, -0.5 if fixed is not None else -0.4), normal=(0.0, 1.0))
        with pytest.raises(InputError, match=words):
            march_contact(BoundaryContact(held, obstacle=obstacle))
    mesh = problem.operator.mesh
    with pytest.raises(InputError, match="belong to the contact boundary"):
        conditions_on(mesh, condensed(), mesh.labels == 1)
    coarse = square_problem(2, MATERIAL, dt=0.5, steps=2)
    sides = [coarse.operator.mesh.labels == k for k in (0, 1)]
    bent = replace(coarse, contact=sides[0] | sides[1]).condensed()
    with pytest.raises(
        InputError, match=r"turns by 90 degrees at \(0.5, -0.5\): give conditions=conditions_on"
    ):
        BoundaryContact(bent)
    BoundaryContact(bent, conditions=conditions_on(coarse.operator.mesh, bent, *sides))
    BoundaryContact(bent, obstacle=vc.HalfSpace(point=(0.0, -0.5), normal=(0.0, 1.0)))
    moved = polygon(mesh.points[[0, 5, 10, 15]] - [0.05, 1.0], 0.2)
    below = unloaded(
        PoincareSteklov(replace(problem.operator.blocks, mesh=moved), 1.0),
        contact=moved.labels == 2,
    )
    with pytest.raises(InputError, match="no partner on the other body"):
        TwoBodies(problem, below).condensed()
    with pytest.raises(InputError, match="welded"):
        TwoBodies(problem, problem, welded=mesh.labels == 1).condensed()


@pytest.mark.parametrize("law", ["none", "Tresca"])
def test_a_third_opinion(law):
    """compare_runs takes the boundary element run: impulses within 2 % of 20 x 20 finite elements
    although meshes and steps differ; another problem is noticed; a reference in space is
    refused."""
    from mpi4py import MPI

    from demos.parts.problems.square import Square, build

    problem = build(Square(cells=20, pressure=1.0), MPI.COMM_WORLD).problem(friction=LAWS[law])
    references = [Reference.of(run(law)), Reference.of(run("Coulomb"))]
    mine, other = compare_runs(
        problem, references, solver=vc.Condensed(), dt=0.05, steps=100, bound=0.02
    )
    assert 0.0 < mine.impulse < 0.02 and 0.0 < mine.towards < 0.02 and mine.agrees
    assert not other.agrees and other.impulse > 2.0 * mine.impulse
    assert mine.name == "boundary elements"
    in_space = Reference("ball", np.array([0.05]), np.zeros((1, 3)), np.zeros(1))
    with pytest.raises(InputError, match="2 components each"):
        compare_runs(problem, [in_space], solver=vc.Condensed(), dt=0.05, steps=2)


@pytest.mark.long
@pytest.mark.parametrize("law", ["none", "Tresca"])
def test_contact_with_convolution_quadrature(law):
    """The condensed compliance of the other time discretisation serves as well: impulse until t = 4
    within 0.5 %."""
    mesh, loads = square().operator.mesh, square().forces[:20]
    operator = convolution_operator(mesh, MATERIAL, dt=0.2, steps=20)
    problem = BoundaryProblem(operator, loads, contact=square().contact)
    found = march_contact(BoundaryContact(problem.condensed(), friction=LAWS[law]))
    assert found.worst < 1e-12 and found.gap.min() >= 0.0
    assert found.impulse[-1, 1] == pytest.approx(run(law).impulse[19, 1], rel=5e-3)
    assert found.friction_loss[-1] == pytest.approx(run(law).friction_loss[19], abs=5e-3)
