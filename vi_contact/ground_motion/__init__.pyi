# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .chain import Processing as Processing
from .chain import scaled_to_arias as scaled_to_arias
from .chain import scaled_to_pga as scaled_to_pga
from .chain import scaled_to_psa as scaled_to_psa
from .ec8 import EC8Spectrum as EC8Spectrum
from .excitation import GroundMotion as GroundMotion
from .formats.reader import read_record as read_record
from .formats.writer import write_at2 as write_at2
from .formats.writer import write_columns as write_columns
from .formats.writer import write_path_series as write_path_series
from .intensity import arias as arias
from .intensity import cav as cav
from .intensity import d5_95 as d5_95
from .intensity import housner_intensity as housner_intensity
from .intensity import husid as husid
from .intensity import mean_period as mean_period
from .intensity import pga as pga
from .intensity import pga_time as pga_time
from .intensity import pgd as pgd
from .intensity import pgv as pgv
from .intensity import predominant_period as predominant_period
from .intensity import psa as psa
from .intensity import record_info as record_info
from .intensity import rms as rms
from .intensity import significant_duration as significant_duration
from .kanai_tajimi import Envelope as Envelope
from .kanai_tajimi import KanaiTajimi as KanaiTajimi
from .kanai_tajimi import synthetic as synthetic
from .processing import baseline_corrected as baseline_corrected
from .processing import filtered as filtered
from .processing import integrated as integrated
from .processing import padded as padded
from .processing import resampled as resampled
from .processing import scaled as scaled
from .processing import tapered as tapered
from .processing import trimmed as trimmed
from .processing import without_mean as without_mean
from .record import Record as Record
from .record import STANDARD_GRAVITY as STANDARD_GRAVITY
from .record import UNITS as UNITS
from .spectra import ResponseSpectrum as ResponseSpectrum
from .spectra import fourier_spectrum as fourier_spectrum
from .spectra import response_spectrum as response_spectrum

__all__: list[str] = [
    "EC8Spectrum",
    "Envelope",
    "GroundMotion",
    "KanaiTajimi",
    "Processing",
    "Record",
    "ResponseSpectrum",
    "STANDARD_GRAVITY",
    "UNITS",
    "arias",
    "baseline_corrected",
    "cav",
    "d5_95",
    "filtered",
    "fourier_spectrum",
    "housner_intensity",
    "husid",
    "integrated",
    "mean_period",
    "padded",
    "pga",
    "pga_time",
    "pgd",
    "pgv",
    "predominant_period",
    "psa",
    "read_record",
    "record_info",
    "resampled",
    "response_spectrum",
    "rms",
    "scaled",
    "scaled_to_arias",
    "scaled_to_pga",
    "scaled_to_psa",
    "significant_duration",
    "synthetic",
    "tapered",
    "trimmed",
    "without_mean",
    "write_at2",
    "write_columns",
    "write_path_series",
]
