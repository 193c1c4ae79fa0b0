# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .checks.comparison import Check as Check
from .checks.comparison import Comparison as Comparison
from .damping import FirstModes as FirstModes
from .damping import first_modes as first_modes
from .floor_spectra import TransferFunction as TransferFunction
from .floor_spectra import floor_spectrum as floor_spectrum
from .floor_spectra import recorded_motion as recorded_motion
from .floor_spectra import transfer_function as transfer_function
from .modal import lowest_frequency as lowest_frequency
from .peak_values import Loop as Loop
from .peak_values import Peak as Peak
from .peak_values import hysteresis as hysteresis
from .peak_values import peaks as peaks
from .peak_values import write_peaks as write_peaks
from .racking import Racking as Racking
from .resultants import Resultants as Resultants
from .resultants import contact_summary as contact_summary

__all__: list[str] = [
    "Check",
    "Comparison",
    "FirstModes",
    "Loop",
    "Peak",
    "Racking",
    "Resultants",
    "TransferFunction",
    "contact_summary",
    "first_modes",
    "floor_spectrum",
    "hysteresis",
    "lowest_frequency",
    "peaks",
    "recorded_motion",
    "transfer_function",
    "write_peaks",
]
