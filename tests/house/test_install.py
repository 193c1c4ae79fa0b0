"""The installation: Debian's interpreter and stack, a form that compiles, any number of ranks."""

from __future__ import annotations

import sys
import tomllib
from fnmatch import fnmatch
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from vi_contact.studies.cases.library import FOLDER

ROOT = Path(__file__).resolve().parents[2]

MINIMUM = {
    "numpy": (1, 24), "scipy": (1, 10), "h5py": (3, 7), "matplotlib": (3, 6), "tqdm": (4, 64),
    "dolfinx": (0, 5), "petsc4py": (3, 18), "mpi4py": (3, 1), "gmsh": (4, 8),
}


@pytest.mark.serial
def test_interpreter_is_recent_enough() -> None:
    assert sys.version_info >= (3, 11)


@pytest.mark.serial
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


@pytest.mark.serial
def test_the_cases_that_ship_are_installed() -> None:
    """pip installs files that are no modules only where pyproject.toml names them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["vi_contact.studies.cases"]
    files = sorted(path.relative_to(FOLDER.parent).as_posix() for path in FOLDER.rglob("*") if path.is_file())
    assert len(files) == 4 and all(any(fnmatch(file, one) for one in patterns) for file in files)
    others = [path for path in (ROOT / "vi_contact").rglob("*") if path.is_file() and "__pycache__" not in path.parts
              and path.suffix not in (".py", ".toml", ".typed")]
    named = project["tool"]["setuptools"]["package-data"]["vi_contact.core"]
    assert [path.relative_to(ROOT / "vi_contact" / "core").as_posix() for path in others] == named
