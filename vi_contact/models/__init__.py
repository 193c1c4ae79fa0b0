"""Hold problems ready to run, one a module: a value that describes one, and ``build``, which assembles it.

What ``build`` returns has the ``problem`` to simulate. Two modules without ``build`` serve the room ``bem``.
>>> from mpi4py import MPI
>>> import vi_contact as vc
>>> from vi_contact import models
>>> model = models.bar.build(models.bar.Bar(elements=8), MPI.COMM_WORLD)
>>> vc.simulate(model.problem(), dt=model.bar.time_step(), steps=10).facts["status"]
'finished'
"""

from ..core.lazy import lazy

_CONTENTS = {  # modules that are handed on whole
    "ball": (), "bar": (), "boundary_curve": (), "boundary_elements": (), "channel": (), "disk": (), "embedded": (),
    "rocking_block": (), "square": (), "wall": (),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
