"""March a problem, listen to it with recorders, and keep what it did in a folder.

Begin with ``simulate``, as README.md does. ``march`` is the bare loop below it,
``static_equilibrium`` the start under weight, ``read_run`` the way back from a folder:
docs/reference/files.md.
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
