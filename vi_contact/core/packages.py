"""Ask which packages PETSc was built with, without an import of PETSc, as any room may.

Call it as ``packages.petsc_has(…)``: a package that is assumed is a crash on somebody's machine.
"""

import sys

PETSC = "petsc4py.PETSc"
# One package to PETSc before 3.22, and from then on each by itself.
OF_SUITESPARSE = ("amd", "cholmod", "umfpack")


def petsc_is_here() -> bool:
    """Say whether somebody has imported PETSc into this process."""
    return PETSC in sys.modules


def petsc_has(package: str) -> bool:
    """Say whether PETSc is in this process, and was built with a package of its configuration."""
    if not petsc_is_here():
        return False
    names = [package, "suitesparse"] if package in OF_SUITESPARSE else [package]
    return any(sys.modules[PETSC].Sys.hasExternalPackage(name) for name in names)
