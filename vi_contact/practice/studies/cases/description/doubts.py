"""Find what does not go together in a model, and what an engineer should look at."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np

STEPS = 20.0  # in a period
PASSAGE = 10.0  # steps in the time b/V of a layer (CHOSEN; the demos take 20)
# Edges of side 2 over those of side 1: more points than a softer side can follow (CHOSEN).
COARSER = 1.2
ROUNDED = 1e-9  # of a time step


def find_defects(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield why records do not fit to each other or to the time step, a sentence each."""
    dt = model["run"]["dt"]
    for first, second in pairwise(model["records"]):
        files = f"'{first['file']}' and '{second['file']}'"
        if abs(first["dt"] - second["dt"]) > ROUNDED * first["dt"]:
            yield (
                f"{files} have samples every {first['dt']:g} and "
                f"{second['dt']:g} s: bring them to one step with record = "
                f'{{path = "FILE", resample_dt = {first["dt"]:g}}}'
            )
        if abs(first["duration"] - second["duration"]) > ROUNDED * first["duration"]:
            yield (
                f"{files} last {first['duration']:g} and "
                f"{second['duration']:g} s: trim or pad one of them in its table of processing"
            )
    for record in model["records"]:
        if dt > record["dt"] * (1.0 + ROUNDED):
            yield (
                f"the time step of {dt:g} s leaves out samples of '{record['file']}', which has "
                f"one every {record['dt']:g} s: shorten [run] dt, or give the record resample_dt "
                f"= {dt:g}"
            )


def find_warnings(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an engineer should look at, a sentence each."""
    yield from _find_coarse_meshes(model)
    yield from _find_long_steps(model)


def _find_coarse_meshes(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of elements that are too long."""
    # Elements too long for the shear waves of the record with the highest frequencies.
    for record in sorted(model["records"], key=lambda record: float(record["f_95"]))[-1:]:
        for wave in model["waves"]:
            if record["f_95"] > wave["f_max"]:
                yield (
                    f"'{wave['body']}' carries shear waves up to {wave['f_max']:.3g} Hz and "
                    f"'{record['file']}' has 95 % of its energy below {record['f_95']:.3g} Hz: "
                    "give smaller elements, or filter the record"
                )

    # A softer side of a contact with longer edges cannot follow the points of the other side.
    for contact in model["contact"]:
        if not contact["sides"]:
            continue
        first, second = contact["sides"]
        if second["h"] > COARSER * first["h"] and second["G"] < first["G"]:
            yield (
                f"'{first['name']}', side 1 of its contact, has edges of {first['h']:.3g} m, and "
                f"'{second['name']}', the softer side, has edges of {second['h']:.3g} m: points "
                f"open there and pressures zigzag, so mesh '{second['name']}' as finely, or "
                "exchange facets1 and facets2"
            )


def _find_long_steps(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of time steps that are too long."""
    # Time steps too long for the passage of a layer.
    for layer in model["layers"]:
        if model["run"]["dt"] > layer["passage"] / PASSAGE:
            yield (
                f"the time step of {model['run']['dt']:.3g} s is longer than a tenth of the time "
                f"in which a body passes the layer, b/V = {layer['passage']:.3g} s: shorten [run] "
                "dt, or widen the layer"
            )

    # Time steps too long for the first period, of the model with the contact closed or open.
    dt = model["run"]["dt"]
    closed = next(iter(model.get("periods", ())), np.inf)
    lifted = next(iter(model.get("periods_open", ())), np.inf)
    if dt > closed / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period, "
            f"{closed:.3g} s: the computed periods become too long, so shorten [run] dt"
        )
    elif dt > lifted / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period "
            f"with the contact open, {lifted:.3g} s: what moves after it has lifted off is "
            "computed too slowly, so shorten [run] dt"
        )
