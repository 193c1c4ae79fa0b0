#!/usr/bin/env python3
"""Push a disk up with a plane, gently, and let it fly.

It is the tennis ball of the space-time boundary elements.

The plane rises by 0.05 within one second and goes down again; the disk (R = 1/2, c_P = 2, c_S = 1,
no weight) leaves it on its way down and flies up with a constant velocity and constant energy,
whether it rubs on the plane or not.

    bash demos/run.sh tennis_ball           # three figures and a table, into results/tennis_ball
    bash demos/run.sh -n 2 tennis_ball      # the same on two ranks

docs/guide/pressed_blocks.md explains the numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.deformed import plot_snapshots, plot_tractions
from demos.parts.pictures.runs import plot_runs
from demos.parts.problems.disk import Disk, Momentum, Push, build
from vi_contact import fem
from vi_contact.cli import status_of
from vi_contact.plots.histories import History

# Parameters
# --------------------------------------------------------------------------------------------------
DISK = Disk(radius=0.5, size=0.04, push=Push(height=0.05, rise=1.0))  # h = 2 dt = 0.04
FRICTION = {
    "no friction": vc.Frictionless(),
    "Coulomb 2": vc.Coulomb(2.0),
    "Tresca 2": vc.Tresca(2.0),
}
T_END = 4.0  # [s]
TIMES = (0.5, 1.0, 1.2, 2.0, 4.0)  # of the snapshots [s]
PUSHED = (0.3, 0.5, 0.7, 0.9, 1.1)  # of the tractions [s]
OUT = Path("results/tennis_ball")
COLUMNS = (
    "release",
    "velocity",
    "energy",
    "work",
    "friction",
    "change of energy",
    "angular momentum",
    "ledger defect",
)


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all friction laws with the default scheme (``quick``: cells of 0.1).

    It returns the columns of the table.
    """
    comm = MPI.COMM_WORLD
    model = build(replace(DISK, size=0.1) if quick else DISK, comm)
    dt = model.disk.time_step
    histories, numbers = {}, {}
    for name, friction in FRICTION.items():
        solution = vc.simulate(
            model.problem(friction=friction),
            dt=dt,
            t_end=T_END,
            out=folder(out, name),
            progress=progress,
            record=(
                vc.Energy(),
                vc.Contact(),
                Momentum((0.0, DISK.radius)),
                vc.Probe(model.probes()),
            ),
            fields=fem.XDMF(every=round(0.1 / dt)),
        )
        histories[name] = history = derived(solution.history, model.mass)
        numbers |= {
            f"{name}: {what}": value for what, value in results(history, solution.facts).items()
        }
        numbers[f"{name}: certificate"] = solution.facts["worst_certificate"]
    if comm.rank == 0:
        draw(histories, out, TIMES[::2] if quick else TIMES)
        print(table(numbers))
        print(f"\nFigures, histories and ParaView files are in {out}.")
    comm.Barrier()
    return numbers


def folder(out: Path, name: str) -> Path:
    """Return the folder of one run."""
    return out / name.replace(" ", "_")


def derived(history: History, mass: float) -> dict[str, Any]:
    """Return the history with the energy and the velocity of the centre of mass."""
    energy = history["energy_kinetic"] + history["energy_strain"]
    return {**history, "energy": energy, "velocity": history["momentum_y"] / mass}


def results(history: History, facts: Mapping[str, float]) -> dict[str, float]:
    """Return a line of the table; flight begins two steps after the last contact."""
    last = int(np.flatnonzero(history["contact_active"])[-1])
    energy = history["energy"]
    values = (
        history["t"][last],
        history["velocity"][-1],
        energy[-1],
        history["work_input"][-1],
        history["loss_friction"][-1],
        np.ptp(energy[last + 2 :]) / energy[-1],
        np.abs(history["momentum_angular"]).max() / (DISK.radius * history["momentum_y"][-1]),
        facts["energy_defect"],
    )
    return {name: float(value) for name, value in zip(COLUMNS, values, strict=True)}


def draw(histories: Mapping[str, History], out: Path, times: Sequence[float]) -> None:
    """Draw snapshots, tractions and histories."""
    runs = {name: folder(out, name) for name in FRICTION}
    plot_snapshots(
        runs,
        times,
        out / "snapshots.png",
        support=DISK.push,
        title="A plane pushes a disk up, with the tractions it feels",
    )
    plot_tractions(runs, PUSHED, out / "tractions.png", title="Contact tractions on the disk")
    quantities = (
        ("energy", "energy", "J"),
        ("contact_resultant", "contact force", "N"),
        ("velocity", "velocity of the centre", "m/s"),
        ("loss_friction", "work of friction", "J"),
    )
    plot_runs(
        histories, quantities, out / "energies.png", title="The disk with and without friction"
    )


def table(numbers: Mapping[str, float]) -> str:
    """Return a line per friction law."""
    lines = [f"{'':<14}" + "".join(f"{what:>18}" for what in COLUMNS)]
    for name in FRICTION:
        values = [numbers[f"{name}: {what}"] for what in COLUMNS]
        lines.append(
            f"{name:<14}"
            + "".join(f"{v:>18.5g}" for v in values[:5])
            + "".join(f"{v:>18.1e}" for v in values[5:])
        )
    return "\n".join(lines)


# Things to try: Push(height=0.1, rise=4.0), a gentler push of which boundary elements say v =
# 0.0679; vc.Coulomb(0.1), which slips; scheme=vc.Midpoint() in simulate; size=0.02.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
