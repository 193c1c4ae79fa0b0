"""Say the words of case files: which classes and functions a table may call where.

Rooms list their public classes once, in their ``__init__``; a class is a word wherever it is of the
kind that is asked for, and so are its named constructors ("GeneralisedAlpha.spectral_radius"). What
takes functions has no word, or one of a function here that takes none.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Annotated, Any, get_origin, get_type_hints

from .... import core, fem, laws, layer, meshes, run, schemes, solvers
from ....beam import Start
from ....core import (
    ContactSurface,
    Excitation,
    FrictionLaw,
    ImpactLaw,
    MassLaw,
    Obstacle,
    Recorder,
    Scheme,
    Solver,
    State,
)
from ....core.arguments import check_arguments
from ....core.corners import FEATURE_ANGLE
from ....core.joint_laws import JointLaw
from ....core.quantities import RATIO, NotNegative, Positive, Unit
from ....core.system import SemiDiscreteSystem
from ....core.units import STANDARD_GRAVITY
from ....fem import (
    BodyForce,
    Cells,
    CompliantBase,
    Dashpots,
    Facets,
    Heterogeneous,
    Prescribed,
    Traction,
)
from ....fem.body.blending import Coupling
from ....fem.contact.matching import Matching
from ....laws.hyperelastic import TurningLaw
from ....laws.impact import VelocityUpdate
from ....laws.materials import DampedBy, Damping, Density, LinearElastic, Section
from ....laws.orthotropic import Orthotropic
from ....laws.yielding import Modulus, Poisson, YieldingMaterial
from ....meshes.gmsh_session import MeshScript
from ....run import BySlipRate, ErrorControlled, HalvedAtImpact, Schedule
from ....run.files.writer import FieldWriter
from ....solvers import friction, normal, volume
from ....solvers.condensed import SmallMethod
from ....solvers.friction.extrapolation import Extrapolation
from ....solvers.friction.problem import FrictionMethod
from ....solvers.volume.route import Method
from ... import engineering, ground_motion, soil
from ...engineering import checks
from ...engineering.checks.comparison import Check
from ...ground_motion.design_spectrum import DesignSpectrum
from ...ground_motion.record import LARGEST_PEAK, Record
from ...soil import SoilCurves, UpgoingVelocity
from . import bodies
from .bodies import BeamBody, LayerLaw, ParticleBody
from .description import design_spectra
from .expressions import Expression, Places
from .own_classes import describe_defect, is_protocol
from .parsing import Words
from .table_calls import Callee, make_callee

_KINDS: Mapping[ModuleType, tuple[Any, ...]] = {  # room -> the kinds of things it lists
    core: (Obstacle, FrictionLaw),
    laws: (
        LinearElastic,
        Orthotropic,
        YieldingMaterial,
        TurningLaw,
        Section,
        Damping,
        FrictionLaw,
        ImpactLaw,
        VelocityUpdate,
        MassLaw,
        Excitation,
        JointLaw,
    ),
    ground_motion: (Excitation,),
    meshes: (MeshScript,),
    fem: (Prescribed, Traction, BodyForce, Dashpots, Matching, Coupling, FieldWriter),
    solvers: (Solver,),
    normal: (SmallMethod,),
    friction: (FrictionMethod, Extrapolation),
    volume: (Method,),
    schemes: (Scheme,),
    run: (Solver, Schedule, HalvedAtImpact, ErrorControlled, BySlipRate, Recorder),
    checks: (Check,),
    soil: (SoilCurves,),
}


# of a table [[contact]]: ``friction_of_tables`` reads it
FrictionCoefficient = Annotated[float, NotNegative, RATIO]


@dataclass(frozen=True)
class MeshFile:
    """Hold what [mesh] makes of type = "read_mesh": the path of a file for ``fem.read_mesh``."""

    path: Path


def record(
    path: Path,
    units: str | None = None,
    *,
    dt: Annotated[float | None, Unit("s")] = None,
    resample_dt: Annotated[float | None, Unit("s")] = None,
    channel: int | str | None = None,
    largest: Annotated[float, Unit("m/s²")] = LARGEST_PEAK,
    processing: "ground_motion.Processing | None" = None,
) -> Record:
    """Read a record, ``read_record``, then apply ``processing``.

    Args:
        path: of the file.
        units: of its numbers, where the file does not state them.
        dt: its time step [s], where the file does not state one.
        resample_dt: time step [s] to which it is brought; None: its own.
        channel: which component of a file that holds several, a number from 1 or a name.
        largest: the greatest peak that is believed [m/s²].
        processing: what is done to it; None: nothing.
    """
    record = ground_motion.read_record(
        path, units, dt=dt, resample_dt=resample_dt, channel=channel, largest=largest
    )
    return record if processing is None else processing(record)


@check_arguments
def surface(
    system: SemiDiscreteSystem,
    facets: Facets | None = None,
    *,
    obstacle: Obstacle | None = None,
    points: Annotated[Sequence[tuple[float, ...]] | None, Unit("m")] = None,
    feature_angle: Annotated[float, Unit("rad")] = FEATURE_ANGLE,
    roller: bool = False,
    springs: Annotated[float | None, Unit("Pa/m")] = None,
    frictionless_corners: bool = False,
    hinges: bool = False,
    mu: FrictionCoefficient | None = None,
    joint: JointLaw | None = None,
    name: str = "",
) -> ContactSurface:
    """Make a ``contact_surface``.

    Args:
        system: of the body.
        facets: the part of its boundary; None: all of it, of a body that turns.
        obstacle: what it may touch; None: ``Touching()``.
        points: (k, d) [m]; only the nodes nearest to them have conditions; None: all have.
        feature_angle: angle [rad]; facets that turn by less from one another are one smooth face.
        roller: makes it bilateral everywhere: it slides along the face and stays on it.
        springs: foundation modulus [Pa/m] of the springs on which it rests; None: without.
        frictionless_corners: whether nodes with several conditions slide freely over their faces.
        hinges: whether the body may hang together with another one by nodes of this boundary.
        mu: coefficient of friction of this surface; None: that of [friction].
        joint: law of a joint whose strength changes, in the place of mu and [friction]; None: none.
        name: of the surface, as ``part`` of recorders.
    """
    result = fem.contact_surface(
        system, facets, obstacle=obstacle, points=points, feature_angle=feature_angle, hinges=hinges
    )
    if springs is not None:
        result = result.on_springs(springs)
    if frictionless_corners:
        result = result.with_frictionless_corners()
    return result.bilateral_everywhere() if roller else result


@check_arguments
def pair(
    system: SemiDiscreteSystem,
    facets1: Facets,
    facets2: Facets,
    *,
    matching: Matching | None = None,
    points: Annotated[Sequence[tuple[float, ...]] | None, Unit("m")] = None,
    feature_angle: Annotated[float, Unit("rad")] = FEATURE_ANGLE,
    roller: bool = False,
    frictionless_corners: bool = False,
    hinges: bool = False,
    mu: FrictionCoefficient | None = None,
    joint: JointLaw | None = None,
    name: str = "",
) -> ContactSurface:
    """Make a ``contact_pair``; roller: ``.bilateral_everywhere()``; the others: as of ``surface``.

    Args:
        system: of the bodies.
        facets1: side 1, whose nodes have the conditions.
        facets2: side 2.
        matching: how side 1 finds side 2; None: ``NodeToNode()``.
        points: as of ``surface``.
        feature_angle: as of ``surface``.
        roller: as of ``surface``.
        frictionless_corners: as of ``surface``.
        hinges: as of ``surface``.
        mu: as of ``surface``.
        joint: as of ``surface``.
        name: as of ``surface``.
    """
    result = fem.contact_pair(
        system,
        facets1,
        facets2,
        matching=matching,
        points=points,
        feature_angle=feature_angle,
        hinges=hinges,
    )
    if frictionless_corners:
        result = result.with_frictionless_corners()
    return result.bilateral_everywhere() if roller else result


@check_arguments
def pairs(
    system: SemiDiscreteSystem,
    *,
    within: Annotated[float, NotNegative, Unit("m")] = 0.0,
    between: Sequence[Cells] | None = None,
    matching: Matching | None = None,
    frictionless_corners: bool = False,
    mu: FrictionCoefficient | None = None,
    name: str = "",
) -> ContactSurface:
    """Make ``contact_pairs`` of all bodies that touch; the others: as of ``surface``.

    Args:
        system: of the bodies.
        within: largest gap of a joint [m].
        between: one group of whole bodies, or two; None: all bodies.
        matching: how side 1 of a joint finds side 2; None: ``NodeToNode()`` where facets of both
            are the same, ``DualMortar()`` elsewhere.
        frictionless_corners: as of ``surface``.
        mu: as of ``surface``.
        name: as of ``surface``.
    """
    result = fem.contact_pairs(system, within=within, between=between, matching=matching)
    return result.with_frictionless_corners() if frictionless_corners else result


def weight(
    system: SemiDiscreteSystem,
    *,
    acceleration: Annotated[float, Unit("m/s²")] = STANDARD_GRAVITY,
    direction: Annotated[tuple[float, ...] | None, RATIO] = None,
    cells: Cells | None = None,
) -> SemiDiscreteSystem:
    """Return the system ``with_weight``.

    Args:
        system: without weight.
        acceleration: of gravity [m/s²].
        direction: (d,) in which it acts; None: downwards.
        cells: a group of whole bodies, which alone have weight; None: all have.
    """
    bodies = None if cells is None else fem.bodies_of(system, cells)
    return laws.with_weight(system, acceleration=acceleration, direction=direction, bodies=bodies)


def first_mode_harmonic(
    system: SemiDiscreteSystem,
    *,
    amplitude: Annotated[float, Unit("m/s²")],
    ratio: Annotated[float, RATIO] = 0.5,
    direction: Annotated[tuple[float, ...], RATIO] = (1.0, 0.0),
) -> laws.Harmonic:
    """Return the harmonic with ``ratio`` times the lowest frequency of the body without contact.

    Args:
        system: of the body.
        amplitude: of the acceleration [m/s²].
        ratio: of the two frequencies [-].
        direction: (d,) of the acceleration.
    """
    return laws.Harmonic(
        amplitude, ratio * engineering.lowest_frequency(system), direction=direction
    )


@check_arguments
def first_mode_period(system: SemiDiscreteSystem, *, parts: Annotated[float, Positive]) -> float:
    """Return the time step that divides the body's longest period into so many parts [s]."""
    return 1.0 / (parts * engineering.lowest_frequency(system))


def heterogeneous(
    E: Annotated[float | Expression, Unit("Pa")],
    nu: Annotated[float | Expression, RATIO],
    rho: Annotated[float | Expression, Unit("kg/m³")],
    xi: Annotated[float | Expression, RATIO] = 0.0,
) -> Heterogeneous:
    """Make a heterogeneous material.

    Args:
        E: Young's modulus [Pa], a number or an expression of x, y, z [m], as all of these.
        nu: Poisson's ratio [-].
        rho: density [kg/m³].
        xi: damping ratio [-].
    """

    def make_field(value: float | Expression) -> Any:
        if not isinstance(value, Expression):
            return value
        places = Places(value)
        return lambda x: places(x.T)  # finite elements give coordinates as (3, k)

    return Heterogeneous(make_field(E), make_field(nu), make_field(rho), make_field(xi))


def iwan(
    E: Modulus,
    nu: Poisson,
    rho: Density,
    curve: Annotated[SoilCurves | Sequence[tuple[float, float]], RATIO],
    xi: DampedBy = 0.0,
) -> laws.Iwan:
    """Make an ``Iwan`` of pairs, or of G/Gmax of published curves.

    Args:
        E: Young's modulus at small strains [Pa].
        nu: Poisson's ratio [-].
        rho: density [kg/m³].
        curve: pairs (shear strain, G/Gmax), or curves of soil.
        xi: damping ratio [-].
    """
    if isinstance(curve, SoilCurves):
        curve = list(zip(curve.strain, curve.reduction, strict=True))
    return laws.Iwan(E, nu, rho, curve, xi=xi)


def analytic_gap(function: Annotated[Expression, Unit("m")]) -> core.AnalyticGap:
    """Make a ``core.AnalyticGap``."""
    return core.AnalyticGap(Places(function))


def resultants(
    name: str = "",
    centre: Annotated[tuple[float, ...] | None, Unit("m")] = None,
    normal: tuple[float, ...] | None = None,
    part: Facets | str | tuple[tuple[float, ...], ...] | None = None,
    toe: Annotated[tuple[float, ...] | None, Unit("m")] = None,
) -> run.Resultants:
    """Record ``Resultants``; part: the name of a [[contact]] or of a boundary group, or a box.

    Args:
        name: of the columns.
        centre: (d,) point of reference [m]; None: as of ``Resultants``.
        normal: (d,) direction of N towards the support; None: the mean contact direction.
        part: of the contact; None: all of it.
        toe: (d,) point at the end over which the body would tip [m].
    """
    return run.Resultants(name, centre, normal=normal, part=part, toe=toe)


def probe(
    points: Annotated[Mapping[Any, tuple[float, ...]], Unit("m")],
    velocity: bool = False,
    acceleration: bool = False,
    nearest: bool = False,
    cells: Cells | None = None,
) -> run.Probe:
    """Record ``Probe``, at points of a cell group where ``cells`` names one.

    Args:
        points: label -> (d,) [m].
        velocity: whether velocities are recorded too.
        acceleration: whether absolute accelerations are recorded too.
        nearest: whether every point takes its nearest node.
        cells: the body that the points are of; None: the whole mesh.
    """
    return run.Probe(points, velocity, acceleration, nearest, cells)


def upgoing(
    excitations: Any,
    motion: Record | Excitation | Sequence[Excitation] | None = None,
    *,
    direction: Annotated[tuple[float, ...], RATIO] = (1.0, 0.0),
    dt: Annotated[float | None, Unit("s")] = None,
    outcrop: bool = True,
) -> Any:
    """Return ``soil.upgoing`` of a motion, or of the run's excitations.

    These then come up through the base alone.

    Args:
        excitations: of the run.
        motion: another motion; None: the excitations.
        direction: (d,) of a record.
        dt: step of the integration [s]; None: that of the record.
        outcrop: whether the motion is that of an outcrop; False: it is upgoing already.
    """
    return soil.upgoing(
        excitations if motion is None else motion, direction=direction, dt=dt, outcrop=outcrop
    )


def compliant_base(
    facets: Facets,
    *,
    motion: UpgoingVelocity,
    material: LinearElastic | None = None,
    normal: float = 1.0,
    tangential: float = 1.0,
) -> CompliantBase:
    """Make a ``fem.CompliantBase``.

    Args:
        facets: the base.
        motion: t [s] -> velocity (d,) [m/s] of the upgoing wave.
        material: of the half-space below; None: of the cells at the base.
        normal: factor of rho c_P [-].
        tangential: factor of rho c_S [-].
    """
    return CompliantBase(facets, material, normal, tangential, motion=motion)


def free_field(
    excitations: Any,
    facets: Facets,
    *,
    base: CompliantBase | None = None,
    material: LinearElastic | None = None,
    normal: float = 1.0,
    tangential: float = 1.0,
) -> "soil.FreeField":
    """Make a free-field side on the base of the run's excitations, or a compliant one.

    Args:
        excitations: of the run.
        facets: the side.
        base: the compliant base on which its column stands; None: that of the excitations.
        material: of the dashpots; None: of the cells at the side.
        normal: factor of rho c_P [-].
        tangential: factor of rho c_S [-].
    """
    column_base = excitations if base is None else base
    return soil.FreeField(facets, material, normal, tangential, base=column_base)


@dataclass(frozen=True)
class Parts:
    """Hold what a problem is made of.

    Attributes:
        system: the equations.
        surface: the contact conditions.
        tags: groups of the mesh.
        weighted: it carries its weight, and starts from its equilibrium.
        moved: the excitations come up through its base, and are no inertia load.
        mass: the law of a body without a mesh, or with a layer.
        tables: how many parts of the surface each [[contact]] has: one, or one for each joint that
            is found.
        begins: where a static stage begins; None: in the displacements at the start.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    tags: Any
    weighted: bool = False
    moved: bool = False
    mass: MassLaw | None = None
    tables: tuple[int, ...] = ()
    begins: State | None = None

    @property
    def steady(self) -> bool:
        """Say whether they serve other excitations too: nothing in them moves with these."""
        return not (self.system.companions or self.surface.companions or self.moved)


# kind -> word -> what it calls, when asked
_FUNCTIONS: Mapping[Any, Mapping[str, Callable[[], Any]]] = {
    MeshFile: {"read_mesh": lambda: MeshFile},
    Dashpots: {"CompliantBase": lambda: compliant_base, "FreeField": lambda: free_field},
    CompliantBase: {"CompliantBase": lambda: compliant_base},
    UpgoingVelocity: {"upgoing": lambda: upgoing},
    ContactSurface: {
        "contact_surface": lambda: surface,
        "contact_pair": lambda: pair,
        "contact_pairs": lambda: pairs,
    },
    ImpactLaw: {"Elastic": lambda: laws.Elastic},
    Record: {"read_record": lambda: record, "synthetic": lambda: ground_motion.synthetic},
    DesignSpectrum: design_spectra.CHOICES,
    Excitation: {"FirstModeHarmonic": lambda: first_mode_harmonic},
    Schedule: {"FirstModePeriod": lambda: first_mode_period},
    Heterogeneous: {"Heterogeneous": lambda: heterogeneous},
    YieldingMaterial: {"Iwan": lambda: iwan},
    Obstacle: {"AnalyticGap": lambda: analytic_gap},
    Recorder: {"Resultants": lambda: resultants, "Probe": lambda: probe},
    BeamBody: {
        name: lambda name=name: getattr(bodies, name)  # type: ignore[misc]
        for name in ("rod_problem", "beam_problem", "rubbing_problem")
    },
    ParticleBody: {"particle_problem": lambda: bodies.particle_problem},
    Start: {"Start": lambda: bodies.start},
    LayerLaw: {
        "contact_layer": lambda: bodies.contact_layer,
        "ContactLayer": lambda: layer.ContactLayer,
    },
}


# kind -> where a case file makes such a thing: a table, or the key of one
_PLACES: tuple[tuple[Any, str], ...] = (
    (Scheme, "[scheme]"),
    (Solver, "[solver]"),
    (FrictionLaw, "[friction]"),
    (ImpactLaw, "[impact]"),
    (MassLaw, "[mass]"),
    (Excitation, "[[excitation]]"),
    (Recorder, "[[record]]"),
    (FieldWriter, "[fields]"),
    (MeshScript, "[mesh]"),
    (LinearElastic, "[material.NAME]"),
    (Orthotropic, "[material.NAME]"),
    (Heterogeneous, "[material.NAME]"),
    (YieldingMaterial, "[material.NAME]"),
    (TurningLaw, "[material.NAME]"),
    (Damping, "[system.damping]"),
    (Section, "[system.section]"),
    (Traction, "[[system.loads]]"),
    (BodyForce, "[[system.loads]]"),
    (Prescribed, "[[system.prescribed]]"),
    (Dashpots, "[[system.dashpots]]"),
    (Matching, "matching"),
    (JointLaw, "joint"),
    (Obstacle, "obstacle"),
    (SmallMethod, "method"),
    (FrictionMethod, "method"),
    (Method, "method"),
    (Extrapolation, "extrapolation"),
    (VelocityUpdate, "update"),
)


def find_word(name: str) -> tuple[str, tuple[str, ...]] | None:
    """Return the table or key of a case file that makes an object of a class, and its keys.

    Args:
        name: of the class, or of a constructor, as "GeneralisedAlpha.spectral_radius".

    Returns:
        "[scheme]" or "matching", and the names of the parameters; None where no case file has it.
    """
    choices_of_kind = _gather_choices()
    for kind, place in _PLACES:
        try:
            return place, tuple(choices_of_kind[kind][name].quantities)
        except KeyError:
            continue
    return None


def list_names(kind: Any) -> tuple[str, ...]:
    """Return the words for things of a kind: ``list_names(Scheme)`` are the schemes."""
    return tuple(_gather_choices()[kind])


@cache
def _gather_choices() -> Mapping[Any, Mapping[str, Callee]]:
    """Return kind -> word -> what it calls."""
    kinds_of_rooms = (kind for kinds in _KINDS.values() for kind in kinds)
    return MappingProxyType({kind: _Choices(kind) for kind in (*kinds_of_rooms, *_FUNCTIONS)})


class _Choices(Mapping[str, Callee]):
    """Find the words for a kind, each when it is asked for.

    Most are of modules that a case does not need.
    """

    def __init__(self, kind: Any) -> None:
        self._kind = kind
        self._rooms = [room for room, kinds in _KINDS.items() if kind in kinds]

    def _find(self, names: Sequence[str] | None = None) -> dict[str, Callee]:
        """Return what words with these names before the dot call; of all if it is None."""
        choices: dict[str, Callee] = {}
        for room in self._rooms:
            classes = room.__all__
            if names is not None:
                classes = [name for name in names if name in room.__all__]
            for target in _make_callees(room, self._kind, classes):
                choices[target.name] = target
        for name, load in _FUNCTIONS.get(self._kind, {}).items():
            if names is None or name in names:
                choices[name] = make_callee(load(), name=name)
        return choices

    @cached_property
    def _all(self) -> dict[str, Callee]:
        return self._find()

    def __getitem__(self, word: str) -> Callee:
        return self._find([word.partition(".")[0]])[word]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __bool__(self) -> bool:
        return True  # without looking


def _make_callees(room: ModuleType, kind: Any, names: Sequence[str]) -> Iterator[Callee]:
    """Yield the classes of these names that are of this kind.

    Named constructors are among them; none needs functions.
    """
    for cls in (getattr(room, name) for name in names):
        if not isinstance(cls, type) or is_protocol(cls) or describe_defect(cls, kind):
            continue
        targets = [
            make_callee(function, name=function.__qualname__)
            for function in (cls, *_list_constructors(cls))
        ]
        yield from (target for target in targets if not _needs_function(target))


def _needs_function(target: Callee) -> bool:
    """Tell whether a parameter without a default is a function, which no file can give."""
    return any(get_origin(target.hints[name]) is Callable for name in target.required)


def _list_constructors(cls: type) -> Iterator[Any]:
    """Yield the classmethods that return an object of the class."""
    for name, member in vars(cls).items():
        if isinstance(member, classmethod):
            returned = get_type_hints(member.__func__).get("return")
            if returned is cls:
                yield getattr(cls, name)


def make_words(folder: Path, allowed: Sequence[str] = ()) -> Words:
    """Return the words of a case file in this folder.

    Its relative paths begin there; ``allowed`` are others' packages.
    """
    default = {
        LinearElastic: "LinearElastic",
        Record: "read_record",
        ContactSurface: "contact_surface",
        Traction: "Traction",
        Dashpots: "Dashpots",
        FieldWriter: "XDMF",
        LayerLaw: "contact_layer",
        JointLaw: "Joint",
        DesignSpectrum: design_spectra.DEFAULT,
    }
    return Words(
        folder, _gather_choices(), default, (Facets, Cells), short={Record: "path"}, allowed=allowed
    )
