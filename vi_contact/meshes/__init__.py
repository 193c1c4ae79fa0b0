"""Build meshes by parametric Gmsh scripts.

There is one structure per file; a Gmsh model is turned into plain arrays.

A mesh is a frozen value with a method `build(gmsh)` that adds geometry, named physical groups and
cells to Gmsh's current model. `write(mesh, path)` of `gmsh_session` makes a file of it,
`fem.build_mesh(mesh, comm)` a distributed mesh without a file, `python3 meshes wall --help` tells
the way from the shell of the source tree. Lengths in metres, angles in radians. Begin with
``wall.py``.
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
