"""Slow contact down in a thin layer before the obstacle, with a wanted restitution.

It is the boundary layer of b-geometry (ENOC 2017): docs/theory/boundary_layer.md. No finite
elements are needed.

``layer_for`` and ``ParticleImpact`` are in closed form. ``layer_motion`` integrates systems with
one contact, ``RigidBody`` among them, and ``bilateral_motion`` those with equality constraints.
``contact_layer`` makes the law of a contact boundary, which the scheme ``BoundaryLayer`` needs.
>>> from vi_contact.layer import ParticleImpact, layer_for
>>> wanted = layer_for(0.7, mass=1.0, speed=2.0, width=0.01)  # kg, m/s, m
>>> round(ParticleImpact(wanted, 1.0, 2.0).restitution, 12)
0.7
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
