"""Weigh a gravity dam under water and uplift: a textbook example."""
