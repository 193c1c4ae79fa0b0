"""Say how far the sides of a model are from the structure in it.

The structure are the bodies that no side of the model belongs to: the boxes round them reach
neither the lowest level of the box of the model nor its sides. The others are a ground if they fill
enough of the boxes round them: columns of a frame do not. The distances are told in widths of
the structure, and in lengths of shear waves of the slowest body around it, at the mean period of
the record with the longest one.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .....core.step import AXES

REACHED = 1e-6  # of the extent of the box: a body that is so near to a side reaches it

FILLED = 0.25  # of the boxes round the bodies of a ground, at least (CHOSEN)


def find_bottom(model: Mapping[str, Any]) -> tuple[int, str]:
    """Return the vertical axis of a model, and which end of it is the bottom: "min" or "max".

    Gravity tells it; without gravity it is the last axis.
    """
    direction = (model["gravity"] or {}).get("direction")
    if not direction:
        return model["dimension"] - 1, "min"
    sizes = [abs(part) for part in direction]
    axis = sizes.index(max(sizes))
    return axis, "min" if direction[axis] < 0.0 else "max"


def describe_sides(model: Mapping[str, Any]) -> dict[str, Any]:
    """Return how far the sides of a model are; {} where no structure stands in a ground.

    Args:
        model: with the keys dimension, gravity, box, bodies, waves and records of model.json.

    Returns:
        structure: names; width: of it along the axis where it is widest [m]; foot: its lowest level
        [m]; ground: name of the slowest body around it; wave_length [m] and period [s] of its
        waves, None without a record; distances: side, distance [m], widths, wave_lengths (None
        without a record).
    """
    if "box" not in model or model["dimension"] == 1:
        return {}
    box = model["box"]
    vertical, bottom = find_bottom(model)
    ends = [(axis, end) for axis in range(model["dimension"]) for end in ("min", "max")]
    top = "max" if bottom == "min" else "min"
    sides = [side for side in ends if side != (vertical, top)]  # above is no ground
    inside = [body for body in model["bodies"] if not _reaches_side(body["box"], box, sides)]
    others = [body for body in model["bodies"] if body not in inside]
    around = [body["name"] for body in others]
    if not inside or not _is_ground(others):
        return {}

    # The box of the structure, and the slowest waves around it.
    low = [min(values) for values in zip(*(body["box"]["min"] for body in inside), strict=True)]
    high = [max(values) for values in zip(*(body["box"]["max"] for body in inside), strict=True)]
    edges = {"min": low, "max": high}
    width = max(high[axis] - low[axis] for axis, _ in sides if axis != vertical)
    waves = [wave for wave in model["waves"] if wave["body"] in around]
    if not waves:  # a ground without mass sends nothing back
        return {}
    slowest = min(waves, key=lambda wave: float(wave["c_s"]))
    periods = [record["mean_period"] for record in model["records"] if record["mean_period"]]
    length = slowest["c_s"] * max(periods) if periods else None

    distances = []
    for axis, end in sides:
        gap = abs(edges[end][axis] - box[end][axis])
        distances.append(
            {
                "side": f"{AXES[axis]} {end}",
                "distance": gap,
                "widths": gap / width,
                "wave_lengths": None if length is None else gap / length,
            }
        )
    return {
        "structure": [body["name"] for body in inside],
        "width": width,
        "foot": edges[bottom][vertical],
        "ground": slowest["body"],
        "period": max(periods) if periods else None,
        "wave_length": length,
        "distances": distances,
    }


def _is_ground(bodies: Sequence[Mapping[str, Any]]) -> bool:
    """Say whether bodies fill enough of the boxes round them to be a ground; without any not."""
    whole = 0.0
    for body in bodies:
        ends = zip(body["box"]["min"], body["box"]["max"], strict=True)
        whole += math.prod(high - low for low, high in ends)
    return sum(body["size"] for body in bodies) > FILLED * whole


def _reaches_side(
    part: Mapping[str, Any], box: Mapping[str, Any], sides: Sequence[tuple[int, str]]
) -> bool:
    """Say whether a body reaches one of some sides of the model.

    Args:
        part: min and max of the box round the body.
        box: the like of the model.
        sides: axis and end of each.
    """
    for axis, end in sides:
        near = REACHED * (box["max"][axis] - box["min"][axis])
        if abs(part[end][axis] - box[end][axis]) <= near:
            return True
    return False
