"""Hold the numerical kernels that bodies and solvers share, below both.

``contact_last`` factorises with contact unknowns last, ``condensation`` condenses onto them,
``friction_sweeps`` and ``exchanges`` begin small contact problems, and ``compiler`` compiles their
C files when they are first needed.
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
