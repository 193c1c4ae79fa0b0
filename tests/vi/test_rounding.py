"""Values that differ by rounding from what is allowed are taken, those that differ by more are
refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from dolfinx import fem, mesh
from own_forms import clamped, space, square

from vi_contact import InputError, vi
from vi_contact.core.algebra import SerialComm
from vi_contact.vi.rounding import OFF, measure_field

INF = np.inf
SIZES = {
    "values": ([0.0, -0.3], [-INF, -INF], [INF, INF], 0.3),
    "a bound that keeps u from zero": ([0.0, 0.0, 0.0], [0.1, 1e-17, 3e-34], [INF] * 3, 0.1),
    "an upper bound that is zero at the rim": (
        [0.0, 0.0, 0.0],
        [-INF] * 3,
        [1.0, 0.4, -2.2e-16],
        1.0,
    ),
    "walls": ([0.0, 0.0, 0.0], [-1e20, 1e-9, -2e-9], [1e7, 1e7, 1e7], 2e-9),
    "walls alone": ([0.0, 0.0], [-1e20, -1e20], [1e20, 1e20], 1e20),
    "no bounds, no values": ([0.0], [-INF], [INF], 0.0),
    "two walls, one behind the other": ([0.5, 0.0], [-1e20, -1e10], [1e20, 2.0], 2.0),
    "large values are no walls": ([3e7, 0.0], [-INF, -INF], [4e7, 1.0], 4e7),
}


@pytest.mark.parametrize("name", SIZES)
def test_the_size_of_a_field(name: str) -> None:
    values, lower, upper, size = SIZES[name]
    assert measure_field(np.array(values), np.array(lower), np.array(upper), SerialComm()) == size


def membrane(comm: Any, degree: int) -> tuple[Any, Any, Any]:
    """A space on the unit square, u, and the form of a membrane without load."""
    V = space(square(comm, 8), ("Lagrange", degree))
    u, v = fem.Function(V), ufl.TestFunction(V)
    return V, u, ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx


def hill(x: Any) -> Any:
    """0 at the rim but for rounding, where it is 1e-17 and 3e-34."""
    return 0.1 * np.sin(np.pi * x[0]) * np.sin(np.pi * x[1])


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e6])
@pytest.mark.parametrize("degree", [1, 2])
def test_an_obstacle_that_is_zero_at_the_rim(comm: Any, degree: int, unit: float) -> None:
    """The rim is held at 0, which misses the obstacle there by rounding: the prescribed value
    wins."""
    V, u, F = membrane(comm, degree)
    lower = fem.Function(V)
    lower.interpolate(lambda x: unit * hill(x))
    result = vi.solve(F, u, lower=lower, bcs=[clamped(V)])
    assert result.certificate.worst <= 1e-9 and result.active[0] > 0
    n = V.dofmap.index_map.size_local
    rim = np.zeros(n, dtype=bool)
    rim[[i for i in clamped(V).dof_indices()[0] if i < n]] = True
    field, bound = u.x.array[:n], lower.x.array[:n]
    above = comm.allreduce(float(np.max(bound[rim], initial=0.0)), op=_largest())
    assert above > 0.0 and not np.any(field[rim])
    assert np.all(field[~rim] >= bound[~rim])


@pytest.mark.two_ranks
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_billionth_of_the_field_is_no_rounding(comm: Any, sign: float) -> None:
    """Also where walls stand for no bound at other nodes: they do not make the field large."""
    V, u, F = membrane(comm, 1)
    place = V.tabulate_dof_coordinates()
    inner = np.all(np.abs(place[:, :2] - 0.5) < 0.49, axis=1)
    for wall in (0.0, 1e7, 1e20):
        bound = fem.Function(V)
        bound.interpolate(lambda x: sign * hill(x) + 1e-9 * sign)
        if wall:
            bound.x.array[inner] = -wall * sign
        bounds = {"lower" if sign > 0.0 else "upper": bound}
        with pytest.raises(InputError, match="bcs prescribe a value beyond a bound"):
            vi.solve(F, u, bcs=[clamped(V)], **bounds)


@pytest.mark.two_ranks
def test_bounds_that_cross_by_rounding(comm: Any) -> None:
    """Two ways to compute one field: where they cross by rounding the unknown is held at lower;
    else it is refused."""
    V, u, F = membrane(comm, 1)
    lower, upper = fem.Function(V), fem.Function(V)
    lower.interpolate(hill)
    upper.interpolate(lambda x: 0.1 * np.sin(np.pi * (1.0 - x[0])) * np.sin(np.pi * (1.0 - x[1])))
    assert comm.allreduce(bool(np.any(lower.x.array > upper.x.array)), op=_either())
    result = vi.solve(F, u, lower=lower, upper=upper, bcs=[clamped(V)])
    assert result.certificate.worst <= 1e-9
    assert np.max(np.abs(u.x.array - lower.x.array)) <= OFF * 0.1
    lower.x.array[:] += 1e-9
    with pytest.raises(InputError, match="lower is above upper"):
        vi.solve(F, u, lower=lower, upper=upper, bcs=[clamped(V)])


@pytest.mark.parametrize("shift", [0.0, 1e-17, -1e-17, 1e-16])
@pytest.mark.parametrize("load", [0.0, 1e-9, 1e-3])
def test_a_body_that_rests_on_its_floor(comm: Any, shift: float, load: float) -> None:
    """An elastic block of finite strains touches a floor whose height is rounded: no load, no
    displacement, and a small load is not lost in the rounding."""
    V = space(square(comm, 4), ("Lagrange", 1), 2)
    u, v, floor = fem.Function(V), ufl.TestFunction(V), fem.Function(V)
    F = ufl.Identity(2) + ufl.grad(u)
    W = 0.5 * (ufl.tr(F.T * F) - 2.0) - ufl.ln(ufl.det(F)) + 0.5 * ufl.ln(ufl.det(F)) ** 2
    floor.interpolate(lambda x: np.vstack([0.0 * x[0] - 10.0, np.where(x[1] > 1e-9, -x[1], shift)]))
    form = ufl.derivative(W * ufl.dx, u, v) + load * v[1] * ufl.dx(V.mesh)
    result = vi.solve(form, u, lower=floor, bcs=[held_sideways(V)])
    assert result.certificate.worst <= 1e-9
    assert np.max(np.abs(u.x.array), initial=0.0) <= max(load, 4e-15)
    pressed = comm.allreduce(
        float(np.sum(result.lambda_lower.x.array[: 2 * V.dofmap.index_map.size_local]))
    )
    assert pressed == pytest.approx(load, rel=1e-6 if load else 0.0, abs=1e-14)


def held_sideways(V: Any) -> Any:
    """A condition that keeps the left side from moving to the right."""
    left = mesh.locate_entities_boundary(V.mesh, 1, lambda x: np.isclose(x[0], 0.0))
    across = V.sub(0)
    return fem.dirichletbc(np.float64(0.0), fem.locate_dofs_topological(across, 1, left), across)


def _largest() -> Any:
    from mpi4py import MPI

    return MPI.MAX


def _either() -> Any:
    from mpi4py import MPI

    return MPI.LOR
