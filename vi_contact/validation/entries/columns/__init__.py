"""Slide elastic columns under a record: numbers of SLAMMER."""
