# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .bodies import draw_run as draw_run
from .bodies import film as film
from .bodies import plot_deformed as plot_deformed
from .charts import plot_overview as plot_overview
from .deformed import read_frames as read_frames
from .faces import plot_faces as plot_faces
from .records import plot_loop as plot_loop
from .records import plot_motion as plot_motion
from .records import plot_spectra as plot_spectra
from .records import plot_transfer as plot_transfer
from .studies import plot_ida as plot_ida

__all__: list[str] = [
    "draw_run",
    "film",
    "plot_deformed",
    "plot_faces",
    "plot_ida",
    "plot_loop",
    "plot_motion",
    "plot_overview",
    "plot_spectra",
    "plot_transfer",
    "read_frames",
]
