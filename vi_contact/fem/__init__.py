"""Finite elements on DOLFINx. Names are imported when first used: `import vi_contact` needs no such library."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "read_mesh": "mesh", "build_mesh": "mesh", "node_numbers": "mesh",
    "Cells": "mesh", "Facets": "mesh", "Tags": "mesh",
    "assemble": "assembly",
    "BodyForce": "loads", "Prescribed": "loads", "TangentialTraction": "loads", "Traction": "loads",
    "Tied": "ties", "Dashpots": "dashpots", "CompliantBase": "dashpots",
    "contact_surface": "contact.surface",
    "contact_pair": "contact.pairs", "NodeToNode": "contact.matching", "DualMortar": "contact.mortar",
    "together": "contact.joined",
    "geometric_stiffness": "initial_stress", "release": "released_supports",
    "XDMF": "output.fields",
    "Reactions": "output.reactions", "SectionForces": "output.section_forces",
}
"""Public name -> module of this folder it lives in."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
