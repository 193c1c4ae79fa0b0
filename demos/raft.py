#!/usr/bin/env python3
"""Shake a building on a raft on soil in all three directions.

It lifts off at its edges and corners, and slides.

The two bodies have tetrahedra that do not match, with Coulomb friction between them. There are
three stages, as in practice. In the first, gravity acts on a firm base. In the second, the base is
released and its reactions are kept as forces. In the third, an earthquake of three components comes
up from below. The sides of the soil are tied to each other, because level ground moves in this way.
docs/guide/raft.md has the data, the figures, the mesh and the time step.

    bash demos/run.sh raft                          # 2e4 unknowns, 1000 steps, into results/raft
    bash demos/run.sh -n 2 raft --size 1e5          # on two ranks
    bash demos/run.sh raft --size 3e5 --steps 50    # 7 GB, six minutes until the first step
    bash demos/run.sh raft --size 1e6 --steps 4     # without a factor: minutes a step

The last one takes hours for the gravity stage. The same stages from a case file:

    python3 meshes raft --size 2.4 --soil-size 1.6 --far 8 -o demos/cases/raft.msh
    vi-contact run demos/cases/raft.toml --out results/raft_case
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures import raft as pictures
from demos.parts.pictures.histories import plot_certificate, plot_energy
from meshes.raft import RaftMesh
from vi_contact import engineering, fem, ground_motion, soil
from vi_contact.cli import status_of
from vi_contact.plots.bodies import film, plot_deformed
from vi_contact.plots.faces import plot_faces

# Parameters
# --------------------------------------------------------------------------------------------------
SOIL = vc.LinearElastic.from_wave_speeds(400.0, 200.0, 1900.0)  # c_P, c_S [m/s], rho [kg/m³]
ROCK = vc.LinearElastic.from_wave_speeds(1600.0, 800.0, 2400.0)  # below the base
CONCRETE = vc.LinearElastic(E=2.5e10, nu=0.2, rho=2500.0)
# [m]
RAFT = (12.0, 9.0, 1.5)
CORE = (0.75, 0.0, 8.0, 6.0)
STOREYS = (4.0, 4.0, 4.0)
LAYER = (42.0, 36.0, 12.0)
# [m] of the building, of the soil under the raft (finer: it is softer) and far off
CELLS = np.array([1.2, 0.8, 4.0])
SIZES = {"2e4": 0.7, "1e5": 0.34, "3e5": 0.235, "1e6": 0.16}  # unknowns, about -> factor of CELLS
# a factor of 1e6: 30 GB
SOLVERS = {size: vc.Iterative() if size == "1e6" else vc.Condensed() for size in SIZES}
MU = 0.5
PEAKS = (2.0, 1.6, 1.0)  # of an outcrop of the rock along x, y, z [m/s²]
SEEDS = (1, 2, 3)  # of the motions along x, y, z
# 3 % at 4 Hz; alpha would brake the rocking
DAMPING = vc.Rayleigh(alpha=0.0, beta=0.03 / (np.pi * 4.0))
DT, T_END = 5e-3, 5.0
FRAMES = 200  # for ParaView and the film
MAGNIFIED = 100.0  # displacements in the pictures
OUT = Path("results/raft")
ROOF = RAFT[2] + sum(STOREYS)
POINTS = {
    "foot": (CORE[0], 0.0, RAFT[2]),
    "roof": (CORE[0], 0.0, ROOF),
    "field": (-0.5 * LAYER[0], -0.5 * LAYER[1], 0.0),
}
POINTS |= {
    name: (0.5 * x * RAFT[0], 0.5 * y * RAFT[1], RAFT[2])
    for name, (x, y) in pictures.CORNERS.items()
}


def main(
    quick: bool = False,
    size: str = "2e4",
    out: Path = OUT,
    progress: bool = True,
    steps: int | None = None,
) -> dict[str, float]:
    """Run all three stages (``quick``: 3e3 unknowns, 150 steps of 10 ms) and draw.

    It returns the key numbers.
    """
    comm = MPI.COMM_WORLD
    dt, t_end = (1e-2, 1.5) if quick else (DT, T_END)
    steps = round(t_end / dt) if steps is None else steps
    problem, start = stages(2.0 if quick else SIZES[size], comm, SOLVERS[size])
    weight = float(comm.allreduce(start.r_n.sum()))
    solution = vc.simulate(
        problem,
        dt=dt,
        steps=steps,
        state=start,
        out=out,
        progress=progress,
        solver=SOLVERS[size],
        record=recorders(),
        fields=fem.XDMF(every=max(1, steps // (15 if quick else FRAMES))),
    )
    numbers = key_numbers(solution.history, weight) | {
        "worst certificate": solution.facts["worst_certificate"],
        "energy defect": solution.facts["energy_defect"],
    }
    if comm.rank == 0:
        print(solution.summary())
        print("\n".join(f"  {name:<42} {value:.4g}" for name, value in numbers.items()))
        draw(out, weight, quick=quick, filmed=size == "2e4")
        print(f"\nFigures, film, histories and ParaView files are in {out}.")
    comm.Barrier()  # nobody leaves before the figures are there
    return numbers


def meshed(finer: float, comm: Any) -> tuple[Any, Any]:
    """Return mesh and groups. ``finer``: factor of all CELLS."""
    size, soil_size, far = (float(one) for one in finer * CELLS)
    shape = RaftMesh(
        raft=RAFT, core=CORE, storeys=STOREYS, soil=LAYER, size=size, soil_size=soil_size, far=far
    )
    return fem.build_mesh(shape, comm)


def problems(mesh: Any, tags: Any) -> tuple[vc.ContactProblem, vc.ContactProblem]:
    """Return the gravity stage on a firm base, and the dynamic problem.

    The base of the latter lets waves in and out.
    """
    cells = [(tags["soil"], SOIL), (tags["building"], CONCRETE)]
    tied = [
        fem.Tied(tags[f"soil_{one}"], tags[f"soil_{two}"])
        for one, two in (("left", "right"), ("back", "front"))
    ]
    gravity = fem.assemble(mesh, cells, clamped=tags["soil_bottom"], tied=tied)
    base = fem.CompliantBase(tags["soil_bottom"], ROCK, motion=soil.upgoing(earthquake()))
    dynamic = fem.assemble(mesh, cells, dashpots=base, tied=tied, damping=DAMPING)
    static, problem = (
        vc.ContactProblem(
            system,
            fem.contact_pair(
                system, tags["raft_bottom"], tags["soil_foot"], matching=fem.DualMortar()
            ),
            friction=vc.Coulomb(MU),
        )
        for system in (vc.with_weight(gravity), vc.with_weight(dynamic))
    )
    return static, problem


def stages(finer: float, comm: Any, solver: Any = None) -> tuple[vc.ContactProblem, vc.State]:
    """Return (dynamic problem, its first state).

    The problem has the reactions of the firm base as forces; the state is at rest.
    """
    static, problem = problems(*meshed(finer, comm))
    return fem.release(static, vc.static_equilibrium(static, solver=solver), problem)


def recorders() -> tuple[Any, ...]:
    """Return what is recorded.

    That is energies, contact, forces and rotation of the raft, and histories of points.
    """
    raft = engineering.Resultants("raft", (0.0, 0.0, 0.0))
    return vc.Energy(), vc.Contact(), raft, vc.Probe(POINTS, velocity=True, acceleration=True)


def earthquake() -> list[vc.GroundMotion]:
    """Return three made-up components of the motion of an outcrop of the rock.

    Each has its seed.
    """
    ground = ground_motion.KanaiTajimi(s0=0.01)
    envelope = ground_motion.Envelope(rise=0.5, end=3.0, decay=2.0)  # [s], [1/s]
    components = []
    for axis, peak, seed in zip(np.eye(3), PEAKS, SEEDS, strict=True):
        record = ground_motion.synthetic(ground, T_END, 1e-2, seed=seed, envelope=envelope)
        record = ground_motion.Processing(low=0.2, baseline=2, pga=peak)(record)
        components.append(vc.GroundMotion(record, direction=tuple(axis)))
    return components


def key_numbers(history: Any, weight: float) -> dict[str, float]:
    """Return the peaks that people ask for."""

    def peak(*columns: str) -> float:
        return float(np.sqrt(sum(np.square(history[column]) for column in columns)).max())

    turned = pictures.rotations(history, RAFT)
    drift = {axis: history[f"u_{axis}_roof"] - history[f"u_{axis}_foot"] for axis in "xy"}
    return {
        "weight [MN]": 1e-6 * weight,
        "least normal force over weight": float(history["N_raft"].min()) / weight,
        "largest normal force over weight": float(history["N_raft"].max()) / weight,
        "base shear over weight": peak("force_x_raft", "force_y_raft") / weight,
        "open share of the raft at rest": float(history["uplift_raft"][0]),
        "largest open share of the raft": float(history["uplift_raft"].max()),
        "largest opening [mm]": 1e3 * float(history["opening_raft"].max()),
        "largest slip [mm]": 1e3 * float(np.nanmax(history["slip_raft"])),
        **{
            f"rotation about {axis} [mrad]": 1e3 * float(np.abs(one).max())
            for axis, one in turned.items()
        },
        "roof over foot [mm]": 1e3
        * float(np.hypot(*(one - one[0] for one in drift.values())).max()),
        "acceleration of the field [m/s²]": peak("a_x_field", "a_y_field"),
        "acceleration of the roof [m/s²]": peak("a_x_roof", "a_y_roof"),
        "friction work [kJ]": 1e-3 * float(history["loss_friction"][-1]),
    }


def draw(out: Path, weight: float, *, quick: bool, filmed: bool) -> None:
    """Draw all figures and the film around the largest uplift.

    The film is drawn where there are not too many cells.
    """
    run = vc.read_run(out)
    history = run.history
    times = pictures.instants(run.history)
    pictures.plot_motions(history, out / "motions.png", weight=weight, mu=MU)
    pictures.plot_moments(history, out / "moments.png", weight=weight, sides=RAFT[:2])
    plot_faces(
        run,
        out / "faces.png",
        times=times,
        title="The raft from above: closed, half open, open widest",
    )
    plot_deformed(
        run, out / "deformed.png", times=times, magnified=MAGNIFIED, title="Building and soil"
    )
    if filmed:
        around = times[-1] + (np.arange(2) if quick else np.linspace(-0.35, 0.35, 29))
        film(run, out / "raft.gif", times=around, magnified=MAGNIFIED, column="uplift_raft")
    plot_energy(history, out / "energy.png")
    plot_certificate(history, out / "certificate.png")


def command_line(words: Sequence[str]) -> int:
    """Run it with the options of the command line."""
    options = ArgumentParser(prog="raft", description=__doc__.splitlines()[0])
    options.add_argument("--quick", action="store_true", help="use a coarse mesh and 150 steps")
    options.add_argument("--size", choices=SIZES, default="2e4", help="number of unknowns, about")
    options.add_argument("--steps", type=int, help=f"number of steps of {1e3 * DT:g} ms")
    options.add_argument("--out", type=Path, default=OUT)
    given = options.parse_args(words)
    return status_of(lambda: main(given.quick, given.size, given.out, steps=given.steps))


# Things to try:
# - MU = 0.2: it slides more and rocks less; PEAKS times 0.2: nothing opens and the response is
#   linear.
# - CORE further to the side: it twists as it slides.
# - fem.CompliantBase without ROCK: the soil goes on below, and nothing comes back from the rock.
if __name__ == "__main__":
    raise SystemExit(command_line(sys.argv[1:]))
