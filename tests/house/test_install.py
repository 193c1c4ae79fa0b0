"""The installation: Debian's interpreter and stack, a form that compiles, any number of ranks."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

import pytest

MINIMUM = {
    "numpy": (1, 24), "scipy": (1, 10), "h5py": (3, 7), "matplotlib": (3, 6), "tqdm": (4, 64),
    "dolfinx": (0, 5), "petsc4py": (3, 18), "mpi4py": (3, 1), "gmsh": (4, 8),
}


def test_interpreter_is_recent_enough() -> None:
    assert sys.version_info >= (3, 11)


@pytest.mark.parametrize("name", MINIMUM)
def test_stack_is_recent_enough(name: str) -> None:
    version = import_module(name).__version__
    assert tuple(int(part) for part in version.split(".")[:2]) >= MINIMUM[name]


def test_petsc_has_real_numbers() -> None:
    import numpy as np
    from petsc4py import PETSc

    assert not np.issubdtype(PETSc.ScalarType, np.complexfloating)


def test_compiled_form_gives_area_of_unit_square(comm: Any) -> None:
    import ufl
    from dolfinx import fem, mesh
    from mpi4py import MPI

    square = mesh.create_unit_square(comm, 4, 4)
    one = fem.Constant(square, 1.0)
    area = comm.allreduce(fem.assemble_scalar(fem.form(one * ufl.dx)), op=MPI.SUM)
    assert area == pytest.approx(1.0, rel=1e-14)
