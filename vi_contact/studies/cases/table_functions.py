"""Offer functions of the public interface in the form in which tables call them: no functions among their arguments."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core.checks import number
from ...core.corners import FEATURE_ANGLE
from ...core.obstacles import Obstacle
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem
from ...engineering.modal import lowest_frequency
from ...fem.contact.matching import Matching
from ...fem.contact.pairs import contact_pair
from ...fem.contact.surface import contact_surface
from ...fem.dashpots import CompliantBase
from ...fem.mesh import Facets
from ...ground_motion import Processing, Record, read_record
from ...ground_motion.formats.reader import LARGEST_PEAK
from ...laws import friction, materials
from ...laws.excitation import Harmonic
from ...models.channel.sides import FreeFieldSides
from ...soil.free_field import FreeField
from ...soil.upgoing_wave import UpgoingVelocity


class MeshFile:
    """Hold what [mesh] makes of type = "read_mesh": the path of a file for ``fem.read_mesh``."""

    def __init__(self, path: Path) -> None:
        self.path = path


def record(
    path: Path, units: str | None = None, *, dt: float | None = None, resample_dt: float | None = None,
    channel: int | None = None, largest: float = LARGEST_PEAK, processing: Processing | None = None,
) -> Record:
    """Read a record, ``read_record``, then apply ``processing``."""
    found = read_record(path, units, dt=dt, resample_dt=resample_dt, channel=channel, largest=largest)
    return found if processing is None else processing(found)


def surface(
    system: SemiDiscreteSystem, facets: Facets, *, obstacle: Obstacle | None = None,
    points: Sequence[tuple[float, ...]] | None = None, feature_angle: float = FEATURE_ANGLE, held: bool = False,
    springs: float | None = None, frictionless_corners: bool = False,
) -> ContactSurface:
    """Make a ``contact_surface``; held: ``.bilateral_everywhere()``; springs: ``.on_springs(stiffness)``; the last:
    ``.with_frictionless_corners()``."""
    found = contact_surface(system, facets, obstacle=obstacle, points=points, feature_angle=feature_angle)
    found = found if springs is None else found.on_springs(springs)
    found = found.with_frictionless_corners() if frictionless_corners else found
    return found.bilateral_everywhere() if held else found


def pair(
    system: SemiDiscreteSystem, facets1: Facets, facets2: Facets, *, matching: Matching | None = None,
    points: Sequence[tuple[float, ...]] | None = None, feature_angle: float = FEATURE_ANGLE, held: bool = False,
    frictionless_corners: bool = False,
) -> ContactSurface:
    """Make a ``contact_pair``; held: ``.bilateral_everywhere()``; the last: ``.with_frictionless_corners()``."""
    found = contact_pair(system, facets1, facets2, matching=matching, points=points, feature_angle=feature_angle)
    found = found.with_frictionless_corners() if frictionless_corners else found
    return found.bilateral_everywhere() if held else found


def first_mode_harmonic(
    system: SemiDiscreteSystem, *, amplitude: float, ratio: float = 0.5, direction: tuple[float, ...] = (1.0, 0.0)
) -> Harmonic:
    """Return the harmonic with ``ratio`` times the lowest frequency of the body without contact."""
    return Harmonic(amplitude, ratio * lowest_frequency(system), direction=direction)


def first_mode_period(system: SemiDiscreteSystem, *, parts: float) -> float:
    """Return the time step that divides the body's longest period into so many parts [s]."""
    return 1.0 / (number("the period", "parts", parts, positive=True) * lowest_frequency(system))


def free_field_sides() -> FreeFieldSides:
    """Return free-field ends of the channel's layer, on the base that the model has."""
    return FreeFieldSides(base=())


def compliant_base(
    facets: Facets, *, motion: UpgoingVelocity, material: materials.LinearElastic | None = None, normal: float = 1.0,
    tangential: float = 1.0,
) -> CompliantBase:
    return CompliantBase(facets, material, normal, tangential, motion=motion)


def free_field(
    excitations: Any, facets: Facets, *, base: CompliantBase | None = None,
    material: materials.LinearElastic | None = None, normal: float = 1.0, tangential: float = 1.0,
) -> FreeField:
    """Make a free-field side on the base of the run's excitations, or a compliant one."""
    foot = excitations if base is None else base
    return FreeField(facets, material, normal, tangential, base=foot)


def slip_rate(mu: friction.ExponentialDecay | friction.StaticKinetic) -> friction.SlipRateCoulomb:
    return friction.SlipRateCoulomb(mu)
