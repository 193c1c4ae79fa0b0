"""Recorded ground motions: readers of record files, scaling, resampling, integration, intensity measures."""

from .info import motion_info
from .intensity import arias, d5_95, pga, pga_time, pgd, pgv
from .processing import integrated, resampled, scaled, scaled_to_pga
from .reader import read_record
from .record import STANDARD_GRAVITY, UNITS, Record

__all__ = ["STANDARD_GRAVITY", "UNITS", "Record", "arias", "d5_95", "integrated", "motion_info", "pga", "pga_time",
           "pgd", "pgv", "read_record", "resampled", "scaled", "scaled_to_pga"]
