#!/usr/bin/env python3
"""Let an elastic bar bounce on a rigid wall.

Every time scheme is compared with the exact solution in one figure.

The bar is clamped at its top and released from a compressed state; its foot strikes the wall at t =
1, 4, 7 and so on, for one unit of time each, under a constant force. Its energy is constant. Time
schemes differ in how much the contact force oscillates, and in whether the energy grows, stays or
falls.

    bash demos/run.sh bouncing_bar          # the figures and a table, into results/bouncing_bar
    bash demos/run.sh -n 2 bouncing_bar     # the same on two ranks

The bar has E = rho = length = 1 (SI).
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.bars import plot_bounces
from demos.parts.problems.bar import Bar, build
from vi_contact.cli import status_of
from vi_contact.exact import PeriodicBar

# Parameters
# --------------------------------------------------------------------------------------------------
BAR = Bar(PeriodicBar(), elements=100, dimension=1)  # dimension=2: a strip of 3 elements across
COURANT = 0.5  # dt c / h
BOUNCES = 4
SCHEMES = {  # name -> (scheme, mass matrix; None: the scheme's own choice)
    "trapezoidal, redistributed mass (default)": (vc.Trapezoidal(), None),
    "HHT(-0.1), redistributed mass": (vc.HHT(-0.1), None),
    "generalised-alpha(0.8), redistributed mass": (vc.GeneralisedAlpha.spectral_radius(0.8), None),
    "Houbolt, redistributed mass": (vc.Houbolt(), None),
    "contact-stabilised Newmark": (vc.ContactStabilisedNewmark(), None),
    "Moreau-Jean, e = 0": (vc.MoreauJean(), None),
    "Moreau-Jean, e = 1": (vc.MoreauJean(e=1.0), None),
    "midpoint (= Zienkiewicz-Wood-Taylor)": (vc.Midpoint(), None),
    "Newmark, consistent mass: do not use": (vc.Newmark(), vc.ConsistentMass()),
}
OUT = Path("results/bouncing_bar")


def main(quick: bool = False, out: Path = OUT, progress: bool = True) -> dict[str, float]:
    """Run all schemes (``quick``: one bounce, 40 elements).

    It returns energies and forces over the exact ones.
    """
    comm = MPI.COMM_WORLD
    bar = replace(BAR, elements=40) if quick else BAR
    model = build(bar, comm)
    dt = bar.time_step(COURANT)
    steps = round((1 if quick else BOUNCES) * bar.case.period / dt)
    histories, numbers = {}, {}
    for name, (scheme, mass) in SCHEMES.items():
        solution = vc.simulate(
            model.problem(mass=mass),
            scheme=scheme,
            dt=dt,
            steps=steps,
            record=(vc.Energy(), vc.Contact(), vc.Probe(model.probes())),
            out=out / name.split(":")[0].replace(",", "").replace(" ", "_"),
            progress=progress,
        )
        history = solution.history
        histories[name] = history
        energy = history["energy_kinetic"] + history["energy_strain"]
        numbers[f"{name}: energy at the end"] = energy[-1] / bar.case.energy / bar.section
        numbers[f"{name}: largest energy"] = energy.max() / bar.case.energy / bar.section
        numbers[f"{name}: largest force"] = history["contact_resultant"].max() / 0.5 / bar.section
        numbers[f"{name}: certificate"] = solution.facts["worst_certificate"]
        numbers[f"{name}: ledger defect"] = solution.facts["energy_defect"]
    if comm.rank == 0:
        plot_bounces(histories, bar.case, bar.section, out / "bouncing_bar.png")
        print(table(numbers))
        print(f"\nFigure and histories are in {out}.")
    comm.Barrier()
    return numbers


def table(numbers: dict[str, float]) -> str:
    """Return the energies and forces over their exact values."""
    lines = [f"{'scheme':<44} {'energy at the end':>18} {'largest':>9} {'largest force':>14}"]
    for name in SCHEMES:
        row = [
            numbers[f"{name}: {what}"]
            for what in ("energy at the end", "largest energy", "largest force")
        ]
        lines.append(f"{name:<44} {row[0]:>18.4f} {row[1]:>9.4f} {row[2]:>14.2f}")
    return "\n".join(lines)


# Things to try: dimension=2 or 3 in BAR; ThrownBar() or BouncingBar() of vi_contact.exact as its
# case; COURANT = 4: the default gains a little there and HHT does not; dt=vc.HalvedAtImpact(dt);
# impact=vc.Inelastic() with consistent mass.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
