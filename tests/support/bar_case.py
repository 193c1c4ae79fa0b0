"""The case file of a bar beside a rigid wall, without its excitation, scheme and run."""

from __future__ import annotations

BAR = """
[mesh]
type = "WallMesh"
width = 2.0
height = 1.0
divisions = [4, 2]
[material.rubber]
E = 1e6
nu = 0.3
rho = 1000.0
[system]
clamped = "base"
[[contact]]
facets = "face"
obstacle = {type = "HalfSpace", point = [2.001, 0.0], normal = [-1.0, 0.0]}
"""
