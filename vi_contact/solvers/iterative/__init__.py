"""Solve the step in the volume by conjugate gradients, without any factor.

One row of a mask is a contact condition.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
