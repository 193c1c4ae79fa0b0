#!/usr/bin/env python3
"""Measure what a unilateral step costs, in plain linear steps with the same matrix.

Both are timed in one run.

    python3 benchmarks/step_cost.py [--sizes 2e4 1e5] [--problems wall channel block square]
        [--json FILE]

The problems are the wall of docs/start/first_wall.md with its whole right side in possible contact,
the buried channel (two bodies and an impact law, after the gravity stage), and a block in space
that is shaken over ground. They have a harmonic motion, the Zienkiewicz-Wood-Taylor step, an impact
law and the certificate, with and without friction, and nothing is recorded. A linear step is
right-hand side, one substitution and update, with the fastest of PETSc's Cholesky, MUMPS and
CHOLMOD in free ordering; it is timed beside every unilateral step. Set-up is ordering, factor and
condensed matrix, beside a factorisation of PETSc's own Cholesky and of CHOLMOD's. The square is the
static problem of Signorini on triangles without assembly. It stands beside the plain way to
condense: PETSc's factor, a substitution for every contact unknown, and a second one for the
reactions.

Products with M, C and K are counted in a step, and timed in turn with products of the same matrices
as AIJ.

Seconds are processor time of one thread. Medians and means are over steps with contact. Any size
can be asked for, in unknowns. Sizes in space and in statics that teach nothing or take minutes are
left out.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from mpi4py import MPI  # noqa: E402
from petsc4py import PETSc  # noqa: E402

import vi_contact as vc  # noqa: E402
from demos.parts.problems import channel  # noqa: E402
from demos.parts.problems.wall import Wall, build  # noqa: E402
from vi_contact import fem  # noqa: E402
from vi_contact.core.algebra import EffectiveMatrix, SerialComm  # noqa: E402
from vi_contact.core.stage import complete, make_matrix, pose  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402
from vi_contact.fem.matrices.petsc_algebra import (  # noqa: E402
    PREFIX,
    PetscFactor,
    PetscMatrix,
)
from vi_contact.kernels import contact_last  # noqa: E402
from vi_contact.kernels.compiler import load_cholmod, locate_arrays  # noqa: E402
from vi_contact.meshes.block import BlockMesh  # noqa: E402
from vi_contact.meshes.channel import ChannelMesh  # noqa: E402

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)
SIZES = {
    "wall": (216, 2e3, 2e4, 2e5),
    "channel": (216, 2e3, 2e4, 2e5),
    "block": (2e4, 6e4),
    "square": (2e4, 2e5),
}
SERVES = {
    "wall": (0.0, np.inf),
    "channel": (0.0, np.inf),
    "block": (5e3, 1e5),
    "square": (5e3, np.inf),
}
PETSC_IN_SPACE = (
    3e4  # unknowns beyond which PETSc's own factorisation in three dimensions takes minutes
)
SHORT_STEPS = 5e3  # unknowns below which ten times as many steps are timed
COUNTED = 20  # steps in which products are counted
RUBBING = vc.Coulomb(0.4)
Problem = tuple[vc.ContactProblem, float, Any]  # with its dt and the state it starts from


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the seconds of processor time of a call, and its result."""
    start = time.thread_time()
    result = work()
    return time.thread_time() - start, result


def wall_cells(size: float) -> tuple[int, int]:
    """Return the cells of the wall along its axes; 600 contact points from 1e5 unknowns on."""
    if size >= 1e5:
        return math.ceil(size / 1200.0), 600
    wide = math.ceil(math.sqrt(0.25 + size / 3.0) - 0.5)
    return wide, round(1.5 * wide)


def wall(size: float, friction: Any) -> Problem:
    """Return the wall, its whole right side in possible contact."""
    model = build(Wall(divisions=wall_cells(size)), MPI.COMM_SELF, base_inertia="catalogue")
    return rubbing(model.problem("face"), friction), model.time_step(), None


def buried(size: float, friction: Any) -> Problem:
    """Return the buried channel at rest under its weight; at 2e5 unknowns 232 contact points."""
    model = channel.build(
        channel.Channel(ChannelMesh(size=0.14 * math.sqrt(2e4 / size))), MPI.COMM_SELF
    )
    problem = model.problem(friction=friction)
    return problem, model.channel.time_step(), vc.static_equilibrium(problem, solver=vc.Condensed())


def block(size: float, friction: Any) -> Problem:
    """Return a cube, clamped at its top, shaken over the ground that it just touches."""
    n = math.floor((size / 3.0) ** (1.0 / 3.0) - 2.0 / 3.0)
    f = 400.0
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(1.0, 1.0, 1.0), divisions=(n, n, n)), MPI.COMM_SELF
    )
    system = fem.assemble(mesh, vc.LinearElastic(E=3e10, nu=0.2, rho=2400.0), clamped=tags["top"])
    ground = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    problem = vc.ContactProblem(
        system,
        fem.contact_surface(system, tags["bottom"], obstacle=ground),
        mass=vc.ConsistentMass(),
        impact=vc.Inelastic(),
        excitation=vc.Harmonic(1.0, f, direction=(0.3, 1.0, 0.0)),
    )
    return rubbing(problem, friction), 1.0 / (40.0 * f), None


def rubbing(problem: vc.ContactProblem, friction: Any) -> vc.ContactProblem:
    """Return the problem with friction, when there is some."""
    return problem if friction is None else replace(problem, friction=friction)


PROBLEMS: dict[str, Callable[[float, Any], Problem]] = {
    "wall": wall,
    "channel": buried,
    "block": block,
}


class Cholmod:
    """Factorise by CHOLMOD in free ordering, and use its own substitutions."""

    def __init__(self, matrix: Any) -> None:
        ends, columns, values = matrix.mat.getValuesCSR()
        A = sp.csr_matrix((values, columns, ends), shape=(len(ends) - 1,) * 2)
        mine = contact_last.SHORT_COLUMNS
        contact_last.SHORT_COLUMNS = 0.0
        self.factor = contact_last.ContactLast(
            load_cholmod(SerialComm()), A, np.zeros(0, dtype=np.int64)
        )
        contact_last.SHORT_COLUMNS = mine

    def solve(self, b: np.ndarray) -> np.ndarray:
        """Return A⁻¹ b."""
        x = b.copy()
        self.factor._library.substitute(self.factor._factor, 0, 1, *locate_arrays(x))  # CHOLMOD_A
        return x


def petsc(kind: str, order: str) -> Callable[[Any], Any]:
    """Return what factorises by PETSc's own Cholesky in this order, or by MUMPS in its own."""

    def factorise(matrix: Any) -> Any:
        options = {
            "pc_type": "cholesky",
            "pc_factor_mat_solver_type": kind,
            "pc_factor_mat_ordering_type": order,
        }
        database = PETSc.Options(PREFIX)
        for name, value in options.items():
            database[name] = value
        try:
            return PetscFactor(matrix)
        finally:
            for name in options:
                database.delValue(name)

    return factorise


class Factors:
    """Hold one matrix, factorised in several ways.

    ``setup``: seconds of each; small ones are made again, as caches warm.
    """

    def __init__(self, matrix: Any, dimension: int) -> None:
        # in space nested dissection is three times as fast
        order = "nd" if dimension == 3 else "amd"
        makers = {
            "PETSc": petsc("petsc", order),
            "MUMPS": petsc("mumps", "amd"),
            "CHOLMOD": Cholmod,
        }
        if dimension == 3 and matrix.rows > PETSC_IN_SPACE:
            del makers["PETSc"]
        self.setup: dict[str, float] = {}
        self.by: dict[str, Any] = {}
        for name, make in makers.items():
            self.setup[name], self.by[name] = repeated(lambda make=make: make(matrix), matrix.rows)


def repeated(work: Callable[[], Any], rows: int) -> tuple[float, Any]:
    """Return the median of seconds of processor time of several calls, and the last result."""
    found = [timed(work) for _ in range(9 if rows < SHORT_STEPS else 3 if rows < 3e4 else 1)]
    return float(np.median([seconds for seconds, _ in found])), found[-1][1]


def make_effective(problem: vc.ContactProblem, dt: float) -> EffectiveMatrix:
    """Return the matrix of steps of dt [s]."""
    state = initial_state(problem)
    return make_matrix(problem.equations, SCHEME.stage(problem, state, dt))


@dataclass
class Linear:
    """Take plain linear steps by several factors of the matrix of the problem.

    They march on a state of their own.
    """

    problem: vc.ContactProblem
    dt: float
    factors: dict[str, Any]

    def __post_init__(self) -> None:
        self.A = make_effective(self.problem, self.dt)
        self.seconds: dict[str, list[float]] = {name: [] for name in self.factors}
        self.state = initial_state(self.problem)
        self.none = np.zeros(self.problem.surface.count)

    def __call__(self) -> None:
        """Step once with every factor, from the same state."""
        for name, factor in self.factors.items():
            spent, state = timed(lambda factor=factor: self._step(factor))
            self.seconds[name].append(spent)
        self.state = state

    def _step(self, factor: Any) -> vc.State:
        stage = SCHEME.stage(self.problem, self.state, self.dt)
        step = pose(self.problem, stage, self.A)
        result = vc.StepResult(factor.solve(step.b), self.none, self.none > 0.0, 0, "linear")
        answer = complete(stage, step, result)
        return SCHEME.finish(self.problem, self.state, stage, answer, self.dt)

    def fastest(self) -> str:
        """Return the name of the factor whose steps are the fastest."""
        return min(self.seconds, key=lambda name: float(np.median(self.seconds[name])))


def set_up(problem: vc.ContactProblem, dt: float, scale: float) -> float:
    """Return the seconds to order, factorise and condense, once more from nothing."""
    matrix = make_effective(problem, dt)

    def condensed() -> Any:
        A = EffectiveMatrix(matrix.matrix, matrix.algebra)
        prepared = vc.Condensed().prepare(A, problem.surface, scale)
        return prepared.friction if problem.frictional else prepared.delassus

    return repeated(condensed, matrix.matrix.rows)[0]


class StepsWithContact:
    """Iterate over the reports of ``count`` steps with contact, each beside linear steps.

    A third as many before them warm up. ``seconds`` of each; ``plain``: of the linear steps by the
    fastest factor; ``active``: points in contact; ``worst``: certificate of all steps.
    """

    def __init__(
        self,
        problem: vc.ContactProblem,
        solver: Any,
        dt: float,
        count: int,
        linear: Linear,
        state: vc.State | None = None,
    ) -> None:
        self.loop = vc.march(problem, scheme=SCHEME, solver=solver, dt=dt, steps=10**6, state=state)
        self.count = count
        self.linear = linear
        self.worst = 0.0
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
        """Return the seconds of the linear steps beside those with contact."""
        return self.linear.seconds[self.linear.fastest()][-len(self.seconds) :]


def measured(name: str, size: float, count: int) -> Iterator[dict[str, Any]]:
    """Yield the rows of one problem of one size, without and with friction.

    They have the same matrix, which is factorised once.
    """
    factors = None
    for friction in (None, RUBBING):
        problem, dt, state = PROBLEMS[name](size, friction)
        if factors is None:
            matrix = make_effective(problem, dt).matrix
            factors = Factors(matrix, problem.surface.points.shape[1])
        yield measure(name, (problem, dt, state), factors, count)


def measure(name: str, given: Problem, factors: Factors, count: int) -> dict[str, Any]:
    """Return the row of the steps with contact of one problem, and once more its set-up."""
    problem, dt, state = given
    linear = Linear(problem, dt, factors.by)
    surface = problem.surface
    steps = StepsWithContact(problem, vc.Condensed(), dt, count, linear, state)
    scale = [report.step.scale for report in steps][-1]
    setup = set_up(problem, dt, scale)
    own = factors.setup.get("PETSc")
    matrices = marched(problem.equations)
    median = np.median(steps.seconds)
    mean = np.mean(steps.seconds)
    plain = steps.plain
    return {
        "unknowns": linear.A.matrix.rows,
        "points": surface.total,
        "dimension": surface.points.shape[1],
        "problem": name,
        "method": "condensed",
        "friction": repr(problem.friction) if problem.frictional else None,
        "ratio_median": float(median / np.median(plain)),
        "ratio_mean": float(mean / np.mean(plain)),
        "setup_seconds": setup,
        "setup_over_factorisation": None if own is None else setup / own,
        "setup_over_cholmod": setup / factors.setup["CHOLMOD"],
        "seconds_per_step": float(median),
        "seconds_per_linear_step": float(np.median(plain)),
        "linear": linear.fastest(),
        "certificate": steps.worst,
        "closed": float(np.mean(steps.active)),
        "product_format": {name: one.product_format for name, one in matrices.items()},
        "products_per_step": count_products(matrices, steps.loop) / COUNTED,
        "product_over_aij": compare_products(matrices),
    }


def marched(system: vc.SemiDiscreteSystem) -> dict[str, PetscMatrix]:
    """Return the matrices of a system by name."""
    matrices = {name: getattr(system, name) for name in ("M", "C", "K")}
    return {name: matrix for name, matrix in matrices.items() if matrix is not None}


class Counting:
    """Count the products by a PETSc matrix, and make them."""

    def __init__(self, mat: Any) -> None:
        self.mat = mat
        self.count = 0

    def mult(self, x: Any, y: Any) -> None:
        """Write A x to y."""
        self.count += 1
        self.mat.mult(x, y)


def count_products(matrices: dict[str, PetscMatrix], loop: Iterator[Any]) -> int:
    """Return how many products with the matrices the next steps make; these are not timed."""
    with ExitStack() as stack:
        counters = []
        for matrix in matrices.values():
            counter = Counting(matrix._multiplied)
            stack.enter_context(patch.object(matrix, "_multiplied", counter))
            counters.append(counter)
        for _ in range(COUNTED):
            next(loop)
    return sum(counter.count for counter in counters)


def compare_products(matrices: dict[str, PetscMatrix]) -> float:
    """Return what a product with each matrix costs, over products of the same as AIJ, in turn."""
    used = list(matrices.values())
    # ``mat`` is AIJ, and nobody has told this one that many products follow
    plain = [PetscMatrix(matrix.mat) for matrix in used]
    x = np.random.default_rng(1).normal(size=used[0].rows)
    seconds: dict[str, list[float]] = {"used": [], "plain": []}
    for _ in range(2 * COUNTED):
        for name, ones in (("used", used), ("plain", plain)):
            spent, _ = timed(lambda ones=ones: [matrix @ x for matrix in ones])
            seconds[name].append(spent)
    return float(np.median(seconds["used"]) / np.median(seconds["plain"]))


class Whole(EffectiveMatrix):
    """Hold a matrix that orders no unknowns last, for the plain way to condense."""

    def contact_last(self, last: Any) -> None:
        """Return nothing, so that no order of the contact unknowns is used."""
        return None


@dataclass(frozen=True)
class Before:
    """Condense by PETSc's factor and two whole substitutions, the plain way."""

    def check(self, problem: vc.ContactProblem) -> None:
        """Accept everything."""

    def prepare(self, A: EffectiveMatrix, surface: vc.ContactSurface, scale: float) -> Any:
        """Prepare the condensed solver without contact last."""
        return vc.Condensed().prepare(Whole(A.matrix, A.algebra), surface, scale)


def square(size: float) -> dict[str, Any]:
    """Solve the static problem of Signorini, both ways in turn, and return its row."""
    n = math.ceil(math.sqrt(0.5 * size) - 0.5)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(1.0, 1.0), divisions=(n, n), simplices=True), MPI.COMM_SELF
    )
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=1.0, nu=0.3, rho=1.0),
        clamped=tags["top"],
        loads=fem.BodyForce((0.0, -0.05)),
    )
    ground = vc.AnalyticGap(lambda x: 0.05 * (x[:, 0] - 0.5) ** 2)
    problem = vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"], obstacle=ground)
    )
    seconds: dict[str, list[float]] = {"before": [], "now": []}
    for _ in range(3 if size < 1e5 else 1):
        states = {}
        for name, solver in (("before", Before()), ("now", vc.Condensed())):
            spent, states[name] = timed(
                lambda solver=solver: vc.static_equilibrium(problem, solver=solver)
            )
            seconds[name].append(spent)
    one, other = states["now"], states["before"]
    before, now = (float(np.median(seconds[name])) for name in ("before", "now"))
    return {
        "unknowns": system.rows,
        "points": problem.surface.total,
        "dimension": 2,
        "problem": "unit square, static",
        "method": "condensed",
        "friction": None,
        "ratio_median": None,
        "ratio_mean": None,
        "setup_seconds": None,
        "setup_over_factorisation": None,
        "seconds_per_step": now,
        "certificate": certificate(problem, one),
        "seconds_before": before,
        "over_before": now / before,
        "closed": float(one.active.sum()),
        "product_format": {"K": system.K.product_format},
        "products_per_step": None,
        "product_over_aij": compare_products({"K": system.K}),
        "difference": float(np.abs(one.u - other.u).max() / np.abs(other.u).max()),
    }


def certificate(problem: vc.ContactProblem, state: vc.State) -> float:
    """Return the residual of equilibrium of a static state, over its largest force."""
    system = problem.static_load
    forces = system.K @ state.u
    residual = (
        forces - system.load.at_rest(0.0) + problem.surface.reaction_load(state.r_n, len(state.u))
    )
    return float(np.abs(residual).max() / np.abs(state.r_n).max())


COLUMNS = (  # title, width, format, key
    ("unknowns", 8, "d", "unknowns"),
    ("points", 6, "d", "points"),
    ("closed", 6, ".0f", "closed"),
    ("problem", 20, "s", "problem"),
    ("friction", 12, "s", "friction"),
    ("ms", 9, ".3f", "ms"),
    ("linear", 8, "s", "linear"),
    ("median", 6, ".2f", "ratio_median"),
    ("mean", 6, ".2f", "ratio_mean"),
    ("set-up s", 8, ".3f", "setup_seconds"),
    ("/PETSc", 6, ".2f", "setup_over_factorisation"),
    ("/CHOLMOD", 8, ".2f", "setup_over_cholmod"),
    ("products", 8, ".1f", "products_per_step"),
    ("/AIJ", 5, ".2f", "product_over_aij"),
    ("before", 6, ".2f", "over_before"),
    ("certificate", 11, ".0e", "certificate"),
)


def line(row: dict[str, Any]) -> str:
    """Return one row of the table, with a dash for what it does not have."""
    shown = row | {"ms": 1e3 * row["seconds_per_step"]}
    cells = ((shown.get(key), width, form) for _, width, form, key in COLUMNS)
    return " ".join(
        f"{'-':>{width}}" if value is None else f"{value:>{width}{form}}"
        for value, width, form in cells
    )


def main() -> None:
    """Print the table, and write it with --json."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument(
        "--sizes", type=float, nargs="+", help="numbers of unknowns (default: as in the guide)"
    )
    parser.add_argument("--problems", nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument(
        "--steps", type=int, default=40, help="number of steps with contact that are timed"
    )
    parser.add_argument("--json", type=Path, help="file for all numbers")
    options = parser.parse_args()
    print(" ".join(f"{title:>{width}}" for title, width, _, _ in COLUMNS), flush=True)
    rows: list[dict[str, Any]] = []

    def add(row: dict[str, Any]) -> None:
        rows.append(row)
        print(line(row), flush=True)
        if options.json:
            options.json.write_text(json.dumps(rows, indent=1) + "\n")

    for size in options.sizes or sorted({size for sizes in SIZES.values() for size in sizes}):
        for name in options.problems:
            least, most = SERVES[name]
            if not (least <= size <= most if options.sizes else size in SIZES[name]):
                continue
            many = 10 if size < SHORT_STEPS else 1
            for row in (
                [square(size)] if name == "square" else measured(name, size, many * options.steps)
            ):
                add(row)


if __name__ == "__main__":
    main()
