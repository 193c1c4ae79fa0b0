#!/usr/bin/env python3
"""Rock a block on its corners.

It is Housner's rigid block (1963) as the stiff limit of a finite element body.

A concrete block, 0.4 m wide and 2 m high, is tilted and let go; then it stands on a ground that
moves. Its contact is two points, the corners of its base. Housner had to assume the loss of energy
when the block changes from one corner to the other. Here it is a result of unilateral contact with
inelastic impulses and a little damping.

    bash demos/run.sh rocking_block         # into results/rocking_block
    bash demos/run.sh -n 2 rocking_block    # the same on two ranks

Units are SI; docs/guide/rocking_block.md explains the numbers.
"""

from __future__ import annotations

import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.histories import plot_certificate, plot_energy
from demos.parts.pictures.rocking import plot_pulses, plot_rocking
from demos.parts.problems import rocking_block as rocking
from vi_contact import fem
from vi_contact.cli import status_of
from vi_contact.exact import HousnerBlock

# Parameters
# --------------------------------------------------------------------------------------------------
SHAPE = HousnerBlock(width=0.4, height=2.0)  # [m]
CONCRETE = vc.LinearElastic(E=3.0e10, nu=0.0, rho=2400.0)  # [Pa, -, kg/m³]
BLOCK = rocking.RockingBlock(
    SHAPE, CONCRETE, damping=vc.Rayleigh(alpha=0.0, beta=3.0e-4), divisions=(2, 10)
)
RELEASE = 0.5  # angle of release over alpha = atan(b/h)
DURATION = 5.0  # of free rocking [s]
ONSET = (0.99, 1.01)  # peaks of the slow pulses over g b/h
STRENGTH = 1.5  # acceleration of the rectangular pulses over g b/h
LENGTHS = (0.98, 1.02)  # their durations over the shortest that overturns
IMPACTS = 6  # compared in the table
OUT = Path("results/rocking_block")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run free rocking and ground pulses (``quick``: two impacts, steps of 4 ms).

    It returns the key numbers.
    """
    comm = MPI.COMM_WORLD
    model = rocking.build(BLOCK, comm)
    # steps halved where a corner lands
    dt = model.time_steps(dt=4e-3) if quick else model.time_steps()
    numbers = free_rocking(model, dt, 1.5 if quick else DURATION, out, progress)
    numbers |= pulses(model, dt, out, progress)
    if comm.rank == 0:
        print(f"\nFigures, histories and ParaView files are in {out}.")
    return numbers


def run(
    problem: vc.ContactProblem,
    model: rocking.RockingModel,
    state: vc.State,
    dt: vc.HalvedAtImpact,
    t_end: float,
    out: Path,
    progress: bool,
) -> vc.Solution:
    """Make one run: impacts are inelastic impulses on the corners."""
    corners = {"left": (0.0, 0.0), "right": (SHAPE.width, 0.0), "top": (0.0, SHAPE.height)}
    return vc.simulate(
        problem,
        scheme=vc.MoreauJean(theta=0.5, e=0.0),
        solver=vc.Condensed(),
        dt=dt,
        t_end=t_end,
        state=state,
        record=(vc.Energy(), vc.Contact(), vc.Probe(corners), rocking.Rocking(model)),
        fields=fem.XDMF(every=20),
        out=out,
        progress=progress,
    )


def free_rocking(
    model: rocking.RockingModel, dt: vc.HalvedAtImpact, t_end: float, out: Path, progress: bool
) -> dict[str, float]:
    """Release the block from RELEASE alpha.

    It stands beside the rigid one, in Housner's kinematics and in small displacements.
    """
    theta0 = RELEASE * SHAPE.alpha
    solution = run(model.problem, model, model.tilted(theta0), dt, t_end, out / "free", progress)
    history = solution.history
    times, peaks = rocking.impacts(history)
    count = min(len(times), IMPACTS)
    housner, rigid = SHAPE.impact_times(theta0, count), BLOCK.impact_times(theta0, count)
    weight = BLOCK.mass * SHAPE.gravity
    potential = weight * 0.5 * SHAPE.width * theta0 * (1.0 - 0.5 * theta0 / BLOCK.overturning_angle)
    all_impacts = BLOCK.impact_times(theta0, 60)
    all_impacts = all_impacts[all_impacts < history["t"][-1]]
    if MPI.COMM_WORLD.rank == 0:
        print(f"\nFree rocking from {RELEASE} alpha\n{solution.summary()}")
        print(
            "\n  impact   time [s]   Housner   rigid, small   amplitude/alpha before it   Housner  "
            " rigid, small"
        )
        before = (
            SHAPE.amplitudes(theta0, count) / SHAPE.alpha,
            BLOCK.amplitudes(theta0, count) / SHAPE.alpha,
        )
        for n in range(count):
            print(
                f"  {n + 1:6d} {times[n]:10.4f} {housner[n]:9.4f} {rigid[n]:14.4f} "
                f"{peaks[n] / SHAPE.alpha:27.4f} "
                f"{before[0][n]:9.4f} {before[1][n]:14.4f}"
            )
        plot_rocking(
            history,
            out / "free_rocking.png",
            angle=BLOCK.overturning_angle,
            exact=BLOCK.motion(theta0, history["t"]),
            energy=potential * SHAPE.energy_ratio ** np.arange(len(all_impacts) + 1.0),
            impacts=all_impacts,
            title=f"Free rocking of a block {SHAPE.width:g} m x {SHAPE.height:g} m",
        )
        plot_energy(history, out / "energy.png")
        plot_certificate(history, out / "certificate.png")
    MPI.COMM_WORLD.Barrier()  # nobody leaves before the figures are there
    return {
        "certificate": solution.facts["worst_certificate"],
        "energy_defect": solution.facts["energy_defect"],
        "worst_time_error": float(np.max(np.abs(times[:count] / housner - 1.0))),
        "restitution": rocking.restitution(BLOCK, history, float(times[0])),
        "first_impact": float(times[0]),
    }


def pulses(
    model: rocking.RockingModel, dt: vc.HalvedAtImpact, out: Path, progress: bool
) -> dict[str, float]:
    """Return the shake by slow pulses and rectangular ones.

    The slow ones are around g b/h, the rectangular ones around the shortest that overturns.
    """
    unit = SHAPE.onset_acceleration
    shortest = SHAPE.overturning_time(STRENGTH * SHAPE.gravity * SHAPE.alpha)
    lifted = {}
    turned = {}
    numbers = {"onset": model.onset_acceleration}
    for share in ONSET:
        ramp = vc.Tabulated((0.0, 0.4, 0.8, 1.2), (0.0, share * unit, share * unit, 0.0))
        solution = run(
            model.shaken(ramp), model, model.rest, dt, 1.5, out / f"onset_{share:g}", progress
        )
        lifted[f"peak {share:g} g b/h"] = solution.history
        numbers[f"gap_{share:g}"] = float(np.max(solution.history["gap"]))
    for share in LENGTHS:
        pulse = vc.Rectangular(STRENGTH * unit, share * shortest)
        solution = run(
            model.shaken(pulse),
            model,
            model.rest,
            dt,
            1.5,
            out / f"overturning_{share:g}",
            progress,
        )
        turned[f"{share:g} of {shortest:.4f} s"] = solution.history
        numbers[f"last_angle_{share:g}"] = (
            float(abs(solution.history["theta"][-1])) / BLOCK.overturning_angle
        )
    if MPI.COMM_WORLD.rank == 0:
        print(
            f"\nGround pulses: rocking starts at {unit:.4f} m/s² (Housner), {numbers['onset']:.4f} "
            "m/s² (mesh);"
            f"\n  a rectangle of {STRENGTH:g} times that overturns from {shortest:.4f} s on "
            "(Housner)"
        )
        for share in ONSET:
            print(
                f"  slow pulse, {share:g} g b/h: largest gap {1e3 * numbers[f'gap_{share:g}']:.4f} "
                "mm"
            )
        for share in LENGTHS:
            angle = numbers[f"last_angle_{share:g}"]
            print(
                f"  rectangle of {share * shortest:.4f} s: rotation {angle:.2f} of the overturning "
                "angle at the end, "
                f"{'overturned' if angle > 1.0 else 'came back'}"
            )
        plot_pulses(lifted, turned, out / "pulses.png", angle=BLOCK.overturning_angle, unit=unit)
    MPI.COMM_WORLD.Barrier()
    return numbers


# Things to try: no damping (vc.NoDamping() for BLOCK): the vibration of one impact meets the next;
# a softer or stiffer block (E from 3e9 to 3e11); MoreauJean(theta=1.0), which damps the rocking
# itself; dt=1e-3 instead of model.time_steps(); vc.Trapezoidal() with NoDamping(), which loses no
# energy: the block hops; a real record, vc.GroundMotion(vc.read_record(file)); mpirun -n 3.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
