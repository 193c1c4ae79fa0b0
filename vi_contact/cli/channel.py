"""``vi-contact channel``: options and what the command does."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from ..laws.materials import Damping, LinearElastic, NoDamping, Rayleigh
from .options import add_output, add_shaking, add_step, chosen, impact_law

_SHAPE = (  # option, default, meaning
    ("width", 24.0, "width of the soil layer"), ("depth", 8.0, "depth of the soil layer"),
    ("outer-width", 4.0, "outer width of the channel"), ("height", 3.0, "outer height of the channel"),
    ("wall", 0.5, "thickness of the walls"), ("slab", 0.5, "thickness of the slab"),
    ("size", 0.5, "element size, everywhere or at the channel"), ("far", None, "element size at the ends: irregular"),
)  # fmt: skip


def add_channel_commands(commands: Any) -> None:
    """Adds ``channel`` to the commands of the top parser."""
    channel = commands.add_parser(
        "channel",
        help="a channel buried in soil on bedrock, shaken (seed 000, Figs. 6-9)",
        description="A channel in a soil layer on bedrock, in unilateral contact with the soil on both walls and the "
        "base. A gravity stage comes first. Without --motion a harmonic of 2 m/s2 and 2 Hz shakes the bedrock for 400 "
        "steps.",
    )
    add_channel_arguments(channel)
    channel.set_defaults(run=_channel)


def add_channel_arguments(channel: argparse.ArgumentParser) -> None:
    """The options of ``vi-contact channel``."""
    contact = channel.add_argument_group("contact and ground")
    contact.add_argument("--contact", default="sliding", help="sliding (default), coulomb (with --mu), bilateral")
    contact.add_argument("--mu", type=float, help="friction coefficient of --contact coulomb")
    contact.add_argument("--gravity", default="channel", help="what weighs: channel (default), all, none")
    contact.add_argument(
        "--sides", help="ends of the soil: rollers (u_y = 0; default), tied (default with --vertical), "
        "free-field, dashpots, vertical-rollers (u_x = 0), fixed"
    )
    contact.add_argument(
        "--base", default="relative",
        help="relative (default): inertia load in the frame of the bedrock; prescribed: the bedrock is moved; both "
        "expect the motion under the layer. compliant: the motion is that of an outcrop, half its velocity comes up",
    )
    contact.add_argument(
        "--rock", type=float, nargs=3, metavar=("E", "NU", "RHO"), help="under a compliant base (default: the soil's)"
    )
    contact.add_argument(
        "--damping", type=float, nargs=3, metavar=("XI", "F1", "F2"),
        help="Rayleigh damping of soil and channel: ratio XI at the frequencies F1 and F2 [Hz] (default none)",
    )
    add_shaking(channel, harmonic="2 m/s2")
    add_step(channel, dt="1/80")
    mesh = channel.add_argument_group("geometry and mesh")
    for name, default, meaning in _SHAPE:
        text = f"{meaning} [m]" + ("" if default is None else f" (default {default:g})")
        mesh.add_argument(f"--{name}", type=float, default=default, metavar="M", help=text)
    mesh.add_argument("--triangles", action="store_true", help="triangles instead of quadrilaterals")
    add_output(channel, out="results/channel")


def _damping(given: Sequence[float] | None) -> Damping:
    if given is None:
        return NoDamping()
    xi, f1, f2 = given
    return Rayleigh.from_frequencies(f1, f2, xi1=xi, xi2=xi)


def _channel(options: argparse.Namespace) -> str:
    from mpi4py import MPI

    from ..meshes.channel import ChannelMesh
    from ..models.channel.model import Channel
    from ..models.channel.run import CONTACTS, ChannelRun, run_channel
    from ..plots.channel_run import illustrate

    lengths = {name.replace("-", "_"): getattr(options, name.replace("-", "_")) for name, _, _ in _SHAPE}
    run = ChannelRun(
        contact=options.contact,
        mu=options.mu,
        channel=Channel(ChannelMesh(triangles=options.triangles, **lengths), damping=_damping(options.damping)),
        base=options.base,
        rock=LinearElastic(*options.rock) if options.rock else None,
        sides=options.sides,
        gravity=options.gravity,
        impact=impact_law(options.impact, projection=options.impact is not None),
        **chosen(options),
    )
    solution = run_channel(run, MPI.COMM_WORLD, options.out, progress=not options.quiet)
    if MPI.COMM_WORLD.rank != 0:
        return ""
    illustrate(options.out, title=CONTACTS[run.contact])
    return f"Channel, {options.contact}\n{solution.summary()}\noutput: {options.out}"
