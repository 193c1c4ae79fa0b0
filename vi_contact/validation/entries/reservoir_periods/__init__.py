"""Shake a dam with a full reservoir: first periods of an independent program."""
