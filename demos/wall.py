#!/usr/bin/env python3
"""Shake a wall beside the ground by a harmonic earthquake.

See Figs. 1 to 5 of the boundary method for dynamic contact.

A concrete wall, 9 m high, is clamped at its base; on its right side it may lift off the ground but
not enter it. Every step is solved twice, condensed to the contact points and on all unknowns, and
the two must agree to round-off.

    bash demos/run.sh wall                      # all figures, in results/wall and its folders a, b
    bash demos/run.sh -n 3 wall                 # the same on three ranks
    bash demos/run.sh wall --case a --motion FILE --scale 2

The last command makes one run as "vi-contact run wall", and its report. Units are SI; the case data
and what the source leaves open are explained in docs/start/first_wall.md.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.histories import draw_histories
from demos.parts.pictures.runs import plot_runs
from demos.parts.pictures.wall import plot_data, plot_decomposition, plot_frames
from demos.parts.problems import wall as wall_model
from demos.parts.problems.decomposition import split
from vi_contact import fem
from vi_contact.practice.cli import main as command
from vi_contact.practice.cli import status_of
from vi_contact.solvers.volume.route import Volume
from vi_contact.solvers.volume.snes import ReducedNewton

# Parameters
# --------------------------------------------------------------------------------------------------
WALL = wall_model.Wall(height=9.0, width=6.0, thickness=0.20, divisions=(8, 12))  # [m]
CASES = {
    "a": "Fig. 4: three possible contact points",
    "b": "Fig. 5: eleven possible contact points",
}
AMPLITUDE = 1.0  # of the ground acceleration [m/s²]
STEPS = 400
REFINED = 16  # the comparison of schemes divides the seed's dt by this
FRAMES_EVERY = 10  # steps between ParaView frames
# steps of case b at which the wall is drawn: away from the ground, and against it
INSTANTS = (10, 30)
OUT = Path("results/wall")
BUILT_IN = {  # case -> settings of the case that ships with the package, which is case b
    "a": ["contact.points=[[6.0, 3.0], [6.0, 5.25], [6.0, 7.5]]"],
    "b": [],
    "face": ["contact.points="],
    "bilateral": ["contact.roller=true"],
    "free": ["contact="],
}


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all cases (``quick``: 40 steps); return the key numbers, displacements in metres."""
    comm = MPI.COMM_WORLD
    # as the reference numbers of the figures
    model = wall_model.build(WALL, comm, base_inertia="catalogue")
    shaking = model.harmonic(AMPLITUDE)
    dt = model.time_step()
    steps = 40 if quick else STEPS
    numbers = {"frequency": shaking.frequency, "dt": dt}

    # the linear wall, to compare with
    linear = vc.simulate(
        model.problem("free", excitation=shaking),
        scheme=vc.ZienkiewiczWoodTaylor(phi=0.5),
        solver=vc.Condensed(),
        dt=dt,
        steps=steps,
        record=(vc.Probe(model.probes()),),
        progress=False,
    )

    for case, title in CASES.items():
        problem = model.problem(case, excitation=shaking, impact=vc.Inelastic())
        # two routes to every step
        routes = vc.CrossChecked(vc.Condensed(), [Volume(method=ReducedNewton())])
        solution = vc.simulate(
            problem,
            scheme=vc.ZienkiewiczWoodTaylor(phi=0.5),
            solver=routes,
            dt=dt,
            steps=steps,
            record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
            fields=fem.XDMF(every=FRAMES_EVERY),
            cross_check=routes,
            out=out / case,
            progress=progress,
        )
        top = solution.history["u_x_12"]
        numbers |= {
            f"{case}_top_min": top.min(),
            f"{case}_top_max": top.max(),
            f"{case}_cross_check": routes.worst,
            f"{case}_certificate": solution.facts["worst_certificate"],
            f"{case}_energy_defect": solution.facts["energy_defect"],
        }
        contact = problem.surface.whole()
        if comm.rank == 0:
            print(f"\nCase {case}. {title}\n{solution.summary()}")
            draw_histories(
                solution.history,
                contact,
                out / case,
                title=title,
                reference=linear.history,
                unilateral=[str(number) for number in wall_model.CASES[case]],
            )
        comm.Barrier()  # nobody leaves before the figures are there
    if comm.rank == 0:
        numbers["magnified"] = plot_frames(
            out / "b", WALL, [dt * k for k in INSTANTS], out / "frames.png"
        )
        print(f"\nframes.png: displacements are drawn {numbers['magnified']:g} times larger")
    numbers["decomposition"] = draw_step(model, steps, out)
    for case in CASES:
        compare_schemes(model, case, steps, 2 if quick else REFINED, out / f"schemes_{case}.png")
    if comm.rank == 0:
        print(f"\nFigures, histories and ParaView files are in {out}, {out}/a and {out}/b.")
    return numbers


def draw_step(model: wall_model.WallModel, steps: int, out: Path) -> float:
    """Draw Fig. 2, the wall and its points, and Fig. 1.

    The latter is the step of case b that presses most, drawn as a structure with its loads and one
    with its reactions; it returns by how much their sum misses the answer of the step, relatively.
    """
    problem = model.problem("b", excitation=model.harmonic(AMPLITUDE))
    most = -1.0
    pressed = None
    scheme = vc.ZienkiewiczWoodTaylor(phi=0.5)
    dt = model.time_step()
    for state, report in vc.march(
        problem, scheme=scheme, solver=vc.Condensed(), dt=dt, steps=steps
    ):
        force = float(problem.surface.everywhere(state.r_n).sum())
        if force > most:
            most, pressed = force, report
    found = split(problem, pressed) if pressed is not None else None
    if found is not None:
        plot_data(model.wall, {case: wall_model.CASES[case] for case in CASES}, out / "data.png")
        plot_decomposition(found, model.wall, out / "decomposition.png")
    return MPI.COMM_WORLD.bcast(None if found is None else found.defect)


def compare_schemes(
    model: wall_model.WallModel, case: str, steps: int, refined: int, figure: Path
) -> None:
    """Run the source's scheme and impact rule beside the default scheme.

    The latter needs no rule and does not ring.
    """
    runs = {}
    for name, impact, finer in (
        ("source's rule, its dt", vc.Inelastic(), 1),
        (f"source's rule, dt/{refined}", vc.Inelastic(), refined),
        # no impact law, no scheme: trapezoidal, massless
        (f"default scheme, dt/{refined}", None, refined),
    ):
        problem = model.problem(case, excitation=model.harmonic(AMPLITUDE), impact=impact)
        runs[name] = vc.simulate(
            problem,
            dt=model.time_step() / finer,
            steps=steps * finer,
            progress=False,
            record=(vc.Energy(), vc.Contact(), vc.Probe({"12": WALL.point(12)})),
        ).history
        runs[name] = {
            **runs[name],
            "energy": runs[name]["energy_kinetic"] + runs[name]["energy_strain"],
        }
    if MPI.COMM_WORLD.rank == 0:
        quantities = (
            ("u_x_12", "u of the top", "m"),
            ("contact_resultant", "contact force", "N"),
            ("energy", "energy", "J"),
        )
        plot_runs(
            runs,
            quantities,
            figure,
            title=f"Wall, case {case}: the source's rule and the default scheme",
        )
    MPI.COMM_WORLD.Barrier()


def command_line(words: Sequence[str]) -> int:
    """Run the built-in case and draw its report.

    Both routes take every step; without --case, these are cases a and b.
    """
    options = ArgumentParser(add_help=False, allow_abbrev=False)
    options.add_argument("--case", choices=BUILT_IN)
    options.add_argument("--out", default=str(OUT))
    own, others = options.parse_known_args(words)
    runs = {own.case: own.out} if own.case else {case: f"{own.out}/{case}" for case in CASES}
    for case, folder in runs.items():
        settings = [word for setting in BUILT_IN[case] for word in ("--set", setting)]
        status = command(["run", "wall", "--cross-check", *settings, "--out", folder, *others])
        if status == 0 and MPI.COMM_WORLD.rank == 0:
            status = command(["report", folder])
        if status:
            return status
    return 0


# Things to try: bilateral instead of unilateral contact (case "bilateral"); impact=vc.Elastic(); a
# finer mesh, Wall(divisions=(32, 48)); triangles; a real earthquake with --motion; mpirun -n 3.
if __name__ == "__main__":
    if len(sys.argv) > 1:
        raise SystemExit(command_line(sys.argv[1:]))
    raise SystemExit(status_of(main))
