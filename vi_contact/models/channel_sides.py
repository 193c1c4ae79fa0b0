"""What holds the two ends of the soil layer beside a channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from ..fem.loads import Prescribed
from ..fem.ties import Tied

ENDS = ("left_side", "right_side")


class Sides(Protocol):
    """Conditions at the ends of the layer."""

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Arguments of fem.assemble, for the groups of a ChannelMesh.

        ``motion``: displacement, velocity and acceleration of the bedrock as `Prescribed` takes them; empty in the
        frame of the bedrock.
        """
        ...


@dataclass(frozen=True)
class Rollers:
    """Held along one component, free along the other. Under horizontal shaking of a horizontal layer ends that move
    horizontally only (component 1 held) follow the free field exactly; under vertical shaking those with component 0
    held do."""

    component: int = 1

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        return {"prescribed": [Prescribed(tags[end], components=(self.component,), **motion) for end in ENDS]}


@dataclass(frozen=True)
class Fixed:
    """The ends move with the bedrock: a box."""

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        return {"prescribed": [Prescribed(tags[end], **motion) for end in ENDS]}


@dataclass(frozen=True)
class TiedSides:
    """Both ends move together in both directions: the exact free field of horizontal layers under horizontal and
    vertical shaking; what leaves at one end comes back at the other."""

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        return {"tied": [Tied(tags["left_side"], tags["right_side"])]}
