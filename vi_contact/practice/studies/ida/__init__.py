"""Run incremental dynamic analyses: many records and scales of one case."""
