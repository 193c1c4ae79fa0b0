#!/usr/bin/env python3
"""Couple contact with what this package does not compute: heat, damage, another program.

Three short programs, each beside an answer that is known.

Heat: a bar is hot at its clamped end. It grows, closes a gap, and gives heat to a cold wall, by a
conductance that grows with the pressure: h = h0 p. Heat and contact follow each other in turn, a
step behind. Steady, with q the heat flux, they satisfy

    q = T0 / (L/k + 1/(h0 p)),    p = E (alpha (T0 - q L / (2 k)) - g / L)

Damage: a mass on a spring strikes a wall. Beyond the force F0 the spring is damaged, so that its
force stays F0, and unloads towards the origin. A callback finds the damage after every step. Work
and energy give the largest shortening x and the speed w of the rebound:

    ½ F0²/k + F0 (x - F0/k) = ½ m v²,    ½ m w² = ½ F0 x

Another program: the right half of a bar that strikes a wall runs in a process of its own and is
spoken to through pipes. In each step both halves try the step with a force between them, until
their ends move alike; then both accept it. The whole bar in one program does the same.

    bash demos/run.sh couplings                 # a table and a figure, into results/couplings
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.couplings import plot_couplings
from vi_contact import core, fem, meshes
from vi_contact.core.algebra import Array
from vi_contact.core.surfaces import empty_surface
from vi_contact.core.system import Load
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
E = 7.0e10  # of an aluminium bar [Pa]
ALPHA = 2.4e-5  # [1/K]
CONDUCTIVITY = 200.0  # k [W/(m K)]
CAPACITY = 2.4e6  # [J/(m³ K)]
LENGTH = 0.2  # L [m]
GAP = 1.0e-4  # g [m]
HOT = 60.0  # T0 above the wall, which has the temperature of the assembly [K]
PER_PRESSURE = 1.0e-4  # h0 [W/(m² K Pa)]
CELLS = 20

MASS, STIFFNESS, SPEED = 2.0, 1.0e6, 3.0  # m [kg], k [N/m], v [m/s]
YIELD_FORCE = 2.0e3  # F0 [N]
NOSE = 1.0e-4  # mass of the end that touches the wall, over m

NODES = 21  # of half a bar
BAR_STEPS = 400
OUT = Path("results/couplings")

Curve = tuple[list[float], list[float]]


# Heat and contact
# --------------------------------------------------------------------------------------------------
class HeatedBar:
    """Hold the temperatures (nodes,) [K] of a bar by linear elements, with heat in every node."""

    def __init__(self, cells: int) -> None:
        h = LENGTH / cells
        self.x = np.linspace(0.0, LENGTH, cells + 1)
        self.T = np.zeros(cells + 1)
        self._capacity = np.full(cells + 1, CAPACITY * h)
        self._capacity[[0, -1]] *= 0.5
        ends = np.ones(cells + 1)
        ends[1:-1] = 2.0
        side = np.full(cells, -1.0)
        self._conduction = CONDUCTIVITY / h * sp.diags([side, ends, side], [-1, 0, 1]).toarray()

    def step(self, dt: float, conductance: float) -> float:
        """Make an implicit step; return the heat flux into the wall [W/m²].

        Args:
            dt: length of the step [s].
            conductance: between the right end and the wall [W/(m² K)].
        """
        A = np.diag(self._capacity / dt) + self._conduction
        A[-1, -1] += conductance
        b = self._capacity / dt * self.T
        A[0] = 0.0  # the left end is hot
        A[0, 0] = 1.0
        b[0] = HOT
        self.T = np.linalg.solve(A, b)
        return float(conductance * self.T[-1])


def steady_pressure() -> float:
    """Return the pressure of the steady bar on the wall, in closed form [Pa].

    With b = h0 L / k the two conditions are p = A - B b p / (1 + b p), a quadratic of p.
    """
    b = PER_PRESSURE * LENGTH / CONDUCTIVITY
    A = E * (ALPHA * HOT - GAP / LENGTH)
    B = 0.5 * E * ALPHA * HOT
    # b p² + (1 + B b - A b) p - A = 0
    middle = 1.0 + (B - A) * b
    return float((-middle + np.sqrt(middle**2 + 4.0 * b * A)) / (2.0 * b))


def heat(steps: int = 60, dt: float = 50.0) -> tuple[dict[str, tuple[float, float]], Curve]:
    """Return (computed, exact) of the bar when nothing changes any more, and its pressures [Pa]."""
    heated = HeatedBar(CELLS)
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(LENGTH,), divisions=(CELLS,)), MPI.COMM_WORLD
    )
    warming = fem.InitialStrain(lambda x, t: ALPHA * np.interp(x[:, 0], heated.x, heated.T))
    material = vc.LinearElastic(E=E, nu=0.0, rho=2700.0)
    system = fem.assemble(mesh, material, clamped=tags["left"], loads=warming)
    wall = core.HalfSpace(point=(LENGTH + GAP,), normal=(-1.0,))
    surface = fem.contact_surface(system, tags["right"], obstacle=wall)
    problem = core.ContactProblem(system, surface)
    pressure = flux = 0.0
    times, pressures = [0.0], [0.0]
    for k in range(1, steps + 1):
        # heat first, with the pressure of the step before; then the body with the new temperatures
        flux = heated.step(dt, PER_PRESSURE * pressure)
        state = vc.static_equilibrium(problem, t=k * dt)
        pressure = float(np.max(surface.everywhere(state.r_n / surface.weights)))
        times.append(state.t)
        pressures.append(pressure)
    p = steady_pressure()
    q = HOT / (LENGTH / CONDUCTIVITY + 1.0 / (PER_PRESSURE * p))
    numbers = {"heat: pressure [Pa]": (pressure, p), "heat: flux [W/m²]": (flux, q)}
    return numbers, (times, pressures)


# Damage by callback
# --------------------------------------------------------------------------------------------------
class DamagedSpring:
    """Join nose and mass by a spring with the stiffness (1 - d) k."""

    def __init__(self) -> None:
        self.d = 0.0
        self.path: Curve = ([0.0], [0.0])  # shortenings [m] and forces [N]
        self._K = STIFFNESS * np.array([[1.0, -1.0], [-1.0, 1.0]])

    def force(self, u: Array) -> Array:
        """Return p(u) (2,) [N]."""
        return np.asarray((1.0 - self.d) * self._K @ u)

    def energy(self, u: Array) -> float:
        """Return the energy [J]."""
        return float(0.5 * u @ self.force(u))

    def tangent(self, u: Array) -> Array:
        """Return the stiffness (2, 2) [N/m]."""
        return np.asarray((1.0 - self.d) * self._K)

    def grow(self, state: core.State, report: core.Report) -> None:
        """Find the damage of the step that has been made; the next one feels it."""
        u = report.problem.cartesian(state.u)  # states are in the frames of contact points
        shortening = u[0] - u[1]
        self.path[0].append(float(shortening))
        self.path[1].append(float(self.force(u)[0]))
        if shortening > 0.0:
            self.d = max(self.d, 1.0 - YIELD_FORCE / STIFFNESS / shortening)


def damage(dt: float = 4.0e-6) -> tuple[dict[str, tuple[float, float]], Curve]:
    """Return (computed, exact) of a mass that rebounds from a wall, and the path of its spring."""
    spring = DamagedSpring()
    system = vc.system_from_arrays(
        np.array([NOSE * MASS, MASS]),
        None,
        STIFFNESS * np.array([[1.0, -1.0], [-1.0, 1.0]]),
        coordinates=[[0.0], [1.0]],
        v0=np.full(2, -SPEED),
        internal=spring,
    )
    wall = vc.contact_points(system, [0], [-1.0], gap0=0.0)
    problem = vc.ContactProblem(system, wall, mass=vc.ConsistentMass())
    solution = vc.simulate(
        problem, dt=dt, t_end=1.5e-2, callback=spring.grow, scheme=vc.MoreauJean(), progress=False
    )
    x = (0.5 * MASS * SPEED**2 + 0.5 * YIELD_FORCE**2 / STIFFNESS) / YIELD_FORCE
    largest = YIELD_FORCE / STIFFNESS / (1.0 - spring.d)
    rebound = float(np.sqrt(YIELD_FORCE * x / MASS))
    numbers = {
        "damage: shortening [m]": (largest, x),
        "damage: rebound [m/s]": (float(solution.state.v[1]), rebound),
    }
    return numbers, spring.path


# Two programs and their pipes
# --------------------------------------------------------------------------------------------------
class HalfBar:
    """Hold a half of a bar of unit masses and springs, which flies at a wall."""

    def __init__(self, *, right: bool) -> None:
        self.push = 0.0  # force at its inner end, from the other half [N]
        self._inner = 0 if right else NODES - 1
        masses = np.ones(NODES)
        masses[self._inner] = 0.5  # the other half has the other half
        load = Load(np.zeros(NODES), general=(self._make_load,))
        system = vc.system_from_arrays(
            masses,
            None,
            make_chain(NODES),
            coordinates=np.arange(float(NODES))[:, None],
            load=load,
            v0=np.full(NODES, 0.1),
        )
        surface = empty_surface(system.space.comm, 1)
        if right:
            surface = vc.contact_points(system, [NODES - 1], [1.0], gap0=0.05)
        problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
        self.stepper = vc.Stepper(problem, scheme=vc.Midpoint())

    def _make_load(self, t: float) -> Array:
        """Return the loads (nodes,) [N]."""
        load = np.zeros(NODES)
        load[self._inner] = self.push
        return load

    def attempt(self, dt: float, push: float) -> float:
        """Try a step with a force at the inner end; return where this end comes to [m]."""
        self.push = push
        problem = self.stepper.method.problem
        for system in (problem.system, problem.equations):  # which remember loads by their time
            system.forget_loads()
        self.trial = self.stepper.attempt(dt)
        return float(self.trial.state.u[self._inner])

    def accept(self) -> list[float]:
        """Go on from the last attempt; return all displacements [m]."""
        return list(map(float, self.stepper.accept(self.trial).u))


def make_chain(nodes: int) -> sp.csr_matrix:
    """Return the stiffness of springs of 1 N/m in a row, free at both ends."""
    ends = np.ones(nodes)
    ends[1:-1] = 2.0
    side = np.full(nodes - 1, -1.0)
    return sp.csr_matrix(sp.diags([side, ends, side], [-1, 0, 1]))


def serve() -> None:
    """Be the other program: read "attempt dt push" or "accept" from a pipe, answer in JSON."""
    half = HalfBar(right=True)
    for line in sys.stdin:
        word, *numbers = line.split()
        answer: Any = half.accept() if word == "accept" else half.attempt(*map(float, numbers))
        print(json.dumps(answer), flush=True)


def partitioned(steps: int = BAR_STEPS, dt: float = 0.1) -> dict[str, tuple[float, float]]:
    """Return (computed, exact): the two halves beside the whole bar."""
    left = HalfBar(right=False)
    command = [sys.executable, __file__, "--serve"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdin is not None and other.stdout is not None

        def ask(*words: Any) -> Any:
            print(*words, file=other.stdin, flush=True)
            return json.loads(other.stdout.readline())

        push, attempts = 0.0, 0
        for _ in range(steps):
            push, count = match(
                lambda f: left.attempt(dt, -f) - ask("attempt", repr(dt), repr(f)), push
            )
            attempts += count
            u = [*left.accept(), *ask("accept")[1:]]
        other.stdin.close()

    whole = vc.system_from_arrays(
        np.ones(2 * NODES - 1),
        None,
        make_chain(2 * NODES - 1),
        coordinates=np.arange(2.0 * NODES - 1.0)[:, None],
        v0=np.full(2 * NODES - 1, 0.1),
    )
    surface = vc.contact_points(whole, [2 * NODES - 2], [1.0], gap0=0.05)
    problem = vc.ContactProblem(whole, surface, mass=vc.ConsistentMass())
    state = vc.simulate(problem, scheme=vc.Midpoint(), dt=dt, steps=steps, progress=False).state
    largest = float(np.abs(np.array(u) - state.u).max() / np.abs(state.u).max())
    return {
        "pipe: difference from the whole bar [-]": (largest, 0.0),
        "pipe: free end [m]": (u[0], float(state.u[0])),
        "pipe: attempts a step [-]": (attempts / steps, attempts / steps),
    }


def match(miss: Callable[[float], float], guess: float) -> tuple[float, int]:
    """Return the force for which two ends meet, and how often it was tried: the secant method.

    ``miss`` falls with the force, in straight pieces, so that two attempts and a third that
    confirms are enough unless a contact changes.
    """
    forces, misses = [guess, guess + 1e-2], [miss(guess), miss(guess + 1e-2)]
    size = max(map(abs, misses))
    while abs(misses[-1]) > 1e-13 * max(size, 1e-2) and len(forces) < 20:
        slope = (misses[-1] - misses[-2]) / (forces[-1] - forces[-2])
        forces.append(forces[-1] - misses[-1] / slope)
        misses.append(miss(forces[-1]))
    return forces[-1], len(forces)


def main(quick: bool = False, out: Path = OUT) -> dict[str, tuple[float, float]]:
    """Print and draw all comparisons; they are returned as name -> (computed, exact)."""
    warm, pressures = heat()
    worn, path = damage(2e-5 if quick else 4e-6)
    numbers = warm | worn
    if MPI.COMM_WORLD.size == 1:
        numbers |= partitioned(100 if quick else BAR_STEPS)
    if MPI.COMM_WORLD.rank == 0:
        print(f"{'':<42} {'computed':>14} {'known':>14}")
        for name, (computed, exact) in numbers.items():
            print(f"{name:<42} {computed:>14.7g} {exact:>14.7g}")
        out.mkdir(parents=True, exist_ok=True)
        known = (YIELD_FORCE / STIFFNESS, YIELD_FORCE, worn["damage: shortening [m]"][1])
        plot_couplings(pressures, steady_pressure(), path, known, out / "couplings.png")
        print(f"\nThe figure is in {out}.")
    return numbers


# Things to try: PER_PRESSURE = 1e-3, where heat and pressure swing about their steady values and a
# shorter step is needed.
if __name__ == "__main__":
    if sys.argv[1:] == ["--serve"]:
        serve()
    else:
        raise SystemExit(status_of(main))
