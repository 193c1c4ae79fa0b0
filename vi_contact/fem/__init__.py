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

if find_spec("dolfinx") is None:
    raise ModuleNotFoundError(
        "vi_contact.fem needs DOLFINx, which is missing here: install it by apt (on Debian "
        "python3-dolfinx-real, and make virtual environments with --system-site-packages), by pip "
        "on Linux with Python 3.12 or newer (the extra vi-contact[fenicsx]) or by conda "
        "(fenics-dolfinx of conda-forge), see docs/start/install.md",
        name="dolfinx",
    )
# The wheels of PETSc and DOLFINx find the MPI library that mpi4py has loaded before.
if find_spec("dolfinx_solver") is not None:
    import mpi4py.MPI  # noqa: F401

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
