"""Model contact in a thin layer before the obstacle, as a smooth force: b-geometry.

``layer``: the boundary force and its cut-off; ``particle``: its closed form; ``metric``: b-metric and b-affinities;
``motion``: any constrained system as ordinary differential equations, which ``trajectory`` integrates;
``rigid_body``: a rolling ellipsoid; ``bilateral``: equality constraints; ``contact_law`` and ``scheme``: the law at the
contact nodes of a finite element body. See docs/theory/boundary_layer.md.
"""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "bilateral": ("bilateral_motion",),
    "contact_law": ("ContactLayer", "contact_layer"),
    "layer": ("Layer",),
    "metric": ("Metric",),
    "motion": ("ConstrainedSystem",),
    "particle": ("ParticleImpact", "layer_for"),
    "rigid_body": ("Ellipsoid", "RigidBody"),
    "scheme": ("BoundaryLayer",),
    "trajectory": ("layer_motion",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
