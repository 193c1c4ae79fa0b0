"""vi_contact: dynamic unilateral contact of elastic structures, certified step by step.

The names most runs need, imported when they are first used: ``import vi_contact`` needs numpy and
scipy only. All else has a room: ``vi_contact.fem`` (meshes, assembly, surfaces), ``solvers``,
``laws``, ``ground_motion``, ``soil``, ``engineering``, ``bem``, ``layer``, ``beam``,
``exact``, ``vi``, ``studies``, ``plots``.
"""

from .core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
