"""Solve variational inequalities of your own: a DOLFINx Function between bounds, any UFL form
(docs/guide/bounds.md).

>>> import dolfinx, ufl, dolfinx.fem as own; from mpi4py import MPI; from vi_contact import vi
>>> line = dolfinx.mesh.create_interval(MPI.COMM_SELF, 8, [0.0, 1.0])  # a string with load 8, ends at 0, floor at -1/2
>>> V = getattr(own, "functionspace", own.FunctionSpace)(line, ("Lagrange", 1))
>>> ends = own.dirichletbc(0.0, own.locate_dofs_geometrical(V, lambda x: x[0] % 1.0 == 0.0), V)
>>> u, v = own.Function(V), ufl.TestFunction(V)
>>> vi.solve((u.dx(0) * v.dx(0) + 8.0 * v) * ufl.dx, u, lower=-0.5, bcs=[ends]).active  # on the floor, at the ceiling
(3, 0)
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
