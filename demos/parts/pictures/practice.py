"""Draw the pictures of docs/guide/practice.md from runs of the cases.

    python3 demos/parts/pictures/practice.py RESULTS [NAMES]

RESULTS holds the run folders wall, dam, pier, pounding and culvert, or those that are named; the
pictures are written beside them.
"""

import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import vi_contact as vc
from vi_contact.core.units import STANDARD_GRAVITY as G

History = Mapping[str, np.ndarray]


def wall(axes: Any, h: History) -> None:
    """Thrust on the stem, its height, and how far the base has slid."""
    thrust, mid, slid = axes
    soil = 0.5 * 1900.0 * G * 5.4**2 / 1e3
    phi = 0.593
    thrust.plot(h["t"], h["N_stem"] / 1e3)
    for factor, name in (
        (math.tan(math.pi / 4 - phi / 2) ** 2, "Rankine, 34°"),
        (0.3 / 0.7, "K0, nu = 0.3"),
    ):
        thrust.axhline(factor * soil, color="0.5", ls="--", lw=0.8)
        thrust.text(h["t"][-1], factor * soil, name, ha="right", va="bottom", fontsize=8)
    thrust.set_title("thrust on the stem [kN/m]")
    mid.plot(h["t"], h["level_stem"])
    mid.axhline(1.0 / 3.0, color="0.5", ls="--", lw=0.8)
    mid.set(title="its height over that of the stem", ylim=(0.0, 1.0))
    slid.plot(h["t"], -1e3 * (h["sliding_base"] - h["sliding_base"][0]))
    slid.set_title("base slides away from the fill [mm]")


def dam(axes: Any, h: History) -> None:
    """Length of the crack, energy that its joint has lost, and safety against sliding."""
    crack, lost, safety = axes
    crack.plot(h["t"], h["crack_length"])
    crack.set_title("length of the crack [m]")
    lost.plot(h["t"], h["loss_fracture"])
    lost.set_title("energy of fracture [J/m]")
    safety.plot(h["t"], 1.0 / (1.0 - h["margin_joint"]))
    safety.axhline(1.0, color="0.5", ls="--", lw=0.8)
    safety.set(title="factor of safety against sliding", ylim=(0.8, 6.0))


def pier(axes: Any, h: History) -> None:
    """Loop of the moment over the rotation, rotation, and open share of the raft."""
    loop, turn, open_ = axes
    weight = h["N_raft"][0]
    loop.plot(1e3 * h["theta_raft"], h["M_raft"] / 1e6, lw=0.7)
    for share, name in ((6.0, "W B/6"), (4.0, "W B/4"), (2.0, "W B/2")):
        for sign in (-1.0, 1.0):
            loop.axhline(sign * weight * 7.0 / share / 1e6, color="0.5", ls="--", lw=0.8)
        loop.text(
            1e3 * h["theta_raft"].max(),
            weight * 7.0 / share / 1e6,
            name,
            ha="right",
            va="bottom",
            fontsize=8,
        )
    loop.set(title="M of the raft [MN m/m] over theta [mrad]", xlabel="theta [mrad]")
    turn.plot(h["t"], 1e3 * h["theta_raft"])
    turn.set_title("rotation on the soil [mrad]")
    open_.plot(h["t"], 100.0 * h["uplift_raft"])
    open_.set_title("open share of the raft [%]")


def culvert(axes: Any, h: History) -> None:
    """Racking of box and free field, one over the other, and the load on the roof."""
    both, ratio, roof = axes
    free, box = (
        1e3 * (h[f"racking_{one}"] - h[f"racking_{one}"][0]) for one in ("free_field", "box")
    )
    both.plot(h["t"], free, color="0.6", label="free field")
    both.plot(h["t"], box, label="box")
    both.legend(fontsize=8, frameon=False)
    both.set_title("racking [mrad]")
    ends = np.array([free.min(), free.max()])
    ratio.plot(free, box, lw=0.7)
    for slope, name in ((0.965, "R of centre lines"), (0.748, "of clear spans")):
        ratio.plot(ends, slope * ends, color="0.5", ls="--", lw=0.8)
        ratio.text(ends[1], slope * ends[1], name, ha="right", va="bottom", fontsize=8)
    ratio.set(title="box over free field [mrad]", xlabel="free field [mrad]")
    roof.plot(h["t"], h["N_roof"] / 6e3)
    roof.axhline(1900.0 * G * 5.0 / 1e3, color="0.5", ls="--", lw=0.8)
    roof.text(
        h["t"][-1],
        1900.0 * G * 5.0 / 1e3,
        "weight of the cover",
        ha="right",
        va="bottom",
        fontsize=8,
    )
    roof.set_title("mean pressure on the roof [kPa]")


def pounding(axes: Any, h: History) -> None:
    """Sways at the height of the lower roof, forces of contact, base shears."""
    sway, force, shear = axes
    sway.plot(h["t"], 1e3 * h["u_x_left_second"], label="left frame")
    sway.plot(h["t"], 1e3 * (h["u_x_right_roof"] + 0.03), label="right frame, 30 mm away")
    sway.legend(fontsize=8, frameon=False, loc="lower right")
    sway.set_title("sways at the lower roof [mm]")
    force.plot(h["t"], h["contact_resultant"] / 1e6, lw=0.8)
    force.set_title("contact force [MN]")
    for one in ("left", "right"):
        shear.plot(h["t"], h[f"reaction_x_{one}"] / 1e3, lw=0.8, label=one)
    shear.legend(fontsize=8, frameon=False, loc="lower right")
    shear.set_title("force of the ground on the feet [kN]")


CASES: Mapping[str, Callable[[Any, History], None]] = {
    "wall": wall,
    "dam": dam,
    "pier": pier,
    "pounding": pounding,
    "culvert": culvert,
}


def main(results: Path, *names: str) -> None:
    """Draw these cases, or all five."""
    for name in names or CASES:
        draw = CASES[name]
        figure, axes = plt.subplots(1, 3, figsize=(11.0, 2.9), layout="constrained")
        draw(axes, vc.read_run(results / name).history)
        for one in axes:
            one.set_xlabel(one.get_xlabel() or "time [s]")
            one.spines[["top", "right"]].set_visible(False)
            one.title.set_fontsize(10)
        figure.savefig(results / f"practice_{name}.png", dpi=110)
        plt.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
