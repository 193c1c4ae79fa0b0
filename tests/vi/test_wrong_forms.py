"""What ``vi.solve`` refuses, in one sentence on all ranks and before any work: forms, bounds,
conditions, methods."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from dolfinx import fem, mesh
from own_forms import clamped, space, square
from petsc4py import PETSc

from vi_contact import InputError, vi
from vi_contact.solvers import Condensed, ReducedNewton, TaoTron


def setting(comm: Any) -> SimpleNamespace:
    """A Poisson problem and its parts."""
    V = space(square(comm, 4), ("Lagrange", 1))
    u, v, w = fem.Function(V), ufl.TestFunction(V), ufl.TrialFunction(V)
    a, L = ufl.inner(ufl.grad(w), ufl.grad(v)) * ufl.dx, -1.0 * v * ufl.dx
    F = ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx + v * ufl.dx
    Pi = 0.5 * ufl.inner(ufl.grad(u), ufl.grad(u)) * ufl.dx + u * ufl.dx
    other = space(square(comm, 3), ("DG", 0))
    return SimpleNamespace(V=V, u=u, v=v, w=w, a=a, L=L, F=F, Pi=Pi, bc=clamped(V), other=other)


def filled(V: Any, *values: tuple[float, float]) -> Any:
    """A Function that is zero but for (x + y -> value) at points of the diagonal."""
    f = fem.Function(V)
    place = V.tabulate_dof_coordinates()
    for at, value in values:
        f.x.array[np.hypot(place[:, 0] - at, place[:, 1] - at) < 1e-6] = value
    return f


Call = Callable[[SimpleNamespace], Any]
CASES: dict[str, tuple[Call, str]] = {
    "functional": (
        lambda s: vi.solve(s.u**2 * ufl.dx, s.u),
        "F is a form of rank 0, and a linear form is needed",
    ),
    "no form": (lambda s: vi.solve(1.0, s.u), r"the form is 1.0, J None; give a UFL form F"),
    "nothing": (
        lambda s: vi.solve(u=s.u),
        r"there is nothing to solve: give the form F\(u; v\), or energy=",
    ),
    "both": (
        lambda s: vi.solve(s.F, s.u, energy=s.Pi),
        "both a form and energy= are given: give one of them",
    ),
    "energy of rank 1": (
        lambda s: vi.solve(energy=s.F, u=s.u),
        "energy is a form of rank 1, and a functional is",
    ),
    "no energy": (
        lambda s: vi.solve(energy=2.0, u=s.u),
        "energy is 2.0, and a functional is needed",
    ),
    "energy of another": (
        lambda s: vi.solve(energy=fem.Function(s.V) ** 2 * ufl.dx, u=s.u),
        "energy does not depend on u",
    ),
    "energy and J": (
        lambda s: vi.solve(energy=s.Pi, u=s.u, J=s.a),
        "J is given beside energy=.*leave J out",
    ),
    "energy and method": (
        lambda s: vi.solve(energy=s.Pi, u=s.u, method=TaoTron()),
        r"method is TaoTron\(\), which solves the linear steps of a form; leave it out",
    ),
    "energy's options": (
        lambda s: vi.solve(energy=s.Pi, u=s.u, petsc_options={"pc_type": "incomplete"}),
        "PETSc does not accept the options under vi_contact_vi_",
    ),
    "three forms": (lambda s: vi.solve((s.a, s.L, s.L), s.u), "the form is "),
    "a of rank 1": (
        lambda s: vi.solve((s.L, s.L), s.u),
        "a is a form of rank 1, and a bilinear form is needed",
    ),
    "L of rank 2": (
        lambda s: vi.solve((s.a, s.a), s.u),
        "L is a form of rank 2, and a linear form is needed",
    ),
    "J of rank 1": (lambda s: vi.solve(s.F, s.u, J=s.L), "J is a form of rank 1"),
    "J beside a": (lambda s: vi.solve((s.a, s.L), s.u, J=s.a), "whose Jacobian is a"),
    "u in a": (
        lambda s: vi.solve((s.u * s.w * s.v * ufl.dx, s.L), s.u),
        "not linear in it: give F",
    ),
    "u in L": (lambda s: vi.solve((s.a, s.u * s.v * ufl.dx), s.u), "a or L contains u itself"),
    "no u": (lambda s: vi.solve(s.L, s.u), "F does not depend on u"),
    "arity": (
        lambda s: vi.solve((s.w**2 * s.v * ufl.dx, s.L), s.u),
        "F or J is not linear in u or in v",
    ),
    "mixed arity": (
        lambda s: vi.solve(s.F + s.u * ufl.dx, s.u),
        "F or J is not linear in u or in v",
    ),
    "test function": (
        lambda s: vi.solve(s.u * ufl.TestFunction(space(s.V.mesh, ("Lagrange", 2))) * ufl.dx, s.u),
        "on another space",
    ),
    "u": (lambda s: vi.solve(s.F, s.w), "give the DOLFINx Function"),
    "bound's mesh": (
        lambda s: vi.solve(s.F, s.u, lower=fem.Function(s.other)),
        "lower is .*give a Function on u.function_space itself",
    ),
    "bound's shape": (
        lambda s: vi.solve(s.F, s.u, upper=[1.0, 2.0]),
        "upper is .*; give a Function on u.function_space",
    ),
    "bound's kind": (lambda s: vi.solve(s.F, s.u, upper="high"), "upper is 'high'"),
    "expression": (lambda s: vi.solve(s.F, s.u, upper=2.0 * s.u), "upper is .*give a Function"),
    "NaN bound": (
        lambda s: vi.solve(s.F, s.u, lower=filled(s.V, (0.5, np.nan))),
        r"at \(0.5, 0.5, 0\), .*: a bound is not a number",
    ),
    "crossed": (
        lambda s: vi.solve(s.F, s.u, lower=filled(s.V, (0.75, 2.0)), upper=1.0),
        r"at \(0.75, 0.75, 0\), where u is 0 in \[2, 1\]: lower is above",
    ),
    "infinite": (
        lambda s: vi.solve(s.F, s.u, lower=np.inf),
        r"in \[inf, inf\]: no number is allowed",
    ),
    "clamped outside": (
        lambda s: vi.solve(s.F, s.u, lower=0.5, bcs=[s.bc]),
        r"where u is 0 in \[0.5, inf\]: bcs prescribe a value beyond a bound",
    ),
    "NaN clamped": (
        lambda s: vi.solve(s.F, s.u, bcs=[clamped(s.V, filled(s.V, (0.0, np.nan)))]),
        "bcs are NaN or infinite",
    ),
    "NaN guess": (
        lambda s: vi.solve(s.F, filled_guess(s), lower=0.0),
        "first guess or bcs are NaN or infinite",
    ),
    "bc elsewhere": (
        lambda s: vi.solve(s.F, s.u, bcs=[clamped(space(s.V.mesh, ("Lagrange", 2)))]),
        "bcs is wrong: give a list of dirichletbc",
    ),
    "bc no bc": (
        lambda s: vi.solve(s.F, s.u, bcs=[0.0]),
        "bcs is wrong: give a list of dirichletbc",
    ),
    "one bc": (lambda s: vi.solve(s.F, s.u, bcs=s.bc), "bcs is wrong: give a list of dirichletbc"),
    "moments": (
        lambda s: vi.solve(s.F, fem.Function(space(s.V.mesh, ("N1curl", 1)))),
        "not values of one field",
    ),
    "method": (lambda s: vi.solve(s.F, s.u, method=Condensed()), "method is Condensed"),
    "class": (
        lambda s: vi.solve(s.F, s.u, method=ReducedNewton),
        r"make an object of it, ReducedNewton",
    ),
    "tolerance": (lambda s: vi.solve(s.F, s.u, tolerance=0.0), "tolerance is 0.0"),
    "iterations": (lambda s: vi.solve(s.F, s.u, iterations=0), "iterations is 0"),
    "options": (lambda s: vi.solve(s.F, s.u, petsc_options="icc"), "give a dict"),
    "prefix": (lambda s: vi.solve(s.F, s.u, prefix=3), "prefix is 3"),
    "refused option": (
        lambda s: vi.solve(
            s.F, s.u, method=ReducedNewton(), petsc_options={"pc_type": "gamg"}, bcs=[s.bc]
        ),
        "gamg with vinewtonrsls is refused",
    ),
    "not symmetric": (
        lambda s: vi.solve(
            (s.a + s.w.dx(0) * s.v * ufl.dx, s.L), s.u, bcs=[s.bc], method=TaoTron()
        ),
        r"TaoTron\(\) minimises, and the form is not symmetric",
    ),
}


def filled_guess(s: SimpleNamespace) -> Any:
    """u itself with a NaN: F is made of it."""
    s.u.x.array[:] = filled(s.V, (0.5, np.nan)).x.array
    return s.u


@pytest.mark.parametrize("name", CASES)
def test_wrong_input_is_one_sentence(comm: Any, name: str) -> None:
    call, words = CASES[name]
    with pytest.raises(InputError, match=words) as error:
        call(setting(comm))
    text = str(error.value)
    assert "\n" not in text and len(set(comm.allgather(text))) == 1


def test_complex_numbers_have_no_order(comm: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PETSc, "ScalarType", np.complex128)
    s = setting(comm)
    with pytest.raises(InputError, match="vi.solve: this PETSc computes with complex numbers"):
        vi.solve(s.F, s.u)


def test_mixed_elements_are_refused(comm: Any) -> None:
    """Their unknowns are of several fields; DOLFINx 0.5 ends in a segmentation fault when asked
    what they are."""
    on = mesh.create_unit_square(comm, 2, 2)
    if hasattr(ufl, "MixedElement"):
        one = ufl.FiniteElement("Lagrange", on.ufl_cell(), 1)
        W = fem.FunctionSpace(on, ufl.MixedElement([one, one]))
    else:
        import basix.ufl

        one = basix.ufl.element("Lagrange", on.basix_cell(), 1)
        W = fem.functionspace(on, basix.ufl.mixed_element([one, one]))
    w, (p, q) = fem.Function(W), ufl.TestFunctions(W)
    with pytest.raises(InputError, match="not mixed"):
        vi.solve(w[0] * p * ufl.dx + w[1] * q * ufl.dx, w)
