"""Hold exact solutions of contact problems, to compare a run with.

There are elastic bars that are thrown, bounce or swing, the contact and the impact of Hertz,
Housner's rocking block, and a membrane over an obstacle. Each cites its source; all are pure numpy
and scipy, in SI units.
>>> from vi_contact.exact import ThrownBar
>>> bar = ThrownBar(length=10.0, E=900.0, rho=1.0, height=5.0, speed=10.0)
>>> round(bar.contact_start, 3), round(bar.contact_end, 3)  # s
(0.5, 1.167)
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
