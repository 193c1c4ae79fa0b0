"""Write fields of a run, and compute what its recorders need of elements.

``fields`` and ``functions`` write and hand out fields; ``nodal_work``, ``plane_cuts``,
``cut_cells`` and ``cell_strains`` serve the recorders, which themselves stand in ``run.recorders``;
``outline`` measures and draws a model before it runs.
"""
