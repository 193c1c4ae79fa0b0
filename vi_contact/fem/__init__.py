"""Assemble finite elements on DOLFINx: meshes, systems, contact surfaces, output of fields.

In order: ``build_mesh``/``read_mesh``, ``assemble``, ``contact_surface``/``contact_pair``: README.
>>> from mpi4py import MPI
>>> from vi_contact import core, fem, laws, meshes
>>> mesh, tags = fem.build_mesh(meshes.WallMesh(divisions=(2, 3)), MPI.COMM_WORLD)
>>> system = fem.assemble(mesh, laws.LinearElastic(2.0e10, 0.0, 2400.0), clamped=tags["base"])
>>> fem.contact_surface(system, tags["face"], obstacle=core.Touching()).total  # on all ranks
3
"""

from importlib.util import find_spec

from ..core.lazy import lazy

if find_spec("dolfinx") is None:
    raise ModuleNotFoundError(
        "vi_contact.fem needs DOLFINx, which is missing here and which pip does not have: install "
        "it by apt (on Debian "
        "python3-dolfinx-real, and make virtual environments with --system-site-packages) or by "
        "conda (fenics-dolfinx "
        "of conda-forge), see docs/start/install.md",
        name="dolfinx",
    )

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
