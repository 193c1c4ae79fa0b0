"""``vi-contact beam``: the Timoshenko beam of seed 002 that rubs with its tip on a wall."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.checks import counted
from ..core.errors import InputError


def add_beam_command(commands: Any) -> None:
    """Adds ``beam`` to the commands of the top parser."""
    beam = commands.add_parser(
        "beam", help="a Timoshenko beam that rubs with its tip on a wall (seed 002)",
        description="The viscoelastic beam of seed 002, with friction at its tip. Without options: the source's data "
        "with reading C of its normal force. Writes history.csv and pictures.",
    )
    body = beam.add_argument_group("beam", "defaults: seed 002, length 5, EI = KAG = 100")
    for name, value, text in (
        ("length", 5.0, "[m]"), ("rho", 1.0, "density [kg/m3]"), ("area", 1.0, "[m2]"),
        ("inertia", 1.0, "second moment of area [m4]"), ("E", 100.0, "[Pa]"), ("G", 100.0, "[Pa]"),
        ("shear-factor", 1.0, "K [-]"), ("viscosity", 0.001, "a2 [s], default 0.001"),
    ):
        body.add_argument(f"--{name}", type=float, default=value, metavar="X", help=text)
    given = beam.add_argument_group("normal force")
    force = given.add_mutually_exclusive_group()
    force.add_argument("--reading", help="of the source's force: A, B, C or none (default C)")
    force.add_argument("--force", type=float, metavar="N", help="constant [N]")
    force.add_argument("--rod", type=float, metavar="F", help="that of the beam as a rod under F [N/m] along it")
    given.add_argument("--gap", type=float, default=0.05, help="between rod and wall [m], default 0.05")
    friction = beam.add_argument_group("friction")
    friction.add_argument("--mu", type=float, help="constant coefficient (default: slip rate/100, as the source)")
    friction.add_argument("--eps", type=float, default=0.002, help="regularisation [m per step], default 0.002")
    friction.add_argument("--exact", action="store_true", help="the inequality itself instead of the regularisation")
    numbers = beam.add_argument_group("discretisation")
    numbers.add_argument("--elements", type=int, default=1000, help="default 1000")
    numbers.add_argument("--free-end", action="store_true",
                         help="a tip that may turn and shear without locking, not the source's last rotation function")
    numbers.add_argument("--dt", type=float, default=0.002, help="time step [s], default 0.002")
    numbers.add_argument("--t-end", type=float, default=2.0, help="[s], default 2")
    beam.add_argument("--out", default="results/beam", metavar="DIR", help="output folder (default results/beam)")
    beam.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> str:
    from ..beam.algorithm import BeamStepper, run_beam
    from ..beam.elements import Elements
    from ..beam.source_data import published_elements, published_mu, published_start
    from ..beam.tip import ExactFriction, RegularisedFriction, TipFriction
    from ..beam.values import TimoshenkoBeam
    from ..core.algebra import SerialComm
    from ..run.files.folder import run_folder

    beam = TimoshenkoBeam(
        options.length, options.rho, options.area, options.inertia, options.E, options.G, options.shear_factor,
        options.viscosity,
    )
    counted("beam", f"--elements {options.elements}", options.elements, "elements", most=100_000)
    elements = Elements(options.elements) if options.free_end else published_elements(options.elements)
    law: TipFriction = ExactFriction() if options.exact else RegularisedFriction(options.eps)
    if not options.dt > 0.0 or not options.t_end >= options.dt:
        raise InputError(f"dt is {options.dt:g} s and t-end {options.t_end:g} s: give 0 < dt <= t-end")
    counted("beam", f"--t-end {options.t_end:g} at --dt {options.dt:g}", options.t_end / options.dt, "steps")
    steps = round(options.t_end / options.dt)
    mu = published_mu if options.mu is None else lambda t, rate: options.mu
    stepper = BeamStepper(beam, elements, options.dt, _force(options, elements, steps), mu, law)
    folder = run_folder(SerialComm(), options.out)
    run = run_beam(stepper, published_start(), steps=steps, every=max(1, steps // 100))
    run.save(folder / "history.csv")
    _pictures(run, folder)
    return f"Timoshenko beam with friction at its tip\n{run.summary()}\noutput: {folder}"


def _force(options: argparse.Namespace, elements: Any, steps: int) -> Any:
    """t -> |r_N|."""
    from ..beam.coupling import rod_forces
    from ..beam.source_data import readings
    from ..beam.values import Rod

    if options.force is not None:
        return lambda t: options.force
    if options.rod is not None:
        rod = Rod(options.length, options.rho, options.area, options.E, viscosity=options.viscosity, gap=options.gap,
                  body_force=lambda t: options.rod)
        return rod_forces(rod, elements, dt=options.dt, steps=steps)
    known, name = readings(options.dt), "C" if options.reading is None else options.reading
    if name not in known:
        raise InputError(f"unknown reading '{name}': choose one of {', '.join(known)}")
    return known[name]


def _pictures(run: Any, folder: Path) -> None:
    from ..plots.beam import plot_beam_energies, plot_shapes, plot_tips

    end = float(run.history["t"][-1])
    plot_beam_energies({"beam": run}, folder / "energy.png", title="Energy of the beam")
    plot_tips({"tip": run}, folder / "tip.png", title="Motion of the tip")
    plot_shapes(run, folder / "shapes.png", span=(0.0, end), title="The beam")
