"""Large changes of Dirichlet data and bounds: neo-Hookean blocks, beside PETSc's SNES VI
(benchmarks/load_steps.py)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from dolfinx import fem, mesh
from own_forms import clamped, space, square
from site_pages import ROOT, loaded

from vi_contact import StepFailure, vi


def neo_hookean(u: Any, E: float, nu: float = 0.3) -> Any:
    """The energy of compressible neo-Hookean material."""
    d = len(u)
    mu, lam = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    F = ufl.Identity(d) + ufl.grad(u)
    J = ufl.det(F)
    return (0.5 * mu * (ufl.inner(F, F) - d) - mu * ufl.ln(J) + 0.5 * lam * ufl.ln(J) ** 2) * ufl.dx


class Pressed:
    """A unit square or cube of rubber on the floor z = 0, whose top is moved."""

    def __init__(
        self, comm: Any, n: int, d: int, E: float = 1.0, element: tuple[str, int] = ("Lagrange", 1)
    ) -> None:
        on = square(comm, n) if d == 2 else mesh.create_unit_cube(comm, n, n, n)
        self.V = space(on, element, d)
        self.u, self.g, self.floor = (
            fem.Function(self.V),
            fem.Function(self.V),
            fem.Function(self.V),
        )
        facets = mesh.locate_entities_boundary(on, d - 1, lambda x: np.isclose(x[d - 1], 1.0))
        self.bc = fem.dirichletbc(self.g, fem.locate_dofs_topological(self.V, d - 1, facets))
        facets = mesh.locate_entities_boundary(on, d - 1, lambda x: np.isclose(x[d - 1], 0.0))
        under = fem.locate_dofs_topological(self.V, d - 1, facets)
        self.floor.x.array[:] = -np.inf
        self.floor.x.array[d * under + d - 1] = 0.0
        self.energy = neo_hookean(self.u, E)
        self.F = ufl.derivative(self.energy, self.u)

    def move(self, *by: float) -> None:
        self.g.interpolate(lambda x: np.vstack([one + 0.0 * x[0] for one in by]))

    def solve(self) -> Any:
        return vi.solve(self.F, self.u, lower=self.floor, bcs=[self.bc])


@pytest.mark.parametrize("E", [1.0, 3e9])
def test_a_load_step_of_several_cells(comm: Any, E: float) -> None:
    """The top goes down by a cell and a half at once, which written into u alone turns the cells
    below it inside out; then it shears. The certificate and the number of steps do not depend on
    the unit of force."""
    block = Pressed(comm, 10, 2, E)
    for by in ((0.0, -0.15), (0.1, -0.2)):
        block.move(*by)
        result = block.solve()
        assert result.certificate.worst <= 1e-9 and result.iterations <= 7
        held = block.bc.dof_indices()[0]
        assert np.array_equal(block.u.x.array[held], block.g.x.array[held])
    assert result.active[0] > 0


@pytest.mark.two_ranks
def test_the_road_does_not_change_the_answer(comm: Any) -> None:
    """One large step or three small ones, F or its energy: the same u."""
    fields = []
    for parts, by_energy in ((1, False), (3, False), (1, True)):
        block = Pressed(comm, 6, 2)
        for k in range(parts):
            block.move(0.0, -0.18 * (k + 1) / parts)
            if by_energy:
                vi.solve(energy=block.energy, u=block.u, lower=block.floor, bcs=[block.bc])
            else:
                block.solve()
        fields.append(block.u.x.array.copy())
    for other in fields[1:]:
        assert np.max(np.abs(other - fields[0])) <= 1e-7


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("d", "n", "element"), [(3, 3, ("Lagrange", 1)), (2, 4, ("Lagrange", 2))], ids=["space", "P2"]
)
def test_other_cells(comm: Any, d: int, n: int, element: tuple[str, int]) -> None:
    block = Pressed(comm, n, d, 1.0, element)
    block.move(*(0.0,) * (d - 1), -0.25)
    assert block.solve().certificate.worst <= 1e-9


@pytest.mark.two_ranks
def test_a_bound_that_moves_by_more_than_a_cell(comm: Any) -> None:
    """The floor rises into the block: the nodes on it take the whole block along and do not turn
    their cells."""
    block = Pressed(comm, 10, 2)
    rising = block.floor.x.array == 0.0
    block.floor.x.array[rising] = 0.15
    result = block.solve()
    assert result.certificate.worst <= 1e-9 and result.iterations <= 7 and result.active[0] > 0
    assert np.all(block.u.x.array[rising] >= 0.15)


@pytest.mark.two_ranks
def test_a_change_that_is_too_large_is_taken_in_parts(comm: Any) -> None:
    """-(e^(10 u) u')' = 0 with 0 and 1 at the ends: at once it takes Newton's method more steps
    than are allowed."""
    V = space(mesh.create_interval(comm, 64, [0.0, 1.0]), ("Lagrange", 1))
    u, v, g = fem.Function(V), ufl.TestFunction(V), fem.Function(V)
    g.interpolate(lambda x: x[0])
    F = ufl.exp(10.0 * u) * u.dx(0) * v.dx(0) * ufl.dx
    at_once = vi.solve(F, u, lower=0.0, bcs=[clamped(V, g)])
    wanted = u.x.array.copy()
    u.x.array[:] = 0.0
    result = vi.solve(F, u, lower=0.0, bcs=[clamped(V, g)], iterations=10)
    assert at_once.iterations > 10 and result.iterations > 10  # those of all parts
    assert result.certificate.worst <= 1e-9 and np.max(np.abs(u.x.array - wanted)) <= 1e-7


@pytest.mark.serial  # ranks: other cells and loads
@pytest.mark.long
def test_a_form_goes_down_where_newtons_method_fails(comm: Any) -> None:
    """Half of the height at once: the work of F takes the place of the energy, which gives the same
    answer. Who limits the steps gets no more of them."""
    fields = []
    for by_energy in (False, True):
        block = Pressed(comm, 6, 2)
        block.move(0.0, -0.5)
        form = {"energy": block.energy} if by_energy else {"form": block.F}
        result = vi.solve(u=block.u, lower=block.floor, bcs=[block.bc], **form)
        assert result.certificate.worst <= 1e-9 and result.method == "trust region"
        assert "at a local minimum" in result.reason
        fields.append(block.u.x.array.copy())
    assert np.max(np.abs(fields[1] - fields[0])) <= 1e-7
    block = Pressed(comm, 6, 2)
    block.move(0.0, -0.5)
    with pytest.raises(StepFailure, match="no step of Newton's method improves u"):
        vi.solve(block.F, block.u, lower=block.floor, bcs=[block.bc], iterations=50)


def test_a_failure_gives_the_first_guess_back(comm: Any) -> None:
    """A bar that is pressed to less than nothing: u is as before, and the sentence names no
    matrix."""
    V = space(mesh.create_interval(comm, 8, [0.0, 1.0]), ("Lagrange", 1))
    u, g = fem.Function(V), fem.Function(V)
    g.interpolate(lambda x: -1.1 * x[0])
    u.x.array[:] = 0.25
    stretch = 1.0 + u.dx(0)
    energy = (0.5 * stretch**2 - ufl.ln(stretch) + ufl.ln(stretch) ** 2) * ufl.dx
    for given in ({"form": ufl.derivative(energy, u)}, {"energy": energy}):
        with pytest.raises(
            StepFailure, match=r"smaller load steps?.*u holds the first guess"
        ) as failure:
            vi.solve(u=u, lower=-2.0, bcs=[clamped(V, g)], **given)
        assert " A " not in str(failure.value) and "\n" not in str(failure.value)
        assert np.all(u.x.array == 0.25)


@pytest.mark.slow
@pytest.mark.serial
def test_beside_snes(comm: Any, tmp_path: Path) -> None:
    """vi.solve takes all steps that SNES takes, to the same u, with no more Newton steps than SNES
    has factors."""
    benchmark = loaded(ROOT / "benchmarks" / "load_steps.py")
    wanted = {
        "cells",
        "step",
        "solved",
        "iterations",
        "linear",
        "certificate",
        "failures",
        "snes_solved",
        "snes_iterations",
        "snes_factorisations",
        "snes_failures",
        "ratio",
        "difference",
    }
    assert benchmark.main(["--cells", "16", "--json", str(tmp_path / "found.json")]) == 0
    rows = json.loads((tmp_path / "found.json").read_text())["rows"]
    assert [(one["cells"], one["step"]) for one in rows] == [(16, 0.1), (16, 0.2)]
    for one in rows:
        assert set(one) == wanted
        assert (
            one["failures"] == 0 and one["solved"] == round(0.8 / one["step"]) >= one["snes_solved"]
        )
        assert one["certificate"] <= 1e-9 and one["difference"] <= 1e-6
        assert one["iterations"] <= one["snes_factorisations"]
