"""A program of version 0.1 with classes of its own: an excitation, a velocity update of impacts and a recorder."""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes.wall import WallMesh


@dataclass(frozen=True)
class Chirp:
    """An acceleration that grows faster [m/s²]."""

    direction: tuple[float, ...] = (1.0, 0.0)
    duration: float = 0.04

    def acceleration(self, t):
        return -3.0 * np.sin(8000.0 * t**2)

    def __call__(self, t):
        return self.acceleration(t) * np.asarray(self.direction)


@dataclass(frozen=True)
class Stopped:
    """The contact velocities take their targets, and nothing else changes."""

    def __call__(self, system, surface, v, target):
        return vc.ComponentReset()(system, surface, v, target)


class SmallestGap:
    """The smallest gap of a step [m]."""

    def columns(self):
        return {"smallest_gap": ("m", "smallest gap")}

    def start(self, problem, state, resumed=None):
        return {"smallest_gap": problem.surface.gap(state.t).min()}

    def row(self, report):
        surface = report.problem.surface
        return {"smallest_gap": (surface.gap(report.new.t) - surface.normal_values(report.new.u)).min()}


mesh, tags = fem.build_mesh(WallMesh(height=9.0, width=6.0, divisions=(2, 3)), MPI.COMM_WORLD)
concrete = vc.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
system = fem.assemble(mesh, concrete, section=vc.PlaneStress(thickness=0.2), clamped=tags["base"])
surface = fem.contact_surface(system, tags["face"], obstacle=vc.HalfSpace(point=(6.0, 0.0), normal=(-1.0, 0.0)))
problem = vc.ContactProblem(system, surface, impact=vc.Inelastic(Stopped()), excitation=Chirp())
scheme = vc.ZienkiewiczWoodTaylor()
solution = vc.simulate(problem, scheme=scheme, dt=0.002, steps=20, record=[vc.Contact(), SmallestGap()], progress=False)
force, gap = (solution.history[name].max() for name in ("contact_resultant", "smallest_gap"))
print(f"contact force up to {1e-3 * force:.3f} kN, smallest gap up to {1e6 * gap:.3f} µm")
