"""Model the second example of the boundary method.

It is a channel buried in soil on bedrock, shaken (Figs. 6 to 9).

The figures' data are not in the text: what is assumed is marked CHOSEN. Between channel and soil:
contact on left wall, base and right wall; the two bottom corners touch with both their sides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from demos.parts.problems.channel_sides import RockBelow, Rollers, Sides
from vi_contact.core.algebra import Array, Mask, from_each
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from vi_contact.core.step import Columns, Recorder, Report, Row, State
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.conditions import as_tuple
from vi_contact.fem.body.loads import Prescribed
from vi_contact.fem.contact.frames import FemSurface
from vi_contact.fem.contact.joined import joined_surfaces
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.laws.materials import Damping, LinearElastic, NoDamping, PlaneStrain
from vi_contact.laws.weight import with_weight
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.practice.soil.moving_base import BaseMotion
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.recorders.probe import Places
from vi_contact.solvers.volume.route import Volume
from vi_contact.solvers.volume.snes import ReducedNewton

REFERENCE = Volume(method=ReducedNewton(), petsc_options={"snes_linesearch_type": "l2"})
"""The volume route to compare with and to fall back on.

Without a line search its active set runs in circles in some steps of the channel: M/dt² of a
consistent mass couples neighbours with the sign that sets need to settle reversed.
"""
BODIES = ("channel", "soil")  # in the order of their nodes
SIDES = ("base", "left", "right")  # of the contact, in the order of its conditions
POINTS = 19


@dataclass(frozen=True)
class Channel:
    """Describe geometry and materials, in SI units. CHOSEN throughout; the text says neither.

    shape: a layer of 24 x 8 m and a channel of 4 x 3 m, walls and slab 0.5 m thick, cells of 0.5 m.
    soil: 100 MPa, 1800 kg/m³, shear waves at 146 m/s. concrete: 20 GPa, 2400 kg/m³. Plane strain,
    per metre.
    """

    shape: ChannelMesh = field(default_factory=ChannelMesh)
    soil: LinearElastic = field(default_factory=lambda: LinearElastic(E=1.0e8, nu=0.3, rho=1800.0))
    concrete: LinearElastic = field(
        default_factory=lambda: LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
    )
    damping: Damping = field(default_factory=NoDamping)

    def point(self, number: int) -> tuple[float, float]:
        """Return the boundary points 1..19 of the channel.

        They are CHOSEN so that 1 and 7 are its bottom corners.

        Evenly spaced: 1-7 base from left to right, 8-13 right wall and 14-19 left wall, upwards to
        the surface.
        """
        if not 1 <= number <= POINTS:
            raise InputError(
                f"the channel has boundary points 1 to {POINTS}, there is no point {number}"
            )
        left, right = self.shape.x[1], self.shape.x[4]
        bottom = self.shape.y[1]
        height = self.shape.height
        if number <= 7:
            return left + (number - 1) / 6.0 * (right - left), bottom
        if number <= 13:
            return right, bottom + (number - 7) / 6.0 * height
        return left, bottom + (number - 13) / 6.0 * height

    def harmonic(self, amplitude: float = 2.0) -> Harmonic:
        """Return a_g = 2 sin(2 pi 2 t) m/s². CHOSEN: "a sinusoidal strong acceleration"."""
        return Harmonic(amplitude, 2.0, direction=(1.0, 0.0))

    def time_step(self) -> float:
        """Return dt = 1/80 s, a fortieth of the period. CHOSEN."""
        return 1.0 / 80.0

    def probes(self) -> dict[str, tuple[float, float]]:
        """Return bottom corners and middle (1, 7, 4).

        With them come the middle of the walls (10, 16) and their tops (13, 19). These are always
        nodes but for the middles of irregular meshes.
        """
        return {str(number): self.point(number) for number in (1, 4, 7, 10, 13, 16, 19)}


@dataclass(frozen=True)
class ChannelModel:
    """Hold the assembled channel and soil.

    ``surface`` has base, left and right wall in contact, with its normals.
    """

    channel: Channel
    mesh: Any
    tags: Any
    system: SemiDiscreteSystem
    surface: ContactSurface

    def problem(
        self,
        *,
        friction: FrictionLaw | None = None,
        bilateral: bool = False,
        excitation: Excitation | Sequence[Excitation] | None = None,
        impact: ImpactLaw | None = Inelastic(ImpulseUpdate()),
        mass: MassLaw | None = None,
    ) -> ContactProblem:
        """Set up channel and soil under the harmonic motion.

        They slide freely; impulses are inelastic, the mass is consistent.

        Args:
            friction: Coulomb(mu) for instance.
            bilateral: soil and channel cannot part, but slide as before: the linear comparison run
                of Fig. 9.
            excitation: what shakes both; None for the harmonic motion of the source.
            impact: schemes with massless contact nodes take no impact law: give None.
            mass: leave it to these schemes. An impact law runs on consistent mass unless another is
                given.
        """
        return ContactProblem(
            self.system,
            self.surface.bilateral_everywhere() if bilateral else self.surface,
            friction=friction or Frictionless(),
            impact=impact,
            mass=ConsistentMass() if impact is not None and mass is None else mass,
            excitation=self.channel.harmonic() if excitation is None else excitation,
        )

    def recorders(self) -> tuple[Recorder, ...]:
        """Return recorders.

        They are energy, contact, probes on channel (u_x_1, ...) and soil (u_x_1_soil, ...), and
        openings.
        """
        probes = self.channel.probes()
        soil = SoilProbe({f"{label}_soil": point for label, point in probes.items()})
        return Energy(), Contact(), Probe(probes), soil, Openings(self.sides)

    @cached_property
    def sides(self) -> dict[str, Mask]:
        """Return masks (total,) of all contact conditions of each of SIDES."""
        normals = {"base": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}
        whole = self.surface.whole()
        return {side: whole.normals @ normals[side] > 0.5 for side in SIDES}


@dataclass
class SoilProbe(Probe):
    """Record, as `Probe` does, at the nodes of the soil.

    These nodes touch these points of the channel in the undeformed mesh.

    InputError for a point that is not at the interface.
    """

    def _find_places(self, problem: ContactProblem, points: Array) -> Places:
        """Return the nodes of side 2 that face those of side 1.

        They are the nearest where divisions differ.
        """
        nodes = problem.system.space.find_nodes(points).tolist()
        surface = problem.surface
        faced: dict[int, int] = {}
        for part in surface.parts if isinstance(surface, FemSurface) else ():
            if part.facing is not None:
                opposite = part.facing.nodes.numbers[
                    np.asarray(part.facing.P.argmax(axis=1)).ravel()
                ]
                for numbers, partners in from_each(surface.comm, (part.nodes.numbers, opposite)):
                    faced |= dict(zip(numbers.tolist(), partners.tolist(), strict=True))
        if not faced.keys() >= set(nodes):
            raise InputError(
                "a soil probe is not at the interface with the channel: give points of the "
                "channel's outline"
            )
        return Places.at_nodes(np.array([faced[node] for node in nodes], dtype=np.int64))


@dataclass(frozen=True)
class Openings:
    """Record the largest gap of each side of the contact: columns opening_<side> [m].

    ``sides``: name -> (total,).
    """

    sides: Mapping[str, Mask]

    def columns(self) -> Columns:
        """Return the columns with units and meanings."""
        return {
            f"opening_{side}": ("m", f"largest gap of the contact side '{side}'")
            for side in self.sides
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the initial state."""
        return self._row(problem.surface, state)

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.problem.surface, report.new)

    def _row(self, surface: ContactSurface, state: State) -> dict[str, Any]:
        gap = surface.everywhere(surface.gap(state.t) - surface.normal_values(state.u))
        return {f"opening_{side}": float(gap[mask].max()) for side, mask in self.sides.items()}


def build(
    channel: Channel,
    comm: Any,
    *,
    sides: Sides | None = None,
    weighing: Sequence[str] = ("channel",),
    base: BaseMotion | RockBelow | None = None,
    meshed: tuple[Any, Any] | None = None,
) -> ChannelModel:
    """Mesh and assemble channel and soil; collective.

    Args:
        channel: the dimensions and materials of both.
        comm: the MPI communicator of the mesh.
        sides: the ends of the soil layer; by default Rollers(), which hold them vertically
            (CHOSEN).
        weighing: the bodies, of BODIES, that have weight. CHOSEN: the channel only, so that the
            soil's own settlement is not in the figures; without any weight a channel with smooth
            sides drifts up without bound.
        base: moves the bedrock, or lets waves in from below, in the frame of an observer at rest;
            its problems take excitation=(). By default the bedrock is at rest and what shakes it is
            an inertia load, in the frame of the bedrock.
        meshed: (mesh, tags) of another model of this channel, for stages on one mesh.
    """
    mesh, tags = meshed or build_mesh(channel.shape, comm)
    moves = ("displacement", "velocity", "acceleration")
    motion = {name: getattr(base, name) for name in moves} if isinstance(base, BaseMotion) else {}
    ends = (sides or Rollers()).conditions(tags, motion)
    held, absorbing = [*as_tuple(ends.pop("prescribed", ()))], [*as_tuple(ends.pop("dashpots", ()))]
    if isinstance(base, RockBelow):
        absorbing.append(base.absorber(tags))
    else:
        held.append(Prescribed(tags["bedrock"], **motion))  # last: the corners are its own
    system = assemble(
        mesh,
        [(tags["channel"], channel.concrete), (tags["soil"], channel.soil)],
        section=PlaneStrain(),
        prescribed=held,
        dashpots=absorbing,
        damping=channel.damping,
        **ends,
    )
    system = weighted(system, weighing)
    pairs = [contact_pair(system, tags[f"channel_{side}"], tags[f"soil_{side}"]) for side in SIDES]
    return ChannelModel(
        channel, mesh, tags, system, joined_surfaces(*pairs).with_frictionless_corners()
    )


def staged(
    channel: Channel,
    comm: Any,
    *,
    sides: Sides | None,
    weighing: Sequence[str],
    base: BaseMotion | RockBelow | None,
) -> tuple[ChannelModel, ChannelModel | None]:
    """Return the model, and on its mesh the one for its gravity stage.

    There is one where its own supports hold no static load.
    """
    ends = sides or Rollers()
    if ends.firm and (base is None or not base.lets_waves_in):
        return build(channel, comm, sides=ends, weighing=weighing, base=base), None
    firm = build(channel, comm, sides=ends if ends.firm else None, weighing=weighing)
    return build(
        channel, comm, sides=ends, weighing=weighing, base=base, meshed=(firm.mesh, firm.tags)
    ), firm


def weighted(system: SemiDiscreteSystem, weighing: Sequence[str]) -> SemiDiscreteSystem:
    """Return the system with the weight of some of BODIES, ∫ rho g v of their own mass matrix."""
    for name in weighing:
        if name not in BODIES:
            raise InputError(f"unknown body '{name}': {' and '.join(BODIES)} may have weight")
    return with_weight(system, bodies=[BODIES.index(name) for name in weighing])
