# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .cases.case import Case as Case
from .cases.case import read_case as read_case
from .cases.checks import comparisons as comparisons
from .ida.ida import IDA as IDA
from .ida.ida import run_ida as run_ida
from .refinement import refine as refine
from .report import report as report

__all__: list[str] = ['Case', 'IDA', 'comparisons', 'read_case', 'refine', 'report', 'run_ida']
