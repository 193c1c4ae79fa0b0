"""Ask which packages PETSc was built with, without an import of PETSc: rooms that do without it may ask too.

Call it as ``packages.petsc_has(…)``: a package that is assumed is a crash on somebody's machine."""

import sys

PETSC = "petsc4py.PETSc"


def petsc_is_here() -> bool:
    """Say whether somebody has imported PETSc into this process."""
    return PETSC in sys.modules


def petsc_has(package: str) -> bool:
    """Say whether PETSc is in this process, and was built with a package, by its name in PETSc's configuration."""
    return petsc_is_here() and bool(sys.modules[PETSC].Sys.hasExternalPackage(package))
