"""Make contact problems of rod and beam.

They have the exact inequalities and are for ``march`` and ``simulate``.

The tip is one contact point: its normal unknown is the displacement along the axis, v_n <= gap, its
tangential one the deflection u_m. With ``Midpoint()`` the rod's step is (5.1)-(5.3) of Ahn (2012),
midpoint rule in the bulk and the complementarity at the end of the step, and the beam's is (5.4),
(5.5) with the inequality (2.8), (2.9) itself:

    Algorithm 10 -> this    for eps -> 0, with |r_N| of the same step

Three problems: the rod alone; the beam under a given normal force, which presses a point mass
against the wall; the beam that rubs with the contact force of its own rod, the coupling that the
paper leaves out. Along the axis and across nothing else is coupled (small displacements): the rod
moves as it would alone.

Problems with a beam are solved with its consistent mass: the redistribution of mass away from
contact points knows no rotations. The forces of ``Midpoint`` ring with the mass of the tip while it
touches or sticks, by turns above and below their mean; those of ``MoreauJean`` and
``ContactStabilisedNewmark`` do not.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array
from ..core.checks import array, function, instance, number, optional, provides, whole
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import FrictionLaw, Frictionless
from ..core.quantities import Unit
from ..core.step import Scheme
from ..core.system import Load
from ..fem.contact.points import contact_points
from ..fem.matrices.own_matrices import system_from_arrays
from ..laws.mass import ConsistentMass
from ..run.march import march
from ..schemes.midpoint import Midpoint
from .elements import Elements, beam_matrices, rod_matrices
from .values import Rod, Start, TimoshenkoBeam

History = Callable[[float], float]


def rod_problem(rod: Rod, elements: Elements, start: Start | None = None) -> ContactProblem:
    """Return the contact problem of the rod before its wall, (2.1)-(2.5) of Ahn (2012).

        rho A v'' = E A (v_xx + a1 v'_xx) + f(t),    v(length) <= gap,    r_n >= 0

    v is positive towards the wall, r_n is the force [N] of the wall on the tip, against it.

    Args:
        rod: the body and its loads.
        elements: their number is that of equal linear elements.
        start: u [m] and v [m/s] along the axis at t = 0; None: at rest.

    Returns:
        A problem of ``elements.count`` unknowns with one contact point of weight 1, for ``march``
        and ``simulate``.

    Raises:
        InputError: an argument is of another type, or a load returns no finite number.
    """
    _check("rod_problem", elements, (start,), rod=rod)
    x = elements.nodes(rod.length)
    bar = _Part.of_rod(rod, elements, start or Start())
    return _assemble_problem(x, bar, None, rod.gap, Frictionless())


def beam_problem(
    beam: TimoshenkoBeam,
    elements: Elements,
    *,
    normal_force: Annotated[History, Unit("N")],
    friction: FrictionLaw,
    start: Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> ContactProblem:
    """Return the problem of the beam whose tip is pressed on the wall, (2.6)-(2.9) of Ahn (2012).

        |R(t)| <= mu |r_N(t)|,    R = mu |r_N| sgn(u') where the tip slips

    R [N] is the friction that the wall takes from the tip, u is positive across and upwards. The
    given force is the load of a point mass rho A l, which the wall holds: one more unknown.

    Args:
        beam: the body.
        elements: equal elements of deflection and rotation.
        normal_force: t [s] -> |r_N| >= 0 [N]. Schemes take it where they take loads:
            ``Midpoint`` at t + dt/2, Algorithm 10 at t.
        friction: a law, for example ``Coulomb(mu)``.
        start: u [m], v [m/s], theta [-] and omega [1/s] at t = 0; None: at rest.
        load: t [s] -> uniform force across [N/m]; None: no load.

    Returns:
        A problem of 2 ``elements.count`` + 1 unknowns with one contact point, for ``march`` and
        ``simulate``. It keeps the consistent mass.

    Raises:
        InputError: an argument is of another type, or a function returns no finite number.
    """
    _check("beam_problem", elements, (start,), load, beam=beam, friction=friction)
    function(
        "beam_problem",
        "normal_force",
        normal_force,
        "give a function of t that returns |r_N| >= 0 in N",
    )
    x = elements.nodes(beam.length)

    # The point mass along the axis, which the given force presses against the wall.
    mass = sp.csr_matrix([[beam.rho * beam.area * beam.length]])
    push = ((np.ones(1), _check_values("normal_force", normal_force, "N")),)
    point = _Part(
        M=mass,
        K=sp.csr_matrix((1, 1)),
        viscosity=0.0,
        loads=push,
        u0=np.zeros(1),
        v0=np.zeros(1),
        inertia=mass @ np.ones(1),
    )
    across = _Part.of_beam(beam, elements, start=start or Start(), load=load)
    return _assemble_problem(x, point, across, 0.0, friction)


def rubbing_problem(
    rod: Rod,
    beam: TimoshenkoBeam,
    elements: Elements,
    *,
    friction: FrictionLaw,
    rod_start: Start | None = None,
    start: Start | None = None,
    load: Annotated[History | None, Unit("N/m")] = None,
) -> ContactProblem:
    """Return the problem of a body that is rod and beam: it rubs with its own contact force.

    Along the axis it obeys the equations of ``rod_problem``, across those of ``beam_problem`` with
    |r_N| = r_n of the rod, the coupling that Ahn (2012) leaves out.

    Args:
        rod: the body along its axis, with the gap.
        beam: the body across, of the same length.
        elements: equal elements, the same for both.
        friction: a law, for example ``Coulomb(mu)``.
        rod_start: u [m] and v [m/s] along the axis at t = 0; None: at rest.
        start: u [m], v [m/s], theta [-] and omega [1/s] across at t = 0; None: at rest.
        load: t [s] -> uniform force across [N/m]; None: no load.

    Returns:
        A problem of 3 ``elements.count`` unknowns with one contact point, for ``march`` and
        ``simulate``. It keeps the consistent mass.

    Raises:
        InputError: rod and beam differ in length, an argument is of another type, or a function
            returns no finite number.
    """
    _check(
        "rubbing_problem", elements, (start, rod_start), load, rod=rod, beam=beam, friction=friction
    )
    if rod.length != beam.length:
        raise InputError(
            f"the rod is {rod.length:g} m long and the beam {beam.length:g} m: they are one body, "
            "give one length"
        )
    x = elements.nodes(beam.length)
    bar = _Part.of_rod(rod, elements, rod_start or Start())
    across = _Part.of_beam(beam, elements, start=start or Start(), load=load)
    return _assemble_problem(x, bar, across, rod.gap, friction)


@dataclass(frozen=True)
class StepForces:
    """Hold forces, one for each time step, as a function of time.

    Args:
        dt: time step [s].
        forces: (steps,) [N], pressing where positive.

    Raises:
        InputError: dt is not positive, a force is no finite number, or the time that is asked for
            is in none of the steps.
    """

    dt: float
    forces: tuple[float, ...]

    def __post_init__(self) -> None:
        number("StepForces", "dt", self.dt, positive=True, unit="s")
        array("StepForces", "forces", self.forces, (None,), unit="N")

    def __call__(self, t: float) -> float:
        """Return the force [N] of the step that contains t [s]."""
        number("StepForces", "t", t, unit="s")
        step = math.floor(t / self.dt + 1e-6)
        if not 0 <= step < len(self.forces):
            end = len(self.forces) * self.dt
            raise InputError(
                f"the rod's forces are known for 0 <= t < {end:g} s, not at {t:g} s: let it run as "
                "long"
            )
        return self.forces[step]


def rod_forces(
    rod: Rod,
    elements: Elements,
    *,
    dt: float,
    steps: int,
    start: Start | None = None,
    scheme: Scheme | None = None,
) -> StepForces:
    """Compute the contact force |r_N| of every step of the rod, for Algorithm 10 of Ahn (2012).

    The force r_N^k of (5.1) acts in the step from t_k to t_k+1, and (7.1) of the same step rubs
    with it. The rod does not feel the beam: rod first, beam second is no approximation, with
    ``ExactFriction`` it is ``rubbing_problem``.

    Args:
        rod: the body and its loads.
        elements: equal linear elements.
        dt: time step [s].
        steps: number of steps.
        start: u [m] and v [m/s] along the axis at t = 0; None: at rest.
        scheme: None: ``Midpoint()``, that of the source.

    Returns:
        The forces [N] as a function of time, for ``normal_force`` of ``BeamStepper``.

    Raises:
        InputError: an argument is outside its range.
        StepFailure: a step of the rod is not solved.
    """
    dt = number("rod_forces", "dt", dt, positive=True, unit="s")
    steps = whole("rod_forces", "steps", steps, least=1)
    problem = rod_problem(rod, elements, start)
    run = march(problem, scheme=scheme or Midpoint(), dt=dt, steps=steps)
    return StepForces(dt, tuple(float(state.r_n[0]) for state, _ in run))


@dataclass(frozen=True)
class _Part:
    """Hold what belongs to the unknowns along the axis, or to those across.

    Args:
        M: mass, sparse (n, n).
        K: stiffness, sparse (n, n).
        viscosity: a of the damping C = a K [s].
        loads: a vector (n,) and its factor as a function of time, of each load.
        u0: values (n,) at t = 0.
        v0: their rates (n,) at t = 0.
        inertia: (n,) forces when unknowns and clamped node are accelerated together by one [kg].
    """

    M: Any
    K: Any
    viscosity: float
    loads: tuple[tuple[Array, History], ...]
    u0: Array
    v0: Array
    inertia: Array

    @classmethod
    def of_rod(cls, rod: Rod, elements: Elements, start: Start) -> "_Part":
        """Return the part along the axis of a rod.

        Args:
            rod: the body and its loads.
            elements: equal linear elements.
            start: u [m] and v [m/s] at t = 0.
        """
        x = elements.nodes(rod.length)
        M, K, uniform = rod_matrices(rod, elements.count)
        tip = np.zeros_like(x)
        tip[-1] = 1.0
        loads = []
        if rod.body_force:
            loads.append((uniform, _check_values("body_force", rod.body_force, "N/m")))
        if rod.end_force:
            loads.append((tip, _check_values("end_force", rod.end_force, "N")))
        return cls(
            M=M,
            K=K,
            viscosity=rod.viscosity,
            loads=tuple(loads),
            u0=start.at("u", x),
            v0=start.at("v", x),
            inertia=rod.rho * rod.area * uniform,
        )

    @classmethod
    def of_beam(
        cls, beam: TimoshenkoBeam, elements: Elements, *, start: Start, load: History | None
    ) -> "_Part":
        """Return the part across the axis of a beam: its rotations, then its deflections.

        Args:
            beam: the body.
            elements: equal elements of deflection and rotation.
            start: u [m], v [m/s], theta [-] and omega [1/s] at t = 0.
            load: t [s] -> uniform force across [N/m]; None: no load.
        """
        x = elements.nodes(beam.length)
        M, S, uniform = beam_matrices(beam, elements)
        y = np.concatenate([start.at("theta", x), start.at("u", x)])
        w = np.concatenate([start.at("omega", x), start.at("v", x)])
        loads = () if load is None else ((uniform, _check_values("load", load, "N/m")),)
        inertia = beam.rho * beam.area * uniform
        return cls(M=M, K=S, viscosity=beam.viscosity, loads=loads, u0=y, v0=w, inertia=inertia)


def _check_values(name: str, history: History, unit: str) -> History:
    """Return the function with a check of every value that it returns.

    The check raises InputError, naming the time, for no finite number, or a negative normal force.
    """
    pressing = name == "normal_force"
    return lambda t: number(
        "beam", f"{name}({t:.6g} s)", history(t), not_negative=pressing, unit=unit
    )


def _check(
    owner: str,
    elements: Elements,
    starts: tuple[Start | None, ...],
    load: History | None = None,
    **parts: Any,
) -> None:
    """Raise InputError for what is no element count, start, load, rod, beam or friction law.

    Args:
        owner: who asks, for messages.
        elements: the elements.
        starts: initial values of each part, or None.
        load: across the beam, or None.
        **parts: rod, beam and friction, those of them that there are.
    """
    instance(owner, "elements", elements, Elements, "give Elements(count)")
    for start in starts:
        instance(owner, "start", start, (Start, type(None)), "give Start(...), or None")
    optional(function, owner, "load", load, "give a function of t in N/m, or None")
    for name, kind in (("rod", Rod), ("beam", TimoshenkoBeam)):
        if name in parts:
            instance(owner, name, parts[name], kind, f"give a {kind.__name__}")
    if "friction" in parts:
        provides(
            owner,
            "friction",
            parts["friction"],
            ("limit", "slope", "at"),
            "give a law, for example Coulomb(mu)",
        )


def _assemble_problem(
    x: Array, along: _Part, across: _Part | None, gap: float, friction: FrictionLaw
) -> ContactProblem:
    """Return the contact problem of the parts along and across the axis.

    Args:
        x: (m,) positions of the nodes but the clamped one [m].
        along: part of the unknowns along the axis, of the last nodes.
        across: part of the rotations and deflections of all nodes; None for no beam.
        gap: distance of the wall at rest [m].
        friction: law of the tip.
    """
    parts = [along] if across is None else [along, across]
    sizes = [len(part.u0) for part in parts]
    m = len(x)
    d = 1 if across is None else 2

    # The loads of a part are zero on the other one.
    loads = []
    for i, part in enumerate(parts):
        for vector, history in part.loads:
            pieces = [np.zeros(size) for size in sizes]
            pieces[i] = vector
            loads.append((np.concatenate(pieces), history))

    # Node and component of every unknown: along the axis 0, of rotations -1, across 1.
    nodes = np.append(0.0, x)[:, None] * np.eye(1, d)  # the first one is clamped
    numbers = np.arange(1, m + 1)
    meaning = [np.column_stack([numbers[m - sizes[0] :], np.zeros(sizes[0])])]
    if across is not None:
        meaning.append(np.column_stack([numbers, np.full(m, -1)]))
        meaning.append(np.column_stack([numbers, np.full(m, 1)]))
    damped = any(part.viscosity for part in parts)
    system = system_from_arrays(
        sp.block_diag([part.M for part in parts]),
        sp.block_diag([part.viscosity * part.K for part in parts]) if damped else None,
        sp.block_diag([part.K for part in parts]),
        coordinates=nodes,
        unknowns=np.concatenate(meaning),
        load=Load(np.zeros(sum(sizes)), tuple(loads)),
        u0=np.concatenate([part.u0 for part in parts]),
        v0=np.concatenate([part.v0 for part in parts]),
    )

    # What the clamped node adds to the inertia of a rigid motion.
    inertia = sp.block_diag([part.inertia[:, None] for part in parts]).toarray()
    inertia_of_unknowns = np.column_stack([system.M @ rigid for rigid in system.influence.T])
    system = system.changed(base_mass=inertia - inertia_of_unknowns)

    # The tip is one point of weight 1: pressures are forces.
    tip = contact_points(system, [m], np.eye(1, d), gap0=gap)
    mass = None if across is None else ConsistentMass()
    return ContactProblem(system, tip, friction=friction, mass=mass)
