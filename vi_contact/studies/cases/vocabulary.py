"""Say the words of case files: which classes and functions a table may call where, all of them of the public interface.

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
from ...core.obstacles import Obstacle
from ...core.protocols import Excitation, FrictionLaw, ImpactLaw, MassLaw
from ...core.step import Recorder, Scheme, Solver
from ...core.surfaces import ContactSurface
from ...fem.contact.matching import Matching
from ...fem.dashpots import CompliantBase, Dashpots
from ...fem.loads import BodyForce, Prescribed, Traction
from ...fem.mesh import Cells, Facets
from ...ground_motion import Record, synthetic
from ...laws.impact import Reading
from ...laws.materials import Damping, LinearElastic, Section
from ...meshes.gmsh_session import MeshScript
from ...models.channel import sides
from ...run.files.writer import FieldWriter
from ...run.time_steps import HalvedAtImpact, Schedule
from ...soil.upgoing_wave import UpgoingVelocity, upgoing
from ...solvers import friction, normal, volume
from ...solvers.condensed import SmallMethod
from ...solvers.friction.extrapolation import Extrapolation
from ...solvers.friction.problem import FrictionMethod
from ...solvers.volume.route import Method
from . import table_functions as plain
from .conformity import defect, is_protocol
from .model_tables import MODELS, Parts
from .parsing import Words
from .table_calls import Callee, callee

_ROOMS: Mapping[Any, tuple[ModuleType, ...]] = {  # kind -> where its classes are listed
    MeshScript: (meshes,), LinearElastic: (laws,), Section: (laws,), Damping: (laws,), Prescribed: (fem,),
    Traction: (fem,), BodyForce: (fem,), Dashpots: (fem,), Obstacle: (core,), Matching: (fem,),
    FrictionLaw: (core, laws), ImpactLaw: (laws,), Reading: (laws,), MassLaw: (laws,),
    Excitation: (laws, ground_motion), Scheme: (schemes,), Solver: (solvers, run), SmallMethod: (normal,),
    FrictionMethod: (friction,), Extrapolation: (friction,), Method: (volume,), Schedule: (run,),
    HalvedAtImpact: (run,), Recorder: (run, engineering, fem), FieldWriter: (fem,),
}
_FUNCTIONS: Mapping[Any, Mapping[str, Callable[..., Any]]] = {  # kind -> word -> what it calls
    plain.MeshFile: {"read_mesh": plain.MeshFile},
    Dashpots: {"CompliantBase": plain.compliant_base, "FreeField": plain.free_field},
    CompliantBase: {"CompliantBase": plain.compliant_base},
    UpgoingVelocity: {"upgoing": upgoing},
    ContactSurface: {"contact_surface": plain.surface, "contact_pair": plain.pair},
    sides.Sides: {
        "Rollers": sides.Rollers, "Fixed": sides.Fixed, "TiedSides": sides.TiedSides,
        "DashpotSides": sides.DashpotSides, "FreeFieldSides": plain.free_field_sides,
    },
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
    for kind, rooms in _ROOMS.items():
        found[kind] = {one.name: one for room in rooms for one in _callees(room, kind)}
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
