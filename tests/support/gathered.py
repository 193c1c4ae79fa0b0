"""Gather contact arrays: a rank holds those of its own conditions, and tests speak of all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from vi_contact.core.surfaces import ContactSurface


def gathered(surface: ContactSurface, found: Any) -> Any:
    """A state, an answer or a balance with the reactions and contact sets of all conditions.
    Collective."""
    arrays = {name: getattr(found, name, None) for name in ("r_n", "active", "r_t")}
    return replace(
        found, **{name: surface.everywhere(x) for name, x in arrays.items() if x is not None}
    )
