"""Rub a viscoelastic Timoshenko beam, or touch with a rod, on a wall at its tip.

It is the beam of Ahn (2012), with what that scheme leaves out: docs/theory/beam.md. No finite
elements of DOLFINx are needed.

``run_beam`` marches as the source does, under a given normal force. ``rod_problem``,
``beam_problem`` and ``rubbing_problem`` make contact problems for any scheme and solver.
``published_start`` and its like are the data of the source.
>>> from vi_contact.beam import Elements
>>> Elements(4).nodes(2.0)  # m, of those that move: the clamped end does not
array([0.5, 1. , 1.5, 2. ])
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
