"""Seed 001: contact in a thin layer before the boundary of the configuration space, by b-geometry.

layer.py: the boundary force (25) and its cut-off; particle.py: the closed form (36) to (38); metric.py: b-metric and
b-affinities (8) to (21); motion.py: equations (26) to (28) of any system as ordinary differential equations;
trajectory.py integrates them; rigid_body.py: the second example; bilateral.py: equality constraints (29) to (34);
contact_law.py, scheme.py: the law at the contact nodes of a finite element body. docs/boundary_layer.md.
"""
