"""Slide rigid blocks under records, by the law of Newmark."""

from pathlib import Path
from typing import Any

import numpy as np

import vi_contact as vc
from vi_contact.practice.engineering import checks
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "gravity": "m/s²",
    "ky_factor": "-",
    "one_sided": "",
    "normal_sense": "-",
    "record": "name",
    "ky": "g",
    "peak": "g",
    "sense": "name",
}
CENTI = 1e-2


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the slip [cm] of every row. All settings compute alike; the smallest has fewer rows.

    Args:
        inputs: gravity and senses; rows of records, yield accelerations and peaks.
        fineness: is not read.
    """
    found = Found()
    records: dict[Any, vc.ground_motion.Record] = {}
    for row in inputs.rows:
        name = row["record"]
        if name not in records:
            assert inputs.records is not None
            records[name] = vc.read_record(inputs.records / f"{name}.csv", "g")
        record = records[name]

        # the record scaled to its peak, above the block that falls to the side of its sense
        peak = float(np.max(np.abs(record.acceleration)))
        along = record.acceleration * (row["peak"] * inputs["gravity"] / peak)
        still = np.zeros_like(along)
        history = {
            "t": record.dt * np.arange(len(along)),
            "a_g_x": along,
            "a_g_y": still,
            "sliding_base": still,
        }
        side = inputs["normal_sense"] * {"normal": 1.0, "inverse": -1.0}[row["sense"]]
        block = checks.NewmarkBlock(
            mu=inputs["ky_factor"] * row["ky"],
            gravity=inputs["gravity"],
            one_sided=inputs["one_sided"],
            towards=side,
        )
        figure = f"{name}, ky {row['ky']:g}, peak {row['peak']:g}, {row['sense']}"
        found.figures[figure] = block.compare(history).expected / CENTI
    return found


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the slips over those of SLAMMER, with the band of a single value.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, draw_over_wanted, save

    wanted = []
    slips = []
    for row in data.rows:
        name = f"{row['record']}, ky {row['ky']:g}, peak {row['peak']:g}, {row['sense']}"
        if name in found.figures:
            wanted.append(row["slip"])
            slips.append(found.figures[name])
    figure, axes = canvas(1, 1, (5.5, 5.0))
    axis: Any = axes[0, 0]
    draw_over_wanted(axis, wanted, slips, relative=0.02, floor=0.05)
    axis.set_xlabel("slip of SLAMMER [cm]")
    axis.set_ylabel("slip of NewmarkBlock [cm]")
    axis.legend()
    save(figure, path)
