#!/usr/bin/env python3
"""Warm a wall between rigid walls, warm a bar at once, and tear a body apart.

They are compared with closed forms.

    sigma = C (eps(u) - eps_0)
    eps_0 = alpha (T - T_0) I  or  b⊗n / h in a layer of cells of height h

A wall below a rigid ceiling is warmed slowly: the gap g closes at (1 + nu) alpha dT H = g, and from
there on the pressure is E / (1 - nu²) ((1 + nu) alpha dT - g / H). A bar that is warmed at once
sends the stress E alpha dT along itself as waves, whose arrivals are known. A jump b across a layer
strains a held bar by b / L.

    bash demos/run.sh warming                 # a table and a figure, into results/warming
    bash demos/run.sh -n 2 warming            # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.warming import plot_warming
from vi_contact import core, fem, meshes
from vi_contact.cli import status_of
from vi_contact.core.surfaces import empty_surface
from vi_contact.solvers.volume.route import Volume

# Parameters
# --------------------------------------------------------------------------------------------------
CONCRETE = vc.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
BAR = vc.LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
ALPHA, WARMER = 1.0e-5, 30.0  # [1/K], [K]
HEIGHT, GAP = 3.0, 6.0e-4  # of the wall, and above it [m]
LENGTH = 2.0  # of the bar [m]
CELLS = 200  # of the bar
JUMP = 2.0e-4  # of the dislocation [m]
OUT = Path("results/warming")


def slowly(comm: MPI.Comm) -> list[tuple[float, float, float, float]]:
    """Return (warming [K], pressure [Pa] by three ways).

    They are the condensed route, the whole body, and the closed form.
    """
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=(1.0, HEIGHT), divisions=(4, 12)), comm)
    sides = [
        fem.Prescribed(tags["bottom"], components=(1,)),
        fem.Prescribed(tags["left"], components=(0,)),
    ]
    heat = fem.InitialStrain(ALPHA, history=lambda t: t)  # t counts the kelvins
    system = fem.assemble(mesh, CONCRETE, prescribed=sides, loads=heat)
    ceiling = core.HalfSpace(point=(0.0, HEIGHT + GAP), normal=(0.0, -1.0))
    problem = core.ContactProblem(
        system, fem.contact_surface(system, tags["top"], obstacle=ceiling)
    )
    warmings = [0.25 * WARMER * k for k in range(1, 5)]
    found = []
    for solver in (vc.Condensed(), Volume()):
        states = vc.quasi_static(problem, warmings, solver=solver)
        found.append(
            [
                float(problem.surface.everywhere(one.r_n / problem.surface.weights).mean())
                for one in states
            ]
        )
    return list(zip(warmings, *found, map(pressure, warmings), strict=True))


def pressure(dT: float) -> float:
    """Return the pressure of the warmed wall on the ceiling, in closed form [Pa]."""
    E, nu = CONCRETE.E, CONCRETE.nu
    return max(0.0, E / (1.0 - nu**2) * ((1.0 + nu) * ALPHA * dT - GAP / HEIGHT))


def at_once(
    comm: MPI.Comm, cells: int
) -> tuple[dict[str, tuple[float, float]], tuple[Any, Any, Any]]:
    """Return (computed, exact) of a bar, and its histories.

    Its right end has the gap alpha dT L to a wall. The histories are t over the crossing T = L/c,
    pushes of the support and of the wall over their exact size.
    """
    strain = ALPHA * WARMER
    speed = float(np.sqrt(BAR.E / BAR.rho))
    crossing = LENGTH / speed
    push = BAR.E * ALPHA * WARMER
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=(LENGTH,), divisions=(cells,)), comm)
    system = fem.assemble(mesh, BAR, clamped=tags["left"], loads=fem.InitialStrain(strain))
    wall = core.HalfSpace(point=(LENGTH * (1.0 + strain),), normal=(-1.0,))
    problem = core.ContactProblem(system, fem.contact_surface(system, tags["right"], obstacle=wall))
    record = (vc.Energy(), vc.Contact(), fem.Reactions("support", tags["left"], (0.0,)))
    h = vc.simulate(
        problem,
        scheme=vc.Midpoint(),
        solver=vc.Condensed(),
        dt=0.5 * crossing / cells,
        t_end=2.9 * crossing,
        record=record,
        progress=False,
    ).history
    t = h["t"] / crossing
    contact = -h["contact_force_x"]
    support = h["reaction_x_support"]

    def mean(values: np.ndarray, begin: float) -> float:
        return float(np.mean(values[(t > begin + 0.2) & (t < begin + 0.8)]))

    impulse = float(np.sum(0.5 * (contact[1:] + contact[:-1]) * np.diff(h["t"])))
    numbers = {
        "push of the support before T [N]": (mean(support, 0.0), push),
        "and from T to 2T [N]": (mean(support, 1.0), -push),
        "push on the wall from T to 2T [N]": (mean(contact, 1.0), push),
        "its impulse [N s]": (impulse, push * crossing),
        "strain energy at the start [J]": (
            float(h["energy_strain"][0]),
            0.5 * BAR.E * strain**2 * LENGTH,
        ),
    }
    return numbers, (t, support / push, contact / push)


def torn(comm: MPI.Comm) -> dict[str, tuple[float, float]]:
    """Return (computed, exact) of a bar with a jump in the layer of cells behind its middle.

    It is free, and held.
    """
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=(LENGTH,), divisions=(8,)), comm)
    h = LENGTH / 8.0
    half = 0.5 * LENGTH
    layer = fem.Cells.where(
        "layer", mesh, lambda x: (x[0] > half - 0.1 * h) & (x[0] < half + 1.1 * h)
    )
    slip = fem.InitialStrain(JUMP / h, cells=layer)
    ends = {"free": [], "held": [tags["right"]]}
    found = {}
    for name, more in ends.items():
        system = fem.assemble(mesh, BAR, clamped=[tags["left"], *more], loads=slip)
        problem = core.ContactProblem(system, empty_surface(system.space.comm, 1))
        state = vc.static_equilibrium(problem, solver=vc.Condensed())
        stress = fem.as_function(problem, state, "stress").x.array
        found[f"stress of the bar, {name} [Pa]"] = (
            comm.allreduce(float(np.min(stress, initial=np.inf)), op=MPI.MIN),
            -BAR.E * JUMP / LENGTH if more else 0.0,
        )
        u = system.space.sample(state.u, system.space.find_nodes(np.array([[LENGTH]])), 0.0)
        found[f"its right end, {name} [m]"] = float(u[0, 0]), 0.0 if more else JUMP
    return found


def main(quick: bool = False, out: Path = OUT) -> dict[str, tuple[float, float]]:
    """Print and draw all comparisons (``quick``: a bar of 50 cells).

    They are returned as name -> (computed, exact).
    """
    comm = MPI.COMM_WORLD
    pressures = slowly(comm)
    numbers = {f"pressure at {dT:g} K [Pa]": (one, exact) for dT, one, _, exact in pressures}
    numbers |= {
        f"pressure at {dT:g} K, whole body [Pa]": (other, exact)
        for dT, _, other, exact in pressures
    }
    waves, histories = at_once(comm, 50 if quick else CELLS)
    numbers |= waves | torn(comm)
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        plot_warming(
            [(dT, one) for dT, one, _, _ in pressures], pressure, histories, out / "warming.png"
        )
        print(f"{'':<36} {'computed':>16} {'closed form':>16}")
        for name, (computed, exact) in numbers.items():
            print(f"{name:<36} {computed:>16.8g} {exact:>16.8g}")
        print(f"\nThe figure is in {out}.")
    return numbers


# Things to try: InitialStrain(lambda x, t: ALPHA * WARMER * x[:, 1] / HEIGHT) bends the wall;
# degree=2 follows it.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
