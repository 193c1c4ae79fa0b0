#!/usr/bin/env python3
"""Solve the examples of Aimi, Di Credico and Gimperlein (2024).

They are solved by space-time boundary elements, beside finite elements.

The examples are a pressed square, concrete on steel, concrete in concrete, and a tennis ball on a
moving plane. Boundary elements have unknowns on the boundary only, and they share no matrix with
the finite elements. So the agreement of both methods shows that the mechanics agree.

    bash demos/run.sh boundary_elements     # figures and a table, into results/boundary_elements

docs/theory/bem.md explains the method, docs/guide/pressed_blocks.md the examples.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from matplotlib.path import Path as Outline
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.boundary import (
    SHEAR,
    Curve,
    Panel,
    Shot,
    plot_boundary_snapshots,
    plot_panels,
)
from demos.parts.problems import disk, embedded, square
from demos.parts.problems.boundary_elements import (
    disk_contact,
    disk_problem,
    embedded_problem,
    square_problem,
)
from demos.parts.problems.compare_tractions import Tractions, compared
from demos.parts.problems.interior import interior_displacement
from vi_contact import bem
from vi_contact.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
ELEMENTS = {"square": 20, "steel": 10, "concrete": 10, "ball": 80}  # along a side, around the ball
QUICK = {"square": 6, "steel": 5, "concrete": 4, "ball": 24}
# of the finite elements; size of those of the ball
CELLS = {"square": 160, "steel": 20, "concrete": 10, "ball": 0.04}
QUICK_CELLS = {"square": 10, "steel": 5, "concrete": 4, "ball": 0.15}
LAWS = {
    "square": {
        "no friction": vc.Frictionless(),
        "Tresca 0.05": vc.Tresca(0.05),
        "Coulomb 0.5": vc.Coulomb(0.5),
    },
    "steel": {"no friction": vc.Frictionless(), "Coulomb 0.3": vc.Coulomb(0.3)},
    "concrete": {"no friction": vc.Frictionless(), "Coulomb 0.75": vc.Coulomb(0.75)},
    "ball": {"no friction": vc.Frictionless(), "Coulomb 2": vc.Coulomb(2.0)},
}
TITLES = {
    "square": "square",
    "steel": "concrete on steel",
    "concrete": "concrete in concrete",
    "ball": "tennis ball",
}
T_END = {"square": 6.0, "steel": 0.02, "concrete": 0.02, "ball": 4.0}  # [s]
SHOTS = {  # [s]
    "square": (0.5, 1.5, 2.5, 4.0),
    "steel": (0.005, 0.01, 0.015, 0.02),
    "concrete": (0.005, 0.01, 0.015, 0.02),
    "ball": (0.5, 1.0, 1.2, 4.0),
}
MAGNIFIED = {"square": 0.3, "steel": 500.0, "concrete": 500.0, "ball": 1.0}
WINDOW = 20  # steps that Uzawa's iteration takes at once where there are many
PUSH = disk.Push(height=0.05, rise=1.0)
COLOURS = ("black", "tab:blue", "tab:red")
OUT = Path("results/boundary_elements")


class Answer(NamedTuple):
    """Hold one law of one example by boundary elements and by finite elements.

    ``fem`` has the history of the latter.
    """

    run: bem.ContactRun
    bodies: tuple[tuple[bem.BoundaryProblem, bem.BoundaryMotion], ...]
    fem: Any
    surface: vc.ContactSurface  # of the finite elements, all of it

    @property
    def energy(self) -> np.ndarray:
        """Return the energies of the boundary elements."""
        return np.sum([motion.work for _, motion in self.bodies], axis=0)

    @property
    def fem_energy(self) -> np.ndarray:
        """Return the energies of the finite elements."""
        return self.fem["energy_kinetic"] + self.fem["energy_strain"]

    @property
    def tractions(self) -> tuple[Tractions, Tractions]:
        """Return pressures and shears of both methods on the nodes of the boundary elements."""
        return compared(self.run, self.surface, self.fem)


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all examples and laws.

    It returns energies and impulses of both methods, iterations of Uzawa, and certificates.
    """
    comm = MPI.COMM_WORLD
    sizes, cells = (QUICK, QUICK_CELLS) if quick else (ELEMENTS, CELLS)
    answers, numbers = {}, {}
    for name in LAWS:
        answers[name] = example(name, sizes[name], cells[name], comm)
        for law, answer in answers[name].items():
            numbers |= {f"{name}, {law}: {what}": value for what, value in results(answer).items()}
            window = None if name == "square" else WINDOW
            numbers |= {
                f"{name}, {law}: {what}": value for what, value in uzawa(answer.run, window).items()
            }
            if progress and comm.rank == 0:
                print(f"{TITLES[name]}, {law}: done", flush=True)
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        draw(answers, out, slice(None, None, 3 if quick else None))
        print(table(numbers))
        print(f"\nFigures are in {out}.")
    comm.Barrier()
    return numbers


def example(name: str, size: int, cells: float, comm: Any) -> dict[str, Answer]:
    """Run all laws of an example by both methods."""
    contact, solve, dt = boundary_elements(name, size)
    problem, fem_dt = finite_elements(name, cells, comm)
    answers = {}
    for law, friction in LAWS[name].items():
        run = bem.march_contact(replace(contact, friction=friction))
        solution = vc.simulate(
            problem(friction=friction),
            dt=fem_dt,
            t_end=T_END[name],
            record=(vc.Energy(), vc.Contact()),
            progress=False,
        )
        answers[law] = Answer(run, solve(run.forces), solution.history, problem().surface.whole())
    return answers


def boundary_elements(name: str, size: int) -> tuple[bem.BoundaryContact, Any, float]:
    """Return (contact, its motion from the contact forces, dt).

    For these c_P dt = h, 4 h for the slow loads, h for the ball.
    """
    box = square.concrete()
    data = {"steel": box, "concrete": box}.get(name, square.Square(pressure=1.0))
    pressure = partial(pressure_of, data)
    dt = {"square": 1.0, "steel": 4.0, "concrete": 4.0}.get(name, 1.0) / size / data.material.c_p
    if name == "concrete":
        inside = embedded_problem(
            size, box.material, dt=dt, steps=round(T_END[name] / dt), pressure=pressure
        )
        two = inside.bodies
        return (
            inside.contact(),
            lambda forces: tuple(zip((two.one, two.two), two.solve(forces), strict=True)),
            dt,
        )
    if name == "ball":
        ball = disk.Disk()
        dt = 2.0 * np.pi * ball.radius / size / ball.material.c_p
        one = disk_problem(
            size, ball.material, dt=dt, steps=int(T_END[name] / dt), radius=ball.radius
        )
        return disk_contact(one, PUSH), lambda forces: ((one, one.solve(forces)),), dt
    one = square_problem(
        size, data.material, dt=dt, steps=round(T_END[name] / dt), pressure=pressure
    )
    return bem.BoundaryContact(one.condensed()), lambda forces: ((one, one.solve(forces)),), dt


def pressure_of(data: square.Square, t: float) -> float:
    """Return the pressure of the load [Pa]."""
    return data.pressure * (data.history(t) if data.history else 1.0)


def finite_elements(name: str, cells: float, comm: Any) -> tuple[Any, float]:
    """Return (problem(friction=...), dt) of the same example."""
    if name == "ball":
        model = disk.build(disk.Disk(size=cells, push=PUSH), comm)
        return model.problem, model.disk.time_step
    if name == "concrete":
        return embedded.build(
            embedded.Embedded(square.concrete(cells=int(cells))), comm
        ).problem, 1e-3 / cells
    data = (
        square.concrete(int(cells))
        if name == "steel"
        else square.Square(cells=int(cells), pressure=1.0)
    )
    return square.build(data, comm).problem, (1e-3 / cells if name == "steel" else data.time_step)


def results(answer: Answer) -> dict[str, float]:
    """Return a line of the table."""
    run, history = answer.run, answer.fem
    end = min(run.times[-1], history["t"][-1])
    fine = np.interp(run.times, history["t"], answer.fem_energy)
    force = history["contact_resultant"]
    impulse = np.cumsum(0.5 * np.diff(history["t"]) * (force[1:] + force[:-1]))
    both = [
        np.interp(end, run.times, run.r_n.sum(axis=1).cumsum() * run.contact.compliance.dt),
        np.interp(end, history["t"][1:], impulse),
    ]
    return {
        "energy": float(answer.energy[-1]),
        "fem energy": float(fine[-1]),
        "energy off": float(np.sqrt(np.mean((answer.energy - fine) ** 2)) / fine.max()),
        "impulse": float(both[0]),
        "fem impulse": float(both[1]),
        "friction": float(run.friction_loss[-1]),
        "fem friction": float(history["loss_friction"][-1]),
        "certificate": run.worst,
    }


def uzawa(run: bem.ContactRun, window: int | None) -> dict[str, float]:
    """Run the source's iteration on a window of steps at once (all by default).

    It tells how often, and how far from the march.
    """
    settings = bem.SpaceTimeUzawa(tolerance=1e-9 if window else 1e-8, window=window)
    found = settings.solve(run.contact)
    off = np.abs(found.forces - run.forces).max() / np.abs(run.forces).max()
    return {"uzawa": float(found.iterations.mean()), "uzawa off": float(off)}


def draw(answers: dict[str, dict[str, Answer]], out: Path, chosen_shots: slice) -> None:
    """Draw snapshots with friction.

    Tractions of both methods, and energies with and without friction, are drawn too.
    """
    rows = {
        TITLES[name]: shots(name, list(laws.values())[-1], SHOTS[name][chosen_shots])
        for name, laws in answers.items()
    }
    plot_boundary_snapshots(
        rows,
        out / "snapshots.png",
        title="Boundary elements, Coulomb friction: deformed bodies "
        "and what the support does to them",
    )
    chosen = (
        ("square", "Tresca 0.05", (1.5, 2.5, 3.5)),
        ("square", "Coulomb 0.5", (1.5, 2.5, 3.5)),
        ("steel", "Coulomb 0.3", (0.01, 0.015, 0.02)),
        ("ball", "Coulomb 2", (0.3, 0.6, 0.9)),
    )
    columns = [tractions(name, law, answers[name][law], times) for name, law, times in chosen]
    plot_panels(
        list(zip(*columns, strict=True)),
        out / "tractions.png",
        title="Contact tractions on the nodes of the boundary elements: boundary elements (lines), "
        "finite elements (dots)",
    )
    pairs = (("square", "steel"), ("concrete", "ball"))
    panels = [[energies(name, answers[name]) for name in pair] for pair in pairs]
    plot_panels(
        panels,
        out / "energies.png",
        title="Energy with and without friction: boundary elements (lines), finite elements (dots)",
    )


def shots(name: str, answer: Answer, times: Sequence[float]) -> list[Shot]:
    """Return the deformed bodies at some times."""
    run = answer.run
    contact = answer.run.contact
    scale = MAGNIFIED[name]
    steps = [int(np.argmin(np.abs(run.times - t))) for t in times]
    inside = [points_inside(problem.operator.mesh) for problem, _ in answer.bodies]
    moved = [
        interior_displacement(problem.operator, motion, x, steps=steps)
        for x, (problem, motion) in zip(inside, answer.bodies, strict=True)
    ]
    drawn = []
    for row, k in enumerate(steps):
        outlines = tuple(
            problem.operator.mesh.points + scale * motion.displacement[k].T
            for problem, motion in answer.bodies
        )
        one, motion = answer.bodies[0]
        nodes = contact.compliance.nodes
        arrows = run.forces[k].reshape(2, -1).T / contact.compliance.lengths[:, None]
        dots = np.concatenate([x + scale * u[row] for x, u in zip(inside, moved, strict=True)])
        feet = one.operator.mesh.points[nodes] + scale * motion.displacement[k][:, nodes].T
        support = {"square": -0.5, "steel": -0.5, "ball": PUSH(float(run.times[k]))}.get(name)
        moment = (
            f"t = {1e3 * run.times[k]:.3g} ms" if T_END[name] < 1.0 else f"t = {run.times[k]:.3g} s"
        )
        magnified = "" if scale == 1.0 else f", u x {scale:g}"
        drawn.append(Shot(moment + magnified, outlines, dots, feet, arrows, support))
    return drawn


def points_inside(mesh: bem.BoundaryMesh, spacing: float = 0.2) -> np.ndarray:
    """Return a lattice of points in the body, half a spacing from its sides at least."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    x, y = (np.arange(a + 0.5 * spacing, b, spacing) for a, b in zip(low, high, strict=True))
    lattice = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    sides = np.concatenate(
        [(1 - a) * mesh.points + a * mesh.points[mesh.after] for a in np.arange(0.0, 1.0, 0.125)]
    )
    near = np.hypot(*(lattice[:, None] - sides).transpose(2, 0, 1)).min(axis=1)
    return lattice[Outline(mesh.points).contains_points(lattice) & (near > 0.3 * spacing)]


def tractions(name: str, law: str, answer: Answer, times: Sequence[float]) -> tuple[Panel, Panel]:
    """Return panels of pressure and of shear over x.

    They are those of the support on the body, along +x, in the steps that end at some times.
    """
    panels = []
    for quantity, both in zip(("pressure", SHEAR), answer.tractions, strict=True):
        curves = []
        for t, colour in zip(times, ("black", "tab:orange", "tab:green"), strict=True):
            k = int(np.argmin(np.abs(both.times - t)))
            moment = f"t = {1e3 * t:g} ms" if T_END[name] < 1.0 else f"t = {t:g} s"
            curves.append(Curve(moment, both.x, both.mine[k], colour))
            curves.append(Curve("", both.x, both.theirs[k], colour, marked=True))
        panels.append(Panel(f"{TITLES[name]}, {law}", quantity, "Pa", tuple(curves), "x [m]"))
    return panels[0], panels[1]


def energies(name: str, laws: dict[str, Answer]) -> Panel:
    """Return the panel of the energy over time of all laws."""
    curves = []
    factor, unit = (1e3, "ms") if T_END[name] < 1.0 else (1.0, "s")
    for (law, answer), colour in zip(laws.items(), COLOURS, strict=False):
        every = max(1, len(answer.fem["t"]) // 40)
        curves.append(Curve(law, factor * answer.run.times, answer.energy, colour))
        curves.append(
            Curve(
                "",
                factor * answer.fem["t"][::every],
                answer.fem_energy[::every],
                colour,
                marked=True,
            )
        )
    return Panel(TITLES[name], "energy", "J/m", tuple(curves), f"time [{unit}]")


def table(numbers: dict[str, float]) -> str:
    """Return a line per example and law."""
    columns = (
        "energy",
        "fem energy",
        "energy off",
        "impulse",
        "fem impulse",
        "friction",
        "fem friction",
        "uzawa",
        "uzawa off",
        "certificate",
    )
    lines = [f"{'':<24}" + "".join(f"{name:>13}" for name in columns)]
    for name, laws in LAWS.items():
        for law in laws:
            values = "".join(
                f"{numbers.get(f'{name}, {law}: {what}', np.nan):>13.5g}" for what in columns
            )
            lines.append(f"{name + ', ' + law:<24}{values}")
    return "\n".join(lines)


# Things to try: ELEMENTS of twice the number; bem.SpaceTimeUzawa(rho=...), whose iterations depend
# on rho; compare_runs(problem, [Reference.of(run)], ...) of demos/parts/problems/whole_runs.py
# beside finite elements.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
