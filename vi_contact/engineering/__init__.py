"""Answer what engineers ask of a run: resultants, racking, floor spectra, peaks, frequencies."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "floor_spectra": ("TransferFunction", "floor_spectrum", "recorded_motion", "transfer_function"),
    "modal": ("lowest_frequency",),
    "peak_values": ("Loop", "Peak", "hysteresis", "peaks", "write_peaks"),
    "racking": ("Racking",),
    "resultants": ("Resultants", "contact_summary"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
