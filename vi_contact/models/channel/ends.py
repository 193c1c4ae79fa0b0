"""Say what a model of the channel asks of what stands at the two ends of the layer."""

from collections.abc import Mapping
from typing import Any, Protocol


class Sides(Protocol):
    """Give the conditions at the layer's ends. ``firm``: they hold static loads; else see ``staged`` for gravity."""

    @property
    def firm(self) -> bool: ...

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of fem.assemble, for the groups of a ChannelMesh.

        ``motion``: displacement, velocity, acceleration of the bedrock as `Prescribed` takes them; empty in its frame.
        """
