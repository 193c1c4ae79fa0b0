"""Convolution quadrature: weights, table of radial functions, rods and pulses in time, contact,
passivity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from convolution_operator import ConvolutionOperator, convolution_operator
from convolution_quadrature import Frequencies
from laplace_kernels import LaplaceKernels
from plane_waves import MATERIAL, SQUARE, pulse
from radial_table import RadialTable
from scipy.linalg import expm

from demos.parts.problems.contact_ledger import ledger
from vi_contact import LinearElastic, Tresca
from vi_contact.bem import (
    BoundaryProblem,
    Galerkin,
    PoincareSteklov,
    energetic_blocks,
    polygon,
    traction_forces,
)
from vi_contact.bem.contact import BoundaryContact
from vi_contact.bem.contact_run import march_contact
from vi_contact.bem.uzawa_space_time import SpaceTimeUzawa
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial


@pytest.fixture(scope="module")
def operators() -> dict[int, ConvolutionOperator]:
    """Squares of 5 and 10 elements a side, c_P dt = h, six crossings of the square."""
    return {
        k: convolution_operator(polygon(SQUARE, 1.0 / k), MATERIAL, dt=1.0 / k, steps=6 * k)
        for k in (5, 10)
    }


def smooth_load(t: float) -> float:
    return float(np.sin(0.5 * np.pi * t) ** 2) if t < 2.0 else 0.0


def top_of_rod(t: np.ndarray, integral) -> np.ndarray:
    """The load's integral and its echoes from the fixed base."""
    return integral(t) + 2.0 * sum(
        (-1) ** j * integral(t - 2.0 * j) for j in range(1, int(t.max() / 2) + 1)
    )


def smooth_integral(t: np.ndarray) -> np.ndarray:
    return np.where(
        t <= 0.0, 0.0, np.where(t < 2.0, 0.5 * t - np.sin(np.pi * t) / (2.0 * np.pi), 1.0)
    )


def rod(operator: ConvolutionOperator, load) -> BoundaryProblem:
    """The square between rollers on a fixed base, pulled at its top by load(t): a rod with c = 1,
    length 1."""
    mesh = operator.mesh
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[1] = mesh.nodes_of(mesh.labels == 0)
    fixed[0] = mesh.nodes_of(np.isin(mesh.labels, (1, 3)))

    def forces(dt: float, steps: int) -> np.ndarray:
        return traction_forces(
            mesh, lambda x, n, t: n * load(t), dt=dt, steps=steps, elements=mesh.labels == 2
        )

    means = operator.frequencies.substep_means(forces)
    return BoundaryProblem(operator, means, fixed, contact=mesh.labels == 0)


def top_error(operator: ConvolutionOperator, load, integral) -> float:
    motion, mesh = rod(operator, load).solve(), operator.mesh
    exact = top_of_rod(motion.times, integral)[:, None]
    top = motion.displacement[:, 1][:, mesh.nodes_of(mesh.labels == 2)]
    return float(np.sqrt(np.mean((top - exact) ** 2) / np.mean(exact**2)))


@pytest.mark.promise("theory/bem.md", "The method keeps its order 3 in time")
@pytest.mark.promise("theory/bem.md", "With means over whole steps it is of order 2")
def test_weights_of_an_oscillator():
    """C(s) = 1/(s² + 0.6 s + 9) under sin⁴ t against the exact answer: order 3; held g: order 2."""
    w2, damping, end, errors, held = 9.0, 0.6, 4.0, [], []

    def transfer(s):
        return 1.0 / (s**2 + damping * s + w2)

    def means(dt: float, steps: int) -> np.ndarray:
        t = dt * np.arange(steps + 1)
        return np.diff(3.0 * t / 8.0 - np.sin(2.0 * t) / 4.0 + np.sin(4.0 * t) / 32.0) / dt

    for steps in (80, 160):
        dt = end / steps
        exact = oscillator(w2, damping, dt * np.arange(1, steps + 1))
        table = Frequencies(dt, steps)
        weights = table.backward((table.held_factors * transfer(table.s)).sum(axis=1))
        held.append(
            np.abs(np.convolve(weights, means(dt, steps))[:steps] - exact).max()
            / np.abs(exact).max()
        )
        modes = table.s * transfer(table.s) * table.impulses(table.substep_means(means))
        errors.append(np.abs(table.at_ends(modes) - exact).max() / np.abs(exact).max())
    assert errors[1] < 6e-3 and np.log2(errors[0] / errors[1]) > 2.9
    assert held[1] < 6e-3 and np.log2(held[0] / held[1]) > 1.9


def oscillator(w2: float, damping: float, times: np.ndarray) -> np.ndarray:
    """u'' + damping u' + w2 u = sin⁴ t = 3/8 - cos(2t)/2 + cos(4t)/8 at equal steps, by the matrix
    exponential."""
    a = np.zeros((7, 7))  # u, u', 1, cos 2t, sin 2t, cos 4t, sin 4t
    a[0, 1], a[1, :4], a[1, 5] = 1.0, (-w2, -damping, 0.375, -0.5), 0.125
    a[3, 4], a[4, 3], a[5, 6], a[6, 5] = -2.0, 2.0, -4.0, 4.0
    step, state, u = expm(a * times[0]), np.array([0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0]), []
    for _ in times:
        state = step @ state
        u.append(state[0])
    return np.array(u)


@pytest.mark.slow
@pytest.mark.promise("theory/bem.md", "those of the direct quadrature to 1e-11", bound="1e-10")
def test_table_of_radial_functions(operators):
    """The matrices from the table are those of the Galerkin layer at frequencies of the whole
    range."""
    mesh = polygon([(0, 0), (1, 0.1), (0.2, 0.8)], 0.2)
    table, plain = RadialTable(mesh, 0.5, 0.15), Galerkin(mesh, 0.5)
    for s in operators[5].frequencies.s.ravel()[::15]:
        kernels = LaplaceKernels(complex(s), 1.0, 0.5)
        few, exact = table.assemble(kernels), plain.assemble(kernels)
        for which in ("single", "double", "hyper"):
            a, b = getattr(few, which), getattr(exact, which)
            assert np.abs(a - b).max() < 1e-10 * np.abs(b).max(), (s, which)


@pytest.mark.long
def test_rod_under_a_smooth_load(operators):
    """B11: top displacement, 10 elements a side; order from 5 to 10."""
    errors = [top_error(operators[k], smooth_load, smooth_integral) for k in (5, 10)]
    assert errors[1] < 3.4e-3 and np.log2(errors[0] / errors[1]) > 2.4


@pytest.mark.promise(
    "theory/bem.md", "6 times the error with Radau, and overshoots by 6 %", bound="12 %"
)
def test_rod_under_a_step(operators):
    """B11: top displacement, reaction of the base (exactly 0 or 2) and its greatest value; fronts
    smear and ring."""
    operator, mesh = operators[10], operators[10].mesh
    assert top_error(operator, lambda t: 1.0, lambda t: np.maximum(t, 0.0)) < 0.026
    motion = rod(operator, lambda t: 1.0).solve()
    base = -motion.forces[:, 1][:, mesh.nodes_of(mesh.labels == 0)].sum(axis=1)
    middle = motion.times - 0.5 * operator.dt
    exact = np.where((middle > 1.0) & (np.mod(middle - 1.0, 4.0) < 2.0), 2.0, 0.0)
    assert np.linalg.norm(base - exact) < 0.25 * np.linalg.norm(exact) and base.max() < 2.25
    elements = mesh.labels == 0
    by_traction = -(motion.traction[:, 1, elements].mean(axis=2) * mesh.lengths[elements]).sum(
        axis=1
    )
    assert np.abs(by_traction - base).max() < 0.225
    # exactly 2; numerical damping takes up to 7 %
    assert motion.work.min() > 0.0 and 1.8 < motion.work[19] < 2.02


@pytest.mark.long
def test_small_steps_stay_bounded():
    """B11: the rod (top exactly 1 at most) with |s| h/c_S up to 100; fewer points on touching
    elements give 250."""
    operator = convolution_operator(polygon(SQUARE, 0.5), MATERIAL, dt=0.05, steps=180)
    motion = rod(operator, smooth_load).solve()
    assert np.abs(motion.displacement[motion.times > 6.0, 1]).max() < 1.25


@pytest.mark.parametrize("shear", [False, True])
def test_plane_pulses(operators, shear):
    """B11: displacement of the whole boundary under the tractions of an oblique pulse, T = 4."""
    wave, errors = pulse(shear=shear), []
    for k in (5, 10):
        operator = operators[k]
        forces = traction_forces(
            operator.mesh, wave.traction, dt=operator.dt, steps=operator.frequencies.steps
        )
        exact = np.array(
            [wave.displacement(operator.mesh.points, operator.dt * (j + 1)).T for j in range(4 * k)]
        )
        found = BoundaryProblem(operator, forces).solve().displacement[: 4 * k]
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[1] < 0.03 and np.log2(errors[0] / errors[1]) > 2.0


@pytest.mark.long
@pytest.mark.promise("theory/bem.md", "Radau differ by 4.7e-3 at k = 10", bound="5e-3")
def test_energetic_and_convolution_agree(operators):
    """B11: top of the rod under the smooth load, Radau against energetic, 10 elements a side."""
    problem = rod(operators[10], smooth_load)
    blocks = energetic_blocks(problem.operator.mesh, MATERIAL, dt=0.1, steps=40)
    means = np.tensordot([1.0 / 3.0, 2.0 / 3.0], problem.forces, (0, 1))[:40]
    energetic = BoundaryProblem(PoincareSteklov(blocks, 1.0), means, problem.fixed).solve()
    difference = energetic.displacement - problem.solve().displacement[:40]
    assert np.linalg.norm(difference) < 5e-3 * np.linalg.norm(energetic.displacement)


@pytest.mark.promise("theory/bem.md", "wraps around the circle is 1.5e-8", bound="1e-6")
def test_compliance_is_the_inverse_seen_from_the_contact(operators):
    """u_c = W * lam + u_free is what solve() gives, to what wraps around; supported unknowns zero;
    W_0 symmetric."""
    problem = rod(operators[5], smooth_load)
    lam = np.random.default_rng(1).standard_normal(problem.condensed().u_free.shape)
    for fixed in (problem.fixed, None):
        case = replace(problem, fixed=fixed)
        compliance = case.condensed()
        direct = case.solve(lam).displacement[:, :, compliance.nodes].reshape(len(lam), -1)
        assert np.abs(compliance.displacement(lam) - direct).max() < 1e-6 * np.abs(direct).max()
    assert np.abs(compliance.W[0] - compliance.W[0].T).max() < 1e-12
    values = np.linalg.eigvalsh(compliance.W[0])
    assert values[0] > 0.9 and values[-1] < 5.5


def test_work_of_contact_forces_is_never_negative(operators):
    """B11: forces held in each step and the displacement increments: their work is a positive
    quadratic form."""
    w = replace(rod(operators[5], smooth_load), fixed=None).condensed().W[:20]
    increments = np.diff(w, axis=0, prepend=0.0)
    size = w.shape[1]
    form = np.zeros((20 * size, 20 * size))
    for k in range(20):
        for step in range(k + 1):
            form[k * size : (k + 1) * size, step * size : (step + 1) * size] = increments[k - step]
    values = np.linalg.eigvalsh(0.5 * (form + form.T))
    assert values[0] > -1e-8 * values[-1]


def test_contact_runs_on_it(operators):
    """V7.1: the pressed square with Tresca's friction: no penetration, impulse at t = 4 (4.6737
    energetic); Uzawa."""
    operator, mesh = operators[10], operators[10].mesh
    forces = traction_forces(mesh, lambda x, n, t: -n, dt=0.1, steps=60, elements=mesh.labels == 2)
    problem = BoundaryProblem(operator, forces, contact=mesh.labels == 0)
    contact = BoundaryContact(problem.condensed(), friction=Tresca(0.05))
    run = march_contact(contact)
    assert run.impulse[39, 1] == pytest.approx(4.6737, rel=1.2e-3) and run.gap.min() > -1e-12
    assert (np.abs(run.shear) <= 0.05 * (1.0 + 1e-9)).all() and run.friction_loss[-1] > 0.04
    motion = problem.solve(run.forces)
    on_contact = motion.displacement[:, :, contact.compliance.nodes].reshape(60, -1)
    assert np.abs(on_contact - run.displacement).max() < 1e-6 * np.abs(on_contact).max()
    work = ledger(run, motion, forces)
    assert work.defect < 1e-6 and work.energy.min() > 0.0
    assert np.abs(SpaceTimeUzawa().solve(contact).r_n - run.r_n).max() < 1e-6 * run.r_n.max()


def test_prescribed_motion(operators):
    """The top of the rod moved as it moved under its load: all else moves as before, to second
    order in the step, for prescribed unknowns move evenly during each step; the reactions there are
    the load."""
    errors, forces = [], []
    for operator in operators.values():
        loaded, mesh = rod(operator, smooth_load), operator.mesh
        motion, fixed = loaded.solve(), loaded.fixed.copy()
        fixed[1] |= mesh.nodes_of(mesh.labels == 2)
        still = np.zeros_like(loaded.forces)
        moved = replace(loaded, forces=still, fixed=fixed, prescribed=motion.displacement).solve()
        errors.append(
            np.linalg.norm(moved.displacement - motion.displacement)
            / np.linalg.norm(motion.displacement)
        )
        forces.append(np.linalg.norm(moved.forces - motion.forces) / np.linalg.norm(motion.forces))
    assert errors[1] < 5e-3 and np.log2(errors[0] / errors[1]) > 1.7
    assert forces[1] < 1.6e-2 and np.log2(forces[0] / forces[1]) > 1.3


@pytest.mark.long
def test_density_and_the_unsymmetric_form(operators):
    """Twice the density at the same speeds halves the compliance; the unsymmetric form converges to
    the same rod."""
    mesh = operators[5].mesh
    heavy = LinearElastic.from_wave_speeds(1.0, 0.5, 2.0)
    light, twice = (
        rod(convolution_operator(mesh, material, dt=0.2, steps=8), smooth_load).condensed()
        for material in (MATERIAL, heavy)
    )
    assert np.allclose(2.0 * twice.W, light.W)
    other = convolution_operator(polygon(SQUARE, 0.2), MATERIAL, dt=0.2, steps=30, symmetric=False)
    assert top_error(other, smooth_load, smooth_integral) < 0.04


def test_errors(operators):
    """One sentence each, naming the thing and the remedy."""
    operator = operators[5]
    n, steps = len(operator.mesh), operator.frequencies.steps
    forces = np.zeros((steps, 2, n))
    with pytest.raises(InputError, match="above zero"):
        Frequencies(-1.0, 3)
    for count in (0, 2.5):
        with pytest.raises(InputError, match="at least 1"):
            Frequencies(0.1, count)
    for dt, remedy in ((1e-3, "enlarge"), (10.0, "reduce")):
        with pytest.raises(InputError, match=remedy):
            convolution_operator(operator.mesh, MATERIAL, dt=dt, steps=3)
    with pytest.raises(InputError, match="forces has shape"):
        BoundaryProblem(operator, forces[1:])
    with pytest.raises(InputError, match="prescribed has shape"):
        BoundaryProblem(operator, forces, prescribed=forces[1:])
    for wrong in ("clamped", np.zeros((2, n)), np.arange(n)):
        with pytest.raises(InputError, match="fixed .* give a boolean mask"):
            BoundaryProblem(operator, forces, fixed=wrong)
    with pytest.raises(InputError, match="contact .* give a boolean mask"):
        BoundaryProblem(operator, forces, contact=np.array([1, 2]))
    with pytest.raises(InputError, match="contact is empty"):
        BoundaryProblem(operator, forces).condensed()
