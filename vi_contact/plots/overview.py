"""Draw in one figure what a person wants to see of a run first."""

from typing import TYPE_CHECKING, Any

from .charts import certificate_chart, draw_chart, energy_chart, of_columns
from .histories import panels

if TYPE_CHECKING:  # a solution without a folder is drawn where h5py is missing
    from ..run.files.reading import RunFolder
    from ..run.solution import Solution

CURVES = 8  # of probes: beyond, nobody tells them apart


def plot_overview(run: "Solution | RunFolder") -> Any:
    """Return a matplotlib Figure: the displacements of probes (the first 8), the contact force, the energy ledger, each
    where it was recorded, and the certificate of every step."""
    probes = [name for name in run.history if name.startswith("u_")][:CURVES]
    charts = [of_columns(run, probes, "displacement")] if probes else []
    charts += [of_columns(run, ["contact_resultant"], "contact force")] if "contact_resultant" in run.history else []
    charts += [*filter(None, [energy_chart(run)]), certificate_chart(run)]
    figure, axes = panels(len(charts), (9.0, 2.0 * len(charts)))
    for axis, chart in zip(axes, charts, strict=True):
        draw_chart(axis, chart)
        axis.set_xlabel(chart.x if axis is axes[-1] else "")
    return figure
