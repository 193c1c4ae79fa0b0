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
from ..core.step import Columns, State
from .files.table import LEDGER

# Lines of the summary, in its four parts: name, text, and the fact without which the line is left
# out. A line without a name is a sentence.
LINES: Mapping[str, Sequence[tuple[str, ...]]] = {
    "run": (
        (
            "",
            (
                "run {status}: {steps} steps {length}, t = {t_start:g} to {t_end:g} s, on {ranks} "
                "rank{s}"
            ),
        ),
        ("scheme", "{scheme}"),
        ("mass matrix", "{mass}"),
        ("solver", "{solver}"),
        ("damping", "{damping}", "damping"),
        ("unknowns, contact points", "{unknowns}, {contact_points}"),
        (
            "iterations per step",
            "{iterations_per_step[mean]:.2f} on average, {iterations_per_step[max]} at most",
        ),
        ("worst certificate", "{worst_certificate:.2e}"),
        ("escalated steps", "{escalated_steps}"),
        ("halved steps", "{halved_steps}", "halved_steps"),
        (
            "steps in contact",
            "{steps_in_contact}, largest uplift {largest_uplift:.3f}",
            "steps_in_contact",
        ),
        ("smallest gap", "{smallest_gap:.3e} m", "steps_in_contact"),
        ("friction used, T/(mu N)", "{used}", "used"),
        ("closed points that slip", "{slid}", "slid"),
    ),
    "energy": (
        ("", "  energy ledger [J]", "energy"),
        ("  energy at the start", "{energy[energy_start]: .6e}", "energy"),
    ),
    "defect": (("  defect, relative", "{energy_defect: .2e}", "energy"),),
    "end": (
        (
            "wall time per step",
            "{seconds_per_step:.3e} s{ratio} (with records{and_output})",
            "ratio",
        ),
        ("reason", "{reason}", "reason"),
    ),
}
# Of the largest energy: more than schemes without a fault gain at sensible time steps.
CREATED = 0.01


@dataclass(frozen=True)
class Solution:
    """Hold the result of ``simulate``.

    Attributes:
        history: column -> values, (rows,) or (rows, m) for arrays; row 0 is the initial state.
        columns: column -> (unit, meaning).
        state: the final state in the basis of the nodal frames (``problem.cartesian`` turns it
            back).
        facts: the contents of summary.json; the times of a step are medians in seconds, nan without
            steps.
        problem: the solved problem, with the mass matrix that the scheme chose.
        folder: the run folder, or None.
    """

    history: Mapping[str, Array]
    columns: Columns
    state: State
    facts: Mapping[str, Any]
    problem: ContactProblem
    folder: Path | None = None

    def function(
        self,
        name: str,
        *,
        t: float | None = None,
        frame: int | None = None,
        continuous: bool = False,
    ) -> Any:
        """Return "u", "v", "stress", "contact_pressure", … as a DOLFINx Function. Collective.

        It is ``fem.as_function`` of the end state, or ``fem.read_function`` of a frame in the run
        folder.

        Args:
            name: which of them.
            t: the time of a frame [s].
            frame: its number. With neither of the two it is the end state.
            continuous: whether stress is averaged at the nodes, or constant in cells.

        Raises:
            InputError: the system has no mesh, or the run no such frame.
        """
        if not hasattr(self.problem.system.space, "V"):
            raise InputError(
                "function: the system has no mesh and so no Functions; use history and state"
            )
        # late: runs need no finite elements
        from ..fem.output.functions import as_function, read_function

        if t is None and frame is None:
            return as_function(self.problem, self.state, name, continuous=continuous)
        if self.folder is None:
            raise InputError(
                "function: the run kept no frames; run with out and fields=fem.XDMF(every=10)"
            )
        return read_function(
            self.problem, self.folder, name, t=t, frame=frame, continuous=continuous
        )

    def summary(self) -> str:
        """Return the run in a few lines for people."""
        lines = []
        for name, value in _entries(self.facts):
            lines.append(f"  {name:<26} {value}" if name else value)
        return "\n".join(lines)

    __repr__ = summary

    def plot(self) -> Any:
        """Return a matplotlib Figure of what was recorded.

        It shows probes, contact force, energy ledger and certificates.
        """
        # by name: on a floor above, and no run needs it
        return import_module("vi_contact.practice.plots").plot_overview(self)

    def _repr_html_(self) -> str:
        """Return summary and figure for a notebook, without reference to anything outside."""
        rows = ""
        for name, value in _entries(self.facts):
            if name:
                rows += f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>"
            else:
                rows += f'<tr><td colspan="2">{escape(value)}</td></tr>'
        image = BytesIO()
        self.plot().savefig(image, format="png", dpi=70)
        picture = b64encode(image.getvalue()).decode()
        return (
            f'<table>{rows}</table><img alt="histories of the run" '
            f'src="data:image/png;base64,{picture}">'
        )


def energy_warning(facts: Mapping[str, Any]) -> str | None:
    """Return a sentence when the run had more energy than was put in.

    It is so when the excess is more than CREATED of the largest energy.
    """
    if facts.get("energy_created", 0.0) <= CREATED:
        return None
    return (
        f"contact and time scheme created {100 * facts['energy_created']:.3g} % of the largest "
        "energy of the run: take a smaller dt (a wave should not cross more than two elements in a "
        "step) or, without impact law, ContactStabilisedNewmark(), which creates none; HHT() and "
        "HalvedAtImpact do not cure it"
    )


def _entries(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of every line of the summary; those without a name are whole lines."""
    words = _words_of(facts)
    entries = _lines("run", words)
    for method, difference in (facts["cross_check"] or {}).items():
        values = ", ".join(f"{name} {value:.2e}" for name, value in difference.items())
        entries.append((f"cross-check {method}", values))
    entries += _lines("energy", words)
    if "energy" in facts:
        for name, title in LEDGER.items():
            if name != "energy_defect":
                entries.append((f"  {title}", f"{facts['energy'][name]: .6e}"))
    entries += _lines("defect", words)
    for warning in filter(None, (energy_warning(facts), facts.get("sampling"))):
        text = f"WARNING: {warning}"
        for line in wrap(text, 110, initial_indent="  ", subsequent_indent="  "):
            entries.append(("", line))
    return entries + _lines("end", words)


def _words_of(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return what fills in the lines of the summary: the facts, some of them in words.

    A fact that is None leaves out the lines that need it.
    """
    dt = facts["dt"]
    length = (
        f"({facts['base_steps']} base steps of {dt})" if isinstance(dt, str) else f"of {dt:g} s"
    )
    mean = facts["seconds_per_step"]
    plain = facts["seconds_per_linear_step"]
    ratio = None
    if np.isfinite(mean):
        ratio = ""
        if np.isfinite(plain):
            ratio = f", plain linear step {plain:.3e} s, ratio {mean / plain:.2f}"
    return {
        **facts,
        "s": "s" if facts["ranks"] > 1 else "",
        "length": length,
        "solver": shorten(facts["solver"], 88, placeholder=" …"),
        "ratio": ratio,
        "and_output": ", output and the cross-check" if facts["cross_check"] else " and output",
        "halved_steps": facts["halved_steps"] or None,
        "reason": facts["reason"] or None,
        "used": _share_in_words(facts.get("friction_used")),
        "slid": _share_in_words(facts.get("slipping")),
    }


def _share_in_words(share: Mapping[str, float | None] | None) -> str | None:
    """Return the largest share of a run and the last one in words, None for none."""
    if share is None or share["largest"] is None:
        return None
    end = "open at the end" if share["end"] is None else f"{share['end']:.3f} at the end"
    return f"{share['largest']:.3f} at most, {end}"


def _lines(part: str, words: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of the lines of a part of ``LINES`` for which there are words."""
    lines = []
    for name, text, *needs in LINES[part]:
        if all(words.get(fact) is not None for fact in needs):
            lines.append((name, text.format_map(words)))
    return lines
