"""Bury a channel of reinforced concrete in soil, and shake it: the value, its contact problem, sides and stages.

``build`` makes the model of a ``Channel``; its ``problem(…)`` is marched. ``at_rest`` does so after the gravity stage.
"""

from .model import Channel, ChannelModel, build, weighted
from .points import Openings, SoilProbe
from .sides import DashpotSides, Fixed, FreeFieldSides, RockBelow, Rollers, Sides, TiedSides
from .stages import AtRest, at_rest

__all__ = [
    "AtRest", "Channel", "ChannelModel", "DashpotSides", "Fixed", "FreeFieldSides", "Openings", "RockBelow", "Rollers",
    "Sides", "SoilProbe", "TiedSides", "at_rest", "build", "weighted",
]
