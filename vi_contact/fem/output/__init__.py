"""Write fields of a run, and resultants that need elements.

These are reactions, section forces, nodal work.
"""
