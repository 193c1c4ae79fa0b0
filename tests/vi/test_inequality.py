"""Bounds on any field: known answers for scalar and vector Functions, linear, symmetric or not;
units; failures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from dolfinx import fem, mesh
from own_forms import Known, clamped, space, square

from vi_contact import StepFailure, vi
from vi_contact.solvers import ReducedNewton, SemismoothNewton, TaoTron

METHODS = (TaoTron(), ReducedNewton(), SemismoothNewton())
name_of = lambda method: type(method).__name__  # noqa: E731


def laplace(u: Any, v: Any) -> Any:
    return ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx


def convection(u: Any, v: Any) -> Any:
    return laplace(u, v) + 5.0 * (u.dx(0) + 2.0 * u.dx(1)) * v * ufl.dx


def elastic(u: Any, v: Any) -> Any:
    def strain(w: Any) -> Any:
        return ufl.sym(ufl.grad(w))

    return (2.0 * ufl.inner(strain(u), strain(v)) + ufl.div(u) * ufl.div(v)) * ufl.dx


def conducting(u: Any, v: Any) -> Any:
    """Not linear, and its Jacobian is not symmetric."""
    return (1.0 + 4.0 * u**2) * ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx


def film(u: Any, v: Any) -> Any:
    """A soap film: the derivative of its area."""
    return (
        ufl.inner(ufl.grad(u), ufl.grad(v))
        / ufl.sqrt(1.0 + ufl.inner(ufl.grad(u), ufl.grad(u)))
        * ufl.dx
    )


def owned(f: Any) -> Any:
    """Values of the unknowns that this rank owns."""
    V = f.function_space
    return f.x.array[: V.dofmap.index_map_bs * V.dofmap.index_map.size_local]


@pytest.mark.parametrize("method", METHODS, ids=name_of)
def test_a_linear_problem_on_every_route(comm: Any, method: Any) -> None:
    known = Known(space(square(comm, 12), ("Lagrange", 1)), laplace)
    result = vi.solve(
        known.linear, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc], method=method
    )
    known.check(result, error=1e-11)
    assert result.method == name_of(method) and result.iterations == 1 and result.u is known.u


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("element", "cell", "width", "form"),
    [
        (("Lagrange", 2), "quadrilateral", 1, laplace),
        (("Lagrange", 1), "triangle", 2, elastic),
        (("Lagrange", 1), "triangle", 1, convection),
    ],
    ids=["Q2", "elastic", "convection"],
)
def test_other_elements_and_forms(
    comm: Any, element: Any, cell: str, width: int, form: Any
) -> None:
    """A linear F(u; v): recognised as such. On Q2 all ∫phi_i > 0; with convection nothing is
    minimised."""
    known = Known(space(square(comm, 10, cell), element, width), form)
    result = vi.solve(known.F, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc])
    known.check(result, error=1e-11)
    assert result.iterations == 1 and result.method == (
        "ReducedNewton" if form is convection else "TaoTron"
    )


@pytest.mark.two_ranks
def test_convection_by_the_semismooth_method(comm: Any) -> None:
    known = Known(space(square(comm, 10), ("Lagrange", 1)), convection)
    result = vi.solve(
        known.linear,
        known.u,
        lower=known.lower,
        upper=known.upper,
        bcs=[known.bc],
        method=SemismoothNewton(),
    )
    known.check(result, error=1e-10)


@pytest.mark.parametrize("method", METHODS, ids=name_of)
@pytest.mark.promise("guide/bounds.md", "each is at most 1e-9")
def test_no_load_but_what_rounding_leaves_of_it(comm: Any, method: Any) -> None:
    """A field that is held at 1 along a line and pushed by nothing, as the crack of demos/crack.py
    that is alone: from guesses with noise, for which J u - F(u) is round-off and tells no size of
    forces."""
    u = fem.Function(space(square(comm, 8), ("Lagrange", 1)))
    v, lower = ufl.TestFunction(u.function_space), fem.Function(u.function_space)
    lower.interpolate(lambda x: 1.0 * (np.abs(x[0] - 0.5) < 0.01))
    noise = np.random.default_rng(comm.rank)
    for _ in range(4):
        u.x.array[:] = noise.random(len(u.x.array))
        u.x.scatter_forward()
        result = vi.solve(
            laplace(u, v) + 20.0 * u * v * ufl.dx, u, lower=lower, upper=1.0, method=method
        )
        assert result.certificate.worst <= 1e-9
        assert owned(u).min() > 0.05 and np.all(owned(u)[owned(lower) == 1.0] == 1.0)


@pytest.mark.parametrize("form", [conducting, film], ids=["unsymmetric", "soap film"])
def test_problems_that_are_not_linear(comm: Any, form: Any) -> None:
    """From a first guess far off: Newton's method ends quadratically."""
    known = Known(space(square(comm, 10), ("Lagrange", 1)), form)
    result = vi.solve(known.F, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc])
    known.check(result, error=1e-8)
    assert 2 <= result.iterations <= 12


@pytest.mark.two_ranks
@pytest.mark.parametrize(("tiny", "force"), [(1e-9, 1e6), (1e7, 1e-5)])
def test_units_change_nothing(comm: Any, tiny: float, force: float) -> None:
    """PETSc's own zero tolerance, 1e-8 in the unit of u, leaves the active set to chance in the
    first."""
    for method in (None, ReducedNewton()):
        known = Known(space(square(comm, 12), ("Lagrange", 1)), laplace, tiny=tiny, force=force)
        known.check(
            vi.solve(
                known.linear,
                known.u,
                lower=known.lower,
                upper=known.upper,
                bcs=[known.bc],
                method=method,
            ),
            error=1e-11,
        )


@pytest.mark.two_ranks
def test_at_the_solution_nothing_is_left_to_do(comm: Any) -> None:
    known = Known(space(square(comm, 12), ("Lagrange", 1)), laplace)
    known.u.x.array[:] = known.exact.x.array
    result = vi.solve(known.F, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc])
    known.check(result, error=1e-12)
    assert (result.iterations, result.inner) == (0, 0)


@pytest.mark.two_ranks
def test_projection_of_constants_on_cells(comm: Any) -> None:
    """DG0 without conditions: every cell by itself, u = mid(-0.1, target, 0.1), also with bounds
    given as numbers, Constants and infinity; and a bound that nobody reaches, as wide as users
    write it, disturbs nothing."""
    V = space(square(comm, 6), ("DG", 0))
    target, u = fem.Function(V), fem.Function(V)
    target.interpolate(lambda x: np.sin(9.0 * x[0]) * x[1])
    F, n = (u - target) * ufl.TestFunction(V) * ufl.dx, len(owned(u))
    for lower, upper, wanted in (
        (-0.1, fem.Constant(V.mesh, 0.1), np.clip(target.x.array, -0.1, 0.1)),
        (-np.inf, [0.1], np.minimum(target.x.array, 0.1)),
        (-1e20, 1e20, target.x.array),
        (None, None, target.x.array),
    ):
        result = vi.solve(F, u, lower=lower, upper=upper)
        assert np.max(np.abs(u.x.array - wanted), initial=0.0) <= 1e-14
        assert result.active == tuple(
            comm.allreduce(int(np.count_nonzero(one[:n])))
            for one in (wanted > target.x.array, wanted < target.x.array)
        )


def test_nothing_is_free_or_nothing_acts(comm: Any) -> None:
    """All unknowns clamped; no load at all; equal bounds."""
    V = space(square(comm, 3), ("Lagrange", 1))
    every = np.arange(len(fem.Function(V).x.array), dtype=np.int32)
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = laplace(u, v)
    assert vi.solve(F, u, lower=-1.0, bcs=[fem.dirichletbc(fem.Function(V), every)]).iterations == 0
    assert vi.solve(F, u, lower=0.0, bcs=[clamped(V)]).active == (0, 0) and not np.any(u.x.array)
    result = vi.solve(F + 3.0 * v * ufl.dx, u, lower=0.25, upper=0.25)
    assert np.all(u.x.array == 0.25) and result.active == (16, 0)
    total = comm.allreduce(float(np.sum(owned(result.lambda_lower))))
    assert total == pytest.approx(3.0, rel=1e-13)


@pytest.mark.two_ranks
def test_a_string_above_a_floor(comm: Any) -> None:
    """-u'' = -8, u(0) = u(1) = 0, u >= -¼: it lies on the floor from ¼ to ¾, and linear elements
    are exact at nodes."""
    V = space(mesh.create_interval(comm, 32, [0.0, 1.0]), ("Lagrange", 1))
    u, v = fem.Function(V), ufl.TestFunction(V)
    result = vi.solve(laplace(u, v) + 8.0 * v * ufl.dx, u, lower=-0.25, bcs=[clamped(V)])
    x = V.tabulate_dof_coordinates()[:, 0]
    near = np.minimum(x, 1.0 - x)
    assert (
        np.max(np.abs(u.x.array - np.where(near < 0.25, 4.0 * near**2 - 2.0 * near, -0.25)))
        <= 1e-14
    )
    assert result.active == (17, 0)
    push = comm.allreduce(float(np.sum(owned(result.lambda_lower))))
    assert push == pytest.approx(4.0, abs=1e-12)  # the load on the half that lies on the floor


def test_a_component_is_bounded_and_another_held(comm: Any) -> None:
    """A block pushed against a wall: u_x <= 0.01 everywhere, u_y = 0, u_x = 0 on the left; bar
    theory."""
    V = space(square(comm, 4), ("Lagrange", 1), 2)
    on = V.mesh
    left = fem.locate_dofs_topological(
        V.sub(0), 1, mesh.locate_entities_boundary(on, 1, lambda x: np.isclose(x[0], 0))
    )
    every = mesh.locate_entities(on, 2, lambda x: np.full(x.shape[1], True))
    on.topology.create_connectivity(2, 2)
    rollers = fem.locate_dofs_topological(V.sub(1), 2, every)
    u, v = fem.Function(V), ufl.TestFunction(V)
    bcs = [fem.dirichletbc(0.0, left, V.sub(0)), fem.dirichletbc(0.0, rollers, V.sub(1))]
    stiff = 2.0 + 1.0  # of a strip that cannot become wider
    # on all sides: 0.27 in all, what is 0.09 (1 + 2 x) / stiff without wall
    F = elastic(u, v) - 0.09 * v[0] * ufl.ds
    free = vi.solve(F, u, bcs=bcs)
    largest = comm.allreduce(float(np.max(u.x.array)), op=_largest())
    assert free.active == (0, 0) and largest > 0.01
    result = vi.solve(F, u, upper=(0.01, np.inf), bcs=bcs)
    assert comm.allreduce(float(np.max(u.x.array)), op=_largest()) == 0.01 and result.active[1] > 0
    push = comm.allreduce(float(np.sum(owned(result.lambda_upper))))
    assert 0.0 < push < 0.27 and stiff * 0.01 < 0.27
    assert not np.any(result.lambda_upper.x.array[1::2])


def _largest() -> Any:
    from mpi4py import MPI

    return MPI.MAX


def test_a_failure_is_one_sentence_and_keeps_the_best(comm: Any) -> None:
    known = Known(space(square(comm, 8), ("Lagrange", 1)), conducting)
    with pytest.raises(
        StepFailure, match=r"after 1 Newton steps, above 1e-09.*more iterations"
    ) as failure:
        vi.solve(
            known.F, known.u, lower=known.lower, upper=known.upper, bcs=[known.bc], iterations=1
        )
    assert "\n" not in str(failure.value)
    off = np.abs(known.u.x.array - known.exact.x.array)
    assert np.all(np.isfinite(off)) and np.max(off) < 0.3  # where it began: 0.35
    v = ufl.TestFunction(known.V)
    with pytest.raises(StepFailure, match="is not a number"):
        vi.solve(
            laplace(known.u, v) + ufl.sqrt(known.u - 10.0) * v * ufl.dx, known.u, bcs=[known.bc]
        )


def test_a_linear_form_that_is_not_positive_is_told(comm: Any) -> None:
    """Nothing has a minimum: TRON would go on for ever. The sentence speaks of F and not of a
    matrix."""
    V = space(square(comm, 6), ("Lagrange", 1))
    u, v = fem.Function(V), ufl.TestFunction(V)
    F = laplace(u, v) - 400.0 * u * v * ufl.dx + v * ufl.dx
    with pytest.raises(
        StepFailure, match="the linear problem is not solved: check that bcs or bounds"
    ) as failure:
        vi.solve(F, u, upper=1.0, bcs=[clamped(V)], method=TaoTron())
    assert " A " not in str(failure.value) and "\n" not in str(failure.value)


@pytest.mark.two_ranks
def test_steps_that_are_too_long_are_shortened(comm: Any) -> None:
    """The p-Laplacian, p = 6, from a rough guess: Newton's steps are too long, and the search
    shortens them."""
    V = space(square(comm, 8), ("Lagrange", 1))
    u, v = fem.Function(V), ufl.TestFunction(V)
    u.interpolate(lambda x: x[0] * (1 - x[0]) * np.sin(40.0 * x[1]))
    energy = (ufl.inner(ufl.grad(u), ufl.grad(u)) + 1e-6) ** 3 / 6.0 * ufl.dx + 0.1 * u * ufl.dx
    F = ufl.derivative(energy, u, v)
    result = vi.solve(F, u, lower=-0.15, bcs=[clamped(V)])
    assert result.certificate.worst <= 1e-9 and result.active[0] > 4
    again = fem.Function(V)
    other = vi.solve(ufl.replace(F, {u: again}), again, lower=-0.15, bcs=[clamped(V)])
    assert other.active == result.active
    assert np.max(np.abs(u.x.array - again.x.array)) <= 1e-6
