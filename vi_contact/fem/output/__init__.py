"""Write fields of a run, and resultants that need elements: reactions, section forces, nodal
work.
"""
