"""Spheres in contact, computed on caps of them, and how far the answers are from the closed forms:
for tests and for benchmarks/contact_in_space.py. Cells of the first body: a/n under the contact; of
the second a/(0.83 n)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate, islice
from typing import Any

import numpy as np
from caps import Cap, Caps, Contact
from half_space import Lubkin, Mindlin, turned
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import State
from vi_contact.exact.hertz import HertzPoint, contact_radius
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.static import Equilibria, quasi_static
from vi_contact.solvers.condensed import Condensed

STEEL = LinearElastic(E=2.1e11, nu=0.3, rho=7800.0)
ALUMINIUM = LinearElastic(E=7.0e10, nu=0.3, rho=2700.0)
# no contraction: slip is along Q, see half_space.Mindlin
FIBROUS = LinearElastic(E=2.0e11, nu=0.0, rho=7800.0)
RADIUS, SLOPE, MU, COARSER = 0.01, 1e-3, 0.3, 0.83  # of a sphere [m]; a/R
APPROACHES = np.linspace(0.85, 1.15, 13)[1:]  # in a


def bodies(kind: str, n: float) -> list[Cap]:
    """What touches: a sphere on a rigid "plane", two "spheres" of 10 and 20 mm, a sphere on an
    elastic "block"."""
    one, m = Cap(RADIUS, STEEL, n), COARSER * n
    others = {
        "plane": [],
        "spheres": [Cap(2.0 * RADIUS, STEEL, m)],
        "block": [Cap(np.inf, ALUMINIUM, m)],
    }
    return [one, *others[kind]]


def hertz(kind: str, n: float, *, simplices: bool = False) -> dict[str, float]:
    """A quarter pressed together by twelve approaches, so that the edge of contact falls anywhere
    between nodes.

    Relative errors: force, radius (second moment of the forces), peak (mean pressure on r < a/2) in
    the mean over the approaches; scatter: standard deviation of the force's; profile: L2 norm of
    the nodal pressures' error, its mean.
    """
    caps = bodies(kind, n)
    spheres = Caps(
        caps,
        SLOPE * contact_radius(*(cap.radius for cap in caps)),
        simplices=simplices,
        pressed=lambda t: float(APPROACHES[round(t) - 1]) if t else 1.0,
    )
    rows = []
    for state in quasi_static(spheres.problem, range(1, 1 + len(APPROACHES)), solver=Condensed()):
        found, exact = (
            spheres.found(state),
            spheres.exact_at(spheres.a * APPROACHES[round(state.t) - 1]),
        )
        p, a, core = (
            exact.pressure(found.r),
            exact.contact_radius,
            found.r < 0.5 * exact.contact_radius,
        )
        error = found.r_n / found.weights - p
        rows.append(
            (
                found.force / exact.force - 1.0,
                found.radius / a - 1.0,
                found.weights @ (error * core) / (found.weights @ (p * core)),
                found.norm(error) / found.norm(p),
            )
        )
    mean = dict(
        zip(("force", "radius", "peak", "profile"), np.mean(rows, axis=0).tolist(), strict=True)
    )
    return mean | {
        "scatter": float(np.std(rows, axis=0)[0]),
        "unknowns": float(spheres.problem.system.space.unknowns),
    }


# at most; stage 0 of an approach presses the bodies, the others rub them: t = STAGES · approach +
# stage
STAGES = 8
Moved = Callable[[Array, float, int], Array]


@dataclass(frozen=True)
class Rubbed:
    """Two equal spheres pressed and then moved along one another in stages, the far sides by the
    closed form; again and again, with ``approaches`` in a.

    ``moved``: (points, radius of contact [m], stage) -> displacements of the far sides of the first
    body, depth in the place of y; those of the second are the opposite, with its own depth.
    ``turn``: of the second mesh about the normal.
    """

    n: float
    whole: tuple[int, ...]
    material: LinearElastic
    moved: Moved
    turn: float = 0.0
    approaches: Sequence[float] = tuple(APPROACHES[::2])
    comm: Any = field(default_factory=lambda: MPI.COMM_WORLD)

    @cached_property
    def spheres(self) -> Caps:
        """The two caps."""

        def motion(sign: float) -> Callable[[Array, float], Array]:
            def moved(points: Array, t: float) -> Array:
                approach, stage = divmod(round(t), STAGES)
                if stage == 0:
                    return np.zeros(points.shape)
                return sign * self.moved(points, self.spheres.a * self.approaches[approach], stage)

            return moved

        caps = [
            Cap(RADIUS, self.material, self.n),
            Cap(RADIUS, self.material, COARSER * self.n, self.turn),
        ]
        return Caps(
            caps,
            0.5 * SLOPE * RADIUS,
            self.whole,
            [motion(1.0), motion(-1.0)],
            pressed=lambda t: self.approaches[round(t) // STAGES],
            comm=self.comm,
        )

    @cached_property
    def _pressed(self) -> list[State]:
        """After every approach, without friction."""
        smooth, start = (
            Equilibria(self.spheres.problem, solver=Condensed()),
            initial_state(self.spheres.problem),
        )
        return [smooth.solve(start, float(STAGES * i)) for i in range(len(self.approaches))]

    def stages(self, stages: Sequence[int], mu: float = MU) -> list[list[Contact]]:
        """What these stages leave, of every approach; each begins where the one before has left the
        bodies."""
        rough = Equilibria(replace(self.spheres.problem, friction=Coulomb(mu)), solver=Condensed())
        found = []
        for i, state in enumerate(self._pressed):
            states = accumulate(
                stages, lambda old, j, i=i: rough.solve(old, float(STAGES * i + j)), initial=state
            )
            found.append([self.spheres.found(one) for one in islice(states, 1, None)])
        return found

    def forms(self) -> list[HertzPoint]:
        """The contact of each approach in closed form."""
        return [self.spheres.exact_at(self.spheres.a * one) for one in self.approaches]


def averaged(rows: Sequence[Sequence[dict[str, float]]]) -> list[dict[str, float]]:
    """Of each stage the means over the approaches."""
    return [
        {key: float(np.mean([one[key] for one in stage])) for key in stage[0]}
        for stage in zip(*rows, strict=True)
    ]


# Q/(mu P): where it turned, half the way back
PATH = ((0.25, 0.0), (0.5, 0.0), (0.75, 0.0), (0.9, 0.0), (0.9, 0.5))


@dataclass(frozen=True)
class PartialSlip:
    """Cattaneo and Mindlin: half of two spheres, Q along x. Taken back from Q* to Q: q = q(Q*) - 2
    q((Q* - Q)/2), the stick radius is that of (Q* - Q)/2 (Mindlin and Deresiewicz 1953)."""

    n: float
    comm: Any = field(default_factory=lambda: MPI.COMM_WORLD)

    @cached_property
    def rubbed(self) -> Rubbed:
        """The problem."""

        def moved(points: Array, a: float, stage: int) -> Array:
            (there, back), exact = PATH[stage - 1], self.exact(a)

            def one(share: float) -> Array:
                return np.array([exact.shift(share), 0.0, 0.0]) - exact.field(points, share)

            return one(there) - (2.0 * one(back) if back else 0.0)

        return Rubbed(self.n, (0,), FIBROUS, moved, comm=self.comm)

    def exact(self, a: float) -> Mindlin:
        """The closed form of this radius of contact [m]."""
        force, nu = self.rubbed.spheres.exact_at(a).force, FIBROUS.nu
        return Mindlin(force, a, MU, 0.5 * FIBROUS.E / (1.0 + nu), nu)

    def compared(self) -> list[dict[str, float]]:
        """Of each stage: relative errors of P, of Q over the greatest, L2 error of q; c and its
        error over a."""
        found = self.rubbed.stages(range(1, 1 + len(PATH)))
        return averaged(
            [
                [
                    self._compared(self.exact(form.contact_radius), *path, one)
                    for path, one in zip(PATH, contacts, strict=True)
                ]
                for form, contacts in zip(self.rubbed.forms(), found, strict=True)
            ]
        )

    @staticmethod
    def _compared(exact: Mindlin, there: float, back: float, found: Contact) -> dict[str, float]:
        r, c, Q = found.r, exact.stick(back or there), there - 2.0 * back
        q = exact.traction(r, there) - (2.0 * exact.traction(r, back) if back else 0.0)
        along = found.shear(np.array([[1.0, 0.0, 0.0]]))
        carried = found.friction[:, 0].sum() / found.share / (MU * exact.force)
        return {
            "Q": Q,
            "force": found.force / exact.force - 1.0,
            "shear": (carried - Q) / there,
            "c": c / exact.a,
            "stick": (found.stick(MU) - c) / exact.a,
            "profile": found.norm(along - q) / found.norm(q),
        }


STICK = (0.9, 0.7, 0.5, 0.3)  # c/a


@dataclass(frozen=True)
class Torsion:
    """Lubkin: two whole spheres twisted about their normal; the mesh of the second is turned. After
    the stages of slip comes the twist of the first one without any."""

    n: float
    approaches: Sequence[float] = tuple(APPROACHES[::2])
    comm: Any = field(default_factory=lambda: MPI.COMM_WORLD)

    @cached_property
    def rubbed(self) -> Rubbed:
        """The problem."""

        def moved(points: Array, a: float, stage: int) -> Array:
            exact, c = self.exact(a), a * (STICK + STICK[:1])[stage - 1]
            stuck = (
                exact.stuck_field(points, exact.twist(c))
                if stage > len(STICK)
                else exact.field(points, c)
            )
            return turned(points, exact.twist(c)) - stuck

        return Rubbed(self.n, (0, 2), STEEL, moved, 0.4, self.approaches, self.comm)

    def exact(self, a: float) -> Lubkin:
        """The closed form of this radius of contact [m]."""
        return Lubkin(
            self.rubbed.spheres.exact_at(a).force, a, MU, 0.5 * STEEL.E / (1.0 + STEEL.nu)
        )

    def compared(self) -> list[dict[str, float]]:
        """Of each stage: relative errors of P and T, L2 error of τ; c and its error over a."""
        found = self.rubbed.stages(range(1, 1 + len(STICK)))
        return averaged(
            [
                [
                    self._compared(self.exact(form.contact_radius), share, one)
                    for share, one in zip(STICK, contacts, strict=True)
                ]
                for form, contacts in zip(self.rubbed.forms(), found, strict=True)
            ]
        )

    @staticmethod
    def _compared(exact: Lubkin, share: float, found: Contact) -> dict[str, float]:
        c, r = share * exact.a, np.maximum(found.r, 1e-9 * exact.a)
        tau, along = exact.traction(r, c), found.shear(turned(found.points, 1.0) / r[:, None])
        return {
            "T": exact.moment(c) / exact.sliding,
            "force": found.force / exact.force - 1.0,
            "moment": moment(found) / exact.moment(c) - 1.0,
            "c": share,
            "stick": found.stick(MU) / exact.a - share,
            "profile": found.norm(along - tau) / found.norm(tau),
        }

    def without_slip(self) -> float:
        """Relative error of T where friction has no bound, in the mean over the approaches."""
        exact = [self.exact(form.contact_radius) for form in self.rubbed.forms()]
        given = [one.no_slip(one.twist(STICK[0] * one.a)) for one in exact]
        found = self.rubbed.stages([1 + len(STICK)], mu=1e3)
        return float(
            np.mean([moment(one) / T - 1.0 for (one,), T in zip(found, given, strict=True)])
        )


def moment(found: Contact) -> float:
    """T [N m] of the friction about the normal."""
    x, f = found.points, found.friction
    return float(x[:, 2] @ f[:, 0] - x[:, 0] @ f[:, 2])
