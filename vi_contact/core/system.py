"""Hold the semi-discrete equations of motion M u'' + C u' + K u = f(t).

The loads on their right-hand side are here too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from .algebra import Algebra, Array, EffectiveMatrix, Mask, Matrix
from .checks import array, function, instance, provides, several, shown
from .collective import kept_error
from .errors import InputError
from .products import Remembered


class Companion(Protocol):
    """Provide a motion among the loads that is marched beside the run.

    It is that of the ground, or of a free field.
    """

    def bind(self, scheme: Any, dt: Any) -> None:
        """Take over ``scheme`` and the time steps ``dt`` [s] of the run that is about to step.

        ``scheme`` is a ``core.step.Scheme``.

        Called on every rank before each base step, so binding the same again must change nothing;
        another scheme or other steps begin the motion anew, from rest at t = 0. ``dt`` is a number
        or a plan of ``run.time_steps``. InputError for a plan that the motion cannot follow.
        """


class Space(Protocol):
    """Say what the unknowns mean: how an owned vector of unknowns becomes displacements of points.

    ``ids``: numbers of the owned unknowns on any ranks, node * dimension + component;
    ``coordinates`` (rows, d) [m]; ``hierarchy``: of displacements whose contact conditions need
    one, else None.
    """

    dimension: int
    unknowns: int

    @property
    def ids(self) -> np.ndarray:
        """Return the numbers of the owned unknowns, node * dimension + component."""

    @property
    def coordinates(self) -> Array:
        """Return the coordinates (rows, d) [m]."""

    @property
    def bodies(self) -> np.ndarray:
        """Return the body of every owned unknown."""

    @property
    def hierarchy(self) -> Any:
        """Return the hierarchy of displacements whose contact conditions need one, else None."""

    def find_nodes(self, points: Array) -> np.ndarray:
        """Return the node numbers nearest to the points (k, d).

        Raises:
            InputError: a point is outside the body.
        """

    def sample(self, u: Array, nodes: np.ndarray, t: float, derivative: int = 0) -> Array:
        """Return the values (k, d) at the nodes, on every rank.

        ``derivative`` 0, 1 or 2 is that of the prescribed motion.
        """


OTHERS = 4  # surfaces and the like of which factors are kept
# products with each: what a step and the next one may ask for again
KEPT = {"M": 6, "C": 4, "K": 2, "load": 2}
PAIR = "give pairs of a vector [N] and a function of the time"


@dataclass(frozen=True)
class Load:
    """Hold the load f(t) of a system, in newtons.

    f(t) = constant + sum vector * history(t) + sum general(t) + sum viscous(t) + sum inertial(t).

    Separable parts cost one vector update a step; the others are evaluated anew at every time.
    Viscous and inertial parts are the shares in C u' and M u'' of what moves in a given way (a
    base, a free field): a mass law that changes C changes the former alike, and a body at rest
    feels neither.
    """

    constant: Array
    separable: tuple[tuple[Array, Callable[[float], float]], ...] = ()
    general: tuple[Callable[[float], Array], ...] = ()
    viscous: tuple[Callable[[float], Array], ...] = ()
    inertial: tuple[Callable[[float], Array], ...] = ()

    def __post_init__(self) -> None:
        array("Load", "constant", self.constant, (None,), unit="N")
        for name in ("separable", "general", "viscous", "inertial"):
            for part in several(
                "Load", name, getattr(self, name), "give a tuple of functions of the time"
            ):
                if name != "separable":
                    function("Load", f"a part of {name}", part, "give a function of the time [s]")
                elif len(several("Load", "a part of separable", part, PAIR)) != 2:
                    raise InputError(f"Load: an item of separable has {len(part)} members; {PAIR}")

    def __call__(self, t: float) -> Array:
        """Return f(t) [N]."""
        total = self.at_rest(t)
        for parts in (self.viscous, self.inertial):
            for moving in parts:
                total += moving(t)
        return total

    def at_rest(self, t: float) -> Array:
        """Return the load of a static stage at time t.

        What moves in a given way stands still where it then is.
        """
        total = self.constant.copy()
        for vector, history in self.separable:
            total += history_value(history, t) * vector
        for part in self.general:
            total += part(t)
        return total

    def in_basis(self, T: Matrix) -> "Load":
        """Return the same load on the unknowns û of u = T û: Tᵀ f."""
        separable = tuple(
            (T.transpose_apply(vector), history) for vector, history in self.separable
        )
        moving = (
            _turned(T, functions) for functions in (self.general, self.viscous, self.inertial)
        )
        return Load(T.transpose_apply(self.constant), separable, *moving)

    def handed_over(self, P: Matrix) -> "Load":
        """Return the load beside C* = PᵀCP: Pᵀ on its viscous parts."""
        return replace(self, viscous=_turned(P, self.viscous))


def history_value(history: Callable[[float], float], t: float) -> float:
    """Return the value of a history; NaN and infinity are told of the load as a whole."""
    try:
        value = history(t)
    except Exception as error:  # of one rank alone, perhaps
        return kept_error(f"the history of a load or excitation at t = {t:g} s", error, 0.0)
    if isinstance(value, float):
        return value
    if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf":
        what = f"the history of a load or excitation is {shown(value)} at t = {t:g} s"
        return kept_error(what, InputError(f"{what}: return one real number"), 0.0)
    return value


def _turned(
    T: Matrix, functions: Sequence[Callable[[float], Array]]
) -> tuple[Callable[[float], Array], ...]:
    def turned(function: Callable[[float], Array]) -> Callable[[float], Array]:
        return lambda t: T.transpose_apply(function(t))

    return tuple(map(turned, functions))


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
        floating: True when some rigid motion is not held by prescribed displacements (static stages
            refuse it).
        tied: unknowns of nodes that move together with others elsewhere, None when there are none:
            they have no one place, and a body with such nodes cannot turn.
        notes: which motion its boundaries expect and the like, for log and summary of a run.
        absolute: True when a boundary lets waves in: displacements are those of space, and nothing
            else may shake it.
        companions: motions among its loads that are marched beside the run, with its scheme and
            time steps.
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
    base_mass: Array | None = None
    tied: Mask | None = None
    notes: tuple[str, ...] = ()
    absolute: bool = False
    companions: tuple[Companion, ...] = ()
    _cache: dict[str, Any] = field(init=False, default_factory=dict, compare=False, repr=False)
    _products: dict[str, Remembered] = field(
        init=False, default_factory=dict, compare=False, repr=False
    )

    def __post_init__(self) -> None:
        for name in ("M", "K") if self.C is None else ("M", "K", "C"):
            remedy = "give a SerialMatrix(…) or a PetscMatrix(…)"
            provides(
                "SemiDiscreteSystem", name, getattr(self, name), ("rows", "transpose_apply"), remedy
            )
        names = ("combine", "factor", "dot", "comm")
        provides(
            "SemiDiscreteSystem",
            "algebra",
            self.algebra,
            names,
            "give SerialAlgebra() or PetscAlgebra(comm)",
        )
        instance("SemiDiscreteSystem", "load", self.load, Load, "give Load(constant, …)")
        provides(
            "SemiDiscreteSystem",
            "space",
            self.space,
            ("dimension", "ids"),
            "give a space, what unknowns mean",
        )
        for name, axes in (("u0", 1), ("v0", 1), ("influence", 2)):
            value = getattr(self, name)
            if (
                not isinstance(value, np.ndarray)
                or value.ndim != axes
                or value.dtype.kind not in "iuf"
            ):
                raise InputError(
                    f"SemiDiscreteSystem: {name} is {shown(value)}; give real numbers along {axes} "
                    "axes"
                )

    def __repr__(self) -> str:
        """Return what it is, in words: not the arrays."""
        kind = (
            f"{'un' if self.C is None else ''}damped, "
            f"{'floating' if self.floating else 'supported'}"
        )
        return (
            f"SemiDiscreteSystem({self.space.unknowns} unknowns in {self.space.dimension}D, {kind})"
        )

    @property
    def rows(self) -> int:
        """Return how many unknowns this rank owns."""
        return len(self.u0)

    def kinetic_energy(self, v: Array) -> float:
        """Return ½ vᵀ M v [J]."""
        return 0.5 * self.algebra.dot(v, self.M @ v)

    def strain_energy(self, u: Array) -> float:
        """Return ½ uᵀ K u [J]."""
        return 0.5 * self.algebra.dot(u, self.K @ u)

    def cached(self, name: str, make: Callable[[], Any], *of: Any) -> Any:
        """Return what ``make`` returned the first time.

        These are factors and the like, which live as long as the system.

        ``of``: the objects beside M, C and K that it depends on, as the contact surface; each of
        the last few has its own. What depends on the load does not belong here: systems that differ
        in it share this memory (``loaded``).
        """
        known: dict[tuple[int, ...], tuple[Any, Any]] = self._cache.setdefault(name, {})
        key = tuple(map(id, of))
        if key not in known:
            made = make()
            if len(known) >= OTHERS:
                del known[next(iter(known))]
            known[key] = of, made  # with the objects, so that ids stay theirs
        return known[key][1]

    def forget_loads(self) -> None:
        """Forget the loads of the last times: a user's functions may give others in another run."""
        self._products.pop("load", None)

    def product(self, name: str, x: Array) -> Array:
        """Return M x, C x or K x, read-only.

        It is made once for each of the last frozen vectors (core.products).
        """
        return (self._products.get(name) or self._remembered(name))(x)

    def _remembered(self, name: str) -> Remembered:
        function = self.load if name == "load" else getattr(self, name).__matmul__
        return self._products.setdefault(name, Remembered(function, KEPT[name]))

    def know_rows(self, many: "SemiDiscreteSystem", row: int, *known: tuple[str, Any, Any]) -> None:
        """Take what makes products of rows: (name, x, rows), and ("load", t, t).

        When asked, the product with x is a row of that with the rows.
        """

        def value(name: str, rows: Any) -> Callable[[], Array]:
            return lambda: np.asarray(many.product(name, rows)[row])

        for name, x, rows in known:
            self._remembered(name).know(x, value(name, rows))

    @property
    def times(self) -> list[float]:
        """Return the times at which the load is known."""
        return self._products["load"].numbers() if "load" in self._products else []

    def load_at(self, t: float) -> Array:
        """Return f(t), read-only.

        It is made once for each of the last two times, unless something is marched beside it.
        """
        if self.companions:
            return self.load(t)
        return (self._products.get("load") or self._remembered("load"))(float(t))

    def rates(self, u0: Array, u1: Array, v0: Array, v1: Array, dt: float) -> tuple[Array, Array]:
        """Return (u1 - u0)/dt and (v1 - v0)/dt.

        The products of C and M with them are made of those with their ends.
        """

        def change(name: str, x0: Array, x1: Array) -> Array:
            product = self._remembered(name)
            return product.know((x1 - x0) / dt, lambda: (product(x1) - product(x0)) / dt)

        return (u1 - u0) / dt if self.C is None else change("C", u0, u1), change("M", v0, v1)

    def changed(self, **values: Any) -> "SemiDiscreteSystem":
        """Return the same system with other values of the attributes that are named.

        It has no factor of the old one.
        """
        return replace(self, **values)

    def effective(self, *, m: float, c: float, k: float, shares: bool = False) -> EffectiveMatrix:
        """Return A = m M + c C + k K for all steps of one size.

        Its factor is made when it is first needed.

        ``shares``: whether the scheme needs M x, C x and K x in its next step, so that A x may be
        made of them.
        """
        terms = [(m, self.M), (k, self.K)]
        if self.C is not None:
            terms.append((c, self.C))

        def image(x: Array) -> Array:
            total = m * self.product("M", x)
            total += self.product("K", x) if k == 1.0 else k * self.product("K", x)
            if self.C is not None:
                total += c * self.product("C", x)
            return total

        A, inertia = self.algebra.combine(terms), (m, self.M)
        return EffectiveMatrix(
            A, self.algebra, space=self.space, inertia=inertia, image=image if shares else None
        )

    def with_load(self, *terms: tuple[Array, Callable[[float], float]]) -> "SemiDiscreteSystem":
        """Return the same system with separable loads vector * history(t) added."""
        return self.changed(load=replace(self.load, separable=self.load.separable + terms))

    def loaded(self, load: Load) -> "SemiDiscreteSystem":
        """Return the same system under another load in its basis, with the factors of this one."""
        other = self.changed(load=load)
        object.__setattr__(other, "_cache", self._cache)
        return other

    def inertia(self, direction: Array) -> Array:
        """Return M r, the force [N] of a unit acceleration in this direction (d,).

        It accelerates body and prescribed nodes by one.
        """
        force = self.M @ (self.influence @ direction)
        return force if self.base_mass is None else force + self.base_mass @ direction

    def in_basis(self, T: Matrix, dual: Matrix | None = None) -> "SemiDiscreteSystem":
        """Return the same system in the unknowns û of u = T û: TᵀMT, TᵀCT, TᵀKT, Tᵀf.

        Initial values and influence vectors turn with T⁻¹: ``dual`` is T⁻ᵀ, T itself where it is
        orthogonal (None).
        """
        return self._in_unknowns(T, (T if dual is None else dual).transpose_apply)

    def in_relative(self, R: Matrix) -> "SemiDiscreteSystem":
        """Return the same system in the unknowns ǔ of û = R ǔ.

        In these, contact points move relative to the other body.

        R = 1 + N with N N = 0 (nobody's partner is somebody's partner), so that R⁻¹ = 2 - R.
        """
        return self._in_unknowns(R, lambda x: 2.0 * x - R @ x)

    def _in_unknowns(self, T: Matrix, inverse: Callable[[Array], Array]) -> "SemiDiscreteSystem":
        turn = self.algebra.congruence
        return self.changed(
            M=turn(T, self.M),
            C=None if self.C is None else turn(T, self.C),
            K=turn(T, self.K),
            load=self.load.in_basis(T),
            influence=_columns(self.influence, inverse),
            base_mass=_columns(self.base_mass, T.transpose_apply),
            u0=inverse(self.u0),
            v0=inverse(self.v0),
        )


def _columns(values: Array | None, apply: Callable[[Array], Array]) -> Array | None:
    return None if values is None else np.column_stack([apply(column) for column in values.T])
