"""Compute rod and Timoshenko beam of Ahn (2012).

There are contact and friction at the tip, with numpy and scipy only.

``run_beam`` follows the source; demos/beam/contract.py makes of both problems for any scheme and
solver: docs/theory/beam.md.
>>> from demos.beam import Elements
>>> Elements(4).nodes(2.0)  # m, of those that move: the clamped end does not
array([0.5, 1. , 1.5, 2. ])
"""

from .algorithm import BeamRun, BeamStepper, Snapshot, run_beam
from .elements import Elements
from .tip import ExactFriction, RegularisedFriction, Slip, TipFriction
from .values import Rod, Start, TimoshenkoBeam

__all__ = [
    "BeamRun",
    "BeamStepper",
    "Elements",
    "ExactFriction",
    "RegularisedFriction",
    "Rod",
    "Slip",
    "Snapshot",
    "Start",
    "TimoshenkoBeam",
    "TipFriction",
    "run_beam",
]
