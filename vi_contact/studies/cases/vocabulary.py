"""The words of case files: which functions a table may call where, all of them of the public interface."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core import protocols, surfaces
from ...core.step import Recorder, Scheme, Solver
from ...core.surfaces import ContactSurface
from ...engineering.racking import Racking
from ...engineering.resultants import Resultants
from ...fem.contact.matching import Matching, NodeToNode
from ...fem.contact.mortar import DualMortar
from ...fem.dashpots import CompliantBase, Dashpots
from ...fem.loads import BodyForce, Prescribed, TangentialTraction, Traction
from ...fem.mesh import Cells, Facets
from ...fem.output.fields import XDMF
from ...fem.output.reactions import Reactions
from ...fem.output.section_forces import SectionForces
from ...ground_motion import GroundMotion, Record, synthetic
from ...laws import excitation, friction, impact, mass, materials
from ...meshes.ball import BallMesh
from ...meshes.block import BlockMesh
from ...meshes.channel import ChannelMesh
from ...meshes.cut import CutOpen, Welded
from ...meshes.disk import DiskMesh
from ...meshes.gmsh_session import MeshScript
from ...meshes.two_blocks import Blocks, TwoBlocks
from ...meshes.wall import WallMesh
from ...models.channel import sides as channel_sides
from ...run import recorders, time_steps
from ...run.cross_check import CrossChecked
from ...run.files.writer import FieldWriter
from ...schemes.contact_stabilised import ContactStabilisedNewmark
from ...schemes.generalised_alpha import GeneralisedAlpha
from ...schemes.hht import HHT
from ...schemes.houbolt import Houbolt
from ...schemes.linear_multistep import LinearMultistep
from ...schemes.midpoint import Midpoint
from ...schemes.moreau_jean import MoreauJean
from ...schemes.newmark import Newmark
from ...schemes.ss22 import SS22
from ...schemes.trapezoidal import Trapezoidal
from ...schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from ...soil.upgoing_wave import UpgoingVelocity, upgoing
from ...solvers.condensed import Condensed, SmallMethod
from ...solvers.friction import extrapolation
from ...solvers.friction import problem as friction_small
from ...solvers.friction.fixed_point import FixedPoint
from ...solvers.friction.given_forces import GivenForces
from ...solvers.friction.newton import FrictionNewton
from ...solvers.friction.nsgs import NSGS
from ...solvers.friction.uzawa import Uzawa
from ...solvers.normal.active_set import ActiveSet
from ...solvers.normal.hildreth import Hildreth
from ...solvers.normal.projected_cg import ProjectedCG
from ...solvers.volume import route as volume
from ...solvers.volume.one_factorisation import OneFactorisation
from ...solvers.volume.snes import ReducedNewton, SemismoothNewton
from ...solvers.volume.tao import TaoTron
from . import table_functions as plain
from .model_tables import MODELS, Parts
from .parsing import Words
from .table_calls import Callee, callee


def _named(*functions: Any) -> dict[str, Callee]:
    """Callees by name; classmethods as "Class.method"."""
    return {one.__qualname__: callee(one, name=one.__qualname__) for one in functions}


def _choices() -> dict[Any, Mapping[str, Callee]]:
    """Type -> word -> what it calls."""
    frictional = _named(FrictionNewton, NSGS, FixedPoint, GivenForces, Uzawa)
    scripts = _named(WallMesh, ChannelMesh, BlockMesh, TwoBlocks, Blocks, DiskMesh, BallMesh, CutOpen, Welded)
    rate = {"SlipRateCoulomb": callee(plain.slip_rate, name="SlipRateCoulomb")}
    compliant = {"CompliantBase": callee(plain.compliant_base, name="CompliantBase")}
    return {
        Parts: MODELS,
        MeshScript: scripts,
        plain.MeshFile: {"read_mesh": callee(plain.MeshFile, name="read_mesh")},
        materials.LinearElastic: _named(materials.LinearElastic, materials.LinearElastic.from_wave_speeds),
        materials.Section: _named(materials.PlaneStrain, materials.PlaneStress, materials.Solid),
        materials.Damping: _named(
            materials.NoDamping, materials.MassProportional, materials.Rayleigh, materials.Rayleigh.from_frequencies
        ),
        Prescribed: _named(Prescribed),
        Traction: _named(Traction, TangentialTraction),
        BodyForce: _named(BodyForce),
        Dashpots: _named(Dashpots) | compliant | {"FreeField": callee(plain.free_field, name="FreeField")},
        CompliantBase: compliant,
        UpgoingVelocity: _named(upgoing),
        ContactSurface: {
            "contact_surface": callee(plain.surface, name="contact_surface"),
            "contact_pair": callee(plain.pair, name="contact_pair"),
        },
        surfaces.Obstacle: _named(surfaces.Touching, surfaces.HalfSpace),
        channel_sides.Sides: _named(channel_sides.Rollers, channel_sides.Fixed, channel_sides.TiedSides),
        Matching: _named(NodeToNode, DualMortar),
        protocols.FrictionLaw: _named(protocols.Frictionless, friction.Tresca, friction.Coulomb) | rate,
        protocols.ImpactLaw: _named(impact.NoImpact, impact.Inelastic, impact.Newton, impact.Elastic),
        impact.Reading: _named(impact.ComponentReset, impact.MassProjection),
        protocols.MassLaw: _named(mass.ConsistentMass, mass.Redistributed),
        protocols.Excitation: _named(
            excitation.Harmonic, excitation.Ricker, excitation.HalfSine, excitation.FullSine, excitation.Rectangular,
            excitation.Tabulated, GroundMotion,
        ),
        Record: {"read_record": callee(plain.record, name="read_record"), "synthetic": callee(synthetic)},
        Scheme: _named(
            Trapezoidal, ZienkiewiczWoodTaylor, SS22, Midpoint, Newmark, HHT, GeneralisedAlpha,
            GeneralisedAlpha.spectral_radius, Houbolt, ContactStabilisedNewmark, MoreauJean, LinearMultistep,
            LinearMultistep.newmark,
        ),
        Solver: _named(Condensed, volume.Volume, CrossChecked),
        SmallMethod: _named(ActiveSet, Hildreth, ProjectedCG),
        friction_small.FrictionMethod: frictional,
        extrapolation.Extrapolation: _named(extrapolation.Plain, extrapolation.Aitken, extrapolation.Anderson),
        volume.Method: _named(OneFactorisation, ReducedNewton, SemismoothNewton, TaoTron),
        time_steps.Schedule: _named(time_steps.Schedule),
        time_steps.HalvedAtImpact: _named(time_steps.HalvedAtImpact),
        Recorder: _named(
            recorders.Energy, recorders.Contact, recorders.Probe, Resultants, Racking, Reactions, SectionForces
        ),
        FieldWriter: _named(XDMF),
    }


def words(folder: Path) -> Words:
    """The words of a case file in this folder, to which its relative paths belong."""
    default = {
        materials.LinearElastic: "LinearElastic", Record: "read_record", ContactSurface: "contact_surface",
        Traction: "Traction", Dashpots: "Dashpots",
    }
    return Words(folder, _choices(), default, (Facets, Cells), short={Record: "path"})
