"""Model contact in a thin layer before the obstacle, as a smooth force: b-geometry.

Begin with ``layer`` (force, cut-off) and ``particle`` (closed form). ``motion`` and ``trajectory`` take any constrained
system, such as the rigid bodies of demos/problems/rigid_body.py; ``metric``: b-metric and b-affinities;
demos/problems/layer_law.py and layer_scheme.py: contact nodes of finite element bodies. docs/theory/boundary_layer.md.
>>> from vi_contact.boundary_layer import ParticleImpact, layer_for
>>> round(ParticleImpact(layer_for(0.5, mass=1.0, speed=2.0, width=1e-3), mass=1.0, speed=2.0).restitution, 9)
0.5
"""

from ..core.lazy import lazy

_CONTENTS = {
    "layer": ("Layer",),
    "metric": ("Metric",),
    "motion": ("ConstrainedSystem",),
    "particle": ("ParticleImpact", "layer_for"),
    "trajectory": ("layer_motion",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
