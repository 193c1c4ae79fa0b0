"""Hold the semi-discrete equations of motion M u'' + C u' + K u = f(t), and their loads.

A system goes through these hands: ``fem.assemble`` (or a user with matrices) makes it along the
axes; ``ContactProblem`` turns it into the nodal frames of the contact surface (``in_basis``), lets
the mass law change M, takes contact points relative to a deformable other side (``in_relative``)
and adds the inertia loads of excitations; schemes read what comes out as ``problem.equations``.
Each of these makes another system, as none ever changes.

Two things are remembered in a system, as they are asked for again and again: the load at the last
times (``load_at``), and whatever is made of the matrices once (``make_once``), such as factors.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from .algebra import (
    Algebra,
    Array,
    EffectiveMatrix,
    Mask,
    Matrix,
    expect_products,
    freeze,
)
from .checks import array, function, instance, provides, quote, several
from .collective import keep_error
from .errors import InputError
from .internal import InternalForce, turn_force


class Companion(Protocol):
    """Provide a motion of the ground, or of a free field, that is marched beside the run."""

    def bind(self, scheme: Any, dt: Any) -> None:
        """Take over the scheme and the time steps of the run that is about to step.

        The loop calls it on every rank before each base step, so binding the same again must change
        nothing. Another scheme or other steps begin the motion anew, from rest at t = 0.

        Args:
            scheme: the time scheme of the run, a ``core.step.Scheme``.
            dt: the time step [s], or a plan of ``run.time_steps``.

        Raises:
            InputError: a plan that the motion cannot follow.
        """


class Space(Protocol):
    """Say what the unknowns mean: how an owned vector of unknowns becomes displacements of points.

    Attributes:
        dimension: number of directions, d.
        unknowns: number of unknowns on all ranks.
    """

    dimension: int
    unknowns: int

    @property
    def ids(self) -> np.ndarray:
        """Return the numbers (rows,) of the owned unknowns, node * dimension + component.

        They do not depend on the number of ranks.
        """

    @property
    def coordinates(self) -> Array:
        """Return the coordinates (rows, d) [m] of the nodes of the owned unknowns."""

    @property
    def bodies(self) -> np.ndarray:
        """Return the number of the body (rows,) of every owned unknown."""

    @property
    def hierarchy(self) -> Any:
        """Return the hierarchy of displacements whose contact conditions need one, else None."""

    def find_nodes(self, points: Array) -> np.ndarray:
        """Return the node numbers nearest to the points (k, d).

        Raises:
            InputError: a point is outside the body.
        """

    def sample(self, u: Array, nodes: np.ndarray, t: float, derivative: int = 0) -> Array:
        """Return the values (k, d) at some nodes, the same on every rank.

        Args:
            u: displacement, velocity or acceleration (rows,) of the owned unknowns.
            nodes: numbers of the nodes (k,), as ``find_nodes`` returns them.
            t: time [s] of the prescribed motion at held nodes.
            derivative: 0, 1 or 2, that of the prescribed motion.
        """


OTHERS = 4  # surfaces and other objects, at most, for each of which factors are remembered
LOADS = 2  # times whose loads are remembered
PAIR_REMEDY = "give pairs of a vector [N] and a function of the time"


@dataclass(frozen=True)
class Load:
    """Hold the load f(t) of a system, in newtons.

    f(t) = constant + sum vector * history(t) + sum general(t) + sum viscous(t) + sum inertial(t).

    Separable parts cost one vector update a step; the others are evaluated anew at every time.
    Viscous and inertial parts are the shares in C u' and M u'' of what moves in a given way (a
    base, a free field): a mass law that changes C changes the former alike, and a body at rest
    feels neither.

    Attributes:
        constant: vector (n,) [N].
        separable: pairs of a vector (n,) [N] and a function of the time t [s] that returns a
            number.
        general: functions of the time t [s] that return a vector (n,) [N].
        viscous: functions of the same kind, for the share in C u'.
        inertial: functions of the same kind, for the share in M u''.
    """

    constant: Array
    separable: tuple[tuple[Array, Callable[[float], float]], ...] = ()
    general: tuple[Callable[[float], Array], ...] = ()
    viscous: tuple[Callable[[float], Array], ...] = ()
    inertial: tuple[Callable[[float], Array], ...] = ()

    def __post_init__(self) -> None:
        array("Load", "constant", self.constant, (None,), unit="N")
        remedy = "give a tuple of functions of the time"
        for part in several("Load", "separable", self.separable, remedy):
            if len(several("Load", "a part of separable", part, PAIR_REMEDY)) != 2:
                raise InputError(
                    f"Load: an item of separable has {len(part)} members; {PAIR_REMEDY}"
                )
        for name in ("general", "viscous", "inertial"):
            for part in several("Load", name, getattr(self, name), remedy):
                function("Load", f"a part of {name}", part, "give a function of the time [s]")

    def __call__(self, t: float) -> Array:
        """Return f(t) (n,) [N] at time t [s]."""
        total = self.at_rest(t)
        for parts in (self.viscous, self.inertial):
            for moving in parts:
                total += moving(t)
        return total

    def at_rest(self, t: float) -> Array:
        """Return the load (n,) [N] of a static stage at time t [s].

        What moves in a given way stands still where it is at that time: its viscous and inertial
        shares are left out.
        """
        total = self.constant.copy()
        for vector, history in self.separable:
            total += evaluate_history(history, t) * vector
        for part in self.general:
            total += part(t)
        return total

    def in_basis(self, T: Matrix) -> "Load":
        """Return the same load on the unknowns û of u = T û: Tᵀ f."""
        return Load(
            constant=T.transpose_apply(self.constant),
            separable=tuple((T.transpose_apply(v), history) for v, history in self.separable),
            general=_turn(T, self.general),
            viscous=_turn(T, self.viscous),
            inertial=_turn(T, self.inertial),
        )

    def transform_viscous(self, P: Matrix) -> "Load":
        """Return the load that belongs to C* = PᵀCP, with Pᵀ on its viscous parts.

        A mass law that takes the inertia of contact nodes to their neighbours takes their damping
        there too.
        """
        return replace(self, viscous=_turn(P, self.viscous))


def evaluate_history(history: Callable[[float], float], t: float) -> float:
    """Return the value of a history at time t [s].

    NaN and infinity pass here: they are refused in the load as a whole. The usual float goes
    through first, as this is called for every history in every step.

    Raises:
        InputError: the function raises, or returns anything but one real number; in a frame of
            several ranks at its end.
    """
    try:
        value = history(t)
    except Exception as error:  # perhaps on one rank alone
        return keep_error(f"the history of a load or excitation at t = {t:g} s", error, 0.0)
    if isinstance(value, float):
        return value
    if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf":
        what = f"the history of a load or excitation is {quote(value)} at t = {t:g} s"
        return keep_error(what, InputError(f"{what}: return one real number"), 0.0)
    return value


def _turn(
    T: Matrix, functions: Sequence[Callable[[float], Array]]
) -> tuple[Callable[[float], Array], ...]:
    """Return functions of the time that give Tᵀ times what these functions give."""

    def turn_one(function: Callable[[float], Array]) -> Callable[[float], Array]:
        return lambda t: T.transpose_apply(function(t))

    return tuple(map(turn_one, functions))


@dataclass(frozen=True)
class SemiDiscreteSystem:
    """Hold M u'' + C u' + K u = f(t) on the free unknowns.

    Prescribed displacements are already eliminated into f.

    Attributes:
        algebra: how its matrices are combined, factorised and reduced over ranks.
        M, K: consistent mass [kg] and stiffness [N/m] (per thickness of the section), symmetric.
        C: damping [N s/m] or None.
        load: f(t) [N].
        influence: (n, d) rigid unit translation in each direction, for the inertia load -M r
            a_g(t).
        base_mass: (n, d) forces on the unknowns when the prescribed nodes alone are accelerated by
            one in each direction: the part of the inertia load that comes from mass shared with
            them. None: left out.
        u0, v0: initial displacement [m] and velocity [m/s].
        space: what the unknowns mean.
        massless: unknowns without inertia (rows and columns of M are zero), None when there are
            none.
        has_massless_bodies: True when ``massless`` names whole bodies or parts of them, and not a
            layer at the contact.
        floating: True when some rigid motion is not held by prescribed displacements (static stages
            refuse it).
        tied: unknowns of nodes that move together with others elsewhere, None when there are none:
            they have no one place, and a body with such nodes cannot turn.
        notes: which motion its boundaries expect and the like, for log and summary of a run.
        absolute: True when a boundary lets waves in: displacements are those of space, and nothing
            else may shake it.
        companions: motions among its loads that are marched beside the run, with its scheme and
            time steps.
        statics_only: True when nobody said its mass: M then stands for a density of one, by which
            static stages weigh motions against each other, and all else refuses the system.
        internal: p(u), which takes the place of K u; K is then the reference stiffness. None for a
            linear body.
    """

    algebra: Algebra
    M: Matrix
    C: Matrix | None
    K: Matrix
    load: Load
    influence: Array
    u0: Array
    v0: Array
    space: Space
    floating: bool = False
    massless: Mask | None = None
    has_massless_bodies: bool = False
    base_mass: Array | None = None
    tied: Mask | None = None
    notes: tuple[str, ...] = ()
    absolute: bool = False
    companions: tuple[Companion, ...] = ()
    statics_only: bool = False
    internal: InternalForce | None = None
    _cache: dict[str, Any] = field(init=False, default_factory=dict, compare=False, repr=False)
    _loads: dict[float, Array] = field(init=False, default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        owner = "SemiDiscreteSystem"
        remedy = "give a SerialMatrix(…) or a PetscMatrix(…)"
        for name in ("M", "K") if self.C is None else ("M", "K", "C"):
            provides(owner, name, getattr(self, name), ("rows", "transpose_apply"), remedy)
        names = ("combine", "factor", "dot", "comm")
        remedy = "give SerialAlgebra() or PetscAlgebra(comm)"
        provides(owner, "algebra", self.algebra, names, remedy)
        expect_products(self.M, self.C, self.K)
        instance(owner, "load", self.load, Load, "give Load(constant, …)")
        remedy = "give a space, what unknowns mean"
        provides(owner, "space", self.space, ("dimension", "ids"), remedy)
        for name, axes in (("u0", 1), ("v0", 1), ("influence", 2)):
            value = getattr(self, name)
            is_array = isinstance(value, np.ndarray) and value.ndim == axes
            if not is_array or value.dtype.kind not in "iuf":
                raise InputError(
                    f"{owner}: {name} is {quote(value)}; give real numbers along {axes} axes"
                )

    def __repr__(self) -> str:
        """Return in words what it is, not the arrays."""
        damped = "undamped" if self.C is None else "damped"
        held = "floating" if self.floating else "supported"
        size = f"{self.space.unknowns} unknowns in {self.space.dimension}D"
        return f"SemiDiscreteSystem({size}, {damped}, {held})"

    @property
    def rows(self) -> int:
        """Return how many unknowns this rank owns."""
        return len(self.u0)

    def refuse_statics_only(self, owner: str) -> None:
        """Raise InputError where nobody said the mass; ``owner`` asks for it."""
        if self.statics_only:
            raise InputError(
                f"{owner}: the forms=… of the system have no mass, which static stages alone do "
                "without: give fem.Forms(…, mass=), or a material for its density"
            )

    def kinetic_energy(self, v: Array) -> float:
        """Return ½ vᵀ M v [J]."""
        return 0.5 * self.algebra.dot(v, self.M @ v)

    def strain_energy(self, u: Array) -> float:
        """Return ½ uᵀ K u [J], or W(u) where the body is not linear."""
        if self.internal is not None:
            return self.internal.energy(u)
        return 0.5 * self.algebra.dot(u, self.K @ u)

    def internal_force(self, u: Array) -> Array:
        """Return K u (n,) [N], or p(u) where the body is not linear; rows (k, n) of rows."""
        return self.K @ u if self.internal is None else self.internal.force(u)

    def refuse_nonlinear(self, owner: str, remedy: str) -> None:
        """Raise InputError where the body is not linear; ``owner`` takes K u for its forces."""
        if self.internal is not None:
            raise InputError(
                f"{owner} knows linear bodies only, and the internal force of this one is not "
                f"linear: {remedy}"
            )

    def make_once(self, name: str, make: Callable[[], Any], *others: Any) -> Any:
        """Return what ``make`` returned the first time: a factor, or the like.

        It lives as long as the system. What depends on the load does not belong here: systems that
        differ in their loads alone share this memory (``loaded``).

        Args:
            name: what it is called here.
            make: makes it.
            others: the objects beside M, C and K that it depends on, as the contact surface. Each
                of the last few has its own, and they are told apart by identity.

        Returns:
            What ``make`` has returned, now or before.
        """
        known: dict[tuple[int, ...], tuple[Any, Any]] = self._cache.setdefault(name, {})
        key = tuple(map(id, others))
        if key not in known:
            value = make()
            if len(known) >= OTHERS:
                oldest = next(iter(known))
                del known[oldest]
            known[key] = (others, value)  # keeps the objects alive, so that the ids stay theirs
        return known[key][1]

    def forget_loads(self) -> None:
        """Forget the loads of the last times: a user's functions may give others in another run."""
        self._loads.clear()

    @property
    def times(self) -> list[float]:
        """Return the times [s] at which the load is remembered."""
        return list(self._loads)

    def load_at(self, t: float) -> Array:
        """Return f(t) (n,) [N], read-only.

        Those of the last two times are remembered, as the end of a step is the beginning of the
        next one, unless something is marched beside the system.
        """
        if self.companions:
            return self.load(t)
        known = self._loads.get(t)
        if known is not None:
            return known
        while len(self._loads) >= LOADS:
            oldest = next(iter(self._loads))
            del self._loads[oldest]
        self._loads[t] = freeze(self.load(t))
        return self._loads[t]

    def changed(self, **values: Any) -> "SemiDiscreteSystem":
        """Return the same system with other values of some attributes, and with no factor yet.

        Args:
            values: attribute -> its new value.
        """
        return replace(self, **values)

    def effective(
        self, *, m: float, c: float, k: float, stiffness: Matrix | None = None
    ) -> EffectiveMatrix:
        """Return A = m M + c C + k K for all steps of one size.

        Its factor is made when it is first needed.

        Args:
            m: factor of the mass, [1/s²] where x is a displacement.
            c: factor of the damping, [1/s] there.
            k: factor of the stiffness, 1 there.
            stiffness: in the place of K, a tangent of the internal force.
        """
        terms = [(m, self.M), (k, self.K if stiffness is None else stiffness)]
        if self.C is not None:
            terms.append((c, self.C))
        A = self.algebra.combine(terms)
        expect_products(A)
        return EffectiveMatrix(A, self.algebra, space=self.space, inertia=(m, self.M))

    def with_load(self, *terms: tuple[Array, Callable[[float], float]]) -> "SemiDiscreteSystem":
        """Return the same system with separable loads vector * history(t) added.

        Args:
            terms: pairs of a vector (n,) [N] and a function of the time t [s].
        """
        return self.changed(load=replace(self.load, separable=self.load.separable + terms))

    def loaded(self, load: Load) -> "SemiDiscreteSystem":
        """Return the same system under another load in its basis, with the factors of this one."""
        # The dataclass is frozen, and what is made of the matrices is shared: hence this way.
        other = self.changed(load=load)
        object.__setattr__(other, "_cache", self._cache)
        return other

    def inertia(self, direction: Array) -> Array:
        """Return M r (n,), the force [N] of a unit acceleration in this direction (d,).

        Body and prescribed nodes are accelerated alike.
        """
        force = self.M @ (self.influence @ direction)
        return force if self.base_mass is None else force + self.base_mass @ direction

    def going_on(self, internal: InternalForce) -> "SemiDiscreteSystem":
        """Return the same system with another internal force, and what this one remembers."""
        # The dataclass is frozen, and a copy shares matrices, factors and loads: hence this way.
        other = copy(self)
        object.__setattr__(other, "internal", internal)
        return other

    def in_basis(self, T: Matrix, dual: Matrix | None = None) -> "SemiDiscreteSystem":
        """Return the same system in the unknowns û of u = T û: TᵀMT, TᵀCT, TᵀKT, Tᵀf.

        Args:
            T: the change of basis.
            dual: T⁻ᵀ, with which initial values and influence vectors turn (by T⁻¹); None where T
                is orthogonal.
        """
        return self._change_unknowns(T, (T if dual is None else dual).transpose_apply)

    def in_relative(self, R: Matrix) -> "SemiDiscreteSystem":
        """Return the same system in the unknowns ǔ of û = R ǔ.

        In these, contact points move relative to the other body. R = 1 + N with N N = 0 (nobody's
        partner is somebody's partner), so that R⁻¹ = 2 - R.
        """
        return self._change_unknowns(R, lambda x: 2.0 * x - R @ x)

    def _change_unknowns(
        self, T: Matrix, inverse: Callable[[Array], Array]
    ) -> "SemiDiscreteSystem":
        """Return the system in other unknowns; ``inverse`` applies T⁻¹ to a vector."""
        turn = self.algebra.congruence
        return self.changed(
            M=turn(T, self.M),
            C=None if self.C is None else turn(T, self.C),
            K=turn(T, self.K),
            load=self.load.in_basis(T),
            influence=_map_columns(inverse, self.influence),
            base_mass=_map_columns(T.transpose_apply, self.base_mass),
            u0=inverse(self.u0),
            v0=inverse(self.v0),
            internal=turn_force(self.internal, T, self.algebra),
        )


def _map_columns(apply: Callable[[Array], Array], values: Array | None) -> Array | None:
    """Return an array whose columns are a function of these, None for None."""
    return None if values is None else np.column_stack([apply(column) for column in values.T])
