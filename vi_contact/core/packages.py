"""Ask which packages are there: DOLFINx, and those that PETSc was built with, as any room may.

PETSc is not imported. Call it as ``packages.petsc_has(…)``: a package that is assumed is a crash on
somebody's machine.
"""

import sys
from importlib.util import find_spec

PETSC = "petsc4py.PETSc"
OF_DOLFINX = ("dolfinx", "ufl", "basix", "ffcx", "petsc4py", "mpi4py")  # what comes with it
# One package to PETSc before 3.22, and from then on each by itself.
OF_SUITESPARSE = ("amd", "cholmod", "umfpack")


def explain_no_dolfinx(what: str, library: str | None) -> str | None:
    """Return a sentence about what needs finite elements; None when the reason is another.

    Args:
        what: the subject of the sentence.
        library: which one was not found.
    """
    if library not in OF_DOLFINX or find_spec("dolfinx") is not None:
        return None
    return (
        f"{what} needs DOLFINx with PETSc, which is missing here: install it by apt (on Debian "
        "python3-dolfinx-real, and make virtual environments with --system-site-packages), by pip "
        "on Linux with Python 3.12 or newer (pip install 'vi-contact[fenicsx]') or by conda "
        "(fenics-dolfinx of conda-forge), see docs/start/install.md"
    )


def petsc_is_here() -> bool:
    """Say whether somebody has imported PETSc into this process."""
    return PETSC in sys.modules


def petsc_has(package: str) -> bool:
    """Say whether PETSc is in this process, and was built with a package of its configuration."""
    if not petsc_is_here():
        return False
    names = [package, "suitesparse"] if package in OF_SUITESPARSE else [package]
    return any(sys.modules[PETSC].Sys.hasExternalPackage(name) for name in names)
