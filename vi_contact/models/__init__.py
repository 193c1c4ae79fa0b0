"""Hold problems ready to run, one a module: a value that describes one, and ``build``, which assembles it.

Problems of single demos stand in ``demos/problems``.
>>> from mpi4py import MPI
>>> import vi_contact as vc
>>> from vi_contact import models
>>> model = models.wall.build(models.wall.Wall(), MPI.COMM_WORLD)
>>> vc.simulate(model.problem("a", impact=None), dt=model.time_step(), steps=10).facts["status"]
'finished'
"""

from ..core.lazy import lazy

_CONTENTS = {"wall": ()}  # modules that are handed on whole
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
