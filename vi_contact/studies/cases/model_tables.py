"""Models that a case file may name instead of mesh, material, system and contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from inspect import signature
from typing import Any, get_type_hints

from ...core.step import Recorder
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem
from ...models import wall
from ...models.channel import model as channel
from ...models.channel.sides import Sides
from ...run.recorders import Contact, Energy, Probe
from .table_calls import Callee


@dataclass(frozen=True)
class Parts:
    """What a problem is made of.

    tags: groups of the mesh; weighted: it carries its weight, and starts from its equilibrium; recorders: of a case
    that names none.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    tags: Any
    weighted: bool = False
    recorders: tuple[Recorder, ...] | None = None


def _wall(
    shape: wall.Wall, comm: Any, *, case: str = "b", weight: bool = False, base_inertia: str = "whole"
) -> Parts:
    model = wall.build(shape, comm, weight=weight, base_inertia=base_inertia)
    return Parts(model.system, model.surface(case), model.tags, weight, (Energy(), Contact(), Probe(model.probes())))


def _channel(
    shape: channel.Channel, comm: Any, *, sides: Sides | None = None, weighing: Sequence[str] = ("channel",),
    held: bool = False,
) -> Parts:
    model = channel.build(shape, comm, sides=sides, weighing=weighing)
    surface = model.surface.held() if held else model.surface
    return Parts(model.system, surface, model.tags, bool(weighing), tuple(model.recorders()))


def model(shape: type, build: Callable[..., Parts]) -> Callee:
    """The call of a model: keys are the fields of its shape and the keyword arguments of ``build(shape, comm, …)``."""
    own = {one.name for one in fields(shape)}
    parameters = signature(build).parameters.values()
    extra = {one.name for one in parameters if one.kind is one.KEYWORD_ONLY}
    hints = {key: hint for key, hint in get_type_hints(shape).items() if key in own}
    hints |= {key: hint for key, hint in get_type_hints(build).items() if key in extra}

    def made(comm: Any, **given: Any) -> Parts:
        of_shape = {key: value for key, value in given.items() if key in own}
        return build(shape(**of_shape), comm, **{key: value for key, value in given.items() if key in extra})

    return Callee(shape.__name__, made, hints, given=("comm",))


MODELS = {"Wall": model(wall.Wall, _wall), "Channel": model(channel.Channel, _channel)}
