"""``vi-contact layer``: a particle that hits a wall through a boundary layer (seed 001)."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from .options import output_file

_METRICS = ("dominant", "full", "blended", "flat")


def add_layer_command(commands: Any) -> None:
    """Adds ``layer`` to the commands of the top parser."""
    layer = commands.add_parser(
        "layer", help="a particle hits a wall through a boundary layer (seed 001)",
        description="Restitution, duration and greatest compression of a particle in the boundary layer of seed 001, "
        "for every pair of k and c, or for a wanted restitution. Without options: seed 001's unit values.",
    )
    body = layer.add_argument_group("particle")
    body.add_argument("--mass", type=float, default=1.0, metavar="M", help="[kg], default 1")
    body.add_argument("--speed", type=float, default=1.0, metavar="V", help="on entering the layer [m/s], default 1")
    law = layer.add_argument_group("layer")
    law.add_argument("--width", type=float, default=1.0, metavar="B", help="b [m], default 1")
    law.add_argument("--start", type=float, metavar="A", help="a [m], where the force is complete (default b)")
    law.add_argument("--k", type=float, nargs="+", default=[1.0], metavar="K", help="spring-like [N/m], default 1")
    law.add_argument("--c", type=float, nargs="+", default=[0.0, 1.0], metavar="C", help="damper-like [N], default 0 1")
    law.add_argument("--law-speed", type=float, metavar="V", help="V of the law [m/s] (default the particle's)")
    law.add_argument("--restitution", type=float, metavar="E", help="find k and c instead; a = b, dominant terms")
    law.add_argument("--deepest", type=float, default=0.5, metavar="X", help="with it: x_min/b, default 0.5")
    law.add_argument("--metric", default="dominant", help="dominant (closed form, default), full, blended, flat")
    layer.add_argument("--out", metavar="PNG", help="picture of distance and velocity (dominant terms, a = b)")
    layer.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> str:
    from ..boundary_layer.layer import Layer
    from ..boundary_layer.particle import ParticleImpact, layer_for

    if options.metric not in _METRICS:
        raise InputError(f"unknown metric '{options.metric}': give {', '.join(_METRICS)}")
    if options.out:
        output_file(options.out, picture=True, made=True)
    closed = options.metric == "dominant" and options.start in (None, options.width)
    if not closed and (options.restitution is not None or options.out):
        raise InputError("--restitution and --out are for the closed form: leave --metric and --start away")
    if options.restitution is not None:
        wanted = {"mass": options.mass, "speed": options.speed, "width": options.width, "deepest": options.deepest}
        layers = [layer_for(options.restitution, **wanted)]
    else:
        layers = [Layer(options.width, k=k, c=c, speed=options.law_speed, start=options.start)
                  for k in options.k for c in options.c]
    impacts = [ParticleImpact(layer, options.mass, options.speed) for layer in layers]
    lines = [f"{'k [N/m]':>12} {'c [N]':>12} {'e':>9} {'e_p':>9} {'t_c [s]':>12} {'t_f [s]':>12} {'x_min [m]':>12}"]
    for impact in impacts:
        values = _closed(impact) if closed else _integrated(impact, options.metric)
        shown = "".join(f" {value:12.6g}" for value in values[2:])
        lines.append(f"{impact.layer.k:12.6g} {impact.layer.c:12.6g} {values[0]:9.6f} {values[1]:9.6f}{shown}")
    lines.append("e: Newton's; e_p: Poisson's with the boundary force; t_c, t_f: end of compression, of contact")
    if options.out:
        lines.append(f"figure: {_draw(impacts, Path(options.out))}")
    return "\n".join(lines)


def _closed(impact: Any) -> tuple[float, ...]:
    return impact.restitution, impact.poisson_covector, impact.compression_time, impact.duration, impact.deepest


def _integrated(impact: Any, metric: str) -> tuple[float, ...]:
    """The same in any reading, from x = b, by integration in time."""
    import numpy as np
    from scipy.integrate import cumulative_trapezoid

    from ..boundary_layer.metric import Metric
    from ..boundary_layer.motion import ConstrainedSystem
    from ..boundary_layer.trajectory import layer_motion

    layer = impact.layer
    body = ConstrainedSystem(np.array([[impact.mass]]), lambda q: float(q[0]), lambda q: np.ones(1))
    motion = layer_motion(
        body, layer, q0=np.array([layer.width]), v0=np.array([-impact.speed]), t_end=1e6 * layer.width / impact.speed,
        metric=Metric(metric), contacts=1, refine=100,
    )
    if not motion.contacts:
        raise InputError("the particle does not come back in 1e6 b/V: give the layer more k or less c")
    contact = motion.contacts[0]
    force = layer.at(impact.speed).force(motion.rho, motion.v[:, 0])
    impulse = cumulative_trapezoid(force, motion.t, initial=0.0)
    pushed = float(np.interp(contact.turned, motion.t, impulse))
    poisson = (float(impulse[-1]) - pushed) / pushed
    return contact.restitution, poisson, contact.turned - contact.start, contact.duration, contact.deepest


def _draw(impacts: list[Any], path: Path) -> Path:
    from ..plots.layer import plot_particle

    path.parent.mkdir(parents=True, exist_ok=True)
    groups: dict[str, list[tuple[str, Any]]] = {}
    for impact in impacts:
        groups.setdefault(f"k = {impact.layer.k:.4g} N/m", []).append((f"c = {impact.layer.c:.4g} N", impact))
    return plot_particle(groups, path)
