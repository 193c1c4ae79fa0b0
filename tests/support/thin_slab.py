"""A slab that is much thinner than its elements are long."""

from __future__ import annotations

from vi_contact.bem import BoundaryMesh, polygon

H = 0.125  # m, length of an element


def slab(width: float, h: float = H) -> BoundaryMesh:
    """Mesh a slab of height 1 m and this width [m], counterclockwise, with elements of length h."""
    return polygon([(-width / 2, -0.5), (width / 2, -0.5), (width / 2, 0.5), (-width / 2, 0.5)], h)
