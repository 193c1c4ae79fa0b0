"""Draw runs, records and studies, and write the report on a run. matplotlib is imported when something is drawn.

Begin with ``draw_run(run.read_run(folder), "pictures", title="Wall")``; ``studies.report(folder)`` writes the report.
The ending of a file's name says its format: docs/guide/outputs.md."""

from ..core.lazy import lazy

_CONTENTS = {
    "bodies": ("draw_run", "film", "plot_deformed"),
    "charts": ("plot_overview",),
    "deformed": ("read_frames",),
    "faces": ("plot_faces",),
    "records": ("plot_loop", "plot_motion", "plot_spectra", "plot_transfer"),
    "studies": ("plot_ida",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
