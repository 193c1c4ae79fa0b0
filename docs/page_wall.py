"""Make the small wall that snippets of several pages continue.

A hidden block of the page imports it.
"""

import numpy as np  # noqa: F401
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes, soil  # noqa: F401

comm = MPI.COMM_WORLD
mesh, tags = fem.build_mesh(meshes.WallMesh(divisions=(2, 3)), comm)
material = vc.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
wall = vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0))
shakes = vc.Harmonic(amplitude=3.0, frequency=14.0, direction=(1.0, 0.0))
system = fem.assemble(mesh, material, clamped=tags["base"])
problem = vc.ContactProblem(
    system, fem.contact_surface(system, tags["face"], obstacle=wall), excitation=shakes
)
first = len(system.load(0.0))
