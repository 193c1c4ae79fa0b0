"""Study a problem that is written down: case files, and many runs of one case.

``read_case(path)`` reads a TOML file whose tables are calls of the Python interface, its
``run(comm)`` computes it; ``run_ida`` makes an incremental dynamic analysis of it:
docs/guide/studies.md; ``report(folder)`` reports on a run.
>>> from vi_contact.practice.studies import read_case
>>> from vi_contact.practice.studies.cases.library import locate  # of the cases that ship
>>> read_case(locate("wall"), ["run.steps=10"]).tables["run"]["steps"]
10
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
