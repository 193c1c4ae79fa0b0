"""Bring the motion of the ground to a body.

There are moved bases, upgoing waves, soil columns and free-field sides.

Begin with docs/guide/soil.md, which tells ``base_motion`` (rock that moves) from ``upgoing`` (a
wave in ``fem.CompliantBase``, half the motion of an outcrop); ``FreeField`` goes to the sides.
>>> from vi_contact import laws, soil
>>> motion = laws.FullSine(amplitude=1.0, duration=1.0)
>>> print(soil.upgoing(motion, dt=0.01)(0.5).round(2))  # m/s: 1 / (2 pi)
[0.16 0.  ]
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
