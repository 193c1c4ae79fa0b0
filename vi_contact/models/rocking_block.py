"""A stiff block standing on the ground with its two lower corners: the rigid limit of contact (V3.1).

The base may lift but not slide: in small displacements the base of a block that turns about one of its corners does not
move sideways, so its horizontal displacement is held. The weight's lever arm b - h theta is a second-order effect,
the geometric stiffness of the gravity stage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..algebra import Array
from ..exact.housner import HousnerBlock
from ..excitation import Excitation
from ..fem.assemble import assemble
from ..fem.gravity import geometric_stiffness
from ..fem.loads import BodyForce, Prescribed
from ..fem.mesh import build_mesh
from ..fem.trace import contact_surface
from ..mass import ConsistentMass
from ..materials import Damping, LinearElastic, NoDamping, PlaneStress
from ..meshes.block import BlockMesh
from ..solvers.condensed import Condensed
from ..static import static_equilibrium
from ..step import ContactProblem, State
from ..surfaces import HalfSpace


@dataclass(frozen=True)
class RockingBlock:
    """Width and height of ``shape`` [m], a material stiff enough to be rigid, and the mesh.

    Rigid means sqrt(E/rho)/height >= 200 p (V3.1): waves cross the block many times while it rocks once.
    """

    shape: HousnerBlock = field(default_factory=lambda: HousnerBlock(width=0.4, height=2.0))
    material: LinearElastic = field(default_factory=lambda: LinearElastic(E=3.0e10, nu=0.0, rho=2400.0))
    damping: Damping = field(default_factory=NoDamping)
    divisions: tuple[int, int] = (2, 10)


@dataclass(frozen=True)
class RockingModel:
    """``problem``: the block with geometric stiffness; ``rest``: the block standing still under its weight."""

    block: RockingBlock
    problem: ContactProblem
    rest: State

    def tilted(self, theta: float, *, rate: float = 0.0) -> State:
        """The block at rest, turned by theta [rad] about its lower left corner, turning at ``rate`` [rad/s]."""
        turn = self._turning()
        return replace(
            self.rest, u=self.rest.u + theta * turn, v=rate * turn, r_n=np.zeros(2), active=np.zeros(2, dtype=bool)
        )

    def _turning(self) -> Array:
        """Displacements of a unit turn to the left about the lower left corner, x = 0."""
        system = self.problem.equations
        x = system.space.coordinates
        return np.asarray(system.influence[:, 1] * x[:, 0] - system.influence[:, 0] * x[:, 1])

    def angle(self, state: State) -> float:
        """Rotation [rad] by the heights of the corners, positive when the right one is up."""
        down = self.problem.surface.normal_values(state.u - self.rest.u)
        return float(down[0] - down[1]) / self.block.shape.width


def build(block: RockingBlock, comm: Any, *, excitation: Excitation | Sequence[Excitation] = ()) -> RockingModel:
    """Mesh, gravity stage and second-order system of the block."""
    width, height, gravity = block.shape.width, block.shape.height, block.shape.gravity
    mesh, tags = build_mesh(BlockMesh(lengths=(width, height), divisions=block.divisions), comm)
    system = assemble(
        mesh, block.material, section=PlaneStress(1.0), damping=block.damping,
        prescribed=Prescribed(tags["bottom"], components=(0,)),
        loads=BodyForce((0.0, -block.material.rho * gravity)),
    )
    ground = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    whole = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=ground))
    standing = static_equilibrium(whole, solver=Condensed())  # on its whole base: no thrust between the corners
    heavy = geometric_stiffness(whole, standing)
    corners = contact_surface(heavy, tags["bottom"], obstacle=ground, points=[(0.0, 0.0), (width, 0.0)])
    problem = ContactProblem(heavy, corners, mass=ConsistentMass(), excitation=excitation)
    return RockingModel(block, problem, static_equilibrium(problem, solver=Condensed()))
