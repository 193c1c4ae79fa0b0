"""Slide rigid blocks by records: 90 numbers of SLAMMER."""
