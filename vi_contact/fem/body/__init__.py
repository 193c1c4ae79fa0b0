"""Assemble bodies: unknowns, supports, materials, loads, and their M, C and K."""
