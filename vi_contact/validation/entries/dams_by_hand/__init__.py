"""Weigh two more gravity dams, whose calculation by hand stands beside them."""
