"""Exact solutions: closed forms that tests, demos and users compare a computation with. numpy and scipy only."""
