"""Bury a channel of reinforced concrete in soil, and shake it: the value, its contact problem and its sides.

``build`` makes the model of a ``Channel``; its ``problem(…)`` is marched. ``staged`` makes that of
its gravity stage, too, where sides or base hold no static load: ``fem.release`` goes from the one to the other.
"""

from ...core.lazy import lazy

_CONTENTS = {
    "ends": ("Sides",),
    "model": ("Channel", "ChannelModel", "Openings", "SoilProbe", "build", "staged", "weighted"),
    "sides": ("DashpotSides", "Fixed", "FreeFieldSides", "RockBelow", "Rollers", "TiedSides", "bedrock"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
