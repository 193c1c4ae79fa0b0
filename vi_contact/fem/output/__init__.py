"""Write fields of a run, and compute what its recorders need of elements.

This is the work of nodal forces, plane cuts and mean strains; the recorders themselves stand in
``run.recorders``.
"""
