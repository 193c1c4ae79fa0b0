# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .cases.case import Case as Case
from .cases.case import read_case as read_case
from .ida.fragility import fragility_curve as fragility_curve
from .ida.ida import IDA as IDA
from .ida.ida import run_ida as run_ida
from .ida.runs import record_set as record_set
from .refinement import refine as refine
from .report import comparisons as comparisons
from .report import report as report

__all__: list[str] = [
    "Case",
    "IDA",
    "comparisons",
    "fragility_curve",
    "read_case",
    "record_set",
    "refine",
    "report",
    "run_ida",
]
