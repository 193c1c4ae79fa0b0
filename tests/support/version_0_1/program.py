"""A program of version 0.1: it reads no file and leaves its run in the folder "run_py"."""

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes.wall import WallMesh

ground = vc.KanaiTajimi(s0=0.01, omega_g=25.0)
motion = vc.synthetic(ground, 0.5, 0.01, seed=1, envelope=vc.Envelope(rise=0.1, end=0.3, decay=5.0))
shaking = vc.GroundMotion(vc.scaled_to_pga(motion, 3.0), direction=(1.0, 0.0))
mesh, tags = fem.build_mesh(WallMesh(height=9.0, width=6.0, divisions=(2, 3)), MPI.COMM_WORLD)
concrete = vc.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
system = fem.assemble(mesh, concrete, section=vc.PlaneStress(thickness=0.20), clamped=tags["base"])
obstacle = vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0))
right = fem.contact_surface(system, tags["face"], obstacle=obstacle)
surface = fem.together(right)
problem = vc.ContactProblem(
    system, surface, friction=vc.Coulomb(mu=0.5), impact=vc.Inelastic(vc.MassProjection()), excitation=shaking
)
record = [vc.Energy(), vc.Contact(), vc.Resultants("face", (6.0, 0.0))]
solver = vc.Condensed(vc.ActiveSet(), friction_method=vc.FrictionNewton())
solution = vc.simulate(
    problem, scheme=vc.ZienkiewiczWoodTaylor(), solver=solver, dt=0.002, steps=10, record=record, out="run_py"
)
print(f"largest contact force: {1e-3 * solution.history['contact_resultant'].max():.3f} kN")
