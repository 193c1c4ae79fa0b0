"""Say how far the sides of a model are from the structure in it.

The structure are the bodies that no side of the model belongs to: the boxes round them reach
neither the lowest level of the box of the model nor its sides. The distances are told in widths of
the structure, and in lengths of shear waves of the slowest body around it, at the mean period of
the record with the longest one.
"""

from collections.abc import Mapping
from typing import Any

from .....core.step import AXES

REACHED = 1e-6  # of the extent of the box: a body that is so near to a side reaches it


def describe_sides(model: Mapping[str, Any]) -> dict[str, Any]:
    """Return how far the sides of a model are; {} where no structure stands in a ground.

    Args:
        model: with the keys box, bodies, waves and records of model.json.

    Returns:
        structure: names; width: of it along the axis where it is widest [m]; foot: its lowest level
        [m]; ground: name of the slowest body around it; wave_length [m] and period [s] of its
        waves, None without a record; distances: side, distance [m], widths, wave_lengths (None
        without a record).
    """
    if "box" not in model or model["dimension"] == 1:
        return {}
    box = model["box"]
    inside = [body for body in model["bodies"] if not _reaches_side(body["box"], box)]
    around = [body["name"] for body in model["bodies"] if body not in inside]
    if not inside or not around:
        return {}

    # The box of the structure, and the slowest waves around it.
    d = len(box["min"])
    low = [min(body["box"]["min"][axis] for body in inside) for axis in range(d)]
    high = [max(body["box"]["max"][axis] for body in inside) for axis in range(d)]
    width = max(high[axis] - low[axis] for axis in range(max(d - 1, 1)))
    waves = [wave for wave in model["waves"] if wave["body"] in around]
    slowest = min(waves, key=lambda wave: float(wave["c_s"]))
    periods = [record["mean_period"] for record in model["records"] if record["mean_period"]]
    length = slowest["c_s"] * max(periods) if periods else None

    distances = []
    for axis in range(d):
        gaps = {"min": low[axis] - box["min"][axis], "max": box["max"][axis] - high[axis]}
        if axis == d - 1:
            gaps.pop("max")  # above is no ground
        for end, gap in gaps.items():
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
        "foot": low[-1],
        "ground": slowest["body"],
        "period": max(periods) if periods else None,
        "wave_length": length,
        "distances": distances,
    }


def _reaches_side(part: Mapping[str, Any], box: Mapping[str, Any]) -> bool:
    """Say whether a body reaches a side of the model or its lowest level.

    Args:
        part: min and max of the box round the body.
        box: the like of the model.
    """
    d = len(box["min"])
    for axis in range(d):
        near = REACHED * (box["max"][axis] - box["min"][axis])
        if part["min"][axis] <= box["min"][axis] + near:
            return True
        if axis < d - 1 and part["max"][axis] >= box["max"][axis] - near:
            return True
    return False
