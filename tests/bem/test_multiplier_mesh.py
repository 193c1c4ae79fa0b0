"""The contact multiplier on its own mesh: the pairing, what is tested, plane waves, inf-sup
constants, the weight."""

from __future__ import annotations

import sys
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from pictures import is_drawn

import vi_contact as vc
from demos.parts.problems.boundary_elements import pressed, square_problem, steklov
from demos.parts.problems.inf_sup import space_constant, time_constant
from vi_contact.bem import (
    BoundaryContact,
    BoundaryProblem,
    CondensedCompliance,
    MultiplierMesh,
    SpaceTimeUzawa,
    circle,
    march_contact,
    polygon,
)
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
MATERIAL = vc.LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
ROOT = Path(__file__).parents[2]
SIDES = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
K, STEPS = 6, 24  # elements a side; steps of h/c_P, until t = 4
LAWS = {"none": vc.Frictionless(), "Tresca": vc.Tresca(0.05), "Coulomb": vc.Coulomb(0.1)}


@cache
def square() -> BoundaryProblem:
    return square_problem(K, MATERIAL, dt=1.0 / K, steps=STEPS)


@cache
def condensed():
    return square().condensed()


def own(**choice) -> MultiplierMesh:
    """Patches on the bottom of the square."""
    return MultiplierMesh(
        **{
            "mesh": square().operator.mesh,
            "elements": square().contact,
            "compliance": condensed(),
            **choice,
        }
    )


@pytest.mark.long
@pytest.mark.parametrize("degree", [0, 1])
def test_the_pairing(degree):
    """B15: B R are the nodal forces of lambda: they do its work on linear displacements, exactly;
    Bᵀ u are means."""
    mesh = square().operator.mesh
    patches = own(patch=4, degree=degree)  # 6 elements: one patch of six
    assert [len(patch) for patch in patches.patches] == [6] and [
        len(p) for p in own(patch=2).patches
    ] == [2, 2, 2]
    x, coarse = condensed().points[:, 0], patches.condensed()
    lam = np.array([3.0, 5.0])[: degree + 1]  # at the left and at the right end
    forces = patches.pairing @ (lam * coarse.lengths)
    work = 4.0 * 1.0 + 2.0 / 12.0 if degree else 3.0  # ∫ (4 + 2 x)(1 + x), or of 3
    assert forces @ (1.0 + x) == pytest.approx(
        work, rel=1e-14
    ) and coarse.lengths.sum() == pytest.approx(1.0)
    assert coarse.points[:, 0] == pytest.approx([[0.0], [-1.0 / 6.0, 1.0 / 6.0]][degree], abs=1e-15)
    assert np.array_equal(patches.pairing.shape, (len(x), degree + 1)) and mesh.labels.max() == 3


def test_patches_end_at_corners_and_close_circles():
    """B15: three sides are three runs, a whole circle is one; the normals are those of the sides,
    the mean ones."""
    problem = square_problem(4, MATERIAL, dt=0.25, steps=2)
    mesh, sides = problem.operator.mesh, problem.operator.mesh.labels != 2
    problem = BoundaryProblem(problem.operator, problem.forces, contact=sides)
    patches = MultiplierMesh(mesh, sides, problem.condensed(), patch=2, interval=1)
    runs = [mesh.labels[patch] for patch in patches.patches]
    assert sorted(int(run[0]) for run in runs) == [0, 0, 1, 1, 3, 3] and all(
        len(set(run)) == 1 for run in runs
    )
    normals = patches.condensed().normals
    assert normals == pytest.approx(
        mesh.normals[[patch[0] for patch in patches.patches]], abs=1e-15
    )
    ring, whole = circle(1.0, 40), np.ones(40, bool)
    disk = nothing(ring, whole, steps=2)
    around = MultiplierMesh(ring, whole, disk, patch=3, interval=2)
    assert [len(patch) for patch in around.patches] == [4, *[3] * 12]
    assert np.concatenate(around.patches).tolist() == list(range(40))
    assert np.hypot(*around.condensed().normals.T) == pytest.approx(np.ones(13), abs=1e-15)


def nothing(mesh, elements, *, steps: int) -> CondensedCompliance:
    """The compliance of a body that does not move."""
    m = len(nodes := np.flatnonzero(mesh.nodes_of(elements)))
    return CondensedCompliance(
        np.zeros((steps, 2 * m, 2 * m)),
        np.zeros((steps, 2 * m)),
        nodes,
        mesh.points[nodes],
        mesh.node_normals(elements)[nodes],
        mesh.node_lengths(elements)[nodes],
        1.0,
    )


def test_a_mean_normal_stands_for_30_degrees():
    """B15: patches of a circle under a pressure 1 that presses it outwards. A patch that turns more
    is refused: in half a circle the mean normal misses more than half of the pressure; two elements
    of 16, 22.5 degrees, miss 4 %."""
    ring, whole, steps = circle(1.0, 16), np.ones(16, bool), 2
    loads = np.tile(ring.node_normals(whole).T, (steps, 1, 1))
    disk = BoundaryProblem(
        steklov(ring, MATERIAL, dt=0.4, steps=steps), loads, contact=whole
    ).condensed()
    around = MultiplierMesh(ring, whole, disk, patch=2, interval=1)
    pressed_on = march_contact(BoundaryContact(around.condensed())).r_n.sum(axis=1)
    assert pressed_on == pytest.approx(np.full(steps, 16.0), rel=0.12)
    for patch, turn in ((3, "67.5"), (8, "15[78]"), (16, "180")):
        with pytest.raises(
            InputError,
            match=f"one turns by {turn} degrees, more than 30, under one mean normal; give",
        ):
            MultiplierMesh(ring, whole, disk, patch=patch, interval=1)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    "choice", [(1, 1, 0, "end"), (2, 2, 0, "end"), (3, 4, 1, "end"), (2, 3, 0, "mean")]
)
def test_the_second_line_holds_in_the_body(law, choice):
    """B15: the displacements of the body under B lambda, from the whole boundary, satisfy what is
    tested: means over patches, ends or means of intervals, increments of tangents; every interval
    is certified."""
    patch, interval, degree, testing = choice
    patches = own(patch=patch, interval=interval, degree=degree, testing=testing)
    run = march_contact(BoundaryContact(patches.condensed(), friction=LAWS[law]))
    assert run.worst < 1e-12 and run.r_n.max() > 0.1
    u = (
        square().solve(patches.forces(run.forces)).displacement[:, :, condensed().nodes]
        @ patches.pairing
    )
    history = np.concatenate([np.zeros_like(u[:1]), u])
    size, pushed = np.abs(u).max(), run.r_n / run.r_n.max()
    ends = history[interval::interval]
    normal = ends[:, 1]
    if testing == "mean":  # trapezoidal rule, exact for what is linear in each step
        inner = 0.5 * (history[:-1] + history[1:])[:, 1]
        normal = inner.reshape(-1, interval, inner.shape[1]).mean(axis=1)
    order = np.argsort(run.contact.surface.points[:, 0])
    assert order.tolist() == list(range(len(order)))
    assert normal.min() > -1e-11 * size and np.abs(normal * pushed).max() < 1e-11 * size
    slip = np.diff(ends[:, 0], axis=0, prepend=0.0)
    assert np.abs(slip - run.slip).max() < 1e-11 * size if law != "none" else not run.r_t.any()
    dissipated = (run.r_t * run.slip).sum()
    assert (dissipated > 1e-3 * run.r_n.max() * size) == (law != "none")


def test_uzawa_solves_it_too():
    """B15: the algorithm of the source on its own mesh of the multiplier ends where the march
    does."""
    contact = BoundaryContact(own(patch=2, interval=2).condensed(), friction=LAWS["Tresca"])
    found, march = SpaceTimeUzawa(tolerance=1e-10).solve(contact), march_contact(contact)
    assert np.abs(found.forces - march.forces).max() < 1e-7 * np.abs(march.forces).max()


@cache
def rod() -> BoundaryProblem:
    """A rod of length 1 between rollers under the pressure 1: the force on its base is 2 from t = 1
    to t = 3."""
    mesh = polygon([(0, 0), (0.5, 0), (0.5, 1), (0, 1)], 0.125)
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[0] = mesh.nodes_of(mesh.labels % 2 == 1)
    operator = steklov(mesh, MATERIAL, dt=0.125, steps=24)
    return pressed(operator, pressure=lambda t: 1.0, top=2, contact=mesh.labels == 0, fixed=fixed)


def base_force(**choice) -> np.ndarray:
    """Pressure on the base of the rod in intervals of 3 steps, the front coming after two thirds of
    the third."""
    patches = MultiplierMesh(
        rod().operator.mesh, rod().contact, rod().condensed(), patch=2, interval=3, **choice
    )
    run = march_contact(BoundaryContact(patches.condensed()))
    return np.asarray(run.resultant[:, 1] / 0.5)


@pytest.mark.long
def test_a_front_inside_of_an_interval():
    """B15: with x = 1/3 of an interval behind the front, exactly: tested at the end lambda is 2 x
    there and then 2; in the mean 2 x², and then 2 (1 +- 2 x (1 - x)) in turn, undamped, although
    its inf-sup constants are good. The last interval has the echo of what was wrong in that of the
    front."""
    end, mean, x = base_force()[:7], base_force(testing="mean")[:7], 1.0 / 3.0
    assert end == pytest.approx([0.0, 0.0, 2.0 * x, 2.0, 2.0, 2.0, 2.0], abs=0.05)
    swing = 4.0 * x * (1.0 - x)
    exact = [0.0, 0.0, 2.0 * x**2, 2.0 + swing, 2.0 - swing, 2.0 + swing, 2.0 - swing]
    assert mean == pytest.approx(exact, abs=0.3 * swing)  # the front is a step wide


@pytest.mark.promise("theory/bem.md", "gives the plain mean digit for digit")
def test_the_weight():
    """B15: sigma = 0 are the means, digit for digit; the answer moves by O(sigma DT); with the
    weight the swing of the rod grows by (1 - theta)/theta an interval, theta the weighted middle,
    which is less than exp(2 sigma DT)."""
    patches = own(patch=2, interval=4, testing="mean", sigma=0.0)
    assert (
        patches.weights[0].tolist() == [0.125, 0.25, 0.25, 0.25, 0.125]
        and patches.weights[1].tolist() == [1.0] * 4
    )
    start = own(patch=2, interval=4, testing="mean", sigma=1e4).weights[0]
    # a great one tests the start of intervals
    assert start[0] > 0.999 and start.sum() == pytest.approx(1.0, abs=1e-15)
    means = march_contact(BoundaryContact(patches.condensed())).r_n
    moved = []
    for sigma in (0.04, 0.02, 0.01):  # DT = 2/3
        other = own(patch=2, interval=4, testing="mean", sigma=sigma)
        assert (
            other.weights[0].sum() == pytest.approx(1.0, abs=1e-15)
            and (np.diff(other.weights[1]) < 0.0).all()
        )
        moved.append(
            np.abs(march_contact(BoundaryContact(other.condensed())).r_n - means).max()
            / means.max()
        )
    assert moved[:2] == pytest.approx([2.0 * moved[1], 2.0 * moved[2]], rel=0.1) and moved[0] < 0.1
    swing, grown = (
        base_force(testing="mean")[3:7] - 2.0,
        base_force(testing="mean", sigma=0.3)[3:7] - 2.0,
    )
    z = 2.0 * 0.3 * 0.375
    theta = 1.0 / z - 1.0 / np.expm1(z)
    growth = (grown[1:] / grown[:-1]) / (swing[1:] / swing[:-1])
    assert growth == pytest.approx(np.full(3, (1.0 - theta) / theta), rel=0.02)
    assert 1.05 < growth[0] < np.exp(z)


def test_a_weight_that_lets_the_means_swing_without_bounds_is_refused():
    """The resultant was a thousand times that of the load, without a word."""
    for sigma in (1e3, 1e6):
        with pytest.raises(
            InputError, match="the means swing .* times as far in each of 6 intervals; reduce sigma"
        ):
            own(patch=2, interval=4, testing="mean", sigma=sigma).condensed()


def test_inf_sup_constants():
    """B15: with H = h and, for means, DT = dt the constants vanish with the mesh: zig-zags of
    lambda are not seen. With patches of two elements and intervals of two steps they stay,
    sqrt(3)/2 in time; linear lambda takes four."""
    meshes = [polygon(SIDES, 1.0 / k) for k in (4, 12)]
    one, two, linear, three = (
        np.array([space_constant(mesh, mesh.labels == 0, patch, degree) for mesh in meshes])
        for patch, degree in ((1, 0), (2, 0), (2, 1), (4, 1))
    )
    assert one[1] < 0.5 * one[0] and linear[1] < 0.6 * linear[0]
    assert two.min() > 0.85 and three.min() > 0.8
    steps = [time_constant(n, 1, "mean") for n in (24, 48)]
    assert steps[1] == pytest.approx(0.5 * steps[0], rel=0.05)
    assert (
        time_constant(48, 2, "mean") == pytest.approx(np.sqrt(0.75), rel=1e-3)
        and time_constant(48, 1, "end") == 1.0
    )


def test_an_obstacle_that_moves():
    """B15: the mean of a motion over an interval: of a constant speed the place at its middle; at
    the end the place."""
    middle, end = (
        own(interval=3, testing="mean").averaged(lambda t: 2.0 * t),
        own(interval=3).averaged(lambda t: t**2),
    )
    assert middle(1.0) == pytest.approx(2.0 * (1.0 - 1.5 / K), rel=1e-14) and end(0.7) == 0.7**2


@pytest.mark.long
def test_the_benchmark(tmp_path):
    """benchmarks/bem_multiplier.py, small: means swing where ends do not, the constants are good in
    both; H = h takes Uzawa's method more iterations; its picture."""
    spec = spec_from_file_location("bem_multiplier", ROOT / "benchmarks" / "bem_multiplier.py")
    assert spec and spec.loader
    # its dataclasses look for their module
    benchmark = sys.modules["bem_multiplier"] = module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    square, fine = benchmark.Square(6), benchmark.Square(8).finest("none")
    end, mean, thin, both = (
        square.row("none", fine, patch=patch, interval=interval, testing=testing)
        for patch, interval, testing in (
            (2, 2, "end"),
            (2, 2, "mean"),
            (1, 1, "end"),
            (4, 4, "mean"),
        )
    )
    assert (
        mean["oscillation"] > 3.0 * end["oscillation"]
        and mean["energy_error"] > 5.0 * end["energy_error"]
    )
    assert min(end["inf_sup"], mean["inf_sup"]) > 0.75 and thin["inf_sup"] < 0.5
    assert (
        thin["uzawa"] > 1.3 * end["uzawa"]
        and set(benchmark.KEYS) <= set(thin)
        and end["impulse_error"] < 0.03
    )
    drawn = benchmark.plot_multiplier([end, mean, thin, both], tmp_path / "ratio.png")
    assert is_drawn(drawn)


def test_bad_input():
    for wrong, words in (
        ({"patch": 7}, "a side has 6 elements"),
        ({"interval": 5}, "5 does not divide"),
        ({"sigma": 1.0}, "sigma is for means"),
        ({"sigma": 1e300, "testing": "mean"}, "gives ends of steps no weight"),
        ({"mesh": polygon(2.0 * np.array(SIDES), 2.0 / K)}, "other nodes than mesh"),
        ({"mesh": polygon(SIDES, 1.0), "elements": np.ones(4, bool)}, "other nodes than mesh"),
    ):
        with pytest.raises(InputError, match=words):
            own(**wrong)
    mesh = square().operator.mesh
    with pytest.raises(InputError, match="all their nodes in the compliance"):
        MultiplierMesh(mesh, mesh.labels == 1, condensed())
    with pytest.raises(InputError, match="not positive definite"):
        # more multipliers than nodes
        march_contact(BoundaryContact(own(patch=1, degree=1).condensed()))
