"""Draw runs, records and studies, and write the page about a run. matplotlib is imported when something is drawn.

Begin with ``plot_report(run.read_run(folder), "report.pdf")``, the page about a run; ``draw_run`` draws its pictures.
The ending of a file's name says its format: docs/guide/outputs.md."""

from ..core.lazy import lazy

_CONTENTS = {
    "bodies": ("film", "plot_deformed"),
    "deformed": ("read_frames",),
    "faces": ("plot_faces",),
    "histories": ("plot_certificate", "plot_energy", "plot_excitation", "plot_points"),
    "maps": ("plot_contact",),
    "overview": ("plot_overview",),
    "records": ("plot_loop", "plot_motion", "plot_spectra", "plot_transfer"),
    "report": ("plot_report",),
    "run_pictures": ("draw_run",),
    "studies": ("plot_ida",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
