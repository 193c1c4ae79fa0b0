"""Bury a channel of reinforced concrete in soil, and shake it: the value, its contact problem and its sides.

``build`` makes the model of a ``Channel``; its ``problem(…)`` is marched. ``staged`` makes that of
its gravity stage, too, where sides or base hold no static load: ``fem.release`` goes from the one to the other.
"""

from .model import Channel, ChannelModel, Openings, SoilProbe, build, staged, weighted
from .sides import DashpotSides, Fixed, FreeFieldSides, RockBelow, Rollers, Sides, TiedSides, bedrock

__all__ = [
    "Channel", "ChannelModel", "DashpotSides", "Fixed", "FreeFieldSides", "Openings", "RockBelow", "Rollers",
    "Sides", "SoilProbe", "TiedSides", "bedrock", "build", "staged", "weighted",
]
