"""Compute rod and Timoshenko beam of Ahn (2012): contact and friction at the tip, with numpy and scipy only.

``run_beam`` follows the source; ``beam_problem`` makes a problem for any scheme and solver: docs/theory/beam.md.
>>> from vi_contact.beam import Elements, Rod, rod_forces
>>> rod_forces(Rod(end_force=lambda t: 2.0), Elements(10), dt=0.1, steps=2).forces  # N, pressed on the wall
(2.0, 2.0)
"""

from .algorithm import BeamRun, BeamStepper, Snapshot, run_beam
from .contract import StepForces, beam_problem, rod_forces, rod_problem, rubbing_problem
from .elements import Elements
from .tip import ExactFriction, RegularisedFriction, Slip, TipFriction
from .values import Rod, Start, TimoshenkoBeam

__all__ = [
    "BeamRun", "BeamStepper", "Elements", "ExactFriction", "RegularisedFriction", "Rod", "Slip", "Snapshot", "Start",
    "StepForces", "TimoshenkoBeam", "TipFriction", "beam_problem", "rod_forces", "rod_problem", "rubbing_problem",
    "run_beam",
]
