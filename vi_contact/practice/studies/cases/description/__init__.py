"""Describe the model that a case file makes, before any step."""
