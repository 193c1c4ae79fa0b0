"""March the beam with friction at its tip under a given normal force, by Algorithm 10 of Ahn (2012), block elimination.

Midpoint rule (5.4), (5.5) for y = (theta, u), w = y', with the stiffness S and C = a2 S:

    P y1 = Q y0 + (2/dt) M w0 + f(t0) - e_m R,     P = 2/dt² M + (a2/dt + ½) S,   Q = 2/dt² M + (a2/dt - ½) S      (7.7)
    w1 = (2/dt) (y1 - y0) - w0                                                                                (7.11)

R is the friction force of the step at the tip, with the limit mu(t0, |w0_m|) |r_N(t0)|: force and coefficient are those
of the *old* time, as in the source. Solved for the increment d = y1 - y0, as Q = P - S: the same equations with less
round-off. With P split at the tip into T, p and P_mm, T is factorised once, and

    P d = r - e_m R,    r = (2/dt) M w0 - S y0 + f
    c = P_mm - pᵀT⁻¹p,    g = r_m - pᵀT⁻¹r     leave the scalar equation  c s - g + R(s) = 0  of tip.py        (7.8)
    d = (T⁻¹r - s T⁻¹p, s)                                                                                    (7.10)

One back-substitution per step. Energy: E = ½ wᵀMw + ½ yᵀSy, and (6.5) holds step by step:

    E1 - E0 = f·(y1 - y0) - a2/dt (y1 - y0)·S (y1 - y0) - R s,      each loss >= 0 (Lemma 11)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, islice
from pathlib import Path

import numpy as np

from ..core import checks
from ..core.algebra import Array, SerialFactor, SerialMatrix
from ..core.checks import array, counted, function, instance, number, provides, shown, whole
from ..core.errors import InputError, StepFailure
from .elements import BeamMatrices, Elements, beam_matrices
from .tip import ExactFriction, Slip, TipFriction
from .values import Start, TimoshenkoBeam

COLUMNS = (
    "t", "u_tip", "v_tip", "friction_force", "slip", "normal_force", "mu", "newton", "energy_kinetic", "energy_strain",
    "work_input", "loss_damping", "loss_friction",
)

@dataclass(frozen=True)
class Snapshot:
    """Hold the beam at a time: rows theta, omega, u, v at all nodes, the clamped one included, shape (4, m + 1)."""

    t: float
    values: Array


@dataclass(frozen=True)
class BeamRun:
    """Hold what a run recorded: columns of shape (steps + 1,) and, when asked for, snapshots.

    history: t [s]; u_tip [m], v_tip [m/s]; friction_force [N] and slip [m] of the step that led there; normal_force [N]
    and mu [-] of that step; newton: updates; energy_kinetic, energy_strain, work_input, loss_damping, loss_friction and
    energy_defect [J] (works and losses since the start).
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
        """Write the history as CSV, a line per time."""
        file = checks.path("BeamRun.save", "the path", path)
        if not file.parent.is_dir():
            raise InputError(f"BeamRun.save: there is no folder {shown(str(file.parent))}; make it first")
        columns = list(self.history)
        table = np.column_stack([self.history[name] for name in columns])
        np.savetxt(file, table, fmt="%.17g", delimiter=",", header=",".join(columns), comments="")
        return file

    def summary(self) -> str:
        """Return the energies, losses, tip and iterations in a few lines."""
        history, energy = self.history, self.energy
        defect = float(np.max(np.abs(history["energy_defect"])))
        return "\n".join([
            f"{len(energy) - 1} steps, t = 0 to {history['t'][-1]:g} s",
            f"  energy                  {energy[0]:.6g} J at the start, {energy[-1]:.6g} J at the end",
            f"  lost to viscosity       {history['loss_damping'][-1]:.6g} J",
            f"  lost to friction        {history['loss_friction'][-1]:.6g} J",
            f"  work of the load        {history['work_input'][-1]:.6g} J",
            f"  ledger closes to        {defect:.1e} J",
            f"  tip                     {history['u_tip'][-1]:.6g} m at the end, lowest {history['u_tip'].min():.6g} m",
            f"  steps that stick        {int(np.sum(history['slip'][1:] == 0.0))}",
            f"  Newton updates per step {self.mean_updates:.4g}, at most {int(history['newton'].max())}",
        ])


@dataclass(frozen=True)
class BeamStep:
    """Hold the end of a step: t [s], y and w there, increment of y, slip of the tip; |r_N| [N], mu and load [N/m]."""

    t: float
    y: Array
    w: Array
    increment: Array
    slip: Slip
    normal_force: float
    mu: float
    load: float


@dataclass(frozen=True)
class BeamStepper:
    """Make condensed steps. ``normal_force``: t -> |r_N| >= 0 [N]; ``mu``: (t, slip rate [m/s] >= 0) -> coefficient;
    ``load``: t -> uniform force along the beam [N/m], or None. InputError for dt <= 0."""

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
        function(owner, "normal_force", self.normal_force, "give a function of t that returns |r_N| in N")
        function(owner, "mu", self.mu, "give a function of (t, slip rate)")
        provides(owner, "friction", self.friction, ("solve",), "give ExactFriction() or RegularisedFriction(eps)",
                 lacks=("limit",))
        if self.load is not None:
            function(owner, "load", self.load, "give a function of t in N/m, or None")

    @cached_property
    def matrices(self) -> BeamMatrices:
        """Return M, S and the unit load."""
        return beam_matrices(self.beam, self.elements)

    def steps(self, y: Array, w: Array) -> Iterator[BeamStep]:
        """Yield steps without end, from y, w at t = 0. InputError for a bad force or coefficient; StepFailure with the
        number of the step and its time."""
        unknowns = (2 * self.elements.count,)
        y, w = array("BeamStepper", "y", y, unknowns), array("BeamStepper", "w", w, unknowns)
        M, S, dt = self.matrices.M, self.matrices.S, self.dt
        P = ((2.0 / dt**2) * M + (self.beam.viscosity / dt + 0.5) * S).tocsr()
        T = SerialFactor(SerialMatrix(P[:-1, :-1]))
        p = P[:-1, -1].toarray().ravel()
        column = T.solve(p)
        c = float(P[-1, -1] - p @ column)
        for k in count():
            t = k * dt
            N, mu, f = self._given(t, abs(float(w[-1])))
            r = (2.0 / dt) * (M @ w) - S @ y + f * self.matrices.load
            free = T.solve(r[:-1])
            g = float(r[-1] - p @ free)
            try:
                slip = self.friction.solve(c, g, mu * N)
            except StepFailure as failure:
                raise StepFailure(f"step {k + 1}, t = {t + dt:.6g} s: {failure}") from None
            increment = np.append(free - slip.s * column, slip.s)
            y, w = y + increment, (2.0 / dt) * increment - w
            if not (np.all(np.isfinite(y)) and np.all(np.isfinite(w))):
                raise StepFailure(f"step {k + 1}, t = {t + dt:.6g} s: the beam's motion is no finite number; check the "
                                  "loads and the state at the start")
            yield BeamStep((k + 1) * dt, y, w, increment, slip, N, mu, f)

    def _given(self, t: float, rate: float) -> tuple[float, float, float]:
        """(|r_N|, mu, load) at a time, checked."""
        owner, at = "BeamStepper", f"({t:.6g} s)"
        N = number(owner, f"normal_force{at}", self.normal_force(t), not_negative=True, unit="N")
        mu = number(owner, f"mu({t:.6g} s, {rate:.6g} m/s)", self.mu(t, rate), not_negative=True)
        return N, mu, 0.0 if self.load is None else number(owner, f"load{at}", self.load(t), unit="N/m")


def run_beam(stepper: BeamStepper, start: Start, *, steps: int, every: int = 0) -> BeamRun:
    """March ``steps`` steps from ``start`` and keep the ledger; ``every``: steps between snapshots, 0 for none.

    Raises InputError for bad numbers and StepFailure, with step and time, where the tip's equation is not solved.
    """
    instance("run_beam", "stepper", stepper, BeamStepper, "give BeamStepper(...)")
    instance("run_beam", "start", start, Start, "give Start(...)")
    steps, every = whole("run_beam", "steps", steps, least=1), whole("run_beam", "every", every)
    kept = (len(COLUMNS) + 1) * steps + (4 * stepper.elements.count * (steps // every) if every else 0)
    counted("run_beam", f"a run of {steps} steps", kept, "numbers to keep")
    x = stepper.elements.nodes(stepper.beam.length)
    y = np.concatenate([start.at("theta", x), start.at("u", x)])
    w = np.concatenate([start.at("omega", x), start.at("v", x)])
    rows: list[tuple[float, ...]] = [(0.0, y[-1], w[-1], *[0.0] * 5, *_energies(stepper, y, w), 0.0, 0.0, 0.0)]
    snapshots = [_snapshot(0.0, y, w)] if every else []
    for k, step in enumerate(islice(stepper.steps(y, w), steps), start=1):
        rows.append(_row(stepper, step))
        if every and k % every == 0:
            snapshots.append(_snapshot(step.t, step.y, step.w))
    return BeamRun(np.insert(x, 0, 0.0), _history(rows), tuple(snapshots))


def _snapshot(t: float, y: Array, w: Array) -> Snapshot:
    m = len(y) // 2
    values = np.zeros((4, m + 1))
    values[:, 1:] = y[:m], w[:m], y[m:], w[m:]
    return Snapshot(t, values)


def _energies(stepper: BeamStepper, y: Array, w: Array) -> tuple[float, float]:
    matrices = stepper.matrices
    return 0.5 * float(w @ (matrices.M @ w)), 0.5 * float(y @ (matrices.S @ y))


def _row(stepper: BeamStepper, step: BeamStep) -> tuple[float, ...]:
    """Values of a step by COLUMNS, works and losses its own."""
    matrices, slip, moved = stepper.matrices, step.slip, step.increment
    kinetic, strain = _energies(stepper, step.y, step.w)
    work = step.load * float(matrices.load @ moved)
    viscous = stepper.beam.viscosity / stepper.dt * float(moved @ (matrices.S @ moved))
    if not np.isfinite(kinetic + strain + work):
        raise StepFailure(f"t = {step.t:.6g} s: the energy of the beam is no finite number; check the loads and "
                          "the state at the start")
    return (step.t, step.y[-1], step.w[-1], slip.force, slip.s, step.normal_force, step.mu, slip.updates, kinetic,
            strain, work, viscous, slip.force * slip.s)


def _history(rows: list[tuple[float, ...]]) -> dict[str, Array]:
    """Columns by name: works and losses since the start, and what the energy lacks."""
    history = dict(zip(COLUMNS, np.array(rows, dtype=float).T, strict=True))
    for name in ("work_input", "loss_damping", "loss_friction"):
        history[name] = np.cumsum(history[name])
    energy = history["energy_kinetic"] + history["energy_strain"]
    spent = history["work_input"] - history["loss_damping"] - history["loss_friction"]
    return history | {"energy_defect": energy - energy[0] - spent}
