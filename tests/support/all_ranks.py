"""See the contact conditions of all ranks, the same on every rank."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vi_contact.core.surfaces import ContactSurface

ARRAYS = ("points", "normals", "weights", "gap0", "bilateral", "compliance", "nodes")


class Seen:
    """A surface whose arrays and values are those of all conditions, by their numbers. Every use is
    collective."""

    def __init__(self, surface: ContactSurface) -> None:
        self._surface = surface

    def __getattr__(self, name: str) -> Any:
        surface = self._surface
        found = surface.total if name == "count" else getattr(surface, name)
        if name in ARRAYS:
            return surface.everywhere(found)
        if name in ("normal_values", "tangential_values", "gap", "sliding", "slip"):
            return lambda *given: self.all(found(*given))
        return found

    @property
    def corners(self) -> list[Any]:
        """The conditions of each node that has several, in the order of the nodes."""
        nodes = self.nodes
        groups = [np.flatnonzero(nodes == node) for node in np.unique(nodes)]
        return [group for group in groups if len(group) > 1]

    def all(self, values: NDArray[Any] | None) -> Any:
        """The values of all conditions."""
        return None if values is None else self._surface.everywhere(values)

    def reaction_load(self, r_n: Any, rows: int, r_t: Any = None) -> Any:
        """The owned part of reactions given for all conditions."""
        mine = self._surface.slots
        return self._surface.reaction_load(r_n[mine], rows, None if r_t is None else r_t[mine])


def seen(surface: ContactSurface) -> Any:
    """A look at the conditions of all ranks."""
    return Seen(surface)
