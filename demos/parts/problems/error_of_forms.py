"""Measure the error of both forms of the Poincaré-Steklov operator.

It is that against the finest symmetric solution.

The source (Aimi, Di Credico, Gimperlein, Comput. Methods Appl. Mech. Engrg. 427 (2024) 117066) says
of concrete on steel: "The squared energy error for both couplings decays with similar slope."
Displacements of nested meshes and time steps lie in the finest space, whose symmetric operator S
knows the energy of any motion v of the boundary:

    |v|²(t_n) = sum_(k<=n) (S v)_k . (v_k - v_(k-1))
    error² = sum_n |u_h - u|²(t_n) / sum_n |u|²(t_n),

u the finest symmetric solution: the energy norm of the difference, over time. Its own error e² is
what the successive differences of its last three levels, d = |u_4h - u_2h| and b = |u_2h - u_h|,
leave when they go on falling by q = b/d, with the cosine c between them (1: Richardson's
extrapolation, 0: differences of projections, perpendicular):

    e² = b² q²/(1 - q²) (1 + 2 c q/(1 - q))

Slopes are those of error² + e² over h, by least squares: u is no nearer to the exact solution than
e.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from demos.parts.problems import square
from demos.parts.problems.boundary_elements import BOTTOM, TOP, pressed
from vi_contact.bem.boundary_mesh import polygon
from vi_contact.bem.contact import BoundaryContact
from vi_contact.bem.contact_run import march_contact
from vi_contact.bem.energetic import EnergeticBlocks, energetic_blocks, march_blocks
from vi_contact.bem.poincare_steklov import BoundaryProblem, CondensedCompliance, PoincareSteklov
from vi_contact.core.algebra import Array
from vi_contact.core.protocols import FrictionLaw, Frictionless
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.materials import LinearElastic

FORMS = {"symmetric": True, "unsymmetric": False}
SETTLED = 0.3  # slopes between neighbouring levels that differ by more have not settled
# elements of a side up to which both forms are solved by a march; beyond, the symmetric one on a
# circle
MARCHED = 40
Row = dict[str, Any]


@dataclass(frozen=True)
class Example:
    """Describe a pressed square.

    It has c_P dt = ``ratio`` h and ``count`` time steps per element of a side.

    pressure: (t) [Pa]; supports: of the base, by name: components that are held, or the friction of
    a contact.
    """

    material: LinearElastic
    pressure: Callable[[float], float]
    ratio: float
    count: int
    supports: dict[str, tuple[int, ...] | FrictionLaw]

    def operator(self, k: int, *, compressed: bool = False) -> PoincareSteklov:
        """Assemble the symmetric operator of the square with k elements per side."""
        dt = self.ratio / (k * self.material.c_p)
        mesh = polygon([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)], 1.0 / k)
        blocks = energetic_blocks(
            mesh, self.material, dt=dt, steps=self.count * k, compressed=compressed
        )
        return PoincareSteklov(blocks, self.material.rho)

    def problem(self, operator: PoincareSteklov) -> BoundaryProblem:
        """Press the square, its base in contact."""
        return pressed(
            operator, pressure=self.pressure, top=TOP, contact=operator.mesh.labels == BOTTOM
        )

    def only(self, *supports: str) -> "Example":
        """Return the example with these supports alone."""
        return replace(self, supports={name: self.supports[name] for name in supports})


HELD: dict[str, tuple[int, ...] | FrictionLaw] = {"rollers": (1,), "clamped": (0, 1)}
_BOX = square.concrete()
EXAMPLES = {
    "square": Example(
        LinearElastic.from_wave_speeds(1.0, 0.5, 1.0),
        lambda t: 1.0,
        1.0,
        4,
        HELD | {"no friction": Frictionless(), "Tresca 0.05": Tresca(0.05)},
    ),
    "concrete on steel": Example(
        _BOX.material,
        lambda t: _BOX.pressure * math.tanh((t / 0.015) ** 2),
        4.0,
        8,
        HELD | {"Coulomb 0.3": Coulomb(0.3)},
    ),
}


@dataclass
class Solutions:
    """Collect displacements (steps, 2n) [m], energies (steps,) [J/m] and worst certificates.

    They are sorted by support, form and k.
    """

    displacement: dict[tuple[str, str, int], Array] = field(default_factory=dict)
    energy: dict[tuple[str, str, int], Array] = field(default_factory=dict)
    worst: float = 0.0

    def add(
        self, example: Example, operator: PoincareSteklov, forms: Sequence[str] = tuple(FORMS)
    ) -> None:
        """Solve all supports with these forms of an operator."""
        made = example.problem(operator)
        k = len(operator.mesh) // 4
        for form in forms:
            problem = replace(made, operator=replace(operator, symmetric=FORMS[form]))
            condensed: CondensedCompliance | None = None
            for name, support in example.supports.items():
                if isinstance(support, tuple):
                    motion = held(problem, support).solve()
                else:
                    condensed = condensed or problem.condensed()
                    run = march_contact(BoundaryContact(condensed, friction=support))
                    motion = problem.solve(run.forces)
                    self.worst = max(self.worst, run.worst)
                self.displacement[name, form, k] = motion.displacement
                self.energy[name, form, k] = motion.work


def held(problem: BoundaryProblem, components: tuple[int, ...]) -> BoundaryProblem:
    """Return the problem with these components of its base supported, without contact."""
    mesh = problem.operator.mesh
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[list(components)] = mesh.nodes_of(mesh.labels == BOTTOM)
    return BoundaryProblem(problem.operator, problem.forces, fixed)


def prolonged(u: Array, k: int, fine: int) -> Array:
    """Return displacements (steps, 2, 4k) in the space of ``fine``.

    They are those of k elements per side, of which ``fine`` is a multiple, with as many times the
    steps. They are linear between nodes and between times, zero at t = 0.
    """
    m = fine // k
    steps = len(u)
    place = np.arange(4 * fine) / m
    time = np.arange(1, m * steps + 1) / m
    node = place.astype(int)
    share = place % 1.0
    along = (1.0 - share) * u[:, :, node] + share * u[:, :, (node + 1) % (4 * k)]
    along = np.concatenate([np.zeros_like(along[:1]), along])
    before = np.minimum(time.astype(int), steps - 1)
    part = (time - before)[:, None, None]
    return np.asarray((1.0 - part) * along[before] + part * along[before + 1])


class Norm(Protocol):
    """Measure sums of given motions."""

    def square(self, weights: Array) -> float:
        """Return |sum_i weights_i u_i|²."""


class EnergyNorm:
    """Give products <S v, w>of motions of the finest space.

    They are summed over all times up to each and then over these.
    """

    def __init__(self, operator: PoincareSteklov, motions: Sequence[Array]) -> None:
        u = np.stack([motion.reshape(len(motion), -1) for motion in motions], axis=2)
        fixed = np.ones(u.shape[1], bool)
        assert isinstance(operator.blocks, EnergeticBlocks)  # one march for all motions
        forces = operator.rho * march_blocks(operator.blocks, fixed, np.zeros_like(u), u)[2]
        work = np.matmul(forces.swapaxes(1, 2), np.diff(u, axis=0, prepend=0.0))
        self._products = np.cumsum(work, axis=0).sum(axis=0)

    def square(self, weights: Array) -> float:
        """Return |sum_i weights_i u_i|², summed over all times."""
        return float(weights @ self._products @ weights)


def measure(name: str, levels: Sequence[int], *supports: str) -> list[Row]:
    """Return a row for each support (all by default), form and level of an example.

    The last level is the reference.

    ``levels``: numbers of elements per side, at least three, all divisors of the last, which is
    twice and four times two of them. With more than MARCHED elements the last level is solved in
    the symmetric form alone.
    """
    example = EXAMPLES[name].only(*(supports or EXAMPLES[name].supports))
    fine = levels[-1]
    found = Solutions()
    large = fine > MARCHED
    for k in levels[:-1]:
        found.add(example, example.operator(k))
    if large:
        found.add(example, example.operator(fine, compressed=True), ["symmetric"])
    operator = example.operator(fine)
    if not large:
        found.add(example, operator)
    rows = []
    for support in example.supports:
        places = [key for key in found.displacement if key[0] == support]
        norm = EnergyNorm(
            operator, [prolonged(found.displacement[key], key[2], fine) for key in places]
        )
        squares = Differences(norm, [key[1:] for key in places])
        e2, cosine = squares.reference_error(fine)
        for form in FORMS:
            best = found.energy[support, "symmetric", fine]
            solved = [
                k
                for k in levels
                if (support, form, k) in found.energy and (form, k) != ("symmetric", fine)
            ]
            errors = {k: squares.between((form, k), ("symmetric", fine)) for k in solved}
            below = levels[:-1]
            slopes = _slopes(below, [errors[k] + e2 for k in below])
            for k in solved:
                off = (
                    np.abs(found.energy[support, form, k] - best[fine // k - 1 :: fine // k]).max()
                    / best.max()
                )
                rows.append(
                    {
                        "case": f"{name}, {support}",
                        "form": form,
                        "k": k,
                        "finest": fine,
                        "error_squared": errors[k],
                        "energy_difference": float(off),
                        "reference_error": e2,
                        "cosine": cosine,
                        "certificate": found.worst,
                        **slopes,
                    }
                )
    return rows


class Differences:
    """Give squared energy norms of differences of solutions.

    They are over that of the finest symmetric one.
    """

    def __init__(self, norm: Norm, keys: list[tuple[str, int]]) -> None:
        self._norm, self._keys = norm, keys
        finest = ("symmetric", max(k for _, k in keys))
        self._unit = norm.square(self._weights(finest))

    def _weights(self, plus: tuple[str, int], minus: tuple[str, int] | None = None) -> Array:
        weights = np.zeros(len(self._keys))
        weights[self._keys.index(plus)] += 1.0
        if minus is not None:
            weights[self._keys.index(minus)] -= 1.0
        return weights

    def between(self, one: tuple[str, int], two: tuple[str, int]) -> float:
        """Return the squared norm of the difference of two solutions."""
        return self._norm.square(self._weights(one, two)) / self._unit

    def reference_error(self, fine: int) -> tuple[float, float]:
        """Return e² of the finest symmetric solution.

        With it comes the cosine between its last two successive differences.
        """
        last, middle, first = (("symmetric", fine // m) for m in (1, 2, 4))
        d2, b2 = self.between(first, middle), self.between(middle, last)
        cosine = 0.5 * (self.between(first, last) - d2 - b2) / math.sqrt(d2 * b2)
        q = math.sqrt(b2 / d2)
        return b2 * q**2 / (1.0 - q**2) * (1.0 + 2.0 * max(cosine, 0.0) * q / (1.0 - q)), cosine


def _slopes(levels: Sequence[int], errors: Sequence[float]) -> Row:
    """Return the slope of error² over h on logarithmic axes, and whether it has settled."""
    x = -np.log(levels)
    y = np.log(errors)
    local = [float((b[1] - a[1]) / (b[0] - a[0])) for a, b in pairwise(zip(x, y, strict=True))]
    slope = float(np.polyfit(x, y, 1)[0])
    return {"slope": slope, "local_slopes": local, "settled": max(local) - min(local) < SETTLED}
