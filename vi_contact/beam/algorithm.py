"""March the beam with friction at its tip under a given normal force.

It is Algorithm 10 of Ahn (2012), by block elimination.

Midpoint rule (5.4), (5.5) for y = (theta, u), w = y', with the stiffness S and C = a2 S:

    P y1 = Q y0 + (2/dt) M w0 + f(t0) - e_m R                                   (7.7)
    P = 2/dt² M + (a2/dt + ½) S,    Q = 2/dt² M + (a2/dt - ½) S
    w1 = (2/dt) (y1 - y0) - w0                                                  (7.11)

R is the friction force of the step at the tip, with the limit mu(t0, |w0_m|) |r_N(t0)|: force and
coefficient are those of the *old* time, as in the source. Solved for the increment d = y1 - y0, as
Q = P - S: the same equations with less round-off. With P split at the tip into T, p and P_mm, T is
factorised once, and

    P d = r - e_m R,    r = (2/dt) M w0 - S y0 + f
    c = P_mm - pᵀT⁻¹p,    g = r_m - pᵀT⁻¹r      leave the scalar equation of tip.py
    c s - g + R(s) = 0                                                          (7.8)
    d = (T⁻¹r - s T⁻¹p, s)                                                      (7.10)

One back-substitution per step. Energy: E = ½ wᵀMw + ½ yᵀSy, and (6.5) holds step by step:

    E1 - E0 = f·(y1 - y0) - a2/dt (y1 - y0)·S (y1 - y0) - R s,      each loss >= 0 (Lemma 11)
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count, islice
from pathlib import Path

import numpy as np

from ..core import checks
from ..core.algebra import Array, SerialFactor, SerialMatrix
from ..core.checks import check_count, function, instance, number, optional, provides, whole
from ..core.errors import StepFailure
from ..core.files import write_csv
from .elements import Elements, beam_matrices
from .tip import ExactFriction, TipFriction
from .values import Start, TimoshenkoBeam

COLUMNS = (
    "t",
    "u_tip",
    "v_tip",
    "friction_force",
    "slip",
    "normal_force",
    "mu",
    "newton",
    "energy_kinetic",
    "energy_strain",
    "work_input",
    "loss_damping",
    "loss_friction",
)


@dataclass(frozen=True)
class Snapshot:
    """Hold the beam at a time.

    Args:
        t: the time [s].
        values: (4, m + 1), rows theta [-], omega [1/s], u [m], v [m/s] at all nodes, the clamped
            one first.
    """

    t: float
    values: Array


@dataclass(frozen=True)
class BeamRun:
    """Hold what a run recorded: columns of shape (steps + 1,) and, when asked for, snapshots.

    Args:
        x: positions of the nodes (m + 1,) [m], the clamped one first.
        history: t [s]; u_tip [m], v_tip [m/s]; friction_force [N] and slip [m] of the step that led
            there; normal_force [N] and mu [-] of that step; newton: updates; energy_kinetic,
            energy_strain, work_input, loss_damping, loss_friction and energy_defect [J] (works and
            losses since the start).
        snapshots: the whole beam at some times.
    """

    x: Array
    history: Mapping[str, Array]
    snapshots: tuple[Snapshot, ...]

    @property
    def energy(self) -> Array:
        """Return the energy ½ wᵀMw + ½ yᵀSy [J], (7.12)."""
        return np.asarray(self.history["energy_kinetic"] + self.history["energy_strain"])

    @property
    def mean_updates(self) -> float:
        """Return the mean number of Newton updates per step."""
        return float(np.mean(self.history["newton"][1:]))

    def save(self, path: str | Path) -> Path:
        """Write the history as CSV, a line per time, and return the path.

        Raises:
            InputError: the path is none, or a file may not be written there.
        """
        file = checks.path("BeamRun.save", "the path", path)
        rows = np.column_stack(list(self.history.values())).tolist()
        return write_csv(file, list(self.history), rows)


@dataclass(frozen=True)
class BeamStepper:
    """Describe a beam and what acts on it, for ``run_beam``.

    Args:
        beam: the body.
        elements: equal elements of deflection and rotation.
        dt: time step [s].
        normal_force: t [s] -> |r_N| >= 0 [N], which presses the tip on the wall.
        mu: (t [s], slip rate [m/s] >= 0) -> coefficient of friction >= 0 [-].
        friction: ``ExactFriction`` or ``RegularisedFriction``.
        load: t [s] -> uniform force across the beam [N/m], positive upwards; None: no load.

    Raises:
        InputError: dt is not positive, or an argument is of another type.

    Source: J. Ahn (2012), A viscoelastic Timoshenko beam with Coulomb law of friction, Algorithm
    10.
    """

    beam: TimoshenkoBeam
    elements: Elements
    dt: float
    normal_force: Callable[[float], float]
    mu: Callable[[float, float], float]
    friction: TipFriction = field(default_factory=ExactFriction)
    load: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        owner = "BeamStepper"
        instance(owner, "beam", self.beam, TimoshenkoBeam, "give a TimoshenkoBeam")
        instance(owner, "elements", self.elements, Elements, "give Elements(count)")
        number(owner, "the time step dt", self.dt, positive=True, unit="s")
        function(
            owner, "normal_force", self.normal_force, "give a function of t that returns |r_N| in N"
        )
        function(owner, "mu", self.mu, "give a function of (t, slip rate)")
        provides(
            owner,
            "friction",
            self.friction,
            ("solve",),
            "give ExactFriction() or RegularisedFriction(eps)",
            lacks=("limit",),
        )
        optional(function, owner, "load", self.load, "give a function of t in N/m, or None")

    def evaluate(self, t: float, rate: float) -> tuple[float, float, float]:
        """Return (|r_N| [N], mu [-], load [N/m]) at a time t [s] and a slip rate [m/s].

        Raises:
            InputError: a function returns no finite number, or a negative force or coefficient.
        """
        owner = "BeamStepper"
        time = f"{t:.6g} s"
        N = number(
            owner, f"normal_force({time})", self.normal_force(t), not_negative=True, unit="N"
        )
        mu = number(owner, f"mu({time}, {rate:.6g} m/s)", self.mu(t, rate), not_negative=True)
        load = 0.0
        if self.load is not None:
            load = number(owner, f"load({time})", self.load(t), unit="N/m")
        return N, mu, load


def run_beam(stepper: BeamStepper, start: Start, *, steps: int, every: int = 0) -> BeamRun:
    """March the beam by Algorithm 10 of Ahn (2012) and keep the energy ledger.

    The equations are those at the head of this file. The tip's friction opposes its motion; u is
    positive across and upwards.

    Args:
        stepper: the beam, its time step and what acts on it.
        start: u [m], v [m/s], theta [-] and omega [1/s] at t = 0.
        steps: number of steps.
        every: steps between snapshots of the whole beam; 0: none.

    Returns:
        The histories, with one row more than steps, and the snapshots.

    Raises:
        InputError: an argument is outside its range, or a function returns no finite number.
        StepFailure: the tip's equation is not solved; the message names step and time.
    """
    instance("run_beam", "stepper", stepper, BeamStepper, "give BeamStepper(...)")
    instance("run_beam", "start", start, Start, "give Start(...)")
    steps = whole("run_beam", "steps", steps, least=1)
    every = whole("run_beam", "every", every)
    size = (len(COLUMNS) + 1) * steps
    if every:
        size += 4 * stepper.elements.count * (steps // every)
    check_count("run_beam", f"a run of {steps} steps", size, "numbers to keep")

    # March, and keep a row of each state and snapshots of some.
    x = stepper.elements.nodes(stepper.beam.length)
    y0 = np.concatenate([start.at("theta", x), start.at("u", x)])
    w0 = np.concatenate([start.at("omega", x), start.at("v", x)])
    rows = list[tuple[float, ...]]()
    snapshots = list[Snapshot]()
    for k, (row, y, w) in enumerate(islice(_march(stepper, y0, w0), steps + 1)):
        rows.append(row)
        if every and k % every == 0:
            snapshots.append(Snapshot(row[0], _gather_values(y, w)))
    history = dict(zip(COLUMNS, np.array(rows, dtype=float).T, strict=True))

    # Works and losses since the start, and what their balance leaves over.
    for name in ("work_input", "loss_damping", "loss_friction"):
        history[name] = np.cumsum(history[name])
    energy = history["energy_kinetic"] + history["energy_strain"]
    spent = history["work_input"] - history["loss_damping"] - history["loss_friction"]
    history["energy_defect"] = energy - energy[0] - spent
    return BeamRun(np.insert(x, 0, 0.0), history, tuple(snapshots))


def _gather_values(y: Array, w: Array) -> Array:
    """Return theta, omega, u, v (4, m + 1) of y = (theta, u) and w = (omega, v), (2 m,) each."""
    values = np.zeros((4, len(y) // 2 + 1))
    values[:, 1:] = np.stack([y.reshape(2, -1), w.reshape(2, -1)], axis=1).reshape(4, -1)
    return values


def _march(
    stepper: BeamStepper, y: Array, w: Array
) -> Iterator[tuple[tuple[float, ...], Array, Array]]:
    """Yield (values by COLUMNS, y, w) at the start and after every step.

    Works and losses among the values are those of the step alone.

    Args:
        stepper: the beam, its time step and what acts on it.
        y: (2 m,) at the start, theta [-] and u [m].
        w: (2 m,) their rates.
    """
    dt = stepper.dt
    viscosity = stepper.beam.viscosity
    M, S, uniform = beam_matrices(stepper.beam, stepper.elements)

    def energies() -> tuple[float, float]:
        """Return the kinetic and the strain energy [J] of the present state."""
        return 0.5 * float(w @ (M @ w)), 0.5 * float(y @ (S @ y))

    yield (0.0, y[-1], w[-1], *[0.0] * 5, *energies(), 0.0, 0.0, 0.0), y, w

    # P, factorised once without the tip, and condensed to it: c.
    P = ((2.0 / dt**2) * M + (viscosity / dt + 0.5) * S).tocsr()
    T = SerialFactor(SerialMatrix(P[:-1, :-1]))
    p = P[:-1, -1].toarray().ravel()
    column = T.solve(p)
    c = float(P[-1, -1] - p @ column)
    for k in count():
        t = k * dt
        place = f"step {k + 1}, t = {k * dt + dt:.6g} s"

        # The slip of the tip (7.8), then the increment of all unknowns (7.10) and rates (7.11).
        N, mu, f = stepper.evaluate(t, abs(float(w[-1])))
        r = (2.0 / dt) * (M @ w) - S @ y + f * uniform
        free = T.solve(r[:-1])
        try:
            slip = stepper.friction.solve(c, float(r[-1] - p @ free), mu * N)
        except StepFailure as failure:
            raise StepFailure(f"{place}: {failure}") from None
        d = np.append(free - slip.s * column, slip.s)
        y = y + d
        w = (2.0 / dt) * d - w

        # Energies, and the terms of (6.5).
        kinetic, strain = energies()
        work = f * float(uniform @ d)
        viscous = viscosity / dt * float(d @ (S @ d))
        if not np.isfinite(kinetic + strain + work):
            raise StepFailure(
                f"{place}: the beam's motion or its energy is no finite number; check the loads "
                "and the state at the start"
            )
        values = (
            (k + 1) * dt,
            y[-1],
            w[-1],
            slip.force,
            slip.s,
            N,
            mu,
            slip.updates,
            kinetic,
            strain,
            work,
            viscous,
            slip.force * slip.s,
        )
        yield values, y, w
