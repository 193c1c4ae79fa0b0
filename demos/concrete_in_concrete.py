#!/usr/bin/env python3
"""Press down a box of concrete in the notch of a concrete block.

They are two elastic bodies in frictional contact.

4 MPa tanh((t/15 ms)²) act on the top of the 1 m box; its lower half is in the notch. It widens as
it is pressed and leans on the walls, which with friction (Coulomb, mu = 0.75) carry a part of the
load.

    bash demos/run.sh concrete_in_concrete          # two figures and a table
    bash demos/run.sh -n 2 concrete_in_concrete     # the same on two ranks

Both write into results/concrete_in_concrete. docs/guide/pressed_blocks.md explains the numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.deformed import plot_snapshots
from demos.parts.pictures.runs import plot_runs
from demos.parts.problems.embedded import Embedded, build
from demos.parts.problems.square import concrete
from vi_contact import fem
from vi_contact.cli import status_of
from vi_contact.plots.histories import History

# Parameters
# --------------------------------------------------------------------------------------------------
CELLS = 10  # along a side of the box
FRICTION = {"smooth": vc.Frictionless(), "rough": vc.Coulomb(0.75)}
DT = 1.0e-4  # [s]
T_END = 20.0e-3  # [s]
TIMES = (5.0e-3, 10.0e-3, 15.0e-3, 20.0e-3)  # of snapshots and the table [s]
MAGNIFIED = 600.0
OUT = Path("results/concrete_in_concrete")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run both, with the default scheme (``quick``: 8 cells, steps of 0.25 ms).

    It returns energies [J], work of friction [J], shares of the load that floor and walls carry at
    the end, certificates and defects.
    """
    comm = MPI.COMM_WORLD
    model = build(Embedded(concrete(8 if quick else CELLS)), comm)
    dt = 2.5 * DT if quick else DT
    box = model.embedded.box
    load = box.pressure * box.side * (box.history(T_END) if box.history else 1.0)
    histories: dict[str, History] = {}
    numbers: dict[str, float] = {}
    for name, friction in FRICTION.items():
        solution = vc.simulate(
            model.problem(friction=friction),
            dt=dt,
            t_end=T_END,
            out=out / name,
            progress=progress,
            record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
            fields=fem.XDMF(every=round(TIMES[0] / dt)),
        )
        history = solution.history
        energy = history["energy_kinetic"] + history["energy_strain"]
        histories[name] = {**history, "energy": energy}
        numbers |= {f"{name}: E({1e3 * t:g} ms)": float(energy[round(t / dt)]) for t in TIMES}
        walls = history["friction_force_y"][-1] if "friction_force_y" in history else 0.0
        numbers |= {
            f"{name}: friction": float(history["loss_friction"][-1]),
            f"{name}: floor": float(history["contact_force_y"][-1]) / load,
            f"{name}: walls": float(walls) / load,
            f"{name}: top": float(history["u_y_top"][-1]),
            f"{name}: certificate": solution.facts["worst_certificate"],
            f"{name}: ledger defect": solution.facts["energy_defect"],
        }
    if comm.rank == 0:
        draw(histories, out, -2.0 * box.side)
        print(table(numbers))
        print(f"\nFigures, histories and ParaView files are in {out}.")
    comm.Barrier()
    return numbers


def draw(histories: Mapping[str, History], out: Path, ground: float) -> None:
    """Draw snapshots and histories."""
    plot_snapshots(
        {name: out / name for name in FRICTION},
        TIMES[1:],
        out / "snapshots.png",
        support=lambda t: ground,
        magnified=MAGNIFIED,
        title="Concrete in concrete, with the tractions on the box",
    )
    quantities = (
        ("energy", "energy", "J"),
        ("loss_friction", "work of friction", "J"),
        ("contact_force_y", "force on the floor", "N"),
        ("u_y_top", "$u_y$, top", "m"),
    )
    plot_runs(
        histories,
        quantities,
        out / "energies.png",
        title="Concrete in concrete, with and without friction",
    )


def table(numbers: Mapping[str, float]) -> str:
    """Return a table of energies over time.

    At the end there are the work of friction and the shares of the load.
    """
    energies = [f"E({1e3 * t:g} ms)" for t in TIMES]
    columns = (*energies, "friction", "floor", "walls")
    lines = [f"{'energies [J], shares of load':<30}" + "".join(f"{name:>11}" for name in columns)]
    for name in FRICTION:
        lines.append(
            f"{name:<30}" + "".join(f"{numbers[f'{name}: {column}']:>11.4f}" for column in columns)
        )
    return "\n".join(lines)


# Things to try: vc.Coulomb(0.2); a soft block, Embedded(..., block=vc.LinearElastic(E=1e9, nu=0.3,
# rho=1800.0)); a sudden load, history=None in Square().
if __name__ == "__main__":
    raise SystemExit(status_of(main))
