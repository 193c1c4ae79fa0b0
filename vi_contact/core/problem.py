"""State the problem that is marched.

It is a semi-discrete system, its contact surface, and the laws of both.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from .algebra import Array
from .checks import array, instance, optional, provides, refuse, shown
from .collective import Parts, agree
from .corners import refuse_rubbing
from .errors import InputError
from .protocols import EXCITATION, Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from .surfaces import ContactSurface
from .system import Load, SemiDiscreteSystem, history_value
from .timing import report_time


@dataclass(frozen=True)
class ContactProblem:
    """Pose a problem of contact.

    It is a semi-discrete system, its contact surface, its excitation, and the laws of friction and
    impact.

    The system is turned into the nodal frames of the surface here, once. ``impact=None`` leaves
    velocities unchanged. ``mass=None`` leaves the choice of the mass matrix to the time scheme.
    InputError is raised on all ranks for parts of the wrong kind or size, and for a surface of
    another system. A friction law that is a dataclass may hold tuples with a value for every
    contact point: of this rank, or of all ranks by their numbers. Collective.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    friction: FrictionLaw = field(default_factory=Frictionless)
    impact: ImpactLaw | None = None
    excitation: Excitation | Sequence[Excitation] = ()
    mass: MassLaw | None = None

    def __post_init__(self) -> None:
        laws = {name: Parts(getattr(self, name)) for name in ("friction", "impact", "mass")}
        if isinstance(self.surface, ContactSurface):
            agree(self.surface.comm, "ContactProblem", laws | {"excitation": self.excitation})
        check_parts(self)
        total, slots = self.surface.total, self.surface.slots
        own = with_values(
            self.friction,
            self.surface,
            lambda v: tuple(v[i] for i in slots) if len(v) == total else v,
        )
        object.__setattr__(self, "friction", own)

    def __repr__(self) -> str:
        """Return unknowns, conditions and laws in a few lines, not the arrays.

        They are those of all ranks.
        """
        laws = {
            "friction": self.friction,
            "impact": self.impact,
            "mass": self.mass or "that of the time scheme",
        }
        parts = [
            self.system,
            self.surface,
            *(f"{name}: {shown(one)}" for name, one in laws.items()),
        ]
        parts += [f"excitation: {shown(one)}" for one in self.excitations]
        return "\n  ".join(
            [f"ContactProblem with {self.surface.total} contact conditions", *map(str, parts)]
        )

    @cached_property
    def excitations(self) -> tuple[Excitation, ...]:
        """Return the excitations as a tuple."""
        return (
            tuple(self.excitation) if isinstance(self.excitation, Sequence) else (self.excitation,)
        )

    @cached_property
    @report_time("mass")
    def unshaken(self) -> SemiDiscreteSystem:
        """Return the system in the rotated basis, with the mass law in it, without excitation."""
        system = self.turned
        if self.mass is not None:
            system = self.mass.apply(system, self.surface, tangential=self.frictional)
        return self._relative(system)

    @cached_property
    def equations(self) -> SemiDiscreteSystem:
        """Return the system that schemes see.

        It is in the rotated basis, with the inertia loads -M r a_g(t).
        """
        system = self.unshaken
        ways = (
            (np.asarray(one.direction, dtype=float), one.acceleration) for one in self.excitations
        )
        shaken = system.with_load(
            *((-system.inertia(direction), history) for direction, history in ways)
        )
        return system.loaded(shaken.load)

    def beside(self, other: "ContactProblem") -> "ContactProblem | None":
        """Return the same problem with the matrices of another one.

        It also has the factors made of them. It is None where these are not its own: for another
        system, surface, mass or impact law, or friction where the other has none.
        """
        ours, theirs = ((one.system, one.surface, one.frictional) for one in (self, other))
        if any(a is not b for a, b in zip(ours, theirs, strict=True)):
            return None
        if (self.mass, self.impact) != (other.mass, other.impact):
            return None
        if self.__dict__.get("unshaken") is other.unshaken:
            return self
        made = replace(self)
        made.__dict__["unshaken"] = other.unshaken
        return made

    @cached_property
    def static_load(self) -> SemiDiscreteSystem:
        """Return the system of the gravity stage.

        It is in the basis of the equations, without excitation.
        """
        return self._relative(self.turned)

    @cached_property
    def turned(self) -> SemiDiscreteSystem:
        """Return the system in the nodal frames, every body in its own unknowns.

        There is one for all problems on a surface.
        """
        system, basis, dual = self.system, self.surface.basis, self.surface.dual
        if basis is None:
            return system
        known: dict[Any, tuple[Load, SemiDiscreteSystem]] = system.cached("turned", dict)
        if (basis, dual) not in known:
            known.clear()  # it takes as much memory as the system
            known[basis, dual] = system.load, system.in_basis(basis, dual)
        load, turned = known[basis, dual]
        if load is system.load:
            return turned
        # the matrices are shared with systems of other loads
        return turned.loaded(system.load.in_basis(basis))

    def _relative(self, system: SemiDiscreteSystem) -> SemiDiscreteSystem:
        return (
            system if self.surface.coupling is None else system.in_relative(self.surface.coupling)
        )

    @property
    def frictional(self) -> bool:
        """Say whether tangential reactions can occur at all."""
        return not isinstance(self.friction, Frictionless)

    def slip_origin(self, u: Array, start: float, end: float) -> Array | None:
        """Return B_t u plus what the obstacle slides; None without friction.

        The slip of a step is zero there.
        """
        return self.surface.slip_origin(u, start, end) if self.frictional else None

    def cartesian(self, x: Array) -> Array:
        """Return T R x: unknowns of the equations back to the system's own."""
        x = x if self.surface.coupling is None else self.surface.coupling @ x
        return x if self.surface.basis is None else self.surface.basis @ x

    def ground_acceleration(self, t: float) -> Array:
        """Return the vector a_g(t) [m/s²] summed over the excitations."""
        found = [0.0] * self.system.influence.shape[1]
        for one in self.excitations:
            a = float(history_value(one.acceleration, t))
            found = [so_far + a * way for so_far, way in zip(found, one.direction, strict=True)]
        return np.array(found)


def with_values(
    law: Any, surface: ContactSurface, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]
) -> Any:
    """Return the law with its tuples changed on several ranks.

    So are those of the laws that it is made of.
    """
    if surface.comm.size == 1 or not is_dataclass(law) or isinstance(law, type):
        return law
    found: dict[str, Any] = {}
    for name, value in ((one.name, getattr(law, one.name)) for one in fields(law) if one.init):
        new = change(value) if isinstance(value, tuple) else with_values(value, surface, change)
        found |= {} if new is value else {name: new}
    return replace(law, **found) if found else law


def check_parts(problem: Any) -> None:
    """Raise InputError, on all ranks, for parts of the wrong kind or size.

    Parts that were made for another system are refused too. Collective.

    Identity counts: a surface that ``fem`` made carries the space it was made on, and only systems
    of that space take it. Sizes are compared on all ranks together, so that all of them raise the
    same sentence.
    """
    owner, system, surface, excitations = (
        "ContactProblem",
        problem.system,
        problem.surface,
        problem.excitations,
    )
    instance(
        owner, "system", system, SemiDiscreteSystem, "give a system, such as fem.assemble returns"
    )
    instance(
        owner,
        "surface",
        surface,
        ContactSurface,
        "give a contact surface, such as fem.contact_surface returns",
    )
    provides(
        owner,
        "friction",
        problem.friction,
        ("limit", "slope", "at"),
        "give Coulomb(mu) or another friction law",
    )
    optional(
        provides,
        owner,
        "impact",
        problem.impact,
        ("target", "apply"),
        "give Inelastic() or another law, or None",
    )
    if problem.mass is not None:
        remedy = "give Redistributed() or ConsistentMass(), or None"
        provides(owner, "mass", problem.mass, ("apply",), remedy, lacks=("target",))
    for excitation in excitations:
        _check_excitation(excitation, system)
    if system.absolute and excitations:
        raise InputError(
            "a compliant base is shaken by its own upgoing motion: leave out the excitation of the "
            "problem, whose inertia load belongs to a rigid base"
        )
    if surface.space is not None and surface.space is not system.space:
        raise InputError(
            "ContactProblem: the contact surface was made for another system with other unknowns: "
            "make it for this one by fem.contact_surface(system, …)"
        )
    if surface.comm.size != system.algebra.comm.size:
        raise InputError(
            f"ContactProblem: the surface is shared by {surface.comm.size} ranks and the system by "
            f"{system.algebra.comm.size}: make both on the same ranks"
        )
    refuse((*_of_system(system), *_of_surface(surface, system, surface.total)), surface.comm)
    if problem.frictional:
        refuse_rubbing(surface)
    _refuse_repeated(excitations)


def _refuse_repeated(excitations: Sequence[Any]) -> None:
    """Raise InputError for an excitation that is named twice: it would shake twice."""
    for one, other in combinations(excitations, 2):
        if one is other:
            raise InputError(
                f"ContactProblem: excitation names {shown(one)} twice, which would shake twice: "
                "leave it out once, or scale it"
            )


def _check_excitation(excitation: Any, system: SemiDiscreteSystem) -> None:
    remedy = "give Harmonic(…), GroundMotion(record) or another excitation, or a list of them"
    provides("ContactProblem", "excitation", excitation, EXCITATION, remedy)
    array("ContactProblem", "the direction of an excitation", excitation.direction, (None,))
    if len(excitation.direction) != system.influence.shape[1]:
        raise InputError(
            f"excitation direction {excitation.direction} has {len(excitation.direction)} "
            f"components but the body has {system.influence.shape[1]}: give one component per "
            "dimension"
        )


def _of_system(system: SemiDiscreteSystem) -> Iterator[str]:
    """Return what is wrong with the sizes of a system on this rank."""
    n = system.rows
    d = system.influence.shape[1]
    for name in ("M", "K", "C"):
        matrix = getattr(system, name)
        if matrix is not None and matrix.rows != n:
            yield (
                f"the system has {n} unknowns in u0 but {matrix.rows} rows in {name}: "
                "give matrices of one system"
            )
    shapes = {"v0": (n,), "influence": (n, d), "base_mass": (n, d), "massless": (n,), "tied": (n,)}
    values = {name: getattr(system, name) for name in shapes} | {
        "load.constant": system.load.constant
    }
    yield from _sizes("the system", values, shapes | {"load.constant": (n,)})
    for name in ("u0", "v0"):
        if not np.isfinite(np.sum(getattr(system, name))):
            yield f"the system's {name} contains NaN or infinite values: give finite initial values"


def _sizes(owner: str, values: dict[str, Any], shapes: dict[str, tuple[int, ...]]) -> Iterator[str]:
    for name, shape in shapes.items():
        if values[name] is not None and np.shape(values[name]) != shape:
            yield f"{owner} has {name} of shape {np.shape(values[name])}: give one of shape {shape}"


def _of_surface(surface: ContactSurface, system: SemiDiscreteSystem, total: int) -> Iterator[str]:
    """Return what is wrong with a surface on this rank.

    Its places in the unknowns of the system are looked at too.
    """
    m, d, n = surface.count, system.influence.shape[1], system.rows
    shapes: dict[str, tuple[int, ...]] = {
        "points": (m, d),
        "normals": (m, d),
        "tangents": (m, d - 1),
    }
    shapes |= dict.fromkeys(("gap0", "weights", "bilateral", "compliance", "owned", "slots"), (m,))
    yield from _sizes(
        "the contact surface", {name: getattr(surface, name) for name in shapes}, shapes
    )
    for name, least, most in (("owned", 0, n), ("tangents", -1, n), ("slots", 0, total)):
        values = getattr(surface, name)
        if np.size(values) and not (least <= np.min(values) and np.max(values) < most):
            yield (
                f"the contact surface has {name} from {np.min(values)} to {np.max(values)}, "
                f"outside {least} to {most - 1}: make the surface for this system, which has "
                "another size"
            )
    if np.any(np.diff(surface.slots) <= 0):
        yield (
            "the contact surface has slots that do not ascend: number its conditions in the order "
            "of their rows"
        )
    if np.isnan(np.sum(surface.gap0)):
        yield "the contact surface has NaN in gap0: check the obstacle's gap function"
    if not (np.all(surface.weights > 0.0) and np.all(surface.compliance >= 0.0)):
        yield (
            "the contact surface has weights of zero or less, or a compliance below zero: "
            "give lengths or areas"
        )
