#!/usr/bin/env python3
"""Shake a channel buried in soil on bedrock by a harmonic earthquake.

See Figs. 6 to 9 of the boundary method.

The soil may let go of both walls and of the base of the channel, but not enter it. After a gravity
stage the same motion is run three times: sliding freely, with Coulomb friction, and bilateral, the
linear comparison. The first steps are solved twice, condensed to the contact points and on all
unknowns, and the two must agree to round-off.

    bash demos/run.sh channel                   # three runs with all figures, into results/channel
    bash demos/run.sh -n 3 channel              # the same on three ranks
    bash demos/run.sh channel --motion H,V --set friction.type=Coulomb --set friction.mu=0.5

The last command makes one run and its report. Units are SI; the case data and what the source
leaves open are explained in docs/guide/channel.md.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures import channel_interface as pictures
from demos.parts.pictures.channel import plot_beside, plot_layout, plot_moments
from demos.parts.pictures.channel_mesh import animate
from demos.parts.pictures.friction import plot_states
from demos.parts.pictures.histories import plot_energy, plot_excitation
from demos.parts.problems.channel import REFERENCE, Channel, build
from vi_contact import fem
from vi_contact.cli import main as command
from vi_contact.cli import status_of
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.plots.histories import History
from vi_contact.run.static import static_equilibrium

# Parameters
# --------------------------------------------------------------------------------------------------
# [m]
CHANNEL = Channel(
    ChannelMesh(width=24.0, depth=8.0, outer_width=4.0, height=3.0, wall=0.5, slab=0.5, size=0.5)
)
AMPLITUDE = 2.0  # of the bedrock's acceleration [m/s²], at 2 Hz
MU = 0.5
STEPS = 400
CHECKED = 40  # steps that both routes solve
FRAMES_EVERY = 2  # steps
TIMES = (1.35, 1.6, 1.875)  # of the snapshots [s]
FILM = (1.0, 2.0)  # [s]
OUT = Path("results/channel")
RUNS = {
    "sliding freely": {},
    f"Coulomb, mu = {MU:g}": {"friction": vc.Coulomb(MU)},
    "bilateral": {"bilateral": True},
}


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Make all runs (``quick``: 40 steps, 4 of them by both routes).

    It returns the key numbers in SI units.
    """
    comm = MPI.COMM_WORLD
    model = build(CHANNEL, comm)
    dt = CHANNEL.time_step()
    histories = {}
    numbers = {}
    for name, options in RUNS.items():
        problem = model.problem(excitation=CHANNEL.harmonic(AMPLITUDE), **options)
        # the channel's weight, contact active
        weighing = static_equilibrium(problem, solver=vc.Condensed())
        scheme = vc.ZienkiewiczWoodTaylor(phi=0.5)
        solution = vc.simulate(
            problem,
            scheme=scheme,
            dt=dt,
            steps=40 if quick else STEPS,
            state=weighing,
            record=model.recorders(),
            fields=fem.XDMF(every=FRAMES_EVERY),
            out=folder(out, name),
            progress=progress,
        )
        routes = vc.CrossChecked(vc.Condensed(), [REFERENCE])  # two routes to every step
        vc.simulate(
            problem,
            scheme=scheme,
            solver=routes,
            dt=dt,
            steps=4 if quick else CHECKED,
            state=weighing,
            progress=False,
        )
        histories[name] = solution.history
        found = key_numbers(solution.history) | {
            "certificate": solution.facts["worst_certificate"],
            "energy defect": solution.facts["energy_defect"],
            "cross-check": routes.worst,
        }
        numbers |= {f"{name}: {key}": value for key, value in found.items()}
        if comm.rank == 0:
            print(f"\n{name}\n{solution.summary()}")
            print("\n".join(f"  {key:<26} {value:.6g}" for key, value in found.items()))
    contact = model.surface.whole()
    if comm.rank == 0:
        draw(contact, histories, out, quick)
        print(
            f"\nFigures and the film are in {out}, histories and ParaView files in folders below "
            "it."
        )
    comm.Barrier()  # nobody leaves before the figures are there
    return numbers


def folder(out: Path, name: str) -> Path:
    """Return the folder of one run."""
    return out / name.split()[0].strip(",").lower()


def key_numbers(history: History) -> dict[str, float]:
    """Return openings, rocking and largest pressure.

    The openings are those of the walls' tops and feet; it says how often both walls' are open.
    """
    left = pictures.opening(history, "19", (-1.0, 0.0))
    right = pictures.opening(history, "13", (1.0, 0.0))
    u_1, u_7 = history["u_y_1"], history["u_y_7"]
    tiny = 1e-9 * max(left.max(), right.max())
    return {
        "opening left": float(history["opening_left"].max()),
        "opening right": float(history["opening_right"].max()),
        "both tops open": float(np.mean((left > tiny) & (right > tiny))) if tiny > 0.0 else 0.0,
        "settlement": float(u_1[0]),
        "u_y of point 1, min": float(u_1.min()),
        "u_y of point 1, max": float(u_1.max()),
        "correlation of 1 and 7": float(np.corrcoef(u_1, u_7)[0, 1]),
        "pressure": float(np.max(history["pressure"])),
    }


def draw(contact: vc.ContactSurface, runs: Mapping[str, History], out: Path, quick: bool) -> None:
    """Draw all figures and the film."""
    sliding, coulomb, bilateral = runs
    unilateral = {name: runs[name] for name in (sliding, coulomb)}
    outline = pictures.Outline.of(contact.points, contact.normals)
    points = {str(number): CHANNEL.point(number) for number in range(1, 20)}
    plot_layout(
        folder(out, sliding),
        points,
        out / "layout.png",
        title="The channel in its layer (compare Fig. 6)",
        soil=f"soil\n{summary(CHANNEL.soil)}",
        concrete=f"concrete\n{summary(CHANNEL.concrete)}",
        ends="ends of the layer\n$u_y$ = 0, $u_x$ free",
    )
    plot_excitation(runs[sliding], out / "excitation.png", title="Acceleration of the bedrock")
    pictures.plot_openings(
        runs[sliding], out / "openings.png", title="Openings of the interface (compare Fig. 7)"
    )
    pictures.plot_rocking(
        runs[sliding], out / "rocking.png", title="Bottom corners (compare Fig. 8)"
    )
    plot_beside(
        runs,
        bilateral,
        out / "beside.png",
        title="Unilateral and bilateral contact (compare Fig. 9)",
    )
    pictures.plot_interface(
        unilateral, outline, out / "interface.png", title="Interface between channel and soil"
    )
    pictures.plot_envelope(
        unilateral, outline, out / "envelope.png", title="Envelopes along the outline"
    )
    plot_states(
        runs[coulomb],
        out / "states.png",
        position=outline.places(),
        axis_label="arc length [m]",
        title=f"Interface, {coulomb}",
    )
    times, film = (TIMES, np.arange(*FILM, 0.025)) if not quick else ((0.4,), (0.2, 0.4))
    plot_moments(
        {name: folder(out, name) for name in unilateral},
        times,
        out / "moments.png",
        title="Channel and soil",
        magnified=500.0,
    )
    tops = {
        "top of the left wall": pictures.opening(runs[sliding], "19", (-1.0, 0.0)),
        "of the right wall": pictures.opening(runs[sliding], "13", (1.0, 0.0)),
    }
    animate(
        folder(out, sliding),
        out / "channel.gif",
        title=sliding,
        magnified=300.0,
        history=runs[sliding],
        times=film,
        openings=tops,
    )
    for name, history in () if quick else runs.items():
        plot_energy(history, folder(out, name) / "energy.png", title=f"Energy ledger, {name}")


def summary(material: vc.LinearElastic) -> str:
    """Return the numbers of a material on two lines."""
    size, unit = (1e9, "GPa") if material.E >= 1e9 else (1e6, "MPa")
    return (
        f"$E$ = {material.E / size:g} {unit}, $\\nu$ = {material.nu:g}\n$\\rho$ = "
        f"{material.rho:g} kg/m³"
    )


def command_line(words: Sequence[str]) -> int:
    """Run the built-in case with these options, and draw its report."""
    options = ArgumentParser(add_help=False, allow_abbrev=False)
    options.add_argument("--out", default=str(OUT))
    own, others = options.parse_known_args(words)
    status = command(["run", "channel", "--out", own.out, *others])
    return command(["report", own.out]) if status == 0 and MPI.COMM_WORLD.rank == 0 else status


# Things to try: weighing=("channel", "soil") in build(); sides=TiedSides(); vc.Coulomb(0.2); a
# finer mesh, size=0.25; a real earthquake with --motion; mpirun -n 3.
if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(command_line(sys.argv[1:]))
    raise SystemExit(status_of(main))
