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

from importlib.util import find_spec

from ..core.lazy import lazy

# The wheels of PETSc and DOLFINx find the MPI library that mpi4py has loaded before.
if find_spec("dolfinx_solver") is not None:
    import mpi4py.MPI  # noqa: F401

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
