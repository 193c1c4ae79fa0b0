"""Describe what stands at the two ends and at the bottom of the soil layer around a channel."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.checks import check_word
from vi_contact.core.errors import InputError
from vi_contact.core.protocols import Excitation
from vi_contact.fem.dashpots import CompliantBase, Dashpots
from vi_contact.fem.loads import Prescribed
from vi_contact.fem.ties import Tied
from vi_contact.laws.materials import LinearElastic
from vi_contact.soil.free_field import FreeField
from vi_contact.soil.moving_base import BaseMotion, base_motion
from vi_contact.soil.upgoing_wave import upgoing

ENDS = ("left_side", "right_side")


class Sides(Protocol):
    """Give the conditions at the layer's ends.

    ``firm``: they hold static loads; else see ``staged`` for gravity.
    """

    @property
    def firm(self) -> bool:
        """Tell whether the sides hold static loads."""

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the arguments of fem.assemble, for the groups of a ChannelMesh.

        ``motion``: displacement, velocity, acceleration of the bedrock as `Prescribed` takes them;
        empty in its frame.
        """


@dataclass(frozen=True)
class RockBelow:
    """Describe rock under the layer that lets waves through.

    There is its ``motion``, t [s] -> upgoing velocity (2,) [m/s] (``upgoing``), and its ``rock``,
    the soil above when None.
    """

    motion: Callable[[float], Array] = field(repr=False)
    rock: LinearElastic | None = None
    lets_waves_in: ClassVar[bool] = True

    def absorber(self, tags: Any) -> CompliantBase:
        """Return the boundary condition on the bedrock of a ChannelMesh."""
        return CompliantBase(tags["bedrock"], self.rock, motion=self.motion)


BASES = ("relative", "prescribed", "compliant")


def bedrock(
    base: str,
    excitations: Sequence[Excitation],
    *,
    dt: float | None,
    rock: LinearElastic | None = None,
) -> BaseMotion | RockBelow | None:
    """Return what moves the bottom of the layer, None where the motion is an inertia load.

    base: "relative", that load, in the frame of the bedrock; "prescribed", a moved bedrock: the
    same contact forces, and both expect the motion under the layer; "compliant", with ``rock`` (the
    soil's own material when None): takes the motion as that of an outcrop, and half its velocity
    comes up. dt: step of the run [s]; what is no record is integrated with a tenth of it.
    InputError for another word, and for rock without a compliant base.
    """
    check_word("base", base, BASES)
    if rock is not None and base != "compliant":
        raise InputError(
            "rock is what is under a compliant base: give base = 'compliant' too, or leave rock out"
        )
    if base == "relative":
        return None
    if base == "prescribed":
        return base_motion(excitations)
    step = None if dt is None else 0.1 * dt
    waves = [
        upgoing(one, dt=getattr(getattr(one, "record", None), "dt", step)) for one in excitations
    ]
    return RockBelow(lambda t: np.asarray(sum(wave(t) for wave in waves)), rock)


@dataclass(frozen=True)
class Rollers:
    """Hold the ends along one component, free along the other.

    Under horizontal shaking of a horizontal layer ends with component 1 held follow the free field
    exactly, under vertical shaking those with component 0 held.
    """

    firm: ClassVar[bool] = True
    component: int = 1

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions at the ends."""
        return {
            "prescribed": [
                Prescribed(tags[end], components=(self.component,), **motion) for end in ENDS
            ]
        }


@dataclass(frozen=True)
class Fixed:
    """Move the ends with the bedrock: a box."""

    firm: ClassVar[bool] = True

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions at the ends."""
        return {"prescribed": [Prescribed(tags[end], **motion) for end in ENDS]}


@dataclass(frozen=True)
class TiedSides:
    """Tie the ends to each other.

    The free field of horizontal layers is exact; waves leave at one end and come back.
    """

    firm: ClassVar[bool] = True

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions at the ends."""
        return {"tied": [Tied(tags["left_side"], tags["right_side"])]}


@dataclass(frozen=True)
class DashpotSides:
    """Put Lysmer and Kuhlemeyer's dashpots only.

    Waves leave, but the ends follow no free field (Kontoe 2007).
    """

    firm: ClassVar[bool] = False

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions at the ends."""
        return {"dashpots": [Dashpots(tags[end]) for end in ENDS]}


@dataclass(frozen=True)
class FreeFieldSides:
    """Put dashpots on the difference to the free field, and its stresses.

    They are exact for level ground; waves from the channel leave. ``base`` is that of the run, as
    ``soil.FreeField`` wants it.
    """

    firm: ClassVar[bool] = False
    base: Excitation | Sequence[Excitation] | BaseMotion | RockBelow = field(repr=False)

    def conditions(self, tags: Any, motion: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions at the ends."""
        base = self.base.absorber(tags) if isinstance(self.base, RockBelow) else self.base
        return {"dashpots": [FreeField(tags[end], base=base) for end in ENDS]}
