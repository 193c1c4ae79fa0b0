#!/usr/bin/env python3
"""Rub a viscoelastic Timoshenko beam on a wall with its tip.

It is that of Ahn (2012), with what that scheme leaves out.

First come the runs of the source with their figures 8.1 to 8.9. Their normal force is given,
friction is regularised, and Newton's method solves a scalar equation in each step. Then the
friction inequality itself stands beside them. In the last run the beam is also a rod that is pulled
against the wall. Its computed contact force drives the friction, and the tip slips, sticks, lifts
off and touches again.

    bash demos/run.sh timoshenko_beam       # into results/timoshenko_beam

Units are SI with the source's dimensionless data; docs/theory/beam.md explains the numbers. One
process is enough.
"""

from __future__ import annotations

import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np

import vi_contact as vc
from demos.parts.pictures.beam import (
    plot_beam_energies,
    plot_regularisation,
    plot_rubbing,
    plot_shapes,
    plot_tips,
)
from vi_contact import beam
from vi_contact.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
VISCOSITIES = (0.001, 2.0)  # a2 of the source [s]: almost elastic, strongly damped
READING = "C"  # of the normal force that is drawn; the table has all of them
SPANS = ((0.0, 0.6), (0.6, 1.5), (1.5, 2.0))  # of Figs. 8.4 to 8.9 [s]
ELEMENTS = 1000
DT = 0.002
T_END = 2.0
MU, FORCE = 0.3, 100.0  # [-], [N] of the comparison of friction laws
EPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # [m]
# pulled to the wall for 1.5 s
ROD = beam.Rod(viscosity=0.002, gap=0.05, body_force=lambda t: 20.0 * (t < 1.5))
OUT = Path("results/timoshenko_beam")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all three parts (``quick``: 50 elements, steps of 10 ms); return the key numbers."""
    out.mkdir(parents=True, exist_ok=True)
    count, dt = (50, 0.01) if quick else (ELEMENTS, DT)
    numbers = published(count, dt, out)
    numbers |= exact(50 if quick else 200, dt, out)
    numbers |= rubbing(50 if quick else 200, dt, out, progress)
    print(f"\nFigures and histories are in {out}.")
    return numbers


def published(count: int, dt: float, out: Path) -> dict[str, float]:
    """Run the source's beam under every reading of its normal force.

    Figs. 8.1 to 8.9 are drawn with READING.
    """
    steps = round(T_END / dt)
    forces = beam.readings(dt)
    numbers, drawn = {}, {}
    print(
        f"\nThe source's beam, m = {count}, dt = {dt:g} s, E(0) and what is left of it at t = "
        f"{T_END:g} s [J]"
    )
    print(
        "  a2 [s]  reading   E(0)     E(end)   lost to friction, viscosity   tip(1), tip(end) [m]  "
        " updates   ledger"
    )
    for viscosity in VISCOSITIES:
        for name, force in forces.items():
            stepper = beam.BeamStepper(
                beam.TimoshenkoBeam(viscosity=viscosity),
                beam.published_elements(count),
                dt,
                normal_force=force,
                mu=beam.published_mu,
                friction=beam.RegularisedFriction(0.002, absolute=1e-10),
            )
            run = beam.run_beam(
                stepper, beam.published_start(), steps=steps, every=max(1, round(0.02 / dt))
            )
            history, energy = run.history, run.energy
            defect = float(np.max(np.abs(history["energy_defect"])))
            tip = history["u_tip"]
            lost = (history["loss_friction"][-1], history["loss_damping"][-1])
            print(
                f"  {viscosity:6g}  {name:7s} {energy[0]:8.4f} {energy[-1]:8.4f} {lost[0]:14.4f} "
                f"{lost[1]:13.4f} "
                f"{tip[steps // 2]:13.5f} {tip[-1]:9.5f} {run.mean_updates:11.3f} {defect:9.1e}"
            )
            key = f"a2 {viscosity:g} {name}"
            numbers |= {
                f"{key}: energy": energy[-1],
                f"{key}: defect": defect,
                f"{key}: largest rise": float(np.max(np.diff(energy))),
            }
            if name == READING:
                drawn[viscosity] = run
                run.save(out / f"history_a2_{viscosity:g}.csv")
    labels = {f"a2 = {viscosity:g} s": run for viscosity, run in drawn.items()}
    plot_beam_energies(
        labels, out / "fig_8_1_energy.png", title=f"Fig. 8.1: energy, reading {READING}"
    )
    for number, (label, run) in enumerate(labels.items(), start=2):
        plot_tips(
            {label: run},
            out / f"fig_8_{number}_tip.png",
            title=f"Fig. 8.{number}: motion of the tip",
        )
    for number, (viscosity, span) in enumerate(
        ((a, span) for a in drawn for span in SPANS), start=4
    ):
        title = f"Fig. 8.{number}: t = {span[0]:g} to {span[1]:g} s, a2 = {viscosity:g} s"
        plot_shapes(drawn[viscosity], out / f"fig_8_{number}_shapes.png", span=span, title=title)
    return numbers


def exact(count: int, dt: float, out: Path) -> dict[str, float]:
    """Run constant force and coefficient.

    The inequality is solved by Algorithm 10 and by the contract, and eps -> 0.
    """
    body = beam.TimoshenkoBeam(viscosity=VISCOSITIES[0])
    elements = beam.Elements(count)
    start = beam.published_start()
    steps = round(T_END / dt)

    def algorithm(friction: beam.TipFriction) -> beam.BeamRun:
        stepper = beam.BeamStepper(
            body, elements, dt, lambda t: FORCE, lambda t, rate: MU, friction
        )
        return beam.run_beam(stepper, start, steps=steps)

    law = algorithm(beam.ExactFriction()).history
    problem = beam.beam_problem(
        body, elements, normal_force=lambda t: FORCE, friction=vc.Coulomb(MU), start=start
    )
    tips = np.array(
        [state.u[-1] for state, _ in vc.march(problem, scheme=vc.Midpoint(), dt=dt, steps=steps)]
    )
    apart = float(np.max(np.abs(tips - law["u_tip"][1:])))
    runs = {eps: algorithm(beam.RegularisedFriction(eps)).history for eps in EPS}
    errors = np.array([np.max(np.abs(run["u_tip"] - law["u_tip"])) for run in runs.values()])
    stuck = int(np.sum(law["slip"][1:] == 0.0))
    print(
        "\n"
        f"The friction inequality, mu = {MU:g}, r_n = {FORCE:g} N: {stuck} of {steps} steps stick; "
        f"two routes differ by {apart:.1e} m"
    )
    for eps, error in zip(EPS, errors, strict=True):
        print(f"  eps = {eps:g} m: the tip differs by {error:.2e} m")
    shown = {f"eps = {eps:g} m": (run["t"], run["u_tip"]) for eps, run in list(runs.items())[:3]}
    shown["inequality"] = (law["t"], law["u_tip"])
    plot_regularisation(EPS, {"tip": errors}, shown, out / "regularisation.png")
    return {"routes apart": apart, "order in eps": float(np.log10(errors[-2] / errors[-1]))}


def rubbing(count: int, dt: float, out: Path, progress: bool) -> dict[str, float]:
    """Run rod and beam as one contact problem, with impulses on velocities.

    Their forces do not ring.
    """
    problem = beam.rubbing_problem(
        ROD,
        beam.TimoshenkoBeam(viscosity=VISCOSITIES[0]),
        beam.Elements(count),
        friction=vc.Coulomb(MU),
        start=beam.published_start(),
    )
    solution = vc.simulate(
        problem,
        scheme=vc.MoreauJean(),
        dt=dt,
        t_end=3.0,
        out=out / "rod_and_beam",
        progress=progress,
        record=(vc.Energy(), vc.Contact(), vc.Probe({"tip": (5.0, 0.0)})),
    )
    print(f"\nRod and beam\n{solution.summary()}")
    plot_rubbing(
        solution.history,
        out / "rod_and_beam.png",
        mu=MU,
        gap=ROD.gap,
        title="The rod drives the friction",
    )
    return {
        "rubbing certificate": solution.facts["worst_certificate"],
        "rubbing defect": solution.facts["energy_defect"],
        "friction loss": float(solution.history["loss_friction"][-1]),
    }


# Things to try: READING = "A"; beam.Elements(ELEMENTS) instead of beam.published_elements, a tip
# that may turn (the source's last rotation function holds it: docs/theory/beam.md); eps = 2e-4 in
# published(); mu that falls with the rate, vc.SlipRateCoulomb(vc.ExponentialDecay(0.4, 0.2, 0.5)),
# in rubbing(); scheme=vc.Midpoint() there, whose contact forces ring; body_force=lambda t: 20.0 +
# 10.0 * np.sin(8.0 * t) for ROD.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
