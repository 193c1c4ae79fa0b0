"""Hold what a run leaves behind: histories, the final state and a summary in figures."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from pathlib import Path
from textwrap import shorten, wrap
from typing import Any, NamedTuple

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.html import make_table
from ..core.problem import ContactProblem
from ..core.step import Columns, State
from .files.table import LEDGER

CREATED = 0.01  # of the largest energy: more than schemes without a fault gain at sensible steps


class Line(NamedTuple):
    """Hold a line of the summary.

    Attributes:
        name: what stands before the value; a line without a name is a sentence.
        text: the value, with the facts in braces.
        needs: the fact without which the line is left out, "" where it always stands.
    """

    name: str
    text: str
    needs: str = ""


# The summary in its four parts. Lines of cross-checks stand after the first, those of the ledger
# after the second, warnings after the third.
RUN = (
    Line(
        "",
        "run {status}: {steps} steps {length}, t = {t_start:g} to {t_end:g} s, on {ranks} rank{s}",
    ),
    Line("scheme", "{scheme}"),
    Line("mass matrix", "{mass}"),
    Line("solver", "{solver}"),
    Line("damping", "{damping}", "damping"),
    Line("unknowns, contact points", "{unknowns}, {contact_points}"),
    Line(
        "iterations per step",
        "{iterations_per_step[mean]:.2f} on average, {iterations_per_step[max]} at most",
    ),
    Line("worst certificate", "{worst_certificate:.2e}"),
    Line("escalated steps", "{escalated_steps}"),
    Line("halved steps", "{halved_steps}", "halved_steps"),
    Line(
        "steps in contact",
        "{steps_in_contact}, largest open share {largest_uplift:.3f}",
        "steps_in_contact",
    ),
    Line("smallest gap", "{smallest_gap:.3e} m", "steps_in_contact"),
    Line("friction used, T/(mu N)", "{used}", "used"),
    Line("closed points that slip", "{slid}", "slid"),
)
# The summary of a run without steps.
STATE = (
    Line("", "state at t = {t_end:g} s, without a step, on {ranks} rank{s}"),
    Line("solver", "{solver}"),
    Line("unknowns, contact points", "{unknowns}, {contact_points}"),
    Line("closed points", "{closed_points} of {contact_points}", "closed_points"),
    Line("largest opening", "{largest_opening:.3e} m", "closed_points"),
    Line("certificate", "{worst_certificate:.2e}", "certified"),
    Line("friction used, T/(mu N)", "{used}", "used"),
    Line("strain energy", "{energy[energy_strain]:.6e} J", "energy"),
    Line("reason", "{reason}", "reason"),
)
ENERGY = (
    Line("", "  energy ledger [J]", "energy"),
    Line("  energy at the start", "{energy[energy_start]: .6e}", "energy"),
)
DEFECT = (Line("  defect, relative", "{energy_defect: .2e}", "energy"),)
END = (
    Line(
        "wall time per step",
        "{seconds_per_step:.3e} s{ratio} (with records{and_output})",
        "ratio",
    ),
    Line("reason", "{reason}", "reason"),
)


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

    def to_xarray(self) -> Any:
        """Return the histories as an xarray Dataset with units and long names. Collective.

        The coordinate ``t`` [s] names the rows. Arrays of contact points have the dimension
        ``point``, whose coordinates are x, y, z [m], normals, weights and initial gaps. They are
        those of rank 0, as in ``history``.

        >>> ds = solution.to_xarray()  # doctest: +SKIP
        >>> ds.u_x_top.sel(t=0.1, method="nearest"), ds.pressure.max("t")  # doctest: +SKIP

        Raises:
            InputError: xarray is not installed.
        """
        # late: only who asks needs it
        from .dataset import make_dataset
        from .files.reading import ContactGeometry

        surface = self.problem.surface
        names = ("points", "normals", "weights", "gap0", "bilateral")
        contact = ContactGeometry(*(surface.on_first(getattr(surface, name)) for name in names))
        return make_dataset(self.history, self.columns, self.facts, contact)

    def summary(self) -> str:
        """Return the run in a few lines for people."""
        lines = []
        for name, value in _list_entries(self.facts):
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
        """Return summary and figure for a notebook, which calls this by its name.

        The figure is in the text, so that it refers to nothing outside.
        """
        image = BytesIO()
        self.plot().savefig(image, format="png", dpi=70)
        picture = b64encode(image.getvalue()).decode()
        return (
            f'{make_table(_list_entries(self.facts))}<img alt="histories of the run" '
            f'src="data:image/png;base64,{picture}">'
        )


def energy_warning(facts: Mapping[str, Any]) -> str | None:
    """Return a sentence when the run had more energy than was put in; None when it had not.

    It had when the excess, ``energy_created`` of the facts, is above CREATED.
    """
    if facts.get("energy_created", 0.0) <= CREATED:
        return None
    return (
        f"contact and time scheme created {100 * facts['energy_created']:.3g} % of the largest "
        "energy of the run: take a smaller dt (a wave should not cross more than two elements in a "
        "step) or, without impact law, ContactStabilisedNewmark(), which creates none; HHT() and "
        "HalvedAtImpact do not cure it"
    )


def _list_entries(facts: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of every line of the summary; those without a name are whole lines."""
    words = _put_in_words(facts)
    if facts["steps"] == 0:
        return _fill_in(STATE, words)
    entries = _fill_in(RUN, words)
    for method, difference in (facts["cross_check"] or {}).items():
        values = ", ".join(f"{name} {value:.2e}" for name, value in difference.items())
        entries.append((f"cross-check {method}", values))
    entries += _fill_in(ENERGY, words)
    if "energy" in facts:
        for name, title in LEDGER.items():
            if name in facts["energy"] and name != "energy_defect":
                entries.append((f"  {title}", f"{facts['energy'][name]: .6e}"))
    entries += _fill_in(DEFECT, words)
    told = (energy_warning(facts), facts.get("sampling"), facts.get("joint_elements"))
    for warning in filter(None, told):
        text = f"WARNING: {warning}"
        for line in wrap(text, 110, initial_indent="  ", subsequent_indent="  "):
            entries.append(("", line))
    return entries + _fill_in(END, words)


def _put_in_words(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return what fills in the lines of the summary: the facts, some of them in words.

    A fact that is None leaves out the lines that need it.
    """
    # A constant time step is a number in the facts, a plan of steps a text.
    dt = facts["dt"]
    length = f"({facts['base_steps']} base steps of {dt})"
    if not isinstance(dt, str):
        length = f"of {dt:g} s"

    # The time of a step, and of a linear one with the same matrix: nan where they were not taken.
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
        "certified": facts["worst_certificate"] or None,  # a state that nobody solved for has none
        "used": _put_share_in_words(facts.get("friction_used")),
        "slid": _put_share_in_words(facts.get("slipping")),
    }


def _put_share_in_words(share: Mapping[str, float | None] | None) -> str | None:
    """Return the largest share of a run and the last one in words, None for none."""
    if share is None or share["largest"] is None:
        return None
    end = "open at the end" if share["end"] is None else f"{share['end']:.3f} at the end"
    return f"{share['largest']:.3f} at most, {end}"


def _fill_in(lines: Sequence[Line], words: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of the lines for which there are words."""
    entries = []
    for line in lines:
        if not line.needs or words.get(line.needs) is not None:
            entries.append((line.name, line.text.format_map(words)))
    return entries
