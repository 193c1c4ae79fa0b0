"""Say what a model of the channel asks of what stands at the two ends of the layer."""

from collections.abc import Mapping
from typing import Any, Protocol


class Sides(Protocol):
    """Give the conditions at the ends of the layer. ``firm``: whether they hold static loads; others need a gravity
    stage on firm ones (``staged``)."""

    @property
    def firm(self) -> bool: ...

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of fem.assemble, for the groups of a ChannelMesh.

        ``motion``: displacement, velocity, acceleration of the bedrock as `Prescribed` takes them; empty in its frame.
        """
