"""Read, write, process and make ground motions: record files, spectra, intensity measures, synthetic motions.

``read_record`` reads one, ``Processing`` makes another of it, ``GroundMotion`` shakes with it: docs/guide/records.md.
>>> from vi_contact.ground_motion import Record, pga, scaled
>>> print(pga(scaled(Record([0.0, 1.5, -3.0, 0.0], dt=0.01), factor=0.5)))  # m/s²
1.5
"""

from ..core.units import STANDARD_GRAVITY
from .baseline import baseline_corrected
from .chain import Processing, scaled_to_arias, scaled_to_pga, scaled_to_psa
from .ec8 import EC8Spectrum
from .excitation import GroundMotion
from .formats.reader import read_record
from .formats.writer import write_at2, write_columns, write_path_series
from .info import record_info
from .intensity import (
    arias,
    bracketed_duration,
    cav,
    d5_95,
    housner_intensity,
    husid,
    mean_period,
    pga,
    pga_time,
    pgd,
    pgv,
    predominant_period,
    psa,
    rms,
    significant_duration,
)
from .kanai_tajimi import Envelope, KanaiTajimi, synthetic
from .processing import filtered, integrated, padded, resampled, scaled, tapered, trimmed, without_mean
from .record import UNITS, Record
from .spectra import ResponseSpectrum, fourier_spectrum, response_spectrum

__all__ = [
    "STANDARD_GRAVITY", "UNITS", "EC8Spectrum", "Envelope", "GroundMotion",
    "KanaiTajimi", "Processing", "Record", "ResponseSpectrum",
    "arias", "baseline_corrected", "bracketed_duration", "cav", "d5_95", "filtered", "fourier_spectrum",
    "housner_intensity", "husid", "integrated", "mean_period", "padded", "pga", "pga_time", "pgd", "pgv",
    "predominant_period", "psa", "read_record", "record_info", "resampled", "response_spectrum", "rms", "scaled",
    "scaled_to_arias", "scaled_to_pga", "scaled_to_psa", "significant_duration", "synthetic", "tapered", "trimmed",
    "without_mean", "write_at2", "write_columns", "write_path_series",
]
