#!/usr/bin/env python3
"""Press a square on a rigid support by finite elements.

There is no friction, Tresca's or Coulomb's.

This is the first example of the space-time boundary elements.

A pressure of 0.1 acts on the top of the unit square from t = 0 on (c_P = 1, c_S = 1/2). Its wave
arrives at the support at t = 1 and comes back; the energy grows linearly until then, and friction
takes some of it.

    bash demos/run.sh square                # three figures and a table, into results/square
    bash demos/run.sh -n 2 square           # the same on two ranks

docs/guide/pressed_blocks.md explains the numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.deformed import plot_snapshots, plot_tractions
from demos.parts.pictures.runs import plot_runs
from demos.parts.problems.square import Square, build
from vi_contact import fem
from vi_contact.cli import status_of
from vi_contact.plots.histories import History

# Parameters
# --------------------------------------------------------------------------------------------------
SQUARE = Square(cells=20, pressure=0.1)  # h = dt = 0.05, as the source has it
FRICTION = {
    "no friction": vc.Frictionless(),
    "Tresca 0.05": vc.Tresca(0.05),
    "Coulomb 0.5": vc.Coulomb(0.5),
}
SCHEMES = {"default scheme": None, "midpoint": vc.Midpoint()}
T_END = 6.0  # [s]
TIMES = (0.5, 1.5, 2.0, 3.0, 4.0)  # of the snapshots and tractions [s]
TABLE = (1.0, 2.0, 3.0, 4.0, 6.0)  # of the energies [s]
OUT = Path("results/square")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run every friction law with every scheme (``quick``: 10 cells, default scheme).

    It returns energies, work of friction, certificates and defects.
    """
    comm = MPI.COMM_WORLD
    model = build(replace(SQUARE, cells=10) if quick else SQUARE, comm)
    dt = model.square.time_step
    histories, numbers = {}, {}
    for scheme_name, scheme in list(SCHEMES.items())[: 1 if quick else None]:
        for name, friction in FRICTION.items():
            run = f"{name}, {scheme_name}"
            solution = vc.simulate(
                model.problem(friction=friction),
                scheme=scheme,
                dt=dt,
                t_end=T_END,
                record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
                fields=fem.XDMF(every=round(0.5 / dt)),
                out=folder(out, run),
                progress=progress,
            )
            history = solution.history
            energy = history["energy_kinetic"] + history["energy_strain"]
            histories[run] = {**history, "energy": energy}
            numbers |= {f"{run}: E({t:g})": float(energy[round(t / dt)]) for t in TABLE}
            numbers[f"{run}: friction"] = float(history["loss_friction"][-1])
            numbers[f"{run}: certificate"] = solution.facts["worst_certificate"]
            numbers[f"{run}: ledger defect"] = solution.facts["energy_defect"]
    if comm.rank == 0:
        draw(histories, out, TIMES[::2] if quick else TIMES)
        print(table(numbers, list(histories)))
        print(f"\nFigures, histories and ParaView files are in {out}.")
    comm.Barrier()
    return numbers


def folder(out: Path, run: str) -> Path:
    """Return the folder of one run."""
    return out / run.replace(", ", "_").replace(" ", "_")


def draw(histories: Mapping[str, History], out: Path, times: Sequence[float]) -> None:
    """Draw snapshots, tractions and energies of the default scheme."""
    runs = {name: folder(out, f"{name}, default scheme") for name in FRICTION}
    support = -0.5 * SQUARE.side
    plot_snapshots(
        runs,
        times,
        out / "snapshots.png",
        support=lambda t: support,
        title="A square under pressure on a rigid support, with the tractions it feels there",
    )
    plot_tractions(
        runs,
        TIMES[1:],
        out / "tractions.png",
        title="Contact tractions on the bottom of the square",
    )
    quantities = (
        ("energy", "energy", "J"),
        ("contact_resultant", "contact force", "N"),
        ("loss_friction", "work of friction", "J"),
        ("u_x_corner", "$u_x$ of the corner", "m"),
    )
    plot_runs(
        {name: histories[f"{name}, default scheme"] for name in FRICTION},
        quantities,
        out / "energies.png",
        title="The square with and without friction, default scheme",
    )


def table(numbers: dict[str, float], runs: list[str]) -> str:
    """Return a table of energies over time, and what friction took."""
    columns = [f"E({t:g})" for t in TABLE] + ["friction"]
    lines = [f"{'':<30}" + "".join(f"{name:>10}" for name in columns)]
    for run in runs:
        lines.append(
            f"{run:<30}" + "".join(f"{numbers[f'{run}: {name}']:>10.5f}" for name in columns)
        )
    return "\n".join(lines)


# Things to try: cells=80; confined=True in SQUARE, where the wave is plane and the base feels twice
# the pressure; vc.Coulomb(0.1), which slips; fem and ParaView with results/square/*/fields.xdmf.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
