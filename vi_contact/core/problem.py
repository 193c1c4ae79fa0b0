"""State the problem that is marched: a system, its contact surface, and the laws of both."""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from .algebra import Array
from .checks import array, instance, optional, provides, quote, refuse
from .collective import Parts, agree
from .corners import let_corners_rub
from .errors import InputError
from .internal import remembers
from .joint_laws import JointLaw, refuse_overstressed
from .protocols import EXCITATION, Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from .surfaces import ContactSurface
from .system import Load, SemiDiscreteSystem, evaluate_history
from .timing import report_time


@dataclass(frozen=True)
class ContactProblem:
    """Pose a problem of contact. Collective.

    The system is turned into the nodal frames of the surface here, once. InputError is raised on
    all ranks for parts of the wrong kind or size, and for a surface of another system.

    Attributes:
        system: the semi-discrete system.
        surface: its contact conditions; beside friction those of nodes with several conditions are
            made anew, as traces with a law for each (``ContactSurface.with_own_laws``).
        friction: the law of friction. One that is a dataclass may hold tuples with a value for
            every contact point: of this rank, or of all ranks by their numbers.
        impact: the law that changes velocities after a step; None leaves them unchanged.
        excitation: what shakes the ground, one excitation or several.
        mass: the mass law; None leaves the choice to the time scheme.
        joint: the law of a joint whose strength changes, in the place of ``friction``; None for
            none. Its values may be functions of the points, and tuples as those of ``friction``.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    friction: FrictionLaw = field(default_factory=Frictionless)
    impact: ImpactLaw | None = None
    excitation: Excitation | Sequence[Excitation] = ()
    mass: MassLaw | None = None
    joint: JointLaw | None = None

    def __post_init__(self) -> None:
        names = ("friction", "impact", "mass", "joint")
        laws = {name: Parts(getattr(self, name)) for name in names}
        if isinstance(self.surface, ContactSurface):
            agree(self.surface.comm, "ContactProblem", laws | {"excitation": self.excitation})
        check_parts(self)
        if self.frictional:
            object.__setattr__(self, "surface", let_corners_rub(self.surface))
        object.__setattr__(self, "friction", replace_tuples(self.friction, self.surface, self._own))
        if self.joint is not None:
            joint = on_points(self.joint, self.surface)
            joint = replace_tuples(joint, self.surface, self._own)
            object.__setattr__(self, "joint", joint)
            refuse_overstressed(joint, self.surface)

    def _own(self, values: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return those of this rank, of values for the contact points of all ranks."""
        if len(values) != self.surface.total:
            return values
        return tuple(values[i] for i in self.surface.slots)

    def __repr__(self) -> str:
        """Return unknowns, conditions and laws of all ranks in a few lines, not the arrays."""
        law = f"friction: {quote(self.friction)}"
        if self.joint is not None:
            law = f"joint: {quote(self.joint)}"
        lines = [
            f"ContactProblem with {self.surface.total} contact conditions",
            str(self.system),
            str(self.surface),
            law,
            f"impact: {quote(self.impact)}",
            f"mass: {quote(self.mass or 'that of the time scheme')}",
        ]
        lines += [f"excitation: {quote(excitation)}" for excitation in self.excitations]
        return "\n  ".join(lines)

    @cached_property
    def excitations(self) -> tuple[Excitation, ...]:
        """Return the excitations as a tuple."""
        if isinstance(self.excitation, Sequence):
            return tuple(self.excitation)
        return (self.excitation,)

    @cached_property
    @report_time("mass")
    def unshaken(self) -> SemiDiscreteSystem:
        """Return the system in the rotated basis, with the mass law in it, without excitation."""
        system = self.turned
        if self.mass is not None:
            system = self.mass.apply(system, self.surface, tangential=self.frictional)
        return self._make_relative(system)

    @cached_property
    def equations(self) -> SemiDiscreteSystem:
        """Return the system that schemes see: in the rotated basis, with its inertia loads.

        These are -M r a_g(t), of every excitation.
        """
        system = self.unshaken

        # One separable load for each excitation: a vector, times its history.
        terms = []
        for excitation in self.excitations:
            direction = np.asarray(excitation.direction, dtype=float)
            terms.append((-system.inertia(direction), excitation.acceleration))
        shaken = system.with_load(*terms)
        return system.loaded(shaken.load)

    def beside(self, other: "ContactProblem") -> "ContactProblem | None":
        """Return the same problem with the matrices of another one, and the factors made of them.

        Returns None where these are not its own: for another system, surface, mass or impact law,
        or friction where the other has none.
        """
        same_parts = self.system is other.system and self.surface is other.surface
        if not same_parts or self.frictional is not other.frictional:
            return None
        if (self.mass, self.impact) != (other.mass, other.impact):
            return None
        if self.__dict__.get("unshaken") is other.unshaken:
            return self
        copy = replace(self)
        copy.__dict__["unshaken"] = other.unshaken
        return copy

    @cached_property
    def static_load(self) -> SemiDiscreteSystem:
        """Return the system of the gravity stage: in the basis of the equations, unshaken.

        What meets dashpots alone is held there (``outlets`` of the space).
        """
        system = self._make_relative(self.turned)
        hold = getattr(system.space, "hold_outlets", None)
        return system if hold is None else hold(system)

    @cached_property
    def turned(self) -> SemiDiscreteSystem:
        """Return the system in the nodal frames, every body in its own unknowns.

        All problems on one surface share it.
        """
        system = self.system
        basis = self.surface.basis
        dual = self.surface.dual
        if basis is None:
            return system

        # The system keeps the last turned one, and the load that was turned with it.
        known: dict[Any, tuple[Load, SemiDiscreteSystem]] = system.make_once("turned", dict)
        if (basis, dual) not in known:
            known.clear()  # it takes as much memory as the system
            known[basis, dual] = (system.load, system.in_basis(basis, dual))
        load, turned = known[basis, dual]
        if load is system.load:
            return turned
        # Systems of other loads share the matrices.
        return turned.loaded(system.load.in_basis(basis))

    def _make_relative(self, system: SemiDiscreteSystem) -> SemiDiscreteSystem:
        """Return the system in unknowns relative to the other side, where there is one."""
        coupling = self.surface.coupling
        relative = system if coupling is None else system.in_relative(coupling)
        if not system.has_massless_bodies:
            return relative

        # A node without mass has that of the node which moves relative to it in its own row.
        massless = system.massless & (relative.M.diagonal() == 0.0)
        return relative.changed(massless=massless)

    def standing_at(self, state: Any, name: str = "equations") -> "ContactProblem":
        """Return the same problem whose materials go on from a state. Collective.

        It is itself where materials have no memory. A copy shares all matrices and factors.

        Args:
            state: a ``core.step.State`` of this problem.
            name: which of its systems is asked for, "equations" or "static_load".
        """
        if not remembers(self.system.internal):
            return self
        system: SemiDiscreteSystem = getattr(self, name)
        internal: Any = system.internal
        other = copy(self)
        other.__dict__[name] = system.going_on(internal.go_on(state.memory, state.u))
        return other

    @property
    def frictional(self) -> bool:
        """Say whether tangential reactions can occur at all."""
        if self.joint is not None:
            return self.surface.tangents.shape[1] > 0 and bool(getattr(self.joint, "rubs", True))
        return not isinstance(self.friction, Frictionless)

    def slip_origin(self, u: Array, start: float, end: float) -> Array | None:
        """Return where the slip of a step is zero, (m, d - 1) [m]; None without friction.

        It is B_t u plus what the obstacle slides in the step.

        Args:
            u: displacement (n,) [m] at the beginning of the step.
            start: time of the beginning [s].
            end: time of the end [s].
        """
        return self.surface.slip_origin(u, start, end) if self.frictional else None

    def cartesian(self, x: Array) -> Array:
        """Return T R x (n,): unknowns of the equations turned back to the system's own."""
        x = x if self.surface.coupling is None else self.surface.coupling @ x
        return x if self.surface.basis is None else self.surface.basis @ x

    def ground_acceleration(self, t: float) -> Array:
        """Return the vector a_g(t) (d,) [m/s²], the sum of all excitations."""
        # Lists of two or three numbers take less time than arrays.
        total = [0.0] * self.system.influence.shape[1]
        for excitation in self.excitations:
            a = float(evaluate_history(excitation.acceleration, t))
            for i, component in enumerate(excitation.direction):
                total[i] += a * component
        return np.array(total)


def on_points(law: Any, surface: ContactSurface) -> Any:
    """Return a law of a joint with its functions of the points taken at those of this rank.

    A law that has functions says so by ``at_points(points)``, with points (m, d) [m], one that is
    made of laws of parts by ``on_surface(surface)``. One with water in it has
    ``lay(surface, rows)``.
    """
    if hasattr(law, "on_surface"):
        return law.on_surface(surface)
    at_points = getattr(law, "at_points", None)
    law = law if at_points is None else at_points(surface.points)
    return law.lay(surface, np.arange(surface.count)) if hasattr(law, "lay") else law


def replace_tuples(
    law: Any, surface: ContactSurface, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]
) -> Any:
    """Return a law with other tuples on several ranks, and so the laws that it is made of.

    Args:
        law: a law; one that is no dataclass is returned as it is.
        surface: the conditions, whose ranks count.
        change: takes a tuple that a law holds, and returns the other one.
    """
    if surface.comm.size == 1 or not is_dataclass(law) or isinstance(law, type):
        return law
    changes: dict[str, Any] = {}
    for name in [part.name for part in fields(law) if part.init]:
        old = getattr(law, name)
        new = change(old) if isinstance(old, tuple) else replace_tuples(old, surface, change)
        if new is not old:
            changes[name] = new
    return replace(law, **changes) if changes else law


def check_parts(problem: Any) -> None:
    """Raise InputError, on all ranks, for parts of the wrong kind or size. Collective.

    Parts that were made for another system are refused too. Identity counts: a surface that ``fem``
    made carries the space it was made on, and only systems of that space take it. Sizes are
    compared on all ranks together, so that all of them raise the same sentence.
    """
    owner = "ContactProblem"
    system = problem.system
    surface = problem.surface
    excitations = problem.excitations
    remedy = "give a system, such as fem.assemble returns"
    instance(owner, "system", system, SemiDiscreteSystem, remedy)
    remedy = "give a contact surface, such as fem.contact_surface returns"
    instance(owner, "surface", surface, ContactSurface, remedy)
    remedy = "give Coulomb(mu) or another friction law"
    provides(owner, "friction", problem.friction, ("limit", "slope", "at"), remedy)
    if problem.joint is not None:
        _check_joint(problem)
    remedy = "give Inelastic() or another law, or None"
    optional(provides, owner, "impact", problem.impact, ("target", "apply"), remedy)
    if problem.mass is not None:
        remedy = "give Redistributed() or ConsistentMass(), or None"
        provides(owner, "mass", problem.mass, ("apply",), remedy, lacks=("target",))
    for excitation in excitations:
        _check_excitation(excitation, system)

    # Parts that are right by themselves and do not fit each other.
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

    # What may be wrong on one rank alone: all ranks are asked before any of them raises.
    total = surface.total  # collective
    defects = (*_find_defects_of_system(system), *_find_defects_of_surface(surface, system, total))
    refuse(defects, surface.comm)
    _refuse_repeated(excitations)


def _check_joint(problem: Any) -> None:
    """Raise InputError for what is no law of a joint, or laws that do not go with one."""
    owner = "ContactProblem"
    remedy = "give laws.Joint(…), laws.SlipWeakening(…) or a law of your own"
    names = ("start", "strength", "slope", "commit")
    provides(owner, "joint", problem.joint, names, remedy, lacks=("limit",))
    if not isinstance(problem.friction, Frictionless):
        raise InputError(
            f"{owner}: joint and friction are two laws of the same points: give the friction as mu "
            "of the joint, and leave the other out"
        )
    if problem.impact is not None:
        raise InputError(
            f"{owner}: an impact law changes velocities of closed points, which a joint holds: "
            "leave impact out beside a joint"
        )
    if problem.surface.some(problem.surface.bilateral):
        raise InputError(
            f"{owner}: the surface has bilateral conditions, which never part: give a joint to a "
            "unilateral surface only"
        )


def _refuse_repeated(excitations: Sequence[Any]) -> None:
    """Raise InputError for an excitation that is named twice: it would shake twice."""
    for first, second in combinations(excitations, 2):
        if first is second:
            raise InputError(
                f"ContactProblem: excitation names {quote(first)} twice, which would shake twice: "
                "leave it out once, or scale it"
            )


def _check_excitation(excitation: Any, system: SemiDiscreteSystem) -> None:
    """Raise InputError for what is no excitation, or shakes in other dimensions."""
    remedy = "give Harmonic(…), GroundMotion(record) or another excitation, or a list of them"
    provides("ContactProblem", "excitation", excitation, EXCITATION, remedy)
    array("ContactProblem", "the direction of an excitation", excitation.direction, (None,))
    d = system.influence.shape[1]
    if len(excitation.direction) != d:
        raise InputError(
            f"excitation direction {excitation.direction} has {len(excitation.direction)} "
            f"components but the body has {d}: give one component per dimension"
        )


def _find_defects_of_system(system: SemiDiscreteSystem) -> Iterator[str]:
    """Yield a sentence for each wrong size or value of a system on this rank."""
    # All vectors have an entry for each unknown of this rank, n, and all matrices a row.
    n = system.rows
    d = system.influence.shape[1]
    for name in ("M", "K", "C"):
        matrix = getattr(system, name)
        if matrix is not None and matrix.rows != n:
            yield (
                f"the system has {n} unknowns in u0 but {matrix.rows} rows in {name}: "
                "give matrices of one system"
            )
    shapes: dict[str, tuple[int, ...]] = {
        "v0": (n,),
        "influence": (n, d),
        "base_mass": (n, d),
        "massless": (n,),
        "tied": (n,),
    }
    yield from _find_other_shapes("the system", system, shapes)
    constant = np.shape(system.load.constant)
    if constant != (n,):
        yield f"the system has load.constant of shape {constant}: give one of shape {(n,)}"
    for name in ("u0", "v0"):
        if not np.isfinite(np.sum(getattr(system, name))):
            yield f"the system's {name} contains NaN or infinite values: give finite initial values"


def _find_other_shapes(words: str, owner: Any, shapes: dict[str, tuple[int, ...]]) -> Iterator[str]:
    """Yield a sentence for each array of another shape.

    Args:
        words: the owner, in words.
        owner: what has the arrays, some of which may be None.
        shapes: name of an array -> its shape.
    """
    for name, shape in shapes.items():
        value = getattr(owner, name)
        if value is not None and np.shape(value) != shape:
            yield f"{words} has {name} of shape {np.shape(value)}: give one of shape {shape}"


def _find_defects_of_surface(
    surface: ContactSurface, system: SemiDiscreteSystem, total: int
) -> Iterator[str]:
    """Yield a sentence for each wrong size or value of a surface on this rank.

    Args:
        surface: the contact conditions.
        system: whose unknowns the conditions bound.
        total: number of the conditions of all ranks.
    """
    m = surface.count
    n = system.rows
    d = system.influence.shape[1]
    shapes: dict[str, tuple[int, ...]] = {
        "points": (m, d),
        "normals": (m, d),
        "tangents": (m, d - 1),
    }
    shapes |= dict.fromkeys(("gap0", "weights", "bilateral", "compliance", "owned", "slots"), (m,))
    least = 0 if surface.traces is None else -1  # conditions that are traces have no unknown
    yield from _find_other_shapes("the contact surface", surface, shapes)

    # Numbers of unknowns and of conditions must be there; a tangent of -1 is prescribed.
    for name, lowest, end in (("owned", least, n), ("tangents", -1, n), ("slots", 0, total)):
        values = getattr(surface, name)
        if np.size(values) and not (lowest <= np.min(values) and np.max(values) < end):
            yield (
                f"the contact surface has {name} from {np.min(values)} to {np.max(values)}, "
                f"outside {lowest} to {end - 1}: make the surface for this system, which has "
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
