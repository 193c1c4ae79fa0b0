"""Write the rows of damping, periods, time steps and waves, and of the sides of a model."""

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

from ....units.report_units import write_number
from .pen import Model, Pen, Row, list_objects, say

_LONG_NUMBER = re.compile(r"(?<!\d)\d{1,20}\.\d{5,}(?:e-?\d{1,3})?")  # as a program writes one


def _shorten_numbers(text: str) -> str:
    """Return a text of a program with the digits of a report."""
    return _LONG_NUMBER.sub(lambda found: write_number(float(found[0])), text)


def list_damping(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the law, its coefficients, and the damping ratio of each of the first modes."""
    if "damping" in model:
        # the ratios of the modes stand beside the periods below
        sources = [text for text in str(model["damping"]).split("; ") if " at T1 = " not in text]
        yield say("law", _shorten_numbers("; ".join(sources)))
    periods = model.get("periods") or []
    ratios = model.get("damping_ratios") or []
    for number, period in enumerate(periods, start=1):
        share = ""
        if number <= len(ratios):
            ratio = ratios[number - 1]
            share = f"damping {write_number(100.0 * ratio)} %" if ratio else "no damping"
        yield pen.row(f"natural period T{number}, contact closed", period, "s", share)
    for period in model.get("periods_open") or []:
        yield pen.row("natural period T1, contact open", period, "s")
    if "rigid_motions" in model:
        yield say("rigid motions that are left", model["rigid_motions"])
    alike: dict[tuple[Any, Any], list[str]] = {}
    for body in list_objects(model, "bodies"):
        factors = (tuple(body.get("alpha") or (0.0,)), tuple(body.get("beta") or (0.0,)))
        alike.setdefault(factors, []).append(str(body.get("name")))
    for (alpha, beta), names in alike.items():
        if any(alpha) or any(beta):
            yield from _list_rayleigh(", ".join(names), (alpha, beta), periods, pen)


def _list_rayleigh(
    name: str,
    factors: tuple[Sequence[float], Sequence[float]],
    periods: Sequence[float],
    pen: Pen,
) -> Iterator[Row]:
    """Yield alpha and beta of C = alpha M + beta K, and the ratios that they give at T1 and T2.

    Args:
        name: of the bodies.
        factors: least and largest alpha [1/s], and the like of beta [s].
        periods: natural ones [s].
        pen: writes.
    """
    alpha, beta = factors
    yield pen.row_of_range(f"{name}: alpha of the mass", alpha, "1/s")
    yield pen.row_of_range(f"{name}: beta of the stiffness", beta, "s")
    for number, period in enumerate(periods[:2], start=1):
        # xi = alpha / (2 w) + beta w / 2 with w = 2 pi / T
        w = 2.0 * math.pi / period
        ratios = []
        for mass, stiffness in zip(alpha, beta, strict=True):
            ratios.append(100.0 * (mass / (2.0 * w) + stiffness * w / 2.0))
        yield pen.row_of_range(f"{name}: damping ratio at T{number} by alpha and beta", ratios, "%")


def list_steps(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield the steps of the run, its method, and what waves the mesh carries."""
    run = model.get("run") or {}
    if run:
        remark = f"{run['steps']} steps until {write_number(run['t_end'])} s"
        yield pen.row("time step", run["dt"], "s", remark)
    method = model.get("method") or {}
    for name, text in method.items():
        kinds = [solver.partition("(")[0] for solver in str(text).split(", then ")]
        is_plain = name == "solver" or str(text).endswith("()")
        remark = "" if is_plain else _shorten_numbers(str(text))
        yield say(name, ", then ".join(kinds), remark)
    joint = model.get("joint") or {}
    if joint:
        yield say("joint", str(joint["law"]).partition("(")[0])
        if joint["lambda"] is not None:
            remark = "below 1 every step has one answer; above, a joint may snap back inside it"
            yield say("joint: lambda of a step", write_number(joint["lambda"]), remark)
    for wave in list_objects(model, "waves"):
        if "c_s" not in wave:
            continue
        name = wave["body"]
        step = f"it passes {write_number(wave['dt_ratio'])} edges in a step"
        yield pen.row(f"{name}: shear wave speed", wave["c_s"], "m/s", step)
        edges = f"edges of {write_number(wave['h'])} m, 8 in a wave length"
        yield pen.row(f"{name}: waves up to", wave["f_max"], "Hz", edges)


def list_sides(model: Model, pen: Pen) -> Iterator[Row]:
    """Yield how far the sides of the model are from the structure."""
    sides = model.get("sides") or {}
    if not sides:
        return
    names = ", ".join(sides["structure"])
    rule = f"{names}: the bodies that reach no side of the box"
    yield pen.row("width of the structure", sides["width"], "m", rule, quantity="size")
    if sides["wave_length"] is not None:
        waves = f"in {sides['ground']}, at the mean period of {write_number(sides['period'])} s"
        yield pen.row("length of shear waves", sides["wave_length"], "m", waves, quantity="size")
    for place in sides["distances"]:
        remark = f"{place['widths']:.2f} widths"
        if place["wave_lengths"] is not None:
            remark += f", {place['wave_lengths']:.2f} wave lengths"
        name = f"distance of the side {place['side']}"
        yield pen.row(name, place["distance"], "m", remark, quantity="size")
