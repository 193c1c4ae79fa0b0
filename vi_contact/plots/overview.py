"""Draw in one figure what a person wants to see of a run first."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..solvers.certified import TOLERANCE
from .histories import draw_ledger, length_unit, log_axis, panels, plain, scaled

if TYPE_CHECKING:  # a solution without a folder is drawn where h5py is missing
    from ..run.files.reading import RunFolder
    from ..run.solution import Solution

CURVES = 8  # of probes: beyond, nobody tells them apart


def plot_overview(run: "Solution | RunFolder") -> Any:
    """Return a matplotlib Figure: the displacements of probes (the first 8), the contact force, the energy ledger, each
    where it was recorded, and the certificate of every step."""
    history, t = run.history, run.history["t"]
    probes = [name for name in history if name.startswith("u_")][:CURVES]
    kinds = ["probes"] * bool(probes) + [name for name in ("contact_resultant", "energy_defect") if name in history]
    figure, axes = panels(len(kinds) + 1, (9.0, 2.0 * len(kinds) + 2.0))
    for axis, kind in zip(axes, kinds, strict=False):
        if kind == "probes":
            metres, unit = length_unit(max(float(np.max(np.abs(history[name]), initial=0.0)) for name in probes))
            for name in probes:
                axis.plot(t, history[name] / metres, lw=0.9, label=plain(name))
            axis.set_ylabel(f"displacement [{unit}]")
        elif kind == "contact_resultant":
            force, unit = scaled(history[kind], "N")
            axis.plot(t, force, lw=0.9, color="black", label="resultant")
            axis.set_ylabel(f"contact force [{unit}]")
        else:
            axis.set_ylabel(f"energy, work [{draw_ledger(axis, history)[1]}]")
    if len(t) > 1:
        log_axis(axes[-1], t[1:], history["certificate"][1:])
        axes[-1].axhline(run.facts.get("tolerance") or TOLERANCE, color="tab:red", ls="--", lw=0.8, label="tolerance")
    axes[-1].set_ylabel("certificate [-]")
    for axis in (one for one in axes if one.get_legend_handles_labels()[0]):
        axis.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.align_ylabels()
    return figure
