"""Local minima of energies that are not convex, between bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from dolfinx import fem, mesh
from own_forms import clamped, space, square

from vi_contact import StepFailure, vi


def double_well(u: Any, width: float, load: float = 0.0) -> Any:
    """An energy with wells at u = 1 and u = -1, and a hill at 0 between them."""
    bend = 0.5 * width**2 * ufl.inner(ufl.grad(u), ufl.grad(u))
    return (bend + 0.25 * (u**2 - 1.0) ** 2 - load * u) * ufl.dx


def owned(f: Any) -> Any:
    V = f.function_space
    return f.x.array[: V.dofmap.index_map_bs * V.dofmap.index_map.size_local]


@pytest.mark.parametrize("element", [("Lagrange", 1), ("Lagrange", 2)], ids=["P1", "P2"])
@pytest.mark.parametrize("width", [0.03, 0.5])
def test_from_the_top_of_the_hill(comm: Any, width: float, element: tuple[str, int]) -> None:
    """u = 0 satisfies every first-order condition where nothing loads it, and is no minimum: the
    answer is a well."""
    for n in (6, 12):
        u = fem.Function(space(square(comm, n), element))
        result = vi.solve(energy=double_well(u, width), u=u)
        assert result.certificate.worst <= 1e-9 and result.iterations <= 30
        assert "at a local minimum" in result.reason
        side = np.sign(comm.allreduce(float(np.sum(owned(u)))))
        assert abs(side) == 1.0 and np.max(np.abs(u.x.array - side)) <= 1e-8


@pytest.mark.two_ranks
def test_a_load_and_bounds_choose_the_well(comm: Any) -> None:
    """The load pushes u from 0 to the bound 0.9, below the well at 1: all nodes lie on it, and the
    multiplier is the force that is left, 0.9 - 0.9³ + load a unit of area."""
    for load, bounds in ((0.05, (-0.8, 0.9)), (-0.05, (-0.9, 0.8))):
        u = fem.Function(space(square(comm, 8), ("Lagrange", 1)))
        result = vi.solve(energy=double_well(u, 0.1, load), u=u, lower=bounds[0], upper=bounds[1])
        assert np.all(u.x.array == np.sign(load) * 0.9) and sum(result.active) == 81
        push = result.lambda_upper if load > 0.0 else result.lambda_lower
        force = comm.allreduce(float(np.sum(owned(push))))
        assert force == pytest.approx(0.9 - 0.9**3 + 0.05, rel=1e-12)


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [1, 3])
def test_a_wall_between_two_wells(comm: Any, d: int) -> None:
    """Held at -1 and 1 at its ends, u is tanh(x / (√2 width)) between them, whatever it begins
    from."""
    n, width = (64, 0.15) if d == 1 else (8, 0.2)
    on = (
        mesh.create_interval(comm, n, [-0.5, 0.5])
        if d == 1
        else mesh.create_box(comm, [[-0.5, 0.0, 0.0], [0.5, 0.25, 0.25]], [n, 2, 2])
    )
    V = space(on, ("Lagrange", 2))
    sides = mesh.locate_entities_boundary(on, d - 1, lambda x: np.isclose(np.abs(x[0]), 0.5))
    dofs = fem.locate_dofs_topological(V, d - 1, sides)
    exact = fem.Function(V)
    exact.interpolate(lambda x: np.tanh(x[0] / (np.sqrt(2.0) * width)))
    for guess in (lambda x: 0.0 * x[0], lambda x: x[0], lambda x: 0.3 * np.cos(5.0 * x[0])):
        u = fem.Function(V)
        u.interpolate(guess)
        energy = double_well(u, width)
        result = vi.solve(
            energy=energy, u=u, lower=-1.0, upper=1.0, bcs=[fem.dirichletbc(exact, dofs)]
        )
        assert result.certificate.worst <= 1e-9
        assert np.max(np.abs(u.x.array - exact.x.array)) <= 0.01


@pytest.mark.long
def test_a_convex_energy_has_the_answer_of_its_form(comm: Any) -> None:
    """The membrane over a step: F and the energy, one answer and one set of multipliers."""
    V = space(square(comm, 12), ("Lagrange", 1))
    u, w, v = fem.Function(V), fem.Function(V), ufl.TestFunction(V)
    energy = 0.5 * ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx + 2.0 * u * ufl.dx
    by_energy = vi.solve(energy=energy, u=u, lower=-0.03, bcs=[clamped(V)])
    F = ufl.inner(ufl.grad(w), ufl.grad(v)) * ufl.dx + 2.0 * v * ufl.dx
    by_form = vi.solve(F, w, lower=-0.03, bcs=[clamped(V)])
    assert by_energy.active == by_form.active and by_form.active[0] > 10
    assert np.max(np.abs(u.x.array - w.x.array)) <= 1e-10 * 0.03
    assert np.max(np.abs(owned(by_energy.lambda_lower) - owned(by_form.lambda_lower))) <= 1e-9


@pytest.mark.two_ranks
@pytest.mark.parametrize(("unit", "force"), [(1e-9, 1e6), (1e7, 1e-5)])
def test_units_change_nothing(comm: Any, unit: float, force: float) -> None:
    """Lengths and forces in other units: the same steps."""
    found = []
    # one mesh: a graph partition may cut an equal one in another way
    V = space(square(comm, 8), ("Lagrange", 1))
    for length, strength in ((1.0, 1.0), (unit, force)):
        u = fem.Function(V)
        w = u / length
        u.interpolate(lambda x, length=length: length * 0.9 * np.sin(7.0 * x[0] + 3.0 * x[1]))
        bend = 0.005 * ufl.inner(ufl.grad(w), ufl.grad(w))
        energy = strength * length * (bend + 0.25 * (w**2 - 1.0) ** 2 - 0.05 * w) * ufl.dx
        result = vi.solve(energy=energy, u=u, lower=-0.8 * length, upper=0.9 * length)
        found.append((u.x.array / length, result.active))
    assert found[0][1] == found[1][1]
    assert np.max(np.abs(found[0][0] - found[1][0])) <= 1e-8


@pytest.mark.two_ranks
def test_energies_that_are_no_numbers_shorten_the_step(comm: Any) -> None:
    """-ln u + u, with its minimum at 1, from near the edge of where it is a number, without
    bounds."""
    u = fem.Function(space(square(comm, 4), ("Lagrange", 1)))
    u.x.array[:] = 20.0
    result = vi.solve(energy=(u - ufl.ln(u)) * ufl.dx, u=u)
    assert result.certificate.worst <= 1e-9 and np.max(np.abs(u.x.array - 1.0)) <= 1e-7


def test_failures_are_one_sentence(comm: Any) -> None:
    """An energy without a minimum; one that is no number at the first guess; too few steps."""
    V = space(square(comm, 4), ("Lagrange", 1))
    for energy, words in (
        (lambda u: -(u**2) * ufl.dx + u * ufl.dx, "bounded below"),
        (
            lambda u: ufl.ln(u - 1.0) * ufl.dx,
            "not a number there: check the energy and the first guess",
        ),
    ):
        u = fem.Function(V)
        with pytest.raises(StepFailure, match=words) as failure:
            vi.solve(energy=energy(u), u=u)
        assert "\n" not in str(failure.value)
    u = fem.Function(V)
    u.interpolate(lambda x: 0.9 * np.sin(7.0 * x[0] + 3.0 * x[1]))
    with pytest.raises(StepFailure, match="after 1 steps downhill.*more iterations"):
        vi.solve(energy=double_well(u, 0.1), u=u, iterations=1)


def test_a_form_that_is_not_positive_offers_the_energy(
    comm: Any, caplog: pytest.LogCaptureFixture
) -> None:
    """Newton's method for F goes to the hill between the wells, where it is not far. A failure
    offers energy=, an answer is told to be no minimum, and energy= finds one."""
    u = fem.Function(space(square(comm, 8), ("Lagrange", 1)))
    energy = double_well(u, 0.1, 0.05)
    F = ufl.derivative(energy, u)

    def begin() -> None:
        u.interpolate(lambda x: 0.2 * np.sin(40.0 * x[0] * x[1]))

    begin()
    with pytest.raises(
        StepFailure, match=r"the Jacobian of F is not positive.*as energy= in the place of F"
    ):
        vi.solve(F, u, iterations=1)
    begin()
    hill = vi.solve(F, u)
    assert hill.certificate.worst <= 1e-9 and np.max(np.abs(u.x.array)) < 0.1
    assert "no minimum" in hill.reason and (comm.rank or "no minimum" in caplog.text)
    begin()
    well = vi.solve(energy=energy, u=u)
    assert well.certificate.worst <= 1e-9 and "at a local minimum" in well.reason
    assert np.min(np.abs(u.x.array)) > 0.9
