"""Draw runs, records and studies, and write the report on a run.

matplotlib is imported when something is drawn.

Begin with ``draw_run(run.read_run(folder), "pictures", title="Wall")``; ``studies.report(folder)``
writes the report. The ending of a file's name says its format: docs/guide/outputs.md.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
