"""Solve variational inequalities: a bounded DOLFINx Function, any UFL form (docs/guide/bounds.md).

>>> import dolfinx, ufl, dolfinx.fem as own; from mpi4py import MPI; from vi_contact import vi
>>> line = dolfinx.mesh.create_interval(MPI.COMM_SELF, 8, [0.0, 1.0])  # a string
>>> V = getattr(own, "functionspace", own.FunctionSpace)(line, ("Lagrange", 1))
>>> ends = own.dirichletbc(0.0, own.locate_dofs_geometrical(V, lambda x: x[0] % 1.0 == 0.0), V)
>>> u, v = own.Function(V), ufl.TestFunction(V)  # load 8; active: on floor, ceiling
>>> vi.solve((u.dx(0) * v.dx(0) + 8.0 * v) * ufl.dx, u, lower=-0.5, bcs=[ends]).active
(3, 0)
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
