"""Leave out what needs a package that this PETSc was built without: that of PyPI has fewer."""

from __future__ import annotations

import pytest
from mpi4py import MPI  # noqa: F401  (PETSc of PyPI finds the library that mpi4py has loaded)
from petsc4py import PETSc  # noqa: F401

from vi_contact.core import packages


def needs(package: str) -> pytest.MarkDecorator:
    """Skip a test, or one of its cases, where PETSc has no such package."""
    missing = not packages.petsc_has(package)
    return pytest.mark.skipif(missing, reason=f"this PETSc was built without {package}")
