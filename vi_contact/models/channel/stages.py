"""Bring the buried channel to rest under its weight, whatever its boundaries, and go on to the shaking."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...core.problem import ContactProblem
from ...core.step import Solver, State
from ...fem.released_supports import release
from ...run.static import static_equilibrium
from ...soil.moving_base import BaseMotion
from ...solvers.condensed import Condensed
from .model import Channel, ChannelModel, build
from .sides import RockBelow, Rollers, Sides


@dataclass(frozen=True)
class AtRest:
    """Hold the model, its problem and the state from which to shake it; None where nothing weighs: from zero."""

    model: ChannelModel
    problem: ContactProblem
    start: State | None


def at_rest(
    channel: Channel,
    comm: Any,
    *,
    sides: Sides | None = None,
    weighing: Sequence[str] = ("channel",),
    base: BaseMotion | RockBelow | None = None,
    solver: Solver | None = None,
    **contact: Any,
) -> AtRest:
    """Build the channel and bring it to rest with contact active; collective.

    Ends or a bottom that hold no static load come after the gravity stage, which has rollers and a firm bedrock in
    their places: what these carried goes on as forces (``fem.release``).

    Args:
        sides, weighing, base: as in ``build``.
        solver: of the gravity stage, Condensed() when None.
        contact: arguments of ``ChannelModel.problem``.
    """
    solver = solver or Condensed()
    model, firm = staged(channel, comm, sides=sides, weighing=weighing, base=base)
    problem = model.problem(**contact)
    if not weighing:
        return AtRest(model, problem, None)
    if firm is None:
        return AtRest(model, problem, static_equilibrium(problem, solver=solver))
    static = firm.problem(**(contact | {"excitation": ()}))
    return AtRest(model, *release(static, static_equilibrium(static, solver=solver), problem))


def staged(
    channel: Channel, comm: Any, *, sides: Sides | None, weighing: Sequence[str], base: BaseMotion | RockBelow | None
) -> tuple[ChannelModel, ChannelModel | None]:
    """Return the model, and on its mesh the one for its gravity stage where its own supports hold no static load."""
    ends = sides or Rollers()
    if ends.firm and (base is None or not base.lets_waves_in):
        return build(channel, comm, sides=ends, weighing=weighing, base=base), None
    firm = build(channel, comm, sides=ends if ends.firm else None, weighing=weighing)
    return build(channel, comm, sides=ends, weighing=weighing, base=base, meshed=(firm.mesh, firm.tags)), firm
