"""Hold what a run leaves behind: histories, the final state and a summary in figures."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import import_module
from io import BytesIO
from pathlib import Path
from textwrap import shorten, wrap
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.protocols import Excitation
from ..core.step import Columns, State
from ..ground_motion.excitation import GroundMotion
from .files.table import LEDGER

CREATED = 0.01  # of the largest energy: more than schemes without a fault gain at sensible time steps


@dataclass(frozen=True)
class Solution:
    """Hold the result of ``simulate``.

    Attributes:
        history: column -> values, (rows,) or (rows, m) for arrays; row 0 is the initial state.
        columns: column -> (unit, meaning).
        state: the final state, in the rotated basis (``problem.cartesian`` turns it back).
        facts: what summary.json holds; the times of a step are medians in seconds, nan without steps.
        problem: what was solved, with the mass matrix that the scheme chose. folder: of the run, None without one.
    """

    history: Mapping[str, Array]
    columns: Columns
    state: State
    facts: Mapping[str, Any]
    problem: ContactProblem
    folder: Path | None = None

    def function(self, name: str, *, t: float | None = None, frame: int | None = None, continuous: bool = False) -> Any:
        """Return "u", "v", "stress" or "contact_pressure" as a DOLFINx Function, ``fem.as_function`` of the end state.

        With ``t`` [s] or ``frame`` that of a frame in the run folder, ``fem.read_function``. Collective.
        InputError for a system without a mesh, and without such a frame.
        """
        if not hasattr(self.problem.system.space, "V"):
            raise InputError("function: the system has no mesh, so there are no Functions; use history and state")
        from ..fem.output.functions import as_function, read_function  # late: runs need no finite elements

        if t is None and frame is None:
            return as_function(self.problem, self.state, name, continuous=continuous)
        if self.folder is None:
            raise InputError("function: the run kept no frames; give it out and fields=fem.XDMF(every=10)")
        return read_function(self.problem, self.folder, name, t=t, frame=frame, continuous=continuous)

    def summary(self) -> str:
        """Return the run in a few lines for people."""
        return "\n".join(f"  {name:<26} {value}" if name else value for name, value in _entries(self.facts))

    __repr__ = summary

    def plot(self) -> Any:
        """Return a matplotlib Figure of what was recorded: probes, contact force, energy ledger, certificates."""
        return import_module("vi_contact.plots").plot_overview(self)  # by name: on a floor above, and no run needs it

    def _repr_html_(self) -> str:
        """Return summary and figure for a notebook, without reference to anything outside."""
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" if name else
                       f'<tr><td colspan="2">{escape(value)}</td></tr>' for name, value in _entries(self.facts))
        image = BytesIO()
        self.plot().savefig(image, format="png", dpi=70)
        picture = b64encode(image.getvalue()).decode()
        return f'<table>{rows}</table><img alt="histories of the run" src="data:image/png;base64,{picture}">'


def energy_warning(facts: Mapping[str, Any]) -> str | None:
    """Return a sentence when the run had more energy than was put in, by more than CREATED of the largest energy."""
    if facts.get("energy_created", 0.0) <= CREATED:
        return None
    return (f"contact and time scheme created {100 * facts['energy_created']:.3g} % of the largest energy of the run: "
            "take a smaller dt (a wave should not cross more than two elements in a step), HalvedAtImpact, or a "
            "dissipative scheme such as ContactStabilisedNewmark() or HHT()")


def sampling_warning(excitations: Sequence[Excitation], dt: float) -> str | None:
    """Return a sentence when a time step [s] is longer than that of a record, whose peaks it then misses."""
    finest = min((one.record.dt for one in excitations if isinstance(one, GroundMotion)), default=dt)
    if dt <= finest * (1.0 + 1e-6):
        return None
    return (f"the time step of {dt:g} s is longer than the {finest:g} s of the record, whose peaks fall between the "
            "steps: take a shorter dt, or bring the record to it by resampled(record, dt), which takes out what dt "
            "cannot carry")


def _entries(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """(name, value) of every line of the summary; those without a name are whole lines."""
    iterations, warning, dt = facts["iterations_per_step"], energy_warning(facts), facts["dt"]
    length = f"({facts['base_steps']} base steps of {dt})" if isinstance(dt, str) else f"of {dt:g} s"
    lines = [
        ("", f"run {facts['status']}: {facts['steps']} steps {length}, "
             f"t = {facts['t_start']:g} to {facts['t_end']:g} s, on {facts['ranks']} rank(s)"),
        ("scheme", facts["scheme"]),
        ("mass matrix", facts["mass"]),
        ("solver", shorten(facts["solver"], 88, placeholder=" …")),
        ("unknowns, contact points", f"{facts['unknowns']}, {facts['contact_points']}"),
        ("iterations per step", f"{iterations['mean']:.2f} on average, {iterations['max']} at most"),
        ("worst certificate", f"{facts['worst_certificate']:.2e}"),
        ("escalated steps", str(facts["escalated_steps"])),
    ]
    if facts["halved_steps"]:
        lines.append(("halved steps", str(facts["halved_steps"])))
    if "steps_in_contact" in facts:
        uplift = f"largest uplift {facts['largest_uplift']:.3f}"
        lines.append(("steps in contact", f"{facts['steps_in_contact']}, {uplift}"))
        lines.append(("smallest gap", f"{facts['smallest_gap']:.3e} m"))
    for method, difference in (facts["cross_check"] or {}).items():
        values = ", ".join(f"{name} {value:.2e}" for name, value in difference.items())
        lines.append((f"cross-check {method}", values))
    if "energy" in facts:
        lines.append(("", "  energy ledger [J]"))
        lines.append(("  energy at the start", f"{facts['energy']['energy_start']: .6e}"))
        lines += [(f"  {title}", f"{facts['energy'][name]: .6e}") for name, title in LEDGER[:-1]]
        lines.append(("  defect, relative", f"{facts['energy_defect']: .2e}"))
    for one in filter(None, (warning, facts.get("sampling"))):
        told = wrap(f"WARNING: {one}", 110, initial_indent="  ", subsequent_indent="  ")
        lines += [("", text) for text in told]
    if np.isfinite(facts["seconds_per_step"]):
        mean, plain = facts["seconds_per_step"], facts["seconds_per_linear_step"]
        ratio = f", plain linear step {plain:.3e} s, ratio {mean / plain:.2f}" if np.isfinite(plain) else ""
        extra = " (with records, output and the cross-check)" if facts["cross_check"] else " (with records and output)"
        lines.append(("wall time per step", f"{mean:.3e} s{ratio}{extra}"))
    if facts["reason"]:
        lines.append(("reason", facts["reason"]))
    return lines
