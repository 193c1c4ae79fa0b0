"""Make contact surfaces: facets to conditions, nodal frames, pairs of bodies."""
