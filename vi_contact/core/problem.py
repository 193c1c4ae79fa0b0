"""State the problem that is marched: a semi-discrete system, its contact surface, and the laws of both."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from .algebra import Array
from .checks import shown
from .problem_checks import check_parts
from .protocols import Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from .stages import stage
from .surfaces import ContactSurface
from .system import SemiDiscreteSystem


@dataclass(frozen=True)
class ContactProblem:
    """Pose a problem: a semi-discrete system, a contact surface, what shakes it and how it rubs and rebounds.

    The system is turned into the surface's nodal frames once, here. ``impact=None`` leaves velocities alone;
    ``mass=None`` leaves the choice of the mass matrix to the time scheme. InputError, on all ranks, for parts of the
    wrong kind or size, and for a surface that was made for another system. A friction law that is a dataclass may hold
    tuples with a value for every contact point: this rank's, or those of all by their numbers. Collective.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    friction: FrictionLaw = field(default_factory=Frictionless)
    impact: ImpactLaw | None = None
    excitation: Excitation | Sequence[Excitation] = ()
    mass: MassLaw | None = None

    def __post_init__(self) -> None:
        check_parts(self)
        total, slots = self.surface.total, self.surface.slots
        own = with_values(self.friction, self.surface, lambda v: tuple(v[i] for i in slots) if len(v) == total else v)
        object.__setattr__(self, "friction", own)

    def __repr__(self) -> str:
        """Return unknowns, conditions and laws in a few lines, those of all ranks: not the arrays."""
        laws = {"friction": self.friction, "impact": self.impact, "mass": self.mass or "that of the time scheme"}
        parts = [self.system, self.surface, *(f"{name}: {shown(one)}" for name, one in laws.items())]
        parts += [f"excitation: {shown(one)}" for one in self.excitations]
        return "\n  ".join([f"ContactProblem with {self.surface.total} contact conditions", *map(str, parts)])

    @cached_property
    def excitations(self) -> tuple[Excitation, ...]:
        """Return the excitations as a tuple."""
        return tuple(self.excitation) if isinstance(self.excitation, Sequence) else (self.excitation,)

    @cached_property
    @stage("mass")
    def unshaken(self) -> SemiDiscreteSystem:
        """Return the system in the rotated basis, with the mass law in it, without excitation."""
        system = self.turned
        if self.mass is not None:
            system = self.mass.apply(system, self.surface, tangential=self.frictional)
        return self._relative(system)

    @cached_property
    def equations(self) -> SemiDiscreteSystem:
        """Return the system that schemes see: in the rotated basis, with the inertia loads -M r a_g(t)."""
        system = self.unshaken
        ways = ((np.asarray(one.direction, dtype=float), one.acceleration) for one in self.excitations)
        shaken = system.with_load(*((-system.inertia(direction), history) for direction, history in ways))
        return system.loaded(shaken.load)

    def beside(self, other: "ContactProblem") -> "ContactProblem | None":
        """Return the same problem with the matrices of another one, and the factors made of them; None where these are
        not its own: for another system, surface, mass or impact law, or friction where the other has none."""
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
        """Return the system in the basis of the equations, without excitation: the gravity stage."""
        return self._relative(self.turned)

    @cached_property
    def turned(self) -> SemiDiscreteSystem:
        """Return the system in the nodal frames, every body in its own unknowns: one for all problems on a surface."""
        system, basis, dual = self.system, self.surface.basis, self.surface.dual
        known: dict[Any, SemiDiscreteSystem] = system.cached("turned", dict)
        if basis is not None and basis not in known:
            known.clear()  # it takes as much memory as the system
            known[basis] = system.in_basis(basis, dual)
        return system if basis is None else known[basis]

    def _relative(self, system: SemiDiscreteSystem) -> SemiDiscreteSystem:
        return system if self.surface.coupling is None else system.in_relative(self.surface.coupling)

    @property
    def frictional(self) -> bool:
        """Say whether tangential reactions can occur at all."""
        return not isinstance(self.friction, Frictionless)

    def slip_origin(self, u: Array, start: float, end: float) -> Array | None:
        """Return B_t u plus what the obstacle slides: where the slip of a step is zero; None without friction."""
        return self.surface.slip_origin(u, start, end) if self.frictional else None

    def cartesian(self, x: Array) -> Array:
        """Return T R x: unknowns of the equations back to the system's own."""
        x = x if self.surface.coupling is None else self.surface.coupling @ x
        return x if self.surface.basis is None else self.surface.basis @ x

    def ground_acceleration(self, t: float) -> Array:
        """Return the vector a_g(t) [m/s²] summed over the excitations."""
        found = [0.0] * self.system.influence.shape[1]
        for one in self.excitations:
            a = float(one.acceleration(t))
            found = [so_far + a * way for so_far, way in zip(found, one.direction, strict=True)]
        return np.array(found)


def with_values(law: Any, surface: ContactSurface, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]) -> Any:
    """Return the law with its tuples changed on several ranks, also in the laws that it is made of."""
    if surface.comm.size == 1 or not is_dataclass(law) or isinstance(law, type):
        return law
    found: dict[str, Any] = {}
    for name, value in ((one.name, getattr(law, one.name)) for one in fields(law) if one.init):
        new = change(value) if isinstance(value, tuple) else with_values(value, surface, change)
        found |= {} if new is value else {name: new}
    return replace(law, **found) if found else law
