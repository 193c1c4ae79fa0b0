"""Problems between bounds whose answers are known: a function of the space that lies on its bounds
where it is pressed.

With F(u; v) = N(u; v) - N(u*; v) + ∫ (p_lower - p_upper) v, where u* = lower on the cells with
p_lower > 0 and u* = upper on those with p_upper > 0, u* is the answer to the last digit, whatever N
and the mesh are: F(u*) are the pressures, and they are zero where the bounds are not reached.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, mesh

from vi_contact.fem import compat

Form = Callable[[Any, Any], Any]


def space(on: Any, element: tuple[str, int], width: int = 1) -> Any:
    """A space of values at points, with so many components."""
    if compat.VERSION >= (0, 7):
        return fem.functionspace(on, element if width == 1 else (*element, (width,)))
    return (
        fem.FunctionSpace(on, element)
        if width == 1
        else fem.VectorFunctionSpace(on, element, dim=width)
    )


def square(comm: Any, n: int, cell: str = "triangle") -> Any:
    """A mesh of the unit square."""
    return mesh.create_unit_square(comm, n, n, cell_type=getattr(mesh.CellType, cell))


def clamped(V: Any, value: Any = None) -> Any:
    """A Dirichlet condition on the whole boundary: that of a Function, or zero."""
    on = V.mesh
    facets = mesh.locate_entities_boundary(
        on, on.topology.dim - 1, lambda x: np.full(x.shape[1], True)
    )
    g = fem.Function(V) if value is None else value
    return fem.dirichletbc(g, fem.locate_dofs_topological(V, on.topology.dim - 1, facets))


def wavy(x: Any) -> Any:
    """Values of both signs, not zero on the boundary."""
    return 0.3 * np.sin(5.0 * x[0] + 1.0) * np.cos(4.0 * x[1])


class Known:
    """A problem with the answer ``exact``. ``tiny``: every length of u, ``force``: every F, in
    other units."""

    def __init__(self, V: Any, N: Form, *, tiny: float = 1.0, force: float = 1.0) -> None:
        self.V, on, width = V, V.mesh, V.dofmap.index_map_bs
        each = (
            (lambda f: f)
            if width == 1
            else (lambda f: lambda x: np.vstack([f(x) * (c + 1) for c in range(width)]))
        )
        self.exact, self.lower, self.upper, self.u = (fem.Function(V) for _ in range(4))
        self.exact.interpolate(each(lambda x: tiny * wavy(x)))
        constant = space(on, ("DG", 0))
        low, high = fem.Function(constant), fem.Function(constant)
        low.interpolate(lambda x: 1.0 * (np.hypot(x[0] - 0.3, x[1] - 0.3) < 0.2))
        high.interpolate(lambda x: 2.0 * (np.hypot(x[0] - 0.7, x[1] - 0.7) < 0.2))
        v = ufl.TestFunction(V)
        both = v if width == 1 else sum(v[c] for c in range(width))
        self.push = [self.vector(force * p * both * ufl.dx) for p in (low, high)]
        for bound, push, sign in zip((self.lower, self.upper), self.push, (-1.0, 1.0), strict=True):
            bound.x.array[:] = self.exact.x.array
            bound.x.array[: len(push)] += sign * tiny * np.where(push > 0.0, 0.0, 0.05)
            bound.x.scatter_forward()
        scale = fem.Constant(on, force / tiny)
        self.F = scale * (N(self.u, v) - N(self.exact, v)) + force * (low - high) * both * ufl.dx
        w = ufl.TrialFunction(V)
        self.linear = (
            scale * N(w, v),
            scale * N(self.exact, v) - force * (low - high) * both * ufl.dx,
        )
        self.bc = clamped(V, self.exact)
        inner = np.ones(len(self.u.x.array), dtype=bool)
        inner[compat.bc_values(self.bc, len(inner))[0]] = False
        self.push = [np.where(inner[: len(push)], push, 0.0) for push in self.push]

    def vector(self, form: Any) -> Any:
        """The owned entries of a linear form."""
        vector = compat.assemble_vector(compat.compile_form(form))
        return np.array(vector.array_r)

    def check(self, result: Any, *, error: float, weak: float = 0.0) -> None:
        """The answer, the active sets and the multipliers are the known ones; ``weak``: pushes that
        may be missed."""
        n, size = len(self.push[0]), float(np.max(np.abs(self.exact.x.array)))
        largest = self.V.mesh.comm.allreduce(
            max(np.max(one, initial=0.0) for one in self.push), op=_max()
        )
        assert np.max(np.abs(result.u.x.array - self.exact.x.array)) <= error * size
        for push, force in zip(self.push, (result.lambda_lower, result.lambda_upper), strict=True):
            assert np.max(np.abs(force.x.array[:n] - push), initial=0.0) <= error * largest
            assert np.array_equal(force.x.array[:n] > 0.0, push > weak * largest)
        counts = tuple(
            self.V.mesh.comm.allreduce(int(np.count_nonzero(push > weak * largest)))
            for push in self.push
        )
        assert result.active == counts and min(counts) > 0
        assert result.certificate.worst <= 1e-9


def _max() -> Any:
    from mpi4py import MPI

    return MPI.MAX
