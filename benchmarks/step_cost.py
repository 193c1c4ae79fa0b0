#!/usr/bin/env python3
"""What a unilateral step costs, as a multiple of a plain linear step with the same matrix, in one run.

    python3 benchmarks/step_cost.py [--sizes 216 2e3 2e4 2e5 6e4] [--problems wall channel block square] [--json FILE]

The wall of seed 000 with its whole right side in possible contact, its buried channel (two bodies, an impulse rule,
after its gravity stage), and a block in space shaken over ground: harmonic motion, Zienkiewicz-Wood-Taylor step, impact
rule and certificate on, no records, with and without friction. A linear step is right-hand side, one substitution and
update, with the fastest of PETSc's Cholesky, MUMPS and CHOLMOD in free ordering, timed beside every unilateral step;
set-up is ordering, factor and condensed matrix, beside a factorisation of PETSc's own Cholesky and of CHOLMOD's.
The square is the static problem of Signorini on triangles, assembly excluded, beside the way of commit f04e87a: PETSc's
factor, a substitution for every contact unknown, a second one for the reactions.

Processor time of one thread; medians and means over steps that have contact.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core import contact_last  # noqa: E402
from vi_contact.core.algebra import EffectiveMatrix, SerialComm  # noqa: E402
from vi_contact.core.compiled import library  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402
from vi_contact.fem.petsc_algebra import PREFIX, PetscFactor  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402
from vi_contact.meshes.channel import ChannelMesh  # noqa: E402
from vi_contact.models.channel import model as channel  # noqa: E402
from vi_contact.models.wall import Wall, build  # noqa: E402

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)
WALLS = {216: (8, 12), 2e3: (26, 39), 2e4: (82, 123), 2e5: (167, 600)}  # up to 600 contact points
CELLS = {2e3: 0.45, 2e4: 0.14, 2e5: 0.0436}  # of the channel's mesh [m]; up to 232 contact points
BLOCKS = {2e4: 18, 6e4: 26}  # cells along each side; 361 and 729 contact points
SQUARES = {2e4: 100, 2e5: 316}
SIZES = (216, 2e3, 2e4, 2e5, 6e4)
PETSC_IN_SPACE = 3e4  # unknowns beyond which PETSc's own factorisation in three dimensions takes minutes
RUBBING = vc.Coulomb(0.4)
Problem = tuple[vc.ContactProblem, float, Any]  # with its dt and the state it starts from


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """(seconds of processor time, result)."""
    start = time.thread_time()
    result = work()
    return time.thread_time() - start, result


def wall(size: float, friction: Any) -> Problem:
    """The wall, its whole right side in possible contact."""
    model = build(Wall(divisions=WALLS[size]), MPI.COMM_SELF, base_inertia="catalogue")
    return rubbing(model.problem("face"), friction), model.time_step(), None


def buried(size: float, friction: Any) -> Problem:
    """The buried channel at rest under its weight."""
    model = channel.build(channel.Channel(ChannelMesh(size=CELLS[size])), MPI.COMM_SELF)
    problem = model.problem(friction=friction)
    return problem, model.channel.time_step(), vc.static_equilibrium(problem, solver=vc.Condensed())


def block(size: float, friction: Any) -> Problem:
    """A cube, clamped at its top, shaken over the ground that it just touches."""
    n, f = BLOCKS[size], 400.0
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0, 1.0), divisions=(n, n, n)), MPI.COMM_SELF)
    system = fem.assemble(mesh, vc.LinearElastic(E=3e10, nu=0.2, rho=2400.0), clamped=tags["top"])
    ground = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    problem = vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"], obstacle=ground), mass=vc.ConsistentMass(),
        impact=vc.Inelastic(), excitation=vc.Harmonic(1.0, f, direction=(0.3, 1.0, 0.0)),
    )
    return rubbing(problem, friction), 1.0 / (40.0 * f), None


def rubbing(problem: vc.ContactProblem, friction: Any) -> vc.ContactProblem:
    """The problem with friction, when there is some."""
    return problem if friction is None else replace(problem, friction=friction)


PROBLEMS: dict[str, tuple[Callable[[float, Any], Problem], dict[float, Any], tuple[Any, ...]]] = {
    "wall": (wall, WALLS, (None, RUBBING)),
    "channel": (buried, CELLS, (None, RUBBING)),
    "block": (block, BLOCKS, (None, RUBBING)),
}


class Cholmod:
    """CHOLMOD's own factor in free ordering, and its own substitutions."""

    def __init__(self, matrix: Any) -> None:
        ends, columns, values = matrix.mat.getValuesCSR()
        A = sp.csr_matrix((values, columns, ends), shape=(len(ends) - 1,) * 2)
        mine, contact_last.SHORT_COLUMNS = contact_last.SHORT_COLUMNS, 0.0
        self.factor = contact_last.ContactLast(library(SerialComm()), A, np.zeros(0, dtype=np.int64))
        contact_last.SHORT_COLUMNS = mine

    def solve(self, b: np.ndarray) -> np.ndarray:
        """A⁻¹ b."""
        x = b.copy()
        self.factor._library.substitute(self.factor._factor, 0, x.ctypes.data)  # CHOLMOD_A
        return x


def petsc(kind: str) -> Callable[[Any], Any]:
    """What factorises by PETSc's own Cholesky or by MUMPS."""
    def factorise(matrix: Any) -> Any:
        options = {"pc_type": "cholesky", "pc_factor_mat_solver_type": kind, "pc_factor_mat_ordering_type": "amd"}
        database = PETSc.Options(PREFIX)
        for name, value in options.items():
            database[name] = value
        try:
            return PetscFactor(matrix)
        finally:
            for name in options:
                database.delValue(name)
    return factorise


@dataclass
class Linear:
    """Plain linear steps by several factors of one matrix, on a state of their own. ``setup``: seconds of each."""

    problem: vc.ContactProblem
    dt: float

    def __post_init__(self) -> None:
        self.A = SCHEME.effective_matrix(self.problem, self.dt)
        in_space = self.problem.surface.points.shape[1] == 3
        makers = {"PETSc": petsc("petsc"), "MUMPS": petsc("mumps"), "CHOLMOD": Cholmod}
        if in_space and self.A.matrix.rows > PETSC_IN_SPACE:
            del makers["PETSc"]
        self.setup, self.factors = {}, {}
        for name, make in makers.items():
            self.setup[name], self.factors[name] = timed(lambda make=make: make(self.A.matrix))
        self.seconds: dict[str, list[float]] = {name: [] for name in makers}
        self.state = initial_state(self.problem)
        self.none = np.zeros(self.problem.surface.count)

    def __call__(self) -> None:
        """Step once with every factor, from the same state."""
        for name, factor in self.factors.items():
            spent, state = timed(lambda factor=factor: self._step(factor))
            self.seconds[name].append(spent)
        self.state = state

    def _step(self, factor: Any) -> vc.State:
        step = SCHEME.step(self.problem, self.state, self.A, self.dt)
        result = vc.StepResult(factor.solve(step.b), self.none, self.none > 0.0, 0, "linear")
        return SCHEME.finish(self.problem, self.state, step, result, self.dt)

    def fastest(self) -> str:
        """The factor whose steps are the fastest."""
        return min(self.seconds, key=lambda name: float(np.median(self.seconds[name])))


def set_up(problem: vc.ContactProblem, dt: float, scale: float) -> float:
    """Seconds to order, factorise and condense, once more from nothing."""
    A = SCHEME.effective_matrix(problem, dt)

    def condensed() -> Any:
        prepared = vc.Condensed().prepare(A, problem.surface, scale)
        return prepared.friction if problem.frictional else prepared.delassus

    return timed(condensed)[0]


class StepsWithContact:
    """Iterates over the reports of ``count`` steps with contact after a third as many to warm up, each beside linear
    steps. ``seconds`` of each; ``plain``: of the linear steps by the fastest factor; ``active``: points in contact;
    ``worst``: certificate of all steps."""

    def __init__(self, problem: vc.ContactProblem, solver: Any, dt: float, count: int, linear: Linear,
                 state: vc.State | None = None) -> None:
        self.loop = vc.march(problem, scheme=SCHEME, solver=solver, dt=dt, steps=10**6, state=state)
        self.count, self.linear, self.worst = count, linear, 0.0
        self.seconds: list[float] = []
        self.active: list[int] = []

    def __iter__(self) -> Iterator[vc.Report]:
        warm_up = self.count // 3
        while len(self.seconds) < self.count:
            spent, (_, report) = timed(lambda: next(self.loop))
            self.worst = max(self.worst, report.certificate.worst)
            if not report.new.active.any():
                continue
            self.linear()
            warm_up -= 1
            if warm_up < 0:
                self.seconds.append(spent)
                self.active.append(int(report.new.active.sum()))
                yield report

    @property
    def plain(self) -> list[float]:
        """Seconds of the linear steps beside those with contact."""
        return self.linear.seconds[self.linear.fastest()][-len(self.seconds) :]


def measure(name: str, size: float, friction: Any, count: int) -> dict[str, Any]:
    """One problem of one size: its steps with contact, and once more its set-up."""
    problem, dt, state = PROBLEMS[name][0](size, friction)
    linear, surface = Linear(problem, dt), problem.surface
    steps = StepsWithContact(problem, vc.Condensed(), dt, count, linear, state)
    scale = [report.step.scale for report in steps][-1]
    setup, own = set_up(problem, dt, scale), linear.setup.get("PETSc")
    median, mean, plain = np.median(steps.seconds), np.mean(steps.seconds), steps.plain
    return {
        "unknowns": linear.A.matrix.rows, "points": surface.total, "dimension": surface.points.shape[1],
        "problem": name, "method": "condensed", "friction": None if friction is None else repr(friction),
        "ratio_median": float(median / np.median(plain)), "ratio_mean": float(mean / np.mean(plain)),
        "setup_seconds": setup, "setup_over_factorisation": None if own is None else setup / own,
        "setup_over_cholmod": setup / linear.setup["CHOLMOD"], "seconds_per_step": float(median),
        "seconds_per_linear_step": float(np.median(plain)), "linear": linear.fastest(), "certificate": steps.worst,
        "closed": float(np.mean(steps.active)),
    }


class Whole(EffectiveMatrix):
    """A matrix that orders nothing last, as at commit f04e87a."""

    def contact_last(self, last: Any) -> None:
        return None


@dataclass(frozen=True)
class Before:
    """Condense by PETSc's factor and two whole substitutions, as at commit f04e87a."""

    def check(self, problem: vc.ContactProblem) -> None:
        """Everything is right."""

    def prepare(self, A: EffectiveMatrix, surface: vc.ContactSurface, scale: float) -> Any:
        """The condensed solver without contact last."""
        return vc.Condensed().prepare(Whole(A.matrix, A.algebra), surface, scale)


def square(size: float) -> dict[str, Any]:
    """The static problem of Signorini, both ways in turn."""
    n = SQUARES[size]
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(n, n), simplices=True), MPI.COMM_SELF)
    system = fem.assemble(mesh, vc.LinearElastic(E=1.0, nu=0.3, rho=1.0), clamped=tags["top"],
                          loads=fem.BodyForce((0.0, -0.05)))
    ground = vc.AnalyticGap(lambda x: 0.05 * (x[:, 0] - 0.5) ** 2)
    problem = vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=ground))
    seconds: dict[str, list[float]] = {"before": [], "now": []}
    for _ in range(3 if size < 1e5 else 1):
        states = {}
        for name, solver in (("before", Before()), ("now", vc.Condensed())):
            spent, states[name] = timed(lambda solver=solver: vc.static_equilibrium(problem, solver=solver))
            seconds[name].append(spent)
    one, other = states["now"], states["before"]
    before, now = (float(np.median(seconds[name])) for name in ("before", "now"))
    return {
        "unknowns": system.rows, "points": problem.surface.total, "dimension": 2, "problem": "unit square, static",
        "method": "condensed", "friction": None, "ratio_median": None, "ratio_mean": None, "setup_seconds": None,
        "setup_over_factorisation": None, "seconds_per_step": now, "certificate": certificate(problem, one),
        "seconds_before": before, "over_before": now / before, "closed": float(one.active.sum()),
        "difference": float(np.abs(one.u - other.u).max() / np.abs(other.u).max()),
    }


def certificate(problem: vc.ContactProblem, state: vc.State) -> float:
    """Residual of equilibrium of a static state, over its largest force."""
    system = problem.static_load
    forces = system.K @ state.u
    residual = forces - system.load.at_rest(0.0) + problem.surface.reaction_load(state.r_n, len(state.u))
    return float(np.abs(residual).max() / np.abs(state.r_n).max())


COLUMNS = (  # title, width, format, key
    ("unknowns", 8, "d", "unknowns"), ("points", 6, "d", "points"), ("closed", 6, ".0f", "closed"),
    ("problem", 20, "s", "problem"), ("friction", 12, "s", "friction"), ("ms", 9, ".3f", "ms"),
    ("linear", 8, "s", "linear"), ("median", 6, ".2f", "ratio_median"), ("mean", 6, ".2f", "ratio_mean"),
    ("set-up s", 8, ".3f", "setup_seconds"), ("/PETSc", 6, ".2f", "setup_over_factorisation"),
    ("/CHOLMOD", 8, ".2f", "setup_over_cholmod"), ("before", 6, ".2f", "over_before"),
    ("certificate", 11, ".0e", "certificate"),
)


def line(row: dict[str, Any]) -> str:
    """One row of the table."""
    shown = row | {"ms": 1e3 * row["seconds_per_step"]}
    cells = ((shown.get(key), width, form) for _, width, form, key in COLUMNS)
    return " ".join(f"{'-':>{width}}" if value is None else f"{value:>{width}{form}}" for value, width, form in cells)


def main() -> None:
    """Prints the table and writes it with --json."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument("--problems", nargs="+", default=[*PROBLEMS, "square"], choices=[*PROBLEMS, "square"])
    parser.add_argument("--steps", type=int, default=40, help="steps with contact that are timed")
    parser.add_argument("--json", type=Path, help="file for all figures")
    options = parser.parse_args()
    print(" ".join(f"{title:>{width}}" for title, width, _, _ in COLUMNS), flush=True)
    rows: list[dict[str, Any]] = []

    def add(row: dict[str, Any]) -> None:
        rows.append(row)
        print(line(row), flush=True)
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1) + "\n")

    for size in options.sizes:
        for name, (_, sizes, laws) in PROBLEMS.items():
            for friction in laws if name in options.problems and size in sizes else ():
                add(measure(name, size, friction, options.steps))
        if "square" in options.problems and size in SQUARES:
            add(square(size))


if __name__ == "__main__":
    main()
