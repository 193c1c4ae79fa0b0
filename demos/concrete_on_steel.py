#!/usr/bin/env python3
"""Press a box of concrete on steel, slowly: the second example of the space-time boundary elements.

4 MPa tanh((t/15 ms)²) act on the top of 1 m of concrete. A pressure wave crosses it 65 times in the
20 ms, so the box follows its static solution; on steel (Coulomb, mu = 0.3) its base sticks
everywhere.

    bash demos/run.sh concrete_on_steel         # two figures and a table
    bash demos/run.sh -n 2 concrete_on_steel    # the same on two ranks

Both write into results/concrete_on_steel. docs/guide/pressed_blocks.md explains the numbers.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.deformed import plot_snapshots, plot_tractions
from demos.parts.pictures.runs import plot_runs
from demos.parts.problems.square import Square, build, concrete
from vi_contact import fem
from vi_contact.cli import status_of
from vi_contact.plots.histories import History

# Parameters
# --------------------------------------------------------------------------------------------------
BOX = concrete(cells=20)
FRICTION = {"smooth": vc.Frictionless(), "on steel": vc.Coulomb(0.3)}
DT = 5.0e-5  # [s]
T_END = 20.0e-3  # [s]
TIMES = (5.0e-3, 10.0e-3, 15.0e-3, 20.0e-3)  # of snapshots, tractions and the table [s]
MAGNIFIED = 500.0
OUT = Path("results/concrete_on_steel")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run both, with the default scheme (``quick``: steps of 0.25 ms).

    It returns energies [J], the last ones of energy, corner and force over their static values
    without friction, certificates and defects.
    """
    comm = MPI.COMM_WORLD
    model = build(BOX, comm)
    dt = 5.0 * DT if quick else DT
    histories, numbers = {}, {}
    energy_s, corner_s, force_s = static(BOX, T_END)
    for name, friction in FRICTION.items():
        solution = vc.simulate(
            model.problem(friction=friction),
            dt=dt,
            t_end=T_END,
            out=folder(out, name),
            progress=progress,
            record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
            fields=fem.XDMF(every=round(TIMES[0] / dt)),
        )
        history = solution.history
        energy = history["energy_kinetic"] + history["energy_strain"]
        histories[name] = {**history, "energy": energy}
        numbers |= {f"{name}: E({1e3 * t:g} ms)": float(energy[round(t / dt)]) for t in TIMES}
        numbers |= {
            f"{name}: energy": float(energy[-1]) / energy_s,
            f"{name}: corner": float(history["u_x_corner"][-1]) / corner_s,
            f"{name}: force": float(history["contact_resultant"][-1]) / force_s,
            f"{name}: friction": float(history["loss_friction"][-1]),
            f"{name}: certificate": solution.facts["worst_certificate"],
            f"{name}: ledger defect": solution.facts["energy_defect"],
        }
    if comm.rank == 0:
        draw(histories, out, TIMES[2:] if quick else TIMES[1:])
        print(table(numbers))
        print(f"\nFigures, histories and ParaView files are in {out}.")
    comm.Barrier()
    return numbers


def folder(out: Path, name: str) -> Path:
    """Return the folder of one run."""
    return out / name.replace(" ", "_")


def static(box: Square, t: float) -> tuple[float, float, float]:
    """Return (energy f²a²/(2E') [J/m], displacement, force) without friction.

    The displacement is that of the corner, ½ nu (1 + nu) f a/E [m], the force is f a [N/m], for the
    box in equilibrium; E' = E/(1 - nu²).
    """
    material, side = box.material, box.side
    f = box.pressure * (box.history(t) if box.history else 1.0)
    plane = material.E / (1.0 - material.nu**2)
    corner = 0.5 * material.nu * (1.0 + material.nu) * f * side / material.E
    return 0.5 * (f * side) ** 2 / plane, corner, f * side


def draw(histories: Mapping[str, History], out: Path, times: Sequence[float]) -> None:
    """Draw snapshots, tractions and histories."""
    runs = {name: folder(out, name) for name in FRICTION}
    support = -0.5 * BOX.side
    plot_snapshots(
        runs,
        times,
        out / "snapshots.png",
        support=lambda t: support,
        magnified=MAGNIFIED,
        title="Concrete on steel, with the tractions it feels",
    )
    plot_tractions(
        runs,
        TIMES,
        out / "tractions.png",
        title="Contact tractions on the base of the concrete box",
    )
    quantities = (
        ("energy", "energy", "J"),
        ("contact_resultant", "contact force", "N"),
        ("u_x_corner", "$u_x$, corner", "m"),
        ("u_y_top", "$u_y$, top", "m"),
    )
    plot_runs(
        histories,
        quantities,
        out / "energies.png",
        title="Concrete on steel, with and without friction",
    )


def table(numbers: Mapping[str, float]) -> str:
    """Return a table of energies over time.

    The end is over the static solution without friction.
    """
    columns = [f"E({1e3 * t:g} ms)" for t in TIMES]
    ends = ("energy", "corner", "force")
    lines = [
        f"{'energies [J], ends / static':<28}"
        + "".join(f"{name:>12}" for name in (*columns, *ends))
    ]
    for name in FRICTION:
        lines.append(
            f"{name:<28}"
            + "".join(f"{numbers[f'{name}: {column}']:>12.4f}" for column in (*columns, *ends))
        )
    return "\n".join(lines)


# Things to try: vc.Coulomb(0.1), which slips at the edges; T_END = 40e-3; a sudden load,
# history=None in Square().
if __name__ == "__main__":
    raise SystemExit(status_of(main))
