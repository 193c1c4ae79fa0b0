"""March a step in time: one scheme a file, each a value that satisfies ``core.step.Scheme``.

Take ``Trapezoidal()``, the default. The head of every file has equations, order, energy and source;
which one when: docs/guide/schemes.md. A scheme of your own: docs/guide/extend.md.

>>> from vi_contact.schemes import GeneralisedAlpha
>>> GeneralisedAlpha.spectral_radius(1.0)
GeneralisedAlpha(alpha_m=0.5, alpha_f=0.5, beta=0.25, gamma=0.5)
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
