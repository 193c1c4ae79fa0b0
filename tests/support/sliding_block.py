"""Model a stiff block that slides on a shaken ground with Coulomb friction; its rigid limit is
Newmark's block (1965).

The whole base is in possible contact and free to lift and slide; the run starts from the gravity
stage.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from newmark_block import SlidingBlock

from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Excitation
from vi_contact.core.step import State
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import Damping, LinearElastic, PlaneStress, Rayleigh
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.static import static_equilibrium


@dataclass(frozen=True)
class SlidingBody:
    """Describe the block. ``law``: friction and gravity of the rigid block; width and height [m];
    stiff material; mesh.

    InputError for a block so slender, width/height <= mu, that it rocks before it slides.
    """

    law: SlidingBlock
    lengths: tuple[float, float] = (1.0, 0.5)
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic(E=3.0e9, nu=0.0, rho=2400.0)
    )
    damping: Damping = field(default_factory=lambda: Rayleigh(alpha=0.0, beta=1.0e-4))
    divisions: tuple[int, int] = (4, 2)

    def __post_init__(self) -> None:
        if self.lengths[0] <= self.law.mu * self.lengths[1]:
            raise InputError(
                f"SlidingBody: a block of {self.lengths[0]:g} m x {self.lengths[1]:g} m rocks "
                f"before it slides with mu = {self.law.mu:g}: make it wider than mu times its "
                "height"
            )


@dataclass(frozen=True)
class SlidingModel:
    """Hold the model. ``problem``: the block on moving ground; ``rest``: standing still;
    ``centre``: for probes."""

    body: SlidingBody
    problem: ContactProblem
    rest: State

    @property
    def centre(self) -> tuple[float, float]:
        """Return the centre of mass [m]."""
        return 0.5 * self.body.lengths[0], 0.5 * self.body.lengths[1]


def build(
    body: SlidingBody, comm: Any, *, excitation: Excitation | Sequence[Excitation]
) -> SlidingModel:
    """Build mesh, system and gravity stage of the block."""
    mesh, tags = build_mesh(BlockMesh(lengths=body.lengths, divisions=body.divisions), comm)
    weight = BodyForce((0.0, -body.material.rho * body.law.gravity))
    system = assemble(
        mesh, body.material, section=PlaneStress(1.0), damping=body.damping, loads=weight
    )
    ground = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = contact_surface(system, tags["bottom"], obstacle=ground)
    problem = ContactProblem(system, surface, friction=Coulomb(body.law.mu), excitation=excitation)
    return SlidingModel(body, problem, static_equilibrium(problem))
