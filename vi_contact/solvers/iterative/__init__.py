"""Solve the step in the volume by conjugate gradients, without any factor: one row of a mask is a contact condition."""
