"""One run of the buried channel, from options to an output folder with histories, fields and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.checks import check_word
from ...core.errors import InputError
from ...core.protocols import Excitation
from ...fem.output.fields import XDMF
from ...laws.friction import Coulomb
from ...laws.impact import Inelastic, MassProjection
from ...laws.materials import LinearElastic
from ...plots.histories import plot_certificate, plot_contact, plot_energy, plot_excitation, plot_points
from ...run.simulate import Solution, simulate
from ...soil.moving_base import BaseMotion, base_motion
from ...soil.upgoing_wave import upgoing
from ...solvers.volume.route import Volume
from ...solvers.volume.snes import ReducedNewton
from ..choices import SCHEMES, SOLVERS
from ..run_options import RunOptions, check_options, excitations, number_of_steps, records, solvers
from .model import Channel, ChannelModel
from .sides import DashpotSides, Fixed, FreeFieldSides, RockBelow, Rollers, Sides, TiedSides
from .stages import AtRest, at_rest

CONTACTS = {
    "sliding": "Buried channel, unilateral contact, free sliding",
    "coulomb": "Buried channel, unilateral contact, Coulomb friction",
    "bilateral": "Buried channel, bilateral contact, free sliding",
}
SIDES: dict[str, Sides] = {
    "rollers": Rollers(), "vertical-rollers": Rollers(component=0), "tied": TiedSides(), "fixed": Fixed(),
    "dashpots": DashpotSides(),
}  # fmt: skip
FREE_FIELD = "free-field"
GRAVITY: dict[str, tuple[str, ...]] = {"channel": ("channel",), "all": ("channel", "soil"), "none": ()}
BASES = ("relative", "prescribed", "compliant")
REFERENCE = Volume(method=ReducedNewton(), petsc_options={"snes_linesearch_type": "l2"})
"""The volume route to compare with and to fall back on. Without a line search its active set runs in circles in some
steps of the channel: M/dt² of a consistent mass couples neighbours with the sign that sets need to settle reversed."""


@dataclass(frozen=True)
class ChannelRun(RunOptions):
    """Options of a run. ``motion``: a record file; without one the harmonic of Fig. 7 shakes the bedrock for 400 steps.

    contact: one of CONTACTS; ``mu`` with "coulomb". gravity: which bodies weigh, of GRAVITY; a static stage with
    contact active comes first. sides: of SIDES, or "free-field"; None is "rollers", with a vertical record "tied".
    base: "relative", an inertia load in the frame of the bedrock, or "prescribed", a moved bedrock: the same contact
    forces, both expect the motion of the bedrock under the layer (within); "compliant", with ``rock`` (the soil's own
    material when None): takes the motion as that of an outcrop, and half its velocity comes up.
    scheme: "zwt" with the inelastic rule as an M-orthogonal impulse takes energy out at every dt, never in; the stiff
    channel's own waves are far from resolved at the dt of ground motions. ``impact`` None: that rule for schemes that
    the source could have used, none for the others.
    """

    contact: str = "sliding"
    mu: float | None = None
    channel: Channel = field(default_factory=Channel)
    base: str = "relative"
    rock: LinearElastic | None = None
    sides: str | None = None
    gravity: str = "channel"

    def __post_init__(self) -> None:
        check_word("contact", self.contact, list(CONTACTS))
        check_word("base", self.base, BASES)
        check_word("gravity", self.gravity, list(GRAVITY))
        if self.sides is not None:
            check_word("sides", self.sides, [*SIDES, FREE_FIELD])
        check_options(self)
        if (self.contact == "coulomb") != (self.mu is not None):
            raise InputError("contact 'coulomb' needs its friction coefficient mu, the other contacts take none")
        if self.rock is not None and self.base != "compliant":
            raise InputError("rock is what is under a compliant base: give base='compliant' too, or leave rock out")


def run_channel(run: ChannelRun, comm: Any, out: str | Path, *, progress: bool = True) -> Solution:
    """Builds the channel, marches, and writes the run folder ``out``; the solution's summary is for printing."""
    ready = prepared(run, comm)
    solver, checked = solvers(run, reference=REFERENCE)
    solution = simulate(
        ready.problem,
        scheme=SCHEMES[run.scheme].scheme,
        solver=solver,
        dt=ready.dt,
        steps=ready.steps,
        record=ready.model.recorders(),
        fields=XDMF(every=run.fields_every) if run.fields_every else None,
        out=out,
        state=ready.start,
        escalation=(REFERENCE, SOLVERS["hildreth"]),
        cross_check=checked,
        restart=run.restart,
        changed=run.changed,
        progress=progress,
    )
    if comm.rank == 0:
        draw(solution.history, ready.model, Path(out), title=CONTACTS[run.contact])
    comm.Barrier()
    return solution


@dataclass(frozen=True)
class Prepared(AtRest):
    """What a run marches: model, problem, first state, time step [s] and number of steps."""

    dt: float
    steps: int


def prepared(run: ChannelRun, comm: Any) -> Prepared:
    """Model, problem and gravity stage of a run; collective. InputError for records that cannot be read."""
    shaking = excitations(records(run), lambda: run.channel.harmonic(2.0 * run.scale))
    dt = run.dt if run.dt is not None else run.channel.time_step()
    choice = SCHEMES[run.scheme]
    impact = run.impact
    if impact is None:
        impact = Inelastic(MassProjection()) if isinstance(choice.impact, Inelastic) else choice.impact
    base = _base(run, shaking, dt)
    rest = at_rest(
        run.channel, comm, sides=_sides(run, base or shaking), weighing=GRAVITY[run.gravity],
        base=base, solver=SOLVERS[run.solver],
        friction=None if run.mu is None else Coulomb(run.mu), bilateral=run.contact == "bilateral",
        excitation=shaking if base is None else (), impact=impact, mass=choice.mass,
    )  # fmt: skip
    return Prepared(rest.model, rest.problem, rest.start, dt, number_of_steps(run, dt, shaking))


def _base(run: ChannelRun, shaking: Sequence[Excitation], dt: float) -> BaseMotion | RockBelow | None:
    """What moves the bottom of the layer, if not an inertia load."""
    if run.base == "relative":
        return None
    if run.base == "prescribed":
        return base_motion(shaking)
    waves = [upgoing(one, dt=getattr(getattr(one, "record", None), "dt", 0.1 * dt)) for one in shaking]
    return RockBelow(lambda t: np.asarray(sum(wave(t) for wave in waves)), run.rock)


def _sides(run: ChannelRun, base: Any) -> Sides:
    name = run.sides or ("rollers" if run.vertical is None else "tied")
    return SIDES.get(name) or FreeFieldSides(base)


def draw(history: Mapping[str, Array], model: ChannelModel, out: Path, *, title: str) -> None:
    """The figures of a run: ground motion, displacements of the channel's points, energy, certificate, contact."""
    labels = list(model.channel.probes())
    plot_excitation(history, out / "excitation.png")
    for component in "xy":
        path = out / f"displacements_{component}.png"
        plot_points(history, labels, path, title=title, component=component, unilateral=None)
    plot_energy(history, out / "energy.png")
    plot_certificate(history, out / "certificate.png")
    label = "arc length, left wall, base, right wall [m]"
    plot_contact(history, out / "contact.png", position=model.arc, axis_label=label)
