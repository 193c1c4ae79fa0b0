"""Assemble bodies with finite elements on DOLFINx.

There are meshes, systems, contact surfaces and output of fields, in this order: ``build_mesh`` or
``read_mesh``, ``assemble``, ``contact_surface`` or ``contact_pair``: README.md.

>>> from mpi4py import MPI
>>> from vi_contact import core, fem, laws, meshes
>>> mesh, tags = fem.build_mesh(meshes.WallMesh(divisions=(2, 3)), MPI.COMM_WORLD)
>>> system = fem.assemble(mesh, laws.LinearElastic(2.0e10, 0.0, 2400.0), clamped=tags["base"])
>>> fem.contact_surface(system, tags["face"], obstacle=core.Touching()).total  # of all ranks
3
"""

import sys
from importlib.abc import MetaPathFinder
from importlib.util import find_spec
from typing import Any

from ..core.lazy import lazy


class LoadsMPI(MetaPathFinder):
    """Import mpi4py before the first import of PETSc or DOLFINx, and find nothing itself."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> None:
        """Return None, so that Python looks on where it always looks."""
        if name in ("petsc4py", "dolfinx"):
            sys.meta_path.remove(self)
            import mpi4py.MPI  # noqa: F401


# The wheels of PETSc and DOLFINx find the MPI library that mpi4py has loaded before.
if find_spec("dolfinx_solver") is not None:
    sys.meta_path.insert(0, LoadsMPI())

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
