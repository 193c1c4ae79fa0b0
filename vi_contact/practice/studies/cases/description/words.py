"""Say in lines of text what ``describe`` found."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class _Part:
    """Say a part of the description of a model.

    Attributes:
        text: filled in with the model, or with each entry of its list ``key``.
        key: a list of the model, None for the model itself.
        heading: the line before the first entry of the list.
        needs: a key without which the model, or an entry, is left out; "" for none.
        without: a key with which it is left out; "" for none.
    """

    text: str
    key: str | None = None
    heading: str = ""
    needs: str = ""
    without: str = ""

    def fits(self, entry: Mapping[str, Any]) -> bool:
        """Say whether the part is about such an entry."""
        return (not self.needs or self.needs in entry) and self.without not in entry


# What the description of a model says, line by line.
PARTS = (
    _Part(
        needs="degree",
        text="{title}\n{dimension}D, {unknowns} unknowns of degree {degree}, {mass:.4g} kg",
    ),
    _Part(without="degree", text="{title}\n{dimension}D, {unknowns} unknown, {mass:.4g} kg"),
    _Part(key="groups", heading="groups of the mesh:", text="  {name} ({kind})"),
    _Part(
        key="bodies",
        needs="cells",
        heading="bodies:",
        text="  {name}: {cells} cells, {mass:.4g} kg; {material}",
    ),
    _Part(
        key="bodies",
        without="cells",
        heading="bodies:",
        text="  {name}: {mass:.4g} kg, {material}",
    ),
    _Part(key="supports", heading="supports:", text="  {groups}: {kind} along {components}"),
    _Part(
        key="contact",
        needs="size",
        heading="contact:",
        text="  {name}: {points} points on {size:.4g} m²; {friction}",
    ),
    _Part(
        key="contact",
        needs="gap",
        heading="contact:",
        text="  {name}: one point, {gap:.4g} m before the wall; {friction}",
    ),
    _Part(
        key="layers",
        heading="layer before the obstacle:",
        text="  {width:.4g} m wide, passed in b/V = {passage:.4g} s at {speed:.4g} m/s",
    ),
    _Part(key="contact", needs="size", heading="contact nodes:", text="  {name}: {nodes}"),
    _Part(
        key="waves",
        heading="shear waves:",
        text=(
            "  {body}: {c_s:.4g} m/s; edges of {h:.3g} m, 8 edges in a wave length up to "
            "{f_max:.3g} Hz; a wave passes {dt_ratio:.3g} edges in a step"
        ),
    ),
    _Part(
        key="records",
        heading="records:",
        text=(
            "  {file}, scaled by {scale:g}: peak {pga:.3g} m/s², {duration:.4g} s in steps "
            "of {dt:.4g} s, 95 % of its energy below {f_95:.3g} Hz"
        ),
    ),
    _Part(
        needs="periods",
        text=(
            "natural periods, contact closed where it touches at the start: {periods} "
            "s\nrigid motions that are left: {rigid_motions}"
        ),
    ),
    _Part(text="damping: {damping}"),
    _Part(text="run: {run[steps]} steps of {run[dt]:.4g} s, {run[t_end]:.4g} s"),
)


def put_in_words(model: Mapping[str, Any]) -> str:
    """Return what ``describe`` found, as lines of text."""
    lines = []
    for part in PARTS:
        entries = [model] if part.key is None else model[part.key]
        entries = [entry for entry in entries if part.fits(entry)]
        if entries and part.heading:
            lines.append(part.heading)
        for entry in entries:
            words = {key: _put_in_word(value) for key, value in entry.items()}
            lines.append(part.text.format(**words))
    return "\n".join([*lines, *(f"warning: {warning}" for warning in model["warnings"])])


def _put_in_word(value: Any) -> Any:
    """Return lists and materials as texts, all else as it is."""
    if isinstance(value, Mapping) and "type" in value:
        value = [f"{key} {number:.4g}" for key, number in value.items() if key != "type"]
    if not isinstance(value, list):
        return value
    entries = [f"{entry:.4g}" if isinstance(entry, float) else str(entry) for entry in value]
    return ", ".join(entries)
