"""Build the models that a case file may name instead of mesh, material, system and contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...core.protocols import Excitation
from ...core.step import Recorder
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem
from ...laws.materials import LinearElastic
from ...models import wall
from ...models.channel import model as channel
from ...models.channel.sides import FreeFieldSides, Sides, bedrock
from ...run.recorders import Contact, Energy, Probe
from .table_calls import Callee, callee


@dataclass(frozen=True)
class Parts:
    """Hold what a problem is made of.

    tags: groups of the mesh; weighted: it carries its weight, and starts from its equilibrium; recorders: of a case
    that names none; firm: the same body on supports that hold static loads, for the gravity stage, where its own do
    not; moved: the excitations move its boundary, and are no inertia load.
    """

    system: SemiDiscreteSystem
    surface: ContactSurface
    tags: Any
    weighted: bool = False
    recorders: tuple[Recorder, ...] | None = None
    firm: Parts | None = None
    moved: bool = False


def _wall(
    shape: wall.Wall, comm: Any, *, case: str = "b", weight: bool = False, base_inertia: str = "whole"
) -> Parts:
    model = wall.build(shape, comm, weight=weight, base_inertia=base_inertia)
    return Parts(model.system, model.surface(case), model.tags, weight, (Energy(), Contact(), Probe(model.probes())))


def _channel(
    shape: channel.Channel, comm: Any, *, excitations: tuple[Excitation, ...], run_dt: float | None,
    sides: Sides | None = None, weighing: Sequence[str] = ("channel",), held: bool = False, base: str = "relative",
    rock: LinearElastic | None = None,
) -> Parts:
    bottom = bedrock(base, excitations, dt=run_dt, rock=rock)
    ends = replace(sides, base=bottom or excitations) if isinstance(sides, FreeFieldSides) else sides

    def parts(model: channel.ChannelModel, firm: Parts | None = None) -> Parts:
        surface = model.surface.bilateral_everywhere() if held else model.surface
        return Parts(model.system, surface, model.tags, bool(weighing), model.recorders(), firm, bottom is not None)

    model, firm = channel.staged(shape, comm, sides=ends, weighing=weighing, base=bottom)
    return parts(model, None if firm is None else parts(firm))


def model(shape: type, build: Callable[..., Parts], inner: str = "") -> Callee:
    """Return the call of a model: its keys are the fields of its shape, and what ``build`` takes by keyword.

    inner: a field of the shape whose own fields are keys, too.
    """
    of_shape, target = callee(shape).hints, callee(build)
    of_inner = callee(of_shape[inner]).hints if inner else {}
    extra = {key: hint for key, hint in target.hints.items() if key != "shape"}

    def made(**values: Any) -> Parts:
        own, parts, more = ({key: values[key] for key in names if key in values}
                            for names in (of_shape, of_inner, (*extra, *target.given)))
        if parts:
            own[inner] = replace(own[inner], **parts) if inner in own else of_shape[inner](**parts)
        return build(shape(**own), **more)

    return Callee(shape.__name__, made, {**of_inner, **of_shape, **extra}, given=target.given)


MODELS = {"Wall": model(wall.Wall, _wall), "Channel": model(channel.Channel, _channel, inner="shape")}
