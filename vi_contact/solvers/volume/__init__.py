"""Solve the step in the volume, with PETSc's variational-inequality solvers: the whole u, no condensation."""
