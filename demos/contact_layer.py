#!/usr/bin/env python3
"""Replace the exact inequality by a boundary layer.

It is done for a stiff block, an elastic bar and the shaken wall.

The block is stiff: it rebounds with the restitution that its layer was made for. The bar is thrown
at a rigid wall with 10 m/s, then it falls and bounces under gravity. In thinner and thinner layers
its motion tends to that of the exact inequality, which is known in closed form. The motion of the
shaken wall tends to that of the exact inequality too.

    bash demos/run.sh contact_layer             # into results/contact_layer
    bash demos/run.sh -n 2 contact_layer        # the same on two ranks

All quantities are SI; docs/theory/boundary_layer.md explains them.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.layer import plot_layered_bar, plot_thin_limit
from demos.parts.problems import wall
from demos.parts.problems.bar import Bar, build
from vi_contact.cli import status_of
from vi_contact.exact import BouncingBar, ThrownBar
from vi_contact.layer import BoundaryLayer, Metric, contact_layer

# Parameters
# --------------------------------------------------------------------------------------------------
BARS = (Bar(ThrownBar(), elements=100), Bar(BouncingBar(), elements=100))
T_END = {ThrownBar: 1.4, BouncingBar: 16.0 / 3.0}  # one impact, one period [s]
WIDTHS = (1.0, 0.5, 0.25, 0.1)  # b [m] of the bar's layers
BLOCK = Bar(ThrownBar(length=0.3, E=1e9, rho=1.0, height=0.02, speed=10.0), elements=3, dimension=2)
WANTED = (1.0, 0.8, 0.5, 0.2)  # restitutions of the block
METRICS = (Metric.BLENDED, Metric.FLAT)
PASSAGE = 20  # time steps per b/V
WALL_WIDTHS = (4e-6, 2e-6, 1e-6, 5e-7)  # b of the wall's layers [m]
WALL_SPEED = 1e-2  # V of the wall's layers [m/s]
WALL_STEPS = 640  # time steps per period of the shaking
WALL_PERIODS = 1.5  # of the shaking
OUT = Path("results/contact_layer")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run block, bar, wall (``quick``: one restitution, two wide layers, one metric, a period).

    It returns the key numbers.
    """
    comm = MPI.COMM_WORLD
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
    if quick:
        numbers = rebounds(WANTED[2:3], METRICS[:1])
        numbers |= thin_limit(Bar(BARS[0].case, elements=40), WIDTHS[:2], METRICS[1:], out)
        numbers |= shaken_wall((8e-6,), 80, 1, out)
    else:
        numbers = rebounds(WANTED, METRICS)
        for bar in BARS:
            numbers |= thin_limit(bar, WIDTHS, METRICS, out)
        numbers |= shaken_wall(WALL_WIDTHS, WALL_STEPS, WALL_PERIODS, out)
    if comm.rank == 0 and progress:
        print(f"\nFigures are in {out}.")
    comm.Barrier()
    return numbers


def rebounds(wanted: tuple[float, ...], metrics: tuple[Metric, ...]) -> dict[str, float]:
    """Return the block's velocity after the impact over the one before."""
    model = build(BLOCK, MPI.COMM_WORLD)
    numbers = {}
    width = 0.01
    problem = model.problem(mass=vc.ConsistentMass())
    case, system = BLOCK.case, model.system
    weight = case.rho * case.length  # mass over contact area
    for metric in metrics:
        for e in wanted:
            law = contact_layer(e, mass=weight, speed=case.speed, width=width, metric=metric)
            dt = width / case.speed / PASSAGE
            for state, _ in vc.march(problem, scheme=BoundaryLayer(law=law), dt=dt, t_end=0.012):
                v = problem.cartesian(state.v)
            momentum = system.algebra.dot(system.influence[:, -1], system.M @ v)
            found = momentum / (weight * model.bar.section * case.speed)
            numbers[f"{metric.name} e {e:g}"] = found
            if MPI.COMM_WORLD.rank == 0:
                print(f"block, metric {metric.name:8s}: wanted e = {e:g}, found {found:.5f}")
    return numbers


def thin_limit(
    bar: Bar, widths: tuple[float, ...], metrics: tuple[Metric, ...], out: Path
) -> dict[str, float]:
    """Compute the bar's foot for every width.

    Beside it stands the exact inequality on the same mesh.
    """
    model = build(bar, MPI.COMM_WORLD)
    numbers = {}
    case = bar.case
    name = type(case).__name__
    t_end = T_END[type(case)]
    speed = (
        case.speed
        if isinstance(case, ThrownBar)
        else float(np.sqrt(2.0 * case.gravity * case.height))
    )
    problem = model.problem(mass=vc.ConsistentMass())
    schemes = {"exact inequality": (vc.Midpoint(), bar.time_step(0.5))}
    for metric in metrics:
        for width in widths:
            mass = np.sqrt(case.E * case.rho) * width / speed
            law = contact_layer(0.5, mass=mass, speed=speed, width=width, metric=metric)
            dt = min(width / speed / PASSAGE, bar.time_step(0.5))
            schemes[f"{metric.name} b {width:g}"] = (BoundaryLayer(law=law), dt)
    fine = np.linspace(0.0, t_end, 2001)
    curve = (fine, case.height + case.displacement(0.0, fine), case.force(fine))
    impulse = float(np.mean(curve[2])) * t_end
    runs = {}
    if MPI.COMM_WORLD.rank == 0:
        print(
            f"\n{name:24s} {'rms error of the foot [m]':>26s} {'energy left':>12s} "
            f"{'impulse / exact':>16s}"
        )
    for label, (scheme, dt) in schemes.items():
        t, y, p, lost = marched(problem, scheme, dt, t_end)
        runs[label] = (t, y, p)
        row = (
            float(np.sqrt(np.mean((y - case.height - case.displacement(0.0, t)) ** 2))),
            1.0 - lost / (0.5 * case.rho * case.length * bar.section * speed**2),
            float(np.sum(p)) * dt / impulse,
        )
        numbers |= {
            f"{name} {label}: {what}": x
            for what, x in zip(("error", "energy", "impulse"), row, strict=True)
        }
        if MPI.COMM_WORLD.rank == 0:
            print(f"{label:24s} {row[0]:26.4f} {row[1]:12.4f} {row[2]:16.4f}")
    if MPI.COMM_WORLD.rank == 0:
        shown = {
            f"layer, b = {width:g} m": runs[f"{metrics[-1].name} b {width:g}"]
            for width in widths[::2]
        }
        plot_layered_bar(shown, curve, out / f"{name}.png")
        errors = {
            f"metric {metric.name}": (
                np.array(widths),
                np.array([numbers[f"{name} {metric.name} b {width:g}: error"] for width in widths]),
            )
            for metric in metrics
        }
        plot_thin_limit(errors, out / f"{name}_limit.png", quantity="rms error of the foot [m]")
    return numbers


def shaken_wall(
    widths: tuple[float, ...], steps: int, periods: float, out: Path
) -> dict[str, float]:
    """Run case b of the wall.

    It tells how far its contact points are from those of the midpoint rule with gap >= 0.
    """
    model = wall.build(wall.Wall(), MPI.COMM_WORLD, base_inertia="catalogue")
    exact = model.problem("b", impact=None, mass=vc.ConsistentMass())
    concrete = model.wall.material
    dt = 1.0 / (model.harmonic().frequency * steps)
    numbers = {}
    errors = []

    def displacements(problem: vc.ContactProblem, scheme) -> np.ndarray:
        found = vc.march(problem, scheme=scheme, dt=dt, steps=round(periods * steps))
        surface = problem.surface
        return np.array([surface.everywhere(surface.normal_values(state.u)) for state, _ in found])

    reference = displacements(exact, vc.Midpoint())
    numbers["wall: largest displacement"] = float(np.max(np.abs(reference)))
    for width in widths:
        mass = np.sqrt(concrete.E * concrete.rho) * width / WALL_SPEED
        law = contact_layer(0.5, mass=mass, speed=WALL_SPEED, width=width, metric=Metric.FLAT)
        scheme = BoundaryLayer(law=law)
        found = displacements(replace(exact, surface=law.set_back(exact.surface)), scheme)
        errors.append(float(np.sqrt(np.mean((found - reference) ** 2))))
        numbers |= {
            f"wall b {width:g}: error": errors[-1],
            f"wall b {width:g}: deepest": float(found.max()),
        }
        if MPI.COMM_WORLD.rank == 0:
            print(
                f"wall, b = {1e6 * width:g} µm: rms distance to the exact inequality "
                f"{1e6 * errors[-1]:.3f} µm, into it {1e6 * found.max():.3f} µm (amplitude "
                f"{1e6 * np.max(np.abs(reference)):.1f} µm)"
            )
    if MPI.COMM_WORLD.rank == 0:
        plot_thin_limit(
            {"wall, case b": (np.array(widths), np.array(errors))},
            out / "wall_limit.png",
            quantity="rms distance of the contact points [m]",
        )
    return numbers


def marched(
    problem: vc.ContactProblem, scheme, dt: float, t_end: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return times, gap of the foot, pressure; the energy lost, the weight's included."""
    system = problem.equations
    surface = problem.surface
    rows = []
    weight = system.load.constant

    def energy(u: np.ndarray, v: np.ndarray) -> float:
        return system.kinetic_energy(v) + system.strain_energy(u) - system.algebra.dot(weight, u)

    for state, _ in vc.march(problem, scheme=scheme, dt=dt, t_end=t_end):
        gap = surface.gap0 - surface.normal_values(state.u)
        sums = surface.comm.sum(np.array([gap.sum(), state.r_n.sum(), surface.weights.sum()]))
        rows.append((state.t, sums[0] / surface.total, sums[1] / sums[2]))
    t, y, p = np.array(rows).T
    return t, y, p, energy(system.u0, system.v0) - energy(state.u, state.v)


# Things to try: a restitution other than ½ in thin_limit (on a bar it changes little: it is that of
# its foot's mass); a mass that does not shrink with the width; PASSAGE = 2; dimension=2 in BARS;
# vc.Trapezoidal() beside vc.Midpoint().
if __name__ == "__main__":
    raise SystemExit(status_of(main))
