"""Assemble bodies with finite elements on DOLFINx: meshes, systems, contact surfaces, output of fields."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "assembly": ("assemble",),
    "contact.joined": ("joined_surfaces",),
    "contact.matching": ("NodeToNode",),
    "contact.mortar": ("DualMortar",),
    "contact.pairs": ("contact_pair",),
    "contact.surface": ("contact_surface",),
    "dashpots": ("CompliantBase", "Dashpots"),
    "initial_stress": ("geometric_stiffness",),
    "loads": ("BodyForce", "Prescribed", "TangentialTraction", "Traction"),
    "mesh": ("Cells", "Facets", "Tags", "build_mesh", "node_numbers", "read_mesh"),
    "output.fields": ("XDMF",),
    "output.reactions": ("Reactions",),
    "output.section_forces": ("SectionForces",),
    "released_supports": ("release",),
    "ties": ("Tied",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
