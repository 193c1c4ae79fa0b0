"""Listen to the loop: each recorder names its columns once, and fills a row after every step.

Displacements and velocities are those of the equations: relative to the ground when an excitation
shakes the body.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
