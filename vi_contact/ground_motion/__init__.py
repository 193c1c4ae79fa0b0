"""Read, write, process and make ground motions: record files, spectra, intensity measures, synthetic motions.

``read_record`` reads one, ``Processing`` makes another of it, ``GroundMotion`` shakes with it: docs/guide/records.md.
>>> from vi_contact.ground_motion import Record, pga, scaled
>>> print(pga(scaled(Record([0.0, 1.5, -3.0, 0.0], dt=0.01), factor=0.5)))  # m/s²
1.5
"""

from ..core.lazy import lazy

_CONTENTS = {
    "chain": ("Processing", "scaled_to_arias", "scaled_to_pga", "scaled_to_psa"),
    "ec8": ("EC8Spectrum",),
    "excitation": ("GroundMotion",),
    "formats.reader": ("read_record",),
    "formats.writer": ("write_at2", "write_columns", "write_path_series"),
    "intensity": (
        "arias", "cav", "d5_95", "housner_intensity", "husid", "mean_period", "pga", "pga_time", "pgd", "pgv",
        "predominant_period", "psa", "record_info", "rms", "significant_duration",
    ),
    "kanai_tajimi": ("Envelope", "KanaiTajimi", "synthetic"),
    "processing": (
        "baseline_corrected", "filtered", "integrated", "padded", "resampled", "scaled", "tapered", "trimmed",
        "without_mean",
    ),
    "record": ("STANDARD_GRAVITY", "UNITS", "Record"),
    "spectra": ("ResponseSpectrum", "fourier_spectrum", "response_spectrum"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
