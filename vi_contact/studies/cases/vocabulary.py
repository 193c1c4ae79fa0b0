"""Say the words of case files: which classes and functions a table may call where, all of the public interface.

Rooms list their public classes once, in their ``__init__``; a class is a word wherever it is of the kind that is asked
for, and so are its named constructors ("GeneralisedAlpha.spectral_radius"). What takes functions has no word, or one in
``table_functions`` that takes none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, get_origin, get_type_hints

from ... import core, engineering, fem, ground_motion, laws, meshes, run, schemes, solvers
from ...core import ContactSurface, Excitation, FrictionLaw, ImpactLaw, MassLaw, Obstacle, Recorder, Scheme, Solver
from ...fem import BodyForce, Cells, CompliantBase, Dashpots, Facets, Prescribed, Traction
from ...fem.contact.matching import Matching
from ...ground_motion import Record, synthetic
from ...laws.impact import VelocityUpdate
from ...laws.materials import Damping, LinearElastic, Section
from ...meshes.gmsh_session import MeshScript
from ...models import channel
from ...run import HalvedAtImpact, Schedule
from ...run.files.writer import FieldWriter
from ...soil import UpgoingVelocity, upgoing
from ...solvers import friction, normal, volume
from ...solvers.condensed import SmallMethod
from ...solvers.friction.extrapolation import Extrapolation
from ...solvers.friction.problem import FrictionMethod
from ...solvers.volume.route import Method
from . import table_functions as plain
from .model_tables import MODELS, Parts
from .own_classes import defect, is_protocol
from .parsing import Words
from .table_calls import Callee, callee

_KINDS: Mapping[ModuleType, tuple[Any, ...]] = {  # room -> the kinds of things it lists
    core: (Obstacle, FrictionLaw),
    laws: (LinearElastic, Section, Damping, FrictionLaw, ImpactLaw, VelocityUpdate, MassLaw, Excitation),
    ground_motion: (Excitation,),
    meshes: (MeshScript,),
    fem: (Prescribed, Traction, BodyForce, Dashpots, Matching, Recorder, FieldWriter),
    solvers: (Solver,), normal: (SmallMethod,), friction: (FrictionMethod, Extrapolation), volume: (Method,),
    schemes: (Scheme,),
    run: (Solver, Schedule, HalvedAtImpact, Recorder),
    engineering: (Recorder,),
    channel: (channel.Sides,),
}
_FUNCTIONS: Mapping[Any, Mapping[str, Callable[..., Any]]] = {  # kind -> word -> what it calls
    plain.MeshFile: {"read_mesh": plain.MeshFile},
    Dashpots: {"CompliantBase": plain.compliant_base, "FreeField": plain.free_field},
    CompliantBase: {"CompliantBase": plain.compliant_base},
    UpgoingVelocity: {"upgoing": upgoing},
    ContactSurface: {"contact_surface": plain.surface, "contact_pair": plain.pair},
    channel.Sides: {"FreeFieldSides": plain.free_field_sides},
    FrictionLaw: {"SlipRateCoulomb": plain.slip_rate},
    ImpactLaw: {"Elastic": laws.Elastic},
    Record: {"read_record": plain.record, "synthetic": synthetic},
    Excitation: {"FirstModeHarmonic": plain.first_mode_harmonic},
    Schedule: {"FirstModePeriod": plain.first_mode_period},
}


def names_of(kind: Any) -> tuple[str, ...]:
    """Return the words for things of a kind: ``names_of(Scheme)`` are the schemes."""
    return tuple(_choices()[kind])


@cache
def _choices() -> Mapping[Any, Mapping[str, Callee]]:
    """Return kind -> word -> what it calls."""
    found: dict[Any, dict[str, Callee]] = {Parts: dict(MODELS)}
    for room, kinds in _KINDS.items():
        for kind in kinds:
            found.setdefault(kind, {}).update({one.name: one for one in _callees(room, kind)})
    for kind, functions in _FUNCTIONS.items():
        found.setdefault(kind, {}).update({name: callee(one, name=name) for name, one in functions.items()})
    return MappingProxyType(found)


def _callees(room: ModuleType, kind: Any) -> Iterator[Callee]:
    """Yield the public classes of a room that are of this kind, and named constructors; none that needs functions."""
    for cls in (getattr(room, name) for name in room.__all__):
        if isinstance(cls, type) and not is_protocol(cls) and not defect(cls, kind):
            made = [callee(one, name=one.__qualname__) for one in (cls, *_constructors(cls))]
            yield from (one for one in made if not any(_function(one.hints[name]) for name in one.required))


def _function(hint: Any) -> bool:
    return get_origin(hint) is Callable


def _constructors(cls: type) -> Iterator[Any]:
    """Yield the classmethods that return an object of the class."""
    for name, one in vars(cls).items():
        if isinstance(one, classmethod) and get_type_hints(one.__func__).get("return") is cls:
            yield getattr(cls, name)


def words(folder: Path, allowed: Sequence[str] = ()) -> Words:
    """Return the words of a case file in this folder, where its relative paths begin; ``allowed``: others' packages."""
    default = {
        LinearElastic: "LinearElastic", Record: "read_record", ContactSurface: "contact_surface", Traction: "Traction",
        Dashpots: "Dashpots",
    }
    return Words(folder, _choices(), default, (Facets, Cells), short={Record: "path"}, allowed=allowed)
